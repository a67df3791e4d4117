//! Relays of a run that hold an agreement, and the groups that they form.

use std::collections::BTreeMap;

use uav_relay::{Phase, Relay, ViewId};

use super::drones::Point;

/// Observed state of a relay.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Seen {
    /// True if the relay is switched on.
    pub is_on: bool,
    /// Phase of the relay.
    pub phase: Phase,
    /// Current view.
    pub view: ViewId,
    /// True while the relay's lease is valid by its own clock.
    pub leased: bool,
    /// Number of relays in the view.
    pub relays: u16,
    /// Index of the relay in the view, from 1.
    pub index: u16,
    /// Version of its mission.
    pub version: u16,
    /// Target SIR of its position, linear.
    pub target: Option<f32>,
    /// Setpoint: x, y and altitude, m.
    pub place: Option<Point>,
}

impl Seen {
    /// Captures the state of `relay`.
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

    fn part_of(&self) -> (ViewId, u16) {
        (self.view, self.relays)
    }

    /// Returns true if the relay is on, holds a lease and has a setpoint.
    fn flies(&self) -> bool {
        self.is_on && self.leased && self.place.is_some()
    }
}

/// Returns the number of groups that each hold an agreement of their own.
///
/// A group consists of the relays of one view with valid leases. Relays of one view that claim the same index belong to different
/// groups. Relays separated by a partition that still hold their common agreement are one group.
pub fn groups(seen: &[Seen]) -> usize {
    let mut views: BTreeMap<(ViewId, u16), BTreeMap<u16, usize>> = BTreeMap::new();
    for one in seen.iter().filter(|one| one.flies()) {
        let claims = views.entry(one.part_of()).or_default();
        *claims.entry(one.index).or_default() += 1;
    }
    let claims = views.values().filter_map(|claims| claims.values().max());
    claims.sum()
}

/// Returns true if all relays of some view hold their positions for the same target.
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
