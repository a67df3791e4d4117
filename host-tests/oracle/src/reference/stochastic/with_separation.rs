//! Best chain of relays that may differ, in any random interference and with any minimum separation.

use super::link::StochasticLink;

/// Disjoint intervals of x, m, in ascending order.
type Stretches = Vec<(f64, f64)>;

/// Returns the minimum of the convex function `value` from `low` to `high`, by ternary search.
fn least(low: f64, high: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (low, high);
    for _ in 0..80 {
        let (p, q) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if value(p) <= value(q) { b = q } else { a = p }
    }
    value(0.5 * (a + b)).min(value(low)).min(value(high))
}

fn joined(mut all: Stretches) -> Stretches {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out = Stretches::new();
    for (low, high) in all {
        match out.last_mut() {
            Some(last) if low <= last.1 => last.1 = last.1.max(high),
            _ => out.push((low, high)),
        }
    }
    out
}

impl StochasticLink {
    /// Returns the best expected SIR (linear) of all chains with relays at least `apart_m` apart.
    ///
    /// It computes all possible positions of each relay from those of the next relay, beginning at Rx. The positions
    /// form intervals. All of them are kept, not only those farthest from Rx, so that no chain is missed. Returns 0 if
    /// no chain is possible.
    pub fn best_apart(&self, apart_m: f64) -> f64 {
        let (Some(first), Some(last)) = (self.relays.first(), self.relays.last()) else {
            return 0.0;
        };
        let d = self.distance_m;
        let most = self.upsilon.iter().map(|point| point.1).fold(0.0, f64::max);
        let above_tx = self.tx_w * most / (self.eta * first.altitude_m.powi(2));
        let above_rx = last.power_w * self.upsilon_at(d) / (self.eta * last.altitude_m.powi(2));
        let (mut low, mut high) = (0.0, above_tx.min(above_rx));
        for k in 0..100 {
            let middle = if k < 60 && low <= 0.0 {
                high / 3.0
            } else {
                0.5 * (low + high)
            };
            if self.meets(middle, apart_m) {
                low = middle;
            } else {
                high = middle;
            }
            if high - low < 1e-7 * low {
                break;
            }
        }
        low
    }

    /// Splits an interval at the positions of the interference table. Upsilon is linear in each part.
    fn pieces(&self, (low, high): (f64, f64)) -> Stretches {
        let inside = self.upsilon.iter().map(|point| point.0);
        let inside = inside.filter(|x| *x > low && *x < high);
        let mut from = low;
        let mut pieces = Stretches::new();
        for to in inside.chain([high]) {
            pieces.push((from, to));
            from = to;
        }
        pieces
    }

    fn meets(&self, target: f64, apart_m: f64) -> bool {
        let (Some(first), Some(last)) = (self.relays.first(), self.relays.last()) else {
            return false;
        };
        let d = self.distance_m;
        let squared =
            last.power_w * self.upsilon_at(d) / (self.eta * target) - last.altitude_m.powi(2);
        if squared < 0.0 {
            return false;
        }
        let mut places = vec![((d - squared.sqrt()).max(0.0), d)];
        for pair in self.relays.windows(2).rev() {
            let [from, to] = pair else { return false };
            let climb = (to.altitude_m - from.altitude_m).powi(2);
            let shortest = (apart_m.powi(2) - climb).max(0.0);
            let scale = from.power_w / (self.mu_los * target);
            // Upper bound on the squared length of the hop to y, along x.
            let room = |y: f64| scale * self.upsilon_at(y) - climb;
            let mut senders = Stretches::new();
            for piece in places.iter().flat_map(|places| self.pieces(*places)) {
                // The bound is linear in this part. Keeps the positions at which the shortest hop fits.
                let (mut a, mut b) = piece;
                let (at_a, at_b) = (room(a) - shortest, room(b) - shortest);
                if at_a < 0.0 && at_b < 0.0 {
                    continue;
                }
                let cut = a + (b - a) * at_a / (at_a - at_b);
                if at_a < 0.0 {
                    a = cut;
                } else if at_b < 0.0 {
                    b = cut;
                }
                let nearest = least(a, b, |y| y - room(y).max(shortest).sqrt()).max(0.0);
                let farthest = b - shortest.sqrt();
                if farthest >= nearest {
                    senders.push((nearest, farthest));
                }
            }
            places = joined(senders);
        }
        let head = |x: f64| {
            x * x + first.altitude_m.powi(2) - self.tx_w * self.upsilon_at(x) / (self.eta * target)
        };
        let mut pieces = places.iter().flat_map(|places| self.pieces(*places));
        pieces.any(|(a, b)| least(a, b, head) <= 0.0)
    }
}
