//! Which epoch comes next: a number that rises at every start and never falls.
//!
//! It is in a [`Journal`] of its own, which each start adds an entry to, so that a loss of power at any moment leaves the largest epoch
//! that was ever used where it is. An entry that a loss of power has cut short is no epoch, and its epoch has not been used: it counts
//! only once it has been read back. 10 922 starts fill a sector of 128 KiB.
//!
//! An entry that cannot be written is tried at the next places. If all of them fail, the epoch is used all the same: it is above all that
//! were kept, so the neighbours believe it, whereas with an older one they would refuse this drone for as long as they fly. What is lost is
//! the start after: it may come to the same epoch, and be refused until the neighbours are switched off and on. So that is logged as
//! an error, and the drone is not to fly again before its block has a larger epoch and its flash is sound.

use crate::journal::{Flash, Journal, WhenFull};

/// Where the two sectors begin: sectors 9 and 10 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x080A_0000, 0x080C_0000];

/// Words of an entry that are kept.
pub const WORDS: usize = 1;

/// The same for every configuration block: no block lets the epoch fall.
pub const KEY: u32 = 0;

/// The epoch of this start, at least `floor`, and whether it stands in the flash; `None` after the last one there is, 4294967294.
pub fn begin<F: Flash>(log: &mut Journal<F>, floor: u32) -> Option<(u32, bool)> {
    log.tidy();
    let [newest] = log.newest::<WORDS>().unwrap_or([0]);
    let epoch = newest.checked_add(1)?.max(floor).max(1);
    if epoch == u32::MAX {
        return None;
    }
    Some((epoch, log.keep(&[epoch], WhenFull::Erase)))
}
