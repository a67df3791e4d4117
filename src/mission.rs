//! The mission: everything the relays agree on before flight, validated once.

use crate::channel::Channel;
use crate::gain::Gain;
use crate::root::sqrt;

/// The most relays a mission may have; addresses on the wire are 12 bits wide.
pub const MAX_RELAYS: u16 = 1000;

/// The interferer (the paper's MSI), on the ground: a jammer, a base station, a licensed user.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interferer {
    /// Transmit power, W.
    pub power_w: f32,
    /// Place along the line from Tx (0) to Rx (D), m; before Tx or beyond Rx too.
    pub x_m: f32,
    /// Distance from that line, m.
    pub y_m: f32,
}

/// What one relay brings along: its altitude and its transmit power.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Profile {
    /// Altitude above the ground plane that the relay holds, m: 0.1 to 1e5.
    pub altitude_m: f32,
    /// Transmit power, W: 1e-6 to 1e6.
    pub power_w: f32,
}

impl Profile {
    /// Whether both numbers are within their ranges.
    pub const fn is_valid(&self) -> bool {
        within(self.altitude_m, 0.1, 1e5) && within(self.power_w, 1e-6, 1e6)
    }
}

/// The parameters of a mission, as plain numbers; [`Mission::try_new`] checks them.
///
/// Frame: x runs along the ground from the transmitter (0) to the receiver (`distance_m`), altitude is height above it.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MissionConfig {
    /// Number of relays N, 1 to [`MAX_RELAYS`].
    pub relays: u16,
    /// Distance D from transmitter to receiver, m: 1 to 1e6.
    pub distance_m: f32,
    /// Least distance between two relays, m: 0 to 1e5.
    pub min_separation_m: f32,
    /// Transmit power of the ground transmitter, W: 1e-6 to 1e6.
    pub tx_power_w: f32,
    /// What every relay holds that was given nothing of its own.
    pub common: Profile,
    /// Path loss of the three kinds of link.
    pub channel: Channel,
    /// The source of interference.
    pub interferer: Interferer,
    /// How close to the best SIR is close enough, relative: 1e-6 to 0.1.
    pub tolerance: f32,
}

/// Which parameter of a [`MissionConfig`] was refused, and its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MissionError {
    /// `relays` is not within 1 to [`MAX_RELAYS`].
    Relays,
    /// `distance_m` is not within 1 to 1e6.
    Distance,
    /// `min_separation_m` is not within 0 to 1e5.
    Separation,
    /// The relays, `min_separation_m` (and a rounding of 5e-7 `distance_m`) apart, are longer than `distance_m`.
    TooManyForDistance,
    /// `tx_power_w` is not within 1e-6 to 1e6.
    TxPower,
    /// `common.altitude_m` is not within 0.1 to 1e5, or `common.power_w` not within 1e-6 to 1e6.
    Common,
    /// `interferer.power_w` is not within 1e-6 to 1e9.
    InterfererPower,
    /// `interferer.x_m` or `interferer.y_m` is not within -1e7 to 1e7.
    InterfererPlace,
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
            Self::InterfererPower => "interferer.power_w must be within 1e-6 to 1e9",
            Self::InterfererPlace => "interferer.x_m and y_m must be within -1e7 to 1e7",
            Self::Tolerance => "tolerance must be within 1e-6 to 0.1",
        })
    }
}

impl core::error::Error for MissionError {}

/// A validated mission, with what is derived from it once.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mission {
    config: MissionConfig,
    tx_gain: Gain,
    /// eta / (`mu_los` `p_MSI`): what a relay's transmit power is worth on a drone-to-drone hop, 1/W.
    relay_gain_per_w: f64,
    /// (`mu_nlos` / eta) ((X - D)^2 + Y^2) / `p_MSI`: what it is worth on the last hop, m^2/W.
    receiver_gain_per_w: f64,
}

/// Two steps of an f32 just below the distance, as a part of it: relays that all gather at its end still stand apart.
const FINEST_STEP: f32 = 1.0 / 4_194_304.0;

/// What rounding may take from a step between two places, as a part of the distance.
const ROUNDING: f32 = 2.0 * FINEST_STEP;

impl Mission {
    /// Checks every parameter. Usable in a constant, where [`Mission::new`] turns a mistake into a failed build.
    ///
    /// # Errors
    /// [`MissionError`] names the parameter that is outside its range.
    pub const fn try_new(config: MissionConfig) -> Result<Self, MissionError> {
        let MissionConfig {
            relays,
            distance_m,
            min_separation_m,
            tx_power_w,
            common,
            channel,
            interferer,
            tolerance,
        } = config;
        if relays < 1 || relays > MAX_RELAYS {
            return Err(MissionError::Relays);
        }
        if !within(distance_m, 1.0, 1e6) {
            return Err(MissionError::Distance);
        }
        if !within(min_separation_m, 0.0, 1e5) {
            return Err(MissionError::Separation);
        }
        if (relays - 1) as f32 * (min_separation_m + distance_m * ROUNDING) > distance_m {
            return Err(MissionError::TooManyForDistance);
        }
        if !within(tx_power_w, 1e-6, 1e6) {
            return Err(MissionError::TxPower);
        }
        if !common.is_valid() {
            return Err(MissionError::Common);
        }
        if !within(interferer.power_w, 1e-6, 1e9) {
            return Err(MissionError::InterfererPower);
        }
        if !within(interferer.x_m, -1e7, 1e7) || !within(interferer.y_m, -1e7, 1e7) {
            return Err(MissionError::InterfererPlace);
        }
        if !within(tolerance, 1e-6, 0.1) {
            return Err(MissionError::Tolerance);
        }
        let p_msi = interferer.power_w as f64;
        let beyond = interferer.x_m as f64 - distance_m as f64;
        let aside = interferer.y_m as f64;
        let nlos_over_eta = channel.mu_nlos() / channel.eta();
        Ok(Self {
            config,
            tx_gain: Gain::new(tx_power_w as f64 / p_msi),
            relay_gain_per_w: channel.eta() / channel.mu_los() / p_msi,
            receiver_gain_per_w: nlos_over_eta * (beyond * beyond + aside * aside) / p_msi,
        })
    }

    /// As [`Mission::try_new`], for a mission that is a constant of the firmware.
    ///
    /// # Panics
    /// On a parameter outside its range: in a `const` that is a failed build, which is what this is for. For numbers that
    /// are only known at run time use [`Mission::try_new`].
    #[expect(
        clippy::panic,
        reason = "in a constant this fails the build, as documented"
    )]
    pub const fn new(config: MissionConfig) -> Self {
        match Self::try_new(config) {
            Ok(mission) => mission,
            Err(MissionError::Relays) => panic!("relays must be within 1 to 1000"),
            Err(MissionError::Distance) => panic!("distance_m must be within 1 to 1e6"),
            Err(MissionError::TooManyForDistance) => {
                panic!("(relays - 1) x min_separation_m is above distance_m")
            }
            Err(MissionError::TxPower) => panic!("tx_power_w must be within 1e-6 to 1e6"),
            Err(MissionError::Common) => {
                panic!("common.altitude_m or common.power_w is out of range")
            }
            Err(_) => panic!("a mission parameter is out of range"),
        }
    }

    /// The parameters as they were given.
    pub const fn config(&self) -> &MissionConfig {
        &self.config
    }

    /// Number of relays N.
    pub const fn relays(&self) -> u16 {
        self.config.relays
    }

    /// The interferer.
    pub const fn interferer(&self) -> &Interferer {
        &self.config.interferer
    }

    /// `p_t` / `p_MSI`: what multiplies the distances of the first hop.
    pub const fn tx_gain(&self) -> Gain {
        self.tx_gain
    }

    /// (`p_u` / `p_MSI`)(eta / `mu_los`): what multiplies the distances of a hop that a relay of `power_w` watts feeds.
    pub const fn relay_gain(&self, power_w: f32) -> Gain {
        Gain::new(power_w as f64 * self.relay_gain_per_w)
    }

    /// K of the last hop, m^2: SIR at the receiver = K / squared distance to the relay of `power_w` watts that feeds it.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    pub const fn receiver_gain(&self, power_w: f32) -> f32 {
        (power_w as f64 * self.receiver_gain_per_w) as f32
    }

    /// The least step in x between neighbours whose altitudes differ by `climb_m`, m: what keeps the separation asked for.
    pub(crate) fn least_step(&self, climb_m: f32) -> f32 {
        let apart = self.config.min_separation_m;
        sqrt(apart * apart - climb_m * climb_m)
    }

    /// The farthest place toward Rx that leaves relays `index` + 1 to N room to stand `min_separation_m` apart, m.
    pub(crate) fn end_for(&self, index: u16) -> f32 {
        let behind = f32::from(self.config.relays.saturating_sub(index));
        let MissionConfig {
            distance_m,
            min_separation_m,
            ..
        } = self.config;
        let step = if min_separation_m > 0.0 {
            min_separation_m + distance_m * ROUNDING
        } else {
            distance_m * FINEST_STEP
        };
        (distance_m - behind * step).max(0.0)
    }
}

/// Whether `value` is a number in [`least`, `most`].
const fn within(value: f32, least: f32, most: f32) -> bool {
    value >= least && value <= most
}

#[cfg(test)]
pub(crate) mod tests {
    use super::{Interferer, Mission, MissionConfig, MissionError, Profile};
    use crate::channel::{AirGround, Channel};

    /// The paper's multi-hop scenario with `relays` relays.
    pub(crate) fn paper(relays: u16) -> MissionConfig {
        MissionConfig {
            relays,
            distance_m: 1000.0,
            min_separation_m: 4.0,
            tx_power_w: 80.0,
            common: Profile {
                altitude_m: 20.0,
                power_w: 1.0,
            },
            channel: Channel::from_db(2e9, 0.1, 21.0, AirGround::Los).unwrap(),
            interferer: Interferer {
                power_w: 80.0,
                x_m: 500.0,
                y_m: 400.0,
            },
            tolerance: 1e-4,
        }
    }

    #[test]
    fn every_parameter_is_checked_at_both_ends_and_for_nan() {
        type Set = fn(&mut MissionConfig, f32);
        let table: [(Set, f32, f32, MissionError); 9] = [
            (|c, v| c.distance_m = v, 1.0, 1e6, MissionError::Distance),
            (
                |c, v| c.min_separation_m = v,
                0.0,
                1e5,
                MissionError::Separation,
            ),
            (|c, v| c.tx_power_w = v, 1e-6, 1e6, MissionError::TxPower),
            (
                |c, v| c.common.altitude_m = v,
                0.1,
                1e5,
                MissionError::Common,
            ),
            (|c, v| c.common.power_w = v, 1e-6, 1e6, MissionError::Common),
            (
                |c, v| c.interferer.power_w = v,
                1e-6,
                1e9,
                MissionError::InterfererPower,
            ),
            (
                |c, v| c.interferer.x_m = v,
                -1e7,
                1e7,
                MissionError::InterfererPlace,
            ),
            (
                |c, v| c.interferer.y_m = v,
                -1e7,
                1e7,
                MissionError::InterfererPlace,
            ),
            (|c, v| c.tolerance = v, 1e-6, 0.1, MissionError::Tolerance),
        ];
        for (set, least, most, error) in table {
            let with = |value| {
                let mut config = paper(1);
                set(&mut config, value);
                Mission::try_new(config).map(|_| ())
            };
            assert_eq!(with(least), Ok(()), "{error}");
            assert_eq!(with(most), Ok(()), "{error}");
            for bad in [
                least.next_down(),
                most.next_up(),
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
            ] {
                assert_eq!(with(bad), Err(error), "{bad}");
            }
        }
        assert_eq!(Mission::try_new(paper(0)), Err(MissionError::Relays));
        assert_eq!(Mission::try_new(paper(1001)), Err(MissionError::Relays));
        assert_eq!(
            Mission::try_new(paper(251)),
            Err(MissionError::TooManyForDistance)
        );
        assert!(Mission::try_new(paper(250)).is_ok());
    }
}
