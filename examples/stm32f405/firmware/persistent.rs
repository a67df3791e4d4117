//! Persistent state: the relay's votes and, with the feature `upload`, the uploaded mission.

use uav_relay::{Instant, Relay, ViewRecord};
#[cfg(feature = "upload")]
use uav_relay_kept::journal::{Journal, WhenFull};
use uav_relay_kept::views;

#[cfg(feature = "upload")]
use super::flash::Sectors;
#[cfg(feature = "upload")]
use super::uploads;
use super::{board, flash, log};

/// Restores an uploaded mission from before the reboot into `relay`, if any.
#[cfg(feature = "upload")]
#[inline(never)]
pub(crate) fn resume_upload(relay: &mut Relay) {
    let mut log = uploads();
    log.tidy();
    let newest = log.newest::<{ uploads::WORDS }>();
    if let Some(upload) = newest.and_then(|stored| uploads::unpack_upload(&stored))
        && relay.resume(&upload).is_ok()
    {
        log::resumes(upload.version());
    }
}

#[cfg(feature = "upload")]
#[inline(never)]
pub(crate) fn store_upload(relay: &Relay) {
    let Some(upload) = relay.upload() else { return };
    let stored = uploads().append(&uploads::pack_upload(upload), WhenFull::Refuse);
    log::uploaded(upload.version(), stored);
}

#[cfg(feature = "upload")]
fn uploads() -> Journal<Sectors> {
    Journal::new(flash::UPLOADS, uploads::WORDS, block())
}

pub(crate) struct Views(views::Views);

impl Views {
    /// Restores the votes on the chain's members from before the reboot into a new `relay`.
    ///
    /// Call it before any other use of the relay, but after a stored mission upload was restored.
    #[inline(never)]
    pub(crate) fn resume(relay: &mut Relay, now: Instant) -> Self {
        let log = views::log(flash::VIEWS, block());
        Self(views::Views::resume(relay, now, log, log::votes_restored))
    }

    /// Stores the relay's votes on the chain's members. Returns true even if the write fails: the flight continues.
    pub(crate) fn store(&mut self, record: &ViewRecord) -> bool {
        if let Some(stored) = self.0.store(record, views::log(flash::VIEWS, block())) {
            log::votes(stored);
        }
        true
    }
}

/// Returns the CRC of the configuration block, which is in the last four bytes of the block.
fn block() -> u32 {
    let bytes = board::block().last_chunk();
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}
