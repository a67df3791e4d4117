//! Report of a run in which drones are replaced when their batteries run low.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;

use super::timeline::seconds;
use crate::simulator::rotation::{
    Dip, DipCause, GOOD, NearDrone, RESERVE_S, Rotated, RotationSpec,
};

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
    /// A relay may stay until its battery has just enough for the way home and the reserve. Its time together with the
    /// spare that joins before a departure is subtracted.
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
    /// Seconds with an SIR below 0.99 of the optimum, by cause.
    pub below_s: BTreeMap<DipCause, f64>,
    /// Each time with an SIR below 0.99 of the optimum.
    pub dips: Vec<Dip>,
}

impl RotationFigures {
    /// Creates the figures of a run. `chains` is the largest number of chains that flew at the same time.
    pub fn new(spec: &RotationSpec, rotated: &Rotated, chains: usize) -> Self {
        let hours = rotated.watched_s / 3_600.0;
        let left = f64::from(rotated.replaced).max(1.0);
        // The drones' own times in the chain are known: no relay may stay longer than its battery allows. A spare joins
        // before the relay leaves, so for some time both are in the chain.
        let both_s = (rotated.served_s - f64::from(spec.flying) * rotated.watched_s) / left;
        let alone_s = rotated.possible_s / left - both_s.max(0.0);
        Self {
            complete_at_s: rotated.complete_at.map(seconds),
            watched_s: rotated.watched_s,
            below: rotated.below_s / rotated.watched_s.max(1.0),
            worst: rotated.worst.map(|(share, _)| share),
            worst_at_s: rotated.worst.map(|(_, at)| seconds(at)),
            replaced: rotated.replaced,
            forced: rotated.forced,
            per_hour: f64::from(rotated.replaced) / hours.max(1e-9),
            arithmetic_per_hour: f64::from(spec.flying) * 3_600.0 / alone_s.max(1.0),
            mean_wait_s: rotated.waits_s / left,
            longest_wait_s: rotated.longest_wait_s,
            least_left_s: rotated.least_left_s,
            nearest_m: rotated.nearest.as_ref().map(|it| it.apart_m),
            nearest_at_s: rotated.nearest.as_ref().map(|it| seconds(it.at)),
            nearest: rotated.nearest.as_ref().map(|it| it.drones.clone()),
            chains,
            below_s: rotated.dips.iter().flat_map(|dip| &dip.causes).fold(
                BTreeMap::new(),
                |mut all, (cause, span_s)| {
                    *all.entry(*cause).or_default() += span_s;
                    all
                },
            ),
            dips: rotated.dips.clone(),
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

    fn figures(&self) -> impl Iterator<Item = &RotationFigures> {
        std::iter::once(&self.announced).chain(&self.unannounced)
    }

    /// Formats the figures as a table with two columns: announced and unannounced departures.
    pub fn table(&self) -> String {
        let title = format!(
            "replacement of drones with low batteries, {} fly",
            self.flying
        );
        let mut text = format!("\n{title:<52}{:>14}{:>14}\n", "announced", "unannounced");
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
        row(
            &format!("time with an SIR below {GOOD} of the optimum, %"),
            &|it| format!("{:.4}", 100.0 * it.below),
        );
        let causes = self.figures().flat_map(|it| it.below_s.keys());
        for cause in causes.collect::<std::collections::BTreeSet<_>>() {
            row(&format!("  {}, s", cause.name()), &|it| {
                format!("{:.1}", it.below_s.get(cause).copied().unwrap_or(0.0))
            });
        }
        row("lowest SIR of the worst hop, share of the optimum", &|it| {
            some(it.worst, 4)
        });
        row("time of the lowest SIR, s", &|it| some(it.worst_at_s, 1));
        row("replacements", &|it| it.replaced.to_string());
        row("drones that left without permission of the chain", &|it| {
            it.forced.to_string()
        });
        row("replacements per hour", &|it| format!("{:.2}", it.per_hour));
        row("replacements per hour that the batteries require", &|it| {
            format!("{:.2}", it.arithmetic_per_hour)
        });
        row("time from request to permission to leave, mean, s", &|it| {
            format!("{:.1}", it.mean_wait_s)
        });
        row(
            "time from request to permission to leave, longest, s",
            &|it| format!("{:.1}", it.longest_wait_s),
        );
        row(
            &format!("least flight time left at home (required: {RESERVE_S}), s"),
            &|it| some(it.least_left_s, 1),
        );
        row("smallest distance between two drones, m", &|it| {
            some(it.nearest_m, 2)
        });
        row("time of the smallest distance, s", &|it| {
            some(it.nearest_at_s, 1)
        });
        row(
            "largest number of separate chains at the same time",
            &|it| it.chains.to_string(),
        );
        if self.unannounced.is_some() {
            text += "unannounced: a drone with a low battery flies home with its relay off, and a spare in the air is switched on at that moment\n";
        }
        for figures in self.figures() {
            for drone in figures.nearest.iter().flatten() {
                let [[x, y, h], [to_x, to_y, to_h]] = [drone.at_m, drone.goal_m];
                _ = writeln!(
                    text,
                    "smallest distance: relay {} at x, y, altitude ({x:.1}, {y:.1}, {h:.1}) m, on its way to ({to_x:.1}, {to_y:.1}, {to_h:.1}) m: {}",
                    drone.relay, drone.state
                );
            }
        }
        text
    }
}

/// Results of several runs with announced departures, which differ by their seeds.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct RotationRuns {
    /// Seed and figures of each run.
    pub runs: Vec<(u64, RotationFigures)>,
}

impl RotationRuns {
    /// Formats one line for each run, and the totals.
    pub fn table(&self) -> String {
        let mut text = format!(
            "{:>8} {:>7} {:>9} {:>7} {:>5} {:>7} {:>8} {:>8} {:>9} {:>8} {:>7}\n",
            "seed",
            "hours",
            "below, %",
            "lowest",
            "left",
            "forced",
            "per hour",
            "computed",
            "least, s",
            "near, m",
            "chains"
        );
        let mut line = |seed: &str, it: &RotationFigures| {
            let lowest = it.worst.unwrap_or(f64::NAN);
            let [left_s, near_m] =
                [it.least_left_s, it.nearest_m].map(|it| it.unwrap_or(f64::INFINITY));
            let hours = it.watched_s / 3_600.0;
            _ = writeln!(
                text,
                "{seed:>8} {hours:>7.2} {:>9.4} {lowest:>7.3} {:>5} {:>7} {:>8.2} {:>8.2} {left_s:>9.1} {near_m:>8.2} {:>7}",
                100.0 * it.below,
                it.replaced,
                it.forced,
                it.per_hour,
                it.arithmetic_per_hour,
                it.chains
            );
        };
        for (seed, figures) in &self.runs {
            line(&seed.to_string(), figures);
        }
        let all = self.total();
        line("all", &all);
        text += "hours: time after the chain was complete; below: share of it with an SIR below 0.99 of the optimum; lowest: smallest share of the optimum\n\
                 left: drones replaced; forced: those that left without permission; computed: replacements per hour that the batteries require\n\
                 least: smallest flight time left at home; near: smallest distance between two drones; chains: most separate chains at the same time\n";
        for (cause, span_s) in &all.below_s {
            _ = writeln!(
                text,
                "SIR below {GOOD} of the optimum for {span_s:.1} s: {}",
                cause.name()
            );
        }
        text
    }

    /// Returns the figures of all runs together: sums, averages by time, and extreme values.
    fn total(&self) -> RotationFigures {
        let all = || self.runs.iter().map(|(_, figures)| figures);
        let watched_s: f64 = all().map(|it| it.watched_s).sum();
        let mean = |of: &dyn Fn(&RotationFigures) -> f64| {
            all().map(|it| of(it) * it.watched_s).sum::<f64>() / watched_s.max(1e-9)
        };
        let least =
            |of: &dyn Fn(&RotationFigures) -> Option<f64>| all().filter_map(of).reduce(f64::min);
        let mut below_s = BTreeMap::new();
        for (cause, span_s) in all().flat_map(|it| &it.below_s) {
            *below_s.entry(*cause).or_default() += span_s;
        }
        RotationFigures {
            complete_at_s: None,
            watched_s,
            below: mean(&|it| it.below),
            worst: least(&|it| it.worst),
            worst_at_s: None,
            replaced: all().map(|it| it.replaced).sum(),
            forced: all().map(|it| it.forced).sum(),
            per_hour: mean(&|it| it.per_hour),
            arithmetic_per_hour: mean(&|it| it.arithmetic_per_hour),
            mean_wait_s: mean(&|it| it.mean_wait_s),
            longest_wait_s: all().map(|it| it.longest_wait_s).fold(0.0, f64::max),
            least_left_s: least(&|it| it.least_left_s),
            nearest_m: least(&|it| it.nearest_m),
            nearest_at_s: None,
            nearest: None,
            chains: all().map(|it| it.chains).max().unwrap_or(0),
            below_s,
            dips: Vec::new(),
        }
    }
}
