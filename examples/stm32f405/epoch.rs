//! Which epoch comes next, and where that is written down: a number that rises at every start and never falls.
//!
//! Two sectors of flash hold it. Each start appends an entry of two words, the epoch and its complement, to the sector that has
//! the largest; when that is full the other one is erased and gone on with, so that a loss of power at any moment leaves the
//! largest epoch that was ever used where it is. An entry that a loss of power has cut short is no epoch, and its epoch has not
//! been used: it counts only once it has been read back. 16 384 starts fill a sector of 128 KiB.

/// Where the two sectors begin: sectors 9 and 10 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x080A_0000, 0x080C_0000];

/// An epoch and its complement; all ones where nothing is written.
pub type Entry = [u32; 2];

/// One step of the log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Step {
    /// The epoch of this start, 1 or more.
    pub epoch: u32,
    /// The sector that takes its entry, 0 or 1.
    pub sector: usize,
    /// Number of the entry in it.
    pub entry: usize,
    /// Whether that sector has to be erased first.
    pub erase: bool,
}

/// The entry of `epoch`.
pub const fn entry(epoch: u32) -> Entry {
    [epoch, !epoch]
}

/// What comes next after what stands in the sectors, at least `floor`; `None` after the last epoch there is, 4294967294.
///
/// Linear in the entries: 32 768 of them.
pub fn next(sectors: [&[Entry]; 2], floor: u32) -> Option<Step> {
    let [first, second] = sectors.map(Found::of);
    let newest = first.newest.max(second.newest);
    let epoch = newest.checked_add(1)?.max(floor).max(1);
    if epoch == u32::MAX {
        return None;
    }
    let sector = usize::from(second.newest > first.newest);
    let [current, other] = if sector == 0 {
        [first, second]
    } else {
        [second, first]
    };
    Some(if current.used < current.room {
        Step {
            epoch,
            sector,
            entry: current.used,
            erase: false,
        }
    } else {
        Step {
            epoch,
            sector: 1 - sector,
            entry: 0,
            erase: other.used > 0,
        }
    })
}

/// What stands in a sector.
#[derive(Clone, Copy)]
struct Found {
    /// The largest epoch, 0 without any.
    newest: u32,
    /// Entries up to the last that is not blank.
    used: usize,
    room: usize,
}

impl Found {
    fn of(entries: &[Entry]) -> Self {
        let (mut newest, mut used) = (0, 0);
        for (before, &[epoch, complement]) in entries.iter().enumerate() {
            if [epoch, complement] != [u32::MAX; 2] {
                used = before + 1;
            }
            if complement == !epoch {
                newest = epoch.max(newest);
            }
        }
        Self {
            newest,
            used,
            room: entries.len(),
        }
    }
}
