//! Random scenes with several interferers.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | D | log-uniform, 100 m to 10 km |
//! | N, number of sources | uniform over the requested range |
//! | source's x | 70 % uniform in [0, D]; 15 % each in [-D, 0] and [D, 2 D] |
//! | source's y, either side | 10 % exactly 0; 30 % log-uniform 0.003 D to 0.1 D; else log-uniform 0.1 D to D |
//! | source's power | log-uniform 1 to 300 times a relay's |
//! | altitude, lowest of the band | log-uniform 0.005 D to 0.1 D |
//! | highest of the band | the same in half of the scenes; else log-uniform from twice the lowest to 0.5 D |
//! | relay power | log-uniform 0.1 W to 10 W; in a third of the scenes 0.3 to 3 times that for each relay |
//! | Tx power | log-uniform 0.3 to 100 times a relay's |
//! | channel | 2 GHz, 0.1 dB and 0.1 to 21 dB of excess loss, eta a uniform mixture |
//! | minimum separation | 0 in half; else log-uniform 0.03 to 1 times D / N |
//!
//! Aloof sources are 0.3 D to D beside the line, with powers of 50 to 100 times a relay's. Such similar sources are the case for
//! which the paper replaces them by one hypothetical interferer.

use std::ops::RangeInclusive;

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::RngExt;
use uav_relay_oracle::mission::scene_of;
use uav_relay_oracle::random::log_uniform;
use uav_relay_oracle::reference::Link;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{AirGround, ChannelSpec, Interference, Scenario, Source};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Sources {
    /// Interferers at any position, also on the line.
    Any,
    /// Interferers far to the side of the line between Tx and Rx.
    Aloof,
}

pub(crate) fn scenario(
    rng: &mut ChaCha8Rng,
    relays: RangeInclusive<u16>,
    sources: RangeInclusive<u16>,
    kind: Sources,
) -> (Scenario, u16) {
    let n = rng.random_range(relays);
    let d = log_uniform(rng, 100.0, 1e4);
    let uav_w = log_uniform(rng, 0.1, 10.0);
    let altitude_m = d * log_uniform(rng, 0.005, 0.1);
    let altitude_max_m = if rng.random() {
        altitude_m
    } else {
        log_uniform(rng, 2.0 * altitude_m, 0.5 * d)
    };
    let count = rng.random_range(sources);
    let sources = (0..count).map(|_| source(rng, d, uav_w, kind)).collect();
    let own_power = rng.random_range(0..3) == 0;
    let relays = (1..=n).filter(|_| own_power).map(|index| {
        let own = make::relay_override(None, Some(uav_w * log_uniform(rng, 0.3, 3.0)));
        (index, own)
    });
    let relays = relays.collect();
    let min_separation_m = if rng.random() {
        0.0
    } else {
        d / f64::from(n) * log_uniform(rng, 0.03, 1.0)
    };
    let scenario = Scenario {
        distance_m: d,
        altitude_m,
        altitude_min_m: altitude_m,
        altitude_max_m,
        min_separation_m,
        tx_w: uav_w * log_uniform(rng, 0.3, 100.0),
        rx_w: uav_w,
        uav_w,
        channel: ChannelSpec {
            excess_loss_nlos_db: rng.random_range(0.1..=21.0),
            air_ground: AirGround::Weight(rng.random_range(0.0..=1.0)),
            ..ChannelSpec::default()
        },
        interference: Interference::Sources(sources),
        relays,
        ..Scenario::default()
    };
    (scenario, n)
}

pub(crate) fn scene(
    rng: &mut ChaCha8Rng,
    relays: RangeInclusive<u16>,
    sources: RangeInclusive<u16>,
) -> Scene {
    let (scenario, n) = scenario(rng, relays, sources, Sources::Any);
    Scene::new(&scenario, n).unwrap()
}

/// Converts a chain of the reference model to a scene. The only permitted altitude is that of the chain's first relay.
pub(crate) fn of_link(link: &Link) -> Scene {
    scene_of(link).unwrap()
}

/// Returns the scene with its lowest permitted altitude as the only permitted altitude.
pub(crate) fn level(mut scene: Scene) -> Scene {
    scene.band.most_m = scene.band.least_m;
    scene
}

fn source(rng: &mut ChaCha8Rng, d: f64, uav_w: f64, kind: Sources) -> Source {
    let along = match rng.random_range(0..20) {
        0..14 => rng.random_range(0.0..=1.0),
        14..17 if kind == Sources::Any => rng.random_range(-1.0..=0.0),
        _ if kind == Sources::Any => rng.random_range(1.0..=2.0),
        _ => rng.random_range(0.0..=1.0),
    };
    let aside = match rng.random_range(0..10) {
        _ if kind == Sources::Aloof => log_uniform(rng, 0.3, 1.0),
        0 => 0.0,
        1..4 => log_uniform(rng, 0.003, 0.1),
        _ => log_uniform(rng, 0.1, 1.0),
    };
    let side = if rng.random() { 1.0 } else { -1.0 };
    let power = if kind == Sources::Aloof {
        log_uniform(rng, 50.0, 100.0)
    } else {
        log_uniform(rng, 1.0, 300.0)
    };
    make::source(uav_w * power, d * along, d * aside * side)
}
