//! Hop with a fixed sender: the SIR as a function of the receiver's position, and bisections on it.

use super::link::{Link, meets, received_w};

/// Number of bisection steps. Any f64 interval needs fewer steps until its ends are adjacent numbers.
const HALVINGS: usize = 200;

/// Hop from a fixed sender to a relay.
///
/// The sender is Tx or the previous relay. The argument `x` of the methods is the x of the receiving relay, m.
pub(super) struct Hop<'a> {
    link: &'a Link,
    sender_w: f64,
    sender_factor: f64,
    sender_x: f64,
    sender_h: f64,
    own_h: f64,
}

impl<'a> Hop<'a> {
    /// Creates the hop to relay `k`, 1 to N, from the previous relay at `from_x`. For `k` = 1, Tx at 0 sends.
    pub(super) fn new(link: &'a Link, k: usize, from_x: f64) -> Option<Self> {
        let before = k.checked_sub(1)?;
        let own_h = link.relays.get(before)?.altitude_m;
        Some(
            match before.checked_sub(1).and_then(|i| link.relays.get(i)) {
                None => Self {
                    link,
                    sender_w: link.tx_w,
                    sender_factor: link.eta,
                    sender_x: 0.0,
                    sender_h: 0.0,
                    own_h,
                },
                Some(sender) => Self {
                    link,
                    sender_w: sender.power_w,
                    sender_factor: link.mu_los,
                    sender_x: from_x,
                    sender_h: sender.altitude_m,
                    own_h,
                },
            },
        )
    }

    /// Returns the hop's linear SIR, with the receiver at `x`: signal / (interference + noise).
    pub(super) fn sir(&self, x: f64) -> f64 {
        let signal = received_w(
            self.sender_w,
            self.sender_factor,
            x - self.sender_x,
            0.0,
            self.own_h - self.sender_h,
        );
        let link = self.link;
        signal / (self.interference_w(x) + link.noise_w)
    }

    fn interference_w(&self, x: f64) -> f64 {
        let link = self.link;
        received_w(
            link.interferer_w,
            link.eta,
            x - link.x_i,
            link.y_i,
            self.own_h,
        )
    }

    pub(super) fn meets(&self, x: f64, target: f64) -> bool {
        meets(self.sir(x), target)
    }

    /// Returns a value with the sign of the SIR's slope along `x`. Its zeros are the extrema of the SIR.
    ///
    /// For `x` greater than the sender's x, the value is a concave function of `x` (see [`super`]) and has at most two
    /// zeros.
    fn rise(&self, x: f64) -> f64 {
        let (dx, dh) = (x - self.sender_x, self.own_h - self.sender_h);
        let (ix, iy, ih) = (x - self.link.x_i, self.link.y_i, self.own_h);
        let (l, s) = (dx * dx + dh * dh, ix * ix + iy * iy + ih * ih);
        let interference_w = self.interference_w(x);
        let louder = 1.0 + self.link.noise_w / interference_w;
        // ix / (s louder) - dx / l, times l s louder / dx.
        ix * l / dx - s * louder
    }

    fn rises(&self, x: f64) -> bool {
        // At the sender's own position and altitude the SIR is infinite, so it falls from there on.
        if x > self.sender_x {
            self.rise(x) > 0.0
        } else {
            self.link.x_i < x && self.own_h.total_cmp(&self.sender_h).is_ne()
        }
    }

    /// Returns the x, m, of the SIR's extrema from `low` to `high`, ascending.
    ///
    /// There are at most two extrema; between them the SIR is monotone. `low` must not be less than the sender's x. The
    /// cost is about 60 evaluations of the slope, or about 300 with receiver noise.
    pub(super) fn turns(&self, low: f64, high: f64) -> Vec<f64> {
        let (first, last) = (self.rises(low), self.rises(high));
        let sign = |from: f64, to: f64| bisect(from, to, |x| self.rises(x) == self.rises(from));
        if first != last {
            return vec![sign(low, high)];
        }
        if first || !(self.link.noise_w > 0.0) {
            return Vec::new();
        }
        // The SIR may rise in between, around the maximum of a concave function.
        let (mut from, mut to) = (low, high);
        for _ in 0..HALVINGS {
            let third = (to - from) / 3.0;
            let (a, b) = (from + third, to - third);
            if self.rise(a) < self.rise(b) {
                from = a;
            } else {
                to = b;
            }
        }
        let top = from.midpoint(to);
        if self.rises(top) {
            vec![sign(low, top), sign(top, high)]
        } else {
            Vec::new()
        }
    }

    pub(super) fn peak(&self, low: f64, high: f64) -> f64 {
        let turns = self.turns(low, high);
        let ends = self.sir(low).max(self.sir(high));
        turns.iter().fold(ends, |most, &x| most.max(self.sir(x)))
    }
}

/// Returns the last x, m, from `inside` toward `outside` at which `holds` is still true.
///
/// `outside` may be smaller than `inside`. `holds` must be true at `inside` and false at `outside`, with a single
/// change between them. At the f64 number next to the result, toward `outside`, `holds` is false.
pub(super) fn bisect(mut inside: f64, mut outside: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = inside.midpoint(outside);
        if middle.total_cmp(&inside).is_eq() || middle.total_cmp(&outside).is_eq() {
            break;
        }
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}
