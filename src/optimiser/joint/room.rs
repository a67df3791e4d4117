//! Where a relay may fly across the line.

use crate::mission::{Band, Mission};
use crate::place::CrossSection;

/// Where a relay may fly across the line.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Room {
    /// Distances to the side, m.
    pub lateral: Band,
    /// Altitudes, m.
    pub band: Band,
}

impl Room {
    /// All that the mission leaves.
    pub const fn of(mission: &Mission) -> Self {
        let config = mission.config();
        Self {
            lateral: config.lateral,
            band: config.band,
        }
    }

    /// The same for a relay that keeps to one altitude.
    pub const fn at_altitude(self, altitude_m: f32) -> Self {
        Self {
            band: Band::at(altitude_m),
            ..self
        }
    }

    /// What of it is nearest to `at`.
    #[inline(never)] // called from many places
    pub const fn nearest(self, at: CrossSection) -> CrossSection {
        CrossSection {
            y_m: self.lateral.nearest(at.y_m),
            altitude_m: self.band.nearest(at.altitude_m),
        }
    }
}
