//! Policy of a relay in one iteration of the joint method: its step, and its feedback on changes before it.

use super::hop::{Coordinate, Triple};
use crate::root::sqrt;
use crate::sir::square;

/// Step of a relay in the two free coordinates of its hop.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Policy {
    pub(super) axis: Coordinate,
    /// True for the larger of the two values that the hop allows for the dependent coordinate.
    pub(super) rising: bool,
    /// Step without a change before, m.
    pub(super) step: [f32; 2],
    /// Feedback on a change in (x, y, h) of the relay before.
    pub(super) follow: [Triple; 2],
}

/// Minimum curvature that a step is divided by, relative to the largest one; flatter directions are noise.
const FLATTEST: f32 = 1e-6;

impl Policy {
    /// Returns the step within the box that maximises the quadratic of `slope` and `bend` (yy, yh, hh), made concave.
    pub(super) fn best(
        slope: [f32; 2],
        bend: [f32; 3],
        across: [[f32; 3]; 2],
        low: [f32; 2],
        high: [f32; 2],
    ) -> Self {
        let [yy, yh, hh] = concave(bend);
        let [gy, gh] = slope;
        let [ay, ah] = across;
        let ([ly, lh], [uy, uh]) = (low, high);
        let free_y = uy > ly;
        let free_h = uh > lh;
        let cut = |v: f32, l: f32, u: f32| v.max(l).min(u);
        // Optimum of one coordinate for a given value of the other.
        let along_y = |h: f32| cut(-(gy + yh * h) / yy, ly, uy);
        let along_h = |y: f32| cut(-(gh + yh * y) / hh, lh, uh);
        let det = yy * hh - yh * yh;
        if free_y && free_h && det > 0.0 {
            let y = (-gy * hh + gh * yh) / det;
            let h = (-gh * yy + gy * yh) / det;
            if y >= ly && y <= uy && h >= lh && h <= uh {
                let mut follow = [[0.0; 3]; 2];
                let [fy, fh] = &mut follow;
                for (((fy, fh), ay), ah) in fy.iter_mut().zip(fh.iter_mut()).zip(ay).zip(ah) {
                    *fy = (-ay * hh + ah * yh) / det;
                    *fh = (-ah * yy + ay * yh) / det;
                }
                return Self {
                    axis: Coordinate::X,
                    rising: true,
                    step: [y, h],
                    follow,
                };
            }
        }
        // Optimum on the edges of the box.
        let value = |y: f32, h: f32| gy * y + gh * h + 0.5 * (yy * y * y + hh * h * h) + yh * y * h;
        let mut best = (f32::NEG_INFINITY, 0.0, 0.0);
        for (y, h) in [
            (ly, along_h(ly)),
            (uy, along_h(uy)),
            (along_y(lh), lh),
            (along_y(uh), uh),
        ] {
            let w = value(y, h);
            if w > best.0 {
                best = (w, y, h);
            }
        }
        let (_, y, h) = best;
        let mut follow = [[0.0; 3]; 2];
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
            axis: Coordinate::X,
            rising: true,
            step: [y, h],
            follow,
        }
    }

    /// Returns the change of the free coordinates for `share` of the step, after a change of the relay before by `change`.
    pub(super) fn apply(&self, share: f32, change: [f32; 3]) -> [f32; 2] {
        let dot = |row: [f32; 3]| row.iter().zip(change).map(|(a, b)| a * b).sum::<f32>();
        let [y, h] = self.step;
        let [fy, fh] = self.follow;
        [share * y + dot(fy), share * h + dot(fh)]
    }
}

/// Returns the symmetric matrix (yy, yh, hh) with each eigenvalue made negative.
fn concave([yy, yh, hh]: [f32; 3]) -> [f32; 3] {
    let (mean, half) = (0.5 * (yy + hh), 0.5 * (yy - hh));
    let root = sqrt(square(half) + square(yh));
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

/// Compressed [`Policy`]: feedback with three digits is sufficient.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Brief {
    axis: Coordinate,
    rising: bool,
    step: [f32; 2],
    follow: [[u16; 3]; 2],
}

impl Brief {
    pub(super) fn of(policy: &Policy) -> Self {
        let Policy {
            axis,
            rising,
            step,
            follow,
        } = *policy;
        Self {
            axis,
            rising,
            step,
            follow: follow.map(|row| row.map(upper_half)),
        }
    }

    pub(super) fn policy(self) -> Policy {
        let whole = |half: u16| f32::from_bits(u32::from(half) << 16);
        Policy {
            axis: self.axis,
            rising: self.rising,
            step: self.step,
            follow: self.follow.map(|row| row.map(whole)),
        }
    }
}

const fn upper_half(value: f32) -> u16 {
    (value.to_bits().saturating_add(0x8000) >> 16) as u16
}
