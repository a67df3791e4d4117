//! Epoch: a number that rises at every start.
//!
//! Each start appends an entry to a [`Journal`], so a loss of power at any moment preserves the largest epoch ever
//! used. An epoch is used only after its entry has been read back, so an entry cut short has not been used. A sector
//! of 128 KiB holds 10 922 starts.
//!
//! A failed write is retried at the next places. If all fail, the epoch is used all the same. It is larger than all
//! stored ones, so the neighbours accept it; they would reject an older one throughout the flight. But the next start
//! may get the same epoch and be rejected until the neighbours restart. So the failure is logged as an error. The
//! drone must not fly again before its block has a larger epoch and its flash is sound.

use crate::journal::{Flash, Journal, WhenFull};

/// Addresses of the two flash sectors for epochs: sectors 9 and 10 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x080A_0000, 0x080C_0000];

/// Length of an epoch in the journal, words.
pub const WORDS: usize = 1;

/// Key of the journal for epochs: a constant.
///
/// If the key depended on the configuration block, a changed block would reset the epoch, which must never fall.
pub const KEY: u32 = 0;

/// Returns the epoch of this start (a number that rises at every start), and true if it was stored.
///
/// The epoch is at least `floor`. The result is `None` once the last epoch, 4294967294, has been used.
pub fn begin<F: Flash>(log: &mut Journal<F>, floor: u32) -> Option<(u32, bool)> {
    log.tidy();
    let [newest] = log.newest::<WORDS>().unwrap_or([0]);
    let epoch = newest.checked_add(1)?.max(floor).max(1);
    if epoch == u32::MAX {
        return None;
    }
    Some((epoch, log.append(&[epoch], WhenFull::Erase)))
}
