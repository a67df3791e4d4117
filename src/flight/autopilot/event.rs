//! What the firmware is told of the autopilot.

use super::state::State;
use super::vehicle::Kind;

/// What the firmware is told.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AutopilotEvent {
    /// An autopilot has been heard for the first time.
    Found(Kind),
    /// It was switched off and on.
    Restarted,
    /// Somebody else flies, or the relay again: see [`State`].
    State(State),
    /// It was told five times where to fly and flies elsewhere: the place is outside its own fence, or another companion talks to it.
    Refused,
}

/// Events that have not been taken.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Events {
    pub(super) found: Option<Kind>,
    pub(super) restarted: bool,
    pub(super) state: Option<State>,
    pub(super) refused: bool,
}

impl Events {
    /// The next one.
    pub(super) fn take(&mut self) -> Option<AutopilotEvent> {
        if let Some(kind) = self.found.take() {
            return Some(AutopilotEvent::Found(kind));
        }
        if core::mem::take(&mut self.restarted) {
            return Some(AutopilotEvent::Restarted);
        }
        if let Some(state) = self.state.take() {
            return Some(AutopilotEvent::State(state));
        }
        core::mem::take(&mut self.refused).then_some(AutopilotEvent::Refused)
    }
}
