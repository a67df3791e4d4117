//! Which epoch comes next, and where that is written down: a number that rises at every start and never falls.
//!
//! Two sectors of flash hold it. Each start appends an entry of two words, the epoch and its complement, to the sector that has
//! the largest; when that is full the other one is erased and gone on with, so that a loss of power at any moment leaves the
//! largest epoch that was ever used where it is. An entry that a loss of power has cut short is no epoch, and its epoch has not
//! been used: it counts only once it has been read back. 16 384 starts fill a sector of 128 KiB.
//!
//! An entry that cannot be written is tried at the next places. If all of them fail, the epoch is used all the same: it is above all that
//! were kept, so the neighbours believe it, whereas with an older one they would refuse this drone for as long as they fly. What is lost is
//! the start after: it may come to the same epoch, and be refused until the neighbours are switched off and on. So that is logged as
//! an error, and the drone is not to fly again before its block has a larger epoch and its flash is sound.

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

/// Places that are tried at most.
const TRIES: usize = 4;

/// The epoch of this start, and whether it stands in the flash; `None` after the last one. `write` takes the entry of a step, erases before
/// that where it says so, and tells whether the entry reads back.
pub fn begin(
    sectors: [&[Entry]; 2],
    floor: u32,
    mut write: impl FnMut(Step) -> bool,
) -> Option<(u32, bool)> {
    let first = next(sectors, floor)?;
    let room = sectors.get(first.sector).map_or(0, |entries| entries.len());
    let places = (first.entry..room).take(TRIES);
    let kept = places.zip(0..).any(|(entry, tried)| {
        write(Step {
            entry,
            erase: first.erase && tried == 0,
            ..first
        })
    });
    Some((first.epoch, kept))
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
