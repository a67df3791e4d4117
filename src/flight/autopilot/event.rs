//! Events for the firmware.

use super::astray::OffLine;
use super::kind::Kind;
use super::mode::{Release, WaitReason};
use super::state::State;
use super::trust::Mistrust;
use crate::flight::mavlink::frame::Address;
use crate::side::Side;

/// Maximum number of relays that one command can name.
pub(super) const MOST: usize = 7;

/// Relays named in a command, 0 for none.
pub type RelayNumbers = [u16; MOST];

/// An event of the link to an autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AutopilotEvent {
    /// First message of an autopilot.
    Found(Kind),
    /// Restart of the autopilot.
    Restarted,
    /// Change of the state: see [`State`].
    State(State),
    /// Release: the relay no longer controls the drone. It comes together with [`State::Standby`], or up to 1.3 s later if the
    /// cause may be a fence.
    Released(Release),
    /// Reason for which the drone cannot be engaged, or is not engaged in the companion's mode.
    Waits(WaitReason),
    /// Readiness: the pilot may choose the mode.
    Ready,
    /// Refused target: for 3 s the autopilot has reported another target than it was sent. The position is outside its own fence,
    /// or another companion controls it.
    Refused,
    /// Report of the autopilot that it is outside of its fence.
    FenceBreached,
    /// Drone so far from its line that it has no place along it. Check that these are the sites of this flight. Reported once on
    /// the ground and at most once in 10 s in the air.
    OffLine(OffLine),
    /// Command of the operator over MAVLink that clears all lost relays of one side.
    /// [`Autopilot::poll_cleared`](super::Autopilot::poll_cleared) returns the side for the relay.
    LostCleared {
        /// Side whose relays are cleared.
        side: Side,
        /// Numbers of the relays, padded with zeros.
        relays: RelayNumbers,
        /// Sender of the command.
        from: Address,
    },
    /// Denied command of the operator to clear lost relays. It does not name exactly the lost relays of one side.
    ClearRefused {
        /// Numbers of the relays that it names, padded with zeros.
        relays: RelayNumbers,
        /// Sender of the command.
        from: Address,
    },
    /// Mismatch of the signatures of autopilot and link.
    Mistrusted(Mistrust),
}

/// Pending events.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Events {
    pub(super) found: Option<Kind>,
    pub(super) restarted: bool,
    pub(super) released: Option<Release>,
    pub(super) state: Option<State>,
    /// Either [`AutopilotEvent::Waits`] or [`AutopilotEvent::Ready`].
    pub(super) waits: Option<AutopilotEvent>,
    pub(super) breached: bool,
    pub(super) refused: bool,
    pub(super) off_line: Option<OffLine>,
    /// Either [`AutopilotEvent::LostCleared`] or [`AutopilotEvent::ClearRefused`].
    pub(super) clearance: Option<AutopilotEvent>,
}

impl Events {
    /// Removes the next event.
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
