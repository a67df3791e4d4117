//! What a relay has promised, kept by its firmware over a reboot in flight.

use super::facade::Relay;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::time::Instant;

impl Relay {
    /// What it has said in the votes on views, to be stored whenever it has changed, *before* [`poll_transmit`](Self::poll_transmit) is
    /// called: a promise that is forgotten is none. Constant work.
    pub const fn view_record(&self) -> ViewRecord {
        self.node.view_record()
    }

    /// Has a relay that has just been made, and was handed nothing but an upload yet, stand by what it had said before it was
    /// switched off in flight: the [`view_record`](Self::view_record) that was stored last.
    ///
    /// Constant work.
    ///
    /// # Errors
    /// [`RecordError::Base`] if it was stored by a relay that was loaded with another mission, [`RecordError::Begun`] if the relay
    /// has begun to talk or to compute. Nothing has changed then.
    pub fn resume_view(&mut self, now: Instant, record: &ViewRecord) -> Result<(), RecordError> {
        self.node.resume_view(self.clock.advance(now), record)
    }
}
