//! Typed content of a scenario.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;
use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, Geodetic, Listen};

use super::area::{NoFly, SourceArea};
use super::link::{Access, Link};
use super::number::{factor, narrow, watts};

/// Parameters of a flight in a scenario file, in SI units.
///
/// x is the distance from Tx toward Rx, and y the offset to the right as seen from Tx. Values from [`Scenario::load`]
/// or [`Scenario::parse`] are within the ranges given here.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Line from Tx to Rx in geographic coordinates; `None` if the scenario has no `[site]`.
    pub line: Option<Line>,
    /// Distance D from Tx to Rx, m, 1 to 1e6.
    pub distance_m: f64,
    /// Altitude of the relays that have no altitude of their own, m, 0.1 to 1e4.
    pub altitude_m: f64,
    /// Lowest altitude for methods that choose altitudes, m, 0.1 to `altitude_m` (its default).
    pub altitude_min_m: f64,
    /// Highest altitude for methods that choose altitudes, m, `altitude_m` (its default) to 1e4.
    pub altitude_max_m: f64,
    /// Smallest lateral position y for the method `joint` (left limit), m, -1e5 to 0 (its default).
    pub lateral_min_m: f64,
    /// Largest lateral position y for the method `joint` (right limit), m, 0 (its default) to 1e5.
    pub lateral_max_m: f64,
    /// Least distance between two relays, m, 0 (its default) to 1e5.
    pub min_separation_m: f64,
    /// EIRP of the transmitter (power and antenna gain), W, 1e-6 to 1e6.
    pub tx_w: f64,
    /// EIRP of the receiver Rx when it sends toward Tx, W, 1e-6 to 1e6; `tx_w` by default.
    pub rx_w: f64,
    /// EIRP of every relay without its own `power_w`, W, 1e-6 to 1e6.
    pub uav_w: f64,
    /// Radio channel: the carrier and the path losses.
    pub channel: ChannelSpec,
    /// Interference: a list of interfering transmitters, or a random field.
    pub interference: Interference,
    /// Areas of interferers whose positions are uncertain, by index (from 0) of the interferer.
    ///
    /// Such an interferer may be anywhere in its area.
    pub areas: BTreeMap<usize, SourceArea>,
    /// Heights of the interferers' antennas above the ground, m, 0 to 1000, by index (from 0).
    ///
    /// The height is 0 for an interferer that is not in the map. The planner uses it only with elevation files.
    pub masts_m: BTreeMap<usize, f64>,
    /// No-fly areas, for the planner.
    pub no_fly: Vec<NoFly>,
    /// Settings for relays that locate the interferer by measurements; `None` if relays do not locate it.
    ///
    /// If given, [`Self::interference`] is what the relays know before the first measurement.
    pub listen: Option<ListenSpec>,
    /// Noise of the receivers, both relays and Rx.
    pub noise: Noise,
    /// Data link, for data rates; `None` if the file has none.
    pub link: Option<Link>,
    /// Required SIR toward Tx, as a fraction (0 to 1) of the required SIR toward Rx.
    ///
    /// 0 means traffic from Tx to Rx only.
    pub reverse: f64,
    /// Relays with their own altitude or power, by index (1 to 1000, 1 is next to Tx).
    pub relays: BTreeMap<u16, RelayOverride>,
    /// Terrain below the chain; `None` if the file has none.
    pub terrain: Option<TerrainSpec>,
    /// Plan of relay positions; `None` if the file has none.
    pub plan: Option<Planned>,
}

/// Terrain below a chain, for the planner.
#[derive(Debug, Clone, PartialEq)]
pub struct TerrainSpec {
    /// Elevation files (GeoTIFF or SRTM), at least one.
    pub files: Vec<PathBuf>,
    /// Height of the antennas of Tx and Rx above the ground, m, 0 to 200; 2 by default.
    pub mast_m: f64,
    /// Least height of a relay above the ground, m, 0 (its default) to 1e4.
    ///
    /// The height is measured from the highest point of the ground below the positions that the relay may have, given
    /// its position error.
    pub above_ground_m: f64,
    /// Greatest height of a relay above the ground, m, 0.1 to 1e4; `None` for no limit.
    ///
    /// It counts from the ground straight below the relay.
    pub above_ground_max_m: Option<f64>,
    /// Error of the heights in the elevation files, m, 0 (its default) to 100.
    ///
    /// The planner adds the error to the height of the ground. It adds nothing at Tx and Rx, and the full error at
    /// points at least 100 m away from both.
    pub error_m: f64,
}

impl TerrainSpec {
    /// Creates the terrain in these elevation files, with the defaults of all other keys.
    pub fn of(files: Vec<PathBuf>) -> Self {
        Self {
            files,
            mast_m: 2.0,
            above_ground_m: 0.0,
            above_ground_max_m: None,
            error_m: 0.0,
        }
    }
}

/// Line from Tx to Rx in geographic coordinates, and the geographic positions of its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Coordinate system of the line from Tx to Rx. This type converts between geographic and local positions.
    pub axis: Axis,
    /// Geographic positions of the transmitter Tx and the receiver Rx.
    pub sites: [Geodetic; 2],
    /// Height of the mean sea level above the WGS84 ellipsoid, m, -120 to 100; `None` if not given.
    pub geoid_m: Option<f64>,
}

/// Radio channel: the carrier frequency, and the losses in addition to the free-space loss.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSpec {
    /// Carrier frequency of the radio channel, Hz, 1e6 to 1e12.
    pub carrier_hz: f64,
    /// Loss of a line-of-sight link in addition to the free-space loss, dB, 0 to 200.
    pub excess_loss_los_db: f64,
    /// Loss of an obstructed link in addition to the free-space loss, dB, `excess_loss_los_db` to 200.
    pub excess_loss_nlos_db: f64,
    /// Kind of the links between ground and air: line of sight, obstructed, or a mixture.
    pub air_ground: AirGround,
}

/// Settings for relays that locate the interferer by measurements. A missing value, `None`, means the default of
/// [`Listen`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ListenSpec {
    /// True if the interferer moves. If true, missing settings have the defaults of [`Listen::following`].
    pub following: bool,
    /// Time from an agreement on positions to the leader's next request for measurements, s, 0.01 to 1e5.
    pub every_s: Option<f64>,
    /// Age at which a measurement has half the weight of a new one, s, 0.01 to 1e12.
    pub half_life_s: Option<f64>,
    /// Relative error of one interference measurement, 1e-3 to 1.
    pub relative_error: Option<f64>,
}

impl ListenSpec {
    /// Returns the measurement settings of a chain of `uavs` relays; missing settings have their defaults.
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

/// Receiver noise: bandwidth and noise figure, or the noise power itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Noise bandwidth, Hz, 0 to 1e12. The default 0 means no noise.
    pub bandwidth_hz: f64,
    /// Noise figure of the receivers, dB, 0 to 60; 6 by default.
    pub figure_db: f64,
    /// Noise power, dBm, -200 to 0. If given, this value replaces the noise power computed from bandwidth and noise
    /// figure.
    pub power_dbm: Option<f64>,
    /// Antenna gains, dBi, -30 to 60; 0 by default. Entry 0 is for the relays, entry 1 for Rx.
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

    /// Returns the noise power at the input of a receiver, W.
    ///
    /// It is the given power, or k T0 B F: Boltzmann's constant, reference temperature, bandwidth and noise figure.
    pub fn receiver_w(&self) -> f64 {
        self.power_dbm.map_or_else(
            || BOLTZMANN * Self::STANDARD_K * self.bandwidth_hz * factor(self.figure_db),
            watts,
        )
    }

    /// Returns the noise power that a mission uses for all receivers, W.
    ///
    /// It is [`Self::receiver_w`] divided by the smaller antenna gain: that of the relays or that of Rx.
    pub fn power_w(&self) -> f64 {
        let [relays, rx] = self.gains_dbi;
        self.receiver_w() / factor(relays.min(rx))
    }

    /// Returns true if there is noise, and the antenna gains of the relays and of Rx differ.
    ///
    /// A mission has a single noise power, which is computed for the smaller gain. It is too high for the receivers
    /// with the larger gain.
    pub fn is_uneven(&self) -> bool {
        let [relays, rx] = self.gains_dbi;
        self.receiver_w() > 0.0 && relays.total_cmp(&rx).is_ne()
    }
}

/// Kind of the links between ground and air, which determines their path-loss factor eta.
#[derive(Debug, Clone, PartialEq)]
pub enum AirGround {
    /// Links between ground and air have line of sight.
    Los,
    /// Links between ground and air are obstructed.
    Nlos,
    /// Mixture of both kinds of link. The value, 0 to 1, is the weight of line of sight.
    Weight(f64),
}

/// Interference in a scenario: known transmitters, or a random field along x.
#[derive(Debug, Clone, PartialEq)]
pub enum Interference {
    /// Known interfering transmitters. The list is empty only if the relays have to locate an unknown interferer.
    Sources(Vec<Source>),
    /// Interference with a known probability distribution of its power at each x.
    Field(Field),
}

/// An interfering transmitter on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// EIRP of the interferer, W, 1e-6 to 1e9.
    pub power_w: f64,
    /// Position of the interferer along the line from Tx (0) to Rx, m, -1e7 to 1e7.
    pub x_m: f64,
    /// Lateral position of the interferer, m, -1e7 to 1e7; positive to the right as seen from Tx.
    pub y_m: f64,
}

/// Random field of interference power I(x), W. I(x) / `i_max_w` has a Beta distribution that depends on x.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Upper bound on the received interference power, W, 1e-30 to 1e6.
    pub i_max_w: f64,
    /// Beta distributions at some positions, x strictly increasing. A list read from a file is never empty.
    pub beta: Vec<BetaPoint>,
}

/// Beta distribution of the interference power at one x.
#[derive(Debug, Clone, PartialEq)]
pub struct BetaPoint {
    /// Position along the line from Tx to Rx, m, -1e7 to 1e7.
    pub x_m: f64,
    /// First shape parameter of the Beta distribution, above 1 and at most 1e6.
    ///
    /// At 1 or less the mean of 1/I would be infinite, where I is the interference power.
    pub alpha: f64,
    /// Second shape parameter of the Beta distribution, above 0 and at most 1e6.
    pub beta: f64,
}

/// Altitude and power of one relay that differ from the common values.
///
/// In a scenario from a file, at least one of the two is `Some`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RelayOverride {
    /// Fixed altitude of this relay, m, 0.1 to 1e4; `None` for the common altitude. Values outside of `altitude_min_m`
    /// to `altitude_max_m` are allowed.
    pub altitude_m: Option<f64>,
    /// EIRP of this relay, W, 1e-6 to 1e6; `None` for the common EIRP.
    pub power_w: Option<f64>,
}

impl Default for ChannelSpec {
    /// Returns the paper's channel: 2 GHz, and line of sight between relays and the ground.
    ///
    /// The excess loss is 0.1 dB with line of sight and 21 dB for an obstructed link.
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
    /// Returns the paper's multi-hop scenario.
    ///
    /// The distance from Tx to Rx is 1 km. The relays fly at 20 m altitude, with a minimum separation of 4 m. One
    /// interferer of 80 W is halfway between Tx and Rx, 400 m to the right of their line.
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
            areas: BTreeMap::new(),
            masts_m: BTreeMap::new(),
            no_fly: Vec::new(),
            listen: None,
            noise: Noise::default(),
            link: None,
            reverse: 0.0,
            relays: BTreeMap::new(),
            terrain: None,
            plan: None,
        }
    }
}

impl Scenario {
    /// Returns the bandwidth of the data link, Hz, from the scenario: `[link]`, or else `[noise]`. `None` if neither
    /// has a bandwidth of at least 1 Hz.
    pub fn bandwidth_hz(&self) -> Option<f64> {
        let own = self.link.as_ref().and_then(|link| link.bandwidth_hz);
        own.or_else(|| Some(self.noise.bandwidth_hz).filter(|hz| *hz >= 1.0))
    }

    /// Returns true if the scenario has fitted slots. Relays with the method `joint` then maximise the data rate.
    pub fn has_fitted_slots(&self) -> bool {
        let link = self.link.as_ref();
        link.is_some_and(|link| link.access == Access::Fitted)
    }

    /// Returns true if the scenario gives the interference; false if relays have to locate an interferer.
    pub fn knows_interference(&self) -> bool {
        !matches!(&self.interference, Interference::Sources(sources) if sources.is_empty())
    }

    /// Returns the power, W, and position x and y, m, of every interferer; empty for a random field.
    pub fn sources(&self) -> Vec<(f64, f64, f64)> {
        match &self.interference {
            Interference::Sources(sources) => {
                sources.iter().map(|s| (s.power_w, s.x_m, s.y_m)).collect()
            }
            Interference::Field(_) => Vec::new(),
        }
    }
}

/// Plan of relay positions in a scenario file. `cargo plan --out` writes it and `cargo provision` reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Number of relays, 1 to 1000.
    pub uavs: u16,
    /// Placement method of the relays.
    pub method: PlannedMethod,
    /// Maximum relative error with which the placement method finds the best SIR, 1e-6 to 0.1.
    pub tolerance: f64,
    /// SIR of the chain's worst hop at the planned positions, dB, -400 to 400.
    pub sir_db: f64,
    /// Planned positions, one per relay, relay 1 first.
    pub places: Vec<PlannedPlace>,
}

/// Placement method in a plan that relays can fly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlannedMethod {
    /// Placement at fixed altitudes: the paper's Algorithm 1, or Algorithm 4 in a random field.
    Align,
    /// Placement that chooses x, lateral offset and altitude of each relay together.
    Joint,
}

/// Planned position of a relay.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedPlace {
    /// Distance of the relay from Tx toward Rx, m.
    pub x_m: f64,
    /// Lateral position of the relay, m; positive to the right as seen from Tx toward Rx.
    pub y_m: f64,
    /// Altitude of the relay above ground, m, 0.1 to 1e4.
    pub altitude_m: f64,
}

impl PlannedMethod {
    /// Names of the placement methods in scenario files.
    pub const NAMES: &'static [&'static str] = &["align", "joint"];

    /// Returns the name of the placement method in scenario files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Align => "align",
            Self::Joint => "joint",
        }
    }
}
