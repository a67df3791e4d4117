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

/// Length of the relay's record of votes (on the chain's members) in the journal, words.
pub const WORDS: usize = ViewRecord::LENGTH.div_ceil(4);

/// Packs the relay's record of votes (on the chain's members) into words for the flash.
pub fn pack_record(record: &ViewRecord) -> [u32; WORDS] {
    pack(&record.to_bytes())
}

/// Unpacks a stored record of votes (on the chain's members); `None` if the words are no valid record.
pub fn unpack_record(kept: &[u32]) -> Option<ViewRecord> {
    ViewRecord::from_bytes(&unpack::<{ ViewRecord::LENGTH }>(kept))
}

/// Creates the flash journal of the relay's votes on the chain's members.
///
/// `block` is the CRC of the configuration block. Records stored with a different CRC are ignored.
pub const fn log<F: Flash>(flash: F, block: u32) -> Journal<F> {
    Journal::new(flash, WORDS, block)
}

/// Storage of the relay's votes (on the chain's members) in flash: its state, working or failing.
#[derive(Debug)]
pub struct Views {
    /// True if the newest record of votes is in the flash.
    is_stored: bool,
}

impl Views {
    /// Restores the relay's votes on the chain's members that were stored before the reboot.
    ///
    /// Call it before any other use of the relay, but after a stored mission upload was restored.
    ///
    /// If a record of votes is stored, `votes_restored` is called, with true if the relay accepts the record. A relay
    /// may reject the record of a different firmware.
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
