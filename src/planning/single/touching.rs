//! One relay in a vertical plane with noise: the position inside the box at which the level lines of both SIRs touch.
//!
//! In the plane y = y0, SIR_2 is constant on the circle of radius r about (D, y0), and with z = x - D both squared distances are
//! linear in z:
//!
//! ```text
//! l = r^2 + y0^2 + D^2 + 2 D z               from Tx
//! s = r^2 + (D - X)^2 + (y0 - Y)^2 + 2 (D - X) z    from the interferer
//! ```
//!
//! The slope of SIR_1 = A s / (l (1 + nu s)) by z has the sign of (D - X) l - D s - D nu s^2. The sum of the first two terms does
//! not depend on z:
//!
//! ```text
//! T = (D - X) y0^2 - X r^2 + D ((D - X) X - (y0 - Y)^2)
//! ```
//!
//! So without noise SIR_1 is monotone along the circle, and no position inside the box is optimal: Theorem 3 as corrected. With
//! noise and X < D it rises up to s = sqrt(T / (D nu)) and falls beyond; this maximum is above the ground if |z| < r. For X >= D
//! the sign is negative.
//!
//! SIR_1 has no maximum off the ground: its slope by h is 0 only where l = s (1 + nu s), and then that by x only for X = 0, where
//! it is the sum of two terms that are not. So the maximum on a circle is that of its inside, and does not fall with r, while
//! SIR_2 does. They are equal at one r, found by bisection. A position inside the box that cannot be improved must be this one:
//! both slopes are opposite there, so SIR_1 is stationary along the circle, and the SIRs are equal.

use super::edge::{TwoHops, narrow};
use super::{Found, HALVINGS};
use crate::mission::{Band, Interferer};
use crate::place::Placement;

/// Returns the touching position at `y_m`; `None` outside of [0, D] and `band`, and without noise. 40 bisection steps.
pub(super) fn inside(
    hops: &TwoHops<'_>,
    interferer: &Interferer,
    y_m: f32,
    band: Band,
) -> Option<Found> {
    let mission = hops.mission;
    let face = Face {
        d: f64::from(mission.config().distance_m),
        x: f64::from(interferer.x_m),
        aside: squared(f64::from(y_m) - f64::from(interferer.y_m)),
        y: squared(f64::from(y_m)),
        noise: f64::from(mission.noise_at_a_metre()),
        g: mission.last_to_first(hops.power_w),
    };
    if !(face.noise > 0.0 && face.x < face.d) {
        return None;
    }
    let (mut low, mut high) = (0.0, libm::hypot(face.d, f64::from(band.most_m)));
    for _ in 0..HALVINGS {
        let r = 0.5 * (low + high);
        if face.first(r) < face.g / (squared(r) + face.y) {
            low = r;
        } else {
            high = r;
        }
    }
    let z = face.best(high);
    let across = squared(high) - squared(z);
    let place = Placement {
        x_m: narrow(face.d + z),
        y_m,
        altitude_m: narrow(libm::sqrt(across.max(0.0))),
    };
    let within = (0.0..=mission.config().distance_m).contains(&place.x_m)
        && (band.least_m..=band.most_m).contains(&place.altitude_m);
    within.then(|| hops.found(place))
}

/// Vertical plane along the line, in m and m^2: D, X, (y0 - Y)^2, y0^2, nu, and G = K / A.
struct Face {
    d: f64,
    x: f64,
    aside: f64,
    y: f64,
    noise: f64,
    g: f64,
}

impl Face {
    /// Returns x - D of the maximum of SIR_1 on the circle of radius `r`.
    fn best(&self, r: f64) -> f64 {
        let (d, gap) = (self.d, self.d - self.x);
        let t = gap * self.y - self.x * squared(r) + d * (gap * self.x - self.aside);
        let s = libm::sqrt((t / (d * self.noise)).max(0.0));
        let z = (s - squared(r) - squared(gap) - self.aside) / (2.0 * gap);
        z.max(-r).min(r)
    }

    /// Returns the maximum of SIR_1 / A on the circle of radius `r`.
    fn first(&self, r: f64) -> f64 {
        let (z, gap) = (self.best(r), self.d - self.x);
        let s = squared(r) + squared(gap) + self.aside + 2.0 * gap * z;
        let l = squared(r) + self.y + squared(self.d) + 2.0 * self.d * z;
        s / (l * (1.0 + self.noise * s))
    }
}

fn squared(x: f64) -> f64 {
    x * x
}
