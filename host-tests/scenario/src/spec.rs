//! Typed content of a scenario.

use std::collections::BTreeMap;

use serde::Deserialize;
use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, Geodetic, Listen};

use super::link::Link;
use super::number::{factor, narrow, watts};

/// Parameters of a flight, in SI units. x is along the line from Tx (x = 0) to Rx, y to its right as seen from above.
///
/// Values from [`Scenario::load`] or [`Scenario::parse`] are within the ranges given here.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Geographic line from Tx to Rx, if the scenario has sites.
    pub line: Option<Line>,
    /// Distance D from Tx to Rx, m, 1 to 1e6.
    pub distance_m: f64,
    /// Common altitude of the relays, m, 0.1 to 1e4.
    pub altitude_m: f64,
    /// Lowest altitude for the joint methods, m, 0.1 to `altitude_m` (its default).
    pub altitude_min_m: f64,
    /// Highest altitude for the joint methods, m, `altitude_m` (its default) to 1e4.
    pub altitude_max_m: f64,
    /// Lateral limit to the left for the joint method, y in m, -1e5 to 0 (its default).
    pub lateral_min_m: f64,
    /// Lateral limit to the right for the joint method, y in m, 0 (its default) to 1e5.
    pub lateral_max_m: f64,
    /// Least distance between two relays, m, 0 (its default) to 1e5.
    pub min_separation_m: f64,
    /// EIRP of the transmitter (power and antenna gain), W, 1e-6 to 1e6.
    pub tx_w: f64,
    /// EIRP of the receiver on the way back to Tx, W, 1e-6 to 1e6; `tx_w` by default.
    pub rx_w: f64,
    /// EIRP of every relay without its own `power_w`, W, 1e-6 to 1e6.
    pub uav_w: f64,
    /// Radio channel.
    pub channel: ChannelSpec,
    /// Interferers, or interference field, of the scenario.
    pub interference: Interference,
    /// Settings for relays that locate the interferer. [`Self::interference`] is then their initial knowledge, if any.
    pub listen: Option<ListenSpec>,
    /// Receiver noise.
    pub noise: Noise,
    /// Data link, if the file has one.
    pub link: Option<Link>,
    /// SIR that a hop needs on the way back from Rx to Tx, relative to that on the way there, 0 to 1. With 0 only the way there counts.
    pub reverse: f64,
    /// Differences of single relays, by index (1 to 1000, 1 is next to Tx).
    pub relays: BTreeMap<u16, RelayOverride>,
    /// Plan, if the file has one.
    pub plan: Option<Planned>,
}

/// Geographic line and its sites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Line from Tx to Rx.
    pub axis: Axis,
    /// Sites of the transmitter and the receiver.
    pub sites: [Geodetic; 2],
    /// Height of the mean sea level above the WGS84 ellipsoid, m, -120 to 100, if given.
    pub geoid_m: Option<f64>,
}

/// Radio channel: carrier and excess losses over free space.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSpec {
    /// Carrier frequency, Hz, 1e6 to 1e12.
    pub carrier_hz: f64,
    /// Excess loss of a line-of-sight link, dB, 0 to 200.
    pub excess_loss_los_db: f64,
    /// Excess loss of an obstructed link, dB, `excess_loss_los_db` to 200.
    pub excess_loss_nlos_db: f64,
    /// Path loss of links between ground and air.
    pub air_ground: AirGround,
}

/// Settings for locating the interferer; missing values default to those of [`Listen`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ListenSpec {
    /// True if the interferer moves: missing values then default to those of [`Listen::following`].
    pub following: bool,
    /// Time from an agreement to the leader's next request for measurements, s, 0.01 to 1e5.
    pub every_s: Option<f64>,
    /// Half-life of a measurement's weight, s, 0.01 to 1e12.
    pub half_life_s: Option<f64>,
    /// Relative error of one measurement, 1e-3 to 1.
    pub relative_error: Option<f64>,
}

impl ListenSpec {
    /// Returns the measurement settings of the relays in a chain of `uavs` relays.
    pub fn of(&self, uavs: u16) -> Listen {
        let default = if self.following {
            Listen::following(uavs)
        } else {
            Listen::default()
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1e4 to 1e18"
        )]
        let micros = |seconds: f64| Duration::from_micros((seconds * 1e6).round() as u64);
        Listen {
            every: self.every_s.map_or(default.every, micros),
            half_life: self.half_life_s.map_or(default.half_life, micros),
            relative_error: self.relative_error.map_or(default.relative_error, narrow),
        }
    }
}

/// Receiver noise, from bandwidth and noise figure or given directly.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Noise bandwidth, Hz, 0 (its default: no noise) to 1e12.
    pub bandwidth_hz: f64,
    /// Noise figure, dB, 0 to 60; 6 by default.
    pub figure_db: f64,
    /// Noise power, dBm, -200 to 0, in place of bandwidth and noise figure.
    pub power_dbm: Option<f64>,
    /// Antenna gains of the relays and of Rx, dBi, -30 to 60; 0 by default.
    pub gains_dbi: [f64; 2],
}

/// Boltzmann's constant, J/K.
const BOLTZMANN: f64 = 1.380_649e-23;

impl Default for Noise {
    fn default() -> Self {
        Self {
            bandwidth_hz: 0.0,
            figure_db: 6.0,
            power_dbm: None,
            gains_dbi: [0.0; 2],
        }
    }
}

impl Noise {
    /// Reference temperature T0 of noise figures, K.
    pub const STANDARD_K: f64 = 290.0;

    /// Returns the noise power at the input of a receiver, W: k T0 B F, or the given power.
    pub fn receiver_w(&self) -> f64 {
        self.power_dbm.map_or_else(
            || BOLTZMANN * Self::STANDARD_K * self.bandwidth_hz * factor(self.figure_db),
            watts,
        )
    }

    /// Returns the noise power of all receivers in a mission, W.
    ///
    /// It is [`Self::receiver_w`] divided by the antenna gain: the lower one if those of the relays and of Rx differ.
    pub fn power_w(&self) -> f64 {
        let [relays, rx] = self.gains_dbi;
        self.receiver_w() / factor(relays.min(rx))
    }

    /// Returns true if the mission's noise is too high for some receivers: the antenna gains differ.
    pub fn is_uneven(&self) -> bool {
        let [relays, rx] = self.gains_dbi;
        self.receiver_w() > 0.0 && relays.total_cmp(&rx).is_ne()
    }
}

/// Path loss eta of links between ground and air.
#[derive(Debug, Clone, PartialEq)]
pub enum AirGround {
    /// Line of sight.
    Los,
    /// Obstructed.
    Nlos,
    /// Mixture: this weight, 0 to 1, of line of sight, the rest obstructed.
    Weight(f64),
}

/// Interference: known transmitters, or a random field along x.
#[derive(Debug, Clone, PartialEq)]
pub enum Interference {
    /// Interferers; empty only if the relays locate an unknown one.
    Sources(Vec<Source>),
    /// Interference power known only by its distribution.
    Field(Field),
}

/// An interfering transmitter on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// EIRP, W, 1e-6 to 1e9.
    pub power_w: f64,
    /// Position along the line from Tx to Rx, m, -1e7 to 1e7 (0 is Tx; beyond Rx is allowed).
    pub x_m: f64,
    /// Lateral position on the ground, m, -1e7 to 1e7; positive to the right.
    pub y_m: f64,
}

/// Interference power I(x) such that I / `i_max_w` has a Beta distribution that depends on x.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Upper bound on the received interference power, W, 1e-30 to 1e6.
    pub i_max_w: f64,
    /// Distributions at some positions, strictly increasing in x; never empty if read from a file.
    pub beta: Vec<BetaPoint>,
}

/// Distribution of the interference at one position.
#[derive(Debug, Clone, PartialEq)]
pub struct BetaPoint {
    /// Position along the line from Tx to Rx, m, -1e7 to 1e7.
    pub x_m: f64,
    /// First shape parameter, above 1 (E[1/I] is infinite otherwise) and at most 1e6.
    pub alpha: f64,
    /// Second shape parameter of the Beta distribution, above 0 and at most 1e6.
    pub beta: f64,
}

/// Differences of one relay; at least one field is set if read from a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RelayOverride {
    /// Fixed altitude, m, 0.1 to 1e4; not limited by the altitude band of the joint methods.
    pub altitude_m: Option<f64>,
    /// EIRP, W, 1e-6 to 1e6.
    pub power_w: Option<f64>,
}

impl Default for ChannelSpec {
    /// Returns the paper's channel. 2 GHz, 0.1 dB and 21 dB of excess loss, line of sight between ground and air.
    fn default() -> Self {
        Self {
            carrier_hz: 2e9,
            excess_loss_los_db: 0.1,
            excess_loss_nlos_db: 21.0,
            air_ground: AirGround::Los,
        }
    }
}

impl Default for Scenario {
    /// Returns the paper's multi-hop scenario. 1 km, relays at 20 m and 4 m apart at least, one 80 W interferer halfway.
    fn default() -> Self {
        Self {
            line: None,
            distance_m: 1000.0,
            altitude_m: 20.0,
            altitude_min_m: 20.0,
            altitude_max_m: 20.0,
            lateral_min_m: 0.0,
            lateral_max_m: 0.0,
            min_separation_m: 4.0,
            tx_w: 80.0,
            rx_w: 80.0,
            uav_w: 1.0,
            channel: ChannelSpec::default(),
            interference: Interference::Sources(vec![Source {
                power_w: 80.0,
                x_m: 500.0,
                y_m: 400.0,
            }]),
            listen: None,
            noise: Noise::default(),
            link: None,
            reverse: 0.0,
            relays: BTreeMap::new(),
            plan: None,
        }
    }
}

impl Scenario {
    /// Returns the bandwidth of the data link, Hz.
    ///
    /// It is that of `[link]`, or else that of `[noise]`; `None` without either.
    pub fn bandwidth_hz(&self) -> Option<f64> {
        let own = self.link.as_ref().and_then(|link| link.bandwidth_hz);
        own.or_else(|| Some(self.noise.bandwidth_hz).filter(|hz| *hz > 0.0))
    }

    /// Returns true if the interference is given; it may be missing if the relays locate the interferer.
    pub fn knows_interference(&self) -> bool {
        !matches!(&self.interference, Interference::Sources(sources) if sources.is_empty())
    }

    /// Returns the interferers for pictures: power in W, x and y in m; none in a field.
    pub fn sources(&self) -> Vec<(f64, f64, f64)> {
        match &self.interference {
            Interference::Sources(sources) => {
                sources.iter().map(|s| (s.power_w, s.x_m, s.y_m)).collect()
            }
            Interference::Field(_) => Vec::new(),
        }
    }
}

/// A plan in a scenario file, from `cargo plan --out` to `cargo provision`.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Number of relays, 1 to 1000.
    pub uavs: u16,
    /// Placement method of the relays.
    pub method: PlannedMethod,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
    /// SIR of the worst hop at these positions, dB, -400 to 400.
    pub sir_db: f64,
    /// Positions, relay 1 first; one per relay.
    pub places: Vec<PlannedPlace>,
}

/// Placement method of relays that fly a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlannedMethod {
    /// Fixed altitudes: Algorithm 1, in a field Algorithm 4.
    Align,
    /// Positions, sides and altitudes together.
    Joint,
}

/// Position of a relay.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedPlace {
    /// Distance along the line from Tx, m.
    pub x_m: f64,
    /// Lateral position, m; positive to the right as seen from above.
    pub y_m: f64,
    /// Altitude above ground, m, 0.1 to 1e4.
    pub altitude_m: f64,
}

impl PlannedMethod {
    /// Names of the methods in files.
    pub const NAMES: &'static [&'static str] = &["align", "joint"];

    /// Returns the name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Align => "align",
            Self::Joint => "joint",
        }
    }
}
