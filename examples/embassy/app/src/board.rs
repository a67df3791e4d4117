//! Hardware of a board besides its ports.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use uav_relay_block::{Block, LEN};
use uav_relay_chip::reset::Reset;

/// Configuration block, seed, reset cause and flash of a board.
#[derive(Debug)]
pub struct Board<F> {
    /// Configuration block of the relay, as read from flash.
    pub block: Block,
    /// Random seed for the relay that differs between boards, and if possible between starts.
    pub seed: u32,
    /// Cause of the last reset of the board.
    pub reset: Reset,
    /// Flash for state that survives a reboot; `None` if the board has none.
    ///
    /// Without such flash, a block with a signing key is refused, and the relay's votes on the chain's membership are
    /// lost at a reboot.
    pub storage: Option<Storage<F>>,
}

/// Flash of a board, and the offsets of its storage areas.
///
/// Each area consists of whole erase units outside of the firmware image.
#[derive(Debug)]
pub struct Storage<F> {
    /// Driver of the flash memory.
    pub flash: F,
    /// Offset of the configuration block, bytes.
    pub block: u32,
    /// Offsets of the two sectors for the epoch, a number that rises at every start.
    pub epochs: [Range<u32>; 2],
    /// Offsets of the two sectors for the relay's votes on the chain's membership.
    ///
    /// When both sectors are full, one is erased in flight. The erase of a small sector takes less time.
    pub views: [Range<u32>; 2],
}

impl<F: NorFlash> Board<F> {
    /// Creates the description of a board, and reads the configuration block from its flash.
    ///
    /// The block is blank after a read error.
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

    /// Returns the board's description with the cause of the last reset.
    #[must_use]
    pub fn reset_by(self, reset: Reset) -> Self {
        Self { reset, ..self }
    }
}
