//! First hop: its reach if the SIR rises before it falls, and its largest SIR.

use host_tests::fixtures::paper;
use host_tests::make;
use uav_relay::optimiser::spacing::Hop;
use uav_relay::place::CrossSection;
use uav_relay::sir::{Sender, first_hop_ceiling};
use uav_relay::{Interference, Mission, MissionConfig, Placement};

fn first_hop(x_m: f32, distance_m: f32, altitude_m: f32) -> Hop {
    let interferer = make::interferer(80.0, x_m, 0.0);
    let config = MissionConfig {
        distance_m,
        interference: Interference::Source(interferer),
        ..paper(1)
    };
    let mission = Mission::try_new(config).unwrap();
    let sender = Sender::transmitter(&mission);
    Hop::new(
        &mission,
        &interferer,
        sender,
        1,
        CrossSection::on_line(altitude_m),
        0.0,
    )
}

/// Checks the maximum length of a first hop whose SIR rises up to a length of 45 m, and then falls.
///
/// The interferer is 10 m behind Tx. With the relay directly above Tx the SIR is 1.04; at a length of 45 m it is 1.22.
/// Only lengths within an interval meet the target. This interval may be beyond the longest permitted length.
#[test]
fn a_stretch_that_meets_the_target_is_found_or_not_by_where_the_link_ends() {
    // SIR_1 is at least 1.22 from 40.9 m to 50 m.
    assert_eq!(
        first_hop(-10.0, 35.0, 50.0).reach(1.22, 0.0),
        None,
        "it lies beyond the end"
    );
    assert_eq!(
        first_hop(-10.0, 45.0, 50.0).reach(1.22, 0.0),
        Some(45.0),
        "the end lies in it"
    );
    let inside = first_hop(-10.0, 60.0, 50.0).reach(1.22, 0.0).unwrap();
    assert!((inside - 50.0).abs() < 1e-3, "it ends at 50 m: {inside}");
    assert_eq!(
        first_hop(-10.0, 60.0, 50.0).reach(1.23, 0.0),
        None,
        "nothing meets that much"
    );
}

#[test]
fn there_is_no_way_back() {
    assert_eq!(first_hop(500.0, 1000.0, 20.0).reach(1.0, 1000.5), None);
}

#[test]
fn the_ceiling_of_the_first_hop_is_never_below_what_a_scan_finds() {
    for (x_m, y_m, altitude_m, noise_w) in [
        (500.0, 400.0, 20.0, 0.0),
        (-10.0, 0.0, 50.0, 0.0),
        (-300.0, 200.0, 80.0, 0.0),
        (-1e5, 3.0, 900.0, 0.0),
        (500.0, 400.0, 20.0, 1e-8),
        (0.0, 0.0, 20.0, 1e-5),
        (-10.0, 0.0, 50.0, 1e-6),
        (-10.0, 0.0, 50.0, 1e-1),
        (-300.0, 200.0, 80.0, 1e-7),
        (-1e5, 3.0, 900.0, 1e-12),
    ] {
        let interferer = make::interferer(80.0, x_m, y_m);
        let mission = Mission::try_new(MissionConfig {
            interference: Interference::Source(interferer),
            noise_w,
            ..paper(1)
        })
        .unwrap();
        let tx = Sender::transmitter(&mission);
        let best = (0..=10_000_u16)
            .map(|i| {
                tx.sir_at(
                    &mission,
                    0.0,
                    Placement::on_line(f32::from(i) * 0.1, altitude_m),
                )
            })
            .fold(0.0, f32::max);
        let ceiling = first_hop_ceiling(&mission, altitude_m);
        assert!(
            (ceiling / best - 1.0).abs() < 1e-4,
            "{x_m} {y_m} {altitude_m} {noise_w}: {ceiling} against {best}"
        );
        assert!(ceiling >= best * (1.0 - 1e-6));
    }
}
