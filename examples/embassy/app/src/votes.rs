//! What the relay has said in the votes on views, kept across a reboot in flight.

use embedded_storage::nor_flash::NorFlash;
use uav_relay::{Instant, Relay};
use uav_relay_block::Block;
use uav_relay_kept::nor::Nor;
use uav_relay_kept::views::{Views, log as journal};

use crate::board::Storage;
use crate::log;

/// What was said last, and the log that it is in.
#[derive(Debug)]
pub(crate) struct Votes<F> {
    flash: Nor<F>,
    /// The check sequence of the block: with another one a drone has forgotten what it said.
    block: u32,
    said: Views,
}

impl<F: NorFlash> Votes<F> {
    /// Has `relay`, which was just made, stand by what it said before this drone was switched off.
    pub(crate) fn resume(
        storage: Storage<F>,
        block: &Block,
        relay: &mut Relay,
        now: Instant,
    ) -> Self {
        let block = (block.last_chunk()).map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let mut flash = Nor::new(storage.flash, storage.views);
        let kept = journal(&mut flash, block);
        let said = Views::resume(relay, now, kept, log::stands_by);
        Self { flash, block, said }
    }

    /// Writes down what `relay` has said, if that has changed. Called before anything is sent.
    pub(crate) fn keep(&mut self, relay: &Relay) {
        let Self { flash, block, said } = self;
        if let Some(kept) = said.keep(relay, || journal(flash, *block)) {
            log::votes(kept);
        }
    }
}
