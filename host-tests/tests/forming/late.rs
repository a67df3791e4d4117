//! Late frames from before a reboot, or of an earlier view.

use host_tests::make;
use uav_relay::wire::message::Message;
use uav_relay::{Local, Method, Settings};

use crate::hand::{Chain, LOW, WIDE, is_stop};
use host_tests::bench::Bench;

/// Checks that a delayed message from before the leader's reboot does not spoil the next agreement.
///
/// The message starts a round along the chain. It arrives during the last round of the agreement after the reboot,
/// which the relays reach by Algorithm 2. No relay may act on the message.
#[test]
fn a_sweep_from_before_a_reboot_does_not_spoil_an_agreement() {
    let method = Method::Adjust(make::adjust(50, 30.0, Local::Fine));
    let settings = Settings {
        method,
        ..Settings::default()
    };
    for held in 1..4 {
        for seed in 1..=20 {
            let mut chain = Chain::new(4, 100.0, WIDE, settings);
            let at_held = |chain: &Bench| chain.flying.iter().any(|frame| frame.to == held + 1);
            chain.until(5_000, at_held).unwrap();
            let late = chain.bench.flying.pop_back().unwrap();
            chain.reboot(0, seed);
            // The pass arrives during the last round.
            let stops = |chain: &Bench| {
                let mut flying = chain.flying.iter();
                flying.any(|frame| frame.to == held + 1 && is_stop(frame))
            };
            let reached = chain.until(600_000, stops);
            assert!(reached.is_some(), "relay {}, seed {seed}", held + 1);
            chain.bench.flying.push_front(late);
            let settled = chain.until(60_000, Bench::holds);
            assert!(settled.is_some(), "relay {}, seed {seed}", held + 1);
            let (above, _) = chain.margin();
            assert!(above >= -2e-4, "relay {}, seed {seed}: {above}", held + 1);
        }
    }
}

/// Checks that a delayed proposal of a membership view has no effect once a newer view is agreed.
#[test]
fn a_proposal_of_an_old_view_changes_nothing() {
    let mut chain = Chain::new(3, 20.0, LOW, Settings::default());
    chain.until(5_000, Bench::holds).unwrap();
    chain.reboot(1, 3);
    let requests_view = |chain: &Bench| {
        let mut flying = chain.flying.iter();
        flying.any(|frame| frame.to == 3 && frame.is(|m| matches!(m, Message::Proposal(_))))
    };
    chain.until(10_000, requests_view).unwrap();
    // The lost request is repeated; relay 2 then reboots once more for a second view.
    let late = chain.bench.flying.pop_back().unwrap();
    chain.until(10_000, Bench::holds).unwrap();
    assert_eq!(chain.bench.relays[2].view().number(), 1);
    chain.reboot(1, 4);
    let second = |chain: &Bench| chain.holds() && chain.relays[2].view().number() == 2;
    // Relay 2 has forgotten that it is a member of view 1. The lease of view 1, 15 s, must expire first.
    chain.until(10_000 + 16_000, second).unwrap();
    let before = chain.bench.setpoints();
    let stale = chain.bench.relays[2].stats().stale;
    chain.bench.flying.push_front(late);
    chain.step();
    assert_eq!(chain.bench.relays[2].stats().stale, stale + 1);
    for _ in 0..200 {
        chain.step();
        assert!(second(&chain.bench));
    }
    assert_eq!(chain.bench.setpoints(), before);
}

/// Checks that a relay requests a membership view when a neighbour reports a newer view.
///
/// The neighbour has already accepted the newer view. Therefore it refuses the relay's messages, which belong to the
/// older view.
#[test]
fn a_relay_that_learns_of_a_newer_view_requests_one() {
    let mut chain = Chain::new(3, 20.0, LOW, Settings::default());
    chain.until(5_000, Bench::holds).unwrap();
    chain.reboot(1, 3);
    // The tail accepted the new view, but the result is lost because the others reboot.
    let agreed = |chain: &Bench| chain.relays[2].view().number() == 1;
    chain.until(10_000, agreed).unwrap();
    chain.bench.flying.clear();
    chain.reboot(0, 8);
    chain.reboot(1, 9);
    // The tail rejects passes of view 0 and reports view 1, on which it may rely until its lease expires.
    let took = chain.until(10_000 + 16_000, |chain| {
        chain.holds() && chain.relays[0].view().number() == 2
    });
    let views: Vec<_> = chain
        .bench
        .relays
        .iter()
        .map(uav_relay::Relay::view)
        .collect();
    println!("{took:?} ms, {views:?}");
    assert!(took.is_some());
    assert!(chain.bench.relays[2].stats().view > 0);
    assert!(chain.margin().0 >= -2e-4);
}
