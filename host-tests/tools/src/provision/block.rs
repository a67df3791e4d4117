//! Builds the configuration block of one drone from a scenario.

use std::fmt;

use uav_relay::flight::course::{Course, CourseError};
use uav_relay::{
    Duration, Identity, Interference, Listen, Measure, Method, Mission, Profile, Settings,
};
use uav_relay_scenario::deployment::Network;
use uav_relay_scenario::fleet::FleetSize;
use uav_relay_scenario::mission::Refusal;
use uav_relay_scenario::{AirGround, ChannelSpec, Scenario, mission};

use super::config::{
    BAUD, Block, ChannelNumbers, Config, ConfigError, EMPTY, MAX_POINTS, MAX_PROBE_AFTER_MS,
    Secret, Sites, autopilot_key, read, secret, write,
};

/// Reason why a drone's configuration block cannot be built.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum BlockError {
    /// Error: the scenario is not a valid mission, for this reason.
    Refused(Refusal),
    /// Error: the interference is given at this many points, more than a block can hold.
    Points(usize),
    /// Error: the drone would reject the configuration, for this reason.
    Config(ConfigError),
    /// Error: the drone would reject the surveyed positions of Tx and Rx, for this reason.
    Course(CourseError),
    /// Error: a drone would not read this configuration from the block.
    Changed,
}

impl fmt::Display for BlockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(refusal) => refusal.fmt(f),
            Self::Points(points) => write!(
                f,
                "the interference field ([field]) has {points} points: a drone's configuration block holds at most {MAX_POINTS}"
            ),
            Self::Config(ConfigError::Index) => {
                f.write_str("the relay's index must be within 1 to the number of relays")
            }
            Self::Config(ConfigError::Profile) => {
                f.write_str("the relay's altitude must be within the mission's band and 0.1 to 1e5 m, its power within 1e-6 to 1e6 W")
            }
            Self::Config(ConfigError::Method) => f.write_str("the method must be align in a scenario with a [field]"),
            Self::Config(ConfigError::Adjust) => {
                f.write_str("the number of rounds must be within 1 to 65535, explore (change of altitude per move) within 0 to 1e5 m")
            }
            Self::Config(ConfigError::Measure) => {
                f.write_str("the number of samples must be within 100 to 1000000, i_max_w (greatest interference power) within 1e-30 to 1e6 W")
            }
            Self::Config(ConfigError::Listen) => f.write_str(
                "[listen] needs a scenario with [[interferer]] or without interference, not one with a [field]",
            ),
            Self::Config(ConfigError::Reverse) => f.write_str(
                "link.reverse above 0 with [listen] needs the method align or adjust: the method joint needs a known interferer",
            ),
            Self::Config(ConfigError::Fitted) => f.write_str(
                "link.access = \"fitted\" needs the method joint and a known interferer: leave [listen] out, or use another link.access",
            ),
            Self::Config(ConfigError::Secret) => {
                f.write_str("the key must contain a byte other than 0, and the epoch must be within 1 to 4294967294")
            }
            Self::Config(ConfigError::Speed) => {
                f.write_str("the maximum speed must be within 0.1 to 20 m/s, and needs a scenario with a [site]")
            }
            Self::Config(ConfigError::AutopilotKey) => {
                f.write_str("an autopilot's key needs a scenario with a [site]")
            }
            Self::Course(CourseError::Axis(error)) => error.fmt(f),
            Self::Course(CourseError::Distance(along)) => {
                write!(
                    f,
                    "Tx and Rx are {along:.3} m apart: the mission's distance must be the same"
                )
            }
            Self::Course(error) => error.fmt(f),
            Self::Config(ConfigError::Mission(error)) => error.fmt(f),
            Self::Config(ConfigError::Channel(error)) => error.fmt(f),
            Self::Config(_) | Self::Changed => {
                f.write_str("the drone would read a mission from this block that differs from the scenario's")
            }
        }
    }
}

impl std::error::Error for BlockError {}

/// Configuration of all drones of a flight. It builds the block of each drone.
#[derive(Clone, Debug)]
pub struct Flight {
    mission: Mission,
    numbers: ChannelNumbers,
    own: Vec<(u16, Profile)>,
    held: Vec<u16>,
    method: Method,
    measure: Option<Measure>,
    listen: Option<Listen>,
    secret: Option<Secret>,
    sites: Option<Sites>,
    autopilot_key: Option<[u8; 32]>,
    network: u16,
    /// Silence of a neighbour after which a relay requests heartbeats, ms; 0 for the firmware's default.
    probe_after_ms: u32,
    /// Numbers of relays in the fleet and in the chain; `None` without spares.
    fleet: Option<FleetSize>,
}

impl Flight {
    /// Creates the configuration of `uavs` relays in `scenario`, with the network number `network`.
    ///
    /// The placement method is `align`, and relays do not measure the interference. `tolerance` is the relative
    /// tolerance of the SIR.
    ///
    /// # Errors
    /// [`BlockError`] if the scenario is not a valid mission, or does not fit into a block.
    pub fn new(
        scenario: &Scenario,
        uavs: u16,
        tolerance: f64,
        network: u16,
    ) -> Result<Self, BlockError> {
        let (mission, own) =
            mission::mission(scenario, uavs, tolerance).map_err(BlockError::Refused)?;
        if let Interference::Field(field) = mission.interference()
            && field.points().len() > MAX_POINTS
        {
            return Err(BlockError::Points(field.points().len()));
        }
        Ok(Self {
            mission,
            numbers: channel_numbers(&scenario.channel),
            own,
            held: mission::fixed_altitude_relays(scenario, uavs),
            method: Method::Align,
            measure: None,
            listen: scenario.listen.map(|listen| listen.of(uavs)),
            secret: None,
            sites: scenario.line.map(|line| line.sites).map(|ends| Sites {
                ends: ends.map(|at| [at.lat_e7, at.lon_e7, at.amsl_mm]),
                speed_m_s: 0.0,
            }),
            autopilot_key: None,
            network,
            probe_after_ms: 0,
            fleet: None,
        })
    }

    /// Sets the placement method of the relays.
    pub fn by(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// Sets the time slots to those of `scenario`, if the placement method is [`Method::Joint`].
    ///
    /// # Errors
    /// [`BlockError::Refused`] if the relays cannot use slots that are as long as each hop needs.
    pub fn with_access(self, scenario: &Scenario) -> Result<Self, BlockError> {
        if self.method != Method::Joint {
            return Ok(self);
        }
        let mission = mission::with_access(scenario, &self.mission).map_err(BlockError::Refused)?;
        Ok(Self { mission, ..self })
    }

    /// Sets how the relays measure the interference along the line Tx-Rx; `None` if they do not.
    pub fn measuring(self, measure: Option<Measure>) -> Self {
        Self { measure, ..self }
    }

    /// Sets the silence of a neighbour, ms, after which a relay requests heartbeats. 0 selects the firmware's default.
    pub fn with_probe_after(self, probe_after_ms: u32) -> Self {
        Self {
            probe_after_ms,
            ..self
        }
    }

    /// Sets the numbers of relays in the fleet and in the chain; `None` for a fleet without spares.
    pub fn with_fleet(self, fleet: Option<FleetSize>) -> Self {
        Self { fleet, ..self }
    }

    /// Sets the key and epoch for signing frames; `None` for unsigned frames.
    pub fn signed(self, secret: Option<Secret>) -> Self {
        Self { secret, ..self }
    }

    /// Sets the drones' greatest speed, m/s.
    ///
    /// It has no effect if the scenario lacks geographic positions of Tx and Rx.
    pub fn no_faster_than(mut self, speed_m_s: f32) -> Self {
        if let Some(sites) = &mut self.sites {
            sites.speed_m_s = speed_m_s;
        }
        self
    }

    /// Sets the key that signs MAVLink messages to and from the autopilot; `None` for unsigned messages.
    pub fn signed_to_autopilots(self, autopilot_key: Option<[u8; 32]>) -> Self {
        Self {
            autopilot_key,
            ..self
        }
    }

    /// Returns true if the scenario has the geographic positions of Tx and Rx.
    ///
    /// An autopilot needs them, because its setpoints are latitudes and longitudes.
    pub const fn has_sites(&self) -> bool {
        self.sites.is_some()
    }

    /// Returns the mission of the flight.
    pub const fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Returns the profiles (power, altitude) that differ from the mission's common profile.
    ///
    /// Each has its relay's index, from 1.
    pub fn profiles(&self) -> &[(u16, Profile)] {
        &self.own
    }

    /// Returns the indices, from 1, of the relays that keep their altitude.
    pub fn held(&self) -> &[u16] {
        &self.held
    }

    /// Returns the placement method of the relays.
    pub const fn method(&self) -> Method {
        self.method
    }

    /// Returns the relays' settings for locating the interferer; `None` if they do not locate it.
    pub const fn listen(&self) -> Option<Listen> {
        self.listen
    }

    /// Builds the configuration block of relay `index`, and checks it by reading it back.
    ///
    /// # Errors
    /// The drone would reject the block, or would read a different configuration from it.
    pub fn block(&self, index: u16) -> Result<Block, BlockError> {
        let own = self.own.iter().find(|(of, _)| *of == index);
        let config = Config {
            identity: Identity {
                network: self.network,
                index,
            },
            mission: self.mission,
            profile: own.map_or(self.mission.config().common, |(_, profile)| *profile),
            hold_altitude: self.held.contains(&index),
            method: self.method,
            measure: self.measure,
            listen: self.listen,
            sites: self.sites,
            probe_after_ms: self.probe_after_ms,
            flying: self.fleet.map_or(0, |fleet| fleet.flying),
            spare: self.fleet.is_some_and(|fleet| fleet.rank(index).is_none()),
        };
        let block = write(&config, &self.numbers, self.secret, self.autopilot_key);
        let read = read(&block, Box::leak(Box::new(EMPTY))).map_err(BlockError::Config)?;
        if let Some(sites) = &read.sites {
            let (ends, speed_m_s) = (sites.on_earth(), sites.speed_m_s);
            Course::try_new(ends, speed_m_s, &read.mission).map_err(BlockError::Course)?;
        }
        let secret = secret(&block).map_err(BlockError::Config)?;
        let same = (read, secret) == (config, self.secret);
        if same && autopilot_key(&block) == self.autopilot_key {
            Ok(block)
        } else {
            Err(BlockError::Changed)
        }
    }
}

/// Converts a scenario's channel, with losses in dB, to the factors of a block.
///
/// The result equals [`uav_relay::Channel::from_db`] to the bit.
fn channel_numbers(spec: &ChannelSpec) -> ChannelNumbers {
    let factor = |db: f64| libm::pow(10.0, db / 10.0);
    ChannelNumbers {
        carrier_hz: spec.carrier_hz,
        excess_los: factor(spec.excess_loss_los_db),
        excess_nlos: factor(spec.excess_loss_nlos_db),
        los_weight: match spec.air_ground {
            AirGround::Los => 1.0,
            AirGround::Nlos => 0.0,
            AirGround::Weight(weight) => weight,
        },
    }
}

/// Returns two silences of a neighbour. After the first a relay requests heartbeats, after the second the neighbour is
/// lost.
///
/// 0 selects the firmware's default.
pub fn silence(probe_after_ms: u32) -> [Duration; 2] {
    let settings = match u64::from(probe_after_ms) {
        0 => Settings::default(),
        ms => Settings::default().with_probe_after(Duration::from_millis(ms)),
    };
    [settings.probe_after, settings.dead_after]
}

/// Returns the silence of a neighbour, ms, after which a relay with this block requests heartbeats.
///
/// It is `given_ms` from the command line, or else the value in the scenario's section `network`; 0 selects the
/// firmware's default. `name` is the name of the scenario, for errors.
///
/// # Errors
/// A text with the scenario key whose value no block can have, the value, and the allowed value.
pub fn probe_after_ms(section: &Network, given_ms: Option<u32>, name: &str) -> Result<u32, String> {
    let refuse = |key: &str, value: u32, own: u32, why: &str| {
        format!(
            "{name}: network.{key} = {value}: must be {own}, or left out: {why}, and a configuration block cannot change it"
        )
    };
    let ms = |time: Duration| u32::try_from(time.as_micros() / 1_000).unwrap_or(u32::MAX);
    if let Some(baud) = section.baud.filter(|baud| *baud != BAUD) {
        let line = refuse(
            "baud",
            baud,
            BAUD,
            "the firmware's ports have only this data rate",
        );
        return Err(format!(
            "{line}; give the data rate of the radio channel with --baud"
        ));
    }
    let probe_after_ms = given_ms.or(section.probe_after_ms).unwrap_or(0);
    if probe_after_ms > MAX_PROBE_AFTER_MS {
        return Err(format!(
            "{name}: network.probe_after_ms = {probe_after_ms}: must be within 1 to {MAX_PROBE_AFTER_MS}"
        ));
    }
    let [_, dead_after] = silence(probe_after_ms);
    let dead = ms(dead_after);
    let own = section.dead_after_ms.filter(|_| given_ms.is_none());
    if let Some(after) = own.filter(|after| *after != dead) {
        let why = "the firmware always uses three times probe_after_ms as dead_after_ms";
        return Err(refuse("dead_after_ms", after, dead, why));
    }
    // 0 is used for the default, so that both give the same block.
    let [usual, _] = silence(0);
    let is_usual = Duration::from_millis(probe_after_ms.into()) == usual;
    Ok(if is_usual { 0 } else { probe_after_ms })
}
