//! One relay in an upright plane with noise: the place inside the box at which the level lines of both SIRs touch.
//!
//! In the plane y = y0, on the circle of radius r about (D, y0) SIR_2 is the same everywhere, and with z = x - D both squared distances
//! are linear in z:
//!
//! ```text
//! l = r^2 + y0^2 + D^2 + 2 D z               from Tx
//! s = r^2 + (D - X)^2 + (y0 - Y)^2 + 2 (D - X) z    from the interferer
//! ```
//!
//! SIR_1 = A s / (l (1 + nu s)) has a slope by z of the sign of (D - X) l - D s - D nu s^2. The first two terms together do not depend
//! on z:
//!
//! ```text
//! T = (D - X) y0^2 - X r^2 + D ((D - X) X - (y0 - Y)^2)
//! ```
//!
//! So without noise SIR_1 only rises or only falls along the circle, and no place inside the box is the best: Theorem 3 as corrected.
//! With noise and X < D it rises up to s = sqrt(T / (D nu)) and falls beyond: there it is best, above the ground where |z| < r. For
//! X >= D the sign is below 0.
//!
//! SIR_1 has no top off the ground (its slope by h is 0 only where l = s (1 + nu s), that by x then only for X = 0, where it is the sum
//! of two that are not), so the most on a circle is the most within it, and does not fall with r, while SIR_2 does: they are equal at one
//! r, which halving finds. A place inside the box that cannot be improved must be this one: there both slopes point in opposite
//! directions, so along the circle SIR_1 is level, and the SIRs are equal.

use super::edge::{TwoHops, narrow};
use super::{Found, HALVINGS};
use crate::mission::{Band, Interferer};
use crate::place::Placement;

/// The touching place at `y_m` within [0, D] and `band`; `None` where it is not, and without noise. Work: 40 halvings in f64.
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

/// An upright plane along the line, in m and m^2: D, X, (y0 - Y)^2, y0^2, nu, and G = K / A.
struct Face {
    d: f64,
    x: f64,
    aside: f64,
    y: f64,
    noise: f64,
    g: f64,
}

impl Face {
    /// Where SIR_1 is best on the circle of radius `r`, as x - D.
    fn best(&self, r: f64) -> f64 {
        let (d, gap) = (self.d, self.d - self.x);
        let t = gap * self.y - self.x * squared(r) + d * (gap * self.x - self.aside);
        let s = libm::sqrt((t / (d * self.noise)).max(0.0));
        let z = (s - squared(r) - squared(gap) - self.aside) / (2.0 * gap);
        z.max(-r).min(r)
    }

    /// The most of SIR_1 / A on it.
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
