//! A running chain as an operator sees it: snapshots for a [`Screen`](uav_relay_screen::Screen).
//!
//! The snapshots contain what the relays report. A relay that is switched off keeps its last reported state, which grows old; it is
//! lost once another relay reports it.

mod alarms;

use std::collections::BTreeMap;

use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::axis::Axis;
use uav_relay::{HoldReason, Instant, Interference, Mission, Phase, Placement};
use uav_relay_screen::{
    Condition, Fence, Frame, Hop, InterfererSnapshot, LogLine, Node, Position, RelaySnapshot,
    Snapshot,
};

use crate::report::{db, hop_sirs, hop_sirs_back, seconds, timeline};
use crate::simulator::chain::{Chain, LiveRelay};
use crate::simulator::drones::{Point, placement, point};
use crate::simulator::setup::Setup;
use alarms::Alarms;

/// View of a running chain, with the history that its snapshots need.
#[derive(Debug)]
pub struct LiveView {
    frame: Option<Frame>,
    geofence: Option<Fence>,
    alarms: Alarms,
    /// Number of log entries of the run that earlier snapshots contain.
    told: usize,
    /// Last report of each relay, and its time.
    known: BTreeMap<u16, (RelaySnapshot, Instant)>,
}

impl LiveView {
    /// Creates the view of a chain with this setup.
    pub fn new(setup: &Setup) -> Self {
        let geofence = setup.settings.guard.map(|guard| {
            let fence = guard.geofence;
            Fence {
                x_m: [fence.least_x_m, fence.most_x_m].map(f64::from),
                y_m: [fence.least_y_m, fence.most_y_m].map(f64::from),
                altitude_m: Some([fence.least_altitude_m, fence.most_altitude_m].map(f64::from)),
            }
        });
        Self {
            frame: setup.fleet.as_ref().map(|fleet| frame(&fleet.axis)),
            geofence,
            alarms: Alarms::default(),
            told: 0,
            known: BTreeMap::new(),
        }
    }

    /// Returns the state of `chain` at the virtual time `now`, and its log since the last call.
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
        let mut places = Vec::new();
        for relay in chain.live() {
            if relay.is_on {
                self.known.insert(relay.number, (reported(&relay), now));
            }
            let is_lost = self.alarms.is_lost(relay.number) && !relay.is_on;
            if let Some((known, at)) = self.known.get_mut(&relay.number) {
                known.age_s = Some(now.since(*at).as_micros() as f64 / 1e6);
                known.lost_neighbours = self.alarms.lost_for(relay.number);
                if is_lost {
                    known.condition = Some(Condition::Lost);
                }
                if let Some(at) = known.position.filter(|_| !is_lost) {
                    let at = [at.x_m, at.y_m, at.altitude_m.unwrap_or_default()];
                    places.push((relay, placement(at)));
                }
            }
        }
        let mission = chain.mission();
        let estimates = chain.live().any(|relay| relay.is_on && relay.estimates);
        let config = mission.config();
        Snapshot {
            time_s: Some(seconds(now)),
            name: Some(format!("Simulated chain of {} relays", self.known.len())),
            frame: self.frame,
            tx: Some(Position::default()),
            rx: Some(Position {
                x_m: f64::from(config.distance_m),
                ..Position::default()
            }),
            relays: self
                .known
                .values()
                .map(|(known, _)| known.clone())
                .collect(),
            hops: hops(mission, places),
            interferers: interferer(mission, estimates).into_iter().collect(),
            geofence: self.geofence,
            no_fly: Vec::new(),
            alarms: self.alarms.all(),
            log,
        }
    }
}

fn frame(axis: &Axis) -> Frame {
    let azimuth_deg = f64::from(axis.azimuth_rad(0.0)).to_degrees();
    let origin = axis.point(Placement::on_line(0.0, 0.0));
    Frame {
        origin_deg: origin.map(|at| [at.lat_e7, at.lon_e7].map(|part| f64::from(part) * 1e-7)),
        azimuth_deg: Some(azimuth_deg.rem_euclid(360.0)),
    }
}

fn position([x_m, y_m, altitude_m]: Point) -> Position {
    Position {
        x_m,
        y_m,
        altitude_m: Some(altitude_m),
    }
}

/// Returns the state that a relay reports now.
fn reported(relay: &LiveRelay) -> RelaySnapshot {
    let is_flown = relay.control.is_none_or(State::is_flown);
    let hold = relay
        .hold_reasons
        .into_iter()
        .zip(relay.neighbours)
        .find_map(|(reason, beside)| Some(hold_reason(reason?, beside)));
    RelaySnapshot {
        condition: Some(condition(relay, is_flown)),
        position: relay.position.map(position),
        setpoint: relay.setpoint.map(|place| position(point(place))),
        agreed: relay.agreed.map(|place| position(point(place))),
        phase: Some(
            if relay.is_passive {
                "passive"
            } else {
                phase(relay.phase)
            }
            .to_owned(),
        ),
        control: relay.control.map(|state| control(state).to_owned()),
        hold_reason: hold.filter(|_| is_flown),
        ..RelaySnapshot::new(relay.number)
    }
}

fn condition(relay: &LiveRelay, is_flown: bool) -> Condition {
    if relay.is_passive
        || matches!(relay.phase, Phase::NoQuorum | Phase::Infeasible)
        || relay.control == Some(State::Blind)
    {
        Condition::Fault
    } else if is_flown && relay.agreed.is_some() {
        Condition::Normal
    } else {
        Condition::Waiting
    }
}

const fn phase(phase: Phase) -> &'static str {
    match phase {
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

const fn control(state: State) -> &'static str {
    match state {
        State::Silent => "no autopilot",
        State::Grounded => "on the ground",
        State::Standby => "pilot",
        State::Engaged => "engaged",
        State::Blind => "no position",
    }
}

fn hold_reason(reason: HoldReason, beside: Option<u16>) -> String {
    let whom = beside.map_or_else(|| "its neighbour".to_owned(), |it| format!("relay {it}"));
    match reason {
        HoldReason::Unheard => format!("{whom} is not engaged, or not received yet"),
        HoldReason::Order => format!("on the wrong side of {whom}, or too close to it"),
        HoldReason::Close => format!("the agreed position is too close to {whom}"),
        HoldReason::Lost => "a lost relay may still hover on the way".to_owned(),
        HoldReason::NotFlown => format!("{whom} is in the way, and not engaged"),
        HoldReason::Pending => format!("{whom} has not made room yet"),
        HoldReason::Halted => {
            format!("a relay beyond {whom} is on the wrong side of its neighbour")
        }
    }
}

/// Returns the hops through the relays at these positions, with their SIRs by the mission's model.
fn hops(mission: &Mission, mut places: Vec<(LiveRelay, Placement)>) -> Vec<Hop> {
    places.sort_by(|(_, one), (_, other)| one.x_m.total_cmp(&other.x_m));
    let relays = places.iter().map(|(relay, _)| Node::Relay(relay.number));
    let nodes: Vec<Node> = std::iter::once(Node::Tx)
        .chain(relays)
        .chain([Node::Rx])
        .collect();
    let flown: Vec<_> = places
        .iter()
        .map(|(relay, place)| (*place, relay.profile))
        .collect();
    let is_known = !matches!(mission.config().interference, Interference::Unknown);
    let there = if is_known {
        hop_sirs(mission, &flown)
    } else {
        Vec::new()
    };
    let back = if is_known && mission.reverse() > 0.0 {
        hop_sirs_back(mission, &flown)
    } else {
        Vec::new()
    };
    let ends = nodes.iter().zip(nodes.iter().skip(1));
    ends.enumerate()
        .map(|(at, (from, to))| Hop {
            sir_db: there.get(at).copied().map(db),
            sir_back_db: back.get(at).copied().map(db),
            ..Hop::new(*from, *to)
        })
        .collect()
}

/// Returns the interferer that the chain knows or has estimated.
fn interferer(mission: &Mission, is_estimated: bool) -> Option<InterfererSnapshot> {
    let source = mission.known_source()?;
    Some(InterfererSnapshot {
        position: Position {
            x_m: f64::from(source.x_m),
            y_m: f64::from(source.y_m),
            altitude_m: None,
        },
        power_w: Some(f64::from(source.power_w)),
        uncertainty_m: None,
        is_estimated,
    })
}
