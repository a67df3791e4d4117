//! Votes on views, by radio: they survive a reboot.

use uav_relay::ViewRecord;
use uav_relay_kept::nor::Nor;
use uav_relay_kept::views::{WORDS, log, unpack_record};

use crate::bench::{Bench, block_of_three};
use crate::ram::Ram;

fn newest(flash: &Ram) -> Option<ViewRecord> {
    let storage = flash.storage();
    let check = u32::from_le_bytes(*block_of_three().last_chunk().unwrap());
    let mut log = log(Nor::new(storage.flash, storage.views), check);
    log.newest::<WORDS>().and_then(|kept| unpack_record(&kept))
}

/// Returns the number of the view (agreed set of members) that the relay has promised to vote for.
///
/// `ViewRecord::to_bytes` has it in 4 bytes from offset 10.
fn promised(record: &ViewRecord) -> u32 {
    u32::from_le_bytes(record.to_bytes()[10..14].try_into().unwrap())
}

/// Checks that a relay restarted three times never votes for an older view (set of members).
///
/// The number of the promised view must never decrease. The remaining two relays fly on, and readmit the restarted
/// relay.
#[test]
fn no_promise_is_forgotten_over_reboots() {
    let flash = Ram::blank();
    let mut bench = Bench::radio();
    let mut last = 0;
    let mut rises = 0;
    for start in 1..=3 {
        bench.boot(flash.board(&block_of_three(), start));
        let before = newest(&flash);
        bench.run(1);
        assert_eq!(newest(&flash), before, "start {start}: nothing is said yet");
        for _ in 0..600 {
            bench.run(100);
            if let Some(record) = newest(&flash) {
                let now = promised(&record);
                assert!(now >= last, "start {start}: {now:#x} behind {last:#x}");
                rises += u32::from(now > last);
                last = now;
            }
        }
        bench.switch_off();
        bench.run(25_000);
    }
    println!("promised {last:#x} at last, {rises} times more than before");
    assert!(rises >= 2, "{rises}: too few views to forget one");
}
