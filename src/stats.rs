//! Counters of a relay. Remote faults are counted here; they never cause an error or a panic.

/// Counters of messages and faults since start-up; each saturates.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stats {
    /// Frames given to the link, including retransmissions.
    pub sent: u32,
    /// Retransmissions for lack of a reply.
    ///
    /// Of view proposals and of messages along the chain.
    pub repeats: u32,
    /// View proposals and messages along the chain started as the leader.
    pub passes_begun: u32,
    /// Messages of a neighbour with all values in range.
    ///
    /// Some also count elsewhere, for example as stale.
    pub received: u32,
    /// Received duplicates, whose replies were repeated.
    ///
    /// Of view proposals and of messages along the chain.
    pub repeated: u32,
    /// Intact frames between other nodes of the network, on a shared channel.
    pub overheard: u32,
    /// Frames longer than the format allows.
    pub oversized: u32,
    /// Frames without their end.
    pub truncated: u32,
    /// Frames with a wrong CRC.
    pub crc: u32,
    /// Intact frames of another version of the format.
    pub version: u32,
    /// Handshakes with the right tag; they only establish sessions.
    pub handshakes: u32,
    /// Intact frames without a tag, received by a relay with a key.
    ///
    /// A relay without a key counts mission offers here: it accepts them only with a key.
    pub unsigned: u32,
    /// Intact frames with a wrong tag.
    ///
    /// Sent without the key, altered, or of another epoch.
    pub forged: u32,
    /// Frames with the right tag that are repeated, or too old to check.
    pub replayed: u32,
    /// Intact frames without a valid message, or with a value out of range.
    pub malformed: u32,
    /// Intact frames of another network.
    pub foreign: u32,
    /// Intact frames of a node that is no neighbour.
    ///
    /// On a point-to-point link also frames for another node.
    pub misaddressed: u32,
    /// Messages from the next relay, or replies from the previous one.
    ///
    /// Both come from the wrong neighbour. Only messages along the chain count.
    pub misdirected: u32,
    /// Messages of another mission, and refused mission offers.
    ///
    /// The events are [`Event::MissionMismatch`](crate::Event::MissionMismatch) and
    /// [`Event::UploadRefused`](crate::Event::UploadRefused).
    pub mission: u32,
    /// Ignored messages of another view or mission.
    ///
    /// Counted are view changes and messages along the chain.
    pub view: u32,
    /// Accepted views (members of the chain).
    pub views: u32,
    /// Ignored outdated messages, for example of an ended view change.
    ///
    /// Mission offers without a recent hello that requested them also count here.
    pub stale: u32,
    /// Rejected interference samples.
    ///
    /// Not a number, out of range, or while this relay measures nothing.
    pub samples_rejected: u32,
}

impl Stats {
    /// Returns the number of rejected frames and messages.
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
