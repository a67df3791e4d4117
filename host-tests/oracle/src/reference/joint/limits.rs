//! Constraints of a chain, with slopes and curvatures.
//!
//! A hop's SIR is a constant times (receiver to interferer)^2 / (sender to receiver)^2, at Rx a constant over (sender to Rx)^2.
//! Its logarithm is a sum of logarithms of squared distances, with the derivatives of ln(q), q = d^2: slope 2 d / q, curvature
//! 2 I / q - 4 d d^T / q^2. With noise the first of them is ln(q / w), w = 1 + nu q: slope 2 d / (q w), curvature
//! 2 I / (q w) - (1 + 2 nu q) (2 d / (q w)) (2 d / (q w))^T.

use super::scene::Scene;
use super::space::{Square, Triple};

/// A multiple of ln(d^2) with its slope and curvature by d.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Log {
    value: f64,
    slope: Triple,
    /// Curvature: `even` times the identity less `sharp` times the outer square of the slope.
    even: f64,
    sharp: f64,
}

impl Log {
    fn of(d: Triple, factor: f64) -> Self {
        let q = d.dot(d);
        Self {
            value: factor * q.ln(),
            slope: d * (2.0 * factor / q),
            even: 2.0 * factor / q,
            sharp: factor.recip(),
        }
    }

    /// Returns ln(q / (1 + nu q)).
    fn in_noise(d: Triple, noise: f64) -> Self {
        let q = d.dot(d);
        let w = 1.0 + noise * q;
        Self {
            value: (q / w).ln(),
            slope: d * (2.0 / (q * w)),
            even: 2.0 / (q * w),
            sharp: 1.0 + 2.0 * noise * q,
        }
    }

    pub(super) fn curvature(&self) -> Square {
        Square::even(self.even) - Square::outer(self.slope, self.slope) * self.sharp
    }

    /// Returns half the curvature along a step: the second-order part of the change.
    fn bend(&self, step: Triple) -> f64 {
        0.5 * (self.even * step.dot(step) - self.sharp * self.slope.dot(step).powi(2))
    }
}

/// A constraint `value` >= 0 on a relay and its predecessor. A hop's ln SIR over the target, or a margin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limit {
    pub(super) relay: usize,
    pub(super) value: f64,
    pub(super) own: Triple,
    pub(super) before: Triple,
    /// Slope by the target: -1 for hops, 0 for margins.
    pub(super) target: f64,
    /// Curved part that depends on the step from the predecessor to this relay.
    pub(super) leap: Log,
    /// Curved part that depends on the relay's own position alone.
    pub(super) alone: Log,
}

impl Limit {
    fn margin(relay: usize, value: f64, own: Triple, before: Triple) -> Self {
        Self {
            relay,
            value,
            own,
            before,
            target: 0.0,
            leap: Log::default(),
            alone: Log::default(),
        }
    }

    /// Creates a curved constraint: `value` plus both logarithms, less `target` if given.
    fn curved(relay: usize, value: f64, leap: Log, alone: Log, target: Option<f64>) -> Self {
        Self {
            relay,
            value: value + leap.value + alone.value - target.unwrap_or(0.0),
            own: leap.slope + alone.slope,
            before: -leap.slope,
            target: if target.is_some() { -1.0 } else { 0.0 },
            leap,
            alone,
        }
    }

    /// Returns the first-order change for steps of the relay, its predecessor and the target.
    pub(super) fn change(&self, own: Triple, before: Triple, raise: f64) -> f64 {
        self.own.dot(own) + self.before.dot(before) + self.target * raise
    }

    /// Returns the second-order part of the change.
    pub(super) fn bend(&self, own: Triple, before: Triple) -> f64 {
        self.leap.bend(own - before) + self.alone.bend(own)
    }
}

/// Returns the constraints of a chain whose ln SIR must exceed `target`.
pub(super) fn limits(scene: &Scene, places: &[Triple], target: f64) -> Vec<Limit> {
    let mut limits = Vec::with_capacity(7 * places.len() + 2);
    let mut from = Triple::default();
    let none = Triple::default();
    let (ahead, aside, up) = (
        Triple::new(1.0, 0.0, 0.0),
        Triple::new(0.0, 1.0, 0.0),
        Triple::new(0.0, 0.0, 1.0),
    );
    let relays = scene.hops.iter().zip(&scene.rooms).zip(places).enumerate();
    for (relay, ((&constant, room), &place)) in relays {
        let leap = place - from;
        limits.push(Limit::curved(
            relay,
            constant,
            Log::of(leap, -1.0),
            Log::in_noise(place - scene.interferer, scene.noise),
            Some(target),
        ));
        limits.push(Limit::margin(relay, leap.x, ahead, -ahead));
        let free = room.free();
        if free.y > 0.0 {
            limits.push(Limit::margin(relay, place.y - room.low.y, aside, none));
            limits.push(Limit::margin(relay, room.high.y - place.y, -aside, none));
        }
        if free.h > 0.0 {
            limits.push(Limit::margin(relay, place.h - room.low.h, up, none));
            limits.push(Limit::margin(relay, room.high.h - place.h, -up, none));
        }
        if relay > 0 && scene.apart > 0.0 {
            // In logarithmic form the margin has the same scale as those of the hops.
            limits.push(Limit::curved(
                relay,
                -2.0 * scene.apart.ln(),
                Log::of(leap, 1.0),
                Log::default(),
                None,
            ));
        }
        if relay + 1 == scene.len() {
            limits.push(Limit::margin(relay, 1.0 - place.x, -ahead, none));
            limits.push(Limit::curved(
                relay,
                scene.last,
                Log::default(),
                Log::of(place - ahead, -1.0),
                Some(target),
            ));
        }
        from = place;
    }
    limits
}
