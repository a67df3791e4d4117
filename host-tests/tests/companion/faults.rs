//! Script of faults of eight flying relays, each with its alarm on the station's page.
//!
//! `COUNT=30 cargo test --test companion reported::the_page_shows_eight -- --nocapture` runs all of them and prints their times.

use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use crate::chain::Chain;
use crate::process::LIMIT;
use crate::reported::{Flown, Page, alarms, relays, restart};

/// Number of faults that the test in `cargo ci` injects; the variable COUNT replaces it.
const FEW: usize = 7;

/// Permitted time until an alarm beyond the time in which the chain itself notices the fault, s.
const SOON_S: f64 = 2.0;

/// Time that reports wait for an agreement after a loss, s: see `src/docs/flight.md`, Telemetry.
const WAIT_S: f64 = 2.0;

/// Fault: command, relay (0: the chain), time that the chain itself needs to notice it, s, and alarm. `#` in the alarm
/// is the relay's number.
type Fault = (&'static str, usize, f64, &'static str);

const RELEASED: &str = "warning relay # released";
const BLIND: &str = "critical relay #: the autopilot reports no position";
const UNLINKED: &str = "critical relay #: the link to the autopilot is lost";
const LOST: &str = "critical relay #";
const STUCK: &str = "warning relay # does not fly to its setpoint";

/// Groups of faults that happen at the same time.
///
/// An autopilot reports its mode every second. A companion waits 3 s for a silent autopilot, and 1 s for a position. A
/// station waits 5 s for a report, and 15 s for a drone that does not move. Relays notice a missing quorum 15 s after the
/// losses and an attempt to agree.
const SCRIPT: [&[Fault]; 14] = [
    &[
        ("pilot", 3, 1.0, RELEASED),
        ("gps", 6, 1.0, BLIND),
        ("mute", 8, 3.0, UNLINKED),
        ("unplug", 1, 3.0, UNLINKED),
    ],
    &[
        ("kill", 4, 5.0, LOST),
        // The mode arrives after 1 s, and the report waits for the agreement without relay 4.
        ("reboot", 7, 1.0 + WAIT_S, RELEASED),
        // As for relay 7.
        ("rtl", 2, 1.0 + WAIT_S, RELEASED),
    ],
    &[
        ("cut", 2, 5.0, LOST),
        // A position is missed after 1 s, and the report waits for the agreement without relay 2.
        ("gps", 5, 1.0 + WAIT_S, BLIND),
        // The mode arrives after 1 s; the report waits, too.
        ("pilot", 8, 1.0 + WAIT_S, RELEASED),
    ],
    &[
        // The setpoint is in every eighth report only. Alone, because a fault of another relay is a reason to wait.
        ("refuse", 5, 23.0, STUCK),
    ],
    &[
        ("pilot", 1, 1.0, RELEASED),
        ("mute", 8, 3.0, UNLINKED),
        ("pilot", 2, 1.0, RELEASED),
        ("pilot", 4, 1.0, RELEASED),
        ("pilot", 6, 1.0, RELEASED),
    ],
    &[
        ("pilot", 5, 1.0, RELEASED),
        ("pilot", 7, 1.0, RELEASED),
        ("hold", 1, 1.0, RELEASED),
    ],
    &[
        ("gps", 1, 1.0, BLIND),
        ("gps", 8, 1.0, BLIND),
        ("rtl", 3, 1.0, RELEASED),
    ],
    &[(
        "cut off",
        0,
        5.0,
        "critical nothing received from the chain",
    )],
    &[
        ("kill", 1, 5.0, LOST),
        // Its reports may have gone through relay 1: the station waits 10 s.
        ("kill", 8, 10.0, LOST),
    ],
    &[("stop", 5, 5.0, LOST)],
    &[("epoch", 6, 5.0, LOST)],
    &[("key", 3, 5.0, LOST)],
    &[("mission", 7, 5.0, LOST)],
    &[("no quorum", 0, 30.0, "critical no quorum")],
];

/// Test setup: the relays of a chain with their drones, and the web page of the ground station.
pub(crate) struct Stage {
    pub(crate) chain: Chain,
    pub(crate) flown: Vec<Flown>,
    pub(crate) page: Page,
}

impl Stage {
    pub(crate) const fn new(chain: Chain, flown: Vec<Flown>, page: Page) -> Self {
        Self { chain, flown, page }
    }

    /// Runs as many faults as COUNT says, or only those of the groups in the list ONLY, from 0.
    pub(crate) fn run(&mut self) {
        let count = std::env::var("COUNT").map_or(FEW, |it| it.parse().unwrap());
        let mut left = count;
        let mut failures = Vec::new();
        let only = std::env::var("ONLY").ok();
        for (at, group) in SCRIPT.iter().enumerate() {
            if only
                .as_ref()
                .is_some_and(|only| !only.split(',').any(|it| it == at.to_string()))
            {
                continue;
            }
            let group = &group[..group.len().min(left)];
            left -= group.len();
            if !group.is_empty() {
                self.group(group, &mut failures);
            }
        }
        assert!(failures.is_empty(), "{failures:#?}");
    }

    fn group(&mut self, group: &[Fault], failures: &mut Vec<String>) {
        self.page
            .until(LIMIT, "no alarms", |it| alarms(it).is_empty());
        let number = |it: &Value| it["number"].as_u64().unwrap();
        let all = |it: &Value| it["alarms"].as_array().unwrap().clone();
        let known = all(&self.page.last).iter().map(number).max().unwrap_or(0);
        for (what, relay, ..) in group {
            self.begin(what, *relay);
        }
        let text = |(_, relay, _, alarm): &Fault| alarm.replace('#', &relay.to_string());
        let (begun, mut times) = (Instant::now(), vec![None; group.len()]);
        let most_s = group
            .iter()
            .map(|it| it.2 + 3.0 * SOON_S)
            .fold(0.0, f64::max);
        while times.contains(&None) && begun.elapsed().as_secs_f64() < most_s {
            let (_, snapshot) = self.page.next();
            let (took, lasting) = (begun.elapsed().as_secs_f64(), alarms(&snapshot));
            for (fault, time) in group.iter().zip(&mut times) {
                if time.is_none() && lasting.iter().any(|it| is_of(it, &text(fault))) {
                    *time = Some(took);
                }
            }
        }
        for (fault, took) in group.iter().zip(&times) {
            let (what, relay, own_s, _) = fault;
            println!("{what} {relay}: chain {own_s:.1} s, alarm after {took:.1?} s");
            if took.is_none_or(|it| it > own_s + SOON_S) {
                failures.push(format!("{what} {relay}: {took:.1?} of {own_s} s"));
            }
        }
        // An alarm that comes and goes would do so now.
        let held = Instant::now();
        while held.elapsed() < Duration::from_secs(1) {
            self.page.next();
        }
        for (what, relay, ..) in group {
            self.end(what, *relay);
        }
        let ended = Instant::now();
        while !alarms(&self.page.last).is_empty() && ended.elapsed() < LIMIT {
            self.page.next();
        }
        println!("  all alarms ended after {:.1?}", ended.elapsed());
        let new: Vec<Value> = all(&self.page.last)
            .into_iter()
            .filter(|it| number(it) > known)
            .collect();
        for it in &new {
            println!(
                "  {}: {} to {} {}",
                it["text"], it["time_s"], it["cleared_s"], it["urgency"]
            );
            if it["cleared_s"].is_null() {
                failures.push(format!("{group:?}: does not end: {it}"));
            }
        }
        let hurt: Vec<u64> = group.iter().flat_map(|it| hurt(it.0, it.1)).collect();
        for it in &new {
            let text = it["text"].as_str().unwrap();
            if subject(text).is_some_and(|it| !hurt.contains(&it)) {
                failures.push(format!("{group:?}: a relay without a fault: {text}"));
            }
        }
        for fault in group {
            let of = |it: &&Value| {
                is_of(
                    &format!(
                        "{} {}",
                        it["urgency"].as_str().unwrap(),
                        it["text"].as_str().unwrap()
                    ),
                    &text(fault),
                )
            };
            let times = new.iter().filter(of).count();
            if times != 1 {
                failures.push(format!("{fault:?}: {times} alarms"));
            }
        }
    }

    fn begin(&mut self, what: &str, relay: usize) {
        let channel = &self.chain.media[0];
        let mut flown = relay.checked_sub(1).map(|at| &mut self.flown[at]);
        let mut order = |order| flown.as_mut().unwrap().drone.order(order);
        match what {
            "pilot" | "rtl" | "hold" => order(&format!("mode {what}")),
            "gps" => order("lose"),
            "mute" | "unplug" | "reboot" => order(what),
            "refuse" => {
                // The pilot flies it 12 m off its place, across the line.
                order("mode pilot");
                order("sticks -4.5 6.6");
                std::thread::sleep(Duration::from_millis(1_500));
                order("sticks 0 0");
                order("refuse");
                self.engage(relay);
            }
            "kill" => self.kill(relay),
            "stop" => self.flown[relay - 1].relay.signal(Signal::STOP),
            "cut" => channel.cut(1 << (relay - 1)),
            "cut off" => channel.cut(u16::MAX),
            "epoch" => {
                self.kill(relay);
                self.chain.files.write(&format!("epoch{relay}"), "5\n");
                self.restart(relay, "");
            }
            "key" => {
                self.kill(relay);
                let signed = self.chain.files.signed("other", "epoch");
                self.flown[relay - 1].relay = self.chain.relay(relay, &signed);
            }
            "mission" => {
                self.kill(relay);
                self.restart(relay, "--altitude 33");
            }
            "no quorum" => (4..=8).for_each(|relay| self.kill(relay)),
            _ => panic!("{what}"),
        }
    }

    fn end(&mut self, what: &str, relay: usize) {
        match what {
            "gps" => return self.order(relay, "find"),
            "mute" => self.order(relay, "speak"),
            "unplug" => self.order(relay, "plug"),
            "refuse" => return self.order(relay, "accept"),
            "reboot" => self.flown[relay - 1].drone.takes_off(),
            "kill" => self.restart(relay, ""),
            "stop" => self.flown[relay - 1].relay.signal(Signal::CONT),
            "cut" | "cut off" => return self.chain.media[0].cut(0),
            "epoch" => {
                self.kill(relay);
                // Without the file the epoch is the time.
                std::fs::remove_file(self.chain.files.path(&format!("epoch{relay}"))).unwrap();
                self.restart(relay, "");
            }
            "key" | "mission" => {
                self.kill(relay);
                self.restart(relay, "");
            }
            "no quorum" => {
                (4..=8).for_each(|relay| self.restart(relay, ""));
                return (4..=8).for_each(|relay| self.engage(relay));
            }
            _ => {}
        }
        self.engage(relay);
    }

    fn order(&mut self, relay: usize, order: &str) {
        self.flown[relay - 1].drone.order(order);
    }

    fn kill(&self, relay: usize) {
        self.flown[relay - 1].relay.signal(Signal::KILL);
    }

    fn restart(&mut self, relay: usize, more: &str) {
        self.flown[relay - 1].relay = restart(&self.chain, relay, more);
    }

    /// Lets the pilot engage the relay's control repeatedly, until the page shows it.
    fn engage(&mut self, relay: usize) {
        let begun = Instant::now();
        let mut turn = 0;
        loop {
            let order = ["mode pilot", "mode companion"][turn % 2];
            self.order(relay, order);
            let until = Instant::now() + Duration::from_millis([1_300, 3_000][turn % 2]);
            while Instant::now() < until {
                let (_, snapshot) = self.page.next();
                let shown = &relays(&snapshot)[relay - 1];
                let is_new = shown["age_s"].as_f64().is_some_and(|it| it < 2.0);
                if turn % 2 == 1 && is_new && shown["control"] == "engaged" {
                    return;
                }
            }
            turn += 1;
            if begun.elapsed() >= LIMIT {
                for (at, it) in self.flown.iter_mut().enumerate() {
                    println!(
                        "relay {}: {:#?} {:#?}",
                        at + 1,
                        it.relay.lines_with(""),
                        it.relay.errors()
                    );
                }
                panic!("relay {relay}: {:#}", self.page.last["relays"]);
            }
        }
    }
}

/// Returns the numbers of the relays that the fault `what` concerns.
fn hurt(what: &str, relay: usize) -> std::ops::RangeInclusive<u64> {
    match what {
        "no quorum" => 4..=8,
        _ => relay as u64..=relay as u64,
    }
}

/// Returns the relay that an alarm is about; `None` if it is about the whole chain.
fn subject(text: &str) -> Option<u64> {
    let rest = text.strip_prefix("relay ")?;
    let end = rest.find(|it: char| !it.is_ascii_digit());
    rest[..end.unwrap_or(rest.len())].parse().ok()
}

/// Returns true if an alarm begins with `start`, and no digit follows.
fn is_of(alarm: &str, start: &str) -> bool {
    let rest = alarm.strip_prefix(start);
    rest.is_some_and(|rest| !rest.starts_with(|it: char| it.is_ascii_digit()))
}
