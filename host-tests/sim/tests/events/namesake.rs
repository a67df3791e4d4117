//! Duplicate relay numbers.

use crate::air::mission;
use uav_relay::{Event, Relay};

use crate::air::{Air, KEY, auth, relay};

const TAKEN: Event = Event::DuplicateIndex { node: 3 };

/// Returns a flying chain of five with a second relay 3 that has just been switched on, and its index.
fn joined(loss: f64, seed: u64) -> (Air, usize) {
    let mission = mission(5);
    let begun = uav_relay::Instant::ZERO;
    let relays = (1..=5).map(|index| relay(&mission, index, None, begun));
    let mut air = Air::new(relays.collect(), loss, seed);
    // The second relay appears at a varying time between two passes.
    air.run(90 + seed % 7);
    assert!(air.relays.iter().all(|relay| relay.setpoint().is_some()));
    assert!(air.told(TAKEN).is_empty());
    let other = air.join(relay(&mission, 3, None, air.now));
    (air, other)
}

fn count() -> u64 {
    std::env::var("COUNT").map_or(20, |text| text.parse().unwrap())
}

/// Runs `COUNT` chains for each loss rate.
#[test]
fn the_later_of_two_relays_with_one_number_has_no_set_point_and_both_are_told() {
    for loss in [0.0, 0.3, 0.5] {
        for seed in 0..count() {
            let (mut air, other) = joined(loss, seed);
            let places: Vec<_> = air.relays.iter().map(Relay::setpoint).collect();
            for _ in 0..120 {
                air.run(1);
                let given = air.relays[other].setpoint();
                assert_eq!(given, None, "loss {loss}, seed {seed}, {:?}", air.now);
            }
            assert!(air.relays[other].is_passive() && !air.relays[2].is_passive());
            let mut told = air.told(TAKEN);
            told.sort_unstable();
            told.dedup();
            assert_eq!(told, [2, other], "loss {loss}");
            if loss == 0.0 {
                let after: Vec<_> = air.relays.iter().map(Relay::setpoint).collect();
                assert_eq!(after[..5], places[..5]);
            }
        }
    }
}

#[test]
fn the_later_one_takes_part_once_the_other_is_gone() {
    for by_hand in [false, true] {
        let (mut air, other) = joined(0.0, 1);
        air.run(10);
        assert!(air.relays[other].is_passive());
        air.off[2] = true;
        if by_hand {
            let now = air.now;
            air.relays[other].clear_duplicate_index(now);
            assert!(!air.relays[other].is_passive());
        }
        air.run(20);
        assert_eq!(air.relays[other].is_passive(), !by_hand);
        air.run(100);
        assert!(!air.relays[other].is_passive());
        assert!(air.relays[other].setpoint().is_some(), "it is relay 3 now");
    }
}

/// Two relays with the same number start together: in the end one flies and the other is passive.
#[test]
fn of_two_that_are_switched_on_together_one_flies_in_the_end() {
    for seed in 0..6 {
        let mission = mission(4);
        let mut air = Air::of(&mission, |_| None, 0.1 * (seed % 3) as f64);
        let mut other = relay(
            &mission,
            3,
            None,
            uav_relay::Instant::from_millis(77 + seed),
        );
        other.handle_timeout(air.now);
        let other = air.join(other);
        air.run(400);
        let down = [2, other].map(|at| air.relays[at].is_passive());
        assert_eq!(down[0], !down[1], "seed {seed}");
        let flies = if down[0] { other } else { 2 };
        assert!(air.relays[flies].setpoint().is_some());
        assert!(air.told(TAKEN).contains(&2) && air.told(TAKEN).contains(&other));
    }
}

/// Signed duplicates: the larger epoch wins; the other relay becomes passive and reports the duplicate.
#[test]
fn with_a_key_the_one_with_the_larger_epoch_stays() {
    for (epoch, first_stays) in [(1, true), (9, false)] {
        let mission = mission(5);
        let mut air = Air::of(&mission, |_| auth(KEY, 5), 0.0);
        air.run(90);
        let other = air.join(relay(&mission, 3, auth(KEY, epoch), air.now));
        air.run(240);
        let silent = if first_stays { other } else { 2 };
        assert!(air.told(TAKEN).contains(&silent), "{epoch}");
        assert_eq!(air.relays[2].setpoint().is_some(), first_stays, "{epoch}");
        assert_eq!(air.relays[2].is_passive(), !first_stays, "{epoch}");
        assert_eq!(
            air.relays[other].setpoint().is_some(),
            !first_stays,
            "{epoch}"
        );
    }
}

/// An attacker without the key can cause a report, but no relay becomes passive.
#[test]
fn forged_frames_have_nobody_stand_down() {
    let mission = mission(3);
    let mut air = Air::of(&mission, |_| auth(KEY, 1), 0.0);
    air.run(60);
    let mut liar = relay(&mission, 2, auth([1; 32], 99), air.now);
    let mut frame = [0; uav_relay::MAX_FRAME];
    for _ in 0..60 {
        liar.persist(|_| true);
        while let Some(transmit) = liar.poll_transmit(air.now, &mut frame) {
            air.play(&frame[..transmit.len]);
        }
        air.run(1);
        liar.handle_timeout(air.now);
    }
    assert_eq!(air.told(Event::DuplicateIndex { node: 2 }), [1]);
    assert!(
        air.relays
            .iter()
            .all(|relay| relay.setpoint().is_some() && !relay.is_passive())
    );
}
