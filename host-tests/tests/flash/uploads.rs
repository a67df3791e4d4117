//! Uploads in a drone's flash; `journal.rs` tests power failures.

use host_tests::firmware::journal::{Journal, OVERHEAD, WhenFull};
use host_tests::firmware::ram::Ram;
use host_tests::firmware::uploads::{WORDS, pack_upload, unpack_upload};
use uav_relay::Upload;
use uav_relay_scenario::Scenario;
use uav_relay_tools::provision::block::Flight;

/// Number of 32-bit words in a flash sector of 128 KiB.
const SECTOR: usize = 32 * 1024;

fn version(number: u16) -> Upload {
    let flight = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    Upload::new(flight.mission(), number, *flight.mission().config()).unwrap()
}

#[test]
fn the_stated_number_of_uploads_is_stored_in_a_flight() {
    let mut flash = Ram::blank(SECTOR, 1);
    let mut log = Journal::new(&mut flash, WORDS, 7);
    assert_eq!(SECTOR / (WORDS + OVERHEAD), 992);
    assert!(log.append(&pack_upload(&version(1)), WhenFull::Refuse));
    assert!(log.append(&pack_upload(&version(2)), WhenFull::Refuse));
    let newest = log.newest::<WORDS>().unwrap();
    assert_eq!(unpack_upload(&newest), Some(version(2)));
}

#[test]
fn invalid_bytes_are_no_upload() {
    assert_eq!(unpack_upload(&pack_upload(&version(77))), Some(version(77)));
    assert_eq!(unpack_upload(&[]), None);
    assert_eq!(unpack_upload(&[u32::MAX; WORDS]), None);
}
