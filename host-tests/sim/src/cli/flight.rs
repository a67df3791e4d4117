//! Options for drones with autopilots and their pilots.

use crate::command::Failure;
use std::path::{Path, PathBuf};

use crate::simulator::drones::Point;
use crate::simulator::fleet::spec::{FleetSpec, Takeover, somewhere};
use crate::simulator::setup::Setup;
use clap::Args;
use uav_relay::GuardConfig;
use uav_relay::Instant;
use uav_relay::flight::axis::{Axis, LONGEST_M, SHORTEST_M};

use super::times::span;

/// Bounds on the constant and the random position error, m; standard deviation of gusts, m/s.
const BIAS_M: f64 = 0.5;
const NOISE_M: f64 = 0.3;
const GUST_MPS: f64 = 0.3;

/// Largest reported distance of a hovering drone from its setpoint, m: position noise and gusts.
const HOVER_M: f32 = 1.5;

/// Command-line options for drones.
#[derive(Args, Debug)]
#[command(next_help_heading = "Drones")]
pub struct Flight {
    /// Simulate drones: limited speed and acceleration, position noise, gusts, autopilots, pilots, guard. The autopilots speak
    /// MAVLink (PX4 and ArduCopter in turn), and the pilots take off and hand over. The run ends when all flying drones hover at
    /// their positions
    #[arg(long)]
    fly: bool,
    /// The pilot of drone I takes over from second S until E, or permanently. Repeatable
    #[arg(long, value_name = "I@S[-E]", value_parser = takeover)]
    takeover: Vec<Takeover>,
    /// File with the position of each drone's first hand-over, one line `index, x_m, y_m, h_m` per drone
    #[arg(long, value_name = "FILE", requires = "fly")]
    start: Option<PathBuf>,
}

/// Bound on |x|, |y| and height of a start position, m.
const START_WITHIN_M: f64 = 5_000.0;

impl Flight {
    pub const fn is_chosen(&self) -> bool {
        self.fly
    }

    /// Returns the takeover options with their start times.
    pub fn begins(&self) -> impl Iterator<Item = (String, Instant)> {
        let name = |it: &Takeover| (format!("--takeover {}", it.relay), it.from);
        self.takeover.iter().map(name)
    }

    /// Returns the times of all events.
    pub fn times(&self) -> impl Iterator<Item = Instant> {
        self.takeover
            .iter()
            .map(|takeover| takeover.until.unwrap_or(takeover.from))
    }

    /// Checks the options against a chain of `uavs` relays.
    pub fn agree(&self, uavs: u16) -> Result<(), Failure> {
        if let (false, Some(Takeover { relay, .. })) = (self.fly, self.takeover.first()) {
            let line = format!("--takeover {relay}@..: would be ignored without --fly");
            return Err(Failure::input(line));
        }
        let wrong = |takeover: &&Takeover| !(1..=uavs).contains(&takeover.relay);
        match self.takeover.iter().find(wrong) {
            Some(takeover) => Err(Failure::input(format!(
                "--takeover {}@..: relay must be within 1 to {uavs}",
                takeover.relay
            ))),
            None => Ok(()),
        }
    }

    /// Adds the drones to the setup; by default evenly spaced along the line.
    pub fn prepare(&self, setup: &mut Setup, axis: Option<Axis>) -> Result<(), Failure> {
        if !self.fly {
            return Ok(());
        }
        let config = setup.mission.config();
        let distance_m = f64::from(config.distance_m);
        let axis = axis.or_else(|| somewhere(distance_m)).ok_or_else(|| {
            Failure::input(format!(
                "--fly: the line is {distance_m} m long: must be within {SHORTEST_M} to {LONGEST_M} m"
            ))
        })?;
        let start = match &self.start {
            Some(file) => starts(file, config.relays)?,
            None => (0..config.relays)
                .map(|index| {
                    let share = (f64::from(index) + 0.5) / f64::from(config.relays);
                    [distance_m * share, 0.0, f64::from(config.common.altitude_m)]
                })
                .collect(),
        };
        let mut guard = GuardConfig::of(&setup.mission, config.common);
        guard.hover_m = HOVER_M;
        setup.settings.guard = Some(guard);
        setup.settings.sited = true;
        setup.fleet = Some(FleetSpec {
            axis,
            start,
            takeovers: self.takeover.clone(),
            restarts: Vec::new(),
            gust_mps: GUST_MPS,
            bias_m: BIAS_M,
            noise_m: NOISE_M,
        });
        Ok(())
    }
}

fn takeover(text: &str) -> Result<Takeover, String> {
    let form = "must be I@S or I@S-E, a relay (1 to N) and seconds after the start (0 to 1e6)";
    let (relay, times) = text.split_once('@').ok_or(form)?;
    let relay = relay.parse().map_err(|_| form)?;
    let (from, until) = span(times).ok_or(form)?;
    if until.is_some_and(|until| until <= from) {
        return Err("must be I@S-E with E after S".to_owned());
    }
    Ok(Takeover {
        relay,
        from,
        until,
        to: None,
    })
}

/// Reads the start positions of all drones from a file.
fn starts(file: &Path, relays: u16) -> Result<Vec<Point>, Failure> {
    let named = |what: String| Failure::input(format!("--start {}: {what}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| named(error.to_string()))?;
    let mut starts = vec![None; usize::from(relays)];
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let at = |what: String| named(format!("line {}: {what}", number + 1));
        let form = || at(format!("`{line}`: must be `index, x_m, y_m, h_m`"));
        let mut parts = line.split(',').map(str::trim);
        let index: u16 = parts
            .next()
            .and_then(|part| part.parse().ok())
            .ok_or_else(form)?;
        let mut place = [0.0; 3];
        for (value, least) in place
            .iter_mut()
            .zip([-START_WITHIN_M, -START_WITHIN_M, 2.0])
        {
            *value = parts
                .next()
                .and_then(|part| part.parse::<f64>().ok())
                .ok_or_else(form)?;
            if !(least..=START_WITHIN_M).contains(value) {
                return Err(at(format!(
                    "{value} m: must be within {least} to {START_WITHIN_M}"
                )));
            }
        }
        if parts.next().is_some() {
            return Err(form());
        }
        let start = index
            .checked_sub(1)
            .and_then(|index| starts.get_mut(usize::from(index)))
            .ok_or_else(|| at(format!("drone {index}: must be within 1 to {relays}")))?;
        if start.replace(place).is_some() {
            return Err(at(format!("drone {index} is there twice")));
        }
    }
    let complete: Option<Vec<Point>> = starts.iter().copied().collect();
    complete.ok_or_else(|| {
        let missing = starts.iter().position(Option::is_none).unwrap_or(0) + 1;
        named(format!(
            "drone {missing} is missing: a line for each of 1 to {relays}"
        ))
    })
}
