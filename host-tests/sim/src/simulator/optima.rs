//! Comparison of the relays' positions with those of an undisturbed run.

use std::collections::HashMap;

use uav_relay::{Mission, Placement, Settings, Wiring};

use super::drones::{Point, apart};
use super::outcome::{Ending, Outcome};
use super::setup::Setup;

/// Largest distance of positions that count as equal, m.
const SAME_M: f64 = 1e-3;

/// Positions of a chain; `None` if it did not settle.
pub type Places = Option<Vec<Point>>;

/// Function that runs a chain to its end; `None` if a relay rejects its settings.
pub type Run = fn(Setup) -> Option<Outcome>;

/// Cache of reference positions, by the members of the chain and the version of the mission.
#[derive(Debug)]
pub struct Optima {
    run: Run,
    known: HashMap<(Vec<u16>, u16), Places>,
}

impl Optima {
    /// Empty cache; `run` computes missing entries.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            known: HashMap::new(),
        }
    }

    /// Returns true if `places` are the reference positions of relays `nodes` (from 1) and this mission.
    pub fn is_met(
        &mut self,
        setup: &Setup,
        nodes: &[u16],
        version: u16,
        places: &[Option<Point>],
    ) -> bool {
        if places.iter().any(Option::is_none) {
            return false;
        }
        let run = self.run;
        let optimum = self
            .known
            .entry((nodes.to_vec(), version))
            .or_insert_with(|| places_of(&run(alone(setup, nodes, version)?)?));
        optimum.as_ref().is_some_and(|optimum| {
            let mut pairs = optimum.iter().zip(places.iter().flatten());
            optimum.len() == nodes.len() && pairs.all(|(one, other)| apart(*one, *other) < SAME_M)
        })
    }
}

/// Returns a fault-free setup with only `nodes` and the mission of `version`. `None` if the mission or the count is invalid.
pub fn alone(setup: &Setup, nodes: &[u16], version: u16) -> Option<Setup> {
    let uploaded = setup
        .uploads
        .iter()
        .find(|spec| spec.upload.version() == version);
    let mission = match uploaded {
        Some(spec) => Mission::try_new(*spec.upload.config()).ok()?,
        None => setup.mission,
    };
    let mut clean = Setup::new(mission.with_relays(u16::try_from(nodes.len()).ok()?).ok()?);
    clean.settings = Settings {
        wiring: Wiring::Pair,
        auth: None,
        guard: None,
        ..setup.settings
    };
    for (index, node) in (1..).zip(nodes) {
        let own = setup.profiles.iter().find(|(of, _)| of == node);
        clean
            .profiles
            .extend(own.map(|(_, profile)| (index, *profile)));
        if setup.held.contains(node) {
            clean.held.push(index);
        }
    }
    Some(clean)
}

/// Returns the final positions of a settled run.
pub fn places_of(outcome: &Outcome) -> Places {
    let point = |place: Placement| [place.x_m, place.y_m, place.altitude_m].map(f64::from);
    let places = outcome.relays.iter().map(|relay| relay.setpoint.map(point));
    (outcome.ending == Ending::Settled).then(|| places.collect())?
}
