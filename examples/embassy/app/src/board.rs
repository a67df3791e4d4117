//! What a board brings beside its ports.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use uav_relay_block::{Block, LEN};
use uav_relay_chip::reset::Reset;

/// The block, a seed, and a flash to keep things in.
#[derive(Debug)]
pub struct Board<F> {
    /// The configuration block.
    pub block: Block,
    /// Differs from one board to the next, and better from one start to the next.
    pub seed: u32,
    /// The cause of the last reset.
    pub reset: Reset,
    /// Where it keeps what has to survive a reboot. Without it a block with a key is refused, and what was said in votes forgotten.
    pub storage: Option<Storage<F>>,
}

/// A flash, and what is where in it: offsets of whole erase units that no image reaches.
#[derive(Debug)]
pub struct Storage<F> {
    /// Its driver.
    pub flash: F,
    /// Where the configuration block begins.
    pub block: u32,
    /// The two sectors of the epoch.
    pub epochs: [Range<u32>; 2],
    /// The two of what was said in votes. One is erased in flight when both are full: the smaller, the sooner that is done.
    pub views: [Range<u32>; 2],
}

impl<F: NorFlash> Board<F> {
    /// A board whose block is in the flash that it keeps things in; blank where it cannot be read.
    pub fn new(seed: u32, mut storage: Storage<F>) -> Self {
        let mut block = [0xFF; LEN];
        if storage.flash.read(storage.block, &mut block).is_err() {
            block.fill(0xFF);
        }
        Self {
            block,
            seed,
            reset: Reset::Unknown,
            storage: Some(storage),
        }
    }

    /// The same, with the cause of the last reset.
    #[must_use]
    pub fn reset_by(self, reset: Reset) -> Self {
        Self { reset, ..self }
    }
}
