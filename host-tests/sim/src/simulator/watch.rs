//! Statistics over time. Availability of the chain, simultaneous groups, and smallest distance of relays.

use std::collections::HashMap;

use uav_relay::{Duration, Instant, Mission, Settings, Wiring};

use super::drones::{Point, apart, point};
pub use super::observed::{ObservedState, groups, has_agreed};
pub use super::outcome::Watched;
use super::outcome::{Ending, Outcome};
use super::setup::Setup;

/// Statistics of a run: availability of the chain, groups of flying relays, distance between relays.
#[derive(Debug)]
pub struct Watch {
    pub(super) states: Vec<ObservedState>,
    pub(super) optima: Optima,
    /// Last setpoint of each relay, from relay 1; `None` if it never had one. A relay that is off keeps its last
    /// setpoint.
    last_setpoints: Vec<Option<Point>>,
    until: Instant,
    first: Option<Instant>,
    is_right: bool,
    right: Duration,
    wrong: Duration,
    longest_wrong: Duration,
    most_flying: usize,
    least_m: Option<f64>,
}

impl Watch {
    /// Starts the statistics of a run with the relays' states `seen`.
    ///
    /// `run` simulates a fault-free chain, whose positions are the reference.
    pub fn new(seen: Vec<ObservedState>, run: Run) -> Self {
        Self {
            last_setpoints: vec![None; seen.len()],
            states: seen,
            optima: Optima::new(run),
            until: Instant::ZERO,
            first: None,
            is_right: false,
            right: Duration::from_micros(0),
            wrong: Duration::from_micros(0),
            longest_wrong: Duration::from_micros(0),
            most_flying: 0,
            least_m: None,
        }
    }

    /// Adds the time since the last call to the available time or to the outage. The last call of `set_available`
    /// decides which. Adds nothing before the first agreement on positions.
    pub fn count_time(&mut self, now: Instant) {
        let span = now.since(self.until);
        self.until = now;
        if self.first.is_none() {
            return;
        }
        let add = |one: Duration| Duration::from_micros(one.as_micros() + span.as_micros());
        if self.is_right {
            self.right = add(self.right);
        } else {
            self.wrong = add(self.wrong);
            self.longest_wrong = self.longest_wrong.max(self.wrong);
        }
    }

    /// Replaces the state of relay `at` (from 0) and updates the smallest distance. Returns true if the state has
    /// changed.
    pub fn record_state(&mut self, at: usize, seen: ObservedState) -> bool {
        let Some(known) = self.states.get_mut(at) else {
            return false;
        };
        if *known == seen {
            return false;
        }
        *known = seen;
        let before = self.last_setpoints.get(at).copied().flatten();
        if seen.place.is_some() && seen.place != before {
            self.move_to(at, seen.place);
        }
        true
    }

    fn move_to(&mut self, at: usize, place: Option<Point>) {
        if let Some(last) = self.last_setpoints.get_mut(at) {
            *last = place;
        }
        for (other, last) in self.last_setpoints.iter().enumerate() {
            if let (Some(one), Some(two)) = (place, last)
                && other != at
            {
                let apart = apart(one, *two);
                self.least_m = Some(self.least_m.map_or(apart, |least| least.min(apart)));
            }
        }
    }

    /// Updates the largest number of relay groups with separate agreements, and the time of the first one. The
    /// agreements are on positions. Changes of states at `now` must be recorded before this call.
    pub fn count_groups(&mut self, now: Instant) {
        self.most_flying = self.most_flying.max(groups(&self.states));
        if self.first.is_none() && has_agreed(&self.states) {
            self.first = Some(now);
        }
    }

    /// Records `is_right`: true if the chain counts as available from now on.
    ///
    /// The chain is available while the longest chain that the living relays can form is at the positions that it would
    /// reach in a run without faults.
    pub fn set_available(&mut self, is_right: bool) {
        if self.is_right && !is_right {
            self.wrong = Duration::from_micros(0);
        }
        self.is_right = is_right;
    }

    /// Returns the statistics up to `now`. They include the availability only if `is_judged` is true.
    ///
    /// `flown_m` is the smallest distance of simulated drones, m. It is `None` if no drones are simulated; the smallest
    /// distance between setpoints is then used.
    pub fn end(mut self, now: Instant, is_judged: bool, flown_m: Option<f64>) -> Watched {
        self.count_time(now);
        let share = self.first.map_or(0.0, |first| {
            self.right.as_micros() as f64 / now.since(first).as_micros().max(1) as f64
        });
        Watched {
            first_agreement: self.first,
            availability: is_judged.then_some(share),
            longest_wrong: is_judged.then_some(self.longest_wrong),
            most_flying: self.most_flying,
            least_separation_m: flown_m.or(self.least_m),
        }
    }
}

/// Largest number of chains that [`longest`] returns.
///
/// If many links are missing, there can be far more chains of the same length. To examine all of them would take too
/// long.
const MAX_CHAINS: usize = 1_000;

/// Returns the largest number of relays that can form a chain, and the chains of that many relays.
///
/// `on` lists the usable relays in ascending order, from 0. `links(a, b)` returns true if relays a < b can be
/// neighbours. Only chains whose relays all satisfy `with` are returned, and at most 1000 chains.
pub fn longest(
    on: &[usize],
    links: impl Fn(usize, usize) -> bool,
    with: impl Fn(usize) -> bool,
) -> (usize, Vec<Vec<usize>>) {
    let onward: Vec<Vec<usize>> = (0..on.len())
        .map(|at| {
            let later = at + 1..on.len();
            later
                .filter(|next| matches!((on.get(at), on.get(*next)), (Some(one), Some(other)) if links(*one, *other)))
                .collect()
        })
        .collect();
    let mut lengths = vec![1_usize; on.len()];
    for (at, next) in onward.iter().enumerate().rev() {
        let beyond = next.iter().filter_map(|next| lengths.get(*next).copied());
        let most = beyond.max().unwrap_or(0);
        if let Some(length) = lengths.get_mut(at) {
            *length = most + 1;
        }
    }
    let length = lengths.iter().copied().max().unwrap_or(0);
    let is = |at: &usize, length: usize| {
        lengths.get(*at) == Some(&length) && on.get(*at).is_some_and(|one| with(*one))
    };
    let mut ways: Vec<Vec<usize>> = (0..on.len())
        .filter(|at| is(at, length))
        .map(|at| vec![at])
        .collect();
    for left in (1..length).rev() {
        ways = ways
            .iter()
            .flat_map(|way| {
                let next = way.last().and_then(|last| onward.get(*last));
                let next = next.into_iter().flatten().filter(|at| is(at, left));
                next.map(|at| [way.as_slice(), &[*at]].concat())
            })
            .take(MAX_CHAINS)
            .collect();
    }
    let named = |way: Vec<usize>| {
        way.into_iter()
            .filter_map(|at| on.get(at).copied())
            .collect()
    };
    (length, ways.into_iter().map(named).collect())
}

#[cfg(test)]
mod tests {
    use super::longest;

    fn near(one: usize, other: usize) -> bool {
        one.abs_diff(other) <= 4
    }

    #[test]
    fn with_all_links_all_relays_are_in_the_chain() {
        let on: Vec<usize> = (0..8).collect();
        assert_eq!(longest(&on, near, |_| true), (8, vec![on.clone()]));
        let left = [0, 1, 4, 5, 7];
        assert_eq!(longest(&left, near, |_| true), (5, vec![left.to_vec()]));
        assert_eq!(longest(&[], near, |_| true), (0, vec![]));
    }

    #[test]
    fn one_of_two_unlinked_neighbours_is_left_out() {
        let on: Vec<usize> = (0..8).collect();
        let links = |one, other| near(one, other) && (one, other) != (2, 3);
        let (length, ways) = longest(&on, links, |_| true);
        assert_eq!(length, 7);
        assert_eq!(ways, [[0, 1, 2, 4, 5, 6, 7], [0, 1, 3, 4, 5, 6, 7]]);
        // Relay 2 has no position, so only the chain without it qualifies.
        let (length, ways) = longest(&on, links, |at| at != 2);
        assert_eq!((length, ways), (7, vec![vec![0, 1, 3, 4, 5, 6, 7]]));
    }

    #[test]
    fn unlinked_parts_are_separate_chains() {
        let on: Vec<usize> = (0..8).collect();
        let halves = |one: usize, other: usize| near(one, other) && (one < 4) == (other < 4);
        let both = longest(&on, halves, |_| true);
        assert_eq!(both, (4, vec![vec![0, 1, 2, 3], vec![4, 5, 6, 7]]));
        let parts = |one: usize, other: usize| near(one, other) && (one < 3) == (other < 3);
        assert_eq!(
            longest(&on, parts, |_| true),
            (5, vec![vec![3, 4, 5, 6, 7]])
        );
        // The five missing relays in a row leave a gap beyond radio range.
        assert_eq!(longest(&[0, 1, 7], near, |_| true).1, [[0, 1]]);
    }

    #[test]
    fn the_number_of_examined_chains_is_limited() {
        let on: Vec<usize> = (0..60).collect();
        // Twenty groups of three; each chain takes any one relay of each group.
        let links = |one: usize, other: usize| other / 3 == one / 3 + 1;
        let (length, ways) = longest(&on, links, |_| true);
        assert_eq!(length, 20);
        assert!(ways.len() == 1_000);
    }
}

/// Largest distance between two positions that count as equal, m.
const SAME_M: f64 = 1e-3;

/// Positions of a chain's relays, in order from Tx; `None` if the chain did not settle.
pub type Places = Option<Vec<Point>>;

/// Function that runs a simulated chain to its end; `None` if a relay rejects its settings.
pub type Run = fn(Setup) -> Option<Outcome>;

/// Cache of the positions that chains reach without faults. The key is the relays and the mission version.
#[derive(Debug)]
pub struct Optima {
    run: Run,
    known: HashMap<(Vec<u16>, u16), Places>,
}

impl Optima {
    /// Creates an empty cache. `run` simulates a chain without faults to compute missing positions.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            known: HashMap::new(),
        }
    }

    /// Returns true if `places` are the positions that a fault-free run of the relays `nodes` reaches.
    ///
    /// `version` is the version of their mission. False if a position is missing.
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
            .or_insert_with(|| places_of(&run(without_other_relays(setup, nodes, version)?)?));
        optimum.as_ref().is_some_and(|optimum| {
            let mut pairs = optimum.iter().zip(places.iter().flatten());
            optimum.len() == nodes.len() && pairs.all(|(one, other)| apart(*one, *other) < SAME_M)
        })
    }
}

/// Returns the setup of a fault-free run of only the relays `nodes`, with the mission of `version`.
///
/// `None` if the mission is invalid or does not allow that number of relays.
pub fn without_other_relays(setup: &Setup, nodes: &[u16], version: u16) -> Option<Setup> {
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

/// Returns the final positions of a run, relay 1 first; `None` if the relays did not settle.
pub fn places_of(outcome: &Outcome) -> Places {
    let places = outcome.relays.iter().map(|relay| relay.setpoint.map(point));
    (outcome.ending == Ending::Settled).then(|| places.collect())?
}
