//! One hop with its sender held still: the SIR as a function of the receiver's place, and bisections on it.

use super::link::{Link, meets, received_w};

/// Halvings after which any f64 interval in metres has collapsed to neighbours, with room to spare.
const HALVINGS: usize = 200;

/// A hop that ends at a relay; `x` in its methods is that relay's place in metres.
pub(super) struct Hop<'a> {
    link: &'a Link,
    sender_w: f64,
    sender_factor: f64,
    sender_x: f64,
    sender_h: f64,
    own_h: f64,
}

impl<'a> Hop<'a> {
    /// Hop `k` in 1..=N with relay k-1 at `from_x`; hop 1 is sent from Tx at 0.
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

    /// Received power over received interference (linear).
    pub(super) fn sir(&self, x: f64) -> f64 {
        let signal = received_w(
            self.sender_w,
            self.sender_factor,
            x - self.sender_x,
            0.0,
            self.own_h - self.sender_h,
        );
        let link = self.link;
        signal
            / received_w(
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

    /// Sign of the SIR's slope: each path loss grows at the relative rate 2 dx / distance^2.
    fn rises(&self, x: f64) -> bool {
        let (dx, dh) = (x - self.sender_x, self.own_h - self.sender_h);
        let (ix, iy, ih) = (x - self.link.x_i, self.link.y_i, self.own_h);
        // NaN (receiver on top of its sender, where the SIR is infinite) compares as false: from there it only falls.
        ix / (ix * ix + iy * iy + ih * ih) > dx / (dx * dx + dh * dh)
    }

    /// The turning point of the SIR between `low` and `high`, both at or past the sender, or `high` if there is none.
    ///
    /// The SIR is monotone from `low` to the returned place and from there to `high`. About 60 slope evaluations.
    pub(super) fn turn(&self, low: f64, high: f64) -> f64 {
        let first = self.rises(low);
        if first == self.rises(high) {
            return high;
        }
        bisect(low, high, |x| self.rises(x) == first)
    }

    /// The largest SIR between `low` and `high`, both at or past the sender.
    pub(super) fn peak(&self, low: f64, high: f64) -> f64 {
        let turn = self.turn(low, high);
        self.sir(low).max(self.sir(high)).max(self.sir(turn))
    }
}

/// The last place on the way from `inside` to `outside` (either direction, metres) at which `holds` is still true.
///
/// `holds` is taken to be true at `inside`, false at `outside`, and to change once. Exact to neighbouring f64 values.
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
