//! Alarms and log lines of a station, by reports alone: a script of faults, each with its number, text, beginning and end.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::expect_used,
    clippy::panic,
    clippy::float_cmp,
    dead_code,
    missing_docs
)]

use std::collections::BTreeMap;

use uav_relay::flight::autopilot::state::State;
use uav_relay::{HoldReason, Instant, Mission, Phase, Placement, Report};
use uav_relay_screen::chain::Chain;
use uav_relay_screen::station::{Frames, StationView};
use uav_relay_screen::{Condition, Node, Snapshot, Urgency};

const RELAYS: u16 = 5;

mod paper {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../src/docs/paper.rs"
    ));
}

/// Returns the report of a relay of a healthy chain.
fn healthy(relay: u16) -> Report {
    let place = Placement::on_line(160.0 * f32::from(relay), 20.0);
    let above = Some(relay + 1).filter(|it| *it <= RELAYS);
    Report {
        relay,
        at: Instant::ZERO,
        position: Some(place),
        setpoint: Some(place),
        agreed: Some(place),
        phase: Phase::Holding,
        is_passive: false,
        control: Some(State::Engaged),
        hold_reasons: [None; 2],
        neighbours: [Some(relay - 1).filter(|it| *it > 0), above],
        silent: [false; 2],
        interference_w: None,
        version: 0,
    }
}

/// Chain whose relays report every second, and the station that watches it.
struct Watched {
    view: StationView,
    reports: BTreeMap<u16, Report>,
    mission: Mission,
    second: u64,
    frames: Frames,
    last: Snapshot,
    log: Vec<String>,
}

impl Watched {
    fn new() -> Self {
        Self {
            view: StationView::default(),
            reports: BTreeMap::new(),
            mission: paper::MISSION.with_relays(RELAYS).unwrap(),
            second: 0,
            frames: Frames::default(),
            last: Snapshot::default(),
            log: Vec::new(),
        }
    }

    /// Returns a chain of which all relays have reported.
    fn healthy() -> Self {
        let mut it = Self::new();
        it.show();
        it.run(3, |_| true);
        assert_eq!(it.lasting(), Vec::<String>::new());
        it
    }

    /// Lets `seconds` pass, in which the relays for which `reports` is true report.
    fn run(&mut self, seconds: u64, reports: impl Fn(u16) -> bool) {
        for _ in 0..seconds {
            self.second += 1;
            let now = Instant::from_millis(1_000 * self.second);
            for relay in (1..=RELAYS).filter(|it| reports(*it)) {
                let report = self.reports.entry(relay).or_insert_with(|| healthy(relay));
                report.at = now;
                self.frames.received += 1;
            }
            self.show();
        }
    }

    fn show(&mut self) {
        let chain = Chain {
            mission: Some(&self.mission),
            relays: RELAYS,
            profiles: &[],
            is_estimated: false,
            axis: None,
            geofence: None,
        };
        let now = Instant::from_millis(1_000 * self.second);
        let reported: Vec<Report> = self
            .reports
            .values()
            .copied()
            .filter(|it| it.at > Instant::ZERO)
            .collect();
        self.last = self.view.snapshot(now, &chain, &reported, self.frames);
        self.log
            .extend(self.last.log.iter().map(|it| it.text.clone()));
    }

    fn set(&mut self, relay: u16, change: impl FnOnce(&mut Report)) {
        change(self.reports.get_mut(&relay).unwrap());
    }

    /// Returns the lasting alarms, as `number urgency text`.
    fn lasting(&self) -> Vec<String> {
        let lasting = self.last.alarms.iter().filter(|it| it.cleared_s.is_none());
        let text = lasting.map(|it| format!("{} {:?} {}", it.number, it.urgency, it.text));
        text.collect()
    }

    fn condition(&self, relay: u16) -> Option<Condition> {
        self.last.relays[usize::from(relay) - 1].condition
    }
}

type Change = fn(&mut Report);

/// Faults of relays that their own reports contain: the relay, its change, the text of the alarm, and the change that ends it.
const OWN: &[(&[u16], Change, &str, Change)] = &[
    (
        &[2],
        |it| it.phase = Phase::NoQuorum,
        "Critical no quorum: relay 2 cannot reach enough relays, position held",
        |it| it.phase = Phase::Holding,
    ),
    (
        &[1, 2],
        |it| it.phase = Phase::NoQuorum,
        "Critical no quorum: relays 1 and 2 cannot reach enough relays, position held",
        |it| it.phase = Phase::ViewChange,
    ),
    (
        &[1],
        |it| it.phase = Phase::Infeasible,
        "Critical relay 1: no positions meet any target SIR, positions kept",
        |it| it.phase = Phase::Holding,
    ),
    (
        &[1, 2, 3, 4, 5],
        |it| it.phase = Phase::Infeasible,
        "Critical relays 1 to 5: no positions meet any target SIR, positions kept",
        |it| it.phase = Phase::Planning,
    ),
    (
        &[4],
        |it| it.control = Some(State::Blind),
        "Critical relay 4: the autopilot reports no position",
        |it| it.control = Some(State::Engaged),
    ),
    (
        &[4],
        |it| it.position = None,
        "Critical relay 4: the autopilot reports no position",
        |it| it.position = Some(Placement::on_line(640.0, 20.0)),
    ),
    (
        &[3],
        |it| it.control = Some(State::Standby),
        "Warning relay 3 released: the pilot took control",
        |it| it.control = Some(State::Engaged),
    ),
    (
        &[3],
        |it| it.control = Some(State::Grounded),
        "Warning relay 3 released: the pilot took control",
        |it| it.control = Some(State::Engaged),
    ),
    (
        &[5],
        |it| it.control = Some(State::Silent),
        "Critical relay 5: the link to the autopilot is lost",
        |it| it.control = Some(State::Engaged),
    ),
    (
        &[5],
        |it| it.agreed = None,
        "Warning last agreement expired, setpoint kept: relay 5",
        |it| it.agreed = it.setpoint,
    ),
    (
        &[2, 3],
        |it| it.agreed = None,
        "Warning last agreement expired, setpoint kept: relays 2 and 3",
        |it| it.agreed = it.setpoint,
    ),
];

/// Changes of a relay's report that are no fault.
const HARMLESS: &[Change] = &[
    |it| it.phase = Phase::ViewChange,
    |it| it.phase = Phase::Waiting,
    |it| it.hold_reasons = [None, Some(HoldReason::Pending)],
    |it| it.neighbours = [None; 2],
    |it| (it.agreed, it.setpoint) = (None, None),
    |it| it.interference_w = Some(1e-9),
    |it| it.control = None,
];

#[test]
fn every_fault_in_a_report_is_one_alarm_that_begins_and_ends() {
    let mut watched = Watched::healthy();
    let healthy: Vec<String> = Vec::new();
    let mut number = 1;
    for (relays, begin, text, end) in OWN {
        relays.iter().for_each(|relay| watched.set(*relay, *begin));
        watched.run(20, |_| true);
        number += 1;
        assert_eq!(watched.lasting(), [format!("{number} {text}")]);
        relays.iter().for_each(|relay| watched.set(*relay, *end));
        watched.run(1, |_| true);
        assert_eq!(watched.lasting(), healthy, "{text}");
        let ended = watched.last.alarms.last().unwrap();
        assert_eq!(ended.cleared_s, watched.last.time_s);
        assert_eq!(ended.time_s + 20.0, watched.last.time_s.unwrap(), "{text}");
        *watched.reports.get_mut(&relays[0]).unwrap() = self::healthy(relays[0]);
        watched.run(1, |_| true);
    }
    for change in HARMLESS {
        watched.set(3, *change);
        watched.run(20, |_| true);
        assert_eq!(watched.lasting(), healthy);
        watched.reports.insert(3, self::healthy(3));
        watched.run(2, |_| true);
        assert_eq!(watched.lasting(), healthy);
    }
    let last = watched.last.alarms.last().unwrap().number;
    assert_eq!(last, number, "no alarm came twice");
}

#[test]
fn before_the_first_reports_no_relay_is_lost() {
    let mut watched = Watched::new();
    watched.run(60, |_| false);
    assert_eq!(
        watched.lasting(),
        ["1 Notice no report yet from relays 1 to 5; nothing received from the chain yet"]
    );
    // Relay 1 is there first, and does not receive relay 2, which is switched on later.
    watched.reports.insert(
        1,
        Report {
            silent: [false, true],
            ..healthy(1)
        },
    );
    watched.run(60, |it| it == 1);
    assert_eq!(
        watched.lasting(),
        ["1 Notice no report yet from relays 2 to 5; relay 1 does not receive relay 2"]
    );
    watched.run(2, |it| it <= 2);
    assert_eq!(
        watched.lasting(),
        ["1 Notice no report yet from relays 3 to 5; relay 1 does not receive relay 2"]
    );
    watched.set(1, |it| it.silent = [false; 2]);
    watched.run(2, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    assert_eq!(watched.last.alarms.len(), 1);
}

#[test]
fn a_lost_relay_is_one_alarm_until_it_reports_again() {
    let mut watched = Watched::healthy();
    watched.set(2, |it| it.silent = [false, true]);
    watched.set(4, |it| it.silent = [true, false]);
    watched.run(1, |it| it != 3 && it != 4);
    assert_eq!(
        watched.lasting(),
        ["2 Critical relay 3 lost: reported by relay 2"]
    );
    watched.run(1, |it| it != 3);
    assert_eq!(
        watched.lasting(),
        ["2 Critical relay 3 lost: reported by relays 2 and 4"]
    );
    watched.run(4, |it| it != 3);
    let lost = "2 Critical relay 3 lost: reported by relays 2 and 4; no report for 5 s";
    assert_eq!(watched.lasting(), [lost]);
    assert_eq!(watched.condition(3), Some(Condition::Lost));
    let hops: Vec<Node> = watched.last.hops.iter().map(|it| it.to).collect();
    assert_eq!(
        hops,
        [1, 2, 4, 5]
            .map(Node::Relay)
            .into_iter()
            .chain([Node::Rx])
            .collect::<Vec<_>>()
    );
    // The chain closes the gap, and its relays have other neighbours.
    watched.set(2, |it| {
        (it.neighbours, it.silent) = ([Some(1), Some(4)], [false; 2])
    });
    watched.set(4, |it| {
        (it.neighbours, it.silent) = ([Some(2), Some(5)], [false; 2])
    });
    watched.run(60, |it| it != 3);
    assert_eq!(watched.lasting(), [lost]);
    watched.run(1, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    assert_eq!(watched.condition(3), Some(Condition::Normal));
    let expected = [
        "relay 2: does not receive relay 3",
        "relay 4: does not receive relay 3",
        "relay 2: neighbours: relays 1 and 4",
        "relay 4: neighbours: relays 2 and 5",
    ];
    assert_eq!(watched.log[5..], expected);
    // A neighbour that does not receive a relay which the station receives.
    watched.reports.insert(
        2,
        Report {
            silent: [true, false],
            ..healthy(2)
        },
    );
    watched.run(9, |_| true);
    assert_eq!(
        watched.lasting(),
        ["3 Critical relay 1 lost: reported by relay 2"]
    );
    assert_eq!(
        watched.condition(1),
        Some(Condition::Normal),
        "its reports arrive"
    );
    watched.set(2, |it| it.silent = [false; 2]);
    watched.run(1, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
}

#[test]
fn relays_behind_a_gap_do_not_report() {
    let mut watched = Watched::healthy();
    watched.set(2, |it| it.silent = [false, true]);
    watched.run(4, |it| it <= 2);
    assert_eq!(watched.lasting().len(), 1);
    watched.run(1, |it| it <= 2);
    let behind = |number, relay| {
        format!(
            "{number} Critical relay {relay}: no report for 5 s; relay 2 does not receive relay 3"
        )
    };
    let lost = "2 Critical relay 3 lost: reported by relay 2; no report for 5 s".to_owned();
    assert_eq!(watched.lasting(), [lost, behind(3, 4), behind(4, 5)]);
    assert_eq!(
        watched.condition(5),
        Some(Condition::Normal),
        "nobody has reported it as lost"
    );
    watched.set(2, |it| it.silent = [false; 2]);
    watched.run(1, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    // A relay whose neighbours receive it, but not the station.
    watched.run(20, |it| it != 4);
    assert_eq!(watched.lasting(), ["5 Critical relay 4: no report for 5 s"]);
}

#[test]
fn a_station_that_is_cut_off_is_one_alarm_and_not_one_for_each_relay() {
    let mut watched = Watched::healthy();
    watched.run(4, |_| false);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    watched.run(8, |_| false);
    let silent = "2 Critical nothing received from the chain for 12 s: 15 frames received before, 0 rejected";
    assert_eq!(watched.lasting(), [silent]);
    // The first frames are from relay 1; the other relays have 5 s.
    watched.run(5, |it| it == 1);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    watched.run(1, |it| it == 1);
    assert_eq!(watched.lasting().len(), 4);
    watched.run(1, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    assert_eq!(
        watched
            .last
            .alarms
            .iter()
            .filter(|it| it.urgency == Urgency::Critical)
            .count(),
        5
    );
    watched.frames.rejected = 7;
    watched.run(30, |_| true);
    let received = watched.frames.received;
    assert_eq!(
        watched.lasting(),
        [format!(
            "7 Notice frames rejected by this station: 7 of {} since its start",
            received + 7
        )]
    );
    watched.run(1, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
}

#[test]
fn versions_passive_relays_and_a_lost_autopilot_link() {
    let mut watched = Watched::healthy();
    // All but relay 4 adopt an upload; during the first seconds that is no fault.
    for relay in [1, 2, 3, 5] {
        watched.set(relay, |it| it.version = 2);
    }
    watched.run(5, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    watched.run(1, |_| true);
    assert_eq!(
        watched.lasting(),
        [
            "2 Warning relay 4 flies another version of the mission: version 0, other relays version 2"
        ]
    );
    assert_eq!(watched.view.version(), Some(2));
    watched.set(4, |it| it.version = 2);
    watched.run(1, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    // Two nodes of one number report in turn.
    for second in 0..20 {
        watched.set(3, |it| it.is_passive = second % 2 == 0);
        watched.run(1, |_| true);
        assert_eq!(
            watched.lasting(),
            ["3 Critical two nodes have the number 3: reported by relay 3"]
        );
    }
    watched.run(10, |_| true);
    assert_eq!(watched.lasting(), Vec::<String>::new());
    // The link is lost while the relay controls the drone, and comes back with the pilot in control.
    watched.set(1, |it| it.control = Some(State::Silent));
    watched.run(1, |_| true);
    assert_eq!(
        watched.lasting(),
        ["4 Critical relay 1: the link to the autopilot is lost"]
    );
    watched.set(1, |it| it.control = Some(State::Standby));
    watched.run(1, |_| true);
    assert_eq!(
        watched.lasting(),
        ["5 Warning relay 1 released: the pilot took control"]
    );
    // A relay that has stopped keeps its alarm.
    watched.run(10, |it| it != 1);
    assert_eq!(
        watched.lasting(),
        [
            "5 Warning relay 1 released: the pilot took control",
            "6 Critical relay 1: no report for 5 s"
        ]
    );
}

#[test]
fn the_snapshot_contains_what_is_known_and_nothing_else() {
    let mut watched = Watched::healthy();
    let sirs = |it: &Watched| {
        it.last
            .hops
            .iter()
            .filter(|hop| hop.sir_db.is_some())
            .count()
    };
    assert_eq!((watched.last.hops.len(), sirs(&watched)), (6, 6));
    assert!(
        watched
            .last
            .hops
            .iter()
            .all(|hop| hop.sir_back_db.is_none()),
        "not required"
    );
    assert_eq!(watched.last.interferers[0].power_w, Some(80.0));
    // A relay of unknown position has no hops, and hides none behind a longer one.
    watched.set(3, |it| it.position = None);
    watched.run(1, |_| true);
    let hops: Vec<(Node, Node)> = watched
        .last
        .hops
        .iter()
        .map(|it| (it.from, it.to))
        .collect();
    let relay = Node::Relay;
    assert_eq!(
        hops,
        [
            (Node::Tx, relay(1)),
            (relay(1), relay(2)),
            (relay(4), relay(5)),
            (relay(5), Node::Rx)
        ]
    );
    // Relays that have never reported are listed.
    let mut silent = Watched::new();
    silent.run(1, |it| it == 2);
    assert_eq!(silent.last.relays.len(), 5);
    assert_eq!(
        (silent.last.relays[0].age_s, silent.condition(1)),
        (None, None)
    );
    assert_eq!(
        (silent.last.relays[1].age_s, silent.last.hops.len()),
        (Some(0.0), 0)
    );
    // Numbers outside the mission and older reports are ignored.
    silent.reports.insert(
        9,
        Report {
            relay: 9,
            at: Instant::from_millis(900),
            ..healthy(1)
        },
    );
    silent.set(2, |it| {
        (it.at, it.phase) = (Instant::from_millis(500), Phase::NoQuorum)
    });
    silent.show();
    assert_eq!(silent.last.relays.len(), 5);
    assert_eq!(silent.last.relays[1].phase.as_deref(), Some("agreed"));
}
