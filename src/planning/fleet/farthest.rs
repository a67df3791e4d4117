//! Minimum number of relays by the reaches of a pass: the paper's eq. (Opt) and Problem 1.
//!
//! No chain gets farther than its reaches (see `pass`), so n relays whose reaches do not end within the last hop cannot meet the
//! target. The printed search starts with two relays; one may be enough.

use super::Fewest;
use crate::mission::{Heading, MAX_RELAYS, Mission, Profile};
use crate::optimiser::spacing::Stand;
use crate::optimiser::walk::{Walk, before};
use crate::place::Placement;

pub(super) fn fewest(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
) -> Option<Fewest> {
    match mission.heading() {
        Heading::TowardRx => toward_rx(mission, target, profile_of),
        // Profiles are indexed from Tx, so every number of relays is another chain.
        Heading::TowardTx => (1..=MAX_RELAYS)
            .map_while(|relays| mission.with_relays(relays).ok())
            .find(|mission| chain(mission, target, profile_of).is_met())
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
    let mut proven = true;
    for index in 1..=MAX_RELAYS {
        let mission = mission.with_relays(index).ok()?;
        // The last relay of its chain may go to the very end.
        let last = chain(&mission, target, profile_of);
        let link = last.link(index);
        from_m = link.reach(target, from_m)?;
        if !link
            .ending(target, from_m)
            .is_some_and(|(slack, _)| slack >= 0.0)
        {
            continue;
        }
        // If it leaves room for the relays behind it, a chain of known length may end earlier than one that grows.
        if last.is_met() {
            return Some(Fewest {
                relays: index,
                proven,
            });
        }
        proven = false;
    }
    None
}

fn chain<'a, F: Fn(u16) -> Profile>(
    mission: &'a Mission,
    target: f32,
    profile_of: &'a F,
) -> Walk<'a, F> {
    Walk {
        mission,
        target,
        plain: false,
        profile_of,
    }
}

pub(super) fn places(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
    places: &mut [Placement],
) -> bool {
    let chain = chain(mission, target, profile_of);
    let plain = Walk {
        plain: true,
        ..chain
    };
    settled(&chain, places).is_some() || settled(&plain, places).is_some()
}

/// Computes the reaches, and then the required positions from the last relay back.
fn settled<F: Fn(u16) -> Profile>(chain: &Walk<'_, F>, places: &mut [Placement]) -> Option<()> {
    let slot = |index: u16| usize::from(index).wrapping_sub(1);
    let (slack, mut place) = chain.ends(|index, reach| {
        if let Some(own) = places.get_mut(slot(index)) {
            *own = chain.link(index).own.at.at(reach);
        }
    })?;
    if !(slack >= 0.0) {
        return None;
    }
    let mut at = match chain.mission.heading() {
        Heading::TowardRx => chain.mission.relays(),
        Heading::TowardTx => 1,
    };
    loop {
        places.get_mut(slot(at))?.x_m = place;
        let before = before(chain.mission, at);
        let from_m = match before {
            Some(index) => places.get(slot(index))?.x_m,
            None => crate::optimiser::pass::origin(chain.mission),
        };
        place = match chain.link(at).stand(chain.target, from_m, place)? {
            Stand::AtReach => from_m,
            Stand::At(x_m) => x_m,
        };
        let Some(index) = before else { return Some(()) };
        at = index;
    }
}
