//! Tests of positions, sent bytes and missing features, the same for all sets of features.

use uav_relay::SetupError;
use uav_relay::mission::MissionError;
use uav_relay::{
    Adjust, Duration, Field, FieldPoint, Interference, Measure, Method, Mission, MissionConfig,
    Relay, Settings,
};
use uav_relay_features::{Chain, paper, shared};

// Results of the full set of features. After a change of the arithmetic or the wire format, print them with `--
// --nocapture`.
/// Expected x of each relay in a chain of five, m, as the bits of an f32.
const OF_FIVE: [u32; 5] = [
    0x439b_7618,
    0x43ac_5a98,
    0x43bc_d291,
    0x43cc_f747,
    0x43dc_e1b0,
];
const OF_FOUR: [u32; 4] = [0x439f_cc32, 0x43b1_2a47, 0x43c2_1c40, 0x43d2_be13];

/// Expected CRC-32C of all sent bytes, with relays connected by wires.
///
/// Only the feature `departures` changes the bytes: it sets a flag in each lease renewal when all relays are in place.
const SAID_BY_WIRES: u32 = if cfg!(feature = "departures") {
    0xe059_0429
} else {
    0xa970_3abd
};
const SAID_ON_A_CHANNEL: u32 = if cfg!(feature = "departures") {
    0xa680_60ff
} else {
    0x36ed_de21
};

const MINUTE: Duration = Duration::from_millis(60_000);

fn places(relays: &[Relay]) -> Vec<f32> {
    let places: Vec<_> = relays.iter().filter_map(Relay::setpoint).collect();
    assert_eq!(places.len(), relays.len(), "all have one");
    for place in &places {
        assert_eq!(
            [place.y_m, place.altitude_m].map(f32::to_bits),
            [0.0, 20.0].map(f32::to_bits)
        );
    }
    places.iter().map(|place| place.x_m).collect()
}

fn bits(places: &[f32]) -> Vec<u32> {
    places.iter().map(|x_m| x_m.to_bits()).collect()
}

/// Returns the SIR (linear) of every hop, computed in f64 by the paper's formulas.
///
/// `places` are the relays' x, m. Excess losses: 0.1 dB to and from drones, 21 dB from the interferer to the
/// receiver.
fn hops(places: &[f32]) -> Vec<f64> {
    let squared = |x: f64, y: f64, h: f64| x * x + y * y + h * h;
    let mut before = (0.0, 0.0, 1.0);
    let mut hops = Vec::new();
    for &x_m in places {
        let x = f64::from(x_m);
        let (from, low, gain) = before;
        let quiet = squared(500.0 - x, 400.0, 20.0);
        hops.push(gain * quiet / squared(x - from, 0.0, 20.0 - low));
        before = (x, 20.0, 1.0 / 80.0);
    }
    let excess = 10_f64.powf(2.1) / 10_f64.powf(0.01);
    let last = 1000.0 - before.0;
    hops.push(excess / 80.0 * squared(500.0, 400.0, 0.0) / squared(last, 0.0, 20.0));
    hops
}

#[test]
fn five_relays_reach_the_optimum_with_the_same_bytes() {
    let mut chain = Chain::new(paper(5), Settings::default()).unwrap();
    chain.fly(MINUTE);
    let places = places(chain.relays());
    let hops = hops(&places);
    println!(
        "{places:?} {:#010x?} {hops:?}, said {:#010x}",
        bits(&places),
        chain.crc_of_sent()
    );
    // In the best chain all hops have the same SIR.
    let (least, most) = hops.iter().fold((f64::MAX, 0.0_f64), |(least, most), hop| {
        (least.min(*hop), most.max(*hop))
    });
    assert!(most / least < 1.0 + 2e-4, "{hops:?}");
    assert_eq!(bits(&places), OF_FIVE);
    assert_eq!(chain.crc_of_sent(), SAID_BY_WIRES);
}

#[test]
fn four_relays_go_on_without_the_third_with_the_same_bytes() {
    let mut chain = Chain::new(paper(5), shared()).unwrap();
    chain.fly(MINUTE);
    assert_eq!(bits(&places(chain.relays())), OF_FIVE);
    chain.silence(3);
    chain.fly(MINUTE.times(3));
    let mut left = chain.relays().to_vec();
    left.remove(2);
    let places = places(&left);
    println!(
        "{places:?} {:#010x?}, said {:#010x}",
        bits(&places),
        chain.crc_of_sent()
    );
    assert_eq!(bits(&places), OF_FOUR);
    assert_eq!(chain.crc_of_sent(), SAID_ON_A_CHANNEL);
}

static POINTS: [FieldPoint; 1] = [FieldPoint {
    x_m: 0.0,
    upsilon_per_w: 1e9,
}];

fn unless<E>(there: bool, error: E) -> Option<E> {
    (!there).then_some(error)
}

#[test]
fn disabled_features_are_rejected() {
    let refused = |settings| Chain::new(paper(5), settings).err();
    let by = |method| Settings {
        method,
        ..Settings::default()
    };
    assert_eq!(
        refused(by(Method::Joint)),
        unless(cfg!(feature = "altitude"), SetupError::Method)
    );
    assert_eq!(
        refused(by(Method::Adjust(Adjust::default()))),
        unless(cfg!(feature = "adjust"), SetupError::Method)
    );
    let measures = Settings {
        measure: Some(Measure {
            i_max_w: 1e-6,
            samples: 1000,
        }),
        ..Settings::default()
    };
    assert_eq!(
        refused(measures),
        unless(cfg!(feature = "field"), SetupError::Measure)
    );
    let field = Mission::try_new(MissionConfig {
        interference: Interference::Field(Field::new(&POINTS)),
        ..*paper(5).config()
    });
    assert_eq!(
        field.err(),
        unless(cfg!(feature = "field"), MissionError::Field)
    );
    let mission = paper(5);
    let guarded = Settings {
        guard: Some(uav_relay::GuardConfig::of(
            &mission,
            mission.config().common,
        )),
        ..Settings::default()
    };
    assert_eq!(
        refused(guarded),
        unless(cfg!(feature = "guard"), SetupError::Guard)
    );
}

#[cfg(feature = "auth")]
#[test]
fn five_relays_with_a_key_find_the_same_positions() {
    let auth = uav_relay::Auth {
        key: uav_relay::Key::new([7; 32]),
        epoch: 1,
    };
    let settings = Settings {
        auth: Some(auth),
        ..Settings::default()
    };
    let mut chain = Chain::new(paper(5), settings).unwrap();
    chain.fly(MINUTE);
    assert_eq!(bits(&places(chain.relays())), OF_FIVE);
}
