//! Emulated drones that share one radio channel: each hears two drones to either side.

use host_tests::sim::faults::Faults;

use crate::chain::{BAD_DAY, paper, simulated};
use crate::fleet::{Fleet, Image};

#[test]
fn five_on_one_radio_settle_where_the_simulated_chain_does() {
    let flight = paper(5);
    for (faults, seed) in [(Faults::default(), 1), (BAD_DAY, 2)] {
        let mut fleet = Fleet::of(Image::Radio, &flight, faults, seed);
        assert_eq!(fleet.places(), simulated(&flight), "{faults:?}");
        // Drone 3 hears what 1, 2, 4 and 5 say to each other.
        let counters = fleet.counters(3);
        assert!(counters.counter("overheard").unwrap() > 0, "{counters:?}");
        assert_eq!(counters.counter("misaddressed"), Some(0), "{counters:?}");
    }
}
