//! Block with a key: frames are signed, with an epoch that increases at every start.

use relay_app::board::Board;
use relay_app::drone::Refused;
use uav_relay::Event;
use uav_relay_block::ConfigError;
use uav_relay_kept::epoch;
use uav_relay_kept::journal::Journal;
use uav_relay_kept::nor::Nor;

use crate::bench::{Bench, SITES, block, refused};
use crate::ram::Ram;

/// Time after which a silent neighbour certainly counts as lost, ms: 15 s plus a margin.
const LOST: u32 = 25_000;

fn epoch(flash: &Ram) -> Option<u32> {
    let storage = flash.storage();
    let flash = Nor::new(storage.flash, storage.epochs);
    let newest = Journal::new(flash, epoch::WORDS, epoch::KEY).newest::<{ epoch::WORDS }>();
    newest.map(|[epoch]| epoch)
}

#[test]
fn neighbours_accept_the_epoch_of_every_start() {
    let flash = Ram::blank();
    let mut bench = Bench::new();
    for start in 1..=4 {
        bench.boot(flash.board(&block(Some(1), None), start));
        // A relay that was lost several times is observed for a longer time before it is readmitted.
        let seen = bench.run(60_000);
        assert!(seen.contains(&Event::Converged), "start {start}: {seen:?}");
        assert_eq!(epoch(&flash), Some(start));
        bench.switch_off();
        let seen = bench.run(LOST);
        let lost = |event: &Event| matches!(event, Event::NeighbourLost { .. });
        assert!(seen.iter().any(lost), "start {start}: {seen:?}");
    }
    assert_eq!(bench.signature_rejections(), 0);
}

/// Checks that a relay is rejected if it restarts with an old epoch, or with its last epoch and seed.
///
/// The frames of such a relay could be replays of earlier frames. A test in the library covers a second relay with the
/// same index and epoch, but a different seed.
#[test]
fn frames_with_a_forgotten_epoch_are_rejected() {
    for (epoch, seed) in [(1, 2), (2, 1)] {
        let mut bench = Bench::new();
        bench.boot(Ram::blank().board(&block(Some(2), None), 1));
        let seen = bench.run(10_000);
        assert!(seen.contains(&Event::Converged), "{seen:?}");
        bench.switch_off();
        bench.run(LOST);
        bench.boot(Ram::blank().board(&block(Some(epoch), None), seed));
        let seen = bench.run(10_000);
        assert!(!seen.contains(&Event::Converged), "{epoch}: {seen:?}");
        let went_back = Event::EpochWentBack { node: 1 };
        assert!(seen.contains(&went_back), "{epoch}: {seen:?}");
    }
}

#[test]
fn a_block_may_raise_the_epoch_and_never_lowers_it() {
    let flash = Ram::blank();
    let mut bench = Bench::new();
    for (least, expected) in [(40, 40), (1, 41), (900, 900), (41, 901)] {
        bench.boot(flash.board(&block(Some(least), None), 1));
        bench.run(1);
        assert_eq!(epoch(&flash), Some(expected));
    }
}

/// Checks that the epoch rises at every start, also when a sector is full, for two sector lengths.
#[test]
fn the_epoch_rises_through_full_sectors() {
    let flash = Ram::blank();
    let mut bench = Bench::new();
    for start in 1..=1_100 {
        bench.boot(flash.board(&block(Some(1), None), start));
        bench.run(1);
        assert_eq!(epoch(&flash), Some(start));
    }
}

#[test]
fn a_board_reports_why_it_cannot_start() {
    let board = |epoch, sites| Ram::blank().board(&block(epoch, sites), 1);
    let no_flash = Board {
        storage: None,
        ..board(Some(1), None)
    };
    assert_eq!(refused(no_flash), Refused::NoFlash);
    assert_eq!(
        refused(board(Some(u32::MAX), None)),
        Refused::Block(ConfigError::Secret)
    );
    assert_eq!(refused(board(None, Some(SITES))), Refused::NoAutopilot);
    let blank = Ram::blank().board(&[0xFF; uav_relay_block::LEN], 1);
    assert_eq!(refused(blank), Refused::Block(ConfigError::Blank));
    let flash = Ram::blank();
    let last = block(Some(u32::MAX - 1), None);
    Bench::new().boot(flash.board(&last, 1));
    let mut bench = Bench::new();
    bench.boot(flash.board(&last, 1));
    bench.run(1);
    drop(bench);
    assert_eq!(refused(flash.board(&last, 1)), Refused::NoEpoch);
}
