//! The sectors of flash that this program writes, and everything unsafe about them.

use core::ptr::{read_volatile, write_volatile};

use stm32f4xx_hal::pac::FLASH;

use super::epoch;
#[cfg(feature = "upload")]
use super::uploads;

/// A sector of 128 KiB that no image reaches (`memory.x`).
#[derive(Clone, Copy)]
pub(crate) struct Sector(u32);

/// The two that keep the epoch.
pub(crate) const EPOCHS: [Sector; 2] = [Sector(epoch::SECTORS[0]), Sector(epoch::SECTORS[1])];

/// The two that keep uploads.
#[cfg(feature = "upload")]
pub(crate) const UPLOADS: [Sector; 2] = [Sector(uploads::SECTORS[0]), Sector(uploads::SECTORS[1])];

const BYTES: usize = 128 * 1024;

impl Sector {
    /// What stands there, in records of `N` words; what does not fill one is left out.
    pub(crate) const fn records<const N: usize>(self) -> &'static [[u32; N]] {
        // SAFETY: a part of the flash, always readable and aligned. Only this file writes there, and what this function gave
        // before is not looked at after that.
        unsafe { core::slice::from_raw_parts(self.0 as *const [u32; N], BYTES / (4 * N)) }
    }

    /// The number that the flash's registers know it by: the large sectors begin with number 5, at 0x0802_0000.
    const fn number(self) -> u8 {
        let [_, _, third, _] = self.0.to_le_bytes();
        third / 2 + 4
    }

    /// Makes it blank. That stops the CPU for a second or two.
    #[inline(never)]
    pub(crate) fn erase(self) {
        let flash = unlocked();
        // SAFETY: the number of a sector that no image reaches.
        flash.cr().write(|w| unsafe {
            w.psize()
                .bits(BY_WORD)
                .ser()
                .set_bit()
                .snb()
                .bits(self.number())
        });
        flash.cr().modify(|_, w| w.strt().set_bit());
        wait(&flash);
        flash.cr().write(|w| w.lock().set_bit());
        // The cache of data does not notice.
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit());
        flash.acr().modify(|_, w| w.dcen().set_bit());
    }

    /// Writes a record, and reads it back; whether it stands there. That stops the CPU for some 16 microseconds a word.
    #[inline(never)]
    pub(crate) fn write<const N: usize>(self, record: usize, words: &[u32; N]) -> bool {
        if record >= BYTES / (4 * N) {
            return false;
        }
        let first = (self.0 as *mut [u32; N]).wrapping_add(record).cast::<u32>();
        let flash = unlocked();
        // SAFETY: a size that the register knows.
        flash
            .cr()
            .write(|w| unsafe { w.psize().bits(BY_WORD).pg().set_bit() });
        for (at, word) in words.iter().enumerate() {
            // SAFETY: inside the sector, and aligned.
            unsafe { write_volatile(first.wrapping_add(at), *word) };
            wait(&flash);
        }
        flash.cr().write(|w| w.lock().set_bit());
        let mut words = words.iter().enumerate();
        // SAFETY: as above.
        words.all(|(at, word)| unsafe { read_volatile(first.wrapping_add(at)) } == *word)
    }
}

/// Words at a time, as the 3.3 V of this board allow.
const BY_WORD: u8 = 2;

/// The flash's registers, ready to write.
fn unlocked() -> FLASH {
    const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
    // SAFETY: no other access to these registers is under way: nothing else in this program has them.
    let flash = unsafe { FLASH::steal() };
    wait(&flash);
    for key in KEYS {
        // SAFETY: any word may be written there; these two unlock.
        flash.keyr().write(|w| unsafe { w.bits(key) });
    }
    flash
}

/// Reading waits by itself until the flash is free; this is for what is asked of it next.
fn wait(flash: &FLASH) {
    while flash.sr().read().bsy().bit_is_set() {}
}
