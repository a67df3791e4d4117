//! What the firmware is told. An event is a flag, so a firmware that does not listen loses nothing but repetitions.

use crate::side::Side;

/// Something a firmware may want to act on. The state behind it is read from the relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Event {
    /// `setpoint()` has a new value: fly there.
    SetpointChanged,
    /// The chain has agreed on a target: `target()`.
    Converged,
    /// Raised at the head: no target can be met.
    Infeasible,
    /// No sign of life from that neighbour for `Settings::dead_after`. It goes on being asked.
    NeighbourLost(Side),
    /// A lost neighbour has been heard again.
    NeighbourBack(Side),
    /// That neighbour flies another mission; its messages are ignored.
    MissionMismatch(Side),
    /// The chain has been counted anew: `Relay::index` and the relays of `Relay::mission` have new values, and new places follow.
    Reformed,
    /// Too few relays can be reached to go on without the others: this part of the chain holds its places.
    NoQuorum,
    /// A newer mission has come: `Relay::upload`. Store it, and hand it to `Relay::resume` when the relay is next switched on.
    Uploaded,
    /// The chain has agreed to fly it: `Relay::mission` and `Relay::version` have new values, and new places follow.
    Adopted,
}

const ALL: [Event; 13] = [
    Event::SetpointChanged,
    Event::Converged,
    Event::Infeasible,
    Event::NeighbourLost(Side::Upstream),
    Event::NeighbourLost(Side::Downstream),
    Event::NeighbourBack(Side::Upstream),
    Event::NeighbourBack(Side::Downstream),
    Event::MissionMismatch(Side::Upstream),
    Event::MissionMismatch(Side::Downstream),
    Event::Reformed,
    Event::NoQuorum,
    Event::Uploaded,
    Event::Adopted,
];

/// Events that have been raised and not yet taken, one bit each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pending {
    bits: u16,
}

impl Pending {
    fn bit(event: Event) -> u16 {
        ALL.iter()
            .zip(0..16)
            .find(|(known, _)| **known == event)
            .map_or(0, |(_, bit)| 1 << bit)
    }

    pub(crate) fn raise(&mut self, event: Event) {
        // Of a loss and a return only the later one still holds.
        match event {
            Event::NeighbourLost(side) => self.bits &= !Self::bit(Event::NeighbourBack(side)),
            Event::NeighbourBack(side) => self.bits &= !Self::bit(Event::NeighbourLost(side)),
            _ => {}
        }
        self.bits |= Self::bit(event);
    }

    pub(crate) fn take(&mut self) -> Option<Event> {
        let event = ALL
            .into_iter()
            .find(|&event| self.bits & Self::bit(event) != 0)?;
        self.bits &= !Self::bit(event);
        Some(event)
    }
}
