//! Votes on views in a drone's flash, binding after a reboot; `journal.rs` tests power failures.

use host_tests::firmware::journal::{Journal, OVERHEAD, WhenFull};
use host_tests::firmware::ram::Ram;
use host_tests::firmware::views::{SECTORS, WORDS, pack_record, unpack_record};
use host_tests::fixtures::voted;
use uav_relay::ViewRecord;

/// Number of 32-bit words in a flash sector of 16 KiB.
const SECTOR: usize = 4 * 1024;

fn found(log: &mut Journal<&mut Ram>) -> Option<ViewRecord> {
    log.newest::<WORDS>()
        .and_then(|words| unpack_record(&words))
}

#[test]
fn the_stated_number_of_views_is_stored_before_an_erase() {
    assert_eq!(SECTORS[1] - SECTORS[0], 16 * 1024);
    let mut flash = Ram::blank(SECTOR, 1);
    for number in 1..=1_000 {
        let said = voted(7, 5, number, true);
        let mut log = Journal::new(&mut flash, WORDS, 7);
        assert!(log.append(&pack_record(&said), WhenFull::Erase));
        assert_eq!(found(&mut log), Some(said));
    }
    assert_eq!(SECTOR / (WORDS + OVERHEAD), 240);
    assert_eq!(flash.erased, [0, 1, 0], "behind 480, 720 and 960");
    let mut start = Journal::new(&mut flash, WORDS, 7);
    start.tidy();
    assert_eq!(found(&mut start), Some(voted(7, 5, 1_000, true)));
}

/// Checks that the previous record stays valid if the power fails while a vote is recorded.
///
/// The previous record is still right, because the relay has not yet sent the new vote.
#[test]
fn after_a_torn_record_the_previous_one_is_read() {
    for written in 1..WORDS + OVERHEAD {
        let mut flash = Ram::blank(SECTOR, written as u64);
        let mut log = Journal::new(&mut flash, WORDS, 7);
        assert!(log.append(&pack_record(&voted(7, 5, 1, true)), WhenFull::Erase));
        flash.power = Some(written);
        let mut log = Journal::new(&mut flash, WORDS, 7);
        assert!(!log.append(&pack_record(&voted(7, 5, 2, false)), WhenFull::Erase));
        assert!(flash.switch_on());
        let mut log = Journal::new(&mut flash, WORDS, 7);
        assert_eq!(found(&mut log), Some(voted(7, 5, 1, true)));
        assert!(log.append(&pack_record(&voted(7, 5, 3, true)), WhenFull::Erase));
        assert_eq!(found(&mut log), Some(voted(7, 5, 3, true)));
    }
}

#[test]
fn invalid_bytes_are_no_view_record() {
    assert_eq!(unpack_record(&[]), None);
    assert_eq!(unpack_record(&[u32::MAX; WORDS]), None);
    let other_format = 2;
    let mut words = pack_record(&voted(7, 5, 1, true));
    words[0] = words[0] & !0xFF | other_format;
    assert_eq!(unpack_record(&words), None);
}
