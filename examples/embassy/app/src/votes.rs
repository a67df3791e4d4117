//! Votes of the relay on the chain's membership, persisted across a reboot in flight.

use embedded_storage::nor_flash::NorFlash;
use uav_relay::{Instant, Relay, ViewRecord};
use uav_relay_block::Block;
use uav_relay_kept::nor::Nor;
use uav_relay_kept::views::{Views, log as journal};

use crate::board::Storage;
use crate::log;

#[derive(Debug)]
pub(crate) struct Votes<F> {
    flash: Nor<F>,
    /// CRC of the configuration block. Votes that were stored with a different block are ignored.
    block: u32,
    view: Views,
}

impl<F: NorFlash> Votes<F> {
    /// Restores the votes on the chain's membership stored before the reboot into a newly created `relay`.
    pub(crate) fn resume(
        storage: Storage<F>,
        block: &Block,
        relay: &mut Relay,
        now: Instant,
    ) -> Self {
        let block = (block.last_chunk()).map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let mut flash = Nor::new(storage.flash, storage.views);
        let stored = journal(&mut flash, block);
        let view = Views::resume(relay, now, stored, log::votes_restored);
        Self { flash, block, view }
    }

    /// Stores the relay's votes on the chain's membership. If the write fails, the relay flies on.
    pub(crate) fn store(&mut self, record: &ViewRecord) {
        let Self { flash, block, view } = self;
        if let Some(stored) = view.store(record, journal(flash, *block)) {
            log::votes(stored);
        }
    }
}
