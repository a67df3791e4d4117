//! Uploaded missions, kept across a reboot: a log in two sectors of flash, whose newest record counts.
//!
//! A record is an upload as [`Upload::encode`] writes it, a byte of zero, and a CRC-32C over both and the check sequence of the
//! configuration block: with another block a drone has forgotten what was uploaded before, and flies what the block says. A record
//! that a loss of power has cut short has no such CRC, and the one before it counts.
//!
//! Nothing is erased in flight, since that stops the CPU for a second or two: records are appended, first to the sector with the
//! newest, then to the other. At each start whichever does not have the newest is made blank, if it is not. A sector of 128 KiB has
//! room for 1489 records, so at least as many uploads are kept from one start to the next; what comes after them is flown all the same.

use uav_relay::Upload;
use uav_relay::wire::crc::CRC_32C;
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::upload::LENGTH;

/// Where the two sectors begin: sectors 7 and 8 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x0806_0000, 0x0808_0000];

/// Words of a record.
pub const WORDS: usize = 22;

/// A record; all ones where nothing is written.
pub type Record = [u32; WORDS];

/// Where a record goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Place {
    /// The sector, 0 or 1.
    pub sector: usize,
    /// Number of the record in it.
    pub record: usize,
}

/// The newest upload in a sector.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Newest {
    /// By which it is told from others.
    pub mission_id: MissionId,
    /// Number of its record.
    pub record: usize,
}

/// What stands in a sector.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Found {
    /// The newest upload, if there is one.
    pub newest: Option<Newest>,
    /// Records up to the last that is not blank.
    pub used: usize,
    room: usize,
}

/// The record of `upload` for a drone whose configuration block has the check sequence `block`.
pub fn record(upload: &Upload, block: u32) -> Record {
    let mut record = [0; WORDS];
    let mut bytes = [0; LENGTH + 1];
    // What was held was checked: it always fits.
    if upload.encode(&mut bytes).is_none() {
        return record;
    }
    let words = bytes
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word));
    for (place, word) in record.iter_mut().zip(words.chain([check(&bytes, block)])) {
        *place = word;
    }
    record
}

/// The upload in a record; `None` if it is blank, was cut short, or was made for a drone with another block.
pub fn upload(record: &Record, block: u32) -> Option<Upload> {
    let [words @ .., sum] = record;
    let mut bytes = [0; LENGTH + 1];
    for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
        *place = word.to_le_bytes();
    }
    if check(&bytes, block) != *sum {
        return None;
    }
    Upload::decode(bytes.get(..LENGTH)?)
}

fn check(bytes: &[u8], block: u32) -> u32 {
    let mut crc = CRC_32C.digest();
    crc.update(bytes);
    crc.update(&block.to_le_bytes());
    crc.finalize()
}

impl Found {
    /// Looks through the records of a sector, for a drone whose configuration block has the check sequence `block`.
    ///
    /// A relay holds newer missions only, so the last whole record is the newest. Linear in the words; a CRC for each record
    /// behind that one.
    pub fn of(records: &[Record], block: u32) -> Self {
        let last = records
            .iter()
            .rposition(|record| record.iter().any(|word| *word != u32::MAX));
        let used = last.map_or(0, |last| last.saturating_add(1));
        let mut back = records.iter().enumerate().take(used).rev();
        let newest = back.find_map(|(at, record)| {
            upload(record, block).map(|upload| Newest {
                mission_id: upload.id(),
                record: at,
            })
        });
        Self {
            newest,
            used,
            room: records.len(),
        }
    }
}

/// Which of the two sectors is in use: the one with the newest upload, 0 where there is none.
pub fn current(found: [Found; 2]) -> usize {
    let [first, second] = found.map(|found| found.newest.map(|newest| newest.mission_id));
    usize::from(second > first)
}

/// Which sectors are to be made blank at a start: those that are not, and do not have the newest upload.
pub fn stale(found: [Found; 2]) -> [bool; 2] {
    let current = current(found);
    let [first, second] = found.map(|found| found.used > 0);
    let keeps =
        |sector: usize| found.iter().any(|found| found.newest.is_some()) && sector == current;
    [first && !keeps(0), second && !keeps(1)]
}

/// Where the next record goes; `None` where there is no room left.
pub fn next(found: [Found; 2]) -> Option<Place> {
    let sector = current(found);
    let [first, second] = found;
    let order = if sector == 0 {
        [(0, first), (1, second)]
    } else {
        [(1, second), (0, first)]
    };
    let mut with_room = order
        .into_iter()
        .filter(|(_, found)| found.used < found.room);
    with_room.next().map(|(sector, found)| Place {
        sector,
        record: found.used,
    })
}
