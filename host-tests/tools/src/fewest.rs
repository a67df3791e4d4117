//! Number of relays for a target SIR, and their positions: the paper's eq. (Opt), and Problem 1 in a field.
//!
//! | interference | profiles | method | accuracy |
//! | --- | --- | --- | --- |
//! | one interferer | any | farthest positions | exact if `proven`: no chain with one relay fewer meets the target |
//! | a field | equal | ranges of equal relays | exact, also in an uneven field; the paper uses an exhaustive search there |
//! | a field | different | farthest positions | result of Algorithm 4; not proven |
//!
//! A minimum separation can only raise the number. If the number is the same without it, it is proven; otherwise it is
//! not.
//!
//! **Farthest positions:** the paper's eq. (Opt) and Problem 1. The reach of a relay is the farthest x that it can have
//! (see `optimiser::pass`). If the reach of relay n is too far from Rx for the last hop, n relays cannot meet the
//! target. The printed search starts with two relays; one may be enough.
//!
//! **Ranges of equal relays** in a field: the exact solution of the paper's Problem 1. Without a minimum separation,
//! more equal relays never have a lower SIR. They meet a target if and only if the ranges of `optimiser::retreat` end
//! at a position that the first hop can reach.

use uav_relay::optimiser::pass::{Walk, origin};
use uav_relay::root::{bisected, sqrt};
use uav_relay::sir::{self, square};
use uav_relay::{Heading, Mission, MissionConfig, Placement, Profile};

const MAX_RELAYS: u16 = Mission::MAX_RELAYS;

/// Minimum number of relays for a target SIR.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fewest {
    /// Smallest number of relays that meets the target SIR.
    pub relays: u16,
    /// True if it is proven that no smaller number of relays meets the target.
    pub proven: bool,
}

/// Highest target SIR that a chain of some number of relays meets, and the fewest relays for it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Most {
    /// Highest target SIR that can be met, linear, to 1e-6 relative.
    pub target: f32,
    /// Smallest number of relays that meets `target`.
    pub relays: u16,
}

/// Lowest target SIR that [`Most::of`] tries, as a fraction of the first hop's highest possible SIR.
const DEPTH: f32 = 1e-20;

/// Number of bisection steps in [`Most::of`].
///
/// The search covers a range of 46 in ln(target), so the target is found to 1e-8 relative.
const HALVINGS: u8 = 32;

impl Fewest {
    /// Returns the fewest relays that meet the SIR `target`, at most [`Mission::MAX_RELAYS`].
    ///
    /// `target` is linear, above 0. The mission's own number of relays is ignored. `profile_of` returns the profile of
    /// relay 1..=N. `None` if no number of relays meets the target; [`Most::of`] returns the highest target that can be
    /// met.
    ///
    /// If the result is `proven`, it equals an exhaustive count: `as_few_as_an_exhaustive_count` in
    /// `host-tests/tests/fleet/`. Work with one interferer: a reach (farthest x) for each relay, two with a minimum
    /// separation. Work in an interference field: at most 32 chains of equal relays.
    pub fn of(mission: &Mission, target: f32, profile_of: impl Fn(u16) -> Profile) -> Option<Self> {
        let found = counted(mission, target, &profile_of)?;
        if !(mission.config().min_separation_m > 0.0) || !found.proven {
            return Some(found);
        }
        let freely = counted(&unseparated(mission)?, target, &profile_of);
        Some(Self {
            proven: freely.is_some_and(|freely| freely.relays == found.relays),
            ..found
        })
    }
}

impl Most {
    /// Returns the highest target SIR that a chain of some number of relays meets.
    ///
    /// `None` if this target is below 1e-20 times the highest possible SIR of the first hop. With different altitudes,
    /// or a minimum separation, the target can be met but may not be the highest. Work: 33 times the work of
    /// [`Fewest::of`].
    pub fn of(mission: &Mission, profile_of: impl Fn(u16) -> Profile) -> Option<Self> {
        let meets = |target: f32| {
            let found = counted(mission, target, &profile_of)?;
            Some(Self {
                target,
                relays: found.relays,
            })
        };
        let ceiling = sir::first_hop_ceiling(mission, profile_of(1).altitude_m);
        if !(ceiling > 0.0) {
            return None;
        }
        if let Some(most) = meets(ceiling) {
            return Some(most);
        }
        let mut best = None;
        bisected(libm::logf(DEPTH), 0.0, HALVINGS, |sigma| {
            let most = meets(ceiling * libm::expf(sigma));
            best = most.or(best);
            most.is_some()
        });
        best
    }
}

/// Returns positions at which the mission's N relays meet the SIR `target`, relay 1 first.
///
/// `None` if the relays cannot meet it. All hops except one have their maximum length, and an SIR of `target` with a
/// relative error of at most 1e-4. Work: at most two computations of every relay's farthest and required x.
pub fn places(
    mission: &Mission,
    target: f32,
    profile_of: impl Fn(u16) -> Profile,
) -> Option<Vec<Placement>> {
    let chain = Walk::new(mission, target, false, &profile_of);
    settled(&chain).or_else(|| settled(&chain.plainly()))
}

/// Returns the mission without a minimum separation.
fn unseparated(mission: &Mission) -> Option<Mission> {
    let config = MissionConfig {
        min_separation_m: 0.0,
        ..*mission.config()
    };
    Mission::try_new(config).ok()
}

/// Returns the fewest relays that meet `target`; `None` if no number does.
///
/// The field `proven` of the result is valid only for missions without a minimum separation.
fn counted(mission: &Mission, target: f32, profile_of: &impl Fn(u16) -> Profile) -> Option<Fewest> {
    if mission.field().is_some() && alike(MAX_RELAYS, profile_of) {
        fewest_of_equals(mission, target, profile_of(1))
    } else {
        fewest_by_reaches(mission, target, profile_of)
    }
}

/// Returns true if relays 1 to `last` have the same profile.
fn alike(last: u16, profile_of: &impl Fn(u16) -> Profile) -> bool {
    let first = profile_of(1);
    (2..=last).all(|index| profile_of(index) == first)
}

fn fewest_by_reaches(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
) -> Option<Fewest> {
    match mission.heading() {
        Heading::TowardRx => toward_rx(mission, target, profile_of),
        // Profiles are numbered from Tx, so each number of relays gives a different chain.
        Heading::TowardTx => (1..=MAX_RELAYS)
            .map_while(|relays| mission.with_relays(relays).ok())
            .find(|mission| is_met(&Walk::new(mission, target, false, profile_of)))
            .map(|mission| Fewest {
                relays: mission.relays(),
                proven: false,
            }),
    }
}

fn toward_rx(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
) -> Option<Fewest> {
    let mut from_m = 0.0;
    // With both directions, the farthest positions do not prove that no other chain is possible.
    let mut proven = !(mission.reverse() > 0.0);
    for index in 1..=MAX_RELAYS {
        let mission = mission.with_relays(index).ok()?;
        // The last relay of its chain may go as far as Rx.
        let last = Walk::new(&mission, target, false, profile_of);
        let link = last.link(index);
        let before_m = from_m;
        from_m = link.reach(target, from_m)?;
        if !link
            .ending(target, before_m, from_m)
            .is_some_and(|(slack, _)| slack >= 0.0)
        {
            continue;
        }
        // With a known number of relays, a relay may stop earlier to leave room for the relays behind it.
        if is_met(&last) {
            return Some(Fewest {
                relays: index,
                proven,
            });
        }
        proven = false;
    }
    None
}

/// Computes the reach (farthest x, m) of every relay. Calls `visit` with the relay's index and reach.
///
/// Returns the chain's slack and the x of the last relay, m; `None` if a hop cannot meet the target. The slack is the
/// length by which the last hop could still grow, and is negative if this hop misses the target.
fn ends<F: Fn(u16) -> Profile>(
    chain: &Walk<'_, F>,
    mut visit: impl FnMut(u16, f32),
) -> Option<(f32, f32)> {
    let mut relays = 0;
    let reaches = chain.reaches().inspect(|(at, _, reach)| {
        relays += 1;
        visit(*at, *reach);
    });
    let (at, before_m, reach) = reaches.last()?;
    let is_complete = relays == chain.mission.relays();
    is_complete.then(|| chain.link(at).ending(chain.target, before_m, reach))?
}

/// Returns true if the last hop meets the target with every relay at its reach (farthest x).
fn closes<F: Fn(u16) -> Profile>(chain: &Walk<'_, F>) -> bool {
    ends(chain, |_, _| {}).is_some_and(|(slack, _)| slack >= 0.0)
}

/// Returns true if the relays can meet the target.
///
/// They may be at their farthest x, or stop at a smaller x that the next hop requires.
fn is_met<F: Fn(u16) -> Profile>(chain: &Walk<'_, F>) -> bool {
    closes(chain) && (closes(&chain.plainly()) || chain.place(0).is_some())
}

/// Returns positions that meet the target; `None` if there are none.
///
/// First the reach of each relay is computed: the farthest x at which its hop meets the target. Then, from the last
/// relay back to the first, each relay moves to the x that its next hop requires.
fn settled<F: Fn(u16) -> Profile>(chain: &Walk<'_, F>) -> Option<Vec<Placement>> {
    let slot = |index: u16| usize::from(index).wrapping_sub(1);
    let mut places = vec![Placement::default(); usize::from(chain.mission.relays())];
    let (slack, place) = ends(chain, |index, reach| {
        if let Some(own) = places.get_mut(slot(index)) {
            *own = chain.link(index).own.cross_section.at(reach);
        }
    })?;
    if !(slack >= 0.0) {
        return None;
    }
    chain.settle(place, |at, place, before| {
        places.get_mut(slot(at))?.x_m = place;
        match before {
            Some(index) => Some(places.get(slot(index))?.x_m),
            None => Some(origin(chain.mission)),
        }
    })?;
    Some(places)
}

/// Largest number of relays to add if the minimum number fails because of the minimum separation.
const MORE: u16 = 32;

const TARGETS: u8 = 48;

fn is_met_by_equals(mission: &Mission, target: f32, profile: Profile) -> bool {
    closes(&Walk::new(mission, target, false, &|_| profile))
}

/// Returns the fewest relays with the same `profile` that meet `target` in an interference field.
///
/// `None` if there is no such number. Without a minimum separation the number is found by bisection; see
/// [`Fewest::of`].
fn fewest_of_equals(mission: &Mission, target: f32, profile: Profile) -> Option<Fewest> {
    let met_by = |mission: &Mission, relays: u16| {
        mission
            .with_relays(relays)
            .is_ok_and(|mission| is_met_by_equals(&mission, target, profile))
    };
    let freely = unseparated(mission)?;
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

/// Returns the highest target SIR that N relays with the same `profile` meet in an interference field.
///
/// The result is linear, and exact to one f32 step. `None` if the mission has no field, or if no target is met. The
/// result is the optimum if no minimum separation is binding: `identical_relays_in_a_field_are_optimal` in
/// `host-tests/tests/fleet/`. If the field varies along the line, Algorithm 4 may reach a lower SIR. Work: 48 chains,
/// each with three square roots for every point of the field and relay.
pub fn best_of_equals(mission: &Mission, profile: Profile) -> Option<f32> {
    mission.field()?;
    let met = |target: f32| is_met_by_equals(mission, target, profile);
    // SIR of the last hop with its relay right above Rx.
    let mut high = mission.receiver_gain(profile.power_w) / square(profile.altitude_m);
    if met(high) {
        return Some(high);
    }
    let mut low = 0.0;
    for _ in 0..TARGETS {
        // Geometric bisection first, since the targets span many decades.
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
