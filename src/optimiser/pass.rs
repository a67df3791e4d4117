//! One pass of targets along the chain: what each relay makes of what the one before it hands on, how the last one ends it,
//! and what the verdict that comes back makes of it.
//!
//! Toward Rx (Algorithm 1) a relay's *reach* is the farthest place that still hears the relay before it well enough, wherever
//! that one stands up to its own reach; toward Tx (Algorithm 4) it is the place nearest to Tx from which it is still heard,
//! wherever the one that hears it stands. So no chain that meets the target is left out, and a target that is missed is out of
//! reach of every chain: see [`spacing`](super::spacing) and [`retreat`](super::retreat) for what may hold a relay back.
//!
//! On the way back each relay has taken its place, and [`stand`](Link::stand) tells where the one before it on the pass is to be.
//! A *plain* pass holds nobody back: every hop leads from reach to reach, as in the paper.

use super::PerTarget;
use super::ladder::{Ladder, TARGETS};
use super::retreat::{HopInterference, Retreat, Step, least};
use super::spacing::{Hop, Stand, receiver_reach};
use super::verdict::Verdict;
use crate::mission::{Heading, Mission, Profile};
use crate::place::Station;
use crate::root::sqrt_in_place;
use crate::sir::{Sender, square};

/// Points of a field that are looked at in one call: for as many targets as that makes, and one at least.
const POINTS_AT_ONCE: usize = 128;

/// The relay that a pass comes from, as its message tells.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Behind {
    /// Where it flies across the line, and its power.
    pub relay: Station,
    /// Upsilon as it measures it where it stands, 1/W, if it uses that instead of the agreed field. Means nothing toward Rx.
    pub measured_per_w: Option<f32>,
}

impl Behind {
    /// A relay above the line that uses the agreed field.
    pub(super) const fn of(profile: Profile) -> Self {
        Self {
            relay: profile.on_line(),
            measured_per_w: None,
        }
    }
}

/// A relay on a pass.
#[derive(Clone, Copy, Debug)]
pub struct Link<'a> {
    /// The mission it flies.
    pub mission: &'a Mission,
    /// The relay that the pass comes from; `None` for the first one, which begins at Tx or Rx.
    pub behind: Option<Behind>,
    /// Its place in the chain, 1 next to Tx.
    pub index: u16,
    /// Where it flies across the line, and its power.
    pub own: Station,
    /// Upsilon as it measures it, 1/W, if it uses that.
    pub measured_per_w: Option<f32>,
    /// Whether nobody holds back.
    pub plain: bool,
    /// How far along x it goes at most, where the joint method has said that, m: then nobody holds back either.
    pub end_m: Option<f32>,
}

/// Where a pass begins, as reaches: at Tx, or at Rx in a field, for every target.
pub(crate) fn origins(mission: &Mission) -> PerTarget {
    PerTarget::from([origin(mission); TARGETS])
}

/// The same for one target, m.
pub(crate) fn origin(mission: &Mission) -> f32 {
    match mission.heading() {
        Heading::TowardRx => 0.0,
        Heading::TowardTx => mission.config().distance_m,
    }
}

impl Link<'_> {
    /// The reaches for as many of the rising `targets` as it can meet, appended to `reaches`, which has the first of them already.
    ///
    /// `from` are the reaches of the relay before, m. Bounded by a reach a target; in a field by three for each of its points.
    pub fn extend(&self, targets: &[f32], from: &[f32], reaches: &mut PerTarget) {
        let done = reaches.len();
        let mut pairs = targets.iter().zip(from).skip(done);
        match self.onward() {
            // Asked once for all the targets of a sweep.
            Some(Onward::Rx(hop)) if hop.is_silent() && !self.plain => {
                let reach =
                    |(&target, &from_m): (&f32, &f32)| hop.outermost_in_silence(target, from_m);
                fill(reaches, pairs.map_while(reach));
            }
            Some(Onward::Rx(hop)) => {
                let reach = |(&target, &from_m): (&f32, &f32)| {
                    if self.plain {
                        hop.reach(target, from_m)
                    } else {
                        hop.outermost(target, from_m)
                    }
                };
                fill(reaches, pairs.map_while(reach));
            }
            Some(Onward::Tx(hop)) => {
                let longest = |target, from_m| self.longest(&hop, target, from_m, self.latest());
                fill(
                    reaches,
                    pairs.map_while(|(&target, &from_m)| Some(longest(target, from_m)?.from_m)),
                );
            }
            None => {
                pairs.next();
            }
        }
    }

    /// The same for as many more targets as one call of a relay may; whether these are all.
    ///
    /// Bounded by 16 reaches; in a field by 128 of its points, or by one target.
    pub(crate) fn go_on(&self, targets: &[f32], from: &[f32], reaches: &mut PerTarget) -> bool {
        let points = self.mission.field().map_or(1, |field| field.points().len());
        let due = reaches.len() + (POINTS_AT_ONCE / points.max(1)).clamp(1, TARGETS);
        self.extend(targets.get(..due).unwrap_or(targets), from, reaches);
        let all = targets.len().min(from.len());
        reaches.len() < due.min(all) || reaches.len() == all
    }

    /// The reach for one target.
    pub(crate) fn reach(&self, target: f32, from_m: f32) -> Option<f32> {
        let mut reaches = PerTarget::new();
        self.extend(&[target], &[from_m], &mut reaches);
        reaches.first().copied()
    }

    fn onward(&self) -> Option<Onward> {
        let mission = self.mission;
        if let Some(interferer) = mission.interferer() {
            let sender = self.behind.map_or(Sender::transmitter(mission), |behind| {
                Sender::relay(mission, behind.relay)
            });
            let hop = Hop::new(mission, interferer, sender, self.index, self.own.at, 0.0);
            return Some(Onward::Rx(match self.end_m {
                Some(end_m) => hop.ending(end_m),
                None if self.plain => hop,
                None => hop.to_the_end(mission, self.index),
            }));
        }
        mission.field()?;
        let altitude_m = self.behind.map(|behind| behind.relay.at.altitude_m);
        let hop = Retreat::new(mission, self.own, self.index, altitude_m);
        Some(Onward::Tx(if self.plain {
            hop
        } else {
            hop.to_the_end(mission, self.index)
        }))
    }

    /// The last place that the relay before on a pass toward Tx may take, m: as many as its neighbours' altitudes allow may be above
    /// each other.
    fn latest(&self) -> f32 {
        self.mission.latest_freely(self.index.saturating_add(1))
    }

    /// The hop that begins nearest to Tx of all that end from `low` to `high`; on a plain pass, at `low`.
    fn longest(&self, hop: &Retreat, target: f32, low: f32, high: f32) -> Option<Step> {
        let (mission, distance_m) = (self.mission, self.mission.config().distance_m);
        // A hop toward Tx is one in a field: where there can be none, the image has nothing of it.
        mission.field()?;
        // Whatever a neighbour says, nobody stands beyond Rx.
        if low > distance_m {
            return None;
        }
        let Some(behind) = self.behind else {
            let from_m = hop.reach(target, low, 1.0)?;
            return Some(Step { to_m: low, from_m });
        };
        let interference = HopInterference::new(mission, behind.measured_per_w);
        if self.plain {
            let from_m = hop.reach(target, low, interference.quiet(low))?;
            return Some(Step { to_m: low, from_m });
        }
        hop.longest(interference, target, low, high)
    }

    /// By how much a chain whose last relay this is overshoots for `target`, m: not negative when it closes; and where in its
    /// range, whose end `reach` is, it then stands. `None` where Rx cannot be reached from anywhere.
    ///
    /// Toward Rx the slack is reach + `d_max` - D; toward Tx it is the same seen from the other end, the farthest that the first
    /// hop may be minus the place, at that place of the range where it is most.
    pub fn ending(&self, target: f32, reach: f32) -> Option<(f32, f32)> {
        let mission = self.mission;
        if mission.field().is_none() {
            let last_hop = receiver_reach(mission, self.own, target)?;
            return Some((reach - mission.config().distance_m + last_hop, reach));
        }
        let c = mission.tx_gain().value() / target;
        let beyond = square(self.own.at.altitude_m);
        let value = |place: f32, quiet: f32| {
            // Cut at 1e9 m, as the last hop toward Rx: an infinite slack would not be sent.
            let squared = (mission.tx_gain().value() * quiet / target).min(1e18) - beyond;
            // Where no place is near enough, by how much the square is negative: it stays continuous in the target.
            Some(place - sqrt_in_place(squared.abs()).copysign(squared))
        };
        let interference = HopInterference::new(mission, self.measured_per_w);
        let here = value(reach, interference.quiet(reach))?;
        let high = if self.plain {
            reach
        } else {
            mission.latest_freely(self.index)
        };
        let step = if here <= 0.0 || high < reach {
            Step {
                to_m: reach,
                from_m: here,
            }
        } else {
            least(interference, c, [beyond, beyond], reach, high, value)?
        };
        Some(((-step.from_m).max(-1e9), step.to_m))
    }

    /// Where the relay before is to stand, whose reach for `target` is `from_m`, when this one stands at `place`; `None` where
    /// it is heard, or hears, from nowhere: a range was taken for one without holes, and has one.
    ///
    /// Bounded by two reaches, in a field by three for each of its points.
    pub fn stand(&self, target: f32, from_m: f32, place: f32) -> Option<Stand> {
        if self.plain {
            return Some(Stand::AtReach);
        }
        match self.onward()? {
            Onward::Rx(hop) => hop.stand(target, from_m, place),
            Onward::Tx(hop) => {
                let Some(behind) = self.behind else {
                    return Some(Stand::AtReach);
                };
                let apart = self
                    .mission
                    .least_step(self.own.at.apart_squared(behind.relay.at));
                let low = from_m.max(place + apart).max(place.next_up());
                // Rather where all that are toward Rx of it have room along the line, however high they fly.
                let clear = self.mission.latest(self.index.saturating_add(1));
                let to = |high| {
                    let step = self.longest(&hop, target, low, high)?;
                    (step.from_m <= place).then_some(step)
                };
                let step = to(clear).or_else(|| to(self.latest()))?;
                Some(if step.to_m <= from_m {
                    Stand::AtReach
                } else {
                    Stand::At(step.to_m)
                })
            }
        }
    }
}

/// A hop of either heading.
enum Onward {
    Rx(Hop),
    Tx(Retreat),
}

fn fill(reaches: &mut PerTarget, places: impl Iterator<Item = f32>) {
    for place in places {
        if reaches.push(place).is_err() {
            break;
        }
    }
}

/// The verdict on the pass, by the last relay, `link`, which has these `reaches`.
pub fn close(link: &Link<'_>, ladder: Ladder, reaches: &[f32]) -> Verdict {
    let targets = ladder.targets();
    let mut slacks = PerTarget::new();
    let ends = targets.iter().zip(reaches);
    fill(
        &mut slacks,
        ends.map_while(|(&target, &reach)| Some(link.ending(target, reach)?.0)),
    );
    Verdict::new(link.mission, ladder, &targets, slacks)
}
