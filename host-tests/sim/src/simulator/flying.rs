//! Which relays of a run fly an agreement, and which of them could be parts of one chain.

use std::collections::BTreeMap;

use uav_relay::{Phase, Relay, ViewId};

use super::drones::Point;

/// What a run knows of a relay at a moment.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Seen {
    /// Whether it is on.
    pub is_on: bool,
    /// What it does.
    pub phase: Phase,
    /// Its view.
    pub view: ViewId,
    /// Whether it may hold what was agreed on in it, by its own clock.
    pub leased: bool,
    /// How many relays that has.
    pub relays: u16,
    /// Its place among them, from 1.
    pub index: u16,
    /// Version of the mission that it flies.
    pub version: u16,
    /// The target that it holds its place for.
    pub target: Option<f32>,
    /// Where it was told to fly: x, y and altitude, m.
    pub place: Option<Point>,
}

impl Seen {
    /// What `relay` shows.
    pub fn of(relay: &Relay, is_on: bool) -> Self {
        let point = |place: uav_relay::Placement| [place.x_m, place.y_m, place.altitude_m];
        Self {
            is_on,
            phase: relay.phase(),
            view: relay.view(),
            leased: relay.lease().is_some(),
            relays: relay.mission().relays(),
            index: relay.index(),
            version: relay.version(),
            target: relay.target(),
            place: relay.setpoint().map(|place| point(place).map(f64::from)),
        }
    }

    /// The view that it is in.
    fn part_of(&self) -> (ViewId, u16) {
        (self.view, self.relays)
    }

    /// Whether it flies an agreement.
    fn flies(&self) -> bool {
        self.is_on && self.leased && self.place.is_some()
    }
}

/// How many separate groups fly an agreement of their own.
///
/// A group are the relays of one view whose leases have not run out. Relays of one view that claim the same place in it are of two
/// groups. Relays that a partition has separated, and that still hold what they agreed together, are one group: they are parts of one
/// chain.
pub fn groups(seen: &[Seen]) -> usize {
    let mut views: BTreeMap<(ViewId, u16), BTreeMap<u16, usize>> = BTreeMap::new();
    for one in seen.iter().filter(|one| one.flies()) {
        let claims = views.entry(one.part_of()).or_default();
        *claims.entry(one.index).or_default() += 1;
    }
    let claims = views.values().filter_map(|claims| claims.values().max());
    claims.sum()
}

/// Whether all relays of some view hold their places for the same target.
pub fn has_agreed(seen: &[Seen]) -> bool {
    seen.iter().filter(|one| one.is_on).any(|one| {
        let same = |other: &&Seen| {
            other.is_on
                && other.phase == Phase::Holding
                && other.part_of() == one.part_of()
                && other.target.map(f32::to_bits) == one.target.map(f32::to_bits)
        };
        one.phase == Phase::Holding && seen.iter().filter(same).count() == usize::from(one.relays)
    })
}
