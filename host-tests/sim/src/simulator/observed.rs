//! States of the relays for a run's statistics, and groups of relays that fly by one agreement.

use std::collections::BTreeMap;

use uav_relay::{Phase, Relay, ViewId};

use super::drones::{Point, point};

/// State of a relay from which a run's statistics are computed, such as the availability of the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ObservedState {
    /// True if the relay is switched on.
    pub is_on: bool,
    /// Phase of the relay's protocol, such as planning or holding an agreed position.
    pub phase: Phase,
    /// View of the relay: the membership of the chain that it has accepted.
    pub view: ViewId,
    /// True while the relay may rely on the last agreement on positions. Its lease is then valid by the relay's clock.
    pub leased: bool,
    /// Number of relays in the relay's view (membership of the chain).
    pub relays: u16,
    /// Index of the relay in its view (membership of the chain), from 1 next to Tx.
    pub index: u16,
    /// Version of the relay's mission; 0 for the mission loaded before the start.
    pub version: u16,
    /// Linear target SIR of the relay's position; `None` without a target.
    pub target: Option<f32>,
    /// Setpoint of the relay: x, y and altitude, m; `None` without one.
    pub place: Option<Point>,
}

impl ObservedState {
    /// Reads the state of `relay`; `is_on` is false if the relay is switched off.
    pub fn of(relay: &Relay, is_on: bool) -> Self {
        Self {
            is_on,
            phase: relay.phase(),
            view: relay.view(),
            leased: relay.lease().is_some(),
            relays: relay.mission().relays(),
            index: relay.index(),
            version: relay.version(),
            target: relay.target(),
            place: relay.setpoint().map(point),
        }
    }

    fn part_of(&self) -> (ViewId, u16) {
        (self.view, self.relays)
    }

    /// Returns true if the relay can control a drone: it is on, holds a lease and has a setpoint.
    fn flies(&self) -> bool {
        self.is_on && self.leased && self.place.is_some()
    }
}

/// Returns the number of groups of relays that fly, each by its own agreement.
///
/// A group consists of the relays of one view with valid leases. If relays of a view claim the same index, they are
/// in different groups. A partition does not split a group whose agreement is still valid.
pub fn groups(seen: &[ObservedState]) -> usize {
    let mut views: BTreeMap<(ViewId, u16), BTreeMap<u16, usize>> = BTreeMap::new();
    for one in seen.iter().filter(|one| one.flies()) {
        let claims = views.entry(one.part_of()).or_default();
        *claims.entry(one.index).or_default() += 1;
    }
    let claims = views.values().filter_map(|claims| claims.values().max());
    claims.sum()
}

/// Returns true if there is a view whose relays all have positions, computed for the same target SIR.
pub fn has_agreed(seen: &[ObservedState]) -> bool {
    seen.iter().filter(|one| one.is_on).any(|one| {
        let same = |other: &&ObservedState| {
            other.is_on
                && other.phase == Phase::Holding
                && other.part_of() == one.part_of()
                && other.target.map(f32::to_bits) == one.target.map(f32::to_bits)
        };
        one.phase == Phase::Holding && seen.iter().filter(same).count() == usize::from(one.relays)
    })
}
