//! Positions in the air, and the power of a relay there.

/// Position in the air.
///
/// Frame: x along the ground from the transmitter toward the receiver, y to the right for an observer who looks along
/// x, h up.
///
/// ```
/// use uav_relay::Placement;
///
/// // 300 m from the transmitter, 20 m to the right of the line, 60 m above ground.
/// let place = Placement { x_m: 300.0, y_m: 20.0, altitude_m: 60.0 };
/// assert!(place != Placement::on_line(300.0, 60.0));
/// ```
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Placement {
    /// Distance from the transmitter along the ground, m: 0 to D, the distance from Tx to Rx.
    pub x_m: f32,
    /// Lateral offset from the line Tx to Rx, m. Positive to the right for an observer at Tx who looks to Rx.
    pub y_m: f32,
    /// Height of the position above the ground, m.
    pub altitude_m: f32,
}

impl Placement {
    /// Creates a position vertically above the line from Tx to Rx: the lateral offset is 0.
    pub const fn on_line(x_m: f32, altitude_m: f32) -> Self {
        CrossSection::on_line(altitude_m).at(x_m)
    }

    /// Returns the lateral offset and altitude of the position, without its x.
    #[doc(hidden)]
    pub const fn cross_section(self) -> CrossSection {
        CrossSection {
            y_m: self.y_m,
            altitude_m: self.altitude_m,
        }
    }
}

/// Lateral offset and altitude of a relay: its position except for x.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CrossSection {
    /// Lateral offset from the line Tx to Rx, m. Positive to the right for an observer at Tx who looks to Rx.
    pub y_m: f32,
    /// Height of the relay above the ground, m.
    pub altitude_m: f32,
}

impl CrossSection {
    /// Creates the cross-section vertically above the line from Tx to Rx: the lateral offset is 0.
    pub const fn on_line(altitude_m: f32) -> Self {
        Self {
            y_m: 0.0,
            altitude_m,
        }
    }

    /// Returns the position at `x_m` with this lateral offset and altitude.
    pub const fn at(self, x_m: f32) -> Placement {
        Placement {
            x_m,
            y_m: self.y_m,
            altitude_m: self.altitude_m,
        }
    }

    pub(crate) fn apart_squared(self, other: Self) -> f32 {
        let (y, h) = (self.y_m - other.y_m, self.altitude_m - other.altitude_m);
        y * y + h * h
    }
}

/// Lateral offset, altitude and transmit power of a relay. It does not include x, which is computed.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Station {
    /// Lateral offset and altitude of the relay.
    pub cross_section: CrossSection,
    /// Transmit power of the relay, W.
    pub power_w: f32,
}

/// Behaviour of a relay while it can reach too few relays for a quorum of the chain.
///
/// [`Leave`](Self::Leave) moves the drone out of the way of the relays that have a quorum. Set the same value on all
/// relays, so that the relays that leave the line keep their order and distances.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WithoutQuorum {
    /// Hold the last position that the chain has agreed on.
    #[default]
    Hold,
    /// Leave the line from Tx to Rx: fly sideways (along y) and upward from the last agreed position. A guard keeps the
    /// drone in its geofence ([`GuardConfig::with_room_for`](crate::guard::config::GuardConfig::with_room_for)).
    Leave {
        /// Lateral distance from the last position that the chain has agreed on, m: -1e4 to 1e4.
        y_m: f32,
        /// Height above the last position that the chain has agreed on, m: 0 to 1e4.
        up_m: f32,
    },
}

impl WithoutQuorum {
    pub(crate) fn is_valid(self) -> bool {
        match self {
            Self::Hold => true,
            Self::Leave { y_m, up_m } => (-1e4..=1e4).contains(&y_m) && (0.0..=1e4).contains(&up_m),
        }
    }

    /// Returns the position at which a drone waits while its relay has no quorum. `place` is the last position that the
    /// chain has agreed on.
    pub(crate) fn place(self, place: Placement) -> Placement {
        match self {
            Self::Hold => place,
            Self::Leave { y_m, up_m } => Placement {
                y_m: place.y_m + y_m,
                altitude_m: place.altitude_m + up_m,
                ..place
            },
        }
    }
}
