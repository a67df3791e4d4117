//! Chain on lossless links, with checks that must hold for any inputs.

use std::collections::VecDeque;

use uav_relay::MAX_FRAME;
use uav_relay::sensing::belief::Belief;
use uav_relay::{
    Duration, Event, Identity, Instant, Mission, Phase, Placement, Port, Relay, Settings, Wiring,
};

/// Turns of the loop at one time after which a chain counts as stuck.
const MOST_TURNS: u32 = 400_000;

pub(crate) struct Line {
    pub(crate) relays: Vec<Relay>,
    under_way: VecDeque<(usize, Port, Vec<u8>)>,
    pub(crate) now: Instant,
    pub(crate) events: Vec<(u16, Event)>,
    turns: u32,
    wiring: Wiring,
}

impl Line {
    /// Starts all relays of `mission` with the settings of each index from 1. `None` where they are refused.
    pub(crate) fn new(
        mission: Mission,
        now: Instant,
        settings: impl Fn(u16) -> Settings,
    ) -> Option<Self> {
        let relay = |index| {
            let identity = Identity { network: 7, index };
            let seed = 0x9E37_79B9_u32.wrapping_mul(u32::from(index));
            Relay::new(mission, identity, settings(index), seed, now).ok()
        };
        let relays: Option<Vec<Relay>> = (1..=mission.relays()).map(relay).collect();
        let mut line = Self {
            relays: relays?,
            under_way: VecDeque::new(),
            now,
            events: Vec::new(),
            turns: 0,
            wiring: settings(1).wiring,
        };
        line.settle();
        Some(line)
    }

    pub(crate) fn run(&mut self, until: Instant) {
        self.turns = 0;
        loop {
            self.settle();
            let next = self.relays.iter().filter_map(Relay::poll_timeout).min();
            match next {
                Some(next) if next <= until => self.now = next,
                _ => break,
            }
        }
        self.now = self.now.max(until);
        self.settle();
    }

    pub(crate) fn run_for(&mut self, span: Duration) {
        self.run(self.now + span);
    }

    /// Returns true if all relays hold positions, or the leader has reported infeasibility.
    pub(crate) fn has_agreed(&self) -> bool {
        let mut leaders = self
            .relays
            .iter()
            .filter(|relay| relay.index() == relay.mission().leader());
        leaders.any(|relay| relay.phase() == Phase::Infeasible)
            || self
                .relays
                .iter()
                .all(|relay| relay.phase() == Phase::Holding)
    }

    /// Returns true if the leader has reported infeasibility.
    pub(crate) fn is_infeasible(&self) -> bool {
        self.events
            .iter()
            .any(|(_, event)| *event == Event::Infeasible)
    }

    /// Handles all due timers and delivers all frames until there are none.
    pub(crate) fn settle(&mut self) {
        loop {
            for at in 0..self.relays.len() {
                self.drain(at);
            }
            let Some((at, port, bytes)) = self.under_way.pop_front() else {
                break;
            };
            self.turn();
            self.relays[at].handle_bytes(self.now, port, &bytes);
        }
    }

    fn turn(&mut self) {
        self.turns += 1;
        assert!(self.turns < MOST_TURNS, "it never ends: {:?}", self.now);
    }

    fn drain(&mut self, at: usize) {
        self.turn();
        let relay = &mut self.relays[at];
        relay.handle_timeout(self.now);
        let mut frame = [0; MAX_FRAME];
        relay.persist(|_| true);
        while let Some(transmit) = relay.poll_transmit(self.now, &mut frame) {
            let bytes = frame[..transmit.len].to_vec();
            let all = 0..at + 2;
            for to in all.filter(|to| to.abs_diff(at) == 1) {
                let port = match (self.wiring, to > at, transmit.port) {
                    (Wiring::Shared, _, _) => Port::Shared,
                    (_, true, Port::Downstream) => Port::Upstream,
                    (_, false, Port::Upstream) => Port::Downstream,
                    _ => continue,
                };
                self.under_way.push_back((to, port, bytes.clone()));
            }
        }
        while let Some(event) = relay.poll_event() {
            self.events.push((relay.index(), event));
        }
        let due = relay.poll_timeout();
        assert!(
            due.is_none_or(|due| due > self.now || self.now.as_micros() == u64::MAX),
            "{due:?} at {:?}",
            self.now
        );
        let count = self.relays.len();
        self.under_way.retain(|(to, ..)| *to < count);
    }

    /// Checks that every reported number is finite, and no relay sends messages that others refuse.
    pub(crate) fn check(&self) {
        for relay in &self.relays {
            for place in [relay.setpoint(), relay.agreed_place()]
                .into_iter()
                .flatten()
            {
                assert!(is_finite(place), "{place:?}");
            }
            let numbers = [
                relay.target(),
                relay.bound(),
                relay.measured_per_w(),
                relay.level_w(uav_relay::Side::Upstream),
                relay.level_w(uav_relay::Side::Downstream),
                Some(relay.profile().altitude_m),
                relay.rounds().map(|(_, sir)| sir),
            ];
            assert!(
                numbers.into_iter().flatten().all(f32::is_finite),
                "{numbers:?}"
            );
            if let Belief::Source { source, receiver_w } = relay.belief().belief {
                assert!(
                    source.is_valid() && receiver_w.is_finite(),
                    "{source:?} {receiver_w}"
                );
            }
            let stats = relay.stats();
            assert_eq!(
                stats.malformed,
                0,
                "relay {} at {:?}",
                relay.index(),
                self.now
            );
        }
    }
}

fn is_finite(place: Placement) -> bool {
    [place.x_m, place.y_m, place.altitude_m]
        .iter()
        .all(|m| m.is_finite())
}
