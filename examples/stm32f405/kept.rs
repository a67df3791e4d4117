//! What is in the flash before it is needed again: with the feature `upload` what was uploaded, and what the relay has said in the votes
//! on views.

use uav_relay::{Instant, Relay};
#[cfg(feature = "upload")]
use uav_relay_kept::journal::{Journal, WhenFull};
use uav_relay_kept::views;

#[cfg(feature = "upload")]
use super::flash::Sectors;
#[cfg(feature = "upload")]
use super::uploads;
use super::{board, flash, log};

/// Has `relay`, which was just made, fly what it held when this drone was switched off.
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

/// Writes down what `relay` holds since just now.
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

/// What the relay has said.
pub(crate) struct Views(views::Views);

impl Views {
    /// Has `relay`, which was handed nothing but an upload yet, stand by what it said before this drone was switched off.
    #[inline(never)]
    pub(crate) fn resume(relay: &mut Relay, now: Instant) -> Self {
        let log = views::log(flash::VIEWS, block());
        Self(views::Views::resume(relay, now, log, log::stands_by))
    }

    /// Writes down what `relay` has said, if that has changed. Called before anything is sent.
    pub(crate) fn keep(&mut self, relay: &Relay) {
        let log = || views::log(flash::VIEWS, block());
        if let Some(kept) = self.0.keep(relay, log) {
            log::votes(kept);
        }
    }
}

/// The check sequence of the configuration block: its last four bytes.
fn block() -> u32 {
    let bytes = board::block().last_chunk();
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}
