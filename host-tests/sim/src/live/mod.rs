//! A running chain as an operator sees it: snapshots for a [`Screen`](uav_relay_screen::Screen).
//!
//! The snapshots contain what the relays report. A relay that is switched off keeps its last reported state, which grows old; it is
//! lost once another relay reports it.

mod alarms;

use std::collections::BTreeMap;

use uav_relay::flight::axis::Axis;
use uav_relay::{Geofence, Instant, Report, Side};
use uav_relay_screen::alarms::Alarms;
use uav_relay_screen::{Condition, LogLine, Snapshot, chain};

use crate::report::{seconds, timeline};
use crate::simulator::chain::Chain;
use crate::simulator::setup::Setup;
use alarms::Observe as _;

/// Display of a running chain: computes its snapshots, and keeps the history that they need.
#[derive(Debug)]
pub struct LiveView {
    axis: Option<Axis>,
    geofence: Option<Geofence>,
    /// Number of relays that are meant to fly; `None` without spares.
    flying: Option<u16>,
    alarms: Alarms,
    /// Number of log entries of the run that earlier snapshots have already shown.
    told: usize,
    /// Newest report of each relay. The key is the relay's number.
    known: BTreeMap<u16, Report>,
}

impl LiveView {
    /// Creates the view of a chain with this setup.
    pub fn new(setup: &Setup) -> Self {
        Self {
            axis: setup.fleet.as_ref().map(|fleet| fleet.axis),
            geofence: setup.settings.guard.map(|guard| guard.geofence),
            flying: Some(setup.settings.flying).filter(|it| *it > 0),
            alarms: Alarms::default(),
            told: 0,
            known: BTreeMap::new(),
        }
    }

    /// Returns the state of `chain` at the virtual time `now`. Its log has the entries since the previous call of this
    /// function.
    pub fn snapshot(&mut self, chain: &Chain, now: Instant) -> Snapshot {
        let new = chain.moments().get(self.told..).unwrap_or_default();
        self.told += new.len();
        let mut log = Vec::new();
        for moment in new {
            self.alarms.observe(moment);
            log.push(LogLine {
                time_s: seconds(moment.at),
                text: timeline::line(moment),
            });
        }
        let (mut profiles, mut passive) = (Vec::new(), Vec::new());
        let mut is_estimated = false;
        for relay in chain.live(now) {
            profiles.push((relay.report.relay, relay.profile));
            if relay.is_passive {
                passive.push(relay.report.relay);
            }
            if relay.is_on {
                is_estimated |= relay.estimates;
                self.known.insert(relay.report.relay, relay.report);
            }
        }
        let reports: Vec<Report> = self.known.values().copied().collect();
        let state = chain::Chain {
            mission: Some(chain.mission()),
            end: Side::Upstream,
            relays: 0,
            flying: self.flying,
            profiles: &profiles,
            is_estimated,
            axis: self.axis.as_ref(),
            geofence: self.geofence,
        };
        let mut snapshot = Snapshot {
            name: Some(format!("Simulated chain of {} relays", reports.len())),
            log,
            ..state.snapshot(now, &reports, &self.alarms, &[], &BTreeMap::new())
        };
        for relay in &mut snapshot.relays {
            if passive.contains(&relay.number) {
                relay.phase = Some("passive".to_owned());
                relay.condition = Some(Condition::Fault);
            }
        }
        snapshot
    }
}
