//! What a relay counts. Remote faults end here: they are never an error of the caller's and never a panic.

/// Counters since the relay was switched on; each stays at its maximum once it gets there.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stats {
    /// Frames handed to the link, repetitions included.
    pub sent: u32,
    /// Messages of a round (sweeps, gatherings, tokens) and proposals sent again because no answer came.
    pub repeats: u32,
    /// Passes of any kind, and proposals, that this relay has begun as the leader.
    pub sweeps: u32,
    /// Messages from a neighbour, in range; what becomes of them may still be counted below as misdirected, of another
    /// mission or stale.
    pub received: u32,
    /// Passes and proposals that had arrived before and are answered once more.
    pub repeated: u32,
    /// Intact frames between other nodes of the network, heard on a shared channel.
    pub overheard: u32,
    /// Frames too long for the format.
    pub oversized: u32,
    /// Frames cut short.
    pub truncated: u32,
    /// Frames whose CRC does not match.
    pub crc: u32,
    /// Intact frames of another version of the format.
    pub version: u32,
    /// Frames with the right tag by which a node makes itself known; of one that proves nothing else is made.
    pub handshakes: u32,
    /// Intact frames without a tag, at a relay that asks for one; at one that does not, messages that are taken with a tag only.
    pub unsigned: u32,
    /// Intact frames whose tag is wrong: by no member, altered, or of another epoch.
    pub forged: u32,
    /// Frames with the right tag that had been taken before, or were too old to tell.
    pub replayed: u32,
    /// Intact frames that hold no message, or one with a number out of range.
    pub malformed: u32,
    /// Intact frames of another network.
    pub foreign: u32,
    /// Intact frames from a node that is no neighbour, or for another node on a link that only this one should hear.
    pub misaddressed: u32,
    /// Messages from the wrong side: a pass or a proposal from where it should go, what comes back of it from where it came from.
    pub misdirected: u32,
    /// Messages of another mission, which raise [`Event::MissionMismatch`](crate::Event::MissionMismatch), and offers of one for other sites,
    /// which raise [`Event::UploadRefused`](crate::Event::UploadRefused).
    pub mission: u32,
    /// Messages of a round or of a view change that are of another view of the chain, or of a mission that is not flown in it.
    pub view: u32,
    /// New views of the chain that this relay has agreed to.
    pub views: u32,
    /// Messages of a pass, or of a view change, that is over or cannot be taken part in; offers that answer no hello of late.
    pub stale: u32,
    /// Samples of the interference that were no use: not a number, out of range, or without anything to measure for.
    pub samples_refused: u32,
}

impl Stats {
    /// Frames that were refused, for whatever reason.
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

/// Counts one more, up to the maximum.
#[inline(never)] // called from many places
pub(crate) fn bump(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
