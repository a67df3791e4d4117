//! What a scenario says.

use std::collections::BTreeMap;

use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, Geodetic, Listen};

use crate::number::{factor, narrow, watts};
use crate::plan::Planned;

/// Everything a host tool has to know about a flight, in SI units, with x along the line from Tx (x = 0) to Rx and y to the
/// right of it as seen from above.
///
/// A value that came from [`Scenario::load`] or [`Scenario::parse`] lies within the ranges given here.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The line from Tx to Rx on earth, where the scenario says where the two are.
    pub line: Option<Line>,
    /// Distance D from Tx to Rx, in metres, 1 to 1e6.
    pub distance_m: f64,
    /// Common altitude of the relays, in metres, 0.1 to 1e5.
    pub altitude_m: f64,
    /// Lowest altitude the joint methods may choose, in metres, 0.1 to `altitude_m` (its default).
    pub altitude_min_m: f64,
    /// Highest altitude the joint methods may choose, in metres, `altitude_m` (its default) to 1e5.
    pub altitude_max_m: f64,
    /// How far to the left of the line the joint method may choose places, as y in metres, -1e5 to 0 (its default).
    pub lateral_min_m: f64,
    /// How far to its right, as y in metres, 0 (its default) to 1e5.
    pub lateral_max_m: f64,
    /// Smallest distance allowed between two relays, in metres, 0 (its default) to 1e5.
    pub min_separation_m: f64,
    /// EIRP of Tx (its power and its antenna's gain), in watts, 1e-6 to 1e6.
    pub tx_w: f64,
    /// EIRP of every relay that has no power of its own, in watts, 1e-6 to 1e6.
    pub uav_w: f64,
    /// How signals weaken with distance.
    pub channel: ChannelSpec,
    /// What disturbs the hops.
    pub interference: Interference,
    /// How the relays listen, where they are to find the interferer; then [`Self::interference`] is what they are told at first, if anything.
    pub listen: Option<ListenSpec>,
    /// The receivers' own noise.
    pub noise: Noise,
    /// What differs for single relays, by relay number (1 to 1000, 1 is next to Tx).
    pub relays: BTreeMap<u16, RelayOverride>,
    /// What a planner found for it.
    pub plan: Option<Planned>,
}

/// The line on earth, and what it was made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// The line.
    pub axis: Axis,
    /// The transmitter's site and the receiver's.
    pub sites: [Geodetic; 2],
    /// How high the mean sea level there is above the ellipsoid of WGS84, in metres, -120 to 100, where that is said.
    pub geoid_m: Option<f64>,
}

/// The radio channel: its carrier and the excess losses over free space.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSpec {
    /// Carrier frequency, in hertz, 1e6 to 1e12.
    pub carrier_hz: f64,
    /// Excess loss of a line-of-sight link, in dB, 0 to 200.
    pub excess_loss_los_db: f64,
    /// Excess loss of an obstructed link, in dB, `excess_loss_los_db` to 200.
    pub excess_loss_nlos_db: f64,
    /// Which path loss the links between the ground and the air have.
    pub air_ground: AirGround,
}

/// How the relays listen: what is not said is that of [`Listen`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ListenSpec {
    /// Whether the interferer moves: what is not said is that of [`Listen::following`].
    pub following: bool,
    /// How long after an agreement the leader asks what is heard, in seconds, 0.01 to 1e5.
    pub every_s: Option<f64>,
    /// After so long what was heard counts half, in seconds, 0.01 to 1e12.
    pub half_life_s: Option<f64>,
    /// By how much one measurement is off, relative, 1e-3 to 1.
    pub relative_error: Option<f64>,
}

impl ListenSpec {
    /// As `uavs` relays are told.
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

/// The noise of every receiver, as its bandwidth and its noise figure make it, or as it is given.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Noise bandwidth, in hertz, 0 (its default: no noise) to 1e12.
    pub bandwidth_hz: f64,
    /// Noise figure, in dB, 0 to 60; 6 by default.
    pub figure_db: f64,
    /// The noise itself, in dBm, -200 to 0, in place of what these two make it.
    pub power_dbm: Option<f64>,
    /// Gains of the antennas of the relays and of Rx, in dBi, -30 to 60; 0 by default.
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
    /// The temperature T0 that noise figures are for, K.
    pub const STANDARD_K: f64 = 290.0;

    /// Noise power at the input of a receiver, in watts: k T0 B F, or what is given.
    pub fn receiver_w(&self) -> f64 {
        self.power_dbm.map_or_else(
            || BOLTZMANN * Self::STANDARD_K * self.bandwidth_hz * factor(self.figure_db),
            watts,
        )
    }

    /// The noise power that a mission has for all receivers, in watts: [`Self::receiver_w`] over the antenna gain, the lower one where that
    /// of the relays and of Rx differ.
    pub fn power_w(&self) -> f64 {
        let [relays, rx] = self.gains_dbi;
        self.receiver_w() / factor(relays.min(rx))
    }

    /// Whether one noise for all receivers is too much for some: there is noise, and the gains differ.
    pub fn is_uneven(&self) -> bool {
        let [relays, rx] = self.gains_dbi;
        self.receiver_w() > 0.0 && relays.total_cmp(&rx).is_ne()
    }
}

/// The path loss eta of a link between the ground and the air.
#[derive(Debug, Clone, PartialEq)]
pub enum AirGround {
    /// That of a line-of-sight link.
    Los,
    /// That of an obstructed link.
    Nlos,
    /// This weight, 0 to 1, times the line-of-sight one, plus the rest times the obstructed one.
    Weight(f64),
}

/// What disturbs the hops: known transmitters, or a random field along x.
#[derive(Debug, Clone, PartialEq)]
pub enum Interference {
    /// One interferer or more; none only where the relays listen and know of none.
    Sources(Vec<Source>),
    /// An interference power known only by its distribution.
    Field(Field),
}

/// One interfering transmitter, on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// EIRP, in watts, 1e-6 to 1e9.
    pub power_w: f64,
    /// Place along the line from Tx to Rx, in metres, -1e7 to 1e7 (0 is Tx; beyond Rx is allowed).
    pub x_m: f64,
    /// Offset from that line on the ground, in metres, -1e7 to 1e7: to its right above 0.
    pub y_m: f64,
}

/// Interference power I(x) such that I / `i_max_w` has a Beta distribution that depends on x.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Upper bound on the received interference power, in watts, 1e-30 to 1e6.
    pub i_max_w: f64,
    /// The distribution at some places, sorted by strictly increasing x; never empty when read from a file.
    pub beta: Vec<BetaPoint>,
}

/// The distribution of the interference at one place.
#[derive(Debug, Clone, PartialEq)]
pub struct BetaPoint {
    /// Place along the line from Tx to Rx, in metres, -1e7 to 1e7.
    pub x_m: f64,
    /// First shape parameter, above 1 (E[1/I] is infinite otherwise) and at most 1e6.
    pub alpha: f64,
    /// Second shape parameter, above 0 and at most 1e6.
    pub beta: f64,
}

/// What differs for one relay; at least one field is set when it was read from a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RelayOverride {
    /// Altitude it holds, in metres, 0.1 to 1e5; the altitude band, which is for the joint methods, does not bind it.
    pub altitude_m: Option<f64>,
    /// Its own EIRP, in watts, 1e-6 to 1e6.
    pub power_w: Option<f64>,
}

impl Default for ChannelSpec {
    /// The paper's channel: 2 GHz, 0.1 dB and 21 dB of excess loss, line of sight between ground and air.
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
    /// The paper's multi-hop scenario: 1 km, relays at 20 m and 4 m apart at least, one 80 W interferer halfway.
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
            uav_w: 1.0,
            channel: ChannelSpec::default(),
            interference: Interference::Sources(vec![Source {
                power_w: 80.0,
                x_m: 500.0,
                y_m: 400.0,
            }]),
            listen: None,
            noise: Noise::default(),
            relays: BTreeMap::new(),
            plan: None,
        }
    }
}

impl Scenario {
    /// Whether it says what disturbs the hops; one whose relays are to find that out may not.
    pub fn knows_interference(&self) -> bool {
        !matches!(&self.interference, Interference::Sources(sources) if sources.is_empty())
    }

    /// Every interferer, as a picture wants it: power in watts, place along x and offset y in metres; none in a field.
    pub fn sources(&self) -> Vec<(f64, f64, f64)> {
        match &self.interference {
            Interference::Sources(sources) => {
                sources.iter().map(|s| (s.power_w, s.x_m, s.y_m)).collect()
            }
            Interference::Field(_) => Vec::new(),
        }
    }
}
