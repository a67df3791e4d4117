//! Events that the firmware is told of.

use super::astray::OffLine;
use super::kind::Kind;
use super::mode::{Release, WaitReason};
use super::state::State;
use super::trust::Mistrust;
use crate::flight::mavlink::frame::Address;
use crate::side::Side;

/// Relays that one command can name.
pub(super) const MOST: usize = 7;

/// Numbers of relays that a command names, 0 for none.
pub type RelayNumbers = [u16; MOST];

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
        relays: RelayNumbers,
        /// The sender of the command.
        from: Address,
    },
    /// The operator's command to clear lost relays was denied: it does not name exactly the relays that are lost on one side.
    ClearRefused {
        /// Numbers of the relays that it names, and zeros.
        relays: RelayNumbers,
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
