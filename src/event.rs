//! What the firmware is told. An event is a flag, so a firmware that does not listen loses nothing but repetitions.

use crate::side::Side;

/// Something a firmware may want to act on. The state behind it is read from the relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Event {
    /// `Relay::setpoint` has a new value: fly there.
    SetpointChanged,
    /// The chain has agreed on a target, `Relay::target`: every relay knows its place for it.
    Converged,
    /// Raised at the leader (relay 1; in a field relay N): no places meet any target that may be tried. Every relay stays where it is.
    /// `Relay::restart`, a new view or a new mission has the leader try again.
    Infeasible,
    /// The neighbour at that side has given no sign of life for 15 s, or what the settings say. On a channel of its own it goes on being
    /// asked; on a shared one the relay searches for another node at that side.
    NeighbourLost(Side),
    /// A lost neighbour has answered again, or another node has taken its place.
    NeighbourBack(Side),
    /// A node at that side was loaded with another mission, as a hello or a heartbeat of its says; its messages are ignored.
    MissionMismatch(Side),
    /// The chain has agreed on a new view of who is in it: `Relay::view`, `Relay::index` and the relays of `Relay::mission` have new
    /// values, and new places follow.
    Reformed,
    /// It is not certain any more that all relays of the view hold what was agreed on: this one holds its place, and asks for a new view.
    LeaseLapsed,
    /// A new view was refused: too few relays can be reached to go on without the others. This part of the chain holds its places.
    NoQuorum,
    /// A newer mission has come: `Relay::upload`. Store it, and hand it to `Relay::resume` when the relay is next switched on.
    Uploaded,
    /// The chain has agreed to fly it: `Relay::mission` and `Relay::version` have new values, and new places follow.
    Adopted,
}

const ALL: [Event; 14] = [
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
    Event::LeaseLapsed,
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
