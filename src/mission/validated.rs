//! A mission whose parameters have been checked, and what is asked of it.
//!
//! Of a mission follow the power ratios of its hops, the least steps between its relays, and a mission with the interference that the relays have
//! found, or with none known.

use super::config::{
    FINEST_STEP, Heading, Interference, Interferer, MissionConfig, MissionError, ROUNDING, within,
};
use crate::field::{Field, InNoise};
use crate::power_ratio::PowerRatio;
use crate::root::sqrt;
use crate::sensing::belief::{Belief, Spread};
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
    /// The most relays a mission may have; addresses on the wire are 12 bits wide.
    pub const MAX_RELAYS: u16 = super::config::MAX_RELAYS;

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

impl Mission {
    /// What multiplies the inverse interference of a place ([`crate::sir::quiet`]) on the first hop: `p_t` / `p_MSI`, in a field
    /// `p_t` `Upsilon_max` / eta.
    #[doc(hidden)]
    pub const fn tx_gain(&self) -> PowerRatio {
        self.tx_gain
    }

    /// What multiplies it on a hop that a relay of `power_w` watts feeds: (`p_u` / `p_MSI`)(eta / `mu_los`), in a field
    /// `p_u` `Upsilon_max` / `mu_los`.
    #[doc(hidden)]
    pub const fn relay_gain(&self, power_w: f32) -> PowerRatio {
        PowerRatio::new(power_w as f64 * self.relay_gain_per_w)
    }

    /// K of the last hop, m^2: SIR at the receiver = K / squared distance to the relay of `power_w` watts that feeds it.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    #[inline(never)] // called from many places
    pub const fn receiver_gain(&self, power_w: f32) -> f32 {
        (power_w as f64 * self.receiver_gain_per_w) as f32
    }

    /// What the last hop's K is worth against the first hop's gain, m^2: (`p_u` / `p_t`)(`mu_nlos` / eta)((X - D)^2 + Y^2).
    pub(crate) fn last_to_first(&self, power_w: f32) -> f64 {
        f64::from(power_w) * self.receiver_gain_per_w / self.tx_gain.wide()
    }

    /// Power that Tx's signal has at a relay whose squared distance is `squared_m2`, W.
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
    /// The least step in x between neighbours that are `across_squared` m^2 apart across the line: what keeps the separation
    /// asked for.
    pub(crate) fn least_step(&self, across_squared: f32) -> f32 {
        let apart = self.config.min_separation_m;
        if !(across_squared > 0.0) {
            return apart;
        }
        sqrt(apart * apart - across_squared)
    }

    /// The same with room for rounding.
    pub(crate) fn step_with_room(&self, across_squared: f32) -> f32 {
        self.step_of(self.least_step(across_squared))
    }

    /// The last place on its way that leaves the relays after `index` room to stand `min_separation_m` apart, m.
    ///
    /// `across_squared` is how far apart across the line two neighbours among them may be, m^2: that much they need not be along
    /// x.
    pub(crate) fn end_for(&self, index: u16, across_squared: f32) -> f32 {
        self.end_after(self.behind(index), self.least_step(across_squared))
    }

    /// The same where whoever comes after may stand as close as they like.
    pub(crate) fn end_freely(&self, index: u16) -> f32 {
        self.end_after(self.behind(index), 0.0)
    }

    /// How many relays come after `index` on the way of a pass.
    fn behind(&self, index: u16) -> f32 {
        f32::from(match self.heading() {
            Heading::TowardRx => self.config.relays.saturating_sub(index),
            Heading::TowardTx => index.saturating_sub(1),
        })
    }

    /// The last place of relay `index` toward Rx that leaves those after it their separation, m.
    pub(crate) fn latest(&self, index: u16) -> f32 {
        self.latest_at(index, self.config.min_separation_m)
    }

    /// The same where those may stand as close as they like.
    pub(crate) fn latest_freely(&self, index: u16) -> f32 {
        self.latest_at(index, 0.0)
    }

    fn latest_at(&self, index: u16, least: f32) -> f32 {
        let after = f32::from(self.config.relays.saturating_sub(index));
        self.config.distance_m - after * self.step_of(least)
    }

    /// What a step between two that must be `least` apart takes with its rounding, m.
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

/// A hop half as long as the others.
const HALF_AS_LONG: f64 = 0.25;

impl Mission {
    /// The interferer, where it is known and not one that stands for none.
    pub const fn known_source(&self) -> Option<Interferer> {
        match self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            _ => None,
        }
    }

    /// The same mission, whose interference is `own` or what is believed instead.
    ///
    /// # Errors
    /// [`MissionError`] where what is believed is out of range.
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

/// What takes the place of an interferer that nobody knows: one so far away that it is the same everywhere, (X - x)^2 + Y^2 to 1e-7.
pub(super) const FAR: Interferer = Interferer {
    power_w: 1.0,
    x_m: 0.0,
    y_m: 1e7,
};

/// One over the square of its distance.
const FAR_AWAY: f64 = 1e-14;

/// The gains of a mission that knows nothing, of relays of `power_w`: on every hop SIR = (D / d)^2, so that the best places are even ones.
pub(super) const fn even_gains(distance_m: f32, power_w: f32) -> (f64, f64, f64) {
    let squared = distance_m as f64 * distance_m as f64;
    let power_w = power_w as f64;
    (
        squared * FAR_AWAY,
        squared * FAR_AWAY / power_w,
        squared / power_w,
    )
}
