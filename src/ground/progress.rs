//! Progress of an upload.

use crate::view::ViewId;

/// Progress of an upload.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// Idle: there is no upload.
    #[default]
    Idle,
    /// The mission is offered; no relay is known to hold it.
    Offering,
    /// A relay holds the mission; the ground station polls until the chain flies it.
    Held {
        /// Node number of the relay.
        by: u16,
    },
    /// A relay flies the mission, but not all relays of its view are known to.
    Adopted {
        /// Node number of the relay.
        by: u16,
    },
    /// The mission is active in all relays of a view. Relays outside the view take no part until they fly it, too.
    Flown {
        /// Node number of the relay that reports it.
        by: u16,
        /// Latest view known to that relay.
        view: ViewId,
        /// Number of relays that fly the mission: that relay and all of its view beyond it.
        relays: u16,
    },
    /// A relay refuses the mission: no line on earth, or outside that relay's own geofence. The chain does not fly it.
    Refused {
        /// Node number of the relay that reports it: it refuses the mission, or a relay beyond it does.
        by: u16,
    },
    /// The chain has a newer mission.
    Outdated {
        /// Version of the newer mission.
        version: u16,
    },
}
