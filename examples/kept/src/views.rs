//! Relay's votes on views, persisted across a reboot in flight. A relay that forgets a promise could split the chain.
//!
//! The votes are in a [`Journal`] whose key is the CRC of the configuration block: another block's votes are ignored.
//! They are stored before any frame that follows from them is sent.
//!
//! A view change takes three or four records, and a sector of 16 KiB holds 240. The second sector is blank at a
//! start, so the next 240 records, some 60 view changes, need no erase. When both are full, the older one is erased
//! in flight, because a relay must not vote without storing its votes. The newest record stays in the other sector.
//! The sectors are small, because an erase of 16 KiB stops the CPU for 0.25 s, at most 0.5 s, and one of 128 KiB for
//! up to 2 s.

use uav_relay::{Instant, Relay, ViewRecord};

use crate::journal::{Flash, Journal, WhenFull, pack, unpack};

/// Addresses of the two flash sectors for votes: sectors 1 and 2 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x0800_4000, 0x0800_8000];

/// Length of the relay's votes in the journal, words.
pub const WORDS: usize = ViewRecord::LENGTH.div_ceil(4);

/// Packs the relay's votes into words.
pub fn pack_record(record: &ViewRecord) -> [u32; WORDS] {
    pack(&record.to_bytes())
}

/// Unpacks stored votes; `None` if the words do not have their format.
pub fn unpack_record(kept: &[u32]) -> Option<ViewRecord> {
    ViewRecord::from_bytes(&unpack::<{ ViewRecord::LENGTH }>(kept))
}

/// Creates the journal of the relay's votes. `block` is the CRC of the configuration block.
pub const fn log<F: Flash>(flash: F, block: u32) -> Journal<F> {
    Journal::new(flash, WORDS, block)
}

/// State of the storage of the relay's votes: working, or failing.
#[derive(Debug)]
pub struct Views {
    /// True if the newest record of votes is in the flash.
    is_stored: bool,
}

impl Views {
    /// Restores the votes from before the reboot.
    ///
    /// Call it before any other use of the relay, but after a stored upload was restored.
    ///
    /// `votes_restored` is called for a stored record, with true if the relay accepts it. A relay may reject the record
    /// of a different firmware.
    pub fn resume<F: Flash>(
        relay: &mut Relay,
        now: Instant,
        mut log: Journal<F>,
        votes_restored: impl FnOnce(bool),
    ) -> Self {
        log.tidy();
        let mut kept = true;
        if let Some(words) = log.newest::<WORDS>() {
            let record = unpack_record(&words);
            kept = record.is_some_and(|record| relay.resume_view(now, &record).is_ok());
            votes_restored(kept);
        }
        Self { is_stored: kept }
    }

    /// Stores the relay's changed votes.
    ///
    /// Returns `Some(true)` when storing works again, `Some(false)` when storing begins to fail, otherwise `None`.
    ///
    /// If the write fails, the relay flies on: a drone in the air must not be stopped for a failed write.
    #[inline(never)] // rarely called
    pub fn store<F: Flash>(&mut self, record: &ViewRecord, mut log: Journal<F>) -> Option<bool> {
        let before = self.is_stored;
        self.is_stored = log.append(&pack_record(record), WhenFull::Erase);
        (self.is_stored != before).then_some(self.is_stored)
    }
}
