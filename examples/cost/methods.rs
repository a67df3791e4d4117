//! Cost of every call while three relays fly each method.

use cortex_m_semihosting::hprintln;
use uav_relay::{Adjust, Instant, MAX_FRAME, Method, Mission, Phase, Port, Relay, Settings};

use super::counter::{instructions, relay};
use super::missions::{HIGH, UNEVEN};

/// Simulated chain of three relays that records the instructions of the most expensive call.
pub(crate) struct Flight {
    relays: heapless::Vec<Relay, 3>,
    /// Number of instructions of the most expensive call of a relay's function so far.
    most: u32,
    /// Length of the longest frame sent so far, bytes.
    longest: usize,
}

impl Flight {
    fn new(mission: Mission, settings: Settings) -> Self {
        let mut relays = heapless::Vec::new();
        for index in [1, 2, 3] {
            // Creates one relay at a time, to save stack.
            _ = relays.push(relay(index, settings, mission));
        }
        Self {
            relays,
            most: 0,
            longest: 0,
        }
    }

    fn drain(&mut self, at: usize, now: Instant) {
        let mut frame = [0; MAX_FRAME];
        loop {
            let Some(sender) = self.relays.get_mut(at) else {
                return;
            };
            let mut sent = None;
            let cost = instructions(|| sent = sender.poll_transmit(now, &mut frame));
            self.most = self.most.max(cost);
            let Some(transmit) = sent else { return };
            self.longest = self.longest.max(transmit.len);
            let (to, port) = match transmit.port {
                Port::Upstream => (at.wrapping_sub(1), Port::Downstream),
                _ => (at + 1, Port::Upstream),
            };
            let bytes = frame.get(..transmit.len).unwrap_or_default();
            if let Some(receiver) = self.relays.get_mut(to) {
                let cost = instructions(|| receiver.handle_bytes(now, port, bytes));
                self.most = self.most.max(cost);
            }
        }
    }

    /// Runs the chain until all relays hold their agreed positions; returns true if they do.
    ///
    /// The run ends after `turns` rounds in any case. Each round delivers the pending frames and handles the next
    /// timers.
    fn run_until_holding(&mut self, turns: u32) -> bool {
        let mut now = Instant::ZERO;
        for _ in 0..turns {
            // Timers and frames of all relays are handled in both orders, so that replies are delivered.
            for at in [0, 1, 2, 1, 0] {
                self.drain(at, now);
            }
            if self
                .relays
                .iter()
                .all(|relay| relay.phase() == Phase::Holding)
            {
                return true;
            }
            let Some(next) = self.relays.iter().filter_map(Relay::poll_timeout).min() else {
                continue;
            };
            now = next;
            for relay in &mut self.relays {
                if relay.poll_timeout().is_some_and(|at| at <= now) {
                    let cost = instructions(|| relay.handle_timeout(now));
                    self.most = self.most.max(cost);
                }
            }
        }
        false
    }
}

/// Result of a simulated chain.
///
/// `settled` is 1 if all relays hold their agreed positions. `most` is the number of instructions of the most expensive
/// call, `longest` the length of the longest frame, bytes.
struct Flown {
    settled: u32,
    most: u32,
    longest: usize,
}

/// Runs one chain to its end. The function is not inlined, because the stack has room for one chain only.
#[inline(never)]
fn fly(mission: Mission, settings: Settings) -> Flown {
    let mut flight = Flight::new(mission, settings);
    Flown {
        settled: u32::from(flight.run_until_holding(20_000)),
        most: flight.most,
        longest: flight.longest,
    }
}

#[inline(never)]
pub(crate) fn methods() {
    let settings = Settings {
        predict: false,
        ..Settings::default()
    };
    let joint = fly(
        HIGH,
        Settings {
            method: Method::Joint,
            ..settings
        },
    );
    hprintln!("joint_settled {}", joint.settled);
    hprintln!("joint {}", joint.most);
    hprintln!("joint_bytes {}", joint.longest);
    let predicted = fly(
        HIGH,
        Settings {
            method: Method::Joint,
            ..Settings::default()
        },
    );
    hprintln!("predicted_settled {}", predicted.settled);
    hprintln!("predicted {}", predicted.most);
    let adjust = Adjust {
        rounds: 2,
        ..Adjust::default()
    };
    let turns = fly(
        HIGH,
        Settings {
            method: Method::Adjust(adjust),
            ..settings
        },
    );
    hprintln!("adjust_settled {}", turns.settled);
    hprintln!("adjust {}", turns.most);
    let field = fly(UNEVEN, Settings::default());
    hprintln!("field_settled {}", field.settled);
    hprintln!("field {}", field.most);
}
