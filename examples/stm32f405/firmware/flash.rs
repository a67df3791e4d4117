//! Flash sectors that this program writes. All unsafe code for them is here.

use core::ptr::{read_volatile, write_volatile};

use stm32f4xx_hal::pac::FLASH;
#[cfg(feature = "auth")]
use uav_relay_kept::epoch;
use uav_relay_kept::journal::{BLANK, Flash};
use uav_relay_kept::views;

#[cfg(feature = "upload")]
use super::uploads;

/// Flash sector outside of every firmware image (`memory.x`), given by its address.
#[derive(Clone, Copy)]
struct Sector(u32);

#[derive(Clone, Copy)]
pub(crate) struct Sectors([Sector; 2]);

pub(crate) const VIEWS: Sectors = Sectors::at(views::SECTORS);

#[cfg(feature = "auth")]
pub(crate) const EPOCHS: Sectors = Sectors::at(epoch::SECTORS);

#[cfg(feature = "upload")]
pub(crate) const UPLOADS: Sectors = Sectors::at(uploads::SECTORS);

const KIB: u32 = 1024;

const FLASH_START: u32 = 0x0800_0000;
const LARGE: u32 = FLASH_START + 128 * KIB;

impl Sectors {
    const fn at([first, second]: [u32; 2]) -> Self {
        Self([Sector(first), Sector(second)])
    }

    fn get(&self, sector: usize) -> Option<Sector> {
        self.0.get(sector).copied()
    }

    #[inline(never)] // small, and called often
    fn all(&self, sector: usize) -> &[u32] {
        self.get(sector).map_or(&[], Sector::words)
    }
}

impl Flash for Sectors {
    fn words(&self, sector: usize) -> usize {
        self.all(sector).len()
    }

    fn used(&mut self, sector: usize) -> usize {
        let words = self.all(sector);
        let last = words.iter().rposition(|word| *word != BLANK);
        last.map_or(0, |last| last + 1)
    }

    fn read(&mut self, sector: usize, word: usize) -> u32 {
        self.all(sector).get(word).copied().unwrap_or(BLANK)
    }

    fn erase(&mut self, sector: usize) {
        if let Some(sector) = self.get(sector) {
            sector.erase();
        }
    }

    fn write(&mut self, sector: usize, first: usize, words: &[u32]) -> bool {
        self.get(sector)
            .is_some_and(|sector| sector.write(first, words))
    }
}

impl Sector {
    /// Returns the length of this sector, words: 16 KiB or 128 KiB. Sectors of 64 KiB are not used.
    const fn len(self) -> usize {
        let bytes = if self.0 < LARGE { 16 * KIB } else { 128 * KIB };
        bytes as usize / 4
    }

    const fn words<'a>(self) -> &'a [u32] {
        // SAFETY: the words are a part of the flash, always readable and aligned. Only this file writes there, through
        // a `Sectors` that is borrowed while the slice lives.
        unsafe { core::slice::from_raw_parts(self.0 as *const u32, self.len()) }
    }

    /// Returns the sector's number in the flash registers. The large sectors begin with number 5.
    const fn number(self) -> u8 {
        let number = if self.0 < LARGE {
            (self.0 - FLASH_START) / (16 * KIB)
        } else {
            (self.0 - LARGE) / (128 * KIB) + 5
        };
        number.to_le_bytes()[0]
    }

    /// Erases the sector. This stops the CPU for up to 2 s, depending on the sector's size.
    #[inline(never)]
    fn erase(self) {
        let flash = unlocked();
        // SAFETY: the number is that of a sector that no image reaches.
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
        // The data cache must be reset explicitly.
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit());
        flash.acr().modify(|_, w| w.dcen().set_bit());
    }

    /// Writes `words` from word `first` of this sector on. Returns true if they are read back correctly.
    ///
    /// Stops the CPU for about 16 microseconds a word.
    #[inline(never)]
    fn write(self, first: usize, words: &[u32]) -> bool {
        let end = first.checked_add(words.len());
        if end.is_none_or(|end| end > self.len()) {
            return false;
        }
        let first = (self.0 as *mut u32).wrapping_add(first);
        let flash = unlocked();
        // SAFETY: the value is a valid size for this register.
        flash
            .cr()
            .write(|w| unsafe { w.psize().bits(BY_WORD).pg().set_bit() });
        for (at, word) in words.iter().enumerate() {
            // SAFETY: the address is inside the sector, and aligned.
            unsafe { write_volatile(first.wrapping_add(at), *word) };
            wait(&flash);
        }
        flash.cr().write(|w| w.lock().set_bit());
        let mut words = words.iter().enumerate();
        // SAFETY: as above.
        words.all(|(at, word)| unsafe { read_volatile(first.wrapping_add(at)) } == *word)
    }
}

/// Value of the field PSIZE in the flash's control register: writes of 32 bits, possible at 3.3 V.
const BY_WORD: u8 = 2;

/// Unlocks the flash registers for writing.
fn unlocked() -> FLASH {
    const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
    // SAFETY: nothing else in this program accesses these registers.
    let flash = unsafe { FLASH::steal() };
    wait(&flash);
    for key in KEYS {
        // SAFETY: the register accepts any word; these two unlock.
        flash.keyr().write(|w| unsafe { w.bits(key) });
    }
    flash
}

/// Waits until the flash is idle, as each command requires. Reads need no such wait, because the hardware delays them.
fn wait(flash: &FLASH) {
    while flash.sr().read().bsy().bit_is_set() {}
}
