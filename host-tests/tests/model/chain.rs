//! The connected relays and the clock; the rules are checked after every turn of a main loop.

use proptest::prop_assert;
use uav_relay::MAX_FRAME;
use uav_relay::Phase;
use uav_relay::{Duration, Event, Instant, Port, Relay, Side};

use super::Checked;
use super::accepted_frames::{EpochPair, accepted_count};
use super::ledger::{Ledger, MOST_FRAMES, Turn};
use super::passes::PassClass;
use super::scenario::{Kind, Scenario};
use super::tally::Tally;
use super::wires::{FLIGHT, Flying, Wires, end, message, pass};

/// Relative error by which f32 rounding may make a hop miss its target SIR.
pub(crate) const MISS: f64 = 2e-4;

/// Relative error by which f32 rounding may make neighbours closer than the minimum separation.
const CLOSE: f64 = 1e-5;

/// Chain of real relays under test, with its clock and a model of each relay.
pub(crate) struct World<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) now: Instant,
    pub(crate) relays: Vec<Relay>,
    pub(crate) wires: Wires,
    pub(crate) ledgers: Vec<Ledger>,
    pub(crate) tally: Tally,
    /// Largest epoch that any relay has had so far. An epoch is a number that rises at each start of a relay.
    pub(crate) epochs: u32,
}

impl<'a> World<'a> {
    /// Creates a chain of relays that have just been switched on. The seeds of the relays follow from `seed`.
    pub(crate) fn new(scenario: &'a Scenario, seed: u32) -> Checked<Self> {
        let now = Instant::from_millis(1);
        let relays = scenario.relays();
        let mut world = Self {
            scenario,
            now,
            relays: (0..relays)
                .map(|at| scenario.relay(at, seed.wrapping_add(at as u32), at as u32 + 1, now))
                .collect(),
            wires: Wires::new(relays),
            ledgers: (1..=relays).map(|at| Ledger::new(now, at as u32)).collect(),
            tally: Tally::default(),
            epochs: relays as u32,
        };
        world.turn_all()?;
        Ok(world)
    }

    /// Runs the main loop of relay `at` (from 0) once: timers, frames, events and next wake-up time. The model checks
    /// all outputs.
    pub(crate) fn turn(&mut self, at: usize) -> Checked {
        let now = self.now;
        let relay = &mut self.relays[at];
        relay.handle_timeout(now);
        let mut frame = [0; MAX_FRAME];
        let mut sent = 0;
        self.ledgers[at].check_view(relay)?;
        // A firmware stores the record before the votes leave.
        let record = relay.unpersisted();
        self.ledgers[at].record = record.or(self.ledgers[at].record);
        let most = MOST_FRAMES + if self.scenario.signs() { 2 } else { 0 };
        relay.persist(|_| true);
        while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
            sent += 1;
            prop_assert!(sent <= most, "relay {} sends and sends", at + 1);
            let bytes = frame[..transmit.len].to_vec();
            if let Some(pass) = pass(&bytes) {
                let leads = at == self.scenario.leader();
                self.ledgers[at].check_sent(self.scenario, leads, pass)?;
            }
            let (to, side) = match transmit.port {
                Port::Upstream => (at - 1, Side::Upstream),
                _ => (at + 1, Side::Downstream),
            };
            if let Some(message) = message(&bytes) {
                self.ledgers[at].on_sent(side, &message, now);
            }
            let frame = Flying {
                due: now + FLIGHT,
                seal: EpochPair {
                    from: self.ledgers[at].epoch,
                    to: self.ledgers[to].epoch,
                },
                bytes,
            };
            self.wires.send(at, transmit.port, frame);
        }
        let events: Vec<_> = std::iter::from_fn(|| relay.poll_event()).collect();
        prop_assert!(
            relay.poll_timeout().is_none_or(|at| at > now),
            "relay {} asks for the next call without an advance of time (endless loop)",
            at + 1
        );
        self.tally.most("frames of a drain", u64::from(sent));
        let measured = self
            .ledgers
            .iter()
            .filter_map(|ledger| ledger.measured_per_w);
        let turn = Turn {
            now,
            measured_per_w: measured.reduce(f64::max),
            relay: &self.relays[at],
            sent,
            events: &events,
        };
        let missed = events
            .iter()
            .filter(|event| matches!(event, Event::NeighbourLost { .. }));
        missed.for_each(|_| self.tally.add("neighbours missed"));
        if events.contains(&Event::ViewAccepted) {
            self.tally.add("views agreed on");
        }
        if self.ledgers[at].audit(self.scenario, at, &turn)? {
            self.neighbours_agree()?;
        }
        Ok(())
    }

    pub(crate) fn turn_all(&mut self) -> Checked {
        (0..self.relays.len()).try_for_each(|at| self.turn(at))
    }

    /// Checks each pair of neighbours that have agreed positions for the same target SIR.
    ///
    /// Their separation must be kept, and the hop between them must meet the target.
    fn neighbours_agree(&mut self) -> Checked {
        let places: Vec<_> = self.ledgers.iter().map(|ledger| ledger.place).collect();
        let hops = self.scenario.reference.hops(&places);
        let apart = f64::from(self.scenario.mission.config().min_separation_m) * (1.0 - CLOSE);
        let last = self.ledgers.len();
        for (hop, sir) in hops.into_iter().enumerate() {
            // Tx and Rx have no target: the target of the hop is that of their one neighbour.
            let from = &self.ledgers[hop.saturating_sub(1)];
            let to = &self.ledgers[hop.min(last - 1)];
            let Some(target) = from.target.filter(|_| {
                from.holding
                    && to.holding
                    && from.target.map(f32::to_bits) == to.target.map(f32::to_bits)
            }) else {
                continue;
            };
            let (Some(before), Some(after)) = (from.place, to.place) else {
                continue;
            };
            let is_between = hop > 0 && hop < last;
            // Where relays measure, passes go toward Tx: relay `to` forwards them to `from`.
            let measures = self.scenario.kind == Kind::Measured;
            if is_between && measures && to.repeats_first_pass() {
                self.tally.add("hops excused");
                continue;
            }
            let louder = to
                .measured_per_w
                .filter(|_| hop < last)
                .map_or(1.0, |measured| {
                    self.scenario
                        .reference
                        .sir_ratio(after.x_m, measured)
                        .max(1.0)
                });
            prop_assert!(
                sir * louder >= f64::from(target) * (1.0 - MISS),
                "hop {}: {sir} short of {target}",
                hop + 1
            );
            self.tally.add("hops held");
            if is_between {
                let (dx, dh) = (after.x_m - before.x_m, after.altitude_m - before.altitude_m);
                prop_assert!(
                    dx >= 0.0 && dx.hypot(dh) >= apart,
                    "relays {hop} and {} at {before:?} and {after:?}",
                    hop + 1
                );
            }
        }
        Ok(())
    }

    /// Delivers bytes of a frame to the receiver of `line`, then runs the receiver's main loop. A line is one
    /// direction of a link.
    pub(crate) fn arrive(&mut self, line: usize, bytes: &[u8], frame: &Flying) -> Checked {
        self.deliver_and_check(line, bytes, frame)?;
        self.turn(end(line).0)
    }

    /// Delivers bytes of a frame to the receiver of `line`, one direction of a link.
    ///
    /// If the bytes complete a pass (a round of messages along the chain), the model checks how the relay's statistics
    /// count this pass.
    pub(crate) fn deliver_and_check(
        &mut self,
        line: usize,
        bytes: &[u8],
        frame: &Flying,
    ) -> Checked {
        let (to, port) = end(line);
        let from = match port {
            Port::Upstream => Side::Upstream,
            _ => Side::Downstream,
        };
        let ended = self.wires.arrive(line, bytes, &frame.bytes);
        let before = *self.relays[to].stats();
        let stands = self.relays[to].setpoint().is_some();
        let suspended = self.relays[to].phase() == Phase::ViewChange;
        self.relays[to].handle_bytes(self.now, port, bytes);
        let after = self.relays[to].stats();
        let is_taken = accepted_count(after) > accepted_count(&before);
        let known = (&self.scenario.settings[to], self.scenario.relays());
        self.ledgers[to].on_received(from, ended, is_taken.then_some(frame), known, self.now)?;
        if let Some(pass) = pass(&frame.bytes).filter(|_| is_taken) {
            let met = self.ledgers[to].check_received(
                self.scenario,
                pass,
                stands,
                suspended,
                &before,
                after,
            )?;
            self.tally.add(match met {
                PassClass::Accepted => "passes taken up",
                PassClass::Again => "passes again",
                PassClass::Late => "stragglers",
                PassClass::Foreign => "foreign passes",
            });
        }
        self.ledgers[to].check_view(&self.relays[to])
    }

    fn next_timer(&self) -> Option<Instant> {
        self.relays.iter().filter_map(Relay::poll_timeout).min()
    }

    pub(crate) fn tick(&mut self) -> Checked {
        let next = self.next_timer();
        prop_assert!(next.is_some(), "nobody will ever do anything");
        self.now = next.unwrap_or(self.now).max(self.now);
        for at in 0..self.relays.len() {
            if self.relays[at]
                .poll_timeout()
                .is_some_and(|due| due <= self.now)
            {
                self.turn(at)?;
            }
        }
        Ok(())
    }

    pub(crate) fn wait(&mut self, time: Duration) -> Checked {
        let until = self.now + time;
        while self.next_timer().is_some_and(|next| next <= until) {
            self.tick()?;
        }
        self.now = until;
        Ok(())
    }

    /// Processes the next frame or timer in order of time. Returns false if there is none by `until`.
    pub(crate) fn flow(&mut self, until: Instant) -> Checked<bool> {
        let timer = self.next_timer();
        match self.wires.next() {
            Some((due, line)) if due <= until && timer.is_none_or(|timer| due <= timer) => {
                self.now = self.now.max(due);
                self.wires.hurry(self.now);
                if let Some(frame) = self.wires.take(line, 0) {
                    self.arrive(line, &frame.bytes, &frame)?;
                }
                Ok(true)
            }
            _ if timer.is_some_and(|timer| timer <= until) => self.tick().map(|()| true),
            _ => Ok(false),
        }
    }

    /// Returns true if every relay has an agreed position, all for the same target SIR.
    pub(crate) fn agrees(&self) -> bool {
        let target = self.ledgers[0].target.map(f32::to_bits);
        self.ledgers
            .iter()
            .all(|ledger| ledger.holding && ledger.target.map(f32::to_bits) == target)
    }
}
