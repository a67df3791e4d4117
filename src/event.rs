//! What the firmware is told. An event is a flag with the node that it is about beside it, so a firmware that does not listen loses
//! nothing but repetitions, and of two nodes on one side the one before.

use crate::line::LineError;
use crate::side::Side;

/// Something a firmware may want to act on. The state behind it is read from the relay.
///
/// A *node* is the number that a relay was given before flight, as in [`Relay::neighbours`](crate::Relay::neighbours).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Event {
    /// `Relay::setpoint` has a new value, or none any more: fly there, or hold the place.
    SetpointChanged,
    /// The chain has agreed on places, and on a target where the interference is known, `Relay::target`: every relay knows its place.
    Converged,
    /// Raised at the leader (relay 1; in a field relay N): no places meet any target that may be tried. Every relay stays where it is.
    /// `Relay::restart`, a new view or a new mission has the leader try again.
    Infeasible,
    /// The neighbour at that side has given no sign of life for 15 s, or what the settings say. On a channel of its own it goes on being
    /// asked; on a shared one the relay searches for another node at that side. An operator looks for that drone; once it has landed,
    /// `Relay::clear_lost` frees its room.
    NeighbourLost {
        /// Where it was.
        side: Side,
        /// Which one.
        node: u16,
    },
    /// A lost neighbour has been heard again, or another node has taken its place: then it is another number than the one lost.
    NeighbourBack {
        /// Where it is.
        side: Side,
        /// Which one.
        node: u16,
    },
    /// A node has said eight times in a row that it does not hear this relay: it cannot be a neighbour, though it is heard. Raised once
    /// until it does. An operator looks at this relay's transmitter and at that one's receiver: antenna, power, channel.
    NotHeard {
        /// Which one.
        node: u16,
    },
    /// A node was loaded with another mission, or flies one that this relay cannot come to; its messages are ignored. An operator loads
    /// both with the same mission before take-off. Raised once a minute for each node.
    MissionMismatch {
        /// Which one.
        node: u16,
    },
    /// Three handshakes in a row under a node's number were signed with another key, and nothing under it with this one between them.
    /// An operator gives both the same key. A single forged frame does not raise it, but somebody without the key who sends three in a
    /// row does: while that node is heard, it is an attack and nothing is wrong with the node.
    KeyMismatch {
        /// Which one.
        node: u16,
    },
    /// Five handshakes in a row under a node's number, with the right key, are of an older epoch than is known of it, or of the same one
    /// begun anew with the same seed, and nothing newer between them: its epoch went back or stood still at its last start, and what it says is refused.
    /// An operator raises that node's epoch and starts it again, or switches this relay and its other neighbours off and on. A frame that
    /// was recorded and is played again and again does not raise it, but as many as these of one start, played in order, do. This relay's
    /// own number: its neighbours show an epoch of it that is newer than its own, and it stands down, with [`Event::IndexTaken`].
    EpochWentBack {
        /// Which one.
        node: u16,
    },
    /// Two nodes use one number. This relay's own: of the two at most one has a setpoint, see `Relay::stands_down`. A neighbour's: it is
    /// received at both of the ports. An operator lands one of the two and gives it the right number. Raised once until nothing was received
    /// of the other node for twice `dead_after`. Where frames are signed, somebody without the key can raise it, and nothing more.
    IndexTaken {
        /// Which number.
        node: u16,
    },
    /// The chain has agreed on a new view of who is in it: `Relay::view`, `Relay::index` and the relays of `Relay::mission` have new
    /// values, and new places follow.
    Reformed,
    /// It is not certain any more that all relays of the view hold what was agreed on: this one holds its place, and asks for a new view.
    /// Raised once until a view is agreed on.
    LeaseLapsed,
    /// A new view was refused: too few relays can be reached to go on without the others. This part of the chain holds its places. Raised
    /// once until a view is agreed on. An operator brings relays that are missing back into reach, or lands these.
    NoQuorum,
    /// A newer mission has come: `Relay::upload`. Store it, and hand it to `Relay::resume` when the relay is next switched on.
    Uploaded,
    /// A newer mission was refused, since it has no line on earth, or leaves the relay's own geofence. It flies on as before, and the ground is
    /// told. Raised once for each such mission. An operator uploads one with sites that are as far apart as its distance says, and within the
    /// geofence.
    UploadRefused {
        /// What is wrong with it.
        why: LineError,
    },
    /// This relay believes something else of the interference than before: `Relay::belief`. New places follow.
    Believed,
    /// Raised at the leader: what the relays hear is not of one source on the ground, says too little, or does not fit together and nobody
    /// knows who is wrong. `Relay::unfit` says which of these.
    InterfererUnclear,
    /// A node measures something else of the interference than follows from what all the others measure: that is left out until it fits
    /// again. An operator looks at its receiver. An end is named by the leader alone, a relay that hears nothing at all by itself alone. With four relays or
    /// fewer nobody can tell which of them is wrong ([`Unfit::Contradiction`](crate::sensing::fit::Unfit::Contradiction)).
    SensorOff {
        /// Which one: 0 for the transmitter, one more than the relays that were loaded for the receiver.
        node: u16,
    },
    /// The chain has agreed to fly it: `Relay::mission`, `Relay::version` and `Relay::sites` have new values, and new places follow.
    Adopted,
}

/// Events about nobody in particular, in the order in which they are told: these first, those about a node, and the others.
const FIRST: [Event; 3] = [Event::SetpointChanged, Event::Converged, Event::Infeasible];
const LAST: &[Event] = &[
    Event::Reformed,
    Event::LeaseLapsed,
    Event::NoQuorum,
    #[cfg(feature = "upload")]
    Event::UploadRefused {
        why: LineError::Distance,
    },
    #[cfg(feature = "upload")]
    Event::UploadRefused {
        why: LineError::Sites,
    },
    #[cfg(feature = "upload")]
    Event::UploadRefused {
        why: LineError::Altitude,
    },
    #[cfg(feature = "upload")]
    Event::UploadRefused {
        why: LineError::Lateral,
    },
    #[cfg(feature = "upload")]
    Event::UploadRefused {
        why: LineError::Length,
    },
    Event::Uploaded,
    Event::Adopted,
    Event::Believed,
    Event::InterfererUnclear,
];

/// What can be told of a node on one side.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum About {
    Lost,
    Back,
    NotHeard,
    Mission,
    #[cfg(feature = "auth")]
    Key,
    #[cfg(feature = "auth")]
    Epoch,
    /// The number itself; of this relay's own, on either side.
    Index,
    /// Its measurements.
    Sensor,
}

impl About {
    const ALL: &[Self] = &[
        Self::Lost,
        Self::Back,
        Self::NotHeard,
        Self::Mission,
        #[cfg(feature = "auth")]
        Self::Key,
        #[cfg(feature = "auth")]
        Self::Epoch,
        Self::Index,
        Self::Sensor,
    ];

    const fn event(self, side: Side, node: u16) -> Event {
        match self {
            Self::Lost => Event::NeighbourLost { side, node },
            Self::Back => Event::NeighbourBack { side, node },
            Self::NotHeard => Event::NotHeard { node },
            Self::Mission => Event::MissionMismatch { node },
            #[cfg(feature = "auth")]
            Self::Key => Event::KeyMismatch { node },
            #[cfg(feature = "auth")]
            Self::Epoch => Event::EpochWentBack { node },
            Self::Index => Event::IndexTaken { node },
            Self::Sensor => Event::SensorOff { node },
        }
    }
}

/// Events that have been raised and not yet taken: one bit each, and the node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pending {
    plain: u16,
    /// By side; bit i is of `About::ALL[i]`.
    about: [u8; 2],
    nodes: [[u16; 8]; 2],
}

impl Pending {
    #[inline(never)] // a search, in every place where an event is raised
    fn bit(event: Event) -> u16 {
        FIRST
            .iter()
            .chain(LAST)
            .zip(0..16)
            .find(|(known, _)| **known == event)
            .map_or(0, |(_, bit)| 1 << bit)
    }

    /// Raises one that is about nobody in particular.
    pub(crate) fn raise(&mut self, event: Event) {
        self.plain |= Self::bit(event);
    }

    /// Raises one about node `node` at `side`, in place of one of that kind about another.
    pub(crate) fn raise_about(&mut self, about: About, side: Side, node: u16) {
        let at = usize::from(side == Side::Downstream);
        let (Some(bits), Some(nodes)) = (self.about.get_mut(at), self.nodes.get_mut(at)) else {
            return;
        };
        let opposite = match about {
            About::Lost => Some(About::Back),
            About::Back => Some(About::Lost),
            _ => None,
        };
        // Of a loss and a return of one node only the later one still holds.
        if let Some(opposite) = opposite
            && nodes.get(opposite as usize) == Some(&node)
        {
            *bits &= !(1 << opposite as u8);
        }
        *bits |= 1 << about as u8;
        if let Some(place) = nodes.get_mut(about as usize) {
            *place = node;
        }
    }

    fn take_plain(&mut self, of: &[Event]) -> Option<Event> {
        let event = of
            .iter()
            .copied()
            .find(|&event| self.plain & Self::bit(event) != 0)?;
        self.plain &= !Self::bit(event);
        Some(event)
    }

    fn take_about(&mut self) -> Option<Event> {
        for &about in About::ALL {
            let sides = [Side::Upstream, Side::Downstream].into_iter();
            let places = self.about.iter_mut().zip(&self.nodes);
            for (side, (bits, nodes)) in sides.zip(places) {
                let bit = 1 << about as u8;
                if *bits & bit != 0 {
                    *bits &= !bit;
                    let node = nodes.get(about as usize).copied().unwrap_or_default();
                    return Some(about.event(side, node));
                }
            }
        }
        None
    }

    pub(crate) fn take(&mut self) -> Option<Event> {
        self.take_plain(&FIRST)
            .or_else(|| self.take_about())
            .or_else(|| self.take_plain(LAST))
    }
}

#[cfg(test)]
mod tests {
    use super::{About, Event, Pending, Side};

    fn all(pending: &mut Pending) -> heapless::Vec<Event, 24> {
        core::iter::from_fn(|| pending.take()).collect()
    }

    #[test]
    fn an_event_names_its_node_and_nothing_is_lost_but_repetitions() {
        let mut pending = Pending::default();
        pending.raise(Event::Adopted);
        pending.raise(Event::SetpointChanged);
        for (side, node) in [(Side::Upstream, 3), (Side::Downstream, 5)] {
            for &about in About::ALL {
                pending.raise_about(about, side, node);
            }
            pending.raise_about(About::Lost, side, node - 1);
        }
        let told = all(&mut pending);
        assert_eq!(told.len(), 2 + 2 * About::ALL.len());
        let lost = Event::NeighbourLost {
            side: Side::Upstream,
            node: 2,
        };
        assert_eq!(told[..2], [Event::SetpointChanged, lost]);
        assert!(told.contains(&Event::NotHeard { node: 5 }));
        assert_eq!(told.last(), Some(&Event::Adopted));
        assert_eq!(pending.take(), None);
    }

    #[test]
    fn of_a_loss_and_a_return_of_one_node_the_later_one_holds() {
        let side = Side::Downstream;
        let (lost, back) = (
            |node| Event::NeighbourLost { side, node },
            |node| Event::NeighbourBack { side, node },
        );
        let mut pending = Pending::default();
        pending.raise_about(About::Lost, side, 3);
        pending.raise_about(About::Back, side, 3);
        assert_eq!(all(&mut pending)[..], [back(3)]);
        // Another node in its place does not undo the loss.
        pending.raise_about(About::Lost, side, 3);
        pending.raise_about(About::Back, side, 4);
        assert_eq!(all(&mut pending)[..], [lost(3), back(4)]);
    }
}
