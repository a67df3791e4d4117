//! Relays that are all alike in a field: which places can be continued to Rx at all. The paper's Problem 1, exactly.
//!
//! The SIR of a hop depends on the place y it ends at and on its length, so it may begin anywhere in [y - d(y), y] with d(y) =
//! sqrt(p_u Upsilon(y) / (mu_los gamma)): any hop may be shortened, not only the last one, as the paper has it with its rho.
//! The places from which relay k can be continued to Rx are therefore a range [l_k, r_k], with l_N = D - d_max and
//!
//! ```text
//! l_k = min { y - d(y) : l_{k+1} <= y <= r_{k+1} },
//! ```
//!
//! and N relays meet gamma if and only if E(SIR_1) does so somewhere in [l_1, r_1]. Between two points of the field y - d(y) is
//! convex: its least value is at an end or where d'(y) = 1, that is d(y) = c b / 2 with b the slope of Upsilon and c = p_u / (mu_los
//! gamma). Where a least separation makes some y useless the ranges may have holes, and what is found is met, but not proven.

use super::Fewest;
use crate::mission::{MAX_RELAYS, Mission, Profile};
use crate::placement::retreat::Retreat;
use crate::root::sqrt;
use crate::sir::{self, Placement, Sender, square};

/// Halvings of a stretch for the first place that the first hop meets the target at.
const HALVINGS: u8 = 40;

/// How many relays more than without a least separation are tried with one.
const MORE: u16 = 32;

/// Halvings of the range of targets.
const TARGETS: u8 = 48;

/// The chain of a mission's N equals for one target.
#[derive(Clone, Copy)]
struct Equals<'a> {
    mission: &'a Mission,
    profile: Profile,
    target: f32,
}

/// Where a hop ends, and the nearest place to Tx that it can begin at.
#[derive(Clone, Copy)]
struct Step {
    to_m: f32,
    from_m: f32,
}

impl Equals<'_> {
    /// l_N: the place nearest to Tx from which Rx still hears relay N.
    fn last(&self) -> Option<f32> {
        let hop = Retreat::new(
            self.mission,
            self.profile.on_line(),
            self.mission.relays(),
            None,
        );
        hop.reach(self.target, self.mission.config().distance_m, 1.0)
    }

    /// r_k: the last place that leaves relays k + 1 to N their separation.
    fn latest(&self, index: u16) -> f32 {
        let before = self.mission.end_for(self.mission.relays() + 1 - index, 0.0);
        self.mission.config().distance_m - before
    }

    /// The longest hop into `y` from relay `index`.
    fn step(&self, index: u16, y: f32) -> Option<Step> {
        let altitude_m = self.profile.altitude_m;
        let hop = Retreat::new(
            self.mission,
            self.profile.on_line(),
            index,
            Some(altitude_m),
        );
        let at = Placement::on_line(y, altitude_m);
        let from_m = hop.reach(self.target, y, sir::quiet(self.mission, at))?;
        Some(Step { to_m: y, from_m })
    }

    /// The hop from relay `index` that begins nearest to Tx, of all that end in [`low`, r_{index + 1}]: its beginning is l_index.
    fn longest(&self, index: u16, low: f32) -> Option<Step> {
        let high = self.latest(index + 1);
        let field = self.mission.field()?;
        let mut best: Option<Step> = None;
        let mut weigh = |y: f32| {
            if let Some(step) = self.step(index, y.max(low).min(high))
                && best.is_none_or(|best| step.from_m < best.from_m)
            {
                best = Some(step);
            }
        };
        if low > high {
            return None;
        }
        weigh(low);
        weigh(high);
        let c =
            self.mission.relay_gain(self.profile.power_w).value() / (self.target * field.largest());
        for pair in field.points().windows(2) {
            let [left, right] = pair else { continue };
            if right.x_m <= low || left.x_m >= high {
                continue;
            }
            weigh(left.x_m);
            let slope = (right.upsilon_per_w - left.upsilon_per_w) / (right.x_m - left.x_m);
            // Upsilon where d' = 1; outside the stretch there is no such place in it.
            let upsilon = 0.25 * c * square(slope);
            if slope > 0.0 && upsilon > left.upsilon_per_w && upsilon < right.upsilon_per_w {
                weigh(left.x_m + (upsilon - left.upsilon_per_w) / slope);
            }
        }
        if let Some(point) = field.points().last() {
            weigh(point.x_m);
        }
        best
    }

    /// l_1, with every l_k told on the way.
    fn ranges(&self, mut tell: impl FnMut(u16, f32)) -> Option<f32> {
        let mut low = self.last()?;
        let mut index = self.mission.relays();
        tell(index, low);
        while index > 1 {
            index -= 1;
            low = self.longest(index, low)?.from_m;
            tell(index, low);
        }
        Some(low)
    }

    fn first_hop_meets(&self, x_m: f32) -> bool {
        let at = Placement::on_line(x_m, self.profile.altitude_m);
        Sender::transmitter(self.mission).sir_at(self.mission, 0.0, at) >= self.target
    }

    /// The first place in [`low`, r_1] at which the first hop meets the target.
    ///
    /// On a stretch the excess of p_t Upsilon / eta gamma over x^2 + h^2 is a hill: if it is there at all, then from somewhere
    /// between the stretch's beginning and the hilltop on.
    fn head(&self, low: f32) -> Option<f32> {
        let high = self.latest(1);
        if low > high {
            return None;
        }
        if self.first_hop_meets(low) {
            return Some(low);
        }
        let field = self.mission.field()?;
        let c = self.mission.tx_gain().value() / (self.target * field.largest());
        for pair in field.points().windows(2) {
            let [left, right] = pair else { continue };
            let (from, to) = (left.x_m.max(low), right.x_m.min(high));
            if from > to {
                continue;
            }
            let slope = (right.upsilon_per_w - left.upsilon_per_w) / (right.x_m - left.x_m);
            let top = (0.5 * c * slope).max(from).min(to);
            if self.first_hop_meets(top) {
                return Some(self.first_met(from, top));
            }
        }
        None
    }

    /// The first place that meets the target in [`from`, `top`], where it is met at `top` and from one place on.
    fn first_met(&self, from: f32, top: f32) -> f32 {
        let (mut outside, mut inside) = (from, top);
        if self.first_hop_meets(from) {
            return from;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (outside + inside);
            if !(middle > outside && middle < inside) {
                break;
            }
            if self.first_hop_meets(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }

    /// Where relay `index` + 1 stands, in its range from `low` on, when relay `index` stands at `at`.
    fn onward(&self, index: u16, at: f32, low: f32) -> Option<f32> {
        let apart = self.mission.least_step(0.0);
        let heard = |step: &Step| step.from_m <= at && step.to_m - at >= apart && step.to_m > at;
        // Where the longest hop ends; where that is behind, as near as may be.
        let near = (at + apart).max(at.next_up()).max(low);
        self.longest(index, low)
            .filter(heard)
            .or_else(|| self.step(index, near).filter(heard))
            .map(|step| step.to_m)
    }

    fn is_met(&self) -> bool {
        self.ranges(|_, _| {})
            .and_then(|low| self.head(low))
            .is_some()
    }
}

/// The fewest equals that meet `target` in a field; see [`super::fewest`].
///
/// More relays never meet less where they may stand as close as they like, so the number is found by halving.
pub(super) fn fewest(mission: &Mission, target: f32, profile: Profile) -> Option<Fewest> {
    let met_by = |mission: &Mission, relays: u16| {
        mission.with_relays(relays).is_ok_and(|mission| {
            let equals = Equals {
                mission: &mission,
                profile,
                target,
            };
            equals.is_met()
        })
    };
    let freely = mission.unseparated();
    let (mut too_few, mut enough) = (0, 1);
    while !met_by(&freely, enough) {
        if enough >= MAX_RELAYS {
            return None;
        }
        too_few = enough;
        enough = (enough * 2).min(MAX_RELAYS);
    }
    while enough - too_few > 1 {
        let middle = too_few + (enough - too_few) / 2;
        if met_by(&freely, middle) {
            enough = middle;
        } else {
            too_few = middle;
        }
    }
    (enough..=enough.saturating_add(MORE))
        .find(|&relays| met_by(mission, relays))
        .map(|relays| Fewest {
            relays,
            proven: true,
        })
}

/// The places of the mission's equals for `target`, which go to their ranges' beginnings where the first hop lets them.
pub(super) fn places(
    mission: &Mission,
    target: f32,
    profile: Profile,
    places: &mut [Placement],
) -> bool {
    let equals = Equals {
        mission,
        profile,
        target,
    };
    let mut set = |index: u16, x_m: f32| {
        if let Some(place) = places.get_mut(usize::from(index).wrapping_sub(1)) {
            *place = Placement::on_line(x_m, profile.altitude_m);
        }
    };
    let head = equals.ranges(&mut set).and_then(|low| equals.head(low));
    let Some(mut at) = head else { return false };
    set(1, at);
    for index in 1..mission.relays() {
        let Some(low) = places.get(usize::from(index)).map(|place| place.x_m) else {
            return false;
        };
        let Some(next) = equals.onward(index, at, low) else {
            return false;
        };
        at = next;
        if let Some(place) = places.get_mut(usize::from(index)) {
            place.x_m = at;
        }
    }
    true
}

/// The highest target (linear, to an f32's own step) that the mission's N equals, which hold `profile`, meet in its field; `None`
/// without a field, or where none is met.
///
/// The optimum where no least separation binds: `the_best_of_equals_in_a_field` in `host-tests/tests/fleet.rs`. Algorithm 4 may be
/// below it in an uneven field. Work: 48 chains, each three square roots for every point of the field and relay.
pub fn best(mission: &Mission, profile: Profile) -> Option<f32> {
    mission.field()?;
    let met = |target: f32| {
        let equals = Equals {
            mission,
            profile,
            target,
        };
        equals.is_met()
    };
    // The last hop from right above Rx.
    let mut high = mission.receiver_gain(profile.power_w) / square(profile.altitude_m);
    if met(high) {
        return Some(high);
    }
    let mut low = 0.0;
    for _ in 0..TARGETS {
        // In powers first: the targets span many decades.
        let middle = if high > 4.0 * low {
            sqrt(high * low.max(high * 1e-6))
        } else {
            0.5 * (low + high)
        };
        if !(middle > low && middle < high) {
            break;
        }
        if met(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low > 0.0).then_some(low)
}
