//! The mission: everything the relays agree on before flight, validated once.

mod parts;

pub use parts::{Band, Heading, Interference, Interferer, Profile};

use parts::within;

use crate::channel::Channel;
use crate::field::Field;
use crate::power_ratio::PowerRatio;
use crate::root::sqrt;

/// The most relays a mission may have; addresses on the wire are 12 bits wide.
pub const MAX_RELAYS: u16 = 1000;

/// The parameters of a mission, as plain numbers; [`Mission::try_new`] checks them.
///
/// Frame: x runs along the ground from the transmitter (0) to the receiver (`distance_m`), y to its right as seen from above,
/// altitude is height above the ground.
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
    /// The altitudes that methods which choose altitudes may choose from, within 0.1 to 1e5; `common.altitude_m` is one of them.
    pub band: Band,
    /// The room beside the line that the joint method may use: y within -1e5 to 1e5, 0 among them.
    pub lateral: Band,
    /// Path loss of the three kinds of link.
    pub channel: Channel,
    /// What degrades the hops.
    pub interference: Interference,
    /// How close to the best SIR is close enough, relative: 1e-6 to 0.1.
    pub tolerance: f32,
}

impl MissionConfig {
    /// Whether that many relays are allowed, and fit.
    const fn room(&self) -> Result<(), MissionError> {
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
    /// `band` is not in order, not within 0.1 to 1e5, or leaves out `common.altitude_m`.
    Band,
    /// `lateral` is not in order, not within -1e5 to 1e5, or leaves out 0.
    Lateral,
    /// `interferer.power_w` is not within 1e-6 to 1e9.
    InterfererPower,
    /// `interferer.x_m` or `interferer.y_m` is not within -1e7 to 1e7.
    InterfererPlace,
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
            Self::Field => "a field of interference needs the feature `field`",
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
    tx_gain: PowerRatio,
    /// What a relay's transmit power is worth on a drone-to-drone hop, 1/W: eta / (`mu_los` `p_MSI`), in a field m^2/W:
    /// `Upsilon_max` / `mu_los`.
    relay_gain_per_w: f64,
    /// What it is worth on the last hop, m^2/W: (`mu_nlos` / eta) ((X - D)^2 + Y^2) / `p_MSI`, in a field Upsilon(D) / eta.
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
            relays: _,
            distance_m,
            min_separation_m,
            tx_power_w,
            common,
            band,
            lateral,
            channel,
            interference,
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
            if !within(interferer.power_w, 1e-6, 1e9) {
                return Err(MissionError::InterfererPower);
            }
            if !within(interferer.x_m, -1e7, 1e7) || !within(interferer.y_m, -1e7, 1e7) {
                return Err(MissionError::InterfererPlace);
            }
        }
        if !within(tolerance, 1e-6, 0.1) {
            return Err(MissionError::Tolerance);
        }
        if matches!(interference, Interference::Field(_)) && !cfg!(feature = "field") {
            return Err(MissionError::Field);
        }
        let eta = channel.eta();
        let (tx_gain, relay_gain_per_w, receiver_gain_per_w) = match interference {
            Interference::Source(interferer) => {
                let p_msi = interferer.power_w as f64;
                let beyond = interferer.x_m as f64 - distance_m as f64;
                let aside = interferer.y_m as f64;
                (
                    tx_power_w as f64 / p_msi,
                    eta / channel.mu_los() / p_msi,
                    channel.mu_nlos() / eta * (beyond * beyond + aside * aside) / p_msi,
                )
            }
            Interference::Field(field) => {
                let most = field.largest() as f64;
                (
                    tx_power_w as f64 * most / eta,
                    most / channel.mu_los(),
                    field.upsilon(distance_m) as f64 / eta,
                )
            }
        };
        Ok(Self {
            config,
            tx_gain: PowerRatio::new(tx_gain),
            relay_gain_per_w,
            receiver_gain_per_w,
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

    /// What degrades the hops.
    pub const fn interference(&self) -> &Interference {
        &self.config.interference
    }

    /// The interferer, where there is one.
    pub const fn interferer(&self) -> Option<&Interferer> {
        match &self.config.interference {
            Interference::Source(interferer) => Some(interferer),
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

    /// What multiplies the inverse interference of a place ([`crate::sir::quiet`]) on the first hop: `p_t` / `p_MSI`, in a field
    /// `p_t` `Upsilon_max` / eta.
    pub const fn tx_gain(&self) -> PowerRatio {
        self.tx_gain
    }

    /// What multiplies it on a hop that a relay of `power_w` watts feeds: (`p_u` / `p_MSI`)(eta / `mu_los`), in a field
    /// `p_u` `Upsilon_max` / `mu_los`.
    pub const fn relay_gain(&self, power_w: f32) -> PowerRatio {
        PowerRatio::new(power_w as f64 * self.relay_gain_per_w)
    }

    /// K of the last hop, m^2: SIR at the receiver = K / squared distance to the relay of `power_w` watts that feeds it.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    pub const fn receiver_gain(&self, power_w: f32) -> f32 {
        (power_w as f64 * self.receiver_gain_per_w) as f32
    }

    /// What the last hop's K is worth against the first hop's gain, m^2: (`p_u` / `p_t`)(`mu_nlos` / eta)((X - D)^2 + Y^2).
    pub(crate) fn last_to_first(&self, power_w: f32) -> f64 {
        f64::from(power_w) * self.receiver_gain_per_w / self.tx_gain.wide()
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

    /// Power that Tx's signal has at a relay whose squared distance is `squared_m2`, W.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    pub(crate) fn first_hop_power_w(&self, squared_m2: f32) -> f32 {
        let loss = self.config.channel.eta() * f64::from(squared_m2);
        (f64::from(self.config.tx_power_w) / loss) as f32
    }

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

#[cfg(test)]
pub(crate) mod tests;
