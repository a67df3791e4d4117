//! Fuzz target: a chain of two to four relays on links that lose, duplicate, reorder and damage frames.

mod agreement;
mod uploads;

use std::collections::VecDeque;

use uav_relay::Auth;
use uav_relay::{Duration, Instant, Mission, Placement, Port, Sample, Settings, Wiring};

use super::input::Input;
use super::setting;
use super::watch::{Sent, Watched};

/// Maximum number of fuzzed operations in one run; each takes some milliseconds.
const MAX_OPERATIONS: usize = 256;

const MAX_RELAYS: u8 = 4;

/// Maximum number of frames in transit to one relay. A frame beyond this number replaces the oldest one.
const MAX_IN_TRANSIT: usize = 24;

/// Maximum number of rounds in one operation. In a round each relay receives one frame.
const MAX_ROUNDS: u8 = 128;

/// Tolerance for the separation of two relays, as a fraction of the distance from Tx to Rx.
///
/// Positions are rounded to f32, which can reduce the distance of two relays by this much.
const ROUNDING: f64 = 1.3e-7;

/// Fuzz target. Reads `data` as a mission, the relays' settings, and operations on the frames between relays.
///
/// # Panics
/// A relay breaks a rule that the module `watch` checks. Or two neighbours are too close to each other, although both
/// positions come from the same pass (a message along the chain and back). Or the chain does not agree after the faults
/// have ended.
pub fn chain(data: &[u8]) {
    _ = flown(data);
}

/// Runs the fuzz target [`chain()`] and returns its relays at the end.
///
/// `None` if the mission or the settings are refused.
///
/// # Panics
/// The panics of the fuzz target [`chain()`].
pub fn flown(data: &[u8]) -> Option<Vec<Watched>> {
    let mut input = Input::new(data);
    let mut chain = Chain::new(&mut input)?;
    let to_the_end = input.below(4) == 3;
    for _ in 0..MAX_OPERATIONS {
        if input.is_empty() {
            break;
        }
        chain.operate(&mut input);
    }
    if to_the_end {
        chain.agree();
    }
    let relays = chain.members.into_iter().map(|member| member.watched);
    Some(relays.collect())
}

struct Member {
    watched: Watched,
    settings: Settings,
    arriving: VecDeque<Sent>,
}

struct Chain {
    mission: Mission,
    members: Vec<Member>,
    now: Instant,
    /// Random seed of the next relay that starts. The seed rises at every start.
    seed: u32,
    version: u16,
}

impl Chain {
    fn new(input: &mut Input<'_>) -> Option<Self> {
        let mission = setting::mission(input, MAX_RELAYS)?;
        let common = setting::of_chain(input, &mission);
        let mut chain = Self {
            mission,
            members: Vec::new(),
            now: Instant::ZERO,
            seed: u32::from(input.word()),
            version: 0,
        };
        for index in 1..=mission.relays() {
            let settings = setting::settings(input, &mission, common);
            let watched = chain.switched_on(index, settings)?;
            chain.members.push(Member {
                watched,
                settings,
                arriving: VecDeque::new(),
            });
        }
        chain.settle_all();
        Some(chain)
    }

    fn switched_on(&mut self, index: u16, settings: Settings) -> Option<Watched> {
        self.seed = self.seed.wrapping_add(1);
        let auth = settings.auth.map(|auth| Auth {
            epoch: self.seed,
            ..auth
        });
        let settings = Settings { auth, ..settings };
        Watched::new(self.mission, index, settings, self.seed, self.now)
    }

    fn operate(&mut self, input: &mut Input<'_>) {
        let at = usize::from(input.byte()) % self.members.len().max(1);
        match input.below(15) {
            0 | 1 => self.deliver(at),
            2 => {
                self.take(at);
            }
            3 => self.duplicate_frame(at),
            4 => self.delay_frame(at),
            5 => self.damage(at, input),
            6 => self.cut(at, input),
            7 => self.noise(at, input),
            8 => self.advance_time(Duration::from_millis(u64::from(input.word()))),
            9 => self.wake(),
            10 => self.restart(),
            11 => self.reboot(at),
            12 => self.sample(at, input),
            14 => self.position(at, input),
            _ => {
                let rounds = input.below(MAX_ROUNDS);
                if rounds == 0 {
                    self.upload(at, input);
                }
                for _ in 0..=rounds {
                    self.round();
                }
            }
        }
    }

    fn take(&mut self, at: usize) -> Option<Sent> {
        self.members.get_mut(at)?.arriving.pop_front()
    }

    fn deliver(&mut self, at: usize) {
        if let Some(frame) = self.take(at) {
            self.arrive(at, frame.port, &frame.bytes);
        }
    }

    fn arrive(&mut self, at: usize, port: Port, bytes: &[u8]) {
        if let Some(member) = self.members.get_mut(at) {
            member.watched.bytes(self.now, port, bytes);
        }
        self.settle(at);
    }

    fn duplicate_frame(&mut self, at: usize) {
        if let Some(member) = self.members.get_mut(at)
            && let Some(first) = member.arriving.front().cloned()
        {
            member.arriving.push_back(first);
        }
    }

    /// Delays the oldest frame to relay `at` until all other frames in transit to this relay have arrived.
    fn delay_frame(&mut self, at: usize) {
        if let Some(member) = self.members.get_mut(at)
            && let Some(first) = member.arriving.pop_front()
        {
            member.arriving.push_back(first);
        }
    }

    fn damage(&mut self, at: usize, input: &mut Input<'_>) {
        let (place, change) = (usize::from(input.byte()), input.byte());
        if let Some(mut frame) = self.take(at) {
            let len = frame.bytes.len();
            if let Some(byte) = frame.bytes.get_mut(place % len.max(1)) {
                *byte ^= change;
            }
            self.arrive(at, frame.port, &frame.bytes);
        }
    }

    /// Delivers the oldest frame to relay `at` in two pieces. `input` decides if the second piece is lost.
    fn cut(&mut self, at: usize, input: &mut Input<'_>) {
        let (place, lost) = (usize::from(input.byte()), input.flag());
        if let Some(frame) = self.take(at) {
            let cut = place % frame.bytes.len().max(1);
            let (first, second) = frame.bytes.split_at_checked(cut).unwrap_or_default();
            self.arrive(at, frame.port, first);
            if !lost {
                self.arrive(at, frame.port, second);
            }
        }
    }

    fn noise(&mut self, at: usize, input: &mut Input<'_>) {
        let port = match (self.members.get(at), input.flag()) {
            (Some(member), _) if member.settings.wiring == Wiring::Shared => Port::Shared,
            (_, true) => Port::Upstream,
            (_, false) => Port::Downstream,
        };
        self.arrive(at, port, input.piece());
    }

    fn advance_time(&mut self, span: Duration) {
        self.now = self.now + span;
        self.settle_all();
    }

    /// Advances the time to the earliest timeout of any relay.
    fn wake(&mut self) {
        let next = self
            .members
            .iter()
            .filter_map(|member| member.watched.relay().poll_timeout())
            .min();
        self.now = self.now.max(next.unwrap_or(self.now));
        self.settle_all();
    }

    /// Delivers the oldest frame to each relay, without faults.
    ///
    /// If no frame is in transit, the time is first advanced to the next timeout.
    fn round(&mut self) {
        if self.members.iter().all(|member| member.arriving.is_empty()) {
            self.wake();
        }
        for at in 0..self.members.len() {
            self.deliver(at);
        }
    }

    fn leader(&self) -> usize {
        usize::from(self.mission.leader()).saturating_sub(1)
    }

    fn restart(&mut self) {
        // Only the leader restarts a pass.
        for member in &mut self.members {
            member.watched.restart(self.now);
        }
        self.settle_all();
    }

    /// Restarts relay `at`. Frames in transit to it are still delivered.
    fn reboot(&mut self, at: usize) {
        let Some(settings) = self.members.get(at).map(|member| member.settings) else {
            return;
        };
        let index = u16::try_from(at).unwrap_or(0) + 1;
        let Some(watched) = self.switched_on(index, settings) else {
            return;
        };
        if let Some(member) = self.members.get_mut(at) {
            member.watched = watched;
        }
        // After its restart, the leader numbers its passes anew, perhaps with an old number. View numbers start anew if
        // most relays have lost them.
        for member in &mut self.members {
            member.watched.forget_pass();
        }
        self.settle(at);
    }

    fn position(&mut self, at: usize, input: &mut Input<'_>) {
        let config = self.mission.config();
        let place = Placement {
            x_m: input.even(0.0, config.distance_m),
            y_m: setting::aside(input, config.lateral),
            altitude_m: input.scaled(0.1, 1e5),
        };
        if let Some(member) = self.members.get_mut(at) {
            member.watched.position(self.now, self.now, place);
        }
        self.settle(at);
    }

    fn sample(&mut self, at: usize, input: &mut Input<'_>) {
        let power_w = input.scaled(1e-30, 1e6);
        let other_w = power_w * input.even(0.0, 1.0);
        let Some(member) = self.members.get_mut(at) else {
            return;
        };
        for power_w in [power_w, other_w] {
            let sample = Sample::Interference { power_w };
            member.watched.sample(self.now, sample, 64);
        }
        self.settle(at);
    }

    fn settle_all(&mut self) {
        for at in 0..self.members.len() {
            self.settle(at);
        }
    }

    /// Takes the frames that relay `at` sends, and puts them in transit. Then checks the relay.
    ///
    /// The checks are those of its view (membership of the chain) and of its separation from each neighbour.
    fn settle(&mut self, at: usize) {
        let now = self.now;
        let Some(member) = self.members.get_mut(at) else {
            return;
        };
        let (sent, _) = member.watched.settle(now);
        for frame in sent {
            self.send(at, &frame);
        }
        self.check_place(at);
        self.check_separation(at);
        self.check_separation(at + 1);
    }

    /// Puts a frame of relay `from` in transit: to one neighbour, or to all relays of a shared channel.
    fn send(&mut self, from: usize, frame: &Sent) {
        for (at, member) in self.members.iter_mut().enumerate() {
            let port = match frame.port {
                Port::Upstream if at + 1 == from => Port::Downstream,
                Port::Downstream if at == from + 1 => Port::Upstream,
                Port::Shared if at != from => Port::Shared,
                _ => continue,
            };
            if member.arriving.len() >= MAX_IN_TRANSIT {
                member.arriving.pop_front();
            }
            let bytes = frame.bytes.clone();
            member.arriving.push_back(Sent { port, bytes });
        }
    }

    /// Checks the index of relay `at` in its view (membership of the chain), and the view's size.
    ///
    /// The view must not have more relays than the mission before relay `at`, nor after it.
    fn check_place(&self, at: usize) {
        if let Some(member) = self.members.get(at) {
            let relay = member.watched.relay();
            let (before, after) = (at + 1, self.members.len() - at);
            let (index, left) = (usize::from(relay.index()), relay.mission().relays());
            let behind = usize::from(left) + 1 - index;
            assert!(
                index <= before && behind <= after,
                "relay {before} is {index} of {left}"
            );
        }
    }

    /// Checks that relay `at` (from 0) keeps the minimum separation from relay `at` - 1.
    ///
    /// The check applies only if both positions come from the same pass (a message along the chain and back).
    fn check_separation(&self, at: usize) {
        let (Some(before), Some(after)) = (
            at.checked_sub(1)
                .and_then(|before| self.members.get(before)),
            self.members.get(at),
        ) else {
            return;
        };
        let held = before.watched.held();
        if held.is_none() || held != after.watched.held() {
            return;
        }
        let places = (
            before.watched.relay().agreed_place(),
            after.watched.relay().agreed_place(),
        );
        if let (Some(from), Some(to)) = places {
            let config = self.mission.config();
            let least = f64::from(config.min_separation_m);
            let rounding = ROUNDING * f64::from(config.distance_m);
            let apart = distance(from, to);
            assert!(
                apart >= least - rounding,
                "{from:?} and {to:?} are {apart} m apart"
            );
            assert!(to.x_m >= from.x_m, "{from:?} and {to:?} in the wrong order");
        }
    }
}

fn distance(one: Placement, other: Placement) -> f64 {
    let step = f64::from(other.x_m) - f64::from(one.x_m);
    let climb = f64::from(other.altitude_m) - f64::from(one.altitude_m);
    let aside = f64::from(other.y_m) - f64::from(one.y_m);
    step.hypot(climb).hypot(aside)
}
