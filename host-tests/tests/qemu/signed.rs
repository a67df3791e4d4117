//! Emulated drones with signed frames.

use uav_relay_sim::simulator::faults::Faults;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::Secret;

use crate::chain::{BAD_DAY, paper, simulated};
use crate::fleet::{Fleet, Image};
use crate::log::Line;

const KEY: [u8; 32] = *b"what five drones have, no others";

fn signed(flight: &Flight, key: [u8; 32]) -> Flight {
    let secret = Secret { key, epoch: 77 };
    flight.clone().signed(Some(secret))
}

#[test]
fn five_signing_drones_settle_like_the_simulation() {
    let plain = paper(5);
    let flight = signed(&plain, KEY);
    for (image, faults) in [
        (Image::Wires, Faults::default()),
        (Image::Wires, BAD_DAY),
        (Image::Radio, BAD_DAY),
    ] {
        let mut fleet = Fleet::of(image, &flight, faults, 1);
        assert_eq!(fleet.places(), simulated(&plain), "{image:?}");
        for drone in 1..=5 {
            let counters = fleet.counters(drone);
            for name in ["unsigned", "malformed"] {
                assert_eq!(counters.counter(name), Some(0), "{}", counters.text);
            }
            assert!(counters.counter("handshakes").unwrap() > 0);
            // The emulator's flash is read-only, which the drone reports.
            let mut lines = fleet.after_start(drone).skip(1);
            assert_eq!(
                lines.next().unwrap().text,
                "frames are signed; epoch 77 (start counter): this relay cannot store it, so increase the epoch in the configuration block before every start"
            );
        }
    }
}

/// Checks that a drone with another key, and a drone without a key, take no part in the chain.
#[test]
fn a_drone_without_the_key_takes_no_part() {
    let flight = paper(4);
    let blocks: Vec<Vec<u8>> = (1..=4)
        .map(|index| {
            let flight = match index {
                3 => signed(&flight, [1; 32]),
                4 => flight.clone(),
                _ => signed(&flight, KEY),
            };
            flight.block(index).unwrap().to_vec()
        })
        .collect();
    let mut fleet = Fleet::start(Image::Wires, &blocks, Faults::default(), 1);
    fleet.wait("neighbours that are lost", |lines| {
        let lost = |drone, text| {
            let mut lines = lines.iter().filter(|line: &&Line| line.drone == drone);
            lines.any(|line| line.text == text)
        };
        lost(
            2,
            "node 3 downstream (toward Rx) does not reply: look for that drone",
        ) && lost(
            3,
            "node 4 downstream (toward Rx) does not reply: look for that drone",
        ) && lost(
            4,
            "node 3 upstream (toward Tx) does not reply: look for that drone",
        )
    });
    assert!(fleet.lines.iter().all(|line| line.setpoint().is_none()));
    let counters = [1, 2, 3, 4].map(|drone| fleet.counters(drone));
    let counter = |drone: usize, name| counters[drone - 1].counter(name).unwrap();
    assert_eq!(counter(1, "forged"), 0);
    assert!(counter(1, "handshakes") > 0);
    assert!(counter(2, "forged") > 0 && counter(3, "forged") > 0);
    assert!(counter(3, "unsigned") > 0);
    assert!(
        counter(4, "version") > 0,
        "it does not know what a tag is for"
    );
    let said = fleet.after_start(4).nth(1).unwrap();
    assert_eq!(
        said.text,
        "no key: frames are not signed, so anybody in range can forge them"
    );
    assert_eq!(
        fleet.after_start(4).nth(2).unwrap().text,
        "no sites (positions of Tx and Rx on earth): no autopilot is controlled, and drones are not kept apart while they move"
    );
}
