//! Pass of target SIRs along the chain: the relays' reaches, the last relay's verdict, the positions.
//!
//! Toward Rx (Algorithm 1) a relay's *reach* is the farthest x at which it receives the previous relay. The previous
//! relay may be at any x up to its own reach; the best of these x counts. Toward Tx (Algorithm 4) the reach is the x
//! closest to Tx from which the previous relay of the pass receives this relay; again the best x of the previous relay
//! counts. So no chain that meets the target is excluded, and a missed target is out of reach of every chain. See
//! [`spacing`](super::spacing) and [`retreat`](super::retreat) for the reasons why a relay may have to hold back.
//!
//! When the verdict travels back along the chain, each relay takes its position, and
//! [`required_position`](Link::required_position) returns the position that the previous relay of the pass must take.
//! In a *plain* pass no relay holds back: every hop leads from reach to reach, as in the paper.
//!
//! The *slack* of a target is the maximum length of a chain that meets it, less the distance D from Tx to Rx: below 0 if the target is
//! missed. The [`Verdict`] of the last relay has the slacks of the targets, and the target to commit, if any. A `Walk` is a whole
//! chain for one target, without messages: reaches from the leader to the last relay, and required positions on the way back.

use core::iter::successors;

use super::PerTarget;
use super::from_rx::FromRx;
use super::ladder::{Ladder, TARGETS};
use super::retreat::{HopInterference, Retreat, Step, least};
use super::spacing::{Hop, RequiredPosition, receiver_reach};
use crate::features::ALTITUDE;
use crate::mission::{Mission, Profile, ROUNDING};
use crate::place::Station;
use crate::root::sqrt_in_place;
use crate::side::Heading;
use crate::sir::{self, Sender, square, transmitter_gain};

/// Maximum number of x that the last relay tries for a sufficient SIR of the hop from Rx to it. Used only for data in
/// both directions.
const HOLDS: u8 = 4;

/// Maximum number of points of the interference field that one call evaluates. The evaluation of one target is
/// completed even if it needs more.
const POINTS_AT_ONCE: usize = 128;

/// Data of the previous relay of a pass along the chain, as stated in its message.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Behind {
    /// Lateral offset, altitude and power of the previous relay.
    pub relay: Station,
    /// Upsilon, the mean inverse interference power that the previous relay has measured, 1/W. `None` to use the
    /// mission's interference field. Only passes from Rx to Tx, in an interference field, use this value.
    pub measured_per_w: Option<f32>,
}

impl Behind {
    /// Returns a previous relay with the altitude and power `profile`, vertically above the line Tx to Rx. It has no
    /// measurement.
    pub(super) const fn of(profile: Profile) -> Self {
        Self {
            relay: profile.on_line(),
            measured_per_w: None,
        }
    }
}

/// Relay in a pass along the chain, with all data to compute its reach for a target SIR. The reach is the x at which
/// the relay meets the target and is farthest in the direction of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Link<'a> {
    /// Mission in which the chain of relays flies.
    pub mission: &'a Mission,
    /// Previous relay of the pass; `None` for the first relay, which is next to Tx or Rx.
    pub behind: Option<Behind>,
    /// Index of the relay in the chain: 1 for the relay next to Tx, N for the relay next to Rx.
    pub index: u16,
    /// Lateral offset, altitude and transmit power of this relay.
    pub own: Station,
    /// Upsilon, the mean inverse interference power, measured by the relay, 1/W. `None` to use the mission's
    /// interference field.
    pub measured_per_w: Option<f32>,
    /// True for a plain pass: every relay takes the farthest x that meets the target. False if a relay may stop before
    /// that x, so that the next relay of the pass gets farther.
    pub plain: bool,
    /// Maximum x of the relay, m, which leaves the relays toward Rx space for their separation. `None` unless the joint
    /// method, which optimises x, y and altitude together, has computed it. Not used in an interference field.
    pub end_m: Option<f32>,
    /// Fixed x of this relay, m; `None` unless the mission has fitted slots (as long as each hop needs). The relay
    /// takes this x for every target that the hop to it meets there, and has no x for other targets.
    pub fixed_m: Option<f32>,
}

/// Returns the x at which a pass starts, repeated for every target, m. It is the x of Tx, or of Rx in an interference
/// field.
pub(crate) fn origins(mission: &Mission) -> PerTarget {
    PerTarget::from([origin(mission); TARGETS])
}

/// Returns the x at which a pass starts, m: the x of Tx, or the x of Rx with an interference field.
pub fn origin(mission: &Mission) -> f32 {
    match mission.heading() {
        Heading::TowardRx => 0.0,
        Heading::TowardTx => mission.config().distance_m,
    }
}

impl<'a> Link<'a> {
    /// Appends this relay's reaches for the remaining `targets`: those from index `reaches.len()` on. A reach is the x
    /// farthest along the pass at which the relay meets a target.
    ///
    /// `targets` is in ascending order, and entry i of each list belongs to target i. `from` has the reaches of the
    /// previous relay of the pass, m. The list ends before the first target that cannot be met. Work for each target:
    /// one computation of a hop; in an interference field, up to three for each point of the field.
    pub fn extend(&self, targets: &[f32], from: &[f32], reaches: &mut PerTarget) {
        let done = reaches.len();
        let mut pairs = targets.iter().zip(from).skip(done);
        if let Some(x_m) = self.fixed_m
            && ALTITUDE
        {
            let reach = |(&target, &from_m): (&f32, &f32)| {
                self.is_met_at(x_m, target, from_m).then_some(x_m)
            };
            fill(reaches, pairs.map_while(reach));
            return;
        }
        match self.onward() {
            // Checked once for all the targets of a sweep.
            Some(Onward::Rx(hop)) if hop.is_simple() && !self.plain => {
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
                let latest = self.latest();
                let reach = |(&target, &from_m): (&f32, &f32)| {
                    Some(self.longest(&hop, target, from_m, latest)?.from_m)
                };
                fill(reaches, pairs.map_while(reach));
            }
            None => {
                pairs.next();
            }
        }
    }

    /// Continues [`extend`](Self::extend) by bounded work; returns true once all reaches are computed. One call
    /// computes 16 reaches. In an interference field it stops after it has evaluated 128 points of the field, but
    /// computes at least one reach.
    pub(crate) fn go_on(&self, targets: &[f32], from: &[f32], reaches: &mut PerTarget) -> bool {
        let points = self.mission.field().map_or(1, |field| field.points().len());
        let due = reaches.len() + (POINTS_AT_ONCE / points.max(1)).clamp(1, TARGETS);
        self.extend(targets.get(..due).unwrap_or(targets), from, reaches);
        let all = targets.len().min(from.len());
        reaches.len() < due.min(all) || reaches.len() == all
    }

    pub fn reach(&self, target: f32, from_m: f32) -> Option<f32> {
        let mut reaches = PerTarget::new();
        self.extend(&[target], &[from_m], &mut reaches);
        reaches.first().copied()
    }

    /// Returns true if the hop from the previous node at `from_m` to this relay at `x_m` meets `target`. The hop must
    /// meet it in both directions of data, if there are two. If the previous node is a relay, it must be closer to Tx
    /// than this relay, and both must be separated.
    fn is_met_at(&self, x_m: f32, target: f32, from_m: f32) -> bool {
        let mission = self.mission;
        let at = self.own.cross_section.at(x_m);
        let (there, back, apart) = match self.behind {
            None => (
                Sender::transmitter(mission).sir_at(mission, from_m, at),
                sir::at_transmitter(mission, at, self.own.power_w),
                0.0,
            ),
            Some(Behind { relay, .. }) => {
                let across = at.cross_section().apart_squared(relay.cross_section);
                let before = relay.cross_section.at(from_m);
                (
                    Sender::relay(mission, relay).sir_at(mission, from_m, at),
                    Sender::relay(mission, self.own).sir_at(mission, x_m, before),
                    mission.least_step(across).max(from_m.next_up() - from_m),
                )
            }
        };
        let rounding = mission.config().distance_m * ROUNDING;
        x_m - from_m >= apart - rounding && there >= target && back >= mission.reverse() * target
    }

    fn onward(&self) -> Option<Onward<'a>> {
        let mission = self.mission;
        if let Some(interferer) = mission.interferer() {
            let sender = self.behind.map_or(Sender::transmitter(mission), |behind| {
                Sender::relay(mission, behind.relay)
            });
            let hop = Hop::new(
                mission,
                interferer,
                sender,
                self.index,
                self.own.cross_section,
                0.0,
            )
            .both_ways(mission, self.own.power_w);
            return Some(Onward::Rx(match self.end_m {
                Some(end_m) => hop.ending(end_m),
                None if self.plain => hop,
                None => hop.to_the_end(mission, self.index),
            }));
        }
        mission.field()?;
        let altitude_m = self
            .behind
            .map(|behind| behind.relay.cross_section.altitude_m);
        let power_w = self.behind.map(|behind| behind.relay.power_w);
        let hop = Retreat::new(mission, self.own, self.index, altitude_m).both_ways(
            mission,
            power_w,
            self.measured_per_w,
        );
        Some(Onward::Tx(if self.plain {
            hop
        } else {
            hop.to_the_end(mission, self.index)
        }))
    }

    /// Returns the maximum x of the previous relay, m, in a pass from Rx to Tx.
    ///
    /// The relays between the previous relay and Rx need no separation in x: they can be above each other.
    fn latest(&self) -> f32 {
        self.mission.latest_freely(self.index.saturating_add(1))
    }

    /// Returns the hop that meets `target` with the smallest possible x of this relay, its sender. The function chooses
    /// the receiver's x from `low` to `high`, m; in a plain pass this x is `low`. `None` if no such hop meets `target`.
    fn longest(&self, hop: &Retreat<'_>, target: f32, low: f32, high: f32) -> Option<Step> {
        let (mission, distance_m) = (self.mission, self.mission.config().distance_m);
        // Hops toward Tx exist in fields only; without the feature the compiler removes them here.
        mission.field()?;
        // A position beyond Rx in a neighbour's message is not used.
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

    /// Returns the chain's slack for `target`, m, and the x of this last relay, m.
    ///
    /// `reach` is this relay's reach (its x farthest along the pass for the target), and `from_m` the reach of the
    /// previous relay. `None` if the target cannot be met at any x. In a pass toward Rx, the slack is `reach` plus the
    /// maximum length of the last hop, minus the distance from Tx to Rx. In a pass toward Tx, it is the maximum length
    /// of the first hop minus this relay's x, which is chosen for the largest slack.
    pub fn ending(&self, target: f32, from_m: f32, reach: f32) -> Option<(f32, f32)> {
        let mission = self.mission;
        if mission.field().is_none() {
            let last_hop = receiver_reach(mission, self.own, target)?;
            let slack = |place: f32| place - mission.config().distance_m + last_hop;
            return Some(match FromRx::new(mission, self.own) {
                Some(hop) => self.held(&hop, target, from_m, reach, slack),
                None => (slack(reach), reach),
            });
        }
        let c = mission.tx_gain().value() / target;
        let beyond = square(self.own.cross_section.altitude_m);
        // Tx hears the first hop of the way back up to this squared length.
        let returned = if mission.reverse() > 0.0 {
            transmitter_gain(mission, self.own.power_w) / mission.reverse() / target
        } else {
            f32::INFINITY
        };
        let value = |place: f32, quiet: f32| {
            // Limited to 1e9 m, as the last hop toward Rx, since an infinite slack cannot be sent.
            let squared = mission.tx_gain().value() * quiet / target;
            let squared = squared.min(returned).min(1e18) - beyond;
            // If no position is close enough, the root of the negated square keeps the slack continuous in the target.
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
            let kink = if returned < f32::INFINITY {
                returned
            } else {
                beyond
            };
            least(interference, c, [beyond, kink], reach, high, value)?
        };
        Some(((-step.from_m).max(-1e9), step.to_m))
    }

    /// Returns the largest x of this relay, m, at which the hop from the previous relay meets `target`. It is at most
    /// `most_m`. The previous relay of the pass may take any x up to `from_m`, the farthest x at which it meets the
    /// target. `None` if there is no such x.
    fn reached(&self, target: f32, from_m: f32, most_m: f32) -> Option<f32> {
        match self.onward()? {
            Onward::Rx(hop) if most_m > from_m => hop.ending(most_m).outermost(target, from_m),
            _ => Some(most_m),
        }
    }

    /// Returns the chain's slack and this last relay's x, m, for data in both directions. The slack is the maximum
    /// length of the chain minus the distance from Tx to Rx. `hop` leads from Rx to this relay, and `slack` returns the
    /// slack for data toward Rx, for an x of this relay. If the relay's SIR from Rx is too low at `reach`, the function
    /// searches for a smaller x.
    fn held(
        &self,
        hop: &FromRx,
        target: f32,
        from_m: f32,
        reach: f32,
        slack: impl Fn(f32) -> f32,
    ) -> (f32, f32) {
        let margin = hop.margin(target, reach);
        if !(margin >= 0.0) && !self.plain {
            let before = f32::from(self.index.saturating_sub(1));
            let least_m = before * self.mission.step_with_room(0.0);
            let mut most_m = reach;
            for _ in 0..HOLDS {
                let Some(held) = hop.hold(target, least_m, most_m) else {
                    break;
                };
                let place = self.reached(target, from_m, held);
                let Some(place) = place.filter(|place| slack(*place) >= 0.0) else {
                    break;
                };
                if place >= held || hop.margin(target, place) >= 0.0 {
                    return (slack(place), place);
                }
                most_m = place;
            }
        }
        (slack(reach).min(margin), reach)
    }

    /// Returns the x of the previous relay that `target` requires if this relay is at x = `place`.
    ///
    /// `from_m` is the farthest x of the previous relay that meets `target`. `None` if the previous relay has no
    /// suitable x. The search assumes that its suitable x are one interval without gaps, which is not always true.
    /// Work: at most two computations of a reach; in an interference field at most three for each point of the field.
    pub fn required_position(
        &self,
        target: f32,
        from_m: f32,
        place: f32,
    ) -> Option<RequiredPosition> {
        if self.plain {
            return Some(RequiredPosition::AtReach);
        }
        match self.onward()? {
            Onward::Rx(hop) => hop.required_position(target, from_m, place),
            Onward::Tx(hop) => {
                // Without the feature `field` the compiler removes this branch here.
                self.mission.field()?;
                let heard_m = hop.heard_up_to(target, place);
                let Some(behind) = self.behind else {
                    let is_met = heard_m >= self.mission.config().distance_m;
                    return is_met.then_some(RequiredPosition::AtReach);
                };
                let apart = self.mission.least_step(
                    self.own
                        .cross_section
                        .apart_squared(behind.relay.cross_section),
                );
                let low = from_m.max(place + apart).max(place.next_up());
                let interference = HopInterference::new(self.mission, behind.measured_per_w);
                // A position with room along the line for all relays toward Rx, at any altitude, is preferred.
                let clear = self.mission.latest(self.index.saturating_add(1));
                let to = |high| {
                    let high = heard_m.min(high);
                    // With data in both directions the closest one is preferred: it is best for data from Rx to Tx.
                    let near = if heard_m < f32::INFINITY { low } else { high };
                    let step = |high| {
                        let step = hop.longest_there(interference, target, low, high)?;
                        (step.from_m <= place).then_some(step)
                    };
                    step(near).or_else(|| step(high))
                };
                let step = to(clear).or_else(|| to(self.latest()))?;
                Some(if step.to_m <= from_m {
                    RequiredPosition::AtReach
                } else {
                    RequiredPosition::At(step.to_m)
                })
            }
        }
    }
}

enum Onward<'a> {
    Rx(Hop),
    Tx(Retreat<'a>),
}

fn fill(reaches: &mut PerTarget, places: impl Iterator<Item = f32>) {
    for place in places {
        if reaches.push(place).is_err() {
            break;
        }
    }
}

/// Returns the result of a pass of target SIRs (a sweep), computed by its last relay, `link`. `reaches` has the x
/// farthest along the pass, m, at which this relay meets each target. `from` has the corresponding x of the previous
/// relay.
pub fn close(link: &Link<'_>, ladder: Ladder, from: &[f32], reaches: &[f32]) -> Verdict {
    let targets = ladder.targets();
    let mut slacks = PerTarget::new();
    let ends = targets.iter().zip(from.iter().zip(reaches));
    fill(
        &mut slacks,
        ends.map_while(|(&target, (&from_m, &reach))| Some(link.ending(target, from_m, reach)?.0)),
    );
    Verdict::new(link.mission, ladder, &targets, slacks)
}

/// Result of a sweep (a pass of target SIRs): the chain's slacks, and the target to commit, if any. A slack is the
/// maximum length of a chain that meets a target, minus the distance from Tx to Rx.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Verdict {
    /// Index of the committed target in the pass's list of targets. The relays take their positions for this target.
    /// `None` if no target is committed and the search goes on.
    pub commit: Option<u8>,
    /// Slack of the chain for each target that every hop can meet, m. The slack is the maximum length of the chain
    /// minus the distance from Tx to Rx. It is 0 or more if the chain meets the target.
    pub slacks: PerTarget,
}

impl Verdict {
    /// Returns the result of a pass with the targets of `ladder`. `slacks` are the chain's slacks, m, one for each of
    /// its `targets`.
    ///
    /// The chain is committed to the highest target that it meets in two cases: if the ladder has a single target, as
    /// in the paper's Algorithm 1; or if the chain misses the next higher target, and the relative difference of the
    /// two targets is within the mission's tolerance.
    pub(crate) fn new(
        mission: &Mission,
        ladder: Ladder,
        targets: &[f32],
        slacks: PerTarget,
    ) -> Self {
        let met = met(&slacks);
        let commit = match (
            met.checked_sub(1).and_then(|best| targets.get(best)),
            targets.get(met),
        ) {
            (Some(best), Some(next)) => next - best <= mission.config().tolerance * best,
            (Some(_), None) => ladder.is_single(),
            (None, _) => false,
        };
        Self {
            commit: if commit {
                u8::try_from(met - 1).ok()
            } else {
                None
            },
            slacks,
        }
    }
}

/// Returns the number of targets up to the highest target that is met; 0 if none is met. A target is met if its slack
/// is 0 or more. A missed target below the highest met one is also counted. Such a target can occur in a varying field
/// or at different altitudes.
pub(crate) fn met(slacks: &[f32]) -> usize {
    slacks
        .iter()
        .rposition(|slack| *slack >= 0.0)
        .map_or(0, |last| last + 1)
}

/// Computation of the x of all relays for one target, in one program and without messages.
#[derive(Debug)]
pub struct Walk<'a, F> {
    pub mission: &'a Mission,
    pub target: f32,
    plain: bool,
    profile_of: &'a F,
}

impl<'a, F: Fn(u16) -> Profile> Walk<'a, F> {
    pub const fn new(mission: &'a Mission, target: f32, plain: bool, profile_of: &'a F) -> Self {
        Self {
            mission,
            target,
            plain,
            profile_of,
        }
    }

    /// Returns this computation for a plain pass: every relay takes the farthest x that meets the target.
    pub const fn plainly(&self) -> Self {
        Self::new(self.mission, self.target, true, self.profile_of)
    }

    pub fn link(&self, index: u16) -> Link<'_> {
        let before = before(self.mission, index);
        Link {
            mission: self.mission,
            behind: before.map(|index| Behind::of((self.profile_of)(index))),
            index,
            own: (self.profile_of)(index).on_line(),
            measured_per_w: None,
            plain: self.plain,
            end_m: None,
            fixed_m: None,
        }
    }

    /// Returns the relays' reaches in the order of the pass, up to a hop that misses the target. A reach is the x
    /// farthest along the pass at which the relay meets the target.
    ///
    /// Each item has the index of a relay, the reach of the previous relay of the pass, m, and the reach of this relay,
    /// m.
    pub fn reaches(&self) -> impl Iterator<Item = (u16, f32, f32)> {
        let mut reach = origin(self.mission);
        let relays = successors(Some(self.mission.leader()), |at| self.mission.after(*at));
        relays.map_while(move |at| {
            let before_m = reach;
            reach = self.link(at).reach(self.target, before_m)?;
            Some((at, before_m, reach))
        })
    }

    /// Returns the reach of relay `index`, m, if every relay can take its reach as its x. Otherwise returns `None`. A
    /// reach is the x farthest along the pass that meets the target. With `index` 0 the function only checks this
    /// condition: it then returns an arbitrary number.
    fn at_reach(&self, index: u16) -> Option<f32> {
        let plain = self.plainly();
        let mut place = None;
        for (at, before_m, reach) in self.reaches() {
            if plain.link(at).reach(self.target, before_m)?.to_bits() != reach.to_bits() {
                return None;
            }
            if at == index || index == 0 {
                place = Some(reach);
            }
            if at == last(self.mission) {
                let (_, end) = self.link(at).ending(self.target, before_m, reach)?;
                return place.filter(|_| end.to_bits() == reach.to_bits());
            }
        }
        None
    }

    /// Returns the reach of relay `index`, m: the x farthest along the pass that meets the target. For `index` `None`,
    /// it returns the x at which the pass starts. The result is `None` if a hop cannot meet the target.
    fn reach(&self, index: Option<u16>) -> Option<f32> {
        let Some(index) = index else {
            return Some(origin(self.mission));
        };
        let own = self.reaches().find(|(at, ..)| *at == index);
        own.map(|(_, _, reach)| reach)
    }

    /// Returns the x of relay `index`, m; `None` if some relay cannot take the x that the target requires. With `index`
    /// 0 the function only checks this: it returns an arbitrary number if all relays can take their x.
    pub fn place(&self, index: u16) -> Option<f32> {
        if self.plain && index > 0 {
            return self.reach(Some(index));
        }
        if let Some(place) = self.at_reach(index) {
            return Some(place);
        }
        let at = last(self.mission);
        let (before_m, reach) = (self.reach(before(self.mission, at))?, self.reach(Some(at))?);
        let (_, place) = self.link(at).ending(self.target, before_m, reach)?;
        let mut own = None;
        let end = self.settle(place, |at, place, before| {
            if at == index {
                own = Some(place);
                return None;
            }
            self.reach(before)
        });
        own.or(end)
    }

    /// Computes the position of every relay, from the last relay of the pass back to the first. The last relay is at x
    /// = `place`, m.
    ///
    /// `visit` gets a relay's index, its x, and the index of the previous relay of the pass. It returns the farthest x
    /// of the previous relay that meets the target, m; for the first relay of the pass, it returns the x at which the
    /// pass starts. The function returns the x that is required of the node before the first relay. It returns `None`
    /// if a relay cannot take the required x, or if `visit` returns `None`.
    pub fn settle(
        &self,
        place: f32,
        mut visit: impl FnMut(u16, f32, Option<u16>) -> Option<f32>,
    ) -> Option<f32> {
        let (mut at, mut place) = (last(self.mission), place);
        loop {
            let before = before(self.mission, at);
            let reach = visit(at, place, before)?;
            let required = self.link(at).required_position(self.target, reach, place)?;
            place = required.or_reach(reach);
            let Some(before) = before else {
                return Some(place);
            };
            at = before;
        }
    }
}

/// Returns the index of the last relay of a pass.
const fn last(mission: &Mission) -> u16 {
    match mission.heading() {
        Heading::TowardRx => mission.relays(),
        Heading::TowardTx => 1,
    }
}

fn before(mission: &Mission, index: u16) -> Option<u16> {
    match mission.heading() {
        Heading::TowardRx => index.checked_sub(1).filter(|before| *before > 0),
        Heading::TowardTx => (index < mission.relays()).then(|| index.saturating_add(1)),
    }
}
