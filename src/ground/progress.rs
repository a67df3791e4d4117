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
    /// A relay flies it, and not all of its view are known to.
    Adopted {
        /// Node number of the relay.
        by: u16,
    },
    /// All relays of a view of the chain fly it. A relay that is not in the view takes part in nothing until it does.
    Flown {
        /// Node number of the relay that says so.
        by: u16,
        /// The latest view of the chain that it has heard of.
        view: ViewId,
        /// Relays that fly it: that relay, and all of its view beyond it.
        relays: u16,
    },
    /// A relay refuses it: there is no line on earth for it, or it leaves that relay's own geofence. The chain does not fly it.
    Refused {
        /// Node number of the relay that says so: it refuses it, or one beyond it does.
        by: u16,
    },
    /// The chain has a newer mission.
    Outdated {
        /// Its version.
        version: u16,
    },
}
