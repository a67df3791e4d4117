//! Random flights with failsafes, restarts, delays and pilots: no drone is engaged without its pilot.

use std::collections::VecDeque;

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::Duration;
use uav_relay::flight::autopilot::Autopilot;
use uav_relay::flight::autopilot::carrot::Pace;

use super::real::{Mode, Real};
use super::runner::Runner;
use super::vehicle::axis;
use super::*;

const STEP: Duration = Duration::from_millis(20);

/// Duration of a flight, s.
const FLIGHT_S: u64 = 240;

/// Longest time until the autopilot link must know the vehicle's mode. Heartbeats come each second, at most 2 s late.
const KNOWN_WITHIN: Duration = Duration::from_millis(3_100);

#[derive(Clone, Copy, PartialEq, Debug)]
enum Fault {
    None,
    /// The cable keeps all bytes, and delivers all of them when the fault ends.
    Withhold,
    Cut,
    /// The cable delays the bytes by this time, µs.
    Delay(u64),
}

/// Model of one direction of a serial cable, with faults. The bytes stay in order.
struct Cable {
    /// Bytes in transit, with their times of arrival and of sending.
    waiting: VecDeque<(Instant, Instant, Vec<u8>)>,
    kept: Vec<(Instant, Vec<u8>)>,
    fault: Fault,
}

impl Cable {
    const fn new() -> Self {
        Self {
            waiting: VecDeque::new(),
            kept: Vec::new(),
            fault: Fault::None,
        }
    }

    fn put(&mut self, now: Instant, bytes: Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        match self.fault {
            Fault::Cut => {}
            Fault::Withhold => self.kept.push((now, bytes)),
            Fault::None => self.enqueue(now, now, bytes),
            Fault::Delay(us) => self.enqueue(now + Duration::from_micros(us), now, bytes),
        }
    }

    fn enqueue(&mut self, at: Instant, sent: Instant, bytes: Vec<u8>) {
        let last = self.waiting.back().map_or(at, |(at, ..)| *at);
        self.waiting.push_back((at.max(last), sent, bytes));
    }

    fn set(&mut self, now: Instant, fault: Fault) {
        self.fault = fault;
        for (sent, bytes) in core::mem::take(&mut self.kept) {
            self.enqueue(now, sent, bytes);
        }
    }

    fn take(&mut self, now: Instant) -> Option<(Instant, Vec<u8>)> {
        let (at, ..) = self.waiting.front()?;
        let is_due = *at <= now;
        let (_, sent, bytes) = is_due.then(|| self.waiting.pop_front())??;
        Some((sent, bytes))
    }
}

/// Companion under test: the autopilot link, which the test polls, or the asynchronous runner.
enum Companion {
    Polled(Box<Autopilot>),
    Async(Runner),
}

struct Flight {
    rng: ChaCha8Rng,
    is_async: bool,
    now: Instant,
    real: Real,
    to: Cable,
    from: Cable,
    companion: Option<Companion>,
    /// Time at which the companion program was last started.
    started: Instant,
    /// Time at which the companion restarts; `None` while it runs.
    starts_at: Option<Instant>,
    /// Time until which the companion is paused and does not run.
    paused_until: Instant,
    mends_at: Instant,
    gps_until: Instant,
    setpoint: Option<Placement>,
    /// Time at which the pilot last chose OFFBOARD or GUIDED; `None` before the first time.
    handed_over_at: Option<Instant>,
    /// Last time at which the drone flew in OFFBOARD or GUIDED.
    flown_at: Instant,
    texts: Vec<(Instant, String)>,
    engaged: u32,
    wrong: Vec<String>,
    log: Vec<String>,
}

impl Flight {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let now = Instant::from_millis(1_000_000);
        let kind = [Kind::Px4, Kind::ArduCopter][rng.random_range(0..2)];
        let mut real = Real::new(kind, axis(), [300.0, 0.0, 20.0], now);
        if rng.random_bool(0.3) {
            real.slow = 0.01;
        }
        // PX4 and ArduCopter both answer TIMESYNC.
        real.echoes = rng.random_bool(0.9);
        let is_async = rng.random_bool(0.25);
        let mut flight = Self {
            rng,
            is_async,
            now,
            real,
            to: Cable::new(),
            from: Cable::new(),
            companion: None,
            started: now,
            starts_at: None,
            paused_until: now,
            mends_at: now,
            gps_until: now,
            setpoint: None,
            handed_over_at: None,
            flown_at: now,
            texts: Vec::new(),
            engaged: 0,
            wrong: Vec::new(),
            log: Vec::new(),
        };
        flight.start();
        flight
    }

    fn start(&mut self) {
        let link = Autopilot::new(axis(), Pace::default(), self.now);
        self.started = self.now;
        self.companion = Some(if self.is_async {
            Companion::Async(Runner::new(link, self.now))
        } else {
            Companion::Polled(Box::new(link))
        });
    }

    fn log_event(&mut self, what: &str) {
        let at = self.now.as_micros() as f64 / 1e6 - 1_000.0;
        self.log.push(format!("{at:.2} {what}"));
    }

    fn random_time(&mut self, least_ms: u64, most_ms: u64) -> Instant {
        self.now + Duration::from_millis(self.rng.random_range(least_ms..=most_ms))
    }

    fn apply_due_events(&mut self) {
        match self.rng.random_range(0..12) {
            0..=3 => self.choose(Mode::Companion),
            4 => self.choose(Mode::Hold),
            5 => self.choose(Mode::Sticks),
            6 if self.now >= self.mends_at => {
                // Without TIMESYNC answers a constant delay and a slow clock look the same.
                let kinds = if self.real.echoes { 3 } else { 2 };
                let fault = match self.rng.random_range(0..kinds) {
                    0 => Fault::Withhold,
                    1 => Fault::Cut,
                    _ => Fault::Delay(self.rng.random_range(100_000..8_000_000)),
                };
                let ways = self.rng.random_range(1..=3_u8);
                self.mends_at = self.random_time(300, 9_000);
                self.log_event(&format!("cable {fault:?} {ways} until {:?}", self.mends_at));
                if ways & 1 != 0 {
                    self.to.set(self.now, fault);
                }
                if ways & 2 != 0 {
                    self.from.set(self.now, fault);
                }
            }
            7 => {
                self.companion = None;
                let at = self.random_time(20, 15_000);
                self.starts_at = Some(at);
                self.log_event(&format!("companion killed until {at:?}"));
            }
            8 => {
                self.paused_until = self.random_time(50, 4_000);
                self.log_event(&format!("companion paused until {:?}", self.paused_until));
            }
            9 => {
                self.real.lose_gps(self.now);
                self.gps_until = self.random_time(1_000, 20_000);
                self.log_event(&format!("gps lost until {:?}", self.gps_until));
            }
            10 if self.rng.random_bool(0.5) => {
                let until = self.random_time(500, 6_000);
                self.real.restart(until);
                self.log_event(&format!("autopilot restarts until {until:?}"));
            }
            _ => {
                self.real.lost_us += self.rng.random_range(-1_500_000..=1_500_000_i64);
                self.log_event(&format!("clock {}", self.real.lost_us));
            }
        }
    }

    fn choose(&mut self, mode: Mode) {
        let taken = self.real.choose(self.now, mode);
        if taken && mode == Mode::Companion {
            self.handed_over_at = Some(self.now);
        }
        self.log_event(&format!("pilot {mode:?} {taken}"));
    }

    fn step(&mut self) {
        self.now = self.now + STEP;
        let now = self.now;
        if now >= self.gps_until {
            self.real.gps = true;
        }
        if now >= self.mends_at {
            self.to.set(now, Fault::None);
            self.from.set(now, Fault::None);
        }
        let said = self.real.step(now);
        self.from.put(now, said);
        if self.real.mode == Mode::Companion {
            self.flown_at = now;
        }
        while let Some((sent, frame)) = self.to.take(now) {
            let answer = self.real.handle_frame(now, sent, &frame);
            self.from.put(now, answer);
        }
        if self.starts_at.is_some_and(|at| at <= now) {
            self.starts_at = None;
            self.start();
            self.texts.clear();
            // Bytes received before are flushed when the port is opened.
            while self.from.take(now).is_some() {}
        }
        self.drive();
        if self.real.resumed > 0 {
            self.wrong
                .push(format!("OFFBOARD resumed without a pilot at {now:?}"));
            self.real.resumed = 0;
        }
    }

    fn drive(&mut self) {
        let now = self.now;
        if now < self.paused_until {
            return;
        }
        let mut companion = self.companion.take();
        let engages = match &mut companion {
            Some(Companion::Polled(link)) => self.poll(link),
            Some(Companion::Async(runner)) => self.run(runner),
            None => false,
        };
        self.companion = companion;
        if engages {
            self.engaged += 1;
            if now.since(self.flown_at) > KNOWN_WITHIN {
                self.wrong
                    .push(format!("engaged by what was long ago at {now:?}"));
            }
            // The pilot's choice must be later than the companion's start.
            if self.handed_over_at.is_none_or(|at| at < self.started) {
                self.wrong
                    .push(format!("engaged without a pilot at {now:?}"));
            }
        }
    }

    /// Polls the autopilot link. Returns true if the drone comes under setpoint control.
    fn poll(&mut self, link: &mut Autopilot) -> bool {
        let now = self.now;
        let before = link.state();
        let mut became = before;
        let mut engages = false;
        let mut see = |state| {
            engages |= state == State::Engaged && !matches!(became, State::Engaged | State::Blind);
            became = state;
        };
        while let Some((_, bytes)) = self.from.take(now) {
            link.handle_bytes(now, &bytes);
            see(link.state());
        }
        link.handle_timeout(now);
        see(link.state());
        link.handle_setpoint(now, self.setpoint);
        while let Some(frame) = link.poll_transmit(now) {
            self.send(&frame);
        }
        while link.poll_position().is_some() {}
        while link.poll_event().is_some() {}
        assert!(
            link.poll_timeout(now) > now,
            "the link asks for the next call without an advance of time (endless loop)"
        );
        if became != before {
            self.log_event(&format!("link {became:?}, {:?}", self.real.mode));
        }
        engages
    }

    /// Runs the asynchronous runner with its relay's setpoint. Returns true if the drone comes under setpoint
    /// control.
    fn run(&mut self, runner: &mut Runner) -> bool {
        let before = runner.is_flown();
        let mut engages = false;
        while let Some((_, bytes)) = self.from.take(self.now) {
            runner.handle_bytes(&bytes);
        }
        let written = runner.run(self.now);
        engages |= !before && runner.is_flown();
        let mut left = &written[..];
        while let Some(length) = left.get(1) {
            let (frame, rest) = left.split_at(12 + usize::from(*length));
            self.send(frame);
            left = rest;
        }
        if before != runner.is_flown() {
            let what = format!("async, flown {}, {:?}", !before, self.real.mode);
            self.log_event(&what);
        }
        engages
    }

    /// Passes a frame of the companion to the vehicle. Checks the status text if the frame contains one.
    fn send(&mut self, frame: &[u8]) {
        let now = self.now;
        if frame[7] == 253 {
            let end = frame.len() - 2;
            let text = String::from_utf8_lossy(&frame[11..end])
                .trim_end_matches('\0')
                .to_owned();
            let again = self.texts.iter().rev().find(|(_, other)| *other == text);
            if again.is_some_and(|(at, _)| now.since(*at) < Duration::from_millis(10_000)) {
                self.wrong.push(format!("{text} again at {now:?}"));
            }
            self.texts.push((now, text));
        }
        self.to.put(now, frame.to_vec());
    }

    fn setpoint(&mut self) {
        let place = |rng: &mut ChaCha8Rng| {
            make::placement(
                rng.random_range(200.0..400.0),
                rng.random_range(-20.0..20.0),
                rng.random_range(20.0..40.0),
            )
        };
        self.setpoint = self.rng.random_bool(0.8).then(|| place(&mut self.rng));
    }
}

/// Simulates a random flight.
///
/// Returns the violated rules, the number of times that setpoint control was engaged, and true if the companion was the
/// asynchronous runner.
fn fly(seed: u64) -> (Vec<String>, u32, bool) {
    let mut flight = Flight::new(seed);
    for i in 0..FLIGHT_S * 50 {
        if i == 150 {
            flight.real.take_off();
        }
        if i > 400 && flight.rng.random_bool(0.004) {
            flight.apply_due_events();
        }
        if flight.rng.random_bool(0.002) {
            flight.setpoint();
        }
        flight.step();
    }
    let kind = flight.real.kind;
    let wrong = flight.wrong.into_iter();
    let log = flight.log.join("\n  ");
    let wrong = wrong.map(|what| format!("SEED={seed} {kind:?}: {what}\n  {log}"));
    (wrong.take(1).collect(), flight.engaged, flight.is_async)
}

#[test]
fn setpoint_control_needs_the_pilots_choice() {
    let first = uav_relay_oracle::random::seed(1);
    let count = std::env::var("COUNT").ok();
    let count: u64 = count.and_then(|text| text.parse().ok()).unwrap_or(1_000);
    let all: Vec<_> = (first..first + count).into_par_iter().map(fly).collect();
    let engaged: u32 = all.iter().map(|(_, engaged, _)| engaged).sum();
    let on_runner = all.iter().filter(|(.., is_async)| *is_async);
    let on_runner: u32 = on_runner.map(|(_, engaged, _)| engaged).sum();
    let wrong: Vec<&String> = all.iter().flat_map(|(wrong, ..)| wrong).collect();
    println!(
        "{count} flights, engaged {engaged} times, {on_runner} of them on the asynchronous runner, {} wrong",
        wrong.len()
    );
    assert!(
        u64::from(engaged) > count,
        "too few were engaged: {engaged}"
    );
    assert!(u64::from(on_runner) > count / 4, "{on_runner}");
    assert!(wrong.is_empty(), "{} of {count}: {}", wrong.len(), wrong[0]);
}
