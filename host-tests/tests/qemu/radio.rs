//! Emulated drones on one radio channel, where each receives two drones on either side.

use uav_relay_sim::simulator::faults::Faults;

use crate::chain::{BAD_DAY, paper, simulated};
use crate::fleet::{Fleet, Image};
use crate::log::Line;

#[test]
fn five_drones_on_one_radio_settle_like_the_simulation() {
    let flight = paper(5);
    for (faults, seed) in [(Faults::default(), 1), (BAD_DAY, 2)] {
        let mut fleet = Fleet::of(Image::Radio, &flight, faults, seed);
        assert_eq!(fleet.places(), simulated(&flight), "{faults:?}");
        // Drone 3 receives frames between 1, 2, 4 and 5.
        let counters = fleet.counters(3);
        assert!(counters.counter("overheard").unwrap() > 0, "{counters:?}");
        // With faults a drone may lose its neighbour and send a hello to the next one.
        if faults == Faults::default() {
            assert_eq!(counters.counter("misaddressed"), Some(0), "{counters:?}");
        }
    }
}

/// Checks that the other four drones take the positions of a chain of four if drone 3 is switched off.
#[test]
fn four_of_five_on_one_radio_recover_from_a_loss() {
    let flight = paper(5);
    let mut fleet = Fleet::of(Image::Radio, &flight, Faults::default(), 3);
    assert_eq!(fleet.places(), simulated(&flight));
    let before = fleet.lines.len();
    fleet.kill(3);
    let left = [1, 2, 4, 5];
    let formed = simulated(&paper(4));
    // Each drone logs the new view, its new position, and the agreement.
    let story = |lines: &[Line], drone: u16, place: &[u32; 3]| {
        let mut new = lines[before..].iter().filter(|line| line.drone == drone);
        let counted = new.find(|line| {
            line.text
                == "the relays have agreed which of them form the chain (a new view): they agree on new positions next"
        })?;
        new.find(|line| line.setpoint() == Some(*place))?;
        let agreed = new.find(|line| line.text == "the relays have agreed on positions")?;
        Some(agreed.at - counted.at)
    };
    fleet.wait("chain of four", |lines| {
        left.iter()
            .zip(&formed)
            .all(|(drone, place)| story(lines, *drone, place).is_some())
    });
    for (drone, place) in left.iter().zip(&formed) {
        let took = story(&fleet.lines, *drone, place).unwrap();
        println!("drone {drone}: agreed {took} us after it was counted");
    }
    // Only drone 3 is reported. A neighbour that links past drone 3 before its own timeout reports no loss.
    let lost = fleet.lines.iter();
    let lost = lost.filter(|line| line.text.contains("does not reply"));
    let lost: Vec<(u16, &str)> = lost.map(|line| (line.drone, line.text.as_str())).collect();
    let of_three = [
        (
            2,
            "node 3 downstream (toward Rx) does not reply: look for that drone",
        ),
        (
            4,
            "node 3 upstream (toward Tx) does not reply: look for that drone",
        ),
    ];
    assert!(!lost.is_empty());
    assert!(lost.iter().all(|loss| of_three.contains(loss)), "{lost:?}");
}
