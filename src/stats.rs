//! Counters of a relay. Remote faults are counted here; they never cause an error or a panic.

/// Counters since start-up; each saturates at its maximum.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stats {
    /// Frames passed to the link, including retransmissions.
    pub sent: u32,
    /// Retransmissions of round messages (sweeps, gatherings, tokens) and proposals after a missing reply.
    pub repeats: u32,
    /// Passes of any kind, and proposals, that this relay has started as the leader.
    pub passes_begun: u32,
    /// Messages received from a neighbour with values in range. Some are also counted below, for example as stale.
    pub received: u32,
    /// Duplicate passes and proposals, to which the reply is sent again.
    pub repeated: u32,
    /// Intact frames between other nodes of the network, received on a shared channel.
    pub overheard: u32,
    /// Frames longer than the format allows.
    pub oversized: u32,
    /// Truncated frames.
    pub truncated: u32,
    /// Frames with a CRC mismatch.
    pub crc: u32,
    /// Intact frames of another version of the format.
    pub version: u32,
    /// Handshake frames with the right tag; they have no effect beyond the handshake.
    pub handshakes: u32,
    /// Intact frames without a tag at a relay with a key. Without a key, messages that are accepted with a tag only.
    pub unsigned: u32,
    /// Intact frames with a wrong tag: of a sender without the key, altered, or of another epoch.
    pub forged: u32,
    /// Frames with the right tag that were received before, or are too old to check.
    pub replayed: u32,
    /// Intact frames without a valid message, or with a value out of range.
    pub malformed: u32,
    /// Intact frames of another network.
    pub foreign: u32,
    /// Intact frames from a node that is no neighbour, or for another node on a link to this relay only.
    pub misaddressed: u32,
    /// Messages from the wrong side. A pass or proposal from downstream of its direction, or a reply from upstream of it.
    pub misdirected: u32,
    /// Messages of another mission, and offers of a mission for other sites. The events are
    /// [`Event::MissionMismatch`](crate::Event::MissionMismatch) and [`Event::UploadRefused`](crate::Event::UploadRefused).
    pub mission: u32,
    /// Messages of a round or view change that belong to another view. They may also belong to a mission that is not flown in it.
    pub view: u32,
    /// New views that this relay has accepted.
    pub views: u32,
    /// Messages of a pass or view change that is over or cannot be joined. Offers that answer no recent hello.
    pub stale: u32,
    /// Rejected interference samples: not a number, out of range, or without a measurement in progress.
    pub samples_rejected: u32,
}

impl Stats {
    /// Returns the number of rejected frames, over all reasons.
    pub fn rejected(&self) -> u32 {
        [
            self.oversized,
            self.truncated,
            self.crc,
            self.version,
            self.unsigned,
            self.forged,
            self.replayed,
            self.malformed,
            self.foreign,
            self.misaddressed,
            self.misdirected,
            self.mission,
            self.view,
            self.stale,
        ]
        .into_iter()
        .fold(0, u32::saturating_add)
    }
}

#[inline(never)] // called from many places
pub(crate) fn bump(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
