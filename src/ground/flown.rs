//! Mission of the chain, as a relay has reported it to the ground station.

use crate::wire::upload::Upload;

/// The newest mission that a relay holds.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FlownMission {
    /// Node number of the relay that answered.
    pub by: u16,
    /// Version of the mission: 0 for the one that was loaded before flight.
    pub version: u16,
    /// True if the relay flies it; false while it only holds it.
    pub flies: bool,
    /// Values of the mission. `None` for the one that was loaded before flight, and until the relay has sent them; older firmware
    /// never sends them.
    pub upload: Option<Upload>,
}

impl FlownMission {
    /// Returns true once the values of the mission are known: received, or those loaded before flight.
    pub const fn is_known(&self) -> bool {
        self.version == 0 || self.upload.is_some()
    }
}
