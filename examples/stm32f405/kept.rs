//! With the feature `upload`: what was uploaded is in the flash before it is needed again.

use uav_relay::Relay;

use super::uploads::{self, Found, next, record, stale};
use super::{board, flash, log};

/// Has `relay`, which was just made, fly what it held when this drone was switched off. A sector that does not have that is made
/// blank, so that nothing has to be erased in flight.
#[inline(never)]
pub(crate) fn resume(relay: &mut Relay) {
    let found = flash::UPLOADS.map(look);
    for ((sector, found), stale) in flash::UPLOADS.iter().zip(found).zip(stale(found)) {
        if stale {
            sector.erase();
        } else if found.newest.is_some() {
            fly(relay, *sector, found);
        }
    }
}

/// With the newest upload of `sector`.
#[inline(never)]
fn fly(relay: &mut Relay, sector: flash::Sector, found: Found) {
    let record = found.newest.and_then(|at| sector.records().get(at.record));
    if let Some(upload) = record.and_then(|record| uploads::upload(record, block()))
        && relay.resume(&upload).is_ok()
    {
        log::resumes(upload.version());
    }
}

/// Writes down what `relay` holds since just now.
#[inline(never)]
pub(crate) fn keep(relay: &Relay) {
    let Some(upload) = relay.upload() else { return };
    let place = next(flash::UPLOADS.map(look));
    let kept = place.is_some_and(|place| {
        let sector = flash::UPLOADS.get(place.sector);
        sector.is_some_and(|sector| sector.write(place.record, &record(upload, block())))
    });
    log::uploaded(upload.version(), kept);
}

#[inline(never)]
fn look(sector: flash::Sector) -> Found {
    Found::of(sector.records(), block())
}

/// The check sequence of the configuration block: its last four bytes.
fn block() -> u32 {
    let bytes = board::block().last_chunk();
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}
