//! How far an upload has come.

use crate::view::ViewId;

/// How far an upload has come.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// There is nothing to upload.
    #[default]
    Idle,
    /// No relay is known to hold it.
    Offering,
    /// A relay holds it: the others are being asked.
    Held {
        /// Node number of the relay.
        by: u16,
    },
    /// The chain flies it.
    Flown {
        /// Node number of the relay that says so.
        by: u16,
        /// The latest view of the chain that it has heard of.
        view: ViewId,
    },
    /// The chain has a newer mission.
    Outdated {
        /// Its version.
        version: u16,
    },
}
