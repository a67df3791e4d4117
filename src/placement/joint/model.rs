//! What the rest of a chain is worth, as a relay's neighbour sees it: a quadratic in where that relay is and in the target.

use super::hop::{Reach, Row};
use crate::mission::Band;
use crate::sir::{CrossSection, square};

/// The slack at the end of the chain, m, about a nominal place and target: its first and second derivatives in (x, y, h, sigma).
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Model {
    pub(crate) slope: [f32; 4],
    /// Symmetric.
    pub(crate) bend: [[f32; 4]; 4],
}

/// What a relay makes of it: its step, and how that follows what changed before it.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Policy {
    /// (y, h), m, where nothing before it has changed.
    step: [f32; 2],
    /// And by (x, y, h, sigma) of the relay before.
    follow: [[f32; 4]; 2],
}

/// What a step is expected to gain: `linear` share + `square` share^2, m of slack.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Gains {
    pub(crate) linear: f32,
    pub(crate) square: f32,
}

/// The least curvature that a step is divided by, relative to the largest of the model: what is flatter is noise.
const FLATTEST: f32 = 1e-6;

impl Model {
    /// The tail's: its own place along x and what the last hop reaches. `ratio` is K / gamma, m^2; `None` where Rx hears nothing.
    pub(super) fn last(ratio: f32, at: CrossSection) -> Option<Self> {
        let (y, h) = (at.y_m, at.altitude_m);
        let squared = ratio - square(y) - square(h);
        if !(squared > 1e-6 * ratio) {
            return None;
        }
        let l = crate::root::sqrt(squared);
        let (l1, l3) = (1.0 / l, 1.0 / (l * squared));
        let half = 0.5 * ratio;
        Some(Self {
            slope: [1.0, -y * l1, -h * l1, -half * l1],
            bend: [
                [0.0; 4],
                [0.0, -l1 - y * y * l3, -y * h * l3, -y * half * l3],
                [0.0, -y * h * l3, -l1 - h * h * l3, -h * half * l3],
                [0.0, -y * half * l3, -h * half * l3, half * l1 - half * half * l3],
            ],
        })
    }

    /// Takes off what being too near the interferer costs, with what `near` is and its slopes in (x, y, h, sigma).
    pub(super) fn penalise(&mut self, weight: f32, near: f32, slope: [f32; 4], curve: f32) {
        for (total, part) in self.slope.iter_mut().zip(slope) {
            *total -= weight * near * part;
        }
        let own = [-2.0, -2.0, -2.0, curve];
        for ((row, p), (i, bend)) in self.bend.iter_mut().zip(slope).zip((0..).zip(own)) {
            for ((cell, q), j) in row.iter_mut().zip(slope).zip(0..) {
                let diagonal = if i == j { bend } else { 0.0 };
                *cell -= weight * (p * q + near * diagonal);
            }
        }
    }

    /// What the relay before sees of it through a hop, when the relay at its end, `at`, may move within `lateral` and `band`.
    pub(super) fn before(
        &self,
        hop: &Reach,
        at: CrossSection,
        lateral: Band,
        band: Band,
    ) -> (Self, Policy, Gains) {
        let r = hop.slope;
        let [vx, vy, vh, vs] = self.slope;
        // The slack by x', and by what else it depends on.
        let [rx, ry, rh, rs, rwy, rwh] = r;
        let first = [vx * rx, vx * ry, vx * rh, vx * rs + vs, vx * rwy + vy, vx * rwh + vh];
        let [m0, m1, m2, m3] = self.bend.map(|[x, y, h, s]| {
            let own = [0.0, 0.0, 0.0, s, y, h];
            add(own, r, x)
        });
        let rows: [Row; 6] = [
            [0.0; 6], [0.0; 6], [0.0; 6], m3, m1, m2,
        ];
        let mut q = hop.bend;
        for ((row, r), m) in q.iter_mut().zip(r).zip(rows) {
            *row = add(add(m, m0, r), *row, vx);
        }
        let [q0, q1, q2, q3, qy, qh] = q;
        let [fx, fy, fh, fs, gy, gh] = first;
        let ([qyx, qyy0, qyh0, qys, yy, yh], [qhx, qhy0, qhh0, qhs, _, hh]) = (qy, qh);
        let across = [[qyx, qyy0, qyh0, qys], [qhx, qhy0, qhh0, qhs]];
        let policy = Policy::best([gy, gh], [yy, yh, hh], across, at, lateral, band);
        let [ky, kh] = policy.step;
        let [ay, ah] = across;
        let [fol_y, fol_h] = policy.follow;
        let gains = Gains {
            linear: gy * ky + gh * kh,
            square: 0.5 * (yy * ky * ky + 2.0 * yh * ky * kh + hh * kh * kh),
        };
        // Q_w + Q_ww k
        let (py, ph) = (gy + yy * ky + yh * kh, gh + yh * ky + hh * kh);
        let mut slope = [fx, fy, fh, fs];
        for ((((cell, ay), ah), ky2), kh2) in
            slope.iter_mut().zip(ay).zip(ah).zip(fol_y).zip(fol_h)
        {
            *cell += ay * ky + ah * kh + ky2 * py + kh2 * ph;
        }
        let mut bend = [q0, q1, q2, q3].map(|[x, y, h, s, _, _]| [x, y, h, s]);
        // K' Q_ws + Q_sw K + K' Q_ww K, of which the last two are K' (Q_ws + Q_ww K) + Q_sw K
        let full_y = mix(ay, fol_y, yy, fol_h, yh);
        let full_h = mix(ah, fol_y, yh, fol_h, hh);
        for ((((row, ay), ah), ky2), kh2) in
            bend.iter_mut().zip(ay).zip(ah).zip(fol_y).zip(fol_h)
        {
            for ((((cell, my), mh), fy), fh) in
                row.iter_mut().zip(full_y).zip(full_h).zip(fol_y).zip(fol_h)
            {
                *cell += ky2 * my + kh2 * mh + ay * fy + ah * fh;
            }
        }
        (Self { slope, bend }, policy, gains)
    }
}

/// a + b f
fn add(a: Row, b: Row, f: f32) -> Row {
    let mut sum = a;
    for (cell, b) in sum.iter_mut().zip(b) {
        *cell += b * f;
    }
    sum
}

/// a + b f + c g
fn mix(a: [f32; 4], b: [f32; 4], f: f32, c: [f32; 4], g: f32) -> [f32; 4] {
    let mut sum = a;
    for ((cell, b), c) in sum.iter_mut().zip(b).zip(c) {
        *cell += b * f + c * g;
    }
    sum
}

impl Policy {
    /// The step within the box that gains most by a concave quadratic: `slope`, and `bend` (yy, yh, hh) turned concave.
    fn best(
        slope: [f32; 2],
        bend: [f32; 3],
        across: [[f32; 4]; 2],
        at: CrossSection,
        lateral: Band,
        band: Band,
    ) -> Self {
        let [yy, yh, hh] = concave(bend);
        let [gy, gh] = slope;
        let [ay, ah] = across;
        let low = [lateral.least_m - at.y_m, band.least_m - at.altitude_m];
        let high = [lateral.most_m - at.y_m, band.most_m - at.altitude_m];
        let ([ly, lh], [uy, uh]) = (low, high);
        let free_y = uy > ly;
        let free_h = uh > lh;
        let cut = |v: f32, l: f32, u: f32| v.max(l).min(u);
        // One coordinate alone, the other given.
        let along_y = |h: f32| cut(-(gy + yh * h) / yy, ly, uy);
        let along_h = |y: f32| cut(-(gh + yh * y) / hh, lh, uh);
        let det = yy * hh - yh * yh;
        if free_y && free_h && det > 0.0 {
            let y = (-gy * hh + gh * yh) / det;
            let h = (-gh * yy + gy * yh) / det;
            if y >= ly && y <= uy && h >= lh && h <= uh {
                let mut follow = [[0.0; 4]; 2];
                let [fy, fh] = &mut follow;
                for (((fy, fh), ay), ah) in fy.iter_mut().zip(fh.iter_mut()).zip(ay).zip(ah) {
                    *fy = (-ay * hh + ah * yh) / det;
                    *fh = (-ah * yy + ay * yh) / det;
                }
                return Self {
                    step: [y, h],
                    follow,
                };
            }
        }
        // On the edges of the box.
        let worth = |y: f32, h: f32| {
            gy * y + gh * h + 0.5 * (yy * y * y + hh * h * h) + yh * y * h
        };
        let mut best = (f32::NEG_INFINITY, 0.0, 0.0);
        for (y, h) in [
            (ly, along_h(ly)),
            (uy, along_h(uy)),
            (along_y(lh), lh),
            (along_y(uh), uh),
        ] {
            let w = worth(y, h);
            if w > best.0 {
                best = (w, y, h);
            }
        }
        let (_, y, h) = best;
        let mut follow = [[0.0; 4]; 2];
        let [fy, fh] = &mut follow;
        if y > ly && y < uy {
            for (cell, a) in fy.iter_mut().zip(ay) {
                *cell = -a / yy;
            }
        } else if h > lh && h < uh {
            for (cell, a) in fh.iter_mut().zip(ah) {
                *cell = -a / hh;
            }
        }
        Self {
            step: [y, h],
            follow,
        }
    }

    /// Where the relay at `at` goes for `share` of its step, when (x, y, h, sigma) before it have changed by `change`.
    pub(super) fn apply(
        &self,
        at: CrossSection,
        share: f32,
        change: [f32; 4],
        lateral: Band,
        band: Band,
    ) -> CrossSection {
        let dot = |row: [f32; 4]| row.iter().zip(change).map(|(a, b)| a * b).sum::<f32>();
        let [y, h] = self.step;
        let [fy, fh] = self.follow;
        CrossSection {
            y_m: lateral.nearest(at.y_m + share * y + dot(fy)),
            altitude_m: band.nearest(at.altitude_m + share * h + dot(fh)),
        }
    }
}

/// The symmetric matrix (yy, yh, hh) with each eigenvalue turned below zero.
fn concave([yy, yh, hh]: [f32; 3]) -> [f32; 3] {
    let (mean, half) = (0.5 * (yy + hh), 0.5 * (yy - hh));
    let root = libm::hypotf(half, yh);
    let least = (FLATTEST * (mean.abs() + root)).max(1e-20);
    let (high, low) = (mean + root, mean - root);
    if high <= -least {
        return [yy, yh, hh];
    }
    let (high, low) = (-high.abs().max(least), -low.abs().max(least));
    // cos and sin of twice the angle of the axes.
    let (cos, sin) = if root > 0.0 {
        (half / root, yh / root)
    } else {
        (1.0, 0.0)
    };
    let (mean, half) = (0.5 * (high + low), 0.5 * (high - low));
    [mean + half * cos, half * sin, mean - half * cos]
}
