//! Statistics over time. Availability of the chain, simultaneous groups, and smallest distance of relays.

use uav_relay::{Duration, Instant};

use super::drones::{Point, apart};
use super::flying::{self, Seen};
use super::optima::{Optima, Run};
pub use super::outcome::Watched;

/// Running statistics.
#[derive(Debug)]
pub struct Watch {
    pub(super) seen: Vec<Seen>,
    pub(super) optima: Optima,
    /// Last setpoint of each relay.
    stood: Vec<Option<Point>>,
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
    /// Starts with the given states; `run` computes the reference positions.
    pub fn new(seen: Vec<Seen>, run: Run) -> Self {
        Self {
            stood: vec![None; seen.len()],
            seen,
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

    /// Advances the time to `now` with unchanged states.
    pub fn go_on(&mut self, now: Instant) {
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

    /// Updates the state of relay `at` (from 0). Returns true if it changed.
    pub fn see(&mut self, at: usize, seen: Seen) -> bool {
        let Some(known) = self.seen.get_mut(at) else {
            return false;
        };
        if *known == seen {
            return false;
        }
        *known = seen;
        let before = self.stood.get(at).copied().flatten();
        if seen.place.is_some() && seen.place != before {
            self.move_to(at, seen.place);
        }
        true
    }

    fn move_to(&mut self, at: usize, place: Option<Point>) {
        if let Some(stood) = self.stood.get_mut(at) {
            *stood = place;
        }
        for (other, stood) in self.stood.iter().enumerate() {
            if let (Some(one), Some(two)) = (place, stood)
                && other != at
            {
                let apart = apart(one, *two);
                self.least_m = Some(self.least_m.map_or(apart, |least| least.min(apart)));
            }
        }
    }

    /// Evaluates the states after all changes at `now`.
    pub fn take_in(&mut self, now: Instant) {
        self.most_flying = self.most_flying.max(flying::groups(&self.seen));
        if self.first.is_none() && flying::has_agreed(&self.seen) {
            self.first = Some(now);
        }
    }

    /// Sets if the chain is at its optimum from now on.
    pub fn judge(&mut self, is_right: bool) {
        if self.is_right && !is_right {
            self.wrong = Duration::from_micros(0);
        }
        self.is_right = is_right;
    }

    /// Returns the statistics up to `now`; `flown_m` is the smallest distance of simulated drones.
    pub fn end(mut self, now: Instant, is_judged: bool, flown_m: Option<f64>) -> Watched {
        self.go_on(now);
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
