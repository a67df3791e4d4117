//! Chains that agree on fitted slots by messages, and carry data in them.

use host_tests::make;
use uav_relay::{Instant, Method, Mission, Placement, Relay, Settings, SetupError, SlotShares};
use uav_relay_scenario::mission;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Moment, Outcome, TimelineEvent};
use uav_relay_sim::simulator::route::{DataLink, TrueHops};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::traffic::{TrafficSpec, traffic};

use super::fitted;
use super::scenes::{Case, TOLERANCE, number};

/// Creates relay 1 of `mission`.
pub(crate) fn relay(mission: &Mission, settings: Settings) -> Result<Relay, SetupError> {
    let identity = make::identity(1);
    Relay::new(*mission, identity, settings, 1, Instant::ZERO)
}

/// Returns the setup of a simulated chain with the joint method and all profiles of `case`.
fn setup(case: &Case) -> Setup {
    let (_, profiles) = mission::mission(&case.scenario, case.relays, TOLERANCE).unwrap();
    let mut setup = Setup {
        profiles,
        track: true,
        ..Setup::new(case.mission())
    };
    setup.settings.method = Method::Joint;
    setup
}

/// Checks that the time slots of all relays fill the TDMA frame: in order, without overlaps and gaps.
fn check_shares(outcome: &Outcome, reverse: f32, what: &str) {
    let flying = outcome.relays.iter().filter(|relay| relay.killed.is_none());
    let shares: Vec<_> = flying.map(|relay| relay.slot_shares.unwrap()).collect();
    for pair in shares.windows(2) {
        assert_eq!(pair[0].to_rx, pair[1].from_tx, "{what}");
        assert_eq!(pair[0].from_rx, pair[1].to_tx, "{what}");
        assert_eq!(pair[0].bits_per_hz.to_bits(), pair[1].bits_per_hz.to_bits());
    }
    // Tx knows its slots from the first relay, Rx from the last one.
    let last = shares[shares.len() - 1];
    let there = shares.iter().map(|own| own.from_tx).chain([last.to_rx]);
    let back = shares.iter().rev().map(|own| own.to_tx);
    let slots: Vec<_> = there.chain([last.from_rx]).chain(back).collect();
    assert_eq!(slots.len(), 2 * (shares.len() + 1), "{what}");
    let mut at = 0.0;
    for (number, [begin, end]) in slots.iter().enumerate() {
        assert_eq!(*begin, at, "{what}: slot {number} of {slots:?}");
        let is_used = number <= shares.len() || reverse > 0.0;
        assert_eq!(end > begin, is_used, "{what}: slot {number} of {slots:?}");
        at = *end;
    }
    assert_eq!(at, 1.0, "{what}: {slots:?}");
}

/// Checks that each time slot is as long as the hop needs for its data at the hop's true SINR.
fn check_lengths(case: &Case, solved: &[(Placement, SlotShares)], what: &str) {
    let places: Vec<Placement> = solved.iter().map(|(at, _)| *at).collect();
    let time = case.time(&places);
    let [there, back] = case.times(&places);
    for (index, (_, own)) in solved.iter().enumerate() {
        for (slot, times, hop) in [
            (own.from_tx, &there, index),
            (own.to_rx, &there, index + 1),
            (own.to_tx, &back, index),
            (own.from_rx, &back, index + 1),
        ] {
            let share = times.get(hop).map_or(0.0, |hop| hop / time);
            let [begin, end] = slot.map(f64::from);
            let off = (end - begin - share).abs();
            assert!(
                off < 1e-4 * share + 3e-6,
                "{what}: {slot:?} {share} {index}"
            );
        }
    }
}

/// Checks that simulated relays agree on the positions and the time slots that the solver finds.
#[test]
fn a_chain_agrees_on_fitted_places_and_shares() {
    let first = number("SEED", 1);
    for seed in first..first + number("COUNT", 30) {
        let case = Case::draw(seed);
        let what = format!("SEED={seed}: {case:?}");
        let mission = case.mission();
        let outcome = run(setup(&case)).unwrap();
        assert_eq!(outcome.ending, Ending::Settled, "{what}");
        let solved = fitted(&mission, case.seats(&mission));
        let places: Vec<Placement> = solved.iter().map(|(at, _)| *at).collect();
        let flown: Vec<Placement> = outcome
            .relays
            .iter()
            .map(|relay| relay.setpoint.unwrap())
            .collect();
        assert_eq!(flown, places, "{what}");
        check_shares(&outcome, mission.config().reverse, &what);
        for (relay, (_, shares)) in outcome.relays.iter().zip(&solved) {
            assert_eq!(relay.slot_shares, Some(*shares), "{what}");
        }
        check_lengths(&case, &solved, &what);
    }
}

/// Checks that after the loss of a relay the time slots of the other relays fill the whole TDMA frame.
#[test]
fn the_remaining_relays_share_the_frame_after_a_loss() {
    let case = Case::draw(1);
    assert!(case.relays > 5);
    let mut setup = Setup {
        profiles: setup(&case).profiles,
        kills: vec![(3, Instant::from_millis(20_000))],
        ..Setup::on_shared_channel(case.mission())
    };
    setup.settings.method = Method::Joint;
    let outcome = run(setup).unwrap();
    assert!(outcome.relays[2].killed.is_some());
    assert!(
        outcome
            .relays
            .iter()
            .all(|relay| relay.killed.is_some() || relay.relays == case.relays - 1)
    );
    check_shares(&outcome, case.mission().config().reverse, "relay 3 lost");
}

/// Checks that the time slots fill the whole TDMA frame after a relay's restart and the next agreement.
#[test]
fn a_restarted_relay_has_the_slots_of_the_next_agreement() {
    let case = Case::draw(1);
    let relays = usize::from(case.relays);
    for (index, at_ms) in [(1, 20_000), (3, 20_000), (case.relays, 20_001)] {
        let mut setup = Setup {
            profiles: setup(&case).profiles,
            boots: vec![(index, Instant::from_millis(at_ms))],
            ..Setup::on_shared_channel(case.mission())
        };
        setup.settings.method = Method::Joint;
        let outcome = run(setup).unwrap();
        let booted = TimelineEvent::Booted;
        assert!(outcome.moments.iter().any(|moment| moment.what == booted));
        assert_eq!(outcome.relays.len(), relays);
        check_shares(
            &outcome,
            case.mission().config().reverse,
            "a relay restarted",
        );
    }
}

/// Checks that relays agree first for the common power, and a second time for their individual powers.
///
/// There is only one agreement if all relays have the common power. There is also only one if the leader has another
/// power: then it gathers all powers first.
#[test]
fn the_first_agreement_is_for_the_common_power() {
    let case = Case {
        relays: 6,
        ..Case::draw(1)
    };
    for (other, agreements) in [(None, 1), (Some(3), 2), (Some(6), 2), (Some(1), 1)] {
        let mut case = case.clone();
        case.scenario.relays.clear();
        if let Some(index) = other {
            let own = make::relay_override(None, Some(3.0));
            case.scenario.relays.insert(index, own);
        }
        let mission = case.mission();
        assert_eq!(mission.leader(), 1);
        let outcome = run(setup(&case)).unwrap();
        for relay in 2..=6 {
            let of =
                |moment: &&Moment| moment.relay == relay && moment.what == TimelineEvent::Converged;
            let found = outcome.moments.iter().filter(of).count();
            assert_eq!(found, agreements, "{other:?} {relay}");
        }
        let solved = fitted(&mission, case.seats(&mission));
        for (relay, (_, shares)) in outcome.relays.iter().zip(&solved) {
            assert_eq!(relay.slot_shares, Some(*shares), "{other:?}");
        }
    }
}

/// Checks that the agreed fitted slots deliver the predicted rate, in one direction or in both.
#[test]
fn fitted_slots_deliver_the_predicted_rate() {
    let first = number("SEED", 1);
    let mut worst = 1.0_f64;
    for seed in first..first + number("COUNT", 15) {
        let case = Case::draw(seed);
        let what = format!("SEED={seed}: {case:?}");
        let both = case.scenario.reverse > 0.0;
        let setup = setup(&case);
        let hops = TrueHops::new(&case.scenario, &setup, &case.mission());
        let outcome = run(setup).unwrap();
        let shares = outcome.relays[0].slot_shares.unwrap();
        let to_rx_bps = f64::from(shares.bits_per_hz) * case.radio.bandwidth_hz;
        let promised_bps = [to_rx_bps, case.scenario.reverse * to_rx_bps];
        let slowest = if both { promised_bps[1] } else { to_rx_bps };
        let spec = TrafficSpec {
            link: DataLink {
                radio: case.radio.clone(),
                packet_bits: (10.0 * slowest).min(12_000.0),
                both,
                reverse: case.scenario.reverse,
            },
            queue_packets: 50,
            offered_bps: None,
        };
        let sent = traffic(&spec, &hops, &outcome, case.relays.into());
        let sent = sent.unwrap().unwrap();
        assert_eq!(sent.flows.len(), if both { 2 } else { 1 });
        for (flow, promised_bps) in sent.flows.iter().zip(promised_bps) {
            let share = flow.delivered_bps / promised_bps;
            assert!((0.95..=1.0 + TOLERANCE).contains(&share), "{share} {what}");
            worst = worst.min(share);
        }
    }
    println!("delivered at least {worst:.4} of the predicted rate");
}
