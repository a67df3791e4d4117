//! Mission: everything that the relays must know alike before flight, validated once.
//!
//! [`MissionConfig`] has the parameters as plain numbers, and [`MissionError`] names a rejected one; a [`Mission`] has checked parameters, and
//! quantities derived from them.

use crate::channel::Channel;
use crate::features::{ALTITUDE, FIELD, NOISE, REVERSE};
use crate::field::{Field, InNoise};
use crate::place::{CrossSection, Station};
use crate::root::PowerRatio;
use crate::root::sqrt;
use crate::side::Heading;

#[cfg(test)]
pub(crate) mod tests;

/// Maximum number of relays of a mission, the value of [`Mission::MAX_RELAYS`](Mission::MAX_RELAYS).
pub(crate) const MAX_RELAYS: u16 = 1000;

/// Smallest allowed step in x from one relay to the next, as a fraction of the distance from Tx to Rx. The step is at
/// least twice the spacing of f32 numbers near Rx, so that no two positions are equal.
pub(super) const FINEST_STEP: f32 = 1.0 / 4_194_304.0;

/// Maximum rounding error of the difference in x between two relays. The unit is the distance from Tx to Rx.
pub(super) const ROUNDING: f32 = 2.0 * FINEST_STEP;

/// Parameters of a mission; [`Mission::try_new`](Mission::try_new) checks them.
///
/// Frame: x runs along the ground from the transmitter (0) to the receiver (`distance_m`), y to the right for an
/// observer who looks along x, altitude is height above the ground.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MissionConfig {
    /// Number of relays N, 1 to [`Mission::MAX_RELAYS`](Mission::MAX_RELAYS).
    pub relays: u16,
    /// Distance D from transmitter to receiver, m: 1 to 1e6.
    pub distance_m: f32,
    /// Minimum distance between two relays, m: 0 to 1e5.
    pub min_separation_m: f32,
    /// Transmit power of the ground transmitter, W: 1e-6 to 1e6.
    pub tx_power_w: f32,
    /// Altitude and transmit power of every relay whose settings contain no profile. See
    /// [`Settings::profile`](crate::Settings::profile).
    pub common: Profile,
    /// Range of altitudes, m, for methods that choose altitudes. Within 0.1 to 1e5; includes `common.altitude_m`.
    pub band: Band,
    /// Range of lateral offsets y for [`Method::Joint`](crate::Method::Joint), m. Within -1e5 to 1e5; includes 0.
    pub lateral: Band,
    /// Path loss of the three kinds of link: drone to drone, drone to ground, and interferer to Rx.
    pub channel: Channel,
    /// Interference on the hops: a transmitter at a known or unknown position, or an interference field. A field gives
    /// the distribution of the interference for every x.
    pub interference: Interference,
    /// Noise power at the input of every receiver, W: 0 to 1. At most 1e12 times the interferer's power received at 1
    /// m. 0 means receivers without noise, as in the paper. Above 0, every SIR is the SINR: signal over interference
    /// plus noise.
    pub noise_w: f32,
    /// Ratio r: SIR required for data toward Tx, divided by that required for data toward Rx; 0 to 1.
    ///
    /// 0 means data from Tx to Rx only, as in the paper. Above 0, once the interference is known, the value of a hop is
    /// the lower of two: the SIR toward Rx, and the SIR toward Tx divided by r.
    pub reverse: f32,
    /// Transmit power of the ground receiver when it sends toward Tx, W: 1e-6 to 1e6. It has no effect if `reverse` is
    /// 0.
    pub rx_power_w: f32,
    /// SNR gap of fitted slots (time slots as long as each hop needs), linear: 1 to 1000. 0 means slots of equal
    /// length. With a gap above 0, [`Method::Joint`](crate::Method::Joint) maximises the data rate. The spectral
    /// efficiency of a hop is log2(1 + SINR / gap).
    pub fitted_gap: f32,
    /// Relative tolerance of the SIR: 1e-6 to 0.1. A chain of relays is accepted if the SIR of its worst hop is within
    /// this fraction of the best possible value.
    pub tolerance: f32,
}

impl MissionConfig {
    /// Checks the number of relays, and that the relays fit between Tx and Rx. Adjacent relays need the minimum
    /// separation, plus a margin for rounding.
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

    /// Checks the parameters of the data link: `reverse`, `rx_power_w` and `fitted_gap`.
    const fn data_link(&self) -> Result<(), MissionError> {
        if !within(self.reverse, 0.0, 1.0) {
            return Err(MissionError::Reverse);
        }
        if !within(self.rx_power_w, 1e-6, 1e6) {
            return Err(MissionError::RxPower);
        }
        if self.reverse > 0.0 && !REVERSE {
            return Err(MissionError::ReverseFeature);
        }
        if self.fitted_gap.to_bits() != 0 {
            if !ALTITUDE {
                return Err(MissionError::FittedFeature);
            }
            if !within(self.fitted_gap, 1.0, 1e3) {
                return Err(MissionError::FittedGap);
            }
        }
        Ok(())
    }
}

/// Parameter of a [`MissionConfig`] that is rejected, and its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MissionError {
    /// `relays` is not within 1 to [`Mission::MAX_RELAYS`](Mission::MAX_RELAYS).
    Relays,
    /// `distance_m` is not within 1 to 1e6.
    Distance,
    /// `min_separation_m` is not within 0 to 1e5.
    Separation,
    /// The distance `distance_m` is too short for `relays` relays that are `min_separation_m` apart. The required
    /// distance includes a rounding margin of 5e-7 `distance_m` per relay.
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
    /// `noise_w` is above 0, and the crate was built without its feature `noise`.
    NoiseFeature,
    /// `interference` is `Interference::Field`, and the crate was built without its feature `field`.
    Field,
    /// `reverse` is not within 0 to 1.
    Reverse,
    /// `reverse` is above 0, and the crate was built without its feature `reverse`.
    ReverseFeature,
    /// `rx_power_w` is not within 1e-6 to 1e6.
    RxPower,
    /// `fitted_gap` is neither 0 nor within 1 to 1000.
    FittedGap,
    /// `fitted_gap` is not 0, and the crate was built without its feature `altitude`.
    FittedFeature,
    /// `tolerance` is not within 1e-6 to 0.1.
    Tolerance,
}

error_texts!(MissionError {
    Relays => "the number of relays must be within 1 to 1000",
    Distance => "distance_m must be within 1 to 1e6",
    Separation => "min_separation_m must be within 0 to 1e5",
    TooManyForDistance => "(relays - 1) x min_separation_m must be at most distance_m",
    TxPower => "tx_power_w must be within 1e-6 to 1e6",
    Common => "common.altitude_m must be within 0.1 to 1e5, common.power_w within 1e-6 to 1e6",
    Band => "the altitude band, band.least_m to band.most_m, must be within 0.1 to 1e5 and include common.altitude_m",
    Lateral => "lateral.least_m must be within -1e5 to 0, lateral.most_m within 0 to 1e5",
    InterfererPower => "interferer.power_w must be within 1e-6 to 1e9",
    InterfererPlace => "interferer.x_m and y_m must be within -1e7 to 1e7",
    Noise => "noise_w must be within 0 to 1, and at most 1e12 times the power received from the interferer at a distance of 1 m",
    NoiseFeature => "a noise_w above 0 needs the cargo feature `noise`",
    Field => "an interference field needs the cargo feature `field`",
    Reverse => "reverse (SIR required from Rx to Tx, as a share of the SIR from Tx to Rx) must be within 0 to 1",
    ReverseFeature => "a reverse above 0 needs the cargo feature `reverse`",
    RxPower => "rx_power_w must be within 1e-6 to 1e6",
    FittedGap => "fitted_gap must be 0 (equal time slots), or within 1 to 1000 (time slots fitted to the hops; linear SNR gap to the Shannon limit)",
    FittedFeature => "a fitted_gap above 0 (time slots fitted to the hops) needs the cargo feature `altitude`",
    Tolerance => "tolerance must be within 1e-6 to 0.1",
});

/// Interferer on the ground (MSI in the paper), such as a jammer, a base station or a licensed user.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interferer {
    /// Transmit power of the interferer, W.
    pub power_w: f32,
    /// x of the interferer, m: 0 is the x of Tx, D the x of Rx. May be below 0 or above D.
    pub x_m: f32,
    /// Lateral offset of the interferer, m. Positive to the right for an observer at Tx who looks to Rx.
    pub y_m: f32,
}

impl Interferer {
    pub(super) const fn is_powered(&self) -> bool {
        within(self.power_w, 1e-6, 1e9)
    }

    pub(super) const fn is_placed(&self) -> bool {
        within(self.x_m, -1e7, 1e7) && within(self.y_m, -1e7, 1e7)
    }

    /// Returns true if the interferer's power and position are within their allowed ranges.
    pub const fn is_valid(&self) -> bool {
        self.is_powered() && self.is_placed()
    }
}

/// Kind of interference that degrades the hops of a mission.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Interference {
    /// Single interfering transmitter at a known position.
    Source(Interferer),
    /// Interference field: for every x, the distribution of the interference is known; its sources are not.
    Field(Field),
    /// Single interfering transmitter at an unknown position. The relays spread evenly until they have estimated the
    /// interference ([`crate::Settings::listen`]).
    Unknown,
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
    /// Smallest allowed altitude, or smallest allowed lateral offset, of the relays, m.
    pub least_m: f32,
    /// Upper limit of the altitudes or lateral offsets, m: at least `least_m`.
    pub most_m: f32,
}

impl Band {
    /// Lateral range that allows y = 0 only. Relays then stay in the vertical plane through Tx and Rx, as in the paper.
    pub const NONE: Self = Self::at(0.0);

    /// Returns the range that contains only the value `at_m`, m.
    pub const fn at(at_m: f32) -> Self {
        Self {
            least_m: at_m,
            most_m: at_m,
        }
    }

    /// Returns the value in this range that is nearest to `at_m`, m.
    pub const fn nearest(self, at_m: f32) -> f32 {
        if at_m >= self.most_m {
            self.most_m
        } else if at_m > self.least_m {
            at_m
        } else {
            self.least_m
        }
    }

    /// Width of this range of altitudes or lateral offsets, m: upper limit minus lower limit.
    pub const fn span_m(self) -> f32 {
        self.most_m - self.least_m
    }

    /// Returns true if this range contains a single value, so that the relay has no choice.
    pub const fn is_single(self) -> bool {
        !(self.least_m < self.most_m)
    }

    /// Returns true if this is a valid range of altitudes: limits in order and within 0.1 to 1e5 m.
    pub(super) const fn is_of_altitudes(self) -> bool {
        within(self.least_m, 0.1, 1e5) && within(self.most_m, self.least_m, 1e5)
    }

    /// Returns true if this is a valid lateral range: limits in order, within -1e5 to 1e5 m, including 0.
    pub(super) const fn is_room_beside(self) -> bool {
        within(self.least_m, -1e5, 0.0) && within(self.most_m, 0.0, 1e5)
    }
}

/// Altitude and transmit power that the mission gives to one relay.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Profile {
    /// Altitude above the ground plane at which the relay flies, m: 0.1 to 1e5.
    pub altitude_m: f32,
    /// Transmit power of the relay, W: 1e-6 to 1e6.
    pub power_w: f32,
}

impl Profile {
    /// Returns true if the altitude and the transmit power are within their allowed ranges.
    pub const fn is_valid(&self) -> bool {
        within(self.altitude_m, 0.1, 1e5) && within(self.power_w, 1e-6, 1e6)
    }

    /// Returns this altitude and power as those of a relay vertically above the line Tx to Rx (y = 0).
    pub const fn on_line(self) -> Station {
        Station {
            cross_section: CrossSection::on_line(self.altitude_m),
            power_w: self.power_w,
        }
    }
}

pub(super) const fn within(value: f32, least: f32, most: f32) -> bool {
    value >= least && value <= most
}

/// Validated mission: its parameters, and quantities derived from them.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mission {
    pub(super) config: MissionConfig,
    pub(super) tx_gain: PowerRatio,
    /// Gain of a drone-to-drone hop per watt of the sender's power; see [`Mission::relay_gain`].
    ///
    /// With one interferer of power `p_MSI` the gain is eta / (`mu_los` `p_MSI`), 1/W. In an interference field it is
    /// `Upsilon_max` / `mu_los`, m^2/W. `Upsilon_max` is the largest mean inverse interference, E[1/I], in the field.
    /// eta is the path-loss factor drone to ground, `mu_los` that drone to drone.
    pub(super) relay_gain_per_w: f64,
    /// Gain of the last hop (to Rx) per watt of its sender's power, m^2/W. The SIR at Rx is this gain times the
    /// sender's power, divided by the squared distance.
    ///
    /// With an interferer of power `p_MSI` at (X, Y), the gain is (`mu_nlos` / eta) ((X - D)^2 + Y^2) / `p_MSI`. In a
    /// field it is the mean inverse interference E[1/I] at Rx, divided by eta. eta is the path-loss factor drone to
    /// ground, `mu_nlos` that from the interferer to Rx. With noise, the interference at Rx includes the noise.
    pub(super) receiver_gain_per_w: f64,
    /// Receiver noise divided by the interferer's power received at 1 m, 1/m^2. This is nu = N eta / `p_MSI`, with the
    /// noise N, the path-loss factor eta and the interferer's power `p_MSI`. It is 0 without noise, and in an
    /// interference field.
    pub(super) noise_at_a_metre: f32,
}

/// Maximum receiver noise relative to the interferer's power received at 1 m. With more noise, f32 rounding would
/// hide the interferer.
const MOST_NOISE: f64 = 1e12;

impl Mission {
    /// Maximum number of relays of a mission. The frames on the wire allow node numbers up to 4094.
    pub const MAX_RELAYS: u16 = MAX_RELAYS;

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
            reverse: _,
            rx_power_w: _,
            fitted_gap: _,
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
        if let Err(error) = config.data_link() {
            return Err(error);
        }
        if !within(noise_w, 0.0, 1.0) {
            return Err(MissionError::Noise);
        }
        if noise_w > 0.0 && !NOISE {
            return Err(MissionError::NoiseFeature);
        }
        if matches!(interference, Interference::Field(_)) && !FIELD {
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

    /// Creates a mission in a `const`; an invalid parameter fails the build. In all other respects it is
    /// [`Mission::try_new`].
    ///
    /// [`Channel::from_db`](crate::Channel::from_db) cannot be used in a constant;
    /// [`Channel::new`](crate::Channel::new), which takes the losses as factors, 10^(dB / 10), can:
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
    ///     reverse: 0.0,
    ///     rx_power_w: 80.0,
    ///     fitted_gap: 0.0,
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
    /// #   reverse: 0.0,
    /// #   rx_power_w: 80.0,
    /// #   fitted_gap: 0.0,
    /// #   tolerance: 1e-4,
    /// });
    /// # assert_eq!(MISSION.relays(), 0);
    /// ```
    ///
    /// # Panics
    /// Panics on a parameter outside its range: in a `const` this is a failed build, as intended. For values known at
    /// run time use [`Mission::try_new`].
    #[expect(
        clippy::panic,
        reason = "in a constant this fails the build, as documented"
    )]
    pub const fn new(config: MissionConfig) -> Self {
        match Self::try_new(config) {
            Ok(mission) => mission,
            Err(error) => panic!("{}", error.text()),
        }
    }

    /// Returns the parameters from which the mission was created.
    pub const fn config(&self) -> &MissionConfig {
        &self.config
    }

    /// Returns the number N of relays of the mission.
    pub const fn relays(&self) -> u16 {
        self.config.relays
    }

    /// Returns the kind of interference in this mission.
    pub const fn interference(&self) -> &Interference {
        &self.config.interference
    }

    /// Returns the interferer; `None` for a mission with an interference field. For an unknown interferer the result is
    /// a substitute far away, with equal interference everywhere.
    pub const fn interferer(&self) -> Option<&Interferer> {
        match &self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            Interference::Unknown => Some(&FAR),
            Interference::Field(_) => None,
        }
    }

    /// Returns the interference field (distribution for every x), or `None` for a single transmitter.
    pub const fn field(&self) -> Option<&Field> {
        match &self.config.interference {
            Interference::Field(field) if FIELD => Some(field),
            _ => None,
        }
    }

    /// Returns the interference field combined with the receiver noise. `None` for a mission without a field.
    #[doc(hidden)]
    pub const fn heard(&self) -> Option<InNoise<'_>> {
        match self.field() {
            Some(field) => Some(field.in_noise(self.config.noise_w)),
            None => None,
        }
    }

    /// Returns the receiver noise divided by the interferer's power received at 1 m, 1/m^2. This is nu = N eta /
    /// `p_MSI`, with the noise N, the path-loss factor eta drone to ground and the interferer's power `p_MSI`.
    ///
    /// The result is 0 without noise. It is also 0 in an interference field, because the field's mean inverse
    /// interference (Upsilon) includes the noise.
    pub const fn noise_at_a_metre(&self) -> f32 {
        if NOISE { self.noise_at_a_metre } else { 0.0 }
    }

    /// Returns r: the SIR required for data from Rx to Tx, divided by that for data from Tx to Rx. r is 0 for data from
    /// Tx to Rx only.
    ///
    /// While the interferer is unknown r is 0, because relays then spread evenly. Without the feature `reverse` the
    /// function returns a constant, so that the compiler drops the code for two directions.
    pub const fn reverse(&self) -> f32 {
        if REVERSE && !matches!(self.config.interference, Interference::Unknown) {
            self.config.reverse
        } else {
            0.0
        }
    }

    /// Returns the SNR gap of fitted slots (as long as each hop needs), linear; 0 for equal slots. It is 0 while the
    /// interferer is unknown, because relays then spread evenly. Without the feature `altitude` the function returns a
    /// constant.
    pub const fn fitted_gap(&self) -> f32 {
        if ALTITUDE && !matches!(self.config.interference, Interference::Unknown) {
            self.config.fitted_gap
        } else {
            0.0
        }
    }

    /// Returns the order in which the relays compute their positions. The order is toward Rx (relay 1 to N), or in an
    /// interference field toward Tx (relay N to 1).
    #[doc(hidden)]
    pub const fn heading(&self) -> Heading {
        match self.field() {
            None => Heading::TowardRx,
            Some(_) => Heading::TowardTx,
        }
    }

    /// Returns the index of the leader, which computes its position first. The leader is relay 1, or relay N in a
    /// mission with an interference field.
    pub const fn leader(&self) -> u16 {
        match self.heading() {
            Heading::TowardRx => 1,
            Heading::TowardTx => self.config.relays,
        }
    }

    /// Returns the relay whose position is computed next after relay `index`. `None` if relay `index` is the last.
    pub const fn after(&self, index: u16) -> Option<u16> {
        match self.heading() {
            Heading::TowardRx if index < self.config.relays => Some(index + 1),
            Heading::TowardTx if index > 1 => Some(index - 1),
            _ => None,
        }
    }

    /// Returns the same mission with `relays` relays.
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
}

impl Mission {
    /// Returns the gain A of the first hop (from Tx). The SIR of this hop is A times the inverse interference
    /// ([`crate::sir::quiet`]), divided by the squared length. With one interferer A is the power of Tx divided by the
    /// power of the interferer, `p_t` / `p_MSI`. In an interference field A is `p_t` `Upsilon_max` / eta. `Upsilon_max`
    /// is the largest mean inverse interference, E[1/I], in the field, eta the path-loss factor drone to ground.
    #[doc(hidden)]
    pub const fn tx_gain(&self) -> PowerRatio {
        self.tx_gain
    }

    /// Returns the gain of a hop from a relay of `power_w` watts to a drone: a factor in the hop's SIR.
    ///
    /// The hop's SIR is this gain times the inverse interference ([`crate::sir::quiet`]), divided by the squared
    /// length. With one interferer the gain is (`p_u` / `p_MSI`) (eta / `mu_los`). `p_u` and `p_MSI` are the powers of
    /// relay and interferer, eta and `mu_los` the path-loss factors drone to ground and drone to drone. In an
    /// interference field the gain is `p_u` `Upsilon_max` / `mu_los`, with the field's largest E[1/I].
    #[doc(hidden)]
    pub const fn relay_gain(&self, power_w: f32) -> PowerRatio {
        PowerRatio::new(power_w as f64 * self.relay_gain_per_w)
    }

    /// Returns the factor K of the last hop, m^2, for a last relay of `power_w` watts. The SIR at Rx is K divided by
    /// the squared length of this hop.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    #[inline(never)] // called from many places
    pub const fn receiver_gain(&self, power_w: f32) -> f32 {
        (power_w as f64 * self.receiver_gain_per_w) as f32
    }

    /// Returns G, m^2, which determines the optimal position of a single relay of `power_w` watts.
    ///
    /// G is K / A: the last hop's factor K divided by the first hop's gain A. With one interferer at (X, Y) it is
    /// (`p_u` / `p_t`) (`mu_nlos` / eta) ((X - D)^2 + Y^2). `p_u` and `p_t` are the transmit powers of the relay and of
    /// Tx. `mu_nlos` is the path-loss factor from the interferer to Rx, eta the path-loss factor between drone and
    /// ground.
    #[doc(hidden)]
    pub fn last_to_first(&self, power_w: f32) -> f64 {
        f64::from(power_w) * self.receiver_gain_per_w / self.tx_gain.wide()
    }

    /// Returns the power that a relay receives from Tx, W. `squared_m2` is the squared distance from Tx to the relay,
    /// m^2.
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
    /// Returns the minimum step in x, m, that keeps two neighbours at their minimum separation. `across_squared`, m^2,
    /// is their squared distance in y and altitude.
    pub(crate) fn least_step(&self, across_squared: f32) -> f32 {
        let apart = self.config.min_separation_m;
        if !(across_squared > 0.0) {
            return apart;
        }
        sqrt(apart * apart - across_squared)
    }

    /// Returns the minimum step in x for the separation of two neighbours, m, plus a margin for rounding.
    /// `across_squared`, m^2, is their squared distance in y and altitude.
    pub(crate) fn step_with_room(&self, across_squared: f32) -> f32 {
        self.step_of(self.least_step(across_squared))
    }

    /// Returns the farthest x of relay `index`, m, at which later relays can still keep their separation. Later relays
    /// are those whose positions are computed after the position of relay `index`.
    ///
    /// Farthest means toward Rx, or toward Tx with an interference field. `across_squared` is the largest squared
    /// distance, in y and altitude, between two neighbours among the later relays, m^2. A larger value allows smaller
    /// steps in x.
    pub(crate) fn end_for(&self, index: u16, across_squared: f32) -> f32 {
        self.end_after(self.behind(index), self.least_step(across_squared))
    }

    /// Returns the farthest x of relay `index`, m, if y and altitude alone keep the later relays apart. Later relays
    /// are those whose positions are computed after the position of relay `index`.
    ///
    /// Farthest means toward Rx, or toward Tx with an interference field.
    pub(crate) fn end_freely(&self, index: u16) -> f32 {
        self.end_after(self.behind(index), 0.0)
    }

    /// Returns the number of relays whose positions are computed after relay `index`.
    fn behind(&self, index: u16) -> f32 {
        f32::from(match self.heading() {
            Heading::TowardRx => self.config.relays.saturating_sub(index),
            Heading::TowardTx => index.saturating_sub(1),
        })
    }

    /// Returns the largest x of relay `index`, m, at which the relays nearer to Rx can keep the separation.
    pub(crate) fn latest(&self, index: u16) -> f32 {
        self.latest_at(index, self.config.min_separation_m)
    }

    /// Returns the largest x of relay `index`, m, if y and altitude keep the relays nearer to Rx apart.
    pub(crate) fn latest_freely(&self, index: u16) -> f32 {
        self.latest_at(index, 0.0)
    }

    fn latest_at(&self, index: u16, least: f32) -> f32 {
        let after = f32::from(self.config.relays.saturating_sub(index));
        self.config.distance_m - after * self.step_of(least)
    }

    /// Returns the step in x, m, that keeps two relays at least `least`, m, from each other after rounding.
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

/// Factor on the gain of the first or the last hop that makes this hop half as long as an inner hop. In the best chain
/// all hops have the same SIR, and the SIR of a hop is its gain divided by the squared length.
const HALF_AS_LONG: f64 = 0.25;

impl Mission {
    /// Returns the interferer if its position is known. `None` for an unknown interferer and for an interference field.
    pub const fn known_source(&self) -> Option<Interferer> {
        match self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            _ => None,
        }
    }

    /// Returns this mission with `interference` in place of its configured interference.
    ///
    /// `receiver_w` is the interference power at the ground receiver, W; with 0 it is computed from `interference`.
    /// `halved` has two flags: for the first hop (from Tx) and for the last hop (to Rx). A true flag makes its hop half
    /// as long as the inner hops.
    ///
    /// # Errors
    /// [`MissionError`] if the interference is out of range.
    pub(crate) fn with_interference(
        &self,
        interference: Interference,
        receiver_w: f32,
        halved: [bool; 2],
    ) -> Result<Self, MissionError> {
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
        let [first, last] = halved;
        if first {
            mission.tx_gain = PowerRatio::new(mission.tx_gain.wide() * HALF_AS_LONG);
        }
        if last {
            mission.receiver_gain_per_w *= HALF_AS_LONG;
        }
        Ok(mission)
    }
}

/// Substitute for an interferer at an unknown position. This substitute is so far away that the interference at all
/// receivers is equal to within 1e-7.
pub(super) const FAR: Interferer = Interferer {
    power_w: 1.0,
    x_m: 0.0,
    y_m: 1e7,
};

const FAR_AWAY: f64 = 1e-14;

/// Returns the gains for an unknown interferer, with which the best chain has hops of equal length.
///
/// The result is the gain of the first hop, the gain per watt of an inner hop, and the gain per watt of the last hop.
/// `power_w` is the transmit power of the relays, W. Every hop of length d has the SIR (`distance_m` / d)^2.
pub(super) const fn even_gains(distance_m: f32, power_w: f32) -> (f64, f64, f64) {
    let squared = distance_m as f64 * distance_m as f64;
    let power_w = power_w as f64;
    (
        squared * FAR_AWAY,
        squared * FAR_AWAY / power_w,
        squared / power_w,
    )
}
