//! Report of a run in which drones are replaced when their batteries run low.

use std::fmt::Write as _;

use serde::Serialize;

use super::timeline::seconds;
use crate::simulator::rotation::{GOOD, NearDrone, RESERVE_S, Rotated, RotationSpec};

/// Result of a run in which drones are replaced when their batteries run low.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RotationReport {
    /// Number of drones that are meant to fly.
    pub flying: u16,
    /// Figures of the run in which a drone with a low battery announces that it will leave the chain. A replacement
    /// joins the chain before the drone leaves.
    pub announced: RotationFigures,
    /// Figures of the same run without announcements; absent if this run was not made.
    ///
    /// A drone with a low battery then flies home and switches its relay off, so that the chain loses the relay. At the
    /// same time a spare is switched on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unannounced: Option<RotationFigures>,
}

/// Figures of one run with replacements.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RotationFigures {
    /// Time when all drones that are meant to fly were first in the chain and in place, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub complete_at_s: Option<f64>,
    /// Duration of the statistics, s: from `complete_at_s` to the end of the run.
    pub watched_s: f64,
    /// Fraction of `watched_s` in which the SIR of the worst hop was below 99 % of the best possible SIR.
    pub below: f64,
    /// Smallest SIR of the worst hop since `complete_at_s`, as a fraction of the best possible SIR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<f64>,
    /// Virtual time of the smallest SIR, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_at_s: Option<f64>,
    /// Number of relays that left the chain since `complete_at_s`.
    pub replaced: u32,
    /// Number of relays, among `replaced`, that had to leave before the chain permitted it.
    pub forced: u32,
    /// Number of relays that left the chain per hour since `complete_at_s`.
    pub per_hour: f64,
    /// Number of relays per hour that would leave if each stayed as long as its battery allows.
    ///
    /// A relay may stay until its battery has just enough for the way home and the reserve.
    pub arithmetic_per_hour: f64,
    /// Mean time from a relay's request to leave until it left, s.
    pub mean_wait_s: f64,
    /// Longest time from a relay's request to leave until it left, s.
    pub longest_wait_s: f64,
    /// Smallest endurance, s, that was expected to remain at home, over all drones that left the chain. It is computed
    /// when a drone leaves: the remaining endurance less the time of the flight home.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_left_s: Option<f64>,
    /// Smallest true distance of two drones in the air, m. Drones flown by their pilots count, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest_m: Option<f64>,
    /// Time of the closest approach, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest_at_s: Option<f64>,
    /// The two drones of the closest approach, with their states at the time `nearest_at_s`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<[NearDrone; 2]>,
    /// Largest number of chains that flew at the same time, each on an agreement of its own. More than 1 means that the
    /// chain was split.
    pub chains: usize,
}

impl RotationFigures {
    fn new(spec: &RotationSpec, rotated: &Rotated, chains: usize) -> Self {
        let hours = rotated.watched_s / 3_600.0;
        let left = f64::from(rotated.replaced).max(1.0);
        // The drones' own times in the chain are known: no relay may stay longer than its battery allows.
        let served_s = rotated.possible_s / left;
        Self {
            complete_at_s: rotated.complete_at.map(seconds),
            watched_s: rotated.watched_s,
            below: rotated.below_s / rotated.watched_s.max(1.0),
            worst: rotated.worst.map(|(share, _)| share),
            worst_at_s: rotated.worst.map(|(_, at)| seconds(at)),
            replaced: rotated.replaced,
            forced: rotated.forced,
            per_hour: f64::from(rotated.replaced) / hours.max(1e-9),
            arithmetic_per_hour: f64::from(spec.flying) * 3_600.0 / served_s.max(1.0),
            mean_wait_s: rotated.waits_s / left,
            longest_wait_s: rotated.longest_wait_s,
            least_left_s: rotated.least_left_s,
            nearest_m: rotated.nearest.as_ref().map(|it| it.apart_m),
            nearest_at_s: rotated.nearest.as_ref().map(|it| seconds(it.at)),
            nearest: rotated.nearest.as_ref().map(|it| it.drones.clone()),
            chains,
        }
    }
}

impl RotationReport {
    /// Creates the report from two runs: with and without announced departures.
    ///
    /// The second value of each pair is the largest number of chains that flew at the same time, each on an agreement
    /// of its own.
    pub fn new(
        spec: &RotationSpec,
        announced: (&Rotated, usize),
        unannounced: Option<(&Rotated, usize)>,
    ) -> Self {
        Self {
            flying: spec.flying,
            announced: RotationFigures::new(spec, announced.0, announced.1),
            unannounced: unannounced
                .map(|(rotated, chains)| RotationFigures::new(spec, rotated, chains)),
        }
    }

    /// Formats the figures as a table with two columns: announced and unannounced departures.
    pub fn table(&self) -> String {
        let mut text = format!(
            "\nreplacement of tired drones, {} of the fleet flying{:>17}{:>14}\n",
            self.flying, "announced", "unannounced"
        );
        let mut row = |name: &str, of: &dyn Fn(&RotationFigures) -> String| {
            let plain = self.unannounced.as_ref().map_or(String::new(), of);
            _ = writeln!(text, "{name:<52}{:>14}{plain:>14}", of(&self.announced));
        };
        let some = |value: Option<f64>, digits: usize| {
            value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
        };
        row("hours after the chain was complete", &|it| {
            format!("{:.2}", it.watched_s / 3_600.0)
        });
        row(&format!("time below {GOOD} of the optimum, %"), &|it| {
            format!("{:.4}", 100.0 * it.below)
        });
        row("lowest SIR of the worst hop, share of the optimum", &|it| {
            some(it.worst, 4)
        });
        row("time of the lowest SIR, s", &|it| some(it.worst_at_s, 1));
        row("replacements", &|it| it.replaced.to_string());
        row("drones that left without permission of the chain", &|it| {
            it.forced.to_string()
        });
        row("replacements per hour", &|it| format!("{:.2}", it.per_hour));
        row("replacements per hour, computed from batteries", &|it| {
            format!("{:.2}", it.arithmetic_per_hour)
        });
        row("from request to leave to permission, mean, s", &|it| {
            format!("{:.1}", it.mean_wait_s)
        });
        row("from request to leave to permission, longest, s", &|it| {
            format!("{:.1}", it.longest_wait_s)
        });
        row(
            &format!("least endurance left at home (required: {RESERVE_S}), s"),
            &|it| some(it.least_left_s, 1),
        );
        row("smallest distance of two drones, m", &|it| {
            some(it.nearest_m, 2)
        });
        row("time of the smallest distance, s", &|it| {
            some(it.nearest_at_s, 1)
        });
        row("most parts of the chain with separate agreements", &|it| {
            it.chains.to_string()
        });
        if self.unannounced.is_some() {
            text += "unannounced: a tired drone flies home with its relay off, and a spare in the air is switched on at that moment\n";
        }
        for figures in std::iter::once(&self.announced).chain(&self.unannounced) {
            for drone in figures.nearest.iter().flatten() {
                let [[x, y, h], [to_x, to_y, to_h]] = [drone.at_m, drone.goal_m];
                _ = writeln!(
                    text,
                    "smallest distance: relay {} at ({x:.1}, {y:.1}, {h:.1}) m, flies to ({to_x:.1}, {to_y:.1}, {to_h:.1}) m: {}",
                    drone.relay, drone.state
                );
            }
        }
        text
    }
}
