//! The setpoint on its way to the agreed place, where a [guard](crate::guard) is asked for.

use super::timers::Timer;
use super::{GUARD, Node};
use crate::event::Event;
use crate::guard::{Guard, HoldReason};
use crate::place::Placement;
use crate::settings::Settings;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// How long after the guard has said something it is said again, unless the neighbour is known to have heard it.
const REMINDER: Duration = Duration::from_millis(1_000);

/// The guard that `settings` ask for, of relay `index`, whose neighbour toward Rx is `after`, 0 for none.
pub(super) fn guard(
    settings: &Settings,
    index: u16,
    after: u16,
    seed: u32,
    now: Instant,
) -> Option<Guard> {
    let confines = settings.guard.filter(|_| GUARD)?;
    let neighbours = [index.saturating_sub(1), after].map(|node| Some(node).filter(|&n| n != 0));
    Some(Guard::new(confines, neighbours, seed, now))
}

impl Node {
    /// Moves the setpoint as far as it may go by what is known now.
    pub(super) fn steer(&mut self, now: Instant) {
        if !GUARD {
            return;
        }
        let agreed = self.agreed();
        let [before, after] = self.neighbours();
        let Some(guard) = &mut self.guard else { return };
        guard.link(Side::Upstream, before);
        guard.link(Side::Downstream, after);
        let Some(agreed) = agreed else { return };
        if guard.is_for(agreed) {
            return self.go(now);
        }
        guard.commit(agreed);
        self.timers.set(Timer::Remind, now + REMINDER);
        self.go(now);
    }

    fn go(&mut self, now: Instant) {
        let Some(guard) = &mut self.guard else { return };
        let before = guard.setpoint();
        if guard.steer(now) != before {
            self.pending.raise(Event::SetpointChanged);
        }
    }

    /// Says again what may have been lost.
    pub(super) fn remind(&mut self, now: Instant) {
        if GUARD && let Some(guard) = &mut self.guard {
            guard.remind();
            self.timers.set(Timer::Remind, now + REMINDER);
        }
    }

    /// The drone was at `place` at time `at`.
    pub(crate) fn handle_position(&mut self, now: Instant, at: Instant, place: Placement) {
        if GUARD && let Some(guard) = &mut self.guard {
            guard.position(at, place);
            self.steer(now);
        }
    }

    /// Who fell silent at `side` is not in the air any more.
    pub(crate) fn forget(&mut self, now: Instant, side: Side) {
        if GUARD && let Some(guard) = &mut self.guard {
            guard.forget(side);
            self.steer(now);
        }
    }

    /// Where to fly now.
    pub(crate) fn setpoint(&self) -> Option<Placement> {
        match &self.guard {
            Some(guard) if GUARD => guard.setpoint(),
            _ => self.agreed(),
        }
    }

    /// What keeps the relay from its place at `side`.
    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.guard.as_ref().filter(|_| GUARD)?.hold_reason(side)
    }
}
