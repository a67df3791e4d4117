//! Alarms and log lines of a station, by reports alone. The script `faults.txt` has faults and the alarms that they raise.
#![cfg(test)]
#![allow(dead_code, unreachable_pub)]

use std::collections::{BTreeMap, BTreeSet};

use uav_relay::flight::autopilot::state::State;
use uav_relay::{Instant, Mission, Phase, Placement, Report, Side};
use uav_relay_screen::chain::Chain;
use uav_relay_screen::station::{Frames, StationView};
use uav_relay_screen::{Condition, Snapshot};

mod paper {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../src/docs/paper.rs"
    ));
}

const RELAYS: u16 = 5;

/// Returns the report of relay `relay` in a chain of `relays` relays without faults.
fn healthy(relay: u16, relays: u16) -> Report {
    let place = Some(Placement::on_line(160.0 * f32::from(relay), 20.0));
    let next = Some(relay + 1).filter(|it| *it <= relays);
    Report {
        relay,
        at: Instant::ZERO,
        position: place,
        setpoint: place,
        agreed: place,
        phase: Phase::Holding,
        holds_lease: true,
        control: Some(State::Engaged),
        hold_reasons: [None; 2],
        neighbours: [Some(relay - 1).filter(|it| *it > 0), next],
        silent: [false; 2],
        is_duplicated: false,
        refuses_setpoint: false,
        other_mission: None,
        other_key: None,
        old_epoch: None,
        interference_w: None,
        version: Some(0),
    }
}

/// Simulated chain whose relays report every second, and the station that receives the reports.
struct Watched {
    view: StationView,
    relays: BTreeMap<u16, Report>,
    off: BTreeSet<u16>,
    of: u16,
    flying: Option<u16>,
    mission: Mission,
    second: u64,
    frames: Frames,
    last: Snapshot,
    log: Vec<String>,
}

impl Watched {
    fn new() -> Self {
        Self::of(RELAYS)
    }

    fn of(of: u16) -> Self {
        Self {
            view: StationView::default(),
            relays: (1..=of).map(|it| (it, healthy(it, of))).collect(),
            off: BTreeSet::new(),
            of,
            flying: None,
            mission: paper::MISSION.with_relays(of).unwrap(),
            second: 0,
            frames: Frames::default(),
            last: Snapshot::default(),
            log: Vec::new(),
        }
    }

    /// Advances the time by one second. Every relay that is not switched off sends a report.
    fn second(&mut self) {
        self.second += 1;
        let now = Instant::from_millis(1_000 * self.second);
        for (_, report) in self
            .relays
            .iter_mut()
            .filter(|(it, _)| !self.off.contains(it))
        {
            report.at = now;
            self.frames.received += 1;
        }
        self.show();
    }

    fn show(&mut self) {
        let chain = Chain {
            mission: Some(&self.mission),
            end: Side::Upstream,
            relays: self.of,
            flying: self.flying,
            profiles: &[],
            is_estimated: false,
            axis: None,
            geofence: None,
        };
        let now = Instant::from_millis(1_000 * self.second);
        let reports = self.relays.values().filter(|it| it.at > Instant::ZERO);
        self.last = self.view.snapshot(now, &chain, reports, self.frames);
        self.log
            .extend(self.last.log.iter().map(|it| it.text.clone()));
    }

    fn change(&mut self, relay: u16, state: &str) {
        self.off.remove(&relay);
        let report = self.relays.get_mut(&relay).unwrap();
        match state {
            "off" => _ = self.off.insert(relay),
            "ok" => {
                let Report { version, at, .. } = *report;
                (*report, report.version, report.at) =
                    (healthy(relay, self.of), version.or(Some(0)), at);
            }
            "noquorum" => report.phase = Phase::NoQuorum,
            "infeasible" => report.phase = Phase::Infeasible,
            "viewchange" => report.phase = Phase::ViewChange,
            "blind" => report.control = Some(State::Blind),
            "standby" => report.control = Some(State::Standby),
            "grounded" => report.control = Some(State::Grounded),
            "nolink" => report.control = Some(State::Silent),
            "bench" => (report.control, report.position) = (None, None),
            "away" => report.setpoint = Some(Placement::on_line(20.0, 20.0)),
            "leaves" => {
                report.position = Some(Placement::on_line(20.0, 20.0));
                report.version = None;
            }
            "detailed" => report.version = Some(0),
            "unlocated" => report.position = None,
            "expired" => report.holds_lease = false,
            "restarted" => (report.agreed, report.setpoint) = (None, None),
            "rebooted" => {
                (report.control, report.holds_lease) = (Some(State::Standby), false);
                report.version = None;
            }
            "brief" => {
                (report.agreed, report.setpoint, report.neighbours) = (None, None, [None; 2]);
                report.version = None;
            }
            "version2" => report.version = Some(2),
            "nonext" => report.neighbours[1] = None,
            "noback" => report.neighbours[0] = None,
            "skipsnext" => (report.neighbours[1], report.silent[1]) = (Some(relay + 2), false),
            "skipsback" => (report.neighbours[0], report.silent[0]) = (Some(relay - 2), false),
            "deafnext" | "nonextyet" => report.silent[1] = true,
            "duplicated" => report.is_duplicated = true,
            "refuses" => report.refuses_setpoint = true,
            "key2" => report.other_key = Some(2),
            "epoch2" => report.old_epoch = Some(2),
            "mission2" => report.other_mission = Some(2),
            "mission4" => report.other_mission = Some(4),
            "deafback" => report.silent[0] = true,
            other => panic!("{other}"),
        }
    }

    /// Makes the changes in one line of the script.
    ///
    /// For example, `12:ok 3:off` makes relays 1 and 2 healthy and switches relay 3 off.
    fn changes(&mut self, changes: &str) {
        for change in changes.split_whitespace() {
            if let Some((relays, state)) = change.split_once(':') {
                relays
                    .chars()
                    .for_each(|it| self.change(it.to_string().parse().unwrap(), state));
            } else if change == "rejected" {
                self.frames.rejected = 7;
            }
        }
    }

    /// Returns the lasting alarms in the form of the script.
    fn lasting(&self) -> String {
        let lasting = self.last.alarms.iter().filter(|it| it.cleared_s.is_none());
        let mut lasting: Vec<String> = lasting
            .map(|it| format!("{} {:?} {}", it.number, it.urgency, it.text))
            .collect();
        if lasting.is_empty() {
            lasting.push(".".to_owned());
        }
        lasting.join(" & ")
    }

    fn condition(&self, relay: u16) -> Option<Condition> {
        self.last.relays[usize::from(relay) - 1].condition
    }

    /// Returns the hops of the last snapshot whose SIR is known.
    fn hops(&self) -> String {
        let hops = self.last.hops.iter().filter(|it| it.sir_db.is_some());
        let hops = hops.map(|it| format!("{}-{} ", it.from, it.to));
        hops.collect::<Vec<_>>().concat()
    }
}

#[test]
fn every_fault_is_one_alarm_with_its_text_that_begins_and_ends() {
    let (mut watched, mut faults) = (Watched::new(), 0);
    let script = include_str!("faults.txt")
        .lines()
        .filter(|line| !line.starts_with('#'));
    for line in script {
        if line.starts_with("flight") {
            watched = Watched::new();
            continue;
        }
        let (order, expected) = line.split_once(" = ").unwrap();
        let (seconds, changes) = order.split_once(' ').unwrap();
        watched.changes(changes);
        watched.show();
        (0..seconds.parse().unwrap()).for_each(|_| watched.second());
        assert_eq!(watched.lasting(), expected, "{line}");
        // An alarm that is not in the list has ended in the second of its end, and none came twice.
        let all = &watched.last.alarms;
        assert!(
            (1..).zip(all).all(|(number, it)| it.number == number),
            "{line}"
        );
        faults += usize::from(!changes.trim().ends_with(":ok") && expected != ".");
    }
    assert!(faults >= 30, "{faults}");
}

#[test]
fn the_snapshot_and_the_log_contain_what_is_known_and_nothing_else() {
    let mut watched = Watched::new();
    watched.second();
    assert_eq!(watched.hops(), "Tx-1 1-2 2-3 3-4 4-5 5-Rx ");
    assert_eq!(watched.last.interferers[0].power_w, Some(80.0));
    // A relay of unknown position has no hops, and hides none behind a longer one.
    watched.changes("3:unlocated");
    watched.second();
    assert_eq!(watched.hops(), "Tx-1 1-2 4-5 5-Rx ");
    // A lost relay leaves the chain; a silent one that no neighbour reports as lost does not.
    watched.changes("3:ok");
    watched.second();
    watched.changes("3:off 2:deafnext 5:off");
    (0..5).for_each(|_| watched.second());
    assert_eq!(
        [3, 5].map(|it| watched.condition(it)),
        [Some(Condition::Lost), Some(Condition::Normal)]
    );
    assert_eq!(watched.hops(), "Tx-1 1-2 2-4 4-5 5-Rx ");
    watched.changes("2:skipsnext 2:blind 4:version2");
    watched.second();
    let first = (1..=5).map(|it| format!("relay {it}: first report: agreed, engaged"));
    let later = [
        "relay 2: does not receive relay 3",
        "relay 2: control: no position",
        "relay 2: neighbours: relays 1 and 4",
        "relay 4: flies version 2 of the mission",
    ];
    assert_eq!(
        watched.log,
        first.chain(later.map(str::to_owned)).collect::<Vec<_>>()
    );

    // Relays that have never reported are listed. Numbers outside the mission and older reports are ignored.
    let mut silent = Watched::new();
    silent.changes("1345:off");
    silent.second();
    assert_eq!((silent.last.relays.len(), silent.hops().as_str()), (5, ""));
    assert_eq!(
        [1, 2].map(|it| silent.last.relays[it - 1].age_s),
        [None, Some(0.0)]
    );
    silent.relays.insert(
        9,
        Report {
            relay: 9,
            at: Instant::from_millis(900),
            ..healthy(1, RELAYS)
        },
    );
    silent.changes("2:noquorum");
    silent.relays.get_mut(&2).unwrap().at = Instant::from_millis(500);
    silent.show();
    assert_eq!(silent.last.relays.len(), 5);
    assert_eq!(silent.last.relays[1].phase.as_deref(), Some("agreed"));
}

#[test]
fn a_silent_relay_that_its_neighbours_have_closed_up_over_is_lost() {
    // The station may have missed the reports of the 2 s in which a neighbour counted the relay as silent.
    let mut watched = Watched::new();
    watched.second();
    watched.changes("3:off");
    (0..2).for_each(|_| watched.second());
    watched.changes("2:skipsnext");
    watched.second();
    assert_eq!(watched.condition(3), Some(Condition::Normal));
    (0..5).for_each(|_| watched.second());
    assert_eq!(watched.condition(3), Some(Condition::Lost));
    assert_eq!(watched.hops(), "Tx-1 1-2 2-4 4-5 5-Rx ");
    // A relay that reports is not lost, even while another one reports the neighbours beyond it.
    watched.changes("3:ok");
    (0..10).for_each(|_| watched.second());
    assert_eq!(watched.condition(3), Some(Condition::Normal));
    // Nor is a silent one without reports of others about newer neighbours.
    watched.changes("12345:off");
    (0..20).for_each(|_| watched.second());
    assert_eq!(watched.condition(3), Some(Condition::Normal));
}

#[test]
fn a_lost_relay_that_is_cleared_is_gone_until_it_reports_again() {
    let mut watched = Watched::new();
    watched.second();
    let clear = |watched: &mut Watched, relay| {
        let now = Instant::from_millis(1_000 * watched.second);
        watched.view.clear(now, relay, &[])
    };
    for relay in [0, 3, 9] {
        assert!(clear(&mut watched, relay).is_err(), "{relay} is not lost");
    }
    watched.changes("3:noquorum 3:off 2:deafnext");
    watched.relays.get_mut(&3).unwrap().at = Instant::from_millis(1_500);
    (0..4).for_each(|_| watched.second());
    // A neighbour does not receive it, but its last report is recent.
    assert!(watched.lasting().contains("relay 3 lost"));
    assert!(clear(&mut watched, 3).is_err());
    (0..4).for_each(|_| watched.second());
    // A report that has arrived since the last snapshot counts, too.
    let now = Instant::from_millis(1_000 * watched.second);
    let at = Instant::from_millis(1_000 * watched.second - 300);
    for (relay, is_refused) in [(3, true), (4, false)] {
        let report = Report {
            at,
            ..healthy(relay, RELAYS)
        };
        let reply = watched.view.clear(now, 3, &[report]);
        assert_eq!(reply.is_err(), is_refused);
    }
    let late = watched.relays.get(&3).copied().unwrap();
    for _ in 0..20 {
        watched.second();
        assert_eq!(watched.lasting(), ".");
        let listed: Vec<u16> = watched.last.relays.iter().map(|it| it.number).collect();
        assert_eq!(listed, [1, 2, 4, 5]);
        assert_eq!(watched.hops(), "Tx-1 1-2 2-4 4-5 5-Rx ");
    }
    assert!(clear(&mut watched, 3).is_err(), "cleared twice");
    // An older state that took long on its way does not bring it back.
    watched.relays.get_mut(&3).unwrap().at = late.at + uav_relay::Duration::from_millis(500);
    watched.second();
    assert_eq!(watched.last.relays.len(), 4);
    watched.changes("3:ok 2:ok");
    watched.second();
    assert_eq!(watched.lasting(), ".");
    assert_eq!(watched.condition(3), Some(Condition::Normal));
    // It can be lost again.
    watched.changes("3:off");
    (0..11).for_each(|_| watched.second());
    assert!(watched.lasting().contains("Critical relay 3"));
    let acts = watched.log.iter().filter(|it| it.contains("cleared"));
    assert_eq!(
        acts.collect::<Vec<_>>(),
        [
            "operator: lost relay 3 cleared",
            "relay 3: reports again after it was cleared"
        ]
    );
}

#[test]
fn a_silent_relay_next_to_tx_or_rx_is_lost_once_its_neighbour_is_the_last_one() {
    for (lost, change, hops) in [
        (1, "2:noback", "Tx-2 2-3 3-4 4-5 5-Rx "),
        (5, "4:nonext", "Tx-1 1-2 2-3 3-4 4-Rx "),
    ] {
        let mut watched = Watched::new();
        watched.second();
        // A relay that is not silent is not lost, whatever its neighbour reports.
        watched.changes(change);
        (0..8).for_each(|_| watched.second());
        assert_eq!(watched.condition(lost), Some(Condition::Normal));
        watched.changes("24:ok");
        watched.changes(&format!("{lost}:off"));
        (0..7).for_each(|_| watched.second());
        // A report without details has no neighbours, too.
        watched.changes("24:brief");
        (0..7).for_each(|_| watched.second());
        assert_eq!(watched.condition(lost), Some(Condition::Normal));
        watched.changes("24:ok");
        watched.changes(change);
        watched.second();
        assert_eq!(watched.condition(lost), Some(Condition::Lost));
        assert_eq!(watched.hops(), hops);
        watched.changes(&format!("{lost}:ok"));
        watched.second();
        assert_eq!(watched.condition(lost), Some(Condition::Normal));
    }
}

/// Checks that frames of a relay prevent the alarm about its missing reports for 15 s.
///
/// They do not prevent the alarm that a neighbour reports.
#[test]
fn a_relay_whose_frames_are_received_is_not_lost_before_15_s() {
    let mut watched = Watched::new();
    let second = |watched: &mut Watched| {
        let now = Instant::from_millis(1_000 * watched.second + 500);
        watched.view.overhear(now, [3]);
        watched.second();
        watched.lasting()
    };
    watched.second();
    watched.changes("3:off");
    for after in 1..=14 {
        assert_eq!(second(&mut watched), ".", "after {after} s");
    }
    assert_eq!(
        second(&mut watched),
        "1 Critical relay 3: no report for 5 s"
    );
    watched.changes("3:ok");
    assert_eq!(second(&mut watched), ".");
    watched.changes("3:off");
    (0..10).for_each(|_| assert_eq!(second(&mut watched), "."));
    // Without further frames the alarm begins after 5 s.
    for _ in 0..4 {
        watched.second();
        assert_eq!(watched.lasting(), ".");
    }
    watched.second();
    assert!(watched.lasting().contains("relay 3: no report"));
    watched.changes("3:ok");
    assert_eq!(second(&mut watched), ".");
    watched.changes("3:off 2:deafnext");
    assert!(second(&mut watched).contains("relay 3 lost: reported by relay 2"));
}

/// Checks that the text of an ended alarm names all relays that have reported it.
#[test]
fn an_ended_alarm_names_all_its_relays() {
    let mut watched = Watched::new();
    watched.second();
    watched.changes("12:noquorum");
    watched.second();
    watched.changes("1:ok 4:noquorum");
    watched.second();
    let lasting = "1 Critical no quorum: relays 2 and 4 cannot reach enough relays, position held";
    assert_eq!(watched.lasting(), lasting);
    watched.changes("24:ok");
    watched.second();
    assert_eq!(watched.lasting(), ".");
    let text = "no quorum: relays 1, 2 and 4 cannot reach enough relays, position held";
    assert_eq!(watched.last.alarms[0].text, text);
}

/// Checks that a neighbour's outdated report does not mark a relay as lost.
///
/// A report is outdated if the neighbour sent it before the lost relay's last report.
#[test]
fn neighbours_from_before_the_loss_do_not_make_a_relay_lost() {
    let mut watched = Watched::new();
    watched.changes("4:nonext 5:off");
    watched.second();
    watched.changes("5:ok");
    watched.second();
    watched.changes("5:off");
    (0..20).for_each(|_| watched.second());
    assert!(watched.lasting().contains("relay 5"));
    assert_eq!(watched.condition(5), Some(Condition::Normal));
    // Newer ones do.
    watched.changes("4:ok");
    watched.second();
    watched.changes("4:nonext");
    watched.second();
    assert_eq!(watched.condition(5), Some(Condition::Lost));
}

#[test]
fn the_last_relay_before_tx_or_rx_is_taken_at_its_word_for_four_numbers() {
    let mut watched = Watched::of(8);
    watched.second();
    watched.changes("45678:off");
    (0..2).for_each(|_| watched.second());
    watched.changes("3:nonext");
    (0..30).for_each(|_| watched.second());
    let lost: Vec<_> = (1..=8)
        .filter(|it| watched.condition(*it) == Some(Condition::Lost))
        .collect();
    assert_eq!(lost, [4, 5, 6, 7]);
}

/// Checks that either relay of a chain of two is shown as lost.
///
/// The remaining relay then reports no neighbour relay, upstream or downstream.
#[test]
fn one_of_two_relays_is_lost_once_the_other_one_is_alone() {
    for (lost, change, hops) in [(1, "2:noback", "Tx-2 2-Rx "), (2, "1:nonext", "Tx-1 1-Rx ")] {
        let mut watched = Watched::of(2);
        watched.second();
        watched.changes(&format!("{lost}:off"));
        (0..12).for_each(|_| watched.second());
        // A report without details has neither neighbours nor an agreement.
        let other = 3 - lost;
        watched.changes(&format!("{other}:brief"));
        watched.second();
        assert_eq!(watched.condition(lost), Some(Condition::Normal));
        watched.changes(&format!("{other}:ok {change}"));
        watched.second();
        assert_eq!(watched.condition(lost), Some(Condition::Lost));
        assert_eq!(watched.hops(), hops);
    }
}

/// Checks that the alarm about another mission begins again after relay 2 was back.
///
/// It begins in two cases: relay 2 stops reporting, or its neighbours refuse its mission for longer than they remember
/// a refusal.
#[test]
fn the_alarm_of_another_mission_begins_again() {
    let alarm = "Warning relay 2 has another mission: reported by relays 1 and 3";
    let mut watched = Watched::new();
    watched.second();
    watched.changes("2:off 13:mission2");
    (0..2).for_each(|_| watched.second());
    assert!(watched.lasting().contains(alarm), "{}", watched.lasting());
    watched.changes("2:ok");
    (0..50).for_each(|_| watched.second());
    assert_eq!(watched.lasting(), ".");
    watched.changes("2:off");
    (0..12).for_each(|_| watched.second());
    assert!(watched.lasting().contains(alarm), "{}", watched.lasting());
    watched.changes("2:ok");
    (0..149).for_each(|_| watched.second());
    assert_eq!(watched.lasting(), ".");
    (0..3).for_each(|_| watched.second());
    assert!(watched.lasting().contains(alarm), "{}", watched.lasting());
    watched.changes("13:ok");
    watched.second();
    assert_eq!(watched.lasting(), ".");
}

/// Checks the numbers of relays in a fleet with two spares, and the alarm about too few.
#[test]
fn too_few_relays_in_the_chain_are_an_alarm() {
    let mut watched = Watched {
        flying: Some(3),
        ..Watched::new()
    };
    let said = |watched: &Watched| {
        let all = watched.lasting();
        all.contains("too few relays").then_some(all)
    };
    let size = |watched: &Watched| {
        let size = watched.last.chain_size.unwrap();
        (size.present, size.meant)
    };
    // Spares have no neighbours.
    for spare in [2, 4] {
        watched.relays.get_mut(&spare).unwrap().neighbours = [None; 2];
    }
    let run = |watched: &mut Watched, seconds: u64| (0..seconds).for_each(|_| watched.second());
    run(&mut watched, 40);
    assert_eq!((size(&watched), said(&watched)), ((3, 3), None));
    let name = watched.last.name.clone();
    assert_eq!(name.as_deref(), Some("Chain of 3 relays, of a fleet of 5"));
    // A relay leaves, and no spare joins.
    watched.relays.get_mut(&5).unwrap().neighbours = [None; 2];
    run(&mut watched, 30);
    assert_eq!((size(&watched), said(&watched)), ((2, 3), None));
    run(&mut watched, 1);
    let alarm = "1 Warning too few relays in the chain: 2, of 3 that are meant to fly";
    assert_eq!(said(&watched).as_deref(), Some(alarm));
    watched.relays.get_mut(&4).unwrap().neighbours = [Some(3), None];
    run(&mut watched, 2);
    assert_eq!((size(&watched), said(&watched)), ((3, 3), None));
    // A silent relay does not count, and the alarm waits while relays join.
    watched.changes("1:off 3:off");
    run(&mut watched, 25);
    assert_eq!((size(&watched), said(&watched)), ((1, 3), None));
    watched.changes("3:ok");
    run(&mut watched, 25);
    assert_eq!((size(&watched), said(&watched)), ((2, 3), None));
    run(&mut watched, 10);
    assert!(said(&watched).is_some());
}
