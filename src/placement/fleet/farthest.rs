//! Every relay as far on the way as the target lets it: the paper's eq. (Opt), and its approach to Problem 1.
//!
//! With one interferer and one altitude a chain that starts a hop farther on never ends it less far, so no chain gets farther than
//! this one; n relays meet the target if and only if the n-th of it is within reach of Rx. The printed search begins with two
//! relays; one may do.

use super::Fewest;
use crate::mission::{Heading, MAX_RELAYS, Mission, Profile};
use crate::placement::PerTarget;
use crate::placement::pass::{self, Behind, origins};
use crate::sir::Placement;

/// A chain that grows by one relay at a time.
struct Growing {
    behind: Option<Behind>,
    from: PerTarget,
}

impl Growing {
    fn new(mission: &Mission) -> Self {
        Self {
            behind: None,
            from: origins(mission),
        }
    }

    /// Where relay `index` of `mission`, the next on the way, stands for `target`; `None` where it cannot meet it.
    fn next(
        &mut self,
        mission: &Mission,
        index: u16,
        profile: Profile,
        target: f32,
    ) -> Option<Placement> {
        let mut reaches = PerTarget::new();
        pass::extend(
            mission,
            self.behind,
            index,
            profile.on_line(),
            &[target],
            &self.from,
            &mut reaches,
        );
        let x_m = *reaches.first()?;
        self.from = reaches;
        self.behind = Some(Behind {
            relay: profile.on_line(),
            measured_per_w: None,
        });
        Some(profile.on_line().at.at(x_m))
    }
}

/// The fewest relays whose farthest chain meets `target`; see [`super::fewest`].
pub(super) fn fewest(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
) -> Option<Fewest> {
    match mission.heading() {
        Heading::TowardRx => toward_rx(mission, target, profile_of),
        // What the relays hold is counted from Tx, so every number of them is another chain.
        Heading::TowardTx => (1..=MAX_RELAYS)
            .map_while(|relays| mission.with_relays(relays).ok())
            .find(|mission| meets(mission, target, profile_of))
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
    let mut chain = Growing::new(mission);
    let altitude_m = profile_of(1).altitude_m;
    let mut level = true;
    for index in 1..=MAX_RELAYS {
        let mission = mission.with_relays(index).ok()?;
        let profile = profile_of(index);
        level = level && !((profile.altitude_m - altitude_m).abs() > 0.0);
        // As the last of its chain it may go to the very end.
        let place = chain.next(&mission, index, profile, target)?;
        let ends = pass::slack(&mission, profile.on_line(), None, target, place.x_m)
            .is_some_and(|slack| slack >= 0.0);
        // With room to be left for those behind it, a chain may end sooner than one that grows without knowing its length.
        if ends && meets(&mission, target, profile_of) {
            return Some(Fewest {
                relays: index,
                proven: level,
            });
        }
    }
    None
}

/// Whether the farthest chain of the mission's N relays meets `target`.
fn meets(mission: &Mission, target: f32, profile_of: &impl Fn(u16) -> Profile) -> bool {
    walk(mission, target, profile_of, |_, _| {}).is_some_and(|slack| slack >= 0.0)
}

/// Walks the farthest chain for `target`, and returns the slack it ends with.
fn walk(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
    mut visit: impl FnMut(u16, Placement),
) -> Option<f32> {
    let mut chain = Growing::new(mission);
    let mut index = mission.leader();
    loop {
        let profile = profile_of(index);
        let place = chain.next(mission, index, profile, target)?;
        visit(index, place);
        let Some(next) = mission.after(index) else {
            return pass::slack(mission, profile.on_line(), None, target, place.x_m);
        };
        index = next;
    }
}

/// The places of that chain; see [`super::places`].
pub(super) fn places(
    mission: &Mission,
    target: f32,
    profile_of: &impl Fn(u16) -> Profile,
    places: &mut [Placement],
) -> bool {
    let slack = walk(mission, target, profile_of, |index, place| {
        if let Some(own) = places.get_mut(usize::from(index).wrapping_sub(1)) {
            *own = place;
        }
    });
    slack.is_some_and(|slack| slack >= 0.0)
}
