//! Flight modes as operators know them, and the events of the link that the firmware is told of.

use super::astray::OffLine;
use super::clearance::Named;
use super::state::State;
use super::trust::Mistrust;
use super::vehicle::Kind;
use crate::flight::mavlink::frame::Address;
use crate::side::Side;

/// What the autopilot is doing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FlightMode {
    /// OFFBOARD or GUIDED: the relay may say where to fly.
    Companion,
    /// A mode that is flown with the sticks.
    Sticks,
    /// It holds its place: Hold, LOITER.
    Hold,
    /// It stops and holds its place: BRAKE.
    Brake,
    /// It returns: RTL, SMART_RTL.
    Return,
    /// It lands.
    Land,
    /// Another mode: a mission, a take-off.
    Other,
}

impl FlightMode {
    /// Returns the mode by its number.
    pub(super) const fn of(kind: Kind, custom_mode: u32) -> Self {
        match kind {
            Kind::Px4 => match (custom_mode >> 16 & 0xFF, custom_mode >> 24) {
                (6, _) => Self::Companion,
                (4, 3) => Self::Hold,
                (4, 5) => Self::Return,
                (4, 6) => Self::Land,
                (4, _) => Self::Other,
                _ => Self::Sticks,
            },
            Kind::ArduCopter => match custom_mode {
                4 => Self::Companion,
                5 => Self::Hold,
                6 | 21 | 27 => Self::Return,
                9 => Self::Land,
                17 => Self::Brake,
                0 | 1 | 2 | 7 | 11 | 13 | 14 | 15 | 16 => Self::Sticks,
                _ => Self::Other,
            },
        }
    }
}

/// Why the drone is not flown by the relay any more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ReleaseCause {
    /// Another mode was chosen, by the pilot or by a ground station.
    Chosen,
    /// The autopilot's failsafe.
    Failsafe,
    /// The autopilot's fence was breached.
    Fence,
    /// The link was interrupted or late: a PX4 may be in its failsafe, which a stream of targets would end.
    Link,
}

/// A release: its cause, and the mode that the autopilot has now.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Release {
    /// Why.
    pub cause: ReleaseCause,
    /// What the autopilot does now.
    pub mode: FlightMode,
}

impl Release {
    /// Returns the line for the operator, in two parts.
    pub(super) const fn text(self) -> [&'static str; 2] {
        let mode = match self.mode {
            FlightMode::Companion => "relay: released",
            FlightMode::Sticks => "relay: released to the sticks",
            FlightMode::Hold => "relay: released, holds its place",
            FlightMode::Brake => "relay: released, BRAKE",
            FlightMode::Return => "relay: released, returns (RTL)",
            FlightMode::Land => "relay: released, lands",
            FlightMode::Other => "relay: released, another mode",
        };
        let cause = match self.cause {
            ReleaseCause::Chosen => "",
            ReleaseCause::Failsafe => ": failsafe",
            ReleaseCause::Fence => ": fence",
            ReleaseCause::Link => ": link interrupted",
        };
        [mode, cause]
    }
}

/// Why the pilot cannot engage the drone, or why the mode was found but not used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WaitReason {
    /// The autopilot is in its failsafe. It ends when the pilot chooses a mode.
    Failsafe,
    /// Bytes from the autopilot come late.
    Link,
    /// OFFBOARD or GUIDED was not chosen before this link: another mode has to be chosen first.
    Found,
    /// No mode that the pilot has chosen was seen yet.
    Unseen,
    /// There is no position, or none near the line.
    Position,
    /// The relay is not ready ([`handle_ready`](super::Autopilot::handle_ready)).
    NotReady,
}

impl WaitReason {
    /// Returns the line for the operator.
    pub(super) const fn text(self) -> &'static str {
        match self {
            Self::Failsafe => "relay: waits, the autopilot is in a failsafe",
            Self::Link => "relay: waits, the autopilot's link is late",
            Self::Found => "relay: waits, take another mode first",
            Self::Unseen => "relay: waits, no mode was chosen yet",
            Self::Position => "relay: waits, no position near the line",
            Self::NotReady => "relay: waits, not in order with its neighbours",
        }
    }
}

/// An event of the link to an autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AutopilotEvent {
    /// An autopilot has been heard for the first time.
    Found(Kind),
    /// The autopilot was switched off and on.
    Restarted,
    /// The state has changed: see [`State`].
    State(State),
    /// The drone is not flown by the relay any more. It comes together with [`State::Standby`], or up to 1.3 s later where the cause may be a
    /// fence.
    Released(Release),
    /// The drone cannot be engaged, or is not though it is in the companion's mode.
    Waits(WaitReason),
    /// The drone can be engaged: the pilot may choose the mode.
    Ready,
    /// The autopilot says that it flies elsewhere than it was told, for 3 s: the place is outside its own fence, or another companion talks
    /// to it.
    Refused,
    /// The autopilot says that it is outside of its fence.
    FenceBreached,
    /// The drone is so far from its line that it has no place along it: are these the sites of this flight? It is told once on the ground and
    /// at most once in 10 s in the air.
    OffLine(OffLine),
    /// The operator has cleared all relays that are lost on one side, by a command over MAVLink. [`Autopilot::poll_cleared`](super::Autopilot::poll_cleared)
    /// has it for the relay.
    LostCleared {
        /// The side.
        side: Side,
        /// Numbers of the relays, and zeros.
        relays: Named,
        /// The sender of the command.
        from: Address,
    },
    /// The operator's command to clear lost relays was denied: it does not name exactly the relays that are lost on one side.
    ClearRefused {
        /// Numbers of the relays that it names, and zeros.
        relays: Named,
        /// The sender of the command.
        from: Address,
    },
    /// The signatures of the two do not fit.
    Mistrusted(Mistrust),
}

/// Events that have not been taken.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Events {
    pub(super) found: Option<Kind>,
    pub(super) restarted: bool,
    pub(super) released: Option<Release>,
    pub(super) state: Option<State>,
    /// [`AutopilotEvent::Waits`] or [`AutopilotEvent::Ready`].
    pub(super) waits: Option<AutopilotEvent>,
    pub(super) breached: bool,
    pub(super) refused: bool,
    pub(super) off_line: Option<OffLine>,
    /// [`AutopilotEvent::LostCleared`] or [`AutopilotEvent::ClearRefused`].
    pub(super) clearance: Option<AutopilotEvent>,
}

impl Events {
    /// Removes the next one.
    pub(super) fn take(&mut self) -> Option<AutopilotEvent> {
        if let Some(kind) = self.found.take() {
            return Some(AutopilotEvent::Found(kind));
        }
        if core::mem::take(&mut self.restarted) {
            return Some(AutopilotEvent::Restarted);
        }
        if core::mem::take(&mut self.breached) {
            return Some(AutopilotEvent::FenceBreached);
        }
        if let Some(release) = self.released.take() {
            return Some(AutopilotEvent::Released(release));
        }
        if let Some(state) = self.state.take() {
            return Some(AutopilotEvent::State(state));
        }
        if let Some(waits) = self.waits.take() {
            return Some(waits);
        }
        if let Some(clearance) = self.clearance.take() {
            return Some(clearance);
        }
        if let Some(off_line) = self.off_line.take() {
            return Some(AutopilotEvent::OffLine(off_line));
        }
        core::mem::take(&mut self.refused).then_some(AutopilotEvent::Refused)
    }
}
