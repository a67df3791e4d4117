//! Changes of a relay's state: each reaches the station in time, and the last one always.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::flight::autopilot::state::State;
use uav_relay::{Duration, GuardConfig, Instant, Placement, Report, Side, Upload};
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::setup::UploadSpec;

use crate::{Figures, RATE, quantile, s, seconds, setup};

/// Control states, each with a flag. The flag is true if the autopilot flies to a target other than the setpoint.
const STATES: [(State, bool); 6] = [
    (State::Silent, false),
    (State::Grounded, false),
    (State::Standby, false),
    (State::Engaged, false),
    (State::Blind, false),
    (State::Engaged, true),
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
    make::placement(x_m, y_m, altitude_m)
}

/// Checks that a position that the autopilot gives a relay only once still reaches the station.
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

/// Checks that the station knows the last state of every relay within seconds after the last change.
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
                    let (state, refuses) = STATES[rng.random_range(0..6)];
                    *control = Some((state, refuses));
                    chain.input(now, relay, |it| it.report_control(state, refuses));
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
                if let Some((state, refuses)) = *control {
                    let known = (report.control, report.refuses_setpoint);
                    assert_eq!(known, (Some(state), refuses), "{what}");
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

/// Returns true if the change of the control state is an alarm on the station's page. Each state is one of [`STATES`].
fn begins_alarm(before: (State, bool), now: (State, bool)) -> bool {
    let is_fault = matches!(now.0, State::Silent | State::Blind) || now.1;
    let is_released = before.0 == State::Engaged && now.0 != State::Engaged;
    before != now && (is_fault || is_released)
}

/// Checks that the station soon knows that eight drones have lost their positions at the same time.
///
/// A jammer is a possible cause. The reports of the relays collide.
#[test]
fn alarms_of_all_relays_at_once_are_known_in_time() {
    let (mut delays_s, mut lasts_s, mut most) = (Vec::new(), Vec::new(), 0.0_f64);
    for seed in 1..=10 {
        let span = [s(60), s(160)];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = setup(8, Some(Access::Csma), s(1), span[1]);
        setup.seed = seed;
        let mut chain = Chain::new(setup).unwrap();
        let mut figures = Figures::default();
        let mut now = span[0];
        chain.advance(now);
        for turn in 0..10 {
            let state = [State::Blind, State::Engaged][turn % 2];
            let begun = now;
            let mut at: Vec<(Instant, u16)> = (1..=8)
                .map(|relay| (now + ms(rng.random_range(0..200)), relay))
                .collect();
            at.sort();
            let mut shown_s = [None; 8];
            while now < begun + ms(10_000) {
                while let Some((_, relay)) = at.first().filter(|(from, _)| *from <= now) {
                    chain.input(now, *relay, |it| it.report_control(state, false));
                    at.remove(0);
                }
                now = now + ms(20);
                chain.advance(now);
                figures.frames.extend(chain.frames(now));
                for (shown_s, relay) in shown_s.iter_mut().zip(1..) {
                    if report(&chain, relay).is_some_and(|it| it.control == Some(state)) {
                        shown_s.get_or_insert(seconds(now.since(begun)));
                    }
                }
            }
            if turn > 1 && state == State::Blind {
                let all = shown_s.map(|it| it.unwrap_or(10.0));
                lasts_s.push(quantile(&all, 1.0));
                delays_s.extend(all);
            }
        }
        most = most.max(figures.most_bytes(span));
    }
    let [delay_s, last_s] =
        [&delays_s, &lasts_s].map(|all| [0.5, 0.95, 1.0].map(|share| quantile(all, share)));
    println!(
        "{} alarms of eight relays at once, collisions: known after (50 %, 95 %, most) {delay_s:.2?} s, all eight {last_s:.2?} s; {:.1} % of the rate",
        lasts_s.len(),
        100.0 * most / RATE
    );
    assert!(
        delay_s[1] <= 2.0 && last_s[1] <= 3.0,
        "{delay_s:?} {last_s:?}"
    );
    assert!(most <= 0.105 * RATE, "{most}");
}

/// Checks the time until the station knows that an alarm has begun. Missions are uploaded, so that the chain often agrees
/// on new positions meanwhile.
#[test]
fn alarms_are_known_in_time() {
    let (mut delays_s, mut ages_s, mut most) = (Vec::new(), Vec::new(), 0.0_f64);
    for seed in 1..=4 {
        let span = [s(60), s(260)];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = setup(8, Some(Access::Ideal), s(1), span[1]);
        setup.seed = seed;
        let config = *setup.mission.config();
        setup.settings.guard = Some(GuardConfig::of(&setup.mission, config.common));
        setup.uploads = (1..=12)
            .map(|version| UploadSpec {
                end: Side::Upstream,
                at: span[0] + ms(16_000).times(version.into()),
                upload: Upload::new(&setup.mission, version, config).unwrap(),
            })
            .collect();
        let mut chain = Chain::new(setup).unwrap();
        let mut figures = Figures::default();
        let mut now = s(50);
        chain.advance(now);
        for relay in 1..=8 {
            chain.input(now, relay, |it| it.report_control(State::Engaged, false));
        }
        now = span[0];
        chain.advance(now);
        let mut states = [(State::Engaged, false); 8];
        // Time of a change that the station does not know yet.
        let mut begun = [None; 8];
        let mut next = now;
        while now < span[1] {
            now = now + ms(20);
            chain.advance(now);
            figures.frames.extend(chain.frames(now));
            while next <= now {
                // Two changes of one relay may follow each other closely, as a pilot's and a silent autopilot's.
                next = next + ms([100, 400, 2_000, 4_000, 8_000][rng.random_range(0..5)]);
                let index = [rng.random_range(0..8), 7][rng.random_range(0..2)];
                let state = STATES[rng.random_range(0..6)];
                let before = core::mem::replace(&mut states[index], state);
                chain.input(now, index as u16 + 1, |it| {
                    it.report_control(state.0, state.1);
                });
                if before != state {
                    begun[index] = begins_alarm(before, state).then_some(now);
                }
            }
            for index in 0..8 {
                let report = report(&chain, index as u16 + 1).unwrap();
                ages_s.push(seconds(now.since(report.at)));
                let (state, refuses) = states[index];
                let is_known = report.control == Some(state) && report.refuses_setpoint == refuses;
                if let Some(since) = begun[index].filter(|_| is_known) {
                    begun[index] = None;
                    delays_s.push(seconds(now.since(since)));
                }
            }
        }
        most = most.max(figures.most_bytes(span));
    }
    let [delay_s, age_s] =
        [&delays_s, &ages_s].map(|all| [0.5, 0.95, 1.0].map(|share| quantile(all, share)));
    println!(
        "{} alarms, no collisions: known after (50 %, 95 %, most) {delay_s:.2?} s, ages {age_s:.2?} s; {:.1} % of the rate",
        delays_s.len(),
        100.0 * most / RATE
    );
    assert!(most <= 0.1 * RATE, "{most}");
    assert!(delays_s.len() > 100 && delay_s[2] <= 0.6, "{delay_s:?}");
    assert!(age_s[1] <= 2.0, "{age_s:?}");
}

/// Checks that alarms do not prolong the time without a lease after the loss of both end relays.
///
/// A relay may use an agreement only with a valid lease. The time without a lease is some 15 s. The other relays report
/// alarms in this time: all at once, or spread as relays spread them.
#[test]
fn alarms_beside_the_loss_of_both_ends_delay_no_lease() {
    let span = [s(60), s(120)];
    let variants = [
        "not watched",
        "no alarms",
        "spread alarms",
        "alarms at once",
    ];
    let longest_s = variants.map(|variant| {
        let runs = (1..=20).map(|seed| {
            let mut setup = setup(8, Some(Access::Csma), s(1), span[1]);
            setup.seed = seed;
            setup.record = false;
            setup.kills = vec![(1, span[0]), (8, span[0])];
            if variant == "not watched" {
                setup.watches = vec![(Side::Upstream, s(1_000))];
            }
            let mut chain = Chain::new(setup).unwrap();
            chain.advance(s(50));
            for relay in 1..=8 {
                chain.input(s(50), relay, |it| it.report_control(State::Engaged, false));
            }
            chain.advance(span[0]);
            let (mut now, mut since, mut longest_s) = (span[0], [span[0]; 8], 0.0_f64);
            let mut state = State::Engaged;
            while now < span[1] {
                let step = now.since(span[0]).as_micros() / 1_000 % 5_000;
                for relay in 2..=7_u16 {
                    // A relay waits for 30 ms for each relay behind it.
                    let turn = match variant {
                        "spread alarms" => 0,
                        "alarms at once" => 30 * (u64::from(relay) - 1),
                        _ => continue,
                    };
                    if step == turn {
                        if relay == 2 {
                            state = [State::Blind, State::Engaged][usize::from(state == State::Blind)];
                        }
                        chain.input(now, relay, |it| it.report_control(state, false));
                    }
                }
                now = now + ms(10);
                chain.advance(now);
                for relay in chain.live(now).filter(|it| it.is_on) {
                    let since = &mut since[usize::from(relay.report.relay) - 1];
                    if relay.report.holds_lease || relay.report.agreed.is_none() {
                        *since = now;
                    }
                    longest_s = longest_s.max(seconds(now.since(*since)));
                }
            }
            longest_s
        });
        let runs: Vec<f64> = runs.collect();
        let expired = runs.iter().filter(|it| **it >= 5.0).count();
        println!(
            "relays 1 and 8 lost, {variant}: longest time without a lease (50 %, 95 %, most) {:.1?} s; {expired} of 20 runs with 5 s or more",
            [0.5, 0.95, 1.0].map(|share| quantile(&runs, share))
        );
        (quantile(&runs, 1.0), expired)
    });
    let [_, (quiet_s, quiet), (spread_s, spread), _] = longest_s;
    assert!(
        spread <= quiet + 1 && spread_s <= quiet_s + 2.0,
        "{longest_s:?}"
    );
}
