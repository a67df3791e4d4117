//! Meaning of a valid file.

use std::collections::BTreeMap;

use host_tests::make;
use uav_relay_scenario::{AirGround, BetaPoint, ChannelSpec, Field, Interference, Noise};

use super::*;

#[test]
fn every_key_sets_its_value() {
    let text = "
        [geometry]
        distance_m = 1500.0
        altitude_m = 25            # no decimal point needed
        altitude_min_m = 20.0
        altitude_max_m = 120.0
        lateral_min_m = -30
        lateral_max_m = 45.0
        min_separation_m = 4.5
        [power]
        tx_w = 80.0
        uav_w = 2
        [channel]
        carrier_hz = 2.4e9
        excess_loss_los_db = 0.2
        excess_loss_nlos_db = 22.0
        air_ground = 0.75
        [[interferer]]
        power_w = 40.0
        x_m = -100.0
        y_m = 400.0
        [[interferer]]
        power_w = 60
        x_m = 1700
        y_m = -300
        [[relay]]
        index = 3
        altitude_m = 30.0
        power_w = 0.5
        [[relay]]
        index = 1
        power_w = 4
    ";
    let expected = Scenario {
        distance_m: 1500.0,
        altitude_m: 25.0,
        altitude_min_m: 20.0,
        altitude_max_m: 120.0,
        lateral_min_m: -30.0,
        lateral_max_m: 45.0,
        min_separation_m: 4.5,
        tx_w: 80.0,
        rx_w: 80.0,
        uav_w: 2.0,
        channel: ChannelSpec {
            carrier_hz: 2.4e9,
            excess_loss_los_db: 0.2,
            excess_loss_nlos_db: 22.0,
            air_ground: AirGround::Weight(0.75),
        },
        interference: Interference::Sources(vec![
            make::source(40.0, -100.0, 400.0),
            make::source(60.0, 1700.0, -300.0),
        ]),
        noise: Noise::default(),
        relays: BTreeMap::from([
            (3, make::relay_override(Some(30.0), Some(0.5))),
            (1, make::relay_override(None, Some(4.0))),
        ]),
        ..Scenario::default()
    };
    assert_eq!(parse(text).unwrap(), expected);
}

#[test]
fn the_paper_scenario_as_a_file_is_the_default() {
    let text = "
        [geometry]
        distance_m = 1000.0
        altitude_m = 20.0
        altitude_min_m = 20.0
        altitude_max_m = 20.0
        min_separation_m = 4.0
        [power]
        tx_w = 80.0
        uav_w = 1.0
        [channel]
        carrier_hz = 2e9
        excess_loss_los_db = 0.1
        excess_loss_nlos_db = 21.0
        air_ground = 'los'
        [[interferer]]
        power_w = 80.0
        x_m = 500.0
        y_m = 400.0
    ";
    assert_eq!(parse(text).unwrap(), Scenario::default());
}

#[test]
fn what_a_file_leaves_out_has_its_default() {
    let expected = Scenario {
        min_separation_m: 0.0,
        ..Scenario::default()
    };
    assert_eq!(parse(&small("")).unwrap(), expected);
    assert_eq!(parse(&small("[channel]\n")).unwrap(), expected);
}

#[test]
fn a_field_takes_the_place_of_the_interferers() {
    let text = format!(
        "{GEOMETRY}{POWER}[field]\ni_max_w = 1.0e-9\nbeta = [\n  {{ x_m = 0.0, alpha = 4.0, beta = 2.0 }},\n  \
         {{ x_m = 1000, alpha = 3, beta = 2 }},\n]\n"
    );
    let beta = vec![
        BetaPoint {
            x_m: 0.0,
            alpha: 4.0,
            beta: 2.0,
        },
        BetaPoint {
            x_m: 1000.0,
            alpha: 3.0,
            beta: 2.0,
        },
    ];
    let expected = Interference::Field(Field {
        i_max_w: 1e-9,
        beta,
    });
    assert_eq!(parse(&text).unwrap().interference, expected);
}

#[test]
fn the_obstructed_path_loss_is_the_larger() {
    let both = small("[channel]\nexcess_loss_los_db = 9\nexcess_loss_nlos_db = 8.5\n");
    refused(
        &both,
        Problem::OutOfRange,
        &[
            "channel.excess_loss_nlos_db = 8.5",
            "9 dB (the value of excess_loss_los_db) to 200 dB",
        ],
    );
    // The given key is reported, not the default that it contradicts.
    let los = small("[channel]\nexcess_loss_los_db = 22\n");
    refused(
        &los,
        Problem::OutOfRange,
        &["channel.excess_loss_los_db = 22", "0 to 21 dB"],
    );
    let equal = parse(&small("[channel]\nexcess_loss_los_db = 21\n")).unwrap();
    assert_eq!(
        equal.channel.excess_loss_los_db,
        equal.channel.excess_loss_nlos_db
    );
}

#[test]
fn air_ground_accepts_only_its_exact_words() {
    let read = |value: &str| parse(&small(&format!("[channel]\nair_ground = {value}\n")));
    assert_eq!(read("'los'").unwrap().channel.air_ground, AirGround::Los);
    assert_eq!(read("'nlos'").unwrap().channel.air_ground, AirGround::Nlos);
    assert_eq!(
        read("0.25").unwrap().channel.air_ground,
        AirGround::Weight(0.25)
    );
    assert_eq!(
        read("1").unwrap().channel.air_ground,
        AirGround::Weight(1.0)
    );
    for word in ["\"LOS\"", "\"mixed\"", "\"\""] {
        let text = small(&format!("[channel]\nair_ground = {word}\n"));
        refused(
            &text,
            Problem::WrongType,
            &[
                "channel.air_ground",
                word,
                "\"los\", \"nlos\" or a number, 0 to 1",
            ],
        );
    }
}

#[test]
fn noise_is_k_t_b_f() {
    let noise = |text: &str| parse(&small(text)).unwrap().noise;
    assert_eq!(noise(""), Noise::default());
    assert!(noise("").power_w() <= 0.0 && noise("[noise]\nfigure_db = 9\n").power_w() <= 0.0);
    // -174 dBm/Hz + 73 dB for 20 MHz + 6 dB: -95 dBm.
    let dbm = 10.0 * (1e3 * noise("[noise]\nbandwidth_hz = 20e6\n").power_w()).log10();
    assert!((dbm + 94.965).abs() < 0.01, "{dbm}");
    let given = noise("[noise]\nbandwidth_hz = 1e6\nfigure_db = 0\n").power_w();
    assert!(
        (given / (1.380_649e-23 * 290.0 * 1e6) - 1.0).abs() < 1e-12,
        "{given}"
    );
}
