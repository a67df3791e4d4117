//! The relay itself: where it is to be, where it was told to fly, where it may be by now.

use super::config::GuardConfig;
use super::reachable::ReachableInterval;
use crate::place::{CrossSection, Placement};
use crate::time::Instant;

/// What both fences go by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Own {
    pub(super) config: GuardConfig,
    /// The number of its node.
    node: u16,
    /// Where it was agreed to be, inside the box.
    pub(super) target: Option<Placement>,
    pub(super) setpoint: Option<Placement>,
    pub(super) reachable: ReachableInterval,
    /// When the setpoint changed across the line.
    turned: Instant,
    /// Whether it has arrived there across the line.
    pub(super) still: bool,
    /// Whether the chain is to open, by what is known here.
    pub(super) open: bool,
    /// True while this relay stays where it is, because it or another one is not in order with its neighbours.
    pub(super) halted: bool,
    /// Place reported last.
    pub(super) reported: Option<Placement>,
    /// Last setpoint at which this relay arrived, or the one that it began with. It is on its way from there, so it stops no farther
    /// outside the box than that.
    left: Placement,
}

impl Own {
    pub(super) const fn new(config: GuardConfig, node: u16, now: Instant) -> Self {
        Self {
            config,
            node,
            target: None,
            setpoint: None,
            reachable: ReachableInterval::unknown(now),
            turned: now,
            still: false,
            open: false,
            halted: true,
            reported: None,
            left: Placement::on_line(0.0, 0.0),
        }
    }

    /// The next setpoint.
    pub(super) fn go(&mut self, setpoint: Placement, now: Instant) {
        if self.across() != setpoint.cross_section() {
            self.turned = now;
            self.still = false;
        }
        self.setpoint = Some(setpoint);
    }

    /// It is not flown to its setpoints any more, or again: there is none, and it may be anywhere.
    pub(super) const fn release(&mut self, now: Instant) {
        self.setpoint = None;
        self.reachable = ReachableInterval::unknown(now);
        (self.turned, self.still) = (now, false);
        (self.open, self.halted) = (false, true);
    }

    /// Halts the relay, or ends that. A relay that halts on its way stops where it was reported last: its own stretch holds that place.
    pub(super) fn halt(&mut self, halted: bool, now: Instant) {
        let begins = halted && !self.halted;
        self.halted = halted;
        if let Some(mut stop) = self.setpoint.filter(|_| begins)
            && let Some(reported) = self.reported
        {
            let ReachableInterval { low_m, high_m, .. } = self.reachable;
            let reported = self.config.cut_toward(reported, self.left);
            if !self.reachable.is_still() {
                stop.x_m = reported.x_m.max(low_m).min(high_m);
            }
            if !self.still {
                stop = reported.cross_section().at(stop.x_m);
            }
            self.reachable.go(stop.x_m, now);
            self.go(stop, now);
        }
    }

    /// Begins with the setpoint `place`.
    pub(super) fn begin(&mut self, place: Placement, now: Instant) {
        self.left = place;
        self.go(place, now);
    }

    /// It was at `place` at time `at`: across the line it has arrived if that was long enough after it was told to go there.
    pub(super) fn report(&mut self, at: Instant, place: Placement) {
        self.still |= at >= self.turned + self.config.lag
            && self.is_near(place.cross_section(), self.across());
        if let Some(setpoint) = self.setpoint.filter(|_| self.still) {
            self.left = setpoint;
        }
    }

    /// Whether `is` is `to_be` but for what a relay hovers off.
    fn is_near(&self, is: CrossSection, to_be: CrossSection) -> bool {
        let most = self.config.hover_m + self.config.rounding();
        (is.y_m - to_be.y_m).abs() <= most && (is.altitude_m - to_be.altitude_m).abs() <= most
    }

    /// Where it was told to fly across the line.
    pub(super) fn across(&self) -> CrossSection {
        self.setpoint.unwrap_or_default().cross_section()
    }

    /// Whether that is where it is to be.
    pub(super) fn is_across(&self) -> bool {
        self.target
            .is_none_or(|target| target.cross_section() == self.across())
    }

    /// Where it was agreed to be, m along x.
    pub(super) fn target_m(&self) -> f32 {
        self.target.unwrap_or_default().x_m
    }

    /// Where it is to be for now, m along x.
    pub(super) fn goal_m(&self) -> f32 {
        self.goal_of(self.node, self.target_m())
    }

    /// Where `node` is to be for now that was agreed to be at `target_m`.
    pub(super) fn goal_of(&self, node: u16, target_m: f32) -> f32 {
        if self.open {
            self.config.open_place(node, target_m)
        } else {
            target_m
        }
    }

    /// Whether places with this step between them are closer along x than the separation.
    pub(super) fn is_close(&self, step_m: f32) -> bool {
        step_m < self.config.separation_m - self.config.rounding()
    }
}
