//! Script of faults of eight flying relays, each with its alarm on the station's page.
//!
//! An alarm about a relay without a fault is a failure, with two exceptions. Relays that lack others for longer than a lease lose it,
//! and may lack a quorum: such an alarm must be true in the relay's own state, as its status socket and its log tell it.
//!
//! `COUNT=30 cargo test --test companion reported::the_page_shows_eight -- --nocapture` runs all of them and prints their times.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use crate::chain::Chain;
use crate::files::status_within;
use crate::process::LIMIT;
use crate::reported::{Flown, Page, alarms, relays, restart};

/// Number of faults that the test in `cargo ci` injects; the variable COUNT replaces it.
const FEW: usize = 7;

/// Longest permitted time from the detection of a fault by the relays to the alarm on the page, s.
const SOON_S: f64 = 2.0;

/// Shortest silence of a relay after which the station misses its reports, s.
const SILENT_S: f64 = 5.0;

/// Time after which the station notices that a relay's reports are missing, s.
///
/// The reports may have gone through another relay that is lost, too.
const LOST_S: f64 = 10.0;

/// Time in which a companion or the page must notice a fault.
const MOST: Duration = Duration::from_secs(90);

/// Time without a lease after which the page shows an alarm, s.
const EXPIRED_S: f64 = 5.0;

/// Longest time between a relay's state and the relay's report of it, s.
///
/// It is also the longest time between two queries of that state.
const NEAR_S: f64 = 2.0;

/// Longest wait for a snapshot of the page before the state of the next relay is queried.
const STEP: Duration = Duration::from_millis(20);

const LEASE: &str = ": last agreement on positions expired";

const NO_QUORUM: &str = "no quorum: ";

/// Fault: the command that causes it, the relay, the alarm, and a log line of a noticing companion.
///
/// Relay 0 is the whole chain, and `#` stands for the relay's number. A log line that begins with `relay` may come from
/// any companion, and so may a log line about relay 0; other lines come from the relay's own companion.
type Fault = (&'static str, usize, &'static str, &'static str);

const LOST: &str = "critical relay #";

/// Groups of faults that happen at the same time: the command and the relay of each fault.
///
/// The fault "refuse" is alone, because a fault of another relay is a reason to wait.
const SCRIPT: [&str; 14] = [
    "pilot 3, gps 6, mute 8, unplug 1",
    "kill 4, reboot 7, rtl 2",
    "cut 2, gps 5, pilot 8",
    "refuse 5",
    "pilot 1, mute 8, pilot 2, pilot 4, pilot 6",
    "pilot 5, pilot 7, hold 1",
    "gps 1, gps 8, rtl 3",
    "cut off 0",
    "kill 1, kill 8",
    "stop 5",
    "epoch 6",
    "key 3",
    "mission 7",
    "no quorum 0",
];

/// Returns the fault of an entry in [`SCRIPT`], with its alarm on the page and its log line.
fn fault(entry: &'static str) -> Fault {
    const RELEASED: &str = "warning relay # released";
    let (what, relay) = entry.rsplit_once(' ').unwrap();
    let (alarm, line) = match what {
        "pilot" | "rtl" | "hold" => (RELEASED, "released: "),
        "reboot" => (RELEASED, "rebooted"),
        "gps" => (
            "critical relay #: the autopilot reports no position",
            "no recent position",
        ),
        "mute" | "unplug" => (
            "critical relay #: the link to the autopilot is lost",
            "no heartbeat",
        ),
        "kill" | "cut" | "stop" => (LOST, "relay # toward"),
        "refuse" => (
            "warning relay # does not fly to its setpoint",
            "flies to a target other than the setpoint",
        ),
        "cut off" => ("critical nothing received from the chain", "does not reply"),
        "epoch" => (
            "critical relay # started with an old epoch",
            "relay # has started with an epoch",
        ),
        "key" => (
            "critical relay # signs with another key",
            "relay # signs with another key",
        ),
        "mission" => (
            "warning relay # has another mission",
            "relay # has another mission",
        ),
        "no quorum" => ("critical no quorum", "no quorum: "),
        _ => panic!("{entry}"),
    };
    (what, relay.parse().unwrap(), alarm, line)
}

/// Prints the times, s, from each fault until a companion notices it and until its alarm.
///
/// Returns a text for each late alarm.
fn late(group: &[Fault], times: &[[Option<f64>; 2]]) -> Vec<String> {
    let mut failures = Vec::new();
    for ((what, relay, alarm, _), [own, shown]) in group.iter().zip(times) {
        let own_s = own.map_or("not before the alarm".to_owned(), |it| format!("{it:.1} s"));
        println!("{what} {relay}: noticed by a companion: {own_s}; alarm: {shown:.1?} s");
        // The neighbours give a lost relay up later than the station misses its reports.
        let [least_s, most_s] = if *alarm == LOST {
            [SILENT_S, LOST_S]
        } else {
            [0.0, MOST.as_secs_f64()]
        };
        let noticed_s = own.unwrap_or(most_s).clamp(least_s, most_s);
        let limit_s = noticed_s + SOON_S;
        if shown.is_none_or(|shown| shown > limit_s) {
            let shown = shown.map_or("no alarm".to_owned(), |it| format!("alarm after {it:.1} s"));
            failures.push(format!(
                "{what} {relay}: {shown}, permitted until {limit_s:.1} s; noticed by a companion: {own_s}"
            ));
        }
    }
    failures
}

/// Formats a group of faults that happen at the same time: "pilot 3, gps 6".
fn name(group: &[Fault]) -> String {
    let all = group
        .iter()
        .map(|(what, relay, ..)| format!("{what} {relay}"));
    all.collect::<Vec<_>>().join(", ")
}

/// State of a relay by its own status and log, since the begin of the present group of faults.
#[derive(Clone, Debug, Default)]
struct Own {
    /// Queries of the relay's status: time, s, and true if the relay had a setpoint but no lease.
    leaseless: Vec<(f64, bool)>,
    /// True if the relay has logged that it has no quorum.
    lacks_quorum: bool,
}

impl Own {
    /// Returns true if the relay had no lease for most of the 5 s before its report of the time `at_s`.
    fn has_expired(&self, at_s: f64) -> bool {
        let before = |span_s: f64| {
            let all = self.leaseless.iter();
            all.filter(move |(then_s, _)| (at_s - span_s..at_s + NEAR_S).contains(then_s))
        };
        let of = |span_s| before(span_s).filter(|(_, is)| *is).count();
        of(NEAR_S) > 0 && 2 * of(EXPIRED_S) > before(EXPIRED_S).count()
    }

    /// Returns the longest time without a lease, s.
    fn longest_s(&self) -> f64 {
        let runs = self.leaseless.chunk_by(|one, next| one.1 == next.1);
        let lost = runs.filter(|run| run[0].1);
        lost.map(|run| run[run.len() - 1].0 - run[0].0)
            .fold(0.0, f64::max)
    }
}

/// Test setup: the relays of a chain with their drones, and the web page of the ground station.
pub(crate) struct Stage {
    pub(crate) chain: Chain,
    pub(crate) flown: Vec<Flown>,
    page: Page,
    begun: Instant,
    own: Vec<Own>,
    /// Number of queries of the relays' states so far.
    queries: usize,
    /// Alarms of the page about a relay's state that the relay's own status and log contradict.
    untrue: BTreeSet<String>,
    /// True if the page has had an alarm that a lease has expired.
    has_expired: bool,
}

impl Stage {
    pub(crate) fn new(chain: Chain, flown: Vec<Flown>, page: Page) -> Self {
        Self {
            own: vec![Own::default(); flown.len()],
            chain,
            flown,
            page,
            begun: Instant::now(),
            queries: 0,
            untrue: BTreeSet::new(),
            has_expired: false,
        }
    }

    fn took_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Queries the state of the next relay. Returns the new log lines of all relays with their numbers.
    fn query(&mut self) -> Vec<(usize, String)> {
        let at = self.queries % self.flown.len();
        self.queries += 1;
        let socket = self.chain.files.path(&format!("status{}", at + 1));
        if let Some(said) = status_within(socket, Duration::from_millis(200)) {
            let it = &said["relay"];
            assert!(it["has_lease"].is_boolean(), "{said:#}");
            let is = it["has_lease"] == false && !it["setpoint"].is_null();
            let took_s = self.took_s();
            self.own[at].leaseless.push((took_s, is));
        }
        let mut lines = Vec::new();
        for ((number, it), own) in (1..).zip(&mut self.flown).zip(&mut self.own) {
            for line in it.relay.lines_with("") {
                own.lacks_quorum |= line.contains("no quorum: ");
                lines.push((number, line));
            }
        }
        lines
    }

    /// Waits for the next snapshot of the page, at most for `limit`. Returns false if none has arrived.
    ///
    /// Compares the snapshot's alarms about relays' states with the states that the relays themselves report.
    fn judge(&mut self, limit: Duration) -> bool {
        if !self.page.arrives(limit) {
            return false;
        }
        let now_s = self.took_s();
        for alarm in alarms(&self.page.last) {
            let (_, text) = alarm.split_once(' ').unwrap();
            let is_lease = text.contains(LEASE);
            self.has_expired |= is_lease;
            let Some(by) = text.strip_prefix(NO_QUORUM).or(is_lease.then_some(text)) else {
                continue;
            };
            for number in subjects(by) {
                let shown = &relays(&self.page.last)[number - 1];
                let own = &self.own[number - 1];
                let age_s = shown["age_s"].as_f64().unwrap();
                let is_true = if is_lease {
                    own.has_expired(now_s - age_s)
                } else {
                    own.lacks_quorum
                };
                if !is_true && self.untrue.insert(format!("relay {number}: {text}")) {
                    println!(
                        "  untrue, {now_s:.1} s, relay {number}, age {age_s} s: {text}: {own:?}"
                    );
                }
            }
        }
        true
    }

    /// Runs the groups of faults of the script. The environment variable COUNT limits their number; ONLY selects groups by number, from 0.
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
            let group: Vec<Fault> = group.split(", ").take(left).map(fault).collect();
            left -= group.len();
            if !group.is_empty() {
                self.group(&group, &mut failures);
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
        // Log lines of earlier groups are not counted.
        self.query();
        self.begun = Instant::now();
        self.own.fill(Own::default());
        self.has_expired = false;
        for (what, relay, ..) in group {
            self.begin(what, *relay);
        }
        let of = |(_, relay, ..): &Fault, text: &str| text.replace('#', &relay.to_string());
        let text = |fault: &Fault| of(fault, fault.2);
        let (begun, mut times) = (Instant::now(), vec![[None; 2]; group.len()]);
        let mut story = Vec::new();
        let is_open = |[own, shown]: &[Option<f64>; 2]| match (own, shown) {
            (_, Some(_)) => false,
            // The alarm is late already; it is waited for, to print its time.
            (Some(own), None) => begun.elapsed().as_secs_f64() < own + 10.0 * SOON_S,
            (None, None) => begun.elapsed() < MOST,
        };
        while times.iter().any(is_open) {
            for (number, line) in self.query() {
                let took = begun.elapsed().as_secs_f64();
                for (fault, [own, _]) in group.iter().zip(&mut times) {
                    let part = of(fault, fault.3);
                    let is_its = part.starts_with("relay ") != (fault.1 == number) || fault.1 == 0;
                    if is_its && line.contains(&part) {
                        own.get_or_insert(took);
                    }
                }
                story.push(format!("{took:.1} {line}"));
            }
            if self.judge(STEP) {
                let (took, lasting) = (begun.elapsed().as_secs_f64(), alarms(&self.page.last));
                for (fault, [_, shown]) in group.iter().zip(&mut times) {
                    if lasting.iter().any(|it| is_of(it, &text(fault))) {
                        shown.get_or_insert(took);
                    }
                }
                let ages = relays(&self.page.last)
                    .iter()
                    .map(|it| it["age_s"].as_f64().unwrap_or(99.0));
                story.push(format!(
                    "{took:.1} ages {:.1?} {lasting:?}",
                    ages.collect::<Vec<_>>()
                ));
            }
        }
        failures.extend(late(group, &times));
        if std::env::var("STORY").is_ok() {
            println!("{story:#?}");
        }
        // An alarm that comes and goes would do so now.
        let held = Instant::now();
        while held.elapsed() < Duration::from_secs(1) {
            self.query();
            self.judge(STEP);
        }
        for (what, relay, ..) in group {
            self.end(what, *relay);
        }
        let ended = Instant::now();
        while !alarms(&self.page.last).is_empty() && ended.elapsed() < LIMIT {
            self.query();
            self.judge(STEP);
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
                failures.push(format!("{}: alarm does not end: {it}", name(group)));
            }
        }
        self.check_others(group, &new, failures);
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
                let [what, text] = [name(&[*fault]), text(fault)];
                failures.push(format!(
                    "{what}: {times} alarms that begin with {text:?}, must be 1"
                ));
            }
        }
    }

    /// Checks the alarms `new` of the page: an alarm about a relay without a fault is a failure.
    ///
    /// Exceptions are true alarms about a lease or the quorum, if the group of faults takes several relays or the
    /// quorum from the chain.
    fn check_others(&mut self, group: &[Fault], new: &[Value], failures: &mut Vec<String>) {
        let of = name(group);
        let hurt: Vec<usize> = group.iter().flat_map(|it| hurt(it.0, it.1)).collect();
        // With both ends or most relays lost, the rest of the chain has no lease for a while, and may have no quorum.
        // So it is if a relay is absent for longer than a lease: five handshakes with an old epoch take 34 s.
        let is_torn = group.iter().filter(|it| it.0 == "kill").count() > 1
            || ["no quorum", "epoch"].contains(&group[0].0);
        for it in new {
            let text = it["text"].as_str().unwrap();
            let by = text.strip_prefix(NO_QUORUM);
            let is_own = by.is_some() || text.contains(LEASE);
            let others = subjects(by.unwrap_or(text)).any(|it| !hurt.contains(&it));
            if others && !(is_own && is_torn) {
                failures.push(format!("{of}: alarm about a relay without a fault: {text}"));
            }
        }
        let untrue = std::mem::take(&mut self.untrue).into_iter();
        failures
            .extend(untrue.map(|it| format!("{of}: the relay's own state contradicts it: {it}")));
        let longest_s: Vec<f64> = self.own.iter().map(Own::longest_s).collect();
        println!("  longest times without a lease, by the relays: {longest_s:.1?} s");
        let most_s = longest_s.into_iter().fold(0.0, f64::max);
        if most_s > EXPIRED_S + SOON_S + NEAR_S && !self.has_expired {
            failures.push(format!("{of}: no lease for {most_s:.1} s, but no alarm"));
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

    fn kill(&mut self, relay: usize) {
        self.flown[relay - 1].relay.killed();
    }

    fn restart(&mut self, relay: usize, more: &str) {
        self.flown[relay - 1].relay = restart(&self.chain, relay, more);
    }

    /// Chooses OFFBOARD or GUIDED repeatedly, until the page shows that setpoint control is engaged.
    fn engage(&mut self, relay: usize) {
        let begun = Instant::now();
        let mut turn = 0;
        loop {
            let order = ["mode pilot", "mode companion"][turn % 2];
            self.order(relay, order);
            let until = Instant::now() + Duration::from_millis([1_300, 3_000][turn % 2]);
            while Instant::now() < until {
                self.query();
                self.judge(STEP);
                let shown = &relays(&self.page.last)[relay - 1];
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

/// Returns the numbers of the relays that the fault `what` affects.
fn hurt(what: &str, relay: usize) -> std::ops::RangeInclusive<usize> {
    match what {
        "no quorum" => 4..=8,
        _ => relay..=relay,
    }
}

/// Returns the relays with which a text begins ("relay 3", "relays 1, 2 and 5 to 7").
fn subjects(text: &str) -> impl Iterator<Item = usize> {
    let words = text.strip_prefix("relays ").or(text.strip_prefix("relay "));
    let (mut numbers, mut is_range) = (BTreeSet::new(), false);
    for word in words.unwrap_or_default().split(' ') {
        match word.trim_end_matches([',', ':', ';']).parse() {
            Ok(number) if is_range => numbers.extend(numbers.last().copied().unwrap()..=number),
            Ok(number) => _ = numbers.insert(number),
            Err(_) if word == "and" || word == "to" => {}
            Err(_) => break,
        }
        is_range = word == "to";
        if word.ends_with([':', ';']) {
            break;
        }
    }
    numbers.into_iter()
}

/// Returns true if the text `alarm` begins with `start`.
///
/// If `start` ends with a relay's number, the alarm must be about the loss of this relay.
fn is_of(alarm: &str, start: &str) -> bool {
    let is_lost = |rest: &str| rest.starts_with(" lost") || rest.starts_with(": no report");
    let rest = alarm.strip_prefix(start);
    rest.is_some_and(|rest| is_lost(rest) || !start.ends_with(|it: char| it.is_ascii_digit()))
}
