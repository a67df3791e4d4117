//! Changes of a relay's state: each reaches the station in time, and the last one always.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::flight::autopilot::state::State;
use uav_relay::{
    Duration, GuardConfig, HoldReason, Instant, Phase, Placement, Report, Side, Upload,
};
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::fleet::{FleetSpec, Takeover, somewhere};
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::setup::UploadSpec;

use crate::{Figures, RATE, evenly, quantile, s, seconds, setup};

const STATES: [State; 5] = [
    State::Silent,
    State::Grounded,
    State::Standby,
    State::Engaged,
    State::Blind,
];

const fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

fn report(chain: &Chain, relay: u16) -> Option<Report> {
    let mut reports = chain.reports(Side::Upstream).into_iter();
    reports.find(|it| it.relay == relay)
}

/// Returns a position with coordinates in quarters of a metre, as in reports.
fn place(rng: &mut ChaCha8Rng) -> Placement {
    let [x_m, y_m, altitude_m] =
        [800, 40, 120].map(|quarters| rng.random_range(0..quarters) as f32 / 4.0);
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}

/// Checks that a position reaches the station right after a report without a position.
#[test]
fn a_position_that_is_given_once_reaches_the_station() {
    for (relays, access) in [(2, None), (4, None), (8, Some(Access::Ideal))] {
        let mut chain = Chain::new(setup(relays, access, s(1), s(600))).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut now, mut delays_s) = (s(20), Vec::new());
        chain.advance(now);
        for turn in 0..40_u16 {
            let relay = relays - turn % relays.min(2);
            let given = place(&mut rng);
            let begun = now;
            chain.input(now, relay, |it| it.handle_position(now, given, now));
            let shows = |chain: &Chain| report(chain, relay).unwrap().position == Some(given);
            while !shows(&chain) {
                assert!(
                    now < begun + ms(4_000),
                    "turn {turn} of {relays} relays: not shown"
                );
                now = now + ms(20);
                chain.advance(now);
            }
            delays_s.push(seconds(now.since(begun)));
            // Then the position is unknown again.
            now = now + ms(6_000 + rng.random_range(0..1_000));
            chain.advance(now);
            assert_eq!(report(&chain, relay).unwrap().position, None);
        }
        let most_s = quantile(&delays_s, 1.0);
        println!(
            "{relays} relays, {access:?}: positions given once are shown within {most_s:.1} s"
        );
        assert!(most_s <= 2.0, "{most_s}");
    }
}

/// Checks that the station knows every relay's last state in time after the last change.
#[test]
fn the_last_state_reaches_the_station() {
    for seed in 0..40 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (relays, access) =
            [(8, Some(Access::Ideal)), (8, Some(Access::Csma)), (3, None)][rng.random_range(0..3)];
        let loss = [0.0, 0.1, 0.3][rng.random_range(0..3)];
        // Frames that are lost or collide are sent again in later turns.
        let within = match (access, loss) {
            (None | Some(Access::Ideal), 0.0) => ms(2_500),
            (_, 0.0) => ms(4_000),
            _ => ms(10_000),
        };
        let mut setup = setup(relays, access, s(1), s(600));
        setup.faults.loss = loss;
        setup.seed = seed;
        let mut chain = Chain::new(setup).unwrap();
        let mut now = s(60);
        chain.advance(now);
        for round in 0..6 {
            let mut last = vec![(None, None); usize::from(relays)];
            for _ in 0..rng.random_range(1..40) {
                now = now + ms(rng.random_range(0..800));
                chain.advance(now);
                let relay = rng.random_range(1..=relays);
                let (control, position) = &mut last[usize::from(relay) - 1];
                if rng.random_bool(0.5) {
                    let state = STATES[rng.random_range(0..5)];
                    *control = Some(state);
                    chain.input(now, relay, |it| it.report_control(state));
                } else {
                    let at = Instant::from_micros(now.as_micros() - rng.random_range(0..300_000));
                    let given = place(&mut rng);
                    *position = Some((now, given));
                    chain.input(now, relay, |it| it.handle_position(now, given, at));
                }
            }
            let silence = now;
            let mut shown = vec![false; usize::from(relays)];
            while now < silence + within {
                for (relay, (is_shown, (_, position))) in (1..).zip(shown.iter_mut().zip(&last)) {
                    let given = position.map(|it| it.1);
                    *is_shown |= report(&chain, relay).is_some_and(|it| it.position == given);
                }
                now = now + ms(50);
                chain.advance(now);
            }
            for (relay, (control, position)) in (1..).zip(&last) {
                let report = report(&chain, relay).unwrap();
                let what = format!(
                    "seed {seed}, round {round}, {relays} relays, {access:?}, loss {loss}, relay {relay}: {report:?}"
                );
                if control.is_some() {
                    assert_eq!(report.control, *control, "{what}");
                }
                // A position is sent for 2 s, which may be too short if frames are lost.
                let is_late = position.is_some_and(|(at, _)| at + ms(500) >= silence);
                if loss == 0.0 && access != Some(Access::Csma) && is_late {
                    assert!(
                        shown[usize::from(relay) - 1],
                        "{position:?} at {silence:?}, {what}"
                    );
                }
            }
        }
    }
}

/// Part of a report whose changes have to be known in time.
///
/// It has the control state, the waits, the faults of the agreement, and the version.
type Changing = (Option<State>, [Option<HoldReason>; 2], Option<Phase>, u16);

fn changing(report: &Report) -> Changing {
    let fault = Some(report.phase).filter(|it| matches!(it, Phase::Infeasible | Phase::NoQuorum));
    (report.control, report.hold_reasons, fault, report.version)
}

/// Checks the time until the station knows a changed state. Pilots take over one drone after the other, autopilots
/// restart, and missions are uploaded, so that the chain often agrees on new positions meanwhile.
#[test]
fn changed_states_are_known_in_time() {
    let (mut delays_s, mut ages_s, mut most) = (Vec::new(), Vec::new(), 0.0_f64);
    for seed in 1..=4 {
        let span = [s(60), s(260)];
        let mut setup = setup(8, Some(Access::Ideal), s(1), span[1]);
        setup.seed = seed;
        let config = *setup.mission.config();
        setup.settings.guard = Some(GuardConfig::of(&setup.mission, config.common));
        let from = |turn: u64| Instant::from_millis(60_000 + 10_000 * turn + 137 * seed * turn);
        let relay = |turn: u64| (turn * 3 % 8 + 1) as u16;
        let takeover = |turn: u64| Takeover {
            relay: relay(turn),
            from: from(turn),
            until: Some(from(turn) + ms(6_000)),
            to: None,
        };
        setup.fleet = Some(FleetSpec {
            axis: somewhere(f64::from(config.distance_m)).unwrap(),
            start: evenly(&setup),
            takeovers: (0..18).map(takeover).collect(),
            restarts: (2..18)
                .step_by(3)
                .map(|turn| (relay(turn + 1), from(turn)))
                .collect(),
            gust_mps: 0.0,
            bias_m: 0.0,
            noise_m: 0.0,
        });
        setup.uploads = (1..=3)
            .map(|version| UploadSpec {
                end: Side::Upstream,
                at: span[0] + ms(47_000).times(version.into()),
                upload: Upload::new(&setup.mission, version, config).unwrap(),
            })
            .collect();
        let mut chain = Chain::new(setup).unwrap();
        let (mut figures, mut now) = (Figures::default(), span[0]);
        chain.advance(now);
        let live = |chain: &Chain, now| -> Vec<Changing> {
            chain.live(now).map(|it| changing(&it.report)).collect()
        };
        // State of each relay, the time of its last change, and true once the station knows it.
        let mut known: Vec<_> = live(&chain, now)
            .into_iter()
            .map(|it| (it, now, true))
            .collect();
        while now < span[1] {
            now = now + ms(50);
            chain.advance(now);
            figures.frames.extend(chain.frames(now));
            for (relay, (is, (was, since, is_known))) in
                (1..).zip(live(&chain, now).into_iter().zip(&mut known))
            {
                if *was != is {
                    (*was, *since, *is_known) = (is, now, false);
                }
                let report = report(&chain, relay).unwrap();
                ages_s.push(seconds(now.since(report.at)));
                if !*is_known && changing(&report) == is {
                    *is_known = true;
                    delays_s.push(seconds(now.since(*since)));
                }
                if std::env::var("STORY").is_ok() && !*is_known && now.since(*since) == ms(2_000) {
                    println!("seed {seed}, {now:?}: relay {relay}: {was:?}, {report:?}");
                }
            }
        }
        most = most.max(figures.most_bytes(span));
    }
    let [delay_s, age_s] =
        [&delays_s, &ages_s].map(|all| [0.5, 0.95, 1.0].map(|share| quantile(all, share)));
    println!(
        "{} changed states, no collisions: known after (50 %, 95 %, most) {delay_s:.2?} s, ages {age_s:.2?} s; {:.1} % of the rate",
        delays_s.len(),
        100.0 * most / RATE
    );
    assert!(most <= 0.1 * RATE, "{most}");
    assert!(delays_s.len() > 100 && delay_s[1] <= 2.0, "{delay_s:?}");
    assert!(age_s[1] <= 2.0, "{age_s:?}");
}
