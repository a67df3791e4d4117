//! Counters of a relay. Remote faults are counted here; they never cause an error or a panic.

/// Counters of a relay's messages and faults since start-up; each saturates at its maximum.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stats {
    /// Frames given to the link for transmission, including retransmissions.
    pub sent: u32,
    /// Retransmissions of view proposals and of messages along the chain, because there was no reply.
    pub repeats: u32,
    /// View proposals and passes along the chain that this relay has started as the leader.
    pub passes_begun: u32,
    /// Messages received from a neighbour with all values in range. Some of them are also counted below, for example as
    /// stale.
    pub received: u32,
    /// Received duplicates of view proposals and of messages along the chain. This relay has repeated its replies.
    pub repeated: u32,
    /// Intact frames between other nodes of the network, received on a shared channel.
    pub overheard: u32,
    /// Received frames that are longer than the format allows.
    pub oversized: u32,
    /// Received frames whose end is missing.
    pub truncated: u32,
    /// Received frames with a wrong CRC.
    pub crc: u32,
    /// Received intact frames of a frame format version that this relay does not know.
    pub version: u32,
    /// Received handshake frames with the right authentication tag. Handshakes only establish sessions.
    pub handshakes: u32,
    /// Received intact frames without an authentication tag, if this relay has a key. Without a key: received offers of
    /// a mission, because a relay accepts an offered mission only with a key.
    pub unsigned: u32,
    /// Intact frames with a wrong authentication tag: sent without the key, altered, or of an old epoch.
    pub forged: u32,
    /// Frames with the right authentication tag that were received before, or are too old to check.
    pub replayed: u32,
    /// Received intact frames without a valid message, or with a value out of range.
    pub malformed: u32,
    /// Received intact frames of a network that is not this relay's network.
    pub foreign: u32,
    /// Received intact frames from a node that is no neighbour. On a point-to-point link also frames that are not
    /// addressed to this relay.
    pub misaddressed: u32,
    /// Received pass messages (messages along the chain) from the wrong neighbour. A pass message must come from the
    /// previous relay of the pass, and a reply from the next relay of the pass.
    pub misdirected: u32,
    /// Ignored messages for a mission other than this relay's, and offered missions that the relay refuses. The events
    /// are [`Event::MissionMismatch`](crate::Event::MissionMismatch) and
    /// [`Event::UploadRefused`](crate::Event::UploadRefused).
    pub mission: u32,
    /// Ignored view changes and pass messages (messages along the chain) with a wrong digest. The digest must be that
    /// of this relay's view and mission.
    pub view: u32,
    /// Views (agreements on the chain's members) that this relay has accepted.
    pub views: u32,
    /// Ignored outdated messages, for example of a view change that has ended. An offered mission also counts here if
    /// this relay has not requested it by a recent hello message.
    pub stale: u32,
    /// Rejected interference samples: not a number, out of range, or while this relay measures nothing.
    pub samples_rejected: u32,
}

impl Stats {
    /// Returns the number of rejected frames and messages, over all reasons.
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
