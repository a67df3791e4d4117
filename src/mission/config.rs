//! Parameters of a mission as plain numbers, and the error that names a rejected one.

use crate::channel::Channel;
use crate::field::Field;
use crate::place::{CrossSection, Station};

/// Value of [`Mission::MAX_RELAYS`](crate::Mission::MAX_RELAYS).
pub(crate) const MAX_RELAYS: u16 = 1000;

/// Two f32 steps just below the distance, as a fraction of it. Positions this far apart near Rx remain distinct.
pub(super) const FINEST_STEP: f32 = 1.0 / 4_194_304.0;

/// Maximum rounding error of a step between two positions, as a fraction of the distance.
pub(super) const ROUNDING: f32 = 2.0 * FINEST_STEP;

/// Parameters of a mission; [`Mission::try_new`](crate::Mission::try_new) checks them.
///
/// Frame: x runs along the ground from the transmitter (0) to the receiver (`distance_m`), y to its right as seen from above,
/// altitude is height above the ground.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MissionConfig {
    /// Number of relays N, 1 to [`Mission::MAX_RELAYS`](crate::Mission::MAX_RELAYS).
    pub relays: u16,
    /// Distance D from transmitter to receiver, m: 1 to 1e6.
    pub distance_m: f32,
    /// Minimum distance between two relays, m: 0 to 1e5.
    pub min_separation_m: f32,
    /// Transmit power of the ground transmitter, W: 1e-6 to 1e6.
    pub tx_power_w: f32,
    /// Altitude and power of every relay without a profile of its own.
    pub common: Profile,
    /// Altitudes for methods that choose altitudes, within 0.1 to 1e5; includes `common.altitude_m`.
    pub band: Band,
    /// Lateral range y for the joint method, within -1e5 to 1e5; includes 0.
    pub lateral: Band,
    /// Path loss of the three kinds of link.
    pub channel: Channel,
    /// Interference on the hops.
    pub interference: Interference,
    /// Noise power at the input of every receiver, W. 0 to 1, and at most 1e12 times the interferer's power received at 1 m. 0 is
    /// the paper's receiver; otherwise every SIR is the SINR, signal over interference plus noise.
    pub noise_w: f32,
    /// Relative tolerance of the SIR: 1e-6 to 0.1. A chain this close to the best SIR is accepted.
    pub tolerance: f32,
}

impl MissionConfig {
    /// Checks the number of relays, and that they fit into the distance.
    pub(super) const fn room(&self) -> Result<(), MissionError> {
        if self.relays < 1 || self.relays > MAX_RELAYS {
            return Err(MissionError::Relays);
        }
        let step = self.min_separation_m + self.distance_m * ROUNDING;
        if (self.relays - 1) as f32 * step > self.distance_m {
            return Err(MissionError::TooManyForDistance);
        }
        Ok(())
    }
}

/// Parameter of a [`MissionConfig`](crate::MissionConfig) that is rejected, and its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MissionError {
    /// `relays` is not within 1 to [`Mission::MAX_RELAYS`](crate::Mission::MAX_RELAYS).
    Relays,
    /// `distance_m` is not within 1 to 1e6.
    Distance,
    /// `min_separation_m` is not within 0 to 1e5.
    Separation,
    /// The relays need more than `distance_m` with `min_separation_m` between them. A rounding of 5e-7 `distance_m` is included.
    TooManyForDistance,
    /// `tx_power_w` is not within 1e-6 to 1e6.
    TxPower,
    /// `common.altitude_m` is not within 0.1 to 1e5, or `common.power_w` not within 1e-6 to 1e6.
    Common,
    /// `band` is not in order, not within 0.1 to 1e5, or leaves out `common.altitude_m`.
    Band,
    /// `lateral` is not in order, not within -1e5 to 1e5, or leaves out 0.
    Lateral,
    /// `interferer.power_w` is not within 1e-6 to 1e9.
    InterfererPower,
    /// `interferer.x_m` or `interferer.y_m` is not within -1e7 to 1e7.
    InterfererPlace,
    /// `noise_w` is not within 0 to 1, or above 1e12 times the interferer's power received at 1 m.
    Noise,
    /// The crate was built without its feature `field`.
    Field,
    /// `tolerance` is not within 1e-6 to 0.1.
    Tolerance,
}

impl core::fmt::Display for MissionError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Relays => "relays must be within 1 to 1000",
            Self::Distance => "distance_m must be within 1 to 1e6",
            Self::Separation => "min_separation_m must be within 0 to 1e5",
            Self::TooManyForDistance => {
                "(relays - 1) x min_separation_m must not be above distance_m"
            }
            Self::TxPower => "tx_power_w must be within 1e-6 to 1e6",
            Self::Common => {
                "common.altitude_m must be within 0.1 to 1e5, common.power_w within 1e-6 to 1e6"
            }
            Self::Band => {
                "band must be within 0.1 to 1e5, from least to most, with common.altitude_m in it"
            }
            Self::Lateral => "lateral must be within -1e5 to 1e5, from least to most, with 0 in it",
            Self::InterfererPower => "interferer.power_w must be within 1e-6 to 1e9",
            Self::InterfererPlace => "interferer.x_m and y_m must be within -1e7 to 1e7",
            Self::Noise => {
                "noise_w must be within 0 to 1, and at most 1e12 times the interferer's power received at 1 m"
            }
            Self::Field => "a field of interference needs the feature `field`",
            Self::Tolerance => "tolerance must be within 1e-6 to 0.1",
        })
    }
}

impl core::error::Error for MissionError {}

/// The interferer (the paper's MSI), on the ground: a jammer, a base station, a licensed user.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interferer {
    /// Transmit power, W.
    pub power_w: f32,
    /// Position along the line from Tx (0) to Rx (D), m; may be before Tx or beyond Rx.
    pub x_m: f32,
    /// Distance from that line, m: to its right above 0, to its left below.
    pub y_m: f32,
}

impl Interferer {
    pub(super) const fn is_powered(&self) -> bool {
        within(self.power_w, 1e-6, 1e9)
    }

    pub(super) const fn is_placed(&self) -> bool {
        within(self.x_m, -1e7, 1e7) && within(self.y_m, -1e7, 1e7)
    }

    /// Returns true if all values are within their ranges.
    pub const fn is_valid(&self) -> bool {
        self.is_powered() && self.is_placed()
    }
}

/// Interference on the hops.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Interference {
    /// Single transmitter at a known position.
    Source(Interferer),
    /// Interference that is known as a distribution along x only.
    Field(Field),
    /// Single transmitter at an unknown position. Relays spread evenly until they find it ([`crate::Settings::listen`]).
    Unknown,
}

/// Order in which the positions of a chain are computed; it determines the leader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heading {
    /// Relay 1 first (Algorithm 1), with an interferer. The SIR of a hop determines the position of its *receiver*.
    TowardRx,
    /// Relay N first (Algorithm 4), in a field. The interference at the receiver determines the position of the *sender*.
    TowardTx,
}

/// Range of altitudes or of lateral offsets that a relay may choose from.
///
/// ```
/// use uav_relay::Band;
///
/// let altitudes = Band { least_m: 20.0, most_m: 120.0 };
/// assert_eq!(altitudes.nearest(300.0), 120.0);
/// assert!(Band::at(20.0).is_single());
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Band {
    /// Lower limit, m.
    pub least_m: f32,
    /// Upper limit, m: at least `least_m`.
    pub most_m: f32,
}

impl Band {
    /// Lateral range 0, as in the paper. Relays stay in the vertical plane through transmitter and receiver.
    pub const NONE: Self = Self::at(0.0);

    /// Returns the band of a single value.
    pub const fn at(at_m: f32) -> Self {
        Self {
            least_m: at_m,
            most_m: at_m,
        }
    }

    /// Returns the value in the band that is nearest to `at_m`.
    pub const fn nearest(self, at_m: f32) -> f32 {
        if at_m >= self.most_m {
            self.most_m
        } else if at_m > self.least_m {
            at_m
        } else {
            self.least_m
        }
    }

    /// Width of the band, m.
    pub const fn span_m(self) -> f32 {
        self.most_m - self.least_m
    }

    /// Returns true if the band has a single value.
    pub const fn is_single(self) -> bool {
        !(self.least_m < self.most_m)
    }

    /// Returns true if the limits are in order and within 0.1 to 1e5.
    pub(super) const fn is_of_altitudes(self) -> bool {
        within(self.least_m, 0.1, 1e5) && within(self.most_m, self.least_m, 1e5)
    }

    /// Returns true if the limits are in order, within -1e5 to 1e5, and include 0.
    pub(super) const fn is_room_beside(self) -> bool {
        within(self.least_m, -1e5, 0.0) && within(self.most_m, 0.0, 1e5)
    }
}

/// Altitude and transmit power of one relay.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Profile {
    /// Altitude above the ground plane that the relay holds, m: 0.1 to 1e5.
    pub altitude_m: f32,
    /// Transmit power, W: 1e-6 to 1e6.
    pub power_w: f32,
}

impl Profile {
    /// Returns true if both values are within their ranges.
    pub const fn is_valid(&self) -> bool {
        within(self.altitude_m, 0.1, 1e5) && within(self.power_w, 1e-6, 1e6)
    }

    /// Returns a relay with this profile right above the line.
    pub const fn on_line(self) -> Station {
        Station {
            at: CrossSection::on_line(self.altitude_m),
            power_w: self.power_w,
        }
    }
}

pub(super) const fn within(value: f32, least: f32, most: f32) -> bool {
    value >= least && value <= most
}
