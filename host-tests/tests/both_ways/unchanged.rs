//! Chains of one direction, compared with recorded bits.
//!
//! The recorded numbers were computed by these tests with the code before missions had a way back.

use host_tests::flights::settle;
use host_tests::placing::{generator, places, setpoints, solve};
use rand::{Rng, RngExt};
use uav_relay::{Adjust, Band, Instant, Local, Method, Mission, MissionConfig};
use uav_relay_oracle::mission::{as_relays_know_it, of_link, of_stochastic_link};
use uav_relay_oracle::random::{self, Chain, Style, in_noise};
use uav_relay_oracle::reference::stochastic::StochasticLink;
use uav_relay_oracle::reference::{Link, Relay as ReferenceRelay};
use uav_relay_sim::simulator::chain::Chain as SimulatedChain;
use uav_relay_sim::simulator::setup::Setup;

/// Message types (first bytes of the body) of the messages of a sweep.
const SWEEP: u8 = 0;
const VERDICT: u8 = 1;
const ASIDE: u8 = 5;

/// Number of random scenarios whose results are hashed.
const SCENARIOS: u32 = 1_000;

/// FNV-1a hash of the results of all scenarios with traffic in one direction.
///
/// The results are the target SIRs, the numbers of sweeps (messages along the chain) and the positions.
const RECORDED: u64 = 0x12dc_53fc_8c0c_d073;

fn add(hash: &mut u64, bits: u32) {
    for byte in bits.to_le_bytes() {
        *hash = (*hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
}

#[test]
fn places_of_one_direction_are_equal_to_the_bit() {
    let mut rng = generator(3301);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let (mut drawn, mut placed) = (0, 0);
    while drawn < SCENARIOS {
        let style = Style {
            relays: 1..=50,
            chain: Chain::Any,
        };
        let link = random::link(&mut rng, &style);
        let link = if drawn % 2 == 0 {
            link
        } else {
            in_noise(&mut rng, &link)
        };
        let Some((mission, own)) = of_link(&as_relays_know_it(&link), 1e-4) else {
            continue;
        };
        drawn += 1;
        let Some(agreed) = solve(&mission, &own) else {
            add(&mut hash, 0);
            continue;
        };
        placed += 1;
        add(&mut hash, agreed.target.to_bits());
        add(&mut hash, agreed.sweeps);
        for place in places(&mission, &own, agreed.target) {
            add(&mut hash, place.x_m.to_bits());
        }
    }
    println!("{placed} of {drawn} placed, hash {hash:#018x}");
    assert!(placed > 900, "{placed}");
    assert_eq!(hash, RECORDED, "{hash:#018x}");
}

/// Runs the simulated chain `setup`, and adds its positions and number of messages to the hash `hash`.
fn add_flown(hash: &mut u64, setup: Setup) {
    let outcome = settle(setup);
    for place in setpoints(&outcome) {
        add(hash, place.x_m.to_bits());
        add(hash, place.altitude_m.to_bits());
    }
    add(hash, outcome.messages as u32);
}

/// Returns a random mission of `relays` relays with an altitude range; every third mission has noise.
fn scene(rng: &mut impl Rng, round: usize, relays: usize) -> MissionConfig {
    let link = Link {
        x_i: rng.random_range(-200.0..1200.0),
        y_i: rng.random_range(20.0..400.0),
        ..Link::paper(relays)
    };
    let (mission, _) = of_link(&as_relays_know_it(&link), 1e-4).unwrap();
    MissionConfig {
        band: Band {
            least_m: 20.0,
            most_m: 120.0,
        },
        noise_w: if round.is_multiple_of(3) { 1e-9 } else { 0.0 },
        ..*mission.config()
    }
}

#[test]
fn turns_of_one_direction_are_equal_to_the_bit() {
    const RECORDED: u64 = 0xd4b6_b8c9_266c_43f1;
    let mut rng = generator(3311);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for round in 0..SCENARIOS as usize {
        let config = scene(&mut rng, round, 1 + round % 12);
        let mut setup = Setup::new(Mission::try_new(config).unwrap());
        let local = if round % 2 == 0 {
            Local::Fine
        } else {
            Local::Grid {
                columns: 21,
                rows: 11,
            }
        };
        setup.settings.method = Method::Adjust(Adjust {
            rounds: 20,
            explore_m: 15.0,
            local,
        });
        add_flown(&mut hash, setup);
    }
    assert_eq!(hash, RECORDED, "{hash:#018x}");
}

/// Checks that the joint method still gives the recorded positions for traffic in one direction.
///
/// In every second scene the relays may also have lateral offsets.
#[test]
fn joint_places_of_one_direction_are_equal_to_the_bit() {
    const RECORDED: u64 = 0xf047_a192_5366_f9f4;
    let mut rng = generator(3313);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for round in 0..SCENARIOS as usize {
        let mut config = scene(&mut rng, round, 1 + round % 10);
        if round % 2 == 0 {
            config.lateral = Band {
                least_m: -80.0,
                most_m: 60.0,
            };
        }
        let mut setup = Setup::new(Mission::try_new(config).unwrap());
        setup.settings.method = Method::Joint;
        let outcome = settle(setup);
        for place in setpoints(&outcome) {
            for part in [place.x_m, place.y_m, place.altitude_m] {
                add(&mut hash, part.to_bits());
            }
        }
    }
    assert_eq!(hash, RECORDED, "{hash:#018x}");
}

#[test]
fn places_in_a_field_of_one_direction_are_equal_to_the_bit() {
    const RECORDED: u64 = 0x2a9d_dbb3_7637_5eab;
    let mut rng = generator(3312);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for round in 0..300_usize {
        let points = 1 + round % 9;
        let point = |at: usize, level: f64| (1000.0 * at as f64 / points as f64, 2e6 * level);
        let upsilon = (0..points).map(|at| point(at, random::log_uniform(&mut rng, 0.2, 5.0)));
        let link = StochasticLink {
            distance_m: 1000.0,
            tx_w: 80.0,
            mu_los: 7000.0,
            eta: 7100.0,
            upsilon: upsilon.collect(),
            relays: vec![
                ReferenceRelay {
                    altitude_m: 20.0,
                    power_w: 1.0,
                };
                1 + round % 20
            ],
        };
        let apart_m = [0.0, 10.0][round % 2];
        add_flown(
            &mut hash,
            Setup::new(of_stochastic_link(&link, apart_m).unwrap()),
        );
    }
    assert_eq!(hash, RECORDED, "{hash:#018x}");
}

/// Adds the bodies of the Sweep, Verdict and Aside messages that the relays of a run send to `hash`.
///
/// The digest in bytes 3 and 4 of each body is left out: older versions of the crate computed it without `reverse`. The
/// hash depends on the order on each link, but not on times, because some messages have changed their length.
fn add_passes(hash: &mut u64, mut setup: Setup) -> usize {
    setup.record = true;
    let mut chain = SimulatedChain::new(setup).unwrap();
    while !chain.step(u64::MAX) {}
    let mut frames = chain.frames(Instant::from_micros(u64::MAX));
    frames.sort_by_key(|frame| frame.link);
    let mut count = 0;
    for frame in frames {
        let Some((_, encoded)) = frame.bytes.split_last() else {
            continue;
        };
        let plain = cobs::decode_vec(encoded).unwrap();
        // Header of 10 bytes; no tag, and a check sequence of 4 bytes.
        let body = &plain[10..plain.len() - 4];
        if matches!(body[0], SWEEP | VERDICT | ASIDE) {
            count += 1;
            for (_, byte) in body
                .iter()
                .enumerate()
                .filter(|(at, _)| !matches!(at, 3 | 4))
            {
                add(hash, u32::from(*byte));
            }
        }
    }
    count
}

/// Checks that relays send the recorded Sweep, Verdict and Aside messages for traffic in one direction.
///
/// The messages were recorded before missions could have traffic in both directions.
#[test]
fn passes_of_one_direction_are_equal_byte_for_byte() {
    const RECORDED: u64 = 0xdeb4_11e3_1ec0_46b1;
    let mut rng = generator(3314);
    let (mut hash, mut count) = (0xcbf2_9ce4_8422_2325_u64, 0);
    for round in 0..SCENARIOS as usize {
        let config = scene(&mut rng, round, 1 + round % 12);
        let mut setup = Setup::new(Mission::try_new(config).unwrap());
        setup.settings.method = [Method::Align, Method::Joint][round % 2];
        count += add_passes(&mut hash, setup);
    }
    println!("{count} messages, hash {hash:#018x}");
    assert_eq!(hash, RECORDED, "{hash:#018x}");
}
