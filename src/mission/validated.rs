//! Mission with checked parameters, and quantities derived from them.
//!
//! Derived are the power ratios of the hops, the minimum steps between relays, and missions for an estimated interferer.

use super::config::{
    FINEST_STEP, Heading, Interference, Interferer, MissionConfig, MissionError, ROUNDING, within,
};
use crate::field::{Field, InNoise};
use crate::power_ratio::PowerRatio;
use crate::root::sqrt;
use crate::sensing::belief::{Belief, Spread};
use crate::wire::digest::digest;

/// Validated mission, with precomputed derived quantities.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mission {
    pub(super) config: MissionConfig,
    pub(super) tx_gain: PowerRatio,
    /// Gain of a relay on a drone-to-drone hop per watt of transmit power, 1/W. eta / (`mu_los` `p_MSI`), in a field m^2/W:
    /// `Upsilon_max` / `mu_los`.
    pub(super) relay_gain_per_w: f64,
    /// Gain of a relay on the last hop per watt, m^2/W. (`mu_nlos` / eta) ((X - D)^2 + Y^2) / `p_MSI`, in a field Upsilon(D) / eta.
    /// With noise, of the interference plus noise at Rx.
    pub(super) receiver_gain_per_w: f64,
    /// N eta / `p_MSI`, 1/m^2: the noise relative to the interferer's power received at 1 m. 0 without noise and in a field.
    pub(super) noise_at_a_metre: f32,
}

/// Maximum noise relative to the interferer's power received at 1 m. Above it the interferer would be lost in f32 rounding.
const MOST_NOISE: f64 = 1e12;

impl Mission {
    /// Maximum number of relays of a mission; addresses on the wire are 12 bits wide.
    pub const MAX_RELAYS: u16 = super::config::MAX_RELAYS;

    /// Creates a mission after checking every parameter.
    ///
    /// Usable in a constant, where [`Mission::new`] turns an error into a failed build.
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
                // (I + N) / I at Rx.
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

    /// Creates a mission that is a constant of the firmware; otherwise as [`Mission::try_new`].
    ///
    /// [`Channel::from_db`](crate::Channel::from_db) cannot be used in a constant; [`Channel::new`](crate::Channel::new), which
    /// takes the losses as factors, 10^(dB / 10), can:
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
    /// A value out of range fails the build:
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
    /// Panics on a parameter outside its range: in a `const` this is a failed build, as intended. For values known at run time
    /// use [`Mission::try_new`].
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

    /// Returns the parameters.
    pub const fn config(&self) -> &MissionConfig {
        &self.config
    }

    /// Returns the 16-bit digest of all parameters, by which relays detect that their missions differ.
    ///
    /// It detects mistakes, not attacks: two different missions have the same digest with a probability of 1 in 65 536.
    pub fn digest(&self) -> u16 {
        digest(self)
    }

    /// Number of relays N.
    pub const fn relays(&self) -> u16 {
        self.config.relays
    }

    /// Interference on the hops.
    pub const fn interference(&self) -> &Interference {
        &self.config.interference
    }

    /// Returns the interferer; `None` in a field. An unknown one is replaced by one far away, with equal interference everywhere.
    pub const fn interferer(&self) -> Option<&Interferer> {
        match &self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            Interference::Unknown => Some(&FAR),
            Interference::Field(_) => None,
        }
    }

    /// Returns the field, if there is one.
    pub const fn field(&self) -> Option<&Field> {
        match &self.config.interference {
            Interference::Field(field) if cfg!(feature = "field") => Some(field),
            _ => None,
        }
    }

    /// Returns the field with receiver noise, if there is one.
    pub(crate) const fn heard(&self) -> Option<InNoise<'_>> {
        match self.field() {
            Some(field) => Some(field.in_noise(self.config.noise_w)),
            None => None,
        }
    }

    /// nu = N eta / `p_MSI`, 1/m^2: the noise relative to the interferer's power received at 1 m.
    ///
    /// 0 without noise and in a field, whose Upsilon includes the noise.
    pub const fn noise_at_a_metre(&self) -> f32 {
        self.noise_at_a_metre
    }

    /// Order in which the positions are computed.
    pub const fn heading(&self) -> Heading {
        match self.field() {
            None => Heading::TowardRx,
            Some(_) => Heading::TowardTx,
        }
    }

    /// Relay that computes its position first and starts the passes: 1, or N in a field.
    pub const fn leader(&self) -> u16 {
        match self.heading() {
            Heading::TowardRx => 1,
            Heading::TowardTx => self.config.relays,
        }
    }

    /// Returns the relay after `index` in a pass; `None` after the last.
    pub const fn after(&self, index: u16) -> Option<u16> {
        match self.heading() {
            Heading::TowardRx if index < self.config.relays => Some(index + 1),
            Heading::TowardTx if index > 1 => Some(index - 1),
            _ => None,
        }
    }

    /// Returns the same mission with another number of relays.
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

    pub(crate) const fn unseparated(&self) -> Self {
        let config = MissionConfig {
            min_separation_m: 0.0,
            ..self.config
        };
        Self { config, ..*self }
    }
}

impl Mission {
    /// Gain of the first hop, the factor of [`crate::sir::quiet`] in its SIR. `p_t` / `p_MSI`, in a field `p_t` `Upsilon_max` /
    /// eta.
    #[doc(hidden)]
    pub const fn tx_gain(&self) -> PowerRatio {
        self.tx_gain
    }

    /// Gain of a hop from a relay of `power_w` watts. (`p_u` / `p_MSI`)(eta / `mu_los`), in a field `p_u` `Upsilon_max` / `mu_los`.
    #[doc(hidden)]
    pub const fn relay_gain(&self, power_w: f32) -> PowerRatio {
        PowerRatio::new(power_w as f64 * self.relay_gain_per_w)
    }

    /// K of the last hop, m^2. The SIR at the receiver is K / squared distance to the relay of `power_w` watts.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    #[inline(never)] // called from many places
    pub const fn receiver_gain(&self, power_w: f32) -> f32 {
        (power_w as f64 * self.receiver_gain_per_w) as f32
    }

    /// Last hop's K over the first hop's gain, m^2: (`p_u` / `p_t`)(`mu_nlos` / eta)((X - D)^2 + Y^2).
    pub(crate) fn last_to_first(&self, power_w: f32) -> f64 {
        f64::from(power_w) * self.receiver_gain_per_w / self.tx_gain.wide()
    }

    /// Received power of Tx's signal at a relay with the squared distance `squared_m2`, W.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    pub(crate) fn first_hop_power_w(&self, squared_m2: f32) -> f32 {
        let loss = self.config.channel.eta() * f64::from(squared_m2);
        (f64::from(self.config.tx_power_w) / loss) as f32
    }
}

impl Mission {
    /// Returns the minimum step in x that keeps the separation of two neighbours. `across_squared`, m^2, is their squared distance
    /// across the line.
    pub(crate) fn least_step(&self, across_squared: f32) -> f32 {
        let apart = self.config.min_separation_m;
        if !(across_squared > 0.0) {
            return apart;
        }
        sqrt(apart * apart - across_squared)
    }

    /// Returns [`Mission::least_step`] plus a margin for rounding.
    pub(crate) fn step_with_room(&self, across_squared: f32) -> f32 {
        self.step_of(self.least_step(across_squared))
    }

    /// Returns the last x in pass order that leaves the relays after `index` their minimum separation, m. `across_squared` is the
    /// maximum squared distance across the line between two neighbours among them, m^2; it reduces the steps in x.
    pub(crate) fn end_for(&self, index: u16, across_squared: f32) -> f32 {
        self.end_after(self.behind(index), self.least_step(across_squared))
    }

    /// Returns the last x in pass order if the relays after `index` need no separation, m.
    pub(crate) fn end_freely(&self, index: u16) -> f32 {
        self.end_after(self.behind(index), 0.0)
    }

    /// Number of relays after `index` in pass order.
    fn behind(&self, index: u16) -> f32 {
        f32::from(match self.heading() {
            Heading::TowardRx => self.config.relays.saturating_sub(index),
            Heading::TowardTx => index.saturating_sub(1),
        })
    }

    /// Returns the largest x of relay `index` that leaves the relays between it and Rx their separation, m.
    pub(crate) fn latest(&self, index: u16) -> f32 {
        self.latest_at(index, self.config.min_separation_m)
    }

    /// Returns the largest x of relay `index` if those relays need no separation, m.
    pub(crate) fn latest_freely(&self, index: u16) -> f32 {
        self.latest_at(index, 0.0)
    }

    fn latest_at(&self, index: u16, least: f32) -> f32 {
        let after = f32::from(self.config.relays.saturating_sub(index));
        self.config.distance_m - after * self.step_of(least)
    }

    /// Returns the minimum step of two relays `least` apart, plus a margin for rounding, m.
    fn step_of(&self, least: f32) -> f32 {
        let distance_m = self.config.distance_m;
        if least > 0.0 {
            least + distance_m * ROUNDING
        } else {
            distance_m * FINEST_STEP
        }
    }

    fn end_after(&self, behind: f32, least: f32) -> f32 {
        let (distance_m, step) = (self.config.distance_m, self.step_of(least));
        match self.heading() {
            Heading::TowardRx => (distance_m - behind * step).max(0.0),
            Heading::TowardTx => (behind * step).min(distance_m),
        }
    }
}

/// Gain factor that makes a hop half as long as the others.
const HALF_AS_LONG: f64 = 0.25;

impl Mission {
    /// Returns the interferer if it is known.
    pub const fn known_source(&self) -> Option<Interferer> {
        match self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            _ => None,
        }
    }

    /// Returns the mission with the interference of `belief`, or with `own` if that refers to the mission.
    ///
    /// # Errors
    /// [`MissionError`] if the estimated interference is out of range.
    pub(crate) fn believing(
        &self,
        own: Interference,
        belief: &Belief,
    ) -> Result<Self, MissionError> {
        let (interference, spread, receiver_w) = match *belief {
            Belief::Mission => (own, Spread::Even, 0.0),
            Belief::Unknown(spread) => (Interference::Unknown, spread, 0.0),
            Belief::Source { source, receiver_w } => {
                (Interference::Source(source), Spread::Even, receiver_w)
            }
        };
        let config = MissionConfig {
            interference,
            ..self.config
        };
        let mut mission = Self::try_new(config)?;
        if receiver_w > 0.0 {
            let eta = config.channel.eta();
            let heard = f64::from(receiver_w) + f64::from(config.noise_w);
            mission.receiver_gain_per_w = 1.0 / (eta * heard);
        }
        match spread {
            Spread::Even => {}
            Spread::TowardTx => {
                mission.tx_gain = PowerRatio::new(mission.tx_gain.wide() * HALF_AS_LONG);
            }
            Spread::TowardRx => mission.receiver_gain_per_w *= HALF_AS_LONG,
        }
        Ok(mission)
    }
}

/// Substitute for an unknown interferer, so far away that (X - x)^2 + Y^2 is constant to 1e-7.
pub(super) const FAR: Interferer = Interferer {
    power_w: 1.0,
    x_m: 0.0,
    y_m: 1e7,
};

const FAR_AWAY: f64 = 1e-14;

/// Gains for an unknown interferer with relays of `power_w`. SIR = (D / d)^2 on every hop, so equal hops are best.
pub(super) const fn even_gains(distance_m: f32, power_w: f32) -> (f64, f64, f64) {
    let squared = distance_m as f64 * distance_m as f64;
    let power_w = power_w as f64;
    (
        squared * FAR_AWAY,
        squared * FAR_AWAY / power_w,
        squared / power_w,
    )
}
