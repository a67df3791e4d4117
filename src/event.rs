//! Events for the firmware.
//!
//! Each kind of event is a flag; some kinds also store a node. If the firmware polls late, it gets repeated events of
//! one kind only once. Of two such events about different nodes on the same side, it gets only the later one.

use crate::geodetic::LineError;
use crate::side::Side;

/// Event of a relay. The firmware reads the changed state from the relay.
///
/// A field `node` is a relay's index in the chain as configured before flight, as in
/// [`Relay::neighbours`](crate::Relay::neighbours).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Event {
    /// `Relay::setpoint` has changed. Fly to the new setpoint; if there is none, hold the position.
    SetpointChanged,
    /// The chain has agreed on positions. If the interference is known, the chain has also agreed on a target SIR
    /// (`Relay::target`).
    Converged,
    /// Every allowed target SIR is infeasible, and all relays keep their positions.
    ///
    /// Raised at the leader, which is relay 1, or relay N if the mission gives the interference as a distribution along
    /// x. The leader tries again after `Relay::restart`, in a new view, or with a new mission.
    Infeasible,
    /// The neighbour on the side `side` of this relay is lost.
    ///
    /// The neighbour has answered nothing for at least `Settings::dead_after` (15 s by default), and has left at least
    /// 16 requests unanswered. On a channel that loses frames the event is raised later, after at most eight times
    /// `dead_after`. On separate links the relay keeps sending heartbeat requests to the neighbour; on a shared channel
    /// it searches for a different node at that side. An operator looks for that drone. Once it has landed,
    /// `Relay::clear_lost` frees the space around its last position.
    NeighbourLost {
        /// Side of this relay, toward Tx or toward Rx, on which the lost neighbour is.
        side: Side,
        /// Index of the lost neighbour in the chain, 1 to N.
        node: u16,
    },
    /// A lost neighbour is received again, or a different neighbour has replaced it. `node` is the present neighbour:
    /// after a replacement it is not the node that was reported as lost.
    NeighbourBack {
        /// Side of this relay, toward Tx or toward Rx, on which the neighbour is.
        side: Side,
        /// Index of the neighbour that is received now.
        node: u16,
    },
    /// A node has reported eight times in a row that it does not receive this relay. The node therefore cannot be a
    /// neighbour. Not raised again before the node has received this relay. An operator checks this relay's
    /// transmitter and the node's receiver: antenna, power, channel.
    NotHeard {
        /// Index of the node that does not receive this relay.
        node: u16,
    },
    /// A node has loaded a different mission before flight, or flies one that this relay cannot obtain. The node's
    /// messages are ignored. An operator loads the same mission into both nodes before take-off. Raised once a minute
    /// for each node.
    MissionMismatch {
        /// Index of the node whose mission is not this relay's mission.
        node: u16,
    },
    /// A node signs its handshakes with a key that is not this relay's key.
    ///
    /// Raised after three such handshakes in a row, then once a minute while they go on; a handshake with the right key
    /// starts the count again. An operator
    /// should give both nodes the same key. An attacker without the key can raise this event with three forged
    /// handshakes in a row, but not with one forged frame. If messages of the node are received at the same time, this
    /// is an attack, and the node has the right key.
    KeyMismatch {
        /// Index of the node that does not sign with this relay's key.
        node: u16,
    },
    /// Five handshakes in a row from a node have an old epoch (start counter). The node's frames are rejected.
    ///
    /// The key is right, but the node did not increase its epoch at its last start. The epoch is smaller than the last
    /// known one, or equal with the same seed. A handshake with a newer epoch starts the count again. An operator
    /// increases the node's epoch and restarts it, or restarts this relay and its other neighbours. Raised once a minute
    /// while the handshakes go on. A replay of one
    /// recorded frame does not raise the event, but a replay in order of five handshakes of one start does. If `node`
    /// is this relay, its neighbours know a newer epoch, and this relay becomes passive ([`Event::DuplicateIndex`]).
    EpochWentBack {
        /// Index of the node whose epoch (start counter) is too old.
        node: u16,
    },
    /// Two nodes use the same index. If it is this relay's index, at most one of the two has a setpoint (see
    /// `Relay::is_passive`). If it is a neighbour's index, frames with this index are received at both ports. An
    /// operator lands one of the two nodes and corrects its index. Not raised again before the duplicate has been
    /// silent for twice `dead_after`. With signed frames, an attacker without the key can raise this event, but cannot
    /// do more.
    DuplicateIndex {
        /// Index that two nodes use.
        node: u16,
    },
    /// The chain has agreed on its members (a new view). `Relay::view`, `Relay::index` and the relays of
    /// `Relay::mission` have changed, and new positions follow.
    ViewAccepted,
    /// The lease has expired: the time for which all members keep to their last agreement. The relay keeps its setpoint
    /// and requests a new view (list of members). Not raised again before a view is agreed on.
    LeaseLapsed,
    /// A new view (list of members) was refused because too few relays are reachable for a quorum. The relays of this
    /// part of the chain hold their positions. Not raised again before a view is agreed on. Bring the missing relays
    /// back into range, or land the drones of this part of the chain.
    NoQuorum,
    /// A newer mission has been received (`Relay::upload`). Store it, and pass it to `Relay::resume` after the next start.
    Uploaded,
    /// A newer mission was rejected, and this relay keeps its present mission. The ground station is informed.
    ///
    /// The reason is one of three. The mission's distance does not fit its Tx and Rx positions on earth. The mission
    /// exceeds this relay's own geofence. The mission has fitted slots (as long as each hop needs), which the settings
    /// do not allow. Upload a corrected mission. The event is raised once for each rejected mission.
    UploadRefused {
        /// Reason for the rejection of the newer mission.
        why: LineError,
    },
    /// The relay's estimate of the interference has changed (`Relay::interference_estimate`). New positions follow.
    NewEstimate,
    /// The leader cannot locate the interferer. The measurements are too few, contradict each other, or do not fit a
    /// single source on the ground. Raised at the leader. `Relay::unfit` gives the reason.
    InterfererUnclear,
    /// A node's measurements do not fit those of all other nodes. The measurements are ignored until they fit.
    ///
    /// An operator should check the receiver of this node. Only the leader raises this event for the transmitter and
    /// the receiver. If a relay measures nothing at all, only this relay raises the event, with itself as the node.
    /// With four relays or fewer the faulty relay cannot be identified
    /// ([`Unfit::Contradiction`](crate::sensing::fit::Unfit::Contradiction)).
    SensorOff {
        /// Index of the node: 0 for the transmitter, number of configured relays + 1 for the receiver.
        node: u16,
    },
    /// The chain flies the uploaded mission. `Relay::mission`, `Relay::version` and `Relay::sites` have changed, and new
    /// positions follow.
    Adopted,
    /// The relay is outside of the chain, as requested by `Relay::leave`. The remaining relays have closed the gap, and
    /// this relay's drone may fly away.
    MayLeave,
    /// The drone's remaining time of flight is unknown. Raised only if a reserve is set (`Relay::set_reserve`).
    ///
    /// Raised if a value of `Relay::handle_endurance` was invalid, if no value came for 10 s, or if no value is known
    /// while the relay controls the drone. The relay then counts the time down from the last value that agreed with the
    /// value before it, or else from the last value. Without any valid value, the relay does not leave the chain by
    /// itself. Raised at most once a minute while the time is unknown.
    EnduranceUnknown,
    /// The drone's remaining time of flight is only enough for the way home and the reserve. `Relay::set_reserve` sets
    /// the reserve. Raised again every minute while this is the case.
    AtReserve,
    /// Notice that a node outside of the chain has been told by this relay that its drone may fly away.
    ///
    /// This relay's guard (collision avoidance) still keeps clear of that drone. Once the drone has left, an operator
    /// calls `Relay::clear_lost`. The event may be repeated.
    MayLeaveTold {
        /// Side of this relay, toward Tx or toward Rx, on which the node is.
        side: Side,
        /// Index of the node whose drone is permitted to leave.
        node: u16,
    },
}

/// Events that the firmware polls first; they concern no node. Events about a node follow, then those of `POLLED_LAST`.
const POLLED_FIRST: [Event; 3] = [Event::SetpointChanged, Event::Converged, Event::Infeasible];
const POLLED_LAST: &[Event] = &[
    Event::ViewAccepted,
    Event::LeaseLapsed,
    Event::NoQuorum,
    Event::UploadRefused {
        why: LineError::Distance,
    },
    Event::UploadRefused {
        why: LineError::Sites,
    },
    Event::UploadRefused {
        why: LineError::Altitude,
    },
    Event::UploadRefused {
        why: LineError::Lateral,
    },
    Event::UploadRefused {
        why: LineError::Length,
    },
    Event::UploadRefused {
        why: LineError::Slots,
    },
    Event::Uploaded,
    Event::Adopted,
    Event::NewEstimate,
    Event::InterfererUnclear,
    #[cfg(feature = "departures")]
    Event::MayLeave,
    Event::EnduranceUnknown,
    Event::AtReserve,
];

/// Kind of event about one node. The event is stored for the side of this relay on which the node is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum NodeEvent {
    Lost,
    Back,
    NotHeard,
    Mission,
    Epoch,
    Key,
    /// Two nodes use the same index. If it is this relay's own index, the event is stored for the upstream side.
    Index,
    /// The measurements of the node do not fit those of all other nodes.
    Sensor,
    #[cfg(feature = "departures")]
    MayLeaveTold,
}

impl NodeEvent {
    const ALL: &[Self] = &[
        Self::Lost,
        Self::Back,
        Self::NotHeard,
        Self::Mission,
        Self::Epoch,
        Self::Key,
        Self::Index,
        Self::Sensor,
        #[cfg(feature = "departures")]
        Self::MayLeaveTold,
    ];

    const fn event(self, side: Side, node: u16) -> Event {
        match self {
            Self::Lost => Event::NeighbourLost { side, node },
            Self::Back => Event::NeighbourBack { side, node },
            Self::NotHeard => Event::NotHeard { node },
            Self::Mission => Event::MissionMismatch { node },
            Self::Key => Event::KeyMismatch { node },
            Self::Epoch => Event::EpochWentBack { node },
            Self::Index => Event::DuplicateIndex { node },
            Self::Sensor => Event::SensorOff { node },
            #[cfg(feature = "departures")]
            Self::MayLeaveTold => Event::MayLeaveTold { side, node },
        }
    }
}

/// Raised events that the firmware has not polled yet, with the nodes that they concern.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pending {
    events: u32,
    /// Raised events that concern a node. Entry 0 is for nodes toward Tx, entry 1 for nodes toward Rx. Bit i stands for
    /// `NodeEvent::ALL[i]`.
    kinds: [u16; 2],
    nodes: [[u16; NodeEvent::ALL.len()]; 2],
}

impl Pending {
    #[inline(never)] // otherwise there is a search in every place where an event is raised
    fn bit(event: Event) -> u32 {
        POLLED_FIRST
            .iter()
            .chain(POLLED_LAST)
            .zip(0..32)
            .find(|(known, _)| **known == event)
            .map_or(0, |(_, bit)| 1 << bit)
    }

    pub(crate) fn raise(&mut self, event: Event) {
        self.events |= Self::bit(event);
    }

    /// Raises an event about `node` at `side`. It replaces an event of the same kind on the same side, even if that is
    /// about a different node.
    pub(crate) fn raise_node_event(&mut self, kind: NodeEvent, side: Side, node: u16) {
        let at = usize::from(side == Side::Downstream);
        let (Some(bits), Some(nodes)) = (self.kinds.get_mut(at), self.nodes.get_mut(at)) else {
            return;
        };
        let opposite = match kind {
            NodeEvent::Lost => Some(NodeEvent::Back),
            NodeEvent::Back => Some(NodeEvent::Lost),
            _ => None,
        };
        // Of a loss and a return of the same node only the later event remains.
        if let Some(opposite) = opposite
            && nodes.get(opposite as usize) == Some(&node)
        {
            *bits &= !(1 << opposite as u16);
        }
        *bits |= 1 << kind as u16;
        if let Some(place) = nodes.get_mut(kind as usize) {
            *place = node;
        }
    }

    fn take_event(&mut self, of: &[Event]) -> Option<Event> {
        let event = of
            .iter()
            .copied()
            .find(|&event| self.events & Self::bit(event) != 0)?;
        self.events &= !Self::bit(event);
        Some(event)
    }

    fn take_node_event(&mut self) -> Option<Event> {
        for &kind in NodeEvent::ALL {
            let sides = [Side::Upstream, Side::Downstream].into_iter();
            let places = self.kinds.iter_mut().zip(&self.nodes);
            for (side, (bits, nodes)) in sides.zip(places) {
                let bit = 1 << kind as u16;
                if *bits & bit != 0 {
                    *bits &= !bit;
                    let node = nodes.get(kind as usize).copied().unwrap_or_default();
                    return Some(kind.event(side, node));
                }
            }
        }
        None
    }

    pub(crate) fn take(&mut self) -> Option<Event> {
        self.take_event(&POLLED_FIRST)
            .or_else(|| self.take_node_event())
            .or_else(|| self.take_event(POLLED_LAST))
    }
}

#[cfg(test)]
mod tests {
    use super::{Event, NodeEvent, Pending, Side};

    fn all(pending: &mut Pending) -> heapless::Vec<Event, 24> {
        core::iter::from_fn(|| pending.take()).collect()
    }

    #[test]
    fn only_repetitions_of_events_are_lost() {
        let mut pending = Pending::default();
        pending.raise(Event::Adopted);
        pending.raise(Event::SetpointChanged);
        for (side, node) in [(Side::Upstream, 3), (Side::Downstream, 5)] {
            for &kind in NodeEvent::ALL {
                pending.raise_node_event(kind, side, node);
            }
            pending.raise_node_event(NodeEvent::Lost, side, node - 1);
        }
        let polled = all(&mut pending);
        assert_eq!(polled.len(), 2 + 2 * NodeEvent::ALL.len());
        let lost = Event::NeighbourLost {
            side: Side::Upstream,
            node: 2,
        };
        assert_eq!(polled[..2], [Event::SetpointChanged, lost]);
        assert!(polled.contains(&Event::NotHeard { node: 5 }));
        assert_eq!(polled.last(), Some(&Event::Adopted));
        assert_eq!(pending.take(), None);
    }

    #[test]
    fn a_loss_and_a_return_of_one_node_cancel() {
        let side = Side::Downstream;
        let (lost, back) = (
            |node| Event::NeighbourLost { side, node },
            |node| Event::NeighbourBack { side, node },
        );
        let mut pending = Pending::default();
        pending.raise_node_event(NodeEvent::Lost, side, 3);
        pending.raise_node_event(NodeEvent::Back, side, 3);
        assert_eq!(all(&mut pending)[..], [back(3)]);
        // A return of another node does not cancel the loss.
        pending.raise_node_event(NodeEvent::Lost, side, 3);
        pending.raise_node_event(NodeEvent::Back, side, 4);
        assert_eq!(all(&mut pending)[..], [lost(3), back(4)]);
    }
}
