//! Flash in RAM that survives a reboot. Writes only clear bits; an erase sets them.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use relay_app::board::{Board, Storage};
use uav_relay_block::Block;

const UNIT: u32 = 4096;

#[derive(Clone, Debug)]
pub(crate) struct Ram(Rc<RefCell<Vec<u8>>>);

impl Ram {
    pub(crate) fn blank() -> Self {
        Self(Rc::new(RefCell::new(vec![0xFF; 16 * UNIT as usize])))
    }

    /// Writes the configuration block into the first erase unit. Returns a board with this flash.
    pub(crate) fn board(&self, block: &Block, seed: u32) -> Board<Self> {
        self.0.borrow_mut()[..block.len()].copy_from_slice(block);
        Board::new(seed, self.storage())
    }

    pub(crate) fn storage(&self) -> Storage<Self> {
        let units = |from: u32, to: u32| UNIT * from..UNIT * to;
        Storage {
            flash: self.clone(),
            block: 0,
            epochs: [units(1, 2), units(2, 4)],
            views: [units(4, 5), units(5, 6)],
        }
    }
}

impl ErrorType for Ram {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Ram {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let from = offset as usize;
        bytes.copy_from_slice(&self.0.borrow()[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().len()
    }
}

impl NorFlash for Ram {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = UNIT as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.0.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let mut all = self.0.borrow_mut();
        for (place, byte) in all[offset as usize..].iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}
