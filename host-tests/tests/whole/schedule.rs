//! Random schedules that mix all faults.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::{Interference, Interferer, Upload, Wiring};

use super::air::{Air, Kind, ScheduledEvent};
use host_tests::fixtures::mission;

pub(crate) const SECOND: u64 = 1_000_000;

/// Schedule of faults of a chain, and the time at which the last fault ends.
#[derive(Clone, Debug)]
pub(crate) struct Schedule {
    pub(crate) kind: Kind,
    pub(crate) events: Vec<(u64, ScheduledEvent)>,
    pub(crate) faults_end_us: u64,
}

impl Schedule {
    /// Returns a schedule without faults, in which all relays are switched on at time 0.
    pub(crate) fn of(relays: u16, seed: u64) -> Self {
        let kind = Kind {
            mission: mission(relays),
            wiring: Wiring::Shared,
            signed: false,
            seed,
            reach: 4,
            stranger: None,
            goes_back: None,
            copied: None,
        };
        let on = (0..usize::from(relays)).map(|at| (0, ScheduledEvent::On(at)));
        Self {
            kind,
            events: on.collect(),
            faults_end_us: 0,
        }
    }

    pub(crate) fn begun(&self) -> Air {
        let mut air = Air::new(self.kind.clone());
        for (at_us, event) in &self.events {
            air.plan(*at_us, event.clone());
        }
        air
    }

    fn put(&mut self, at_us: u64, event: ScheduledEvent) {
        self.events.push((at_us, event));
        self.faults_end_us = self.faults_end_us.max(at_us);
    }

    /// Switches relay `at` off at `off_us`, and on again at `on_us`.
    pub(crate) fn reboot(&mut self, at: usize, off_us: u64, on_us: u64) {
        self.put(off_us, ScheduledEvent::Off(at));
        self.put(on_us, ScheduledEvent::On(at));
    }

    /// Steps the clock of relay `at` by a millisecond to ten hours, forward or back.
    pub(crate) fn step(&mut self, at: usize, at_us: u64, forward: bool, rng: &mut ChaCha8Rng) {
        let by_us = 1e3 * f64::powf(3.6e7, rng.random_range(0.0..1.0));
        let by_us = if forward { by_us as i64 } else { -by_us as i64 };
        self.put(at_us, ScheduledEvent::Step(at, by_us));
    }

    /// Loses the frames from relay `from` to relay `to` between two times.
    pub(crate) fn cut_link_between(&mut self, from: usize, to: usize, from_us: u64, until_us: u64) {
        self.put(from_us, ScheduledEvent::Cut { from, to });
        self.put(until_us, ScheduledEvent::Mend { from, to });
    }

    /// Cuts the link of two relays in both directions between two times.
    pub(crate) fn cut_both_links(&mut self, one: usize, other: usize, from_us: u64, until_us: u64) {
        self.cut_link_between(one, other, from_us, until_us);
        self.cut_link_between(other, one, from_us, until_us);
    }

    /// Separates the relays with `is_in` true from all other relays, between two times.
    pub(crate) fn cut(&mut self, is_in: impl Fn(usize) -> bool, from_us: u64, until_us: u64) {
        let all = usize::from(self.kind.mission.relays());
        for one in 0..all {
            for other in (0..one).filter(|other| is_in(*other) != is_in(one)) {
                self.cut_both_links(one, other, from_us, until_us);
            }
        }
    }

    /// Lets the link of two relays fail and return again and again until `until_us`.
    pub(crate) fn flap(
        &mut self,
        (one, other): (usize, usize),
        (down_us, up_us): (u64, u64),
        from_us: u64,
        until_us: u64,
    ) {
        let mut at_us = from_us;
        while at_us < until_us {
            self.cut_both_links(one, other, at_us, (at_us + down_us).min(until_us));
            at_us += down_us + up_us;
        }
    }
}

/// Draws the number of relays: 2 to 50, mostly few.
fn relays(rng: &mut ChaCha8Rng) -> u16 {
    match rng.random_range(0..40) {
        0 => rng.random_range(13..=50),
        1..8 => rng.random_range(9..=12),
        _ => rng.random_range(2..=8),
    }
}

/// Draws the duration of a fault, µs: 2 s to 4 minutes, log-uniform.
fn span(rng: &mut ChaCha8Rng) -> u64 {
    let seconds = 2.0 * f64::powf(120.0, rng.random_range(0.0..1.0));
    (seconds * 1e6) as u64
}

/// Draws a schedule of faults of every kind. In one of six schedules clocks step back.
pub(crate) fn random(seed: u64) -> Schedule {
    let mut schedule = without_steps(seed);
    // A separate random generator leaves the rest of the schedule unchanged.
    let rng = &mut ChaCha8Rng::seed_from_u64(!seed);
    if rng.random_range(0..6) == 0 {
        for _ in 0..rng.random_range(1..=4) {
            let at = rng.random_range(0..usize::from(schedule.kind.mission.relays()));
            let at_us = rng.random_range(0..=schedule.faults_end_us + 60 * SECOND);
            schedule.step(at, at_us, false, rng);
        }
    }
    schedule
}

/// Draws a schedule of faults in which relays also leave the chain. Each relay that leaves cancels its departure in the
/// end.
pub(crate) fn with_departures(seed: u64) -> Schedule {
    let mut schedule = random(seed);
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0x5555);
    let end_us = schedule.faults_end_us;
    for at in 0..usize::from(schedule.kind.mission.relays()) {
        if rng.random_bool(0.4) {
            // Some are spares from the start.
            let is_spare = rng.random_bool(0.3);
            let leaves_us = if is_spare || rng.random_bool(0.1) {
                1
            } else {
                rng.random_range(1..=end_us + 30 * SECOND)
            };
            let endurance_s = rng.random_bool(0.5).then(|| rng.random_range(0..=600));
            let stays_us = leaves_us + span(rng);
            let event = if is_spare {
                ScheduledEvent::Spare(at)
            } else {
                ScheduledEvent::Leave(at, endurance_s)
            };
            schedule.put(leaves_us, event);
            schedule.put(stays_us, ScheduledEvent::Stay(at));
        }
    }
    schedule
}

/// Draws a schedule of faults of every kind except steps of clocks.
pub(crate) fn without_steps(seed: u64) -> Schedule {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let count = relays(rng);
    let all = usize::from(count);
    let mut schedule = Schedule::of(count, rng.random());
    schedule.kind.signed = rng.random_bool(0.3);
    if rng.random_bool(0.2) {
        schedule.kind.wiring = Wiring::Pair;
    }
    if rng.random_bool(0.3) {
        // Early and late starts: within seconds or minutes, in one of ten schedules within an hour.
        let most = match rng.random_range(0..10) {
            0 => 3_600 * SECOND,
            1..5 => 10 * SECOND,
            _ => 240 * SECOND,
        };
        for (at_us, _) in &mut schedule.events {
            if rng.random_bool(0.5) {
                *at_us = rng.random_range(0..most);
            }
        }
        let starts = schedule.events.iter().map(|(at_us, _)| *at_us);
        schedule.faults_end_us = starts.max().unwrap_or(0);
    }
    let begun = schedule.faults_end_us.min(600 * SECOND);
    let long = rng.random_bool(0.05);
    let faults = rng.random_range(1..=6);
    for number in 0..faults {
        let from_us = rng.random_range(0..=begun + 240 * SECOND);
        let until_us = from_us
            + if long && number == 0 {
                rng.random_range(3_600..4 * 3_600) * SECOND
            } else {
                span(rng)
            };
        let one = rng.random_range(0..all);
        let near = |rng: &mut ChaCha8Rng| {
            let reach = rng.random_range(1..=4.min(all - 1));
            if one + reach < all {
                one + reach
            } else {
                one - reach.min(one)
            }
        };
        let mut other = near(rng);
        if other == one {
            other = (one + 1) % all;
        }
        let kind = if long && number == 0 {
            rng.random_range(0..3)
        } else {
            rng.random_range(0..9)
        };
        match kind {
            // Cut of one relay's radio, of the chain at one position, or between any two parts.
            0 => schedule.cut(|at| at == one, from_us, until_us),
            1 => schedule.cut(|at| at <= one, from_us, until_us),
            2 => {
                let part: Vec<bool> = (0..all).map(|_| rng.random()).collect();
                schedule.cut(|at| part[at], from_us, until_us);
            }
            3 => schedule.cut_both_links(one, other, from_us, until_us),
            4 => schedule.cut_link_between(one, other, from_us, until_us),
            5 => {
                // One relay receives no frames, or none of its frames is received.
                let mute = rng.random_bool(0.5);
                for other in (0..all).filter(|other| *other != one) {
                    let (from, to) = if mute { (one, other) } else { (other, one) };
                    schedule.cut_link_between(from, to, from_us, until_us);
                }
            }
            6 => {
                let period = (span(rng), span(rng));
                schedule.flap((one, other), period, from_us, until_us);
            }
            7 => {
                schedule.put(from_us, ScheduledEvent::Loss(rng.random_range(0.05..0.7)));
                schedule.put(until_us, ScheduledEvent::Loss(0.0));
            }
            _ => schedule.reboot(one, from_us, until_us),
        }
    }
    if schedule.kind.signed && rng.random_bool(0.5) {
        let at_us = rng.random_range(0..=schedule.faults_end_us);
        let upload = moved(&schedule, rng);
        schedule.put(
            at_us,
            ScheduledEvent::Upload(rng.random_range(0..all), upload),
        );
    }
    schedule
}

/// Returns an upload of the schedule's mission with the interferer at another position.
fn moved(schedule: &Schedule, rng: &mut ChaCha8Rng) -> Box<Upload> {
    let base = &schedule.kind.mission;
    let mut config = *base.config();
    if let Interference::Source(Interferer { power_w, .. }) = config.interference {
        config.interference = Interference::Source(make::interferer(
            power_w,
            rng.random_range(100.0..900.0),
            rng.random_range(100.0..500.0),
        ));
    }
    Box::new(Upload::new(base, 1, config).unwrap())
}

/// Draws a schedule with a relay and its copy, one of which is removed after all other faults.
///
/// A copy is a second drone with the same index. In half of the schedules, the remaining drone is informed of the
/// removal. In some schedules, the two drones do not receive each other, or the chain is cut.
pub(crate) fn with_copy(seed: u64) -> Schedule {
    let mut schedule = without_steps(seed);
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0xC0B1);
    schedule.kind.wiring = Wiring::Shared;
    schedule.kind.signed = rng.random_bool(0.5);
    let copy = usize::from(schedule.kind.mission.relays());
    let copied = rng.random_range(0..copy);
    schedule.kind.copied = Some(copied);
    if rng.random_bool(0.5) {
        // The copy is the only fault.
        schedule
            .events
            .retain(|(_, event)| matches!(event, ScheduledEvent::On(_)));
        let starts = schedule.events.iter().map(|(at_us, _)| *at_us);
        schedule.faults_end_us = starts.max().unwrap_or(0);
    }
    let most_us = schedule.faults_end_us.min(600 * SECOND) + 60 * SECOND;
    let on_us = rng.random_range(0..most_us);
    schedule.put(on_us, ScheduledEvent::On(copy));
    if rng.random_bool(0.3) {
        schedule.cut_both_links(copied, copy, 0, rng.random_range(0..most_us + 60 * SECOND));
    }
    let gone_us = schedule.faults_end_us + rng.random_range(0..120 * SECOND);
    // With a key, the neighbours refuse the copy with the older epoch.
    let rebooted = schedule
        .events
        .iter()
        .any(|(_, event)| matches!(event, ScheduledEvent::Off(at) if *at == copied));
    let (gone, left) = if schedule.kind.signed && rebooted || rng.random_bool(0.5) {
        (copy, copied)
    } else {
        (copied, copy)
    };
    schedule.put(gone_us, ScheduledEvent::Off(gone));
    if rng.random_bool(0.5) {
        schedule.put(gone_us, ScheduledEvent::Clear(left));
    }
    schedule
}

impl Schedule {
    /// Returns true if no link between two relays is ever cut in this schedule.
    pub(crate) fn is_uncut(&self) -> bool {
        !self
            .events
            .iter()
            .any(|(_, event)| matches!(event, ScheduledEvent::Cut { .. }))
    }
}
