//! Wrong keys, and epochs that went back.

use crate::air::mission;
use uav_relay::{Event, Identity, Port, Relay, Settings};

use crate::air::{Air, KEY, auth, relay};

/// Relay 2 of three has another key: it and its neighbours report this once.
#[test]
fn another_key_is_told_with_the_node() {
    for loss in [0.0, 0.3] {
        let key = |index| if index == 2 { [1; 32] } else { KEY };
        let mut air = Air::of(&mission(3), |index| auth(key(index), 1), loss);
        air.run(60);
        let mut told = air.told(Event::KeyMismatch { node: 2 });
        told.sort_unstable();
        assert_eq!(told, [0, 2]);
        for node in [1, 3] {
            assert_eq!(air.told(Event::KeyMismatch { node }), [1]);
        }
    }
}

/// Two handshakes with a wrong key cause no report.
#[test]
fn two_forged_handshakes_are_noise() {
    let mission = mission(3);
    let mut air = Air::of(&mission, |_| auth(KEY, 1), 0.0);
    let mut stranger = relay(&mission, 2, auth([1; 32], 9), air.now);
    let mut frame = [0; uav_relay::MAX_FRAME];
    air.run(30);
    for _ in 0..2 {
        let transmit = stranger.poll_transmit(air.now, &mut frame).unwrap();
        air.play(&frame[..transmit.len]);
        air.run(30);
    }
    assert!(air.relays[0].stats().forged > 0);
    assert!(air.told(Event::KeyMismatch { node: 2 }).is_empty());
}

/// Relay 2 restarts with an older epoch: its neighbours reject it, and all three relays report it.
#[test]
fn an_epoch_that_went_back_is_told_with_the_node() {
    for (loss, again, back) in [(0.0, 1, true), (0.3, 1, true), (0.3, 6, false)] {
        let mission = mission(3);
        let epoch = |index| if index == 2 { 5 } else { 1 };
        let mut air = Air::of(&mission, |index| auth(KEY, epoch(index)), loss);
        air.run(60);
        assert!(air.relays.iter().all(|relay| relay.setpoint().is_some()));
        air.relays[1] = relay(&mission, 2, auth(KEY, again), air.now);
        air.run(90);
        let mut told = air.told(Event::EpochWentBack { node: 2 });
        told.sort_unstable();
        let expected: &[usize] = if back { &[0, 1, 2] } else { &[] };
        assert_eq!(told, expected, "epoch {again}, loss {loss}");
        assert_eq!(air.relays[1].setpoint().is_none(), back);
    }
}

/// Relay 2 restarts with the epoch that it had, so its neighbours take it for a duplicate of itself. With the larger claim it takes part.
/// With the smaller one it reports that its number is taken, and has no setpoint until they have received nothing of the larger one for
/// `dead_after`.
#[test]
fn with_the_epoch_that_it_had_a_relay_takes_part_at_once_or_reports_and_waits() {
    let mut waited = 0;
    for seed in 1..=12 {
        let mission = mission(3);
        let mut air = Air::of(&mission, |_| auth(KEY, 5), 0.0);
        air.run(60);
        let identity = Identity {
            network: 7,
            index: 2,
        };
        let settings = super::air::settings(auth(KEY, 5));
        air.relays[1] = Relay::new(mission, identity, settings, 1_000 * seed, air.now).unwrap();
        let restarted = air.now;
        let reports = |air: &Air| air.told(Event::DuplicateIndex { node: 2 }).contains(&1);
        while air.relays[1].setpoint().is_none() {
            air.run(1);
            let seconds = air.now.since(restarted).as_micros() / 1_000_000;
            assert!(seconds < 90, "seed {seed}");
        }
        let waits = air.now.since(restarted) > settings.dead_after;
        assert_eq!(reports(&air), waits, "seed {seed}");
        waited += u32::from(waits);
    }
    assert!((1..12).contains(&waited), "{waited} of 12");
}

/// Two wires lead to relays with the same number.
#[test]
fn a_neighbour_that_is_heard_at_both_ports_is_told() {
    let mission = mission(3);
    let of = |index| {
        let identity = Identity { network: 7, index };
        Relay::new(
            mission,
            identity,
            Settings::default(),
            1,
            uav_relay::Instant::ZERO,
        )
        .unwrap()
    };
    let (mut middle, mut head) = (of(2), of(1));
    let mut frame = [0; uav_relay::MAX_FRAME];
    let now = uav_relay::Instant::from_millis(6_000);
    while let Some(at) = head.poll_timeout().filter(|at| *at <= now) {
        head.handle_timeout(at);
    }
    let mut told = Vec::new();
    head.persist(|_| true);
    while let Some(transmit) = head.poll_transmit(now, &mut frame) {
        for port in [Port::Upstream, Port::Downstream] {
            middle.handle_bytes(now, port, &frame[..transmit.len]);
        }
        told.extend(std::iter::from_fn(|| middle.poll_event()));
    }
    assert_eq!(told, [Event::DuplicateIndex { node: 1 }]);
    assert!(!middle.is_passive());
}
