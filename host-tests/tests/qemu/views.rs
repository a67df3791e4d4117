//! Emulated drones that rebooted in flight: their votes on views are binding.

use host_tests::firmware::emulator::Kept;
use host_tests::firmware::journal::{Journal, WhenFull};
use host_tests::firmware::ram::Ram;
use host_tests::firmware::views::{SECTORS, WORDS, pack_record};
use host_tests::fixtures::voted;
use uav_relay::ViewRecord;
use uav_relay::wire::digest::digest;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_tools::provision::block::Flight;

use crate::chain::{paper, simulated};
use crate::fleet::{Fleet, Image};

/// Number of 32-bit words in a flash sector of 16 KiB.
const SMALL: usize = 4 * 1024;

fn blocks(flight: &Flight) -> Vec<Vec<u8>> {
    (1..=flight.mission().relays())
        .map(|index| flight.block(index).unwrap().to_vec())
        .collect()
}

/// Returns a flash with the voting records `said`. A power failure has truncated the last record.
fn flash(block: &[u8], said: &[ViewRecord]) -> Vec<Kept> {
    let check = u32::from_le_bytes(*block.last_chunk().unwrap());
    let mut flash = Ram::blank(SMALL, 1);
    for (at, record) in said.iter().enumerate() {
        let is_last = at + 1 == said.len();
        flash.power = is_last.then_some(9);
        let stands =
            Journal::new(&mut flash, WORDS, check).append(&pack_record(record), WhenFull::Erase);
        assert_eq!(stands, !is_last);
    }
    vec![(SECTORS[0], flash.bytes())]
}

const HOLDS: &str = "votes on the chain's members from before this start were read from flash";

/// Checks that drones with stored votes up to membership view 40 get setpoints in a later view.
#[test]
fn three_restarted_drones_keep_their_votes() {
    let flight = paper(3);
    let base = digest(flight.mission());
    let blocks = blocks(&flight);
    let said = [30, 40, 50].map(|number| voted(base, 3, number, true));
    let kept: Vec<Vec<Kept>> = blocks.iter().map(|block| flash(block, &said)).collect();
    let mut fleet = Fleet::with_flash(Image::Radio, &blocks, &kept, Faults::default(), 1);
    fleet.settle_at(&simulated(&flight));
    for drone in 1..=3 {
        let told = fleet.of_drone(drone).filter(|line| line.text == HOLDS);
        assert_eq!(told.count(), 1, "drone {drone}");
    }
}

/// Checks that two of three drones get no setpoints if their stored membership view excludes both.
///
/// Without that stored view, the two drones would have a quorum.
#[test]
fn two_drones_that_recall_a_view_without_them_do_not_fly() {
    let flight = paper(3);
    let base = digest(flight.mission());
    let blocks = blocks(&flight)[..2].to_vec();
    let said = [voted(base, 1, 40, false), voted(base, 3, 50, true)];
    let kept: Vec<Vec<Kept>> = blocks.iter().map(|block| flash(block, &said)).collect();
    let mut fleet = Fleet::with_flash(Image::Radio, &blocks, &kept, Faults::default(), 1);
    fleet.wait("a quorum that is missed", |lines| {
        lines.iter().any(|line| {
            line.text
                == "no quorum: too few relays receive each other to agree on the chain's members: bring the missing relays into range, or land this part of the chain"
        })
    });
    assert!(fleet.lines.iter().all(|line| line.setpoint().is_none()));
    drop(fleet);
    // The same two drones with an empty flash.
    let mut fleet = Fleet::start(Image::Radio, &blocks, Faults::default(), 1);
    fleet.wait("places for two", |lines| {
        [1, 2].iter().all(|drone| {
            let mut of_drone = lines.iter().filter(|line| line.drone == *drone);
            of_drone.any(|line| line.setpoint().is_some())
        })
    });
}
