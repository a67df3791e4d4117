//! Options of the mission.

use clap::{Args, ValueEnum};
use uav_relay::channel::AirGround;
use uav_relay::mission::MissionError;
use uav_relay::{Adjust, Band, Channel, Interference, Interferer, Mission, MissionConfig, Profile};
use uav_relay_scenario::deployment::COMPANION_TOLERANCE;
use uav_relay_scenario::number::narrow;

use crate::command::{named, number};

/// Permitted range of the distance from transmitter to receiver, m.
pub const DISTANCE_M: [f32; 2] = [1.0, 1e6];

/// Permitted range of an altitude, m.
pub const ALTITUDE_M: [f32; 2] = [0.1, 1e4];

/// Permitted range of the left limit of relay positions: lateral position y, m (facing the receiver).
pub const LEFT_M: [f32; 2] = [-1e5, 0.0];

/// Permitted range of the right limit of relay positions: lateral position y, m (facing the receiver).
pub const RIGHT_M: [f32; 2] = [0.0, 1e5];

/// Permitted range of a transmit power, W.
pub const POWER_W: [f32; 2] = [1e-6, 1e6];

/// Permitted range of a noise power, W.
pub const NOISE_W: [f32; 2] = [0.0, 1.0];

/// Permitted range of `--reverse`: the required SIR toward Tx, divided by the SIR toward Rx.
pub const REVERSE: [f32; 2] = [0.0, 1.0];

/// Permitted range of `--fitted-gap`, if it is not 0: SNR gap of fitted time slots, a power ratio.
pub const FITTED_GAP: [f32; 2] = [1.0, 1e3];

fn fitted_gap(text: &str) -> Result<f32, String> {
    if text == "0" {
        Ok(0.0)
    } else {
        number(FITTED_GAP, "")(text)
    }
}

/// Permitted range of the minimum separation of two relays, m.
pub const SEPARATION_M: [f32; 2] = [0.0, 1e5];

const PAPERS: Interference = Interference::Source(Interferer {
    power_w: 80.0,
    x_m: 500.0,
    y_m: 400.0,
});

/// Placement method.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Method {
    /// Algorithm 1; with --field Algorithm 4
    Align,
    /// Joint optimisation of positions, sides and altitudes
    #[value(alias = "altitude")]
    Joint,
    /// Algorithm 1, then Algorithm 2
    Adjust,
}

impl From<Method> for uav_relay::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Align => Self::Align,
            Method::Joint => Self::Joint,
            Method::Adjust => Self::Adjust(Adjust::default()),
        }
    }
}

/// Options of a mission, except the number of relays.
#[derive(Args, Debug)]
pub struct MissionOptions {
    /// Distance from transmitter to receiver, m, 1 to 1e6
    #[arg(long, value_name = "M", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = number(DISTANCE_M, "m"))]
    pub distance: f32,
    /// Altitude of every relay, m, 0.1 to 1e4
    #[arg(long, value_name = "M", default_value_t = 20.0, allow_negative_numbers = true, value_parser = number(ALTITUDE_M, "m"))]
    pub altitude: f32,
    /// Range of altitudes to choose from, m, 0.1 to 1e4, including --altitude; default: --altitude alone
    #[arg(long, value_name = "LEAST,MOST", allow_hyphen_values = true, value_parser = band)]
    pub band: Option<Band>,
    /// Left limit of the places that `joint` chooses, facing the receiver, as y in m, -1e5 to 0
    #[arg(long = "lateral-min-m", value_name = "M", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number(LEFT_M, "m"))]
    pub lateral_min: f32,
    /// Right limit of the places that `joint` chooses, facing the receiver, as y in m, 0 to 1e5
    #[arg(long = "lateral-max-m", value_name = "M", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number(RIGHT_M, "m"))]
    pub lateral_max: f32,
    /// Power of the transmitter, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", default_value_t = 80.0, allow_negative_numbers = true, value_parser = number(POWER_W, "W"))]
    pub tx_power: f32,
    /// Power of every relay, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", default_value_t = 1.0, allow_negative_numbers = true, value_parser = number(POWER_W, "W"))]
    pub uav_power: f32,
    /// Interferer: power (W, 1e-6 to 1e9) and position x, y (m, -1e7 to 1e7). x is toward the receiver, y to the
    /// right when facing it. `unknown` for relays that listen; default 80,500,400
    #[arg(long, value_name = "P,X,Y", allow_hyphen_values = true, value_parser = guess)]
    pub interferer: Option<Interference>,
    /// Noise power at every receiver, W, 0 to 1
    #[arg(long, value_name = "W", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number(NOISE_W, "W"))]
    pub noise: f32,
    /// SIR that a hop needs toward the transmitter, relative to its SIR toward the receiver, 0 to 1. 0 means traffic
    /// toward the receiver only
    #[arg(long, value_name = "R", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number(REVERSE, ""))]
    pub reverse: f32,
    /// Power with which the receiver sends toward the transmitter, W, 1e-6 to 1e6; default: --tx-power
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = number(POWER_W, "W"))]
    pub rx_power: Option<f32>,
    /// SNR gap of fitted slots, linear, 1 to 1000; 0 for equal slots. With a gap each slot is as long as its hop
    /// needs, and `joint` chooses the places with the largest data rate
    #[arg(long, value_name = "G", default_value_t = 0.0, allow_negative_numbers = true, value_parser = fitted_gap)]
    pub fitted_gap: f32,
    /// Minimum distance between two relays, m, 0 to 1e5
    #[arg(long, value_name = "M", default_value_t = 4.0, allow_negative_numbers = true, value_parser = number(SEPARATION_M, "m"))]
    pub min_separation: f32,
}

impl MissionOptions {
    /// Returns the interference of the command line, otherwise `field`, otherwise the paper's interferer.
    ///
    /// `field` is the interference as a function of x (position along the line Tx to Rx) in the `--config` file.
    pub fn interference(&self, field: Option<Interference>) -> Interference {
        self.interferer.or(field).unwrap_or(PAPERS)
    }

    /// Returns the mission's parameters for `relays` relays. Without `channel`, the mission has the paper's channel.
    ///
    /// # Errors
    /// One line that states the fault.
    pub fn config(
        &self,
        relays: u16,
        interference: Interference,
        channel: Option<Channel>,
    ) -> Result<MissionConfig, String> {
        // 2 GHz, excess losses of 0.1 dB and 21 dB with and without line of sight: bit-identical to the simulator's
        // channel.
        let channel = match channel {
            Some(channel) => channel,
            None => Channel::from_db(2e9, 0.1, 21.0, AirGround::Los)
                .map_err(|error| error.to_string())?,
        };
        Ok(MissionConfig {
            relays,
            distance_m: self.distance,
            min_separation_m: self.min_separation,
            tx_power_w: self.tx_power,
            common: Profile {
                altitude_m: self.altitude,
                power_w: self.uav_power,
            },
            channel,
            band: self.band.unwrap_or(Band::at(self.altitude)),
            lateral: Band {
                least_m: self.lateral_min,
                most_m: self.lateral_max,
            },
            interference,
            noise_w: self.noise,
            reverse: self.reverse,
            rx_power_w: self.rx_power.unwrap_or(self.tx_power),
            fitted_gap: self.fitted_gap,
            tolerance: narrow(COMPANION_TOLERANCE),
        })
    }
}

/// Checks a mission's parameters. In error messages, `prefix` comes before the option's name: "--" or "--new-".
///
/// # Errors
/// One line that names the option and the fault.
pub fn mission(config: MissionConfig, prefix: &str) -> Result<Mission, String> {
    let MissionConfig {
        relays,
        distance_m,
        min_separation_m,
        common,
        band,
        ..
    } = config;
    // The error about the separation occurs only with two or more relays.
    let gaps = relays.saturating_sub(1).max(1);
    Mission::try_new(config).map_err(|error| match error {
        MissionError::TooManyForDistance => format!(
            "{prefix}min-separation {min_separation_m}: must be at most {} m, so that {relays} relays fit into {prefix}distance {distance_m} ({gaps} times that separation)",
            distance_m / f32::from(gaps)
        ),
        MissionError::Band => format!(
            "{prefix}band {},{}: must contain {prefix}altitude {}: LEAST must be at most that altitude, MOST at least that altitude",
            band.least_m, band.most_m, common.altitude_m
        ),
        other => other.to_string(),
    })
}

/// Parses the value of `--interferer`: power (W) and position (m), or the word `unknown`.
///
/// # Errors
/// The expected form or range.
pub fn guess(text: &str) -> Result<Interference, String> {
    if text == "unknown" {
        return Ok(Interference::Unknown);
    }
    interferer(text).map(Interference::Source)
}

/// Parses an interferer: its power (W) and position x, y (m), separated by commas.
///
/// # Errors
/// The expected form or range.
pub fn interferer(text: &str) -> Result<Interferer, String> {
    let [power, x, y] = text.split(',').collect::<Vec<_>>()[..] else {
        return Err("must be three numbers P,X,Y: the interferer's power P in W, and its position X along the line and Y beside it in m".to_owned());
    };
    Ok(Interferer {
        power_w: named("P", power, [1e-6, 1e9], "W")?,
        x_m: named("X", x, [-1e7, 1e7], "m")?,
        y_m: named("Y", y, [-1e7, 1e7], "m")?,
    })
}

/// Parses a range of altitudes: the lowest and the highest (m), separated by a comma.
///
/// # Errors
/// The expected form or range.
pub fn band(text: &str) -> Result<Band, String> {
    let (least, most) = text.split_once(',').ok_or(
        "must be two numbers LEAST,MOST: the lowest and the highest permitted altitude in m",
    )?;
    Ok(Band {
        least_m: named("LEAST", least, ALTITUDE_M, "m")?,
        most_m: named("MOST", most, ALTITUDE_M, "m")?,
    })
}
