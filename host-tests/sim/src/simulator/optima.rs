//! Whether relays hold the places that they would have if nothing had ever happened.

use std::collections::HashMap;

use uav_relay::{Mission, Placement, Settings, Wiring};

use super::drones::{Point, apart};
use super::outcome::{Ending, Outcome};
use super::setup::Setup;

/// Places that are no farther apart are the same, m.
const SAME_M: f64 = 1e-3;

/// The places of a chain, `None` if it has none.
pub type Places = Option<Vec<Point>>;

/// Runs a chain to its end; `None` where a relay refuses its settings.
pub type Run = fn(Setup) -> Option<Outcome>;

/// The places that were asked for so far: by who is in the chain, and by the version of the mission.
#[derive(Debug)]
pub struct Optima {
    run: Run,
    known: HashMap<(Vec<u16>, u16), Places>,
}

impl Optima {
    /// None yet; `run` finds them.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            known: HashMap::new(),
        }
    }

    /// Whether the relays `nodes` (from 1) of a run of `setup` have the places that the mission of `version` has for exactly them.
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

/// A chain of just `nodes` that nothing happens to, with the mission of `version`; `None` where there is no such mission.
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

/// Where the relays of a run settled.
pub fn places_of(outcome: &Outcome) -> Places {
    let point = |place: Placement| [place.x_m, place.y_m, place.altitude_m].map(f64::from);
    let places = outcome.relays.iter().map(|relay| relay.setpoint.map(point));
    (outcome.ending == Ending::Settled).then(|| places.collect())?
}
