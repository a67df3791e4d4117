//! Powers, gains and noise in decibel units: the chain reproduces the link budget.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::mission::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_sim::report::hop_sirs;

use super::*;

#[test]
fn the_same_power_in_dbm_is_the_same_scenario() {
    let in_w = small("[[relay]]\nindex = 2\npower_w = 0.1\n[noise]\nbandwidth_hz = 1e6\n");
    let in_dbm = in_w
        .replace("tx_w = 80", "tx_dbm = 49.03089986991944")
        .replace("uav_w = 1", "uav_dbm = 30")
        .replace("power_w = 80", "power_dbm = 49.03089986991944")
        .replace("power_w = 0.1", "power_dbm = 20");
    let eirps = in_w
        .replace("tx_w = 80", "tx_eirp_dbm = 49.03089986991944")
        .replace("power_w = 80", "eirp_dbm = 49.03089986991944");
    let gains = in_w
        .replace("tx_w = 80", "tx_dbm = 39.03089986991944\ntx_gain_dbi = 10")
        .replace("power_w = 80", "power_w = 800\ngain_dbi = -10");
    let (plain, _) = mission(&parse(&in_w).unwrap(), 3, 1e-4).unwrap();
    for text in [in_dbm, eirps, gains] {
        let (other, _) = mission(&parse(&text).unwrap(), 3, 1e-4).unwrap();
        assert_eq!(other, plain, "{text}");
    }
}

#[test]
fn a_power_is_given_once() {
    for (key, other, table) in [
        ("tx_w = 80", "tx_dbm = 49", "power"),
        ("tx_w = 80", "tx_eirp_dbm = 49", "power"),
        ("uav_w = 1", "uav_dbm = 30", "power"),
        ("power_w = 80", "power_dbm = 49", "interferer[0]"),
        ("power_w = 80", "eirp_dbm = 49", "interferer[0]"),
        ("x_m = 500", "lat_deg = 47", "interferer[0]"),
        ("y_m = 400", "lon_deg = 8", "interferer[0]"),
    ] {
        let text = small("").replace(key, &format!("{key}\n{other}"));
        let name = |pair: &str| pair.split(' ').next().unwrap().to_owned();
        let both = format!("{table}.{key} together with {other} is not allowed");
        let allowed = format!("{} or {}, not both", name(key), name(other));
        refused(&text, Problem::SaidTwice, &[&both, &allowed]);
    }
    let relay = small("[[relay]]\nindex = 1\npower_w = 1\npower_dbm = 30\n");
    let parts = ["relay[0].power_w = 1 together with power_dbm = 30"];
    refused(&relay, Problem::SaidTwice, &parts);
    let gain = small("").replace("tx_w = 80", "tx_gain_dbi = 3\ntx_eirp_dbm = 49");
    let parts = ["power.tx_gain_dbi = 3 together with tx_eirp_dbm = 49"];
    refused(&gain, Problem::SaidTwice, &parts);
    for other in ["bandwidth_hz = 1e6", "figure_db = 3"] {
        let noise = small(&format!("[noise]\n{other}\npower_dbm = -100\n"));
        refused(
            &noise,
            Problem::SaidTwice,
            &["together with power_dbm = -100"],
        );
    }
    let none = small("").replace("uav_w = 1\n", "");
    let parts = [
        "power.uav_w is missing",
        "1e-6 to 1e6 W, or the key uav_dbm instead, a number, -30 to 90 dBm",
    ];
    refused(&none, Problem::Missing, &parts);
}

#[test]
fn an_eirp_outside_the_missions_range_is_refused() {
    for (plain, gain, parts) in [
        (
            "tx_w = 80",
            "tx_w = 1e5\ntx_gain_dbi = 20",
            ["power.tx_w = 1e5 with tx_gain_dbi = 20", "1e-6 to 1e6 W"],
        ),
        (
            "uav_w = 1",
            "uav_dbm = -20\nuav_gain_dbi = -20",
            [
                "power.uav_dbm = -20 with uav_gain_dbi = -20",
                "1e-6 to 1e6 W",
            ],
        ),
        (
            "power_w = 80",
            "power_dbm = 100\ngain_dbi = 30",
            [
                "interferer[0].power_dbm = 100 with gain_dbi = 30",
                "1e-6 to 1e9 W",
            ],
        ),
    ] {
        let text = small("").replace(plain, gain);
        refused(&text, Problem::OutOfRange, &parts);
    }
    let relay = small("[[relay]]\nindex = 1\npower_w = 1e6\n")
        .replace("uav_w = 1", "uav_w = 1\nuav_gain_dbi = 1");
    let parts = ["relay[0].power_w = 1e6 with power.uav_gain_dbi = 1"];
    refused(&relay, Problem::OutOfRange, &parts);
}

/// End of a radio link: its position in m, and its antenna gain in dBi.
type End = ([f64; 3], f64);

/// Returns the received power in dBm for a transmitted power `dbm`. The loss in free space, the excess loss and both
/// antenna gains are included.
fn received_dbm(
    dbm: f64,
    (from, sends_dbi): End,
    (to, hears_dbi): End,
    hertz: f64,
    excess_db: f64,
) -> f64 {
    let square = |axis: usize| (from[axis] - to[axis]).powi(2);
    let distance = (square(0) + square(1) + square(2)).sqrt();
    let free_space_db = 20.0 * distance.log10() + 20.0 * hertz.log10() - 147.552_216_778;
    dbm + sends_dbi + hears_dbi - free_space_db - excess_db
}

fn milliwatts(dbm: f64) -> f64 {
    10_f64.powf(dbm / 10.0)
}

/// Checks the crate's SINRs against a link budget.
///
/// The crate's SINRs equal those of the link budget if all receiving antennas have the same gain. Otherwise the
/// crate's SINRs are not higher.
#[test]
fn the_chain_has_the_sinrs_of_a_link_budget() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut uneven = 0;
    for _ in 0..300 {
        let mut of = |low: f64, high: f64| rng.random_range(low..high);
        let (d, h, hertz) = (of(500.0, 20e3), of(20.0, 300.0), of(4e8, 6e9));
        let [tx_dbm, uav_dbm, jam_dbm] = [of(20.0, 50.0), of(10.0, 40.0), of(10.0, 50.0)];
        let [tx_g, uav_g, jam_g] = [of(-3.0, 20.0), of(-3.0, 10.0), of(-3.0, 20.0)];
        let rx_g = if of(0.0, 1.0) < 0.5 {
            uav_g
        } else {
            of(-3.0, 20.0)
        };
        let (bandwidth, figure) = (10_f64.powf(of(4.0, 8.0)), of(0.0, 12.0));
        let (jam_x, jam_y) = (of(0.0, d), of(100.0, 2e3));
        let text = format!(
            "[geometry]\ndistance_m = {d}\naltitude_m = {h}\n[channel]\ncarrier_hz = {hertz}\n\
             [power]\ntx_dbm = {tx_dbm}\ntx_gain_dbi = {tx_g}\nuav_dbm = {uav_dbm}\nuav_gain_dbi = {uav_g}\nrx_gain_dbi = {rx_g}\n\
             [noise]\nbandwidth_hz = {bandwidth}\nfigure_db = {figure}\n\
             [[interferer]]\npower_dbm = {jam_dbm}\ngain_dbi = {jam_g}\nx_m = {jam_x}\ny_m = {jam_y}\n"
        );
        let scenario = parse(&text).unwrap();
        let places = [(0.3 * d, h), (0.8 * d, h)];
        let scene = Scene::new(&scenario, 2).unwrap();
        let told = scene.hop_sirs(&places);

        let tx: End = ([0.0, 0.0, 0.0], tx_g);
        let relays: [End; 2] = places.map(|(x, h)| ([x, 0.0, h], uav_g));
        let rx: End = ([d, 0.0, 0.0], rx_g);
        let jammer: End = ([jam_x, jam_y, 0.0], jam_g);
        let noise_dbm =
            10.0 * (1.380_649e-23_f64 * 290.0 * 1e3).log10() + 10.0 * bandwidth.log10() + figure;
        let sinr = |dbm: f64, from: End, to: End, jam_excess: f64| {
            let signal = received_dbm(dbm, from, to, hertz, 0.1);
            let jammed = received_dbm(jam_dbm, jammer, to, hertz, jam_excess);
            milliwatts(signal) / (milliwatts(jammed) + milliwatts(noise_dbm))
        };
        let budget = [
            sinr(tx_dbm, tx, relays[0], 0.1),
            sinr(uav_dbm, relays[0], relays[1], 0.1),
            sinr(uav_dbm, relays[1], rx, 21.0),
        ];
        for (hop, (told, is)) in told.iter().zip(budget).enumerate() {
            let exact = if hop == 2 {
                rx_g <= uav_g
            } else {
                uav_g <= rx_g
            };
            let off = told / is - 1.0;
            if exact {
                assert!(off.abs() < 1e-6, "hop {hop}: {told} is {is}\n{text}");
            } else {
                assert!(off < 1e-6, "hop {hop}: {told} is above {is}\n{text}");
            }
        }
        uneven += usize::from(scenario.noise.is_uneven());

        // The relays' f32 values give the same.
        let (mission, _) = mission(&scenario, 2, 1e-4).unwrap();
        let profile = mission.config().common;
        let held = places.map(|(x, h)| {
            let place = make::placement(x as f32, 0.0, h as f32);
            (place, profile)
        });
        for (on_board, told) in hop_sirs(&mission, &held).iter().zip(told) {
            assert!(
                (on_board / told - 1.0).abs() < 1e-4,
                "{on_board} {told}\n{text}"
            );
        }
    }
    assert!((100..200).contains(&uneven), "{uneven}");
}

#[test]
fn a_receivers_gain_changes_no_sir_and_its_noise_alone() {
    let noise = "[noise]\npower_dbm = -100\n";
    let gains = |relays: i32, rx: i32| {
        let gains = format!("uav_w = 1\nuav_gain_dbi = {relays}\nrx_gain_dbi = {rx}");
        parse(&small(noise).replace("uav_w = 1", &gains)).unwrap()
    };
    for (relays, rx, dbm) in [
        (0, 0, -100.0),
        (3, 3, -103.0),
        (3, 12, -103.0),
        (12, -2, -98.0),
    ] {
        let scenario = gains(relays, rx);
        let is = 10.0 * scenario.noise.power_w().log10() + 30.0;
        assert!((is - dbm).abs() < 1e-9, "{relays} {rx}: {is}");
        assert_eq!(scenario.noise.is_uneven(), relays != rx);
    }
    let silent = small("").replace("uav_w = 1", "uav_w = 1\nrx_gain_dbi = 30");
    let (with, _) = mission(&parse(&silent).unwrap(), 2, 1e-4).unwrap();
    let (without, _) = mission(&parse(&small("")).unwrap(), 2, 1e-4).unwrap();
    assert_eq!(with, without);
}
