//! A new mission in flight, as a firmware sees it.

use super::facade::Relay;
use crate::time::Instant;
use crate::wire::upload::{Upload, UploadError};

impl Relay {
    /// Has a relay that has just been made, and was handed nothing yet, fly `upload`: the newest that it had stored on
    /// [`Event::Uploaded`](crate::Event::Uploaded) before it was switched off. [`Relay::new`] still takes the mission that was loaded
    /// before flight.
    ///
    /// Constant work.
    ///
    /// # Errors
    /// [`UploadError::Base`] if it was stored for another mission than the one that was loaded, [`UploadError::Line`] if there is no
    /// line on earth for it, [`UploadError::Begun`] if the relay has begun to talk or to compute. Nothing has changed then.
    pub fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        self.node.resume(upload)
    }

    /// Takes a new mission that has come another way than over the link; the chain adopts it as one that has.
    ///
    /// Constant work.
    ///
    /// # Errors
    /// [`UploadError::Unsigned`] without `Settings::auth`, [`UploadError::Base`] if it is for other relays, [`UploadError::Line`] if
    /// there is no line on earth for it, [`UploadError::Old`] if a mission as new as that is held.
    pub fn handle_upload(&mut self, now: Instant, upload: &Upload) -> Result<(), UploadError> {
        self.node.handle_upload(self.clock.advance(now), upload)
    }

    /// The newest mission held, flown or not yet, if it was uploaded.
    pub fn upload(&self) -> Option<&Upload> {
        self.node.upload()
    }

    /// The version of the mission that it flies: 0 for the one that was loaded before flight.
    pub fn version(&self) -> u16 {
        self.node.member().active.version
    }
}
