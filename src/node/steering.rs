//! The setpoint on its way to the agreed place: with a [guard](crate::guard) as far as is safe by now, without one the place itself.

use super::context::Effects;
#[cfg(feature = "upload")]
use crate::guard::config::Geofence;
use crate::guard::{Fence, Guard, HoldReason};
use crate::place::Placement;
use crate::settings::Settings;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// How long after the guard has said something it is said again, unless the neighbour is known to have heard it.
const REMINDER: Duration = Duration::from_millis(1_000);

/// Whether this crate was built to guard setpoints.
const GUARD: bool = cfg!(feature = "guard");

/// What moves the setpoint of one relay.
#[derive(Clone, Debug)]
pub(crate) struct Steering {
    guard: Option<Guard>,
    remind_at: Option<Instant>,
    /// The setpoint that the firmware was told of last.
    told: Option<Placement>,
}

impl Steering {
    /// Before it has begun.
    pub(crate) const NONE: Self = Self {
        guard: None,
        remind_at: None,
        told: None,
    };

    /// With the guard that `settings` ask for, of a relay with these neighbours.
    #[inline(never)] // a guard is built on the stack
    pub(crate) fn begin(
        &mut self,
        settings: &Settings,
        neighbours: [Option<u16>; 2],
        seed: u32,
        now: Instant,
    ) {
        let config = settings.guard.filter(|_| GUARD);
        self.guard = config.map(|config| Guard::new(config, neighbours, seed, now));
    }

    fn guard(&mut self) -> Option<&mut Guard> {
        self.guard.as_mut().filter(|_| GUARD)
    }

    /// Moves the setpoint as far toward `agreed` as it may go by what is known at `now`; whether it has a new value.
    pub(crate) fn steer(&mut self, now: Instant, agreed: Option<Placement>) -> bool {
        if let Some(agreed) = agreed
            && let Some(guard) = self.guard()
        {
            let known = guard.is_for(agreed);
            if !known {
                guard.commit(agreed);
            }
            guard.steer(now);
            if !known {
                self.remind_at = Some(now + REMINDER);
            }
        }
        let setpoint = self.setpoint(agreed);
        let changed = setpoint != self.told;
        self.told = setpoint;
        changed
    }

    /// Where to fly now.
    pub(crate) fn setpoint(&self, agreed: Option<Placement>) -> Option<Placement> {
        match &self.guard {
            Some(guard) if GUARD => guard.setpoint(),
            _ => agreed,
        }
    }

    /// Another node is taken for the neighbour at `side`.
    pub(crate) fn link(&mut self, side: Side, neighbour: Option<u16>) {
        if let Some(guard) = self.guard() {
            guard.link(side, neighbour);
        }
    }

    /// What the neighbour `from` at `side` says of the fence between the two.
    pub(crate) fn handle(&mut self, side: Side, from: u16, fence: &Fence) -> Effects {
        if let Some(guard) = self.guard() {
            guard.hear(side, from, fence);
        }
        Effects::NONE
    }

    /// Says again what may have been lost.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        if self.remind_at.is_some_and(|at| at <= now) {
            self.remind_at = None;
            if let Some(guard) = self.guard() {
                guard.remind();
                self.remind_at = Some(now + REMINDER);
            }
        }
    }

    /// Takes the control state from `now` on: true while the drone flies to the setpoints. Returns true if a guard did not know that state.
    pub(crate) fn control(&mut self, now: Instant, flown: bool) -> bool {
        let is_news = self.guard().is_some_and(|guard| guard.control(now, flown));
        if is_news {
            self.remind_at = Some(now + REMINDER);
        }
        is_news
    }

    /// Places are along another line, since `now` if the drone has flown along the one before.
    #[cfg(feature = "upload")]
    pub(crate) fn leave_line(&mut self, now: Option<Instant>) {
        if let Some(guard) = self.guard() {
            guard.leave_line(now);
        }
    }

    /// The box is `fence` from now on.
    #[cfg(feature = "upload")]
    pub(crate) fn set_box(&mut self, fence: Option<Geofence>) {
        if let Some(guard) = self.guard()
            && let Some(fence) = fence
        {
            guard.set_box(fence);
        }
    }

    /// The drone was at `place` at time `at`.
    pub(crate) fn position(&mut self, at: Instant, place: Placement) {
        if let Some(guard) = self.guard() {
            guard.position(at, place);
        }
    }

    /// Who fell silent at `side` is not in the air any more.
    pub(crate) fn clear_lost(&mut self, side: Side) {
        if let Some(guard) = self.guard() {
            guard.forget(side);
        }
    }

    /// What keeps the relay from its place at `side`.
    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.guard.as_ref().filter(|_| GUARD)?.hold_reason(side)
    }

    /// What there is to say of a fence: at which side, to which node.
    pub(crate) fn poll_transmit(&mut self) -> Option<(Side, u16, Fence)> {
        self.guard()?.poll()
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.remind_at
    }
}
