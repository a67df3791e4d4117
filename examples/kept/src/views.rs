//! What the relay has said in the votes on views, kept across a reboot in flight: a promise that is forgotten is none, and two parts of a
//! chain could fly one view each.
//!
//! It is in a [`Journal`] of its own, whose key is the check sequence of the configuration block: with another
//! block a drone has forgotten what it said. It is written before anything is sent that follows from it.
//!
//! A view change takes three or four records, and a sector of 16 KiB has room for 240 of them. The second sector is blank at a start, so
//! the 240 records after it, some 60 view changes, erase nothing. When both sectors are full the older one is erased in flight, since a
//! relay that cannot keep what it says is no voice to count on; the newest record stands in the other sector meanwhile. The sectors
//! are small for that reason: an erase of 16 KiB stops the CPU for 0.25 s, for 0.5 s at most, where one of 128 KiB takes up to 2 s.

use uav_relay::{Instant, Relay, ViewRecord};

use crate::journal::{Flash, Journal, WhenFull, pack, unpack};

/// Where the two sectors begin: sectors 1 and 2 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x0800_4000, 0x0800_8000];

/// Words of a record that are kept.
pub const WORDS: usize = ViewRecord::LENGTH.div_ceil(4);

/// As it is kept.
pub fn kept(record: &ViewRecord) -> [u32; WORDS] {
    pack(&record.to_bytes())
}

/// What was kept, if it is of this format.
pub fn record(kept: &[u32]) -> Option<ViewRecord> {
    ViewRecord::from_bytes(&unpack::<{ ViewRecord::LENGTH }>(kept))
}

/// The log, under the check sequence of the drone's block.
pub const fn log<F: Flash>(flash: F, block: u32) -> Journal<F> {
    Journal::new(flash, WORDS, block)
}

/// What the relay has said, as it was when that was looked at last.
#[derive(Debug)]
pub struct Views {
    said: ViewRecord,
    /// Whether it stands in the flash.
    kept: bool,
}

impl Views {
    /// Has `relay`, which was handed nothing but an upload yet, stand by what it said before this drone was switched off. Where anything was
    /// kept, `stands_by` is told whether it does: what is of another firmware it may not be able to.
    pub fn resume<F: Flash>(
        relay: &mut Relay,
        now: Instant,
        mut log: Journal<F>,
        stands_by: impl FnOnce(bool),
    ) -> Self {
        log.tidy();
        let mut kept = true;
        if let Some(words) = log.newest::<WORDS>() {
            let record = record(&words);
            kept = record.is_some_and(|record| relay.resume_view(now, &record).is_ok());
            stands_by(kept);
        }
        Self {
            said: relay.view_record(),
            kept,
        }
    }

    /// Writes down what `relay` has said, if that has changed: to be called before anything is sent. Where it cannot be written, the relay
    /// flies on: a drone in the air is not to be switched off for it. Whether it stands in the flash, where that is not as it was.
    pub fn keep<F: Flash>(
        &mut self,
        relay: &Relay,
        log: impl FnOnce() -> Journal<F>,
    ) -> Option<bool> {
        let said = relay.view_record();
        if said == self.said {
            return None;
        }
        self.said = said;
        self.write(log)
    }

    #[inline(never)] // seldom
    fn write<F: Flash>(&mut self, log: impl FnOnce() -> Journal<F>) -> Option<bool> {
        let before = self.kept;
        self.kept = log().keep(&kept(&self.said), WhenFull::Erase);
        (self.kept != before).then_some(self.kept)
    }
}
