//! Check before flight of a whole chain, `--check`: a table of the relays' reports.

use std::collections::BTreeMap;

use uav_relay::flight::autopilot::state::State;
use uav_relay::{Duration, Ground, Instant, Phase, Report};
use uav_relay_linux::check::{End, colour, verdict};
use uav_relay_linux::log::Log;

use crate::options::Plan;
use crate::uploading::{Fault, Outcome};

/// Age from which the last report of a relay counts as too old.
const OLD: Duration = Duration::from_millis(10_000);

/// Time for which all relays must stay green (without a fault) before the check ends with success.
///
/// Only every eighth report of a relay has its neighbours and its version, so a shorter time could miss a fault.
const GREEN_FOR: Duration = Duration::from_millis(2_000);

/// Running check of a chain before flight.
#[derive(Debug)]
pub(crate) struct Check {
    end: End,
    /// Newest report of each relay. The key is the relay's number.
    reports: BTreeMap<u16, Report>,
}

impl Check {
    /// Requests the reports of all relays. The check takes at most `seconds`.
    pub(crate) fn begin(now: Instant, seconds: u64, ground: &mut Ground) -> Self {
        ground.watch(now, true);
        Self {
            end: End {
                limit: now + Duration::from_millis(1_000 * seconds),
                green_for: GREEN_FOR,
                green_since: None,
            },
            reports: BTreeMap::new(),
        }
    }

    /// Logs the table of the relays, and returns the result at the end of the check; `None` before the end.
    ///
    /// `arrived` are the reports received since the last call. The check ends when all relays have stayed green (without
    /// a fault), or when its time is over.
    pub(crate) fn turn(
        &mut self,
        now: Instant,
        plan: &Plan,
        arrived: &[Report],
        log: &Log,
    ) -> Outcome {
        for report in arrived {
            let newest = self.reports.entry(report.relay).or_insert(*report);
            newest.update(*report);
        }
        let reports = &self.reports;
        let version = reports.values().filter_map(|it| it.version).max();
        let relays = plan.loaded.mission.relays();
        let rows = (1..=relays).map(|index| {
            let report = reports.get(&index);
            let faults = report.map_or(vec!["no report"], |it| faults(now, it, relays, version));
            (index, report, faults)
        });
        let rows: Vec<_> = rows.collect();
        let red = rows
            .iter()
            .filter(|(_, _, faults)| !faults.is_empty())
            .count();
        if !self.end.is_reached(now, red == 0) {
            return None;
        }
        log.line(
            now,
            "check",
            "relay  colour  control   position x, y, h     neighbours  version  faults",
        );
        for (index, report, faults) in &rows {
            let colour = colour(faults.is_empty());
            let row = report.map(|it| {
                let position = it.position.map_or_else(String::new, |at| {
                    format!("{:.0}, {:.0}, {:.0} m", at.x_m, at.y_m, at.altitude_m)
                });
                let number =
                    |it: Option<u16>| it.map_or_else(|| "-".to_owned(), |it| it.to_string());
                let [before, after] = it.neighbours.map(number);
                let control = it
                    .control
                    .map_or_else(|| "-".to_owned(), |state| format!("{state:?}"));
                format!(
                    "{control:<9} {position:<20} {:<11} {:<8}",
                    format!("{before}, {after}"),
                    number(it.version)
                )
            });
            let faults = faults.join(", ");
            log.line(
                now,
                "check",
                format_args!(
                    "{index:<6} {colour:<7} {:<51} {faults}",
                    row.unwrap_or_default()
                ),
            );
        }
        let verdict = verdict(red, relays.into(), "relays");
        Some(
            verdict
                .map(|_| ())
                .map_err(|line| Fault { line, status: 1 }),
        )
    }
}

/// Returns the faults of a relay before flight. An empty list means that the relay is green.
fn faults(now: Instant, report: &Report, relays: u16, version: Option<u16>) -> Vec<&'static str> {
    let Report {
        relay,
        control,
        position,
        neighbours,
        phase,
        ..
    } = *report;
    let expected = [relay - 1, if relay < relays { relay + 1 } else { 0 }];
    let expected = expected.map(|node| Some(node).filter(|node| *node != 0));
    let all = [
        (now.since(report.at) >= OLD, "report older than 10 s"),
        (report.is_duplicated, "another relay has its number"),
        (
            report.other_key.is_some(),
            "a relay near it signs with another key",
        ),
        (
            report.other_mission.is_some(),
            "a relay near it has another mission",
        ),
        (
            report.old_epoch.is_some(),
            "a relay near it has started with an old epoch",
        ),
        (
            report.refuses_setpoint,
            "the autopilot flies to another target",
        ),
        (control.is_none(), "no autopilot"),
        (control == Some(State::Silent), "autopilot silent"),
        (
            matches!(
                control,
                Some(State::Standby | State::Engaged | State::Blind)
            ),
            "in the air",
        ),
        (position.is_none(), "no position"),
        (
            neighbours != expected,
            "neighbours are not the relays with the next numbers",
        ),
        (report.silent.contains(&true), "a neighbour is silent"),
        (phase == Phase::NoQuorum, "no quorum"),
        (phase == Phase::Infeasible, "no feasible positions"),
        (
            report.agreed.is_none() || !report.holds_lease,
            "no agreement",
        ),
        (report.version != version, "older mission"),
    ];
    all.into_iter()
        .filter(|(is, _)| *is)
        .map(|(_, fault)| fault)
        .collect()
}
