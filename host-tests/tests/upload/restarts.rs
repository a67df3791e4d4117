//! Missions flown after reboots.

use uav_relay::Wiring;

use super::*;

/// Runs eight relays that all reboot after an upload. The relays `forgetful` lose the upload in this reboot.
fn power_cut(wiring: Wiring, forgetful: &[u16]) -> (Setup, Outcome) {
    let base = mission(8);
    let mut setup = signed(base, wiring == Wiring::Shared);
    let config = moved(&base, 700.0, -300.0);
    setup.uploads = vec![upload(&base, Side::Upstream, seconds(20), 3, config)];
    for relay in 1..=8 {
        setup.kills.push((relay, seconds(40)));
        setup.boots.push((relay, seconds(41)));
    }
    setup.forgetful = forgetful.to_vec();
    setup.deadline = seconds(300);
    let outcome = run(setup.clone()).unwrap();
    (setup, outcome)
}

/// Returns the number of membership views that relays accepted after the power failure. A view is the agreed set of
/// members.
fn views(outcome: &Outcome) -> usize {
    let moments = outcome
        .moments
        .iter()
        .filter(|moment| moment.at > seconds(41));
    moments
        .filter(|moment| matches!(moment.what, TimelineEvent::ViewAccepted { .. }))
        .count()
}

#[test]
fn a_rebooted_chain_flies_a_stored_upload_at_once() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let (setup, outcome) = power_cut(wiring, &[]);
        let config = *setup.uploads[0].upload.config();
        judge(&setup, &outcome, 3, config).unwrap();
        // The chain acts like one with this mission before flight, but its stored votes require one more view.
        assert_eq!(views(&outcome), 8);
        assert!(outcome.ended < seconds(43), "{:?}", outcome.ended);
    }
}

#[test]
fn one_relay_with_a_stored_upload_is_enough() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        for keeper in 1..=8 {
            let others: Vec<u16> = (1..=8).filter(|relay| *relay != keeper).collect();
            let (setup, outcome) = power_cut(wiring, &others);
            let config = *setup.uploads[0].upload.config();
            judge(&setup, &outcome, 3, config)
                .unwrap_or_else(|what| panic!("{wiring:?}, kept by {keeper}: {what}"));
            // The relay reports its mission as soon as a neighbour sends messages of another one.
            assert!(outcome.ended < seconds(42), "{:?}", outcome.ended);
        }
    }
}

#[test]
fn a_chain_without_stored_uploads_flies_the_loaded_mission() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let all: Vec<u16> = (1..=8).collect();
        let (setup, outcome) = power_cut(wiring, &all);
        judge(&setup, &outcome, 0, *setup.mission.config()).unwrap();
        assert_eq!(views(&outcome), 8);
    }
}

#[test]
fn a_relay_rebooted_during_an_upload_flies_it_with_the_others() {
    let base = mission(5);
    let config = moved(&base, 700.0, -300.0);
    for wiring in [Wiring::Pair, Wiring::Shared] {
        for end in [Side::Upstream, Side::Downstream] {
            for relay in 1..=5 {
                for ms in (0..300).step_by(15) {
                    for forgetful in [vec![], vec![relay]] {
                        let mut setup = signed(base, wiring == Wiring::Shared);
                        setup.uploads = vec![upload(&base, end, seconds(20), 1, config)];
                        let off = Instant::from_millis(20_000 + ms);
                        let on = Instant::from_millis(20_100 + ms);
                        setup.kills = vec![(relay, off)];
                        setup.boots = vec![(relay, on)];
                        setup.forgetful = forgetful.clone();
                        setup.deadline = seconds(200);
                        flies(
                            &setup,
                            1,
                            config,
                            &format!("{wiring:?} {end:?} {relay} at {ms} {forgetful:?}"),
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_others_fly_an_upload_without_a_lost_relay() {
    let base = mission(8);
    let config = moved(&base, 700.0, -300.0);
    for relay in 1..=8 {
        for ms in [0, 50, 100, 150, 200, 250, 300] {
            let mut setup = signed(base, true);
            setup.uploads = vec![upload(&base, Side::Upstream, seconds(20), 1, config)];
            setup.kills = vec![(relay, Instant::from_millis(20_000 + ms))];
            setup.deadline = seconds(200);
            flies(&setup, 1, config, &format!("{relay} at {ms}"));
        }
    }
}
