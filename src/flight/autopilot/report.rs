//! What the operator reads on a ground station: lines, and numbers to plot.

use heapless::{Deque, String};

use crate::event::Event;
use crate::flight::mavlink::outgoing::Outgoing;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// A line, and how much it matters.
type Line = (u8, String<50>);

/// Lines that wait.
const LINES: usize = 3;

/// From one round of numbers to the next.
const PERIOD: Duration = Duration::from_millis(1_000);

const NAMES: [&str; 4] = ["sir_db", "relay_x", "relay_y", "relay_h"];

/// What the operator reads of an event of the relay.
pub(super) const fn line_of(event: Event) -> Option<&'static str> {
    Some(match event {
        Event::Converged => "relay: the chain has agreed on places",
        Event::Infeasible => "relay: no places meet any target",
        Event::NeighbourLost { .. } => "relay: a neighbour is lost",
        Event::Reformed => "relay: the chain formed anew",
        Event::NoQuorum => "relay: too few others, holds its place",
        Event::LeaseLapsed => "relay: not certain of the others, holds",
        Event::UploadRefused { .. } => "relay: refused a mission without a line",
        Event::IndexTaken { .. } => "relay: its number is used twice",
        _ => return None,
    })
}

/// Lines and numbers that have not been sent yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Report {
    lines: Deque<Line, LINES>,
    values: [Option<f32>; NAMES.len()],
    /// How many of the values have been sent in this round.
    sent: usize,
    again_at: Option<Instant>,
}

impl Report {
    /// Has a line sent; whether there was room for it.
    pub(super) fn say(&mut self, severity: u8, text: &str) -> bool {
        let mut line = String::new();
        for character in text.chars() {
            if line.push(character).is_err() {
                break;
            }
        }
        self.lines.push_back((severity, line)).is_ok()
    }

    /// The numbers from now on.
    pub(super) fn values(&mut self, now: Instant, sir_db: Option<f32>, place: Option<Placement>) {
        let [x, y, h] = match place {
            Some(place) => [place.x_m, place.y_m, place.altitude_m].map(Some),
            None => [None; 3],
        };
        self.values = [sir_db, x, y, h].map(|value| value.filter(|value| value.is_finite()));
        if self.again_at.is_none() {
            self.again_at = Some(now);
        }
    }

    /// The next of them, encoded by `encode`.
    pub(super) fn take<T>(
        &mut self,
        now: Instant,
        boot_ms: u32,
        encode: impl FnOnce(Outgoing<'_>) -> T,
    ) -> Option<T> {
        if let Some((severity, text)) = self.lines.pop_front() {
            return Some(encode(Outgoing::StatusText {
                severity,
                text: &text,
            }));
        }
        if self.again_at.is_none_or(|at| at > now) {
            return None;
        }
        let left = self.values.into_iter().zip(NAMES).skip(self.sent);
        for (value, name) in left {
            self.sent += 1;
            if let Some(value) = value {
                return Some(encode(Outgoing::NamedValue {
                    boot_ms,
                    name,
                    value,
                }));
            }
        }
        self.sent = 0;
        self.again_at = Some(now + PERIOD);
        None
    }

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.again_at
    }
}
