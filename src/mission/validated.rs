//! A mission whose parameters have been checked, and what is asked of it.

use super::config::MissionConfig;
use super::error::MissionError;
use super::parts::{Heading, Interference, Interferer, within};
use super::unknown::{FAR, even_gains};
use crate::field::{Field, InNoise};
use crate::power_ratio::PowerRatio;
use crate::wire::digest::digest;

/// A validated mission, with what is derived from it once.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mission {
    pub(super) config: MissionConfig,
    pub(super) tx_gain: PowerRatio,
    /// What a relay's transmit power is worth on a drone-to-drone hop, 1/W: eta / (`mu_los` `p_MSI`), in a field m^2/W:
    /// `Upsilon_max` / `mu_los`.
    pub(super) relay_gain_per_w: f64,
    /// What it is worth on the last hop, m^2/W: (`mu_nlos` / eta) ((X - D)^2 + Y^2) / `p_MSI`, in a field Upsilon(D) / eta. With
    /// noise, of the interference and the noise at Rx together.
    pub(super) receiver_gain_per_w: f64,
    /// N eta / `p_MSI`, 1/m^2: the noise over what of the interferer arrives at a relay a metre from it; 0 without noise and in a field.
    pub(super) noise_at_a_metre: f32,
}

/// The most that noise may be, as a part of what of the interferer arrives at a relay a metre from it: with more nothing of the
/// interferer would be left to an f32.
const MOST_NOISE: f64 = 1e12;

impl Mission {
    /// Checks every parameter. Usable in a constant, where [`Mission::new`] turns a mistake into a failed build.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::mission::MissionError;
    /// use uav_relay::{Mission, MissionConfig};
    ///
    /// let too_near = MissionConfig { distance_m: 0.5, ..*MISSION.config() };
    /// assert_eq!(Mission::try_new(too_near).err(), Some(MissionError::Distance));
    /// ```
    ///
    /// # Errors
    /// [`MissionError`] names the parameter that is outside its range.
    pub const fn try_new(config: MissionConfig) -> Result<Self, MissionError> {
        let MissionConfig {
            relays: _,
            distance_m,
            min_separation_m,
            tx_power_w,
            common,
            band,
            lateral,
            channel,
            interference,
            noise_w,
            tolerance,
        } = config;
        if !within(distance_m, 1.0, 1e6) {
            return Err(MissionError::Distance);
        }
        if !within(min_separation_m, 0.0, 1e5) {
            return Err(MissionError::Separation);
        }
        if let Err(error) = config.room() {
            return Err(error);
        }
        if !within(tx_power_w, 1e-6, 1e6) {
            return Err(MissionError::TxPower);
        }
        if !common.is_valid() {
            return Err(MissionError::Common);
        }
        if !band.is_of_altitudes() || !within(common.altitude_m, band.least_m, band.most_m) {
            return Err(MissionError::Band);
        }
        if !lateral.is_room_beside() {
            return Err(MissionError::Lateral);
        }
        if let Interference::Source(interferer) = &interference {
            if !interferer.is_powered() {
                return Err(MissionError::InterfererPower);
            }
            if !interferer.is_placed() {
                return Err(MissionError::InterfererPlace);
            }
        }
        if !within(tolerance, 1e-6, 0.1) {
            return Err(MissionError::Tolerance);
        }
        if !within(noise_w, 0.0, 1.0) {
            return Err(MissionError::Noise);
        }
        if matches!(interference, Interference::Field(_)) && !cfg!(feature = "field") {
            return Err(MissionError::Field);
        }
        let eta = channel.eta();
        let (noise, mut noise_at_a_metre) = (noise_w as f64, 0.0);
        let (tx_gain, relay_gain_per_w, receiver_gain_per_w) = match interference {
            Interference::Source(interferer) => {
                let p_msi = interferer.power_w as f64;
                let beyond = interferer.x_m as f64 - distance_m as f64;
                let aside = interferer.y_m as f64;
                let squared = beyond * beyond + aside * aside;
                noise_at_a_metre = noise * eta / p_msi;
                if noise_at_a_metre > MOST_NOISE {
                    return Err(MissionError::Noise);
                }
                // I + N at Rx in place of I, as parts of I.
                let louder = 1.0 + noise * channel.mu_nlos() * squared / p_msi;
                (
                    tx_power_w as f64 / p_msi,
                    eta / channel.mu_los() / p_msi,
                    channel.mu_nlos() / eta * squared / p_msi / louder,
                )
            }
            Interference::Unknown => even_gains(distance_m, common.power_w),
            Interference::Field(field) => {
                let heard = field.in_noise(noise_w);
                let most = heard.largest() as f64;
                (
                    tx_power_w as f64 * most / eta,
                    most / channel.mu_los(),
                    heard.upsilon(distance_m) as f64 / eta,
                )
            }
        };
        Ok(Self {
            config,
            tx_gain: PowerRatio::new(tx_gain),
            relay_gain_per_w,
            receiver_gain_per_w,
            #[expect(clippy::cast_possible_truncation, reason = "it is given as an f32")]
            noise_at_a_metre: noise_at_a_metre as f32,
        })
    }

    /// As [`Mission::try_new`], for a mission that is a constant of the firmware.
    ///
    /// [`Channel::from_db`](crate::Channel::from_db) is no function of a constant; [`Channel::new`](crate::Channel::new), which takes the losses
    /// as factors, 10^(dB / 10), is:
    ///
    /// ```
    /// use uav_relay::channel::AirGround;
    /// use uav_relay::{Band, Channel, Interference, Interferer, Mission, MissionConfig, Profile};
    ///
    /// // 0.1 dB and 21 dB.
    /// const CHANNEL: Channel = match Channel::new(2e9, 1.023_293, 125.892_541, AirGround::Los) {
    ///     Ok(channel) => channel,
    ///     Err(_) => panic!("the channel is out of range"),
    /// };
    /// const MISSION: Mission = Mission::new(MissionConfig {
    ///     relays: 5,
    ///     distance_m: 1_000.0,
    ///     min_separation_m: 4.0,
    ///     tx_power_w: 80.0,
    ///     common: Profile { altitude_m: 20.0, power_w: 1.0 },
    ///     band: Band::at(20.0),
    ///     lateral: Band::NONE,
    ///     channel: CHANNEL,
    ///     interference: Interference::Source(Interferer { power_w: 80.0, x_m: 500.0, y_m: 400.0 }),
    ///     noise_w: 0.0,
    ///     tolerance: 1e-4,
    /// });
    /// assert_eq!(MISSION.relays(), 5);
    /// ```
    ///
    /// A number out of range is a failed build:
    ///
    /// ```compile_fail,E0080
    /// # use uav_relay::channel::AirGround;
    /// # use uav_relay::{Band, Channel, Interference, Interferer, Mission, MissionConfig, Profile};
    /// # const CHANNEL: Channel = match Channel::new(2e9, 1.023_293, 125.892_541, AirGround::Los) {
    /// #     Ok(channel) => channel,
    /// #     Err(_) => panic!("the channel is out of range"),
    /// # };
    /// const MISSION: Mission = Mission::new(MissionConfig {
    ///     relays: 0,
    ///     // and the rest as above
    /// #   distance_m: 1_000.0,
    /// #   min_separation_m: 4.0,
    /// #   tx_power_w: 80.0,
    /// #   common: Profile { altitude_m: 20.0, power_w: 1.0 },
    /// #   band: Band::at(20.0),
    /// #   lateral: Band::NONE,
    /// #   channel: CHANNEL,
    /// #   interference: Interference::Source(Interferer { power_w: 80.0, x_m: 500.0, y_m: 400.0 }),
    /// #   noise_w: 0.0,
    /// #   tolerance: 1e-4,
    /// });
    /// # assert_eq!(MISSION.relays(), 0);
    /// ```
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

    /// Returns the 16-bit digest of all parameters, by which relays detect that their missions differ.
    ///
    /// It detects mistakes, not attacks: two different missions have the same digest once in 65 536.
    pub fn digest(&self) -> u16 {
        digest(self)
    }

    /// Number of relays N.
    pub const fn relays(&self) -> u16 {
        self.config.relays
    }

    /// What degrades the hops.
    pub const fn interference(&self) -> &Interference {
        &self.config.interference
    }

    /// The interferer, where there is one; where nobody knows it, one far away, which is the same everywhere.
    pub const fn interferer(&self) -> Option<&Interferer> {
        match &self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            Interference::Unknown => Some(&FAR),
            Interference::Field(_) => None,
        }
    }

    /// The field, where there is one.
    pub const fn field(&self) -> Option<&Field> {
        match &self.config.interference {
            Interference::Field(field) if cfg!(feature = "field") => Some(field),
            _ => None,
        }
    }

    /// The field as the receivers hear it, with their noise, where there is one.
    pub(crate) const fn heard(&self) -> Option<InNoise<'_>> {
        match self.field() {
            Some(field) => Some(field.in_noise(self.config.noise_w)),
            None => None,
        }
    }

    /// nu = N eta / `p_MSI`, 1/m^2: the noise over what of the interferer arrives at a relay a metre from it; 0 without noise and in a
    /// field, whose noise is in its Upsilon.
    pub const fn noise_at_a_metre(&self) -> f32 {
        self.noise_at_a_metre
    }

    /// Which way the places are worked out.
    pub const fn heading(&self) -> Heading {
        match self.field() {
            None => Heading::TowardRx,
            Some(_) => Heading::TowardTx,
        }
    }

    /// The relay that works out its place first, and begins the passes: 1, or N in a field.
    pub const fn leader(&self) -> u16 {
        match self.heading() {
            Heading::TowardRx => 1,
            Heading::TowardTx => self.config.relays,
        }
    }

    /// The relay that comes after `index` on a pass; `None` after the last.
    pub const fn after(&self, index: u16) -> Option<u16> {
        match self.heading() {
            Heading::TowardRx if index < self.config.relays => Some(index + 1),
            Heading::TowardTx if index > 1 => Some(index - 1),
            _ => None,
        }
    }

    /// The same mission with another number of relays.
    ///
    /// # Errors
    /// [`MissionError::Relays`] or [`MissionError::TooManyForDistance`].
    pub const fn with_relays(&self, relays: u16) -> Result<Self, MissionError> {
        let config = MissionConfig {
            relays,
            ..self.config
        };
        match config.room() {
            Ok(()) => Ok(Self { config, ..*self }),
            Err(error) => Err(error),
        }
    }

    /// The same mission, whose relays may stand as close as they like.
    pub(crate) const fn unseparated(&self) -> Self {
        let config = MissionConfig {
            min_separation_m: 0.0,
            ..self.config
        };
        Self { config, ..*self }
    }
}
