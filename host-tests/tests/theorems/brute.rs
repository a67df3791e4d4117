//! Best position by brute force, without theorems.

use super::scene::Scene;

impl Scene {
    /// Returns the best SIR in ranges of x and altitude, by brute force. The search is along x at some altitudes and
    /// along the altitude at some x, and then around the three best points.
    pub(crate) fn brute(&mut self, x: (f64, f64), h: (f64, f64)) -> f64 {
        let lines = |(low, high): (f64, f64)| {
            if low < high {
                vec![0.0, 0.05, 0.3, 0.7, 1.0]
                    .into_iter()
                    .map(|share| low + share * (high - low))
                    .collect()
            } else {
                vec![low]
            }
        };
        let mut best: Vec<(f64, f64, f64)> = Vec::new();
        if x.0 < x.1 {
            let near = self.link.x_i;
            for up in lines(h) {
                let (sir, at) = along(x, near, |at| self.sir(at, up));
                best.push((sir, at, up));
            }
        }
        if h.0 < h.1 {
            for at in lines(x) {
                let (sir, up) = along(h, h.0, |up| self.sir(at, up));
                best.push((sir, at, up));
            }
        }
        if best.is_empty() {
            return self.sir(x.0, h.0);
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        let most = best[0].0;
        if x.0 < x.1 && h.0 < h.1 {
            best.truncate(3);
            best.into_iter()
                .map(|(_, at, up)| self.about((at, up), x, h))
                .fold(most, f64::max)
        } else {
            most
        }
    }

    /// Returns the best SIR that a search of x and altitude around `place` finds.
    fn about(&mut self, place: (f64, f64), x: (f64, f64), h: (f64, f64)) -> f64 {
        let (mut at, mut up) = place;
        let mut half = ((x.1 - x.0) / 8.0, (h.1 - h.0) / 8.0);
        let mut most = self.sir(at, up);
        for _ in 0..20 {
            let centre = (at, up);
            for i in -2_i32..=2 {
                for j in -2_i32..=2 {
                    let try_x = (centre.0 + half.0 * f64::from(i) / 2.0).clamp(x.0, x.1);
                    let try_h = (centre.1 + half.1 * f64::from(j) / 2.0).clamp(h.0, h.1);
                    let sir = self.sir(try_x, try_h);
                    if sir > most {
                        (most, at, up) = (sir, try_x, try_h);
                    }
                }
            }
            half = (half.0 * 0.5, half.1 * 0.5);
        }
        most
    }
}

/// Returns the maximum of `f` over `range` and its position. Samples are denser around `near`, and a golden-section
/// search refines the best.
fn along(range: (f64, f64), near: f64, mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    let (low, high) = range;
    let mut at = vec![low, high];
    for i in 1..24 {
        let share = f64::from(i) / 24.0;
        let close = 10_f64.powf(-8.0 * share) * (high - low);
        at.extend([
            low + share * (high - low),
            low + close,
            high - close,
            near - close,
            near + close,
        ]);
    }
    at.retain(|x| (low..=high).contains(x));
    at.sort_by(f64::total_cmp);
    let values: Vec<f64> = at.iter().map(|&x| f(x)).collect();
    let mut order: Vec<usize> = (0..at.len()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let mut best = (values[order[0]], at[order[0]]);
    for &peak in order.iter().take(3) {
        let (mut from, mut to) = (at[peak.saturating_sub(1)], at[(peak + 1).min(at.len() - 1)]);
        let ratio = (5_f64.sqrt() - 1.0) / 2.0;
        let (mut a, mut b) = (to - ratio * (to - from), from + ratio * (to - from));
        let (mut fa, mut fb) = (f(a), f(b));
        for _ in 0..40 {
            if fa > best.0 {
                best = (fa, a);
            }
            if fb > best.0 {
                best = (fb, b);
            }
            if fa < fb {
                (from, a, fa) = (a, b, fb);
                b = from + ratio * (to - from);
                fb = f(b);
            } else {
                (to, b, fb) = (b, a, fa);
                a = to - ratio * (to - from);
                fa = f(a);
            }
        }
    }
    best
}
