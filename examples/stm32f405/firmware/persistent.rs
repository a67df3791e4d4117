//! Persistent state: the relay's votes on views and, with the feature `upload`, the uploaded mission.

use uav_relay::{Instant, Relay, ViewRecord};
#[cfg(feature = "upload")]
use uav_relay_kept::journal::{Journal, WhenFull};
use uav_relay_kept::views;

#[cfg(feature = "upload")]
use super::flash::Sectors;
#[cfg(feature = "upload")]
use super::uploads;
use super::{board, flash, log};

/// Restores the mission uploaded before the reboot, if any, into a newly created `relay`.
#[cfg(feature = "upload")]
#[inline(never)]
pub(crate) fn resume_upload(relay: &mut Relay) {
    let mut log = uploads();
    log.tidy();
    let newest = log.newest::<{ uploads::WORDS }>();
    if let Some(upload) = newest.and_then(|kept| uploads::upload(&kept))
        && relay.resume(&upload).is_ok()
    {
        log::resumes(upload.version());
    }
}

#[cfg(feature = "upload")]
#[inline(never)]
pub(crate) fn keep_upload(relay: &Relay) {
    let Some(upload) = relay.upload() else { return };
    let kept = uploads().keep(&uploads::kept(upload), WhenFull::Refuse);
    log::uploaded(upload.version(), kept);
}

#[cfg(feature = "upload")]
fn uploads() -> Journal<Sectors> {
    Journal::new(flash::UPLOADS, uploads::WORDS, block())
}

pub(crate) struct Views(views::Views);

impl Views {
    /// Restores the votes from before the reboot into a new `relay`. Only an uploaded mission may have been restored
    /// before.
    #[inline(never)]
    pub(crate) fn resume(relay: &mut Relay, now: Instant) -> Self {
        let log = views::log(flash::VIEWS, block());
        Self(views::Views::resume(relay, now, log, log::stands_by))
    }

    /// Stores the relay's changed votes. Returns true even if the write fails, so that the relay flies on.
    pub(crate) fn store(&mut self, record: &ViewRecord) -> bool {
        if let Some(kept) = self.0.store(record, views::log(flash::VIEWS, block())) {
            log::votes(kept);
        }
        true
    }
}

/// Returns the CRC of the configuration block, its last four bytes.
fn block() -> u32 {
    let bytes = board::block().last_chunk();
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}
