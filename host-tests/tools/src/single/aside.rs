//! Relay with lateral freedom: Theorems 1 and 3 with y free, which is not in the paper.
//!
//! At a position (x, y, h), with c = SIR_1 / A, k = c - 1, q = X^2 + Y^2 and s the ground distance from Rx:
//!
//! ```text
//! c     = ((X - x)^2 + (Y - y)^2 + h^2) / (x^2 + y^2 + h^2)    A = p_t / p_MSI
//! SIR_2 = K / (s^2 + h^2)                                      s^2 = (D - x)^2 + y^2
//! ```
//!
//! **Spheres.** SIR_1 is constant where k (x^2 + y^2 + h^2) + 2 X x + 2 Y y = q: on a sphere about the ground point -(X, Y) / k,
//! for k = 0 on a vertical plane. It is higher inside for k > 0, outside for k < 0. SIR_2 is constant on a sphere about Rx, and
//! higher inside.
//!
//! **At one altitude, without limits.** The optimum is one of three positions.
//!
//! 1. Above Rx, where SIR_2 is maximal, if SIR_1 is no worse there.
//! 2. At the maximum of SIR_1, its only one, if SIR_2 is no worse there: t = 2 h^2 / (sqrt(q) + sqrt(q + 4 h^2)) from Tx,
//!    straight away from the interferer.
//! 3. Otherwise where a circle of constant SIR_1 touches one of constant SIR_2, with SIR_1 = SIR_2. No other position
//!    is as good, because the two sets of positions with higher SIRs share only the touching point. This holds for two
//!    discs (k > 0), and for the disc of SIR_2 within the disc that SIR_1 excludes (k < 0).
//!
//! Any other position can be improved: either one SIR is worse and can rise, or both can rise together.
//!
//! **The touching position** is the one on the circle of radius s about Rx at which SIR_1 is maximal. With x = D - s cos w, y = s
//! sin w that is the largest k for which k m - a = (b + k n) cos w + e sin w has a solution:
//!
//! ```text
//! a = q - 2 X D    b = 2 X s    e = -2 Y s    m = D^2 + s^2 + h^2    n = 2 D s
//! k = (a m + b n + sqrt((a n + b m)^2 + e^2 (m^2 - n^2))) / (m^2 - n^2)
//! (cos w, sin w) ~ (b + k n, e)
//! ```
//!
//! While the maximum of SIR_1 is outside of the disc, the largest SIR_1 on the circle is that on the whole disc; it rises with s,
//! and SIR_2 falls. They are equal at one s, found by bisection. In c it is a root of the quartic for touching circles:
//!
//! ```text
//! ((D^2 + 2 h^2) k c + (2 D X - q) c - G k)^2 = 4 c (q c - h^2 k^2) (G - h^2 c)    G = K / A
//! ```
//!
//! **Limits.** If the touching position is in [0, D] x [left, right], it is the optimum. Otherwise the optimum is on an edge of
//! that rectangle, because an inner position that cannot be improved is one of the three. An edge is a one-dimensional problem:
//! see `edge`.
//!
//! **With the altitude free** the lowest altitude is optimal if there is lateral room. Turn a position about the line on the
//! ground through the centres of its two spheres: neither SIR changes, and the relay descends to one side or the other. So no
//! higher position is better than the optimum of the lowest plane without limits, and if that is within the corridor, it is the
//! global optimum. In numbers: at the same distance r from the line, and so with the same signal at both ends, y = -r is farther
//! from the interferer than h = r, by 2 Y r in squared distance. For Y = 0 the two are equal.
//!
//! A higher altitude can only be better if that position is outside of the corridor. Then the optimum is on one of the twelve
//! edges of the box: any higher position can be turned down until it is in the lowest plane or in a vertical face. In a vertical
//! face all level circles have their centres on the ground, so they do not touch above it.
//!
//! **With noise** SIR_1 = A s / (l (1 + nu s)), s and l the squared distances from the interferer and from Tx.
//!
//! - The maximum of SIR_1 is at t times the interferer's distance from Tx, straight away from it, with h^2 = t q + t^2 q + nu t
//!   s^2 and s = (1 + t)^2 q + h^2: there is one solution, closer than without noise. It is still the only maximum: along the
//!   line on the other side, where (1 / s w)(r - |(X, Y)|) = r / l, 1 / s w is above 1 / l, and SIR_1 rises to both sides.
//! - On a circle about Rx s and l are linear in (cos w, sin w): they follow an ellipse. q(s) / l with q(s) = s / (1 + nu s) is at
//!   least v on a convex set, since q(s) - v l is concave, and better with a larger s and a smaller l. So on the arc from the
//!   point closest to Tx to that farthest from the interferer it has one maximum, found by bisection.
//! - On a sphere about Rx l is linear in x, and s in x and y. For Y = 0 SIR_1 is symmetric in y; for any other Y it rises toward
//!   the side away from the interferer. On that side the relay descends as it moves there, so the lowest altitude is optimal if
//!   there is room. On the interferer's side it climbs, so the highest may be optimal. In a vertical face along the line the
//!   level lines may touch in between: see `edge`. In the two faces across the line l is constant along such a circle, so they do
//!   not touch.
//! - If the touching position is outside of the corridor, another one may be inside, in the lowest plane or the highest: see
//!   `edge`.
//!
//! Accuracy: `a_relay_aside_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use uav_relay::{Band, Interferer, Mission, Placement, Profile};
use uav_relay_scenario::number::narrow;

use super::edge::{Edge, best_in_corridor, squared, touching_inside};
use super::extrema::bisected;
use super::{Found, TwoHops};

pub use super::edge::EdgeCoordinate;

/// Number of bisection steps in f64; the remaining error is far below a step of an f32.
const HALVINGS: u8 = 48;

/// Case of the optimal position of a single relay that may move sideways.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum AsideCase {
    /// Optimum at the lowest altitude, where the circles of constant SIR of both hops touch.
    Touching,
    /// Optimum at the lowest altitude, at the maximum of the first hop's SIR.
    ///
    /// The second hop's SIR is higher there.
    Hilltop,
    /// Optimum above Rx, at the lowest altitude. The first hop's SIR is higher there than the second hop's.
    AboveRx,
    /// Optimum on an edge of the box of allowed positions, along this coordinate.
    ///
    /// Without the limits of the box the optimum would be elsewhere.
    Edge(EdgeCoordinate),
    /// Optimum above Rx: the interferer is at Tx (X = Y = 0), so the SIR of the first hop is constant.
    Level,
    /// Optimum on a vertical face of the box of allowed positions; only with noise.
    ///
    /// The curves of constant SIR of the two hops touch there.
    Wall,
    /// Optimum at the lowest or highest altitude, inside the allowed lateral range; only with noise.
    ///
    /// It is found by a search, and not proven.
    Inside,
    /// Optimum above Rx: the interferer is at Rx (X = D, Y = 0), so the second hop's SIR is always 0.
    Drowned,
}

impl AsideCase {
    /// Number of the case, 1 to 10.
    ///
    /// Cases 1 to 3 are optima that the limits of x, y and h do not affect; 4 to 6 are optima on edges along x, y and
    /// h. In cases 7 and 8 the interferer is at Tx or Rx. Cases 9 and 10 occur only with noise.
    pub const fn number(self) -> u8 {
        match self {
            Self::Touching => 1,
            Self::Hilltop => 2,
            Self::AboveRx => 3,
            Self::Edge(axis) => axis as u8,
            Self::Level => 7,
            Self::Drowned => 8,
            Self::Wall => 9,
            Self::Inside => 10,
        }
    }
}

/// Returns the optimal position of a relay with `profile`, and its case.
///
/// `None` if the mission has no interferer. x is between Tx and Rx, and y in the allowed lateral range. The relay has
/// the altitude of `profile`. Work: 48 bisection steps in f64; with noise 48 further steps for each of them. If the
/// optimum is outside of the allowed ranges, some 300 evaluations of both hops; with noise and a lateral range some
/// 23 000 more.
pub fn best_at(mission: &Mission, profile: Profile) -> Option<(Found, AsideCase)> {
    best_within(mission, Band::at(profile.altitude_m), profile.power_w)
}

/// Returns the optimal position of a relay of `power_w` watts, and its case.
///
/// `None` if the mission has no interferer. x is between Tx and Rx; y and altitude are in their allowed ranges. Work:
/// 48 bisection steps in f64; with noise 48 further steps for each of them. If the optimum is outside of the allowed
/// ranges, some 800 evaluations of both hops; with noise and a lateral range some 46 000 more.
pub fn best_place(mission: &Mission, power_w: f32) -> Option<(Found, AsideCase)> {
    best_within(mission, mission.config().band, power_w)
}

fn best_within(mission: &Mission, band: Band, power_w: f32) -> Option<(Found, AsideCase)> {
    let interferer = mission.interferer()?;
    let hops = TwoHops { mission, power_w };
    let (place, case) = without_limits(mission, interferer, band.least_m, power_w);
    let config = mission.config();
    let (along, across) = (
        Band {
            least_m: 0.0,
            most_m: config.distance_m,
        },
        config.lateral,
    );
    if holds(along, place.x_m) && holds(across, place.y_m) {
        return Some((hops.found(place), case));
    }
    // The position above Rx is always allowed.
    let above_rx = Placement::on_line(config.distance_m, band.least_m);
    let mut best = (hops.found(above_rx), AsideCase::AboveRx);
    let at = |x_m: f32, y_m: f32, altitude_m: f32| Placement {
        x_m,
        y_m,
        altitude_m,
    };
    if mission.noise_at_a_metre() > 0.0 && !across.is_single() {
        for altitude_m in both_ends(band) {
            let found = best_in_corridor(&hops, interferer, along, across, altitude_m);
            if found.sir > best.0.sir {
                best = (found, AsideCase::Inside);
            }
        }
    }
    for y in both_ends(across) {
        if let Some(found) = touching_inside(&hops, interferer, y, band)
            && found.sir > best.0.sir
        {
            best = (found, AsideCase::Wall);
        }
    }
    let mut weigh = |free: EdgeCoordinate, room: Band, through: Placement| {
        let edge = Edge {
            free,
            through,
            room,
        };
        let found = edge.best(&hops, interferer);
        if found.sir > best.0.sir {
            best = (found, AsideCase::Edge(free));
        }
    };
    for h in both_ends(band) {
        for y in both_ends(across) {
            weigh(EdgeCoordinate::Along, along, at(0.0, y, h));
        }
        for x in both_ends(along) {
            weigh(EdgeCoordinate::Across, across, at(x, 0.0, h));
        }
    }
    if !band.is_single() {
        for y in both_ends(across) {
            for x in both_ends(along) {
                weigh(EdgeCoordinate::Upward, band, at(x, y, band.least_m));
            }
        }
    }
    Some(best)
}

fn both_ends(band: Band) -> impl Iterator<Item = f32> {
    let other = (!band.is_single()).then_some(band.most_m);
    std::iter::once(band.least_m).chain(other)
}

fn holds(band: Band, value: f32) -> bool {
    (band.least_m..=band.most_m).contains(&value)
}

/// Returns the optimal position of a single relay at `altitude_m`, if x and y are not limited.
fn without_limits(
    mission: &Mission,
    interferer: &Interferer,
    altitude_m: f32,
    power_w: f32,
) -> (Placement, AsideCase) {
    let scene = Plane {
        d: f64::from(mission.config().distance_m),
        x: f64::from(interferer.x_m),
        y: f64::from(interferer.y_m),
        h2: squared(f64::from(altitude_m)),
        g: mission.last_to_first(power_w),
        noise: f64::from(mission.noise_at_a_metre()),
    };
    let (place, case) = scene.best();
    let place = Placement {
        x_m: narrow(place.0),
        y_m: narrow(place.1),
        altitude_m,
    };
    (place, case)
}

/// Horizontal plane at one altitude h, with the numbers that both hops' SIRs depend on.
///
/// The numbers are D (distance Tx-Rx), the interferer's position (X, Y), h^2, the ratio G = K / A of the hops' gains,
/// and the noise nu, in m and m^2.
struct Plane {
    d: f64,
    x: f64,
    y: f64,
    h2: f64,
    g: f64,
    noise: f64,
}

impl Plane {
    fn best(&self) -> ((f64, f64), AsideCase) {
        let above_rx = (self.d, 0.0);
        if !(self.g > 0.0) {
            return (above_rx, AsideCase::Drowned);
        }
        let q = squared(self.x) + squared(self.y);
        if !(q > 0.0 || self.noise > 0.0) {
            return (above_rx, AsideCase::Level);
        }
        if self.first(above_rx) >= self.second(0.0) {
            return (above_rx, AsideCase::AboveRx);
        }
        let t = self.hill(q);
        let hill = (-self.x * t, -self.y * t);
        let far = libm::hypot(self.d - hill.0, hill.1);
        if self.first(hill) <= self.second(far) {
            return (hill, AsideCase::Hilltop);
        }
        let is_inside = |s| self.first(self.loudest(s)) < self.second(s);
        let (_, s) = bisected(0.0, far, HALVINGS, is_inside);
        (self.loudest(s), AsideCase::Touching)
    }

    /// Returns the first hop's SIR divided by the hop's gain A, with the relay at (x, y) in this plane.
    fn first(&self, (x, y): (f64, f64)) -> f64 {
        let heard = squared(self.x - x) + squared(self.y - y) + self.h2;
        heard / (squared(x) + squared(y) + self.h2) / (1.0 + self.noise * heard)
    }

    /// Returns the factor t of the position -t (X, Y) with the first hop's largest SIR.
    ///
    /// The interferer is at (X, Y), and Tx at (0, 0). The position is on the side of Tx opposite the interferer. `q` is
    /// X^2 + Y^2.
    fn hill(&self, q: f64) -> f64 {
        let away = libm::sqrt(q);
        if !(away > 0.0) {
            return 0.0;
        }
        let t = 2.0 * self.h2 / (away + libm::sqrt(q + 4.0 * self.h2)) / away;
        if !(self.noise > 0.0) {
            return t;
        }
        let rises = |t: f64| {
            let s = squared(1.0 + t) * q + self.h2;
            self.h2 > t * q + squared(t) * q + self.noise * t * squared(s)
        };
        bisected(0.0, t, HALVINGS, rises).0
    }

    /// Returns the point (x, y), m, of a circle about Rx at which the first hop's SIR in noise is largest.
    ///
    /// `s` is the radius of the circle, m.
    fn loudest_in_noise(&self, s: f64) -> (f64, f64) {
        let at = |w: f64| (self.d - s * libm::cos(w), s * libm::sin(w));
        // From the point closest to Tx, w = 0, to the point farthest from the interferer.
        let mut far = libm::atan2(-self.y, self.x - self.d);
        if !(squared(self.x) + squared(self.y) > 0.0) {
            far = 0.0;
        }
        let rises = |part: f64| {
            let w = part * far;
            let (x, y) = at(w);
            let (dx, dy) = (s * libm::sin(w) * far, s * libm::cos(w) * far);
            let heard = squared(self.x - x) + squared(self.y - y) + self.h2;
            let from = squared(x) + squared(y) + self.h2;
            let more = (x - self.x) * dx + (y - self.y) * dy;
            more * from > (x * dx + y * dy) * heard * (1.0 + self.noise * heard)
        };
        at(bisected(0.0, 1.0, HALVINGS, rises).0 * far)
    }

    /// Returns the second hop's SIR divided by the first hop's gain A.
    ///
    /// `s` is the relay's distance from Rx along the ground, m.
    fn second(&self, s: f64) -> f64 {
        self.g / (squared(s) + self.h2)
    }

    /// Returns the point on the circle of radius `s` about Rx at which the first hop's SIR is largest.
    fn loudest(&self, s: f64) -> (f64, f64) {
        if self.noise > 0.0 {
            return self.loudest_in_noise(s);
        }
        let a = squared(self.x) + squared(self.y) - 2.0 * self.x * self.d;
        let (b, e) = (2.0 * self.x * s, -2.0 * self.y * s);
        let (m, n) = (squared(self.d) + squared(s) + self.h2, 2.0 * self.d * s);
        // m^2 - n^2, without cancellation.
        let spread = (squared(self.d - s) + self.h2) * (squared(self.d + s) + self.h2);
        let root = libm::sqrt(squared(a * n + b * m) + squared(e) * spread);
        let k = (a * m + b * n + root) / spread;
        let (cos, sin) = (b + k * n, e);
        let size = libm::hypot(cos, sin);
        if size > 0.0 {
            (self.d - s * (cos / size), s * (sin / size))
        } else {
            // SIR_1 is constant on the circle.
            (self.d - s, 0.0)
        }
    }
}
