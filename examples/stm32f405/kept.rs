//! What is in the flash before it is needed again: with the feature `upload` what was uploaded, and what the relay has said in the votes
//! on views.

use uav_relay::{Instant, Relay, ViewRecord};

use super::flash::Sectors;
use super::journal::{Journal, WhenFull};
#[cfg(feature = "upload")]
use super::uploads;
use super::{board, flash, log, views};

/// Has `relay`, which was just made, fly what it held when this drone was switched off.
#[cfg(feature = "upload")]
#[inline(never)]
pub(crate) fn resume_upload(relay: &mut Relay) {
    let mut log = uploads();
    log.tidy();
    if let Some(upload) = log.newest().and_then(uploads::upload)
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

/// What the relay has said, as it was when that was looked at last.
pub(crate) struct Views {
    said: ViewRecord,
    /// Whether it stands in the flash.
    kept: bool,
}

impl Views {
    /// Has `relay`, which was handed nothing but an upload yet, stand by what it said before this drone was switched off.
    #[inline(never)]
    pub(crate) fn resume(relay: &mut Relay, now: Instant) -> Self {
        let mut log = views();
        log.tidy();
        let mut kept = true;
        if let Some(words) = log.newest() {
            let record = views::record(words);
            kept = record.is_some_and(|record| relay.resume_view(now, &record).is_ok());
            log::stands_by(kept);
        }
        Self {
            said: relay.view_record(),
            kept,
        }
    }

    /// Writes down what `relay` has said, if that has changed. Called before anything is sent. Where it cannot be written, the relay
    /// flies on: a drone in the air is not to be switched off for it.
    pub(crate) fn keep(&mut self, relay: &Relay) {
        let said = relay.view_record();
        if said != self.said {
            self.said = said;
            self.write();
        }
    }

    #[inline(never)]
    fn write(&mut self) {
        let kept = views().keep(&views::kept(&self.said), WhenFull::Erase);
        if kept != self.kept {
            log::votes(kept);
        }
        self.kept = kept;
    }
}

fn views() -> Journal<Sectors> {
    Journal::new(flash::VIEWS, views::WORDS, block())
}

/// The check sequence of the configuration block: its last four bytes.
fn block() -> u32 {
    let bytes = board::block().last_chunk();
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}
