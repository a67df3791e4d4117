//! Snapshot of a chain from the reports of its relays.

use std::collections::BTreeMap;

use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::axis::Axis;
use uav_relay::{
    Geofence, HoldReason, Instant, Interference, Mission, Phase, Placement, Profile, Report, Side,
};

use crate::alarms::{Alarms, Reason};
use crate::hops::{db, hop_sirs, hop_sirs_back};
use crate::snapshot::{
    ChainSize, Condition, Fence, Frame, Hop, InterfererSnapshot, Node, Position, RelaySnapshot,
    Snapshot,
};

/// Age of a report from which its relay counts as silent.
///
/// With 10 % of all frames lost, reports of eight relays on one channel are 4 s old about once in two minutes, and
/// 5 s old once in several hours of a relay: see the test `silences_of_five_seconds_are_rare`.
pub const SILENT_AFTER: uav_relay::Duration = uav_relay::Duration::from_millis(5_000);

/// Largest difference between the node numbers of two neighbours.
const REACH: u16 = 4;

/// Converts a time to seconds.
pub fn seconds(at: Instant) -> f64 {
    at.as_micros() as f64 / 1e6
}

/// Data of a chain that its relays do not report.
#[derive(Clone, Copy, Debug)]
pub struct Chain<'a> {
    /// Mission that the chain flies; `None` if it is unknown. Rx, the SIRs and the interferer are then unknown, too.
    pub mission: Option<&'a Mission>,
    /// End of the chain at which the station is.
    pub end: Side,
    /// Number of relays that are always listed: relays 1 to this number, even those without a report.
    pub relays: u16,
    /// Number of relays that are meant to fly, if the fleet has spares; `None` if unknown.
    pub flying: Option<u16>,
    /// Profiles (altitude and power) that differ from the mission's common profile, by relay number.
    pub profiles: &'a [(u16, Profile)],
    /// True if the interferer in `mission` is an estimate of the relays.
    pub is_estimated: bool,
    /// Line on earth from Tx to Rx.
    pub axis: Option<&'a Axis>,
    /// Geofence of the setpoints.
    pub geofence: Option<Geofence>,
}

impl Chain<'_> {
    /// Returns the state of the chain at the time `now`, from the newest report of each relay.
    ///
    /// A relay is shown as lost if its newest report is older than [`SILENT_AFTER`], and `alarms` has a report of
    /// another relay that it is lost. It is also lost while the alarm about its missing reports lasts, if it had
    /// neighbours and another relay's report, newer by [`SILENT_AFTER`], shows that the chain bypasses it.
    ///
    /// The relays `cleared`, which have no report, are left out. `changed` has for each relay the time of the first
    /// report with its present neighbours; by default it is the time of the relay's report.
    pub fn snapshot(
        &self,
        now: Instant,
        reports: &[Report],
        alarms: &Alarms,
        cleared: &[u16],
        changed: &BTreeMap<u16, Instant>,
    ) -> Snapshot {
        let is_skipped = |report: &Report| {
            let mut later = reports.iter().filter(|by| {
                let at = changed.get(&by.relay).unwrap_or(&by.at);
                *at >= report.at && by.at.since(report.at) >= SILENT_AFTER
            });
            let is_closed =
                later.any(|by| has_beyond(by, report.relay) || self.is_end(by, report.relay));
            is_closed && report.neighbours != [None; 2] && alarms.lasts(Reason::Lost, report.relay)
        };
        let is_lost = |report: &Report| {
            now.since(report.at) >= SILENT_AFTER
                && (alarms.is_lost(report.relay) || is_skipped(report))
        };
        let mut relays: Vec<RelaySnapshot> = (1..=self.relays)
            .filter(|it| !cleared.contains(it))
            .map(RelaySnapshot::new)
            .collect();
        for report in reports {
            let mut known = RelaySnapshot {
                age_s: Some(now.since(report.at).as_micros() as f64 / 1e6),
                lost_neighbours: alarms.lost_for(report.relay),
                ..reported(report)
            };
            if is_lost(report) {
                known.condition = Some(Condition::Lost);
            }
            match relays.iter_mut().find(|it| it.number == known.number) {
                Some(listed) => *listed = known,
                None => relays.push(known),
            }
        }
        let flying = reports.iter().filter(|it| !is_lost(it));
        let mut places: Vec<(u16, Placement)> = flying
            .filter_map(|report| Some((report.relay, report.position?)))
            .collect();
        places.sort_by(|(_, one), (_, other)| one.x_m.total_cmp(&other.x_m));
        let mut hops = self.hops(&places);
        // A relay of unknown position is somewhere on the way, unless it is lost.
        let unknown = relays.iter().filter(|it| {
            it.condition != Some(Condition::Lost) && !places.iter().any(|(of, _)| *of == it.number)
        });
        let unknown: Vec<u16> = unknown.map(|it| it.number).collect();
        hops.retain(|hop| !unknown.iter().any(|it| is_between(*it, hop)));
        Snapshot {
            time_s: Some(seconds(now)),
            frame: self.axis.map(frame),
            tx: Some(Position::default()),
            rx: self.mission.map(|mission| Position {
                x_m: f64::from(mission.config().distance_m),
                ..Position::default()
            }),
            relays,
            chain_size: self.size(reports, alarms),
            hops,
            interferers: self.interferer().into_iter().collect(),
            geofence: self.geofence.map(fence),
            alarms: alarms.all(),
            ..Snapshot::default()
        }
    }

    /// Returns the name of the chain: its number of relays, and that of the fleet if it has spares.
    pub(crate) fn name(&self) -> String {
        let relays = self.relays;
        self.flying.map_or_else(
            || format!("Chain of {relays} relays"),
            |flying| format!("Chain of {flying} relays, of a fleet of {relays}"),
        )
    }

    /// Returns the number of relays in the chain, with the number that is meant to fly, if that is known.
    ///
    /// A relay is in the chain if its report has a neighbour, and no alarm lasts that it is lost. A spare or a relay that
    /// has left has no neighbour.
    pub(crate) fn size(&self, reports: &[Report], alarms: &Alarms) -> Option<ChainSize> {
        let is_in =
            |it: &&Report| it.neighbours != [None; 2] && !alarms.lasts(Reason::Lost, it.relay);
        let present = reports.iter().filter(is_in).count();
        Some(ChainSize {
            present: u16::try_from(present).unwrap_or(u16::MAX),
            meant: self.flying?,
        })
    }

    /// Returns true if relay `by` reports no neighbour on its side toward the relay `number`.
    ///
    /// The relay `number` must be at most [`REACH`] numbers away, because `by` cannot receive a relay farther away.
    fn is_end(&self, by: &Report, number: u16) -> bool {
        let [before, after] = by.neighbours;
        let (toward, away) = if number < by.relay {
            (before, after)
        } else {
            (after, before)
        };
        // A relay without details has no neighbours in its report, nor has one outside of the chain.
        let has_others = away.is_some() || self.relays == 2 && by.agreed.is_some();
        let is_near = (1..=REACH).contains(&number.abs_diff(by.relay));
        toward.is_none() && has_others && is_near
    }

    fn profile(&self, mission: &Mission, relay: u16) -> Profile {
        let own = self.profiles.iter().find(|(of, _)| *of == relay);
        own.map_or(mission.config().common, |(_, profile)| *profile)
    }

    /// Returns the hops from Tx over the relays at these positions to Rx, with their SIRs by the mission.
    fn hops(&self, places: &[(u16, Placement)]) -> Vec<Hop> {
        let relays = places.iter().map(|(number, _)| Node::Relay(*number));
        let nodes: Vec<Node> = std::iter::once(Node::Tx)
            .chain(relays)
            .chain([Node::Rx])
            .collect();
        let (mut there, mut back) = (Vec::new(), Vec::new());
        let model = self.mission;
        let is_known = |it: &&Mission| !matches!(it.interference(), Interference::Unknown);
        if let Some(mission) = model.filter(is_known) {
            let flown = places.iter();
            let flown: Vec<_> = flown
                .map(|(number, place)| (*place, self.profile(mission, *number)))
                .collect();
            there = hop_sirs(mission, &flown);
            if mission.reverse() > 0.0 {
                back = hop_sirs_back(mission, &flown);
            }
        }
        let ends = nodes.iter().zip(nodes.iter().skip(1));
        ends.enumerate()
            .map(|(at, (from, to))| Hop {
                sir_db: there.get(at).copied().map(db),
                sir_back_db: back.get(at).copied().map(db),
                ..Hop::new(*from, *to)
            })
            .collect()
    }

    /// Returns the interferer that the mission has, known before flight or estimated by the relays.
    fn interferer(&self) -> Option<InterfererSnapshot> {
        let source = self.mission?.known_source()?;
        Some(InterfererSnapshot {
            position: Position {
                x_m: f64::from(source.x_m),
                y_m: f64::from(source.y_m),
                altitude_m: None,
            },
            power_w: Some(f64::from(source.power_w)),
            uncertainty_m: None,
            is_estimated: self.is_estimated,
        })
    }
}

/// Returns true if relay `by` reports a neighbour farther away than relay `number`, on the same side.
fn has_beyond(by: &Report, number: u16) -> bool {
    let [before, after] = by.neighbours;
    before.is_some_and(|it| (it + 1..by.relay).contains(&number))
        || after.is_some_and(|it| (by.relay + 1..it).contains(&number))
}

/// Returns true if relay `number` is between the two ends of a hop in the order of the relays' numbers.
fn is_between(number: u16, hop: &Hop) -> bool {
    let of = |node| match node {
        Node::Tx => 0,
        Node::Relay(number) => number,
        Node::Rx => u16::MAX,
    };
    let (from, to) = (of(hop.from), of(hop.to));
    (from.min(to)..from.max(to)).contains(&number) && number != from.min(to)
}

fn frame(axis: &Axis) -> Frame {
    let azimuth_deg = f64::from(axis.azimuth_rad(0.0)).to_degrees();
    let origin = axis.point(Placement::on_line(0.0, 0.0));
    Frame {
        origin_deg: origin.map(|at| [at.lat_e7, at.lon_e7].map(|part| f64::from(part) * 1e-7)),
        azimuth_deg: Some(azimuth_deg.rem_euclid(360.0)),
    }
}

fn fence(fence: Geofence) -> Fence {
    Fence {
        x_m: [fence.least_x_m, fence.most_x_m].map(f64::from),
        y_m: [fence.least_y_m, fence.most_y_m].map(f64::from),
        altitude_m: Some([fence.least_altitude_m, fence.most_altitude_m].map(f64::from)),
    }
}

impl From<Placement> for Position {
    fn from(place: Placement) -> Self {
        Self {
            x_m: f64::from(place.x_m),
            y_m: f64::from(place.y_m),
            altitude_m: Some(f64::from(place.altitude_m)),
        }
    }
}

/// Returns the state that a relay has reported, without its age.
fn reported(report: &Report) -> RelaySnapshot {
    RelaySnapshot {
        condition: Some(condition(report)),
        position: report.position.map(Position::from),
        setpoint: report.setpoint.map(Position::from),
        agreed: report.agreed.map(Position::from),
        phase: Some(phase(report).to_owned()),
        control: report.control.map(|state| control(state).to_owned()),
        hold_reason: hold_reason(report),
        ..RelaySnapshot::new(report.relay)
    }
}

fn is_flown(report: &Report) -> bool {
    report.control.is_none_or(State::is_flown)
}

fn condition(report: &Report) -> Condition {
    if matches!(report.phase, Phase::NoQuorum | Phase::Infeasible)
        || report.control == Some(State::Blind)
    {
        Condition::Fault
    } else if is_flown(report) && report.agreed.is_some() {
        Condition::Normal
    } else {
        Condition::Waiting
    }
}

/// Returns the phase of a relay's protocol in words.
pub(crate) const fn phase(report: &Report) -> &'static str {
    match report.phase {
        Phase::Idle => "idle",
        Phase::Planning => "planning",
        Phase::Waiting => "waiting for the chain",
        Phase::Answered => "no agreement yet",
        Phase::Holding => "agreed",
        Phase::Infeasible => "no feasible SIR",
        Phase::ViewChange => "membership change",
        Phase::NoQuorum => "no quorum",
    }
}

/// Returns the control state of a drone in words.
pub(crate) const fn control(state: State) -> &'static str {
    match state {
        State::Silent => "no autopilot",
        State::Grounded => "on the ground",
        State::Standby => "pilot",
        State::Engaged => "engaged",
        State::Blind => "no position",
    }
}

/// Returns the reason why a drone holds its position; `None` if it moves or no relay controls it.
pub(crate) fn hold_reason(report: &Report) -> Option<String> {
    let pairs = report.hold_reasons.into_iter().zip(report.neighbours);
    let mut reasons = pairs.filter(|_| is_flown(report));
    reasons.find_map(|(reason, beside)| {
        let whom = beside.map_or_else(|| "its neighbour".to_owned(), |it| format!("relay {it}"));
        Some(match reason? {
            HoldReason::Unheard => format!("{whom} is not engaged, or not received yet"),
            HoldReason::Order => format!("on the wrong side of {whom}, or too close to it"),
            HoldReason::Close => format!("the agreed position is too close to {whom}"),
            HoldReason::Lost => "the drone of a lost relay may still hover on the way".to_owned(),
            HoldReason::NotFlown => format!("{whom} is in the way, and not engaged"),
            HoldReason::Pending => format!("{whom} has not made room yet"),
            HoldReason::Halted => {
                format!("a relay beyond {whom} is on the wrong side of its neighbour")
            }
        })
    })
}
