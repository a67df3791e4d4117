//! What the relay has said in the votes on views, kept across a reboot in flight: a promise that is forgotten is none, and two parts of a
//! chain could fly one view each.
//!
//! It is in a [`Journal`](super::journal::Journal) of its own, whose key is the check sequence of the configuration block: with another
//! block a drone has forgotten what it said. It is written before anything is sent that follows from it.
//!
//! A view change takes three or four records, and a sector of 16 KiB has room for 240 of them. The second sector is blank at a start, so
//! the 240 records after it, some 60 view changes, erase nothing. When both sectors are full the older one is erased in flight, since a
//! relay that cannot keep what it says is no voice to count on; the newest record stands in the other sector meanwhile. The sectors
//! are small for that reason: an erase of 16 KiB stops the CPU for 0.25 s, for 0.5 s at most, where one of 128 KiB takes up to 2 s.

use uav_relay::ViewRecord;

use super::journal::{pack, unpack};

/// Where the two sectors begin: sectors 1 and 2 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x0800_4000, 0x0800_8000];

/// Words of a record that are kept.
pub const WORDS: usize = ViewRecord::LENGTH.div_ceil(4);

/// As it is kept.
pub fn kept(record: &ViewRecord) -> [u32; WORDS] {
    pack(&record.to_bytes())
}

/// What was kept, if it is of this format.
pub fn record(kept: &[u32]) -> Option<ViewRecord> {
    ViewRecord::from_bytes(&unpack::<{ ViewRecord::LENGTH }>(kept))
}
