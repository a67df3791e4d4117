//! Altitudes: one for all relays, Algorithm 2 by round, and the joint method.

use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::joint::{Corridor, Place, sir};
use uav_relay_oracle::reference::{Link, Relay, joint};
use uav_relay_tools::figures::altitude::best_common;
use uav_relay_tools::figures::aside::{ALTITUDES_M, MOST_ROOM_M, OFFSETS_M, RELAY_W, ROOM_M};

use super::{Table, off, within};

fn link(relays: usize, y_i: f64, altitude_m: f64) -> Link {
    Link {
        y_i,
        min_separation_m: 4.0,
        relays: vec![
            Relay {
                altitude_m,
                power_w: 1.0
            };
            relays
        ],
        ..Link::paper(relays)
    }
}

#[test]
fn chains_at_one_altitude_agree_with_the_reference() {
    let table = Table::read("altitude");
    for y in [100.0, 150.0, 200.0, 300.0, 400.0] {
        for altitude in [10.0, 100.0, 205.0, 220.0, 400.0] {
            let row = table.row(&[("interferer_y_m", y), ("altitude_m", altitude)]);
            let optimum = link(50, y, altitude).optimum().unwrap();
            within(row.number("sir_linear"), optimum, 1e-5, 2e-6);
        }
    }
}

/// Checks the SIRs with the paper's steps of 0.1 in the target SIR against the reference.
///
/// The altitudes are 195 m to 230 m.
#[test]
fn the_step_ends_where_the_reference_does() {
    let table = Table::read("altitude");
    for altitude in [195.0, 205.5, 209.5, 220.0, 230.0] {
        let row = table.row(&[("interferer_y_m", 150.0), ("altitude_m", altitude)]);
        let (_, target) = link(50, 150.0, altitude).fixed_step(0.1).unwrap();
        within(row.number("sir_by_step_linear"), target, 1e-5, 1e-5);
    }
    let row = table.row(&[("interferer_y_m", 150.0), ("altitude_m", 220.0)]);
    assert!(off(row.number("sir_by_step_linear"), 5.43017) < 1e-5);
    assert!(
        table
            .row(&[("interferer_y_m", 200.0), ("altitude_m", 220.0)])
            .get("sir_by_step_linear")
            .is_none()
    );
}

#[test]
fn the_best_common_altitude_agrees_with_the_reference() {
    let (altitude, sir) = best_common(50, 150.0).unwrap();
    println!("{altitude} m, SIR {sir}");
    assert!((altitude - 209.42).abs() < 1.0, "{altitude}");
    within(sir, 5.450_572_0, 3e-6, 3e-6);
}

const CORRIDOR: Corridor = Corridor::plane(20.0 - 1e-3, 300.0 + 1e-3);

#[test]
fn chain_shapes_have_the_sir_of_their_round() {
    let (shapes, rounds) = (Table::read("shapes"), Table::read("rounds"));
    for round in [0.0, 10.0, 50.0, 500.0] {
        let rows = shapes.rows(&[("round", round)]);
        assert_eq!(rows.len(), 50);
        let places: Vec<Place> = rows
            .iter()
            .map(|row| Place::in_plane(row.number("x_m"), row.number("altitude_m")))
            .collect();
        let link = link(50, 150.0, 220.0);
        let sir = sir(&link, &places).unwrap();
        let said = rounds.row(&[("round", round)]).number("sir_fine_linear");
        assert!(off(said, sir) < 1e-5, "{said} against {sir}");
        let rounded = Link {
            min_separation_m: 3.999,
            ..link
        };
        assert!(joint::keeps_rules(&rounded, CORRIDOR, &[], &places));
    }
    // Statements in the text of the page.
    let at = |round: f64, relay: f64| shapes.row(&[("round", round), ("relay", relay)]);
    assert!(
        at(50.0, 1.0).number("altitude_m") < 160.0 && at(50.0, 50.0).number("altitude_m") < 180.0
    );
    assert!(at(500.0, 25.0).number("altitude_m") > 290.0);
    let step = |round: f64, relay: f64| {
        at(round, relay + 1.0).number("x_m") - at(round, relay).number("x_m")
    };
    for round in [0.0, 10.0, 50.0] {
        assert!(step(round, 1.0) > step(round, 25.0) && step(round, 49.0) > step(round, 25.0));
    }
    assert!(step(500.0, 49.0) < step(500.0, 25.0));
}

/// Checks Algorithm 2 against a separate program that maximises each relay's SIR exactly.
///
/// From round to round the chain's SIR never falls, and it stays below the joint optimum of all relays. Algorithm 2
/// with a coarse grid gains nothing.
#[test]
fn rounds_rise_as_exact_local_search_does() {
    let table = Table::read("rounds");
    let rows = table.rows(&[]);
    assert_eq!(rows.len(), 501);
    let start = link(50, 150.0, 220.0).optimum().unwrap();
    let fine: Vec<f64> = rows
        .iter()
        .map(|row| row.number("sir_fine_linear"))
        .collect();
    within(fine[0], start, 1e-4, 1e-5);
    assert!(fine.windows(2).all(|pair| pair[1] >= pair[0]));
    for (round, exact) in [(10, 5.555), (50, 6.010), (500, 6.401)] {
        println!("round {round}: {} against {exact}", fine[round]);
        assert!(off(fine[round], exact) < 1e-3, "{}", fine[round]);
    }
    assert!(fine[500] < 6.498_377_624_8);
    for row in &rows {
        assert_eq!(row.number("sir_grid_linear"), fine[0]);
    }
}

#[test]
fn common_and_joint_altitudes_agree_with_the_reference() {
    let table = Table::read("joint");
    for (relays, common, optimum) in [
        (2.0, 0.881_533_2, 0.881_533_886_7),
        (5.0, 1.047_409_1, 1.047_463_457_8),
        (8.0, 1.228_699_0, 1.235_783_782_6),
        (50.0, 5.450_572_0, 6.498_377_624_8),
    ] {
        let row = table.row(&[("relays", relays)]);
        within(row.number("common_sir_linear"), common, 3e-6, 3e-6);
        within(row.number("joint_sir_linear"), optimum, 1e-4, 1e-6);
        let adjusted = row.number("adjust_sir_linear");
        assert!(adjusted >= common * (1.0 - 1e-4) && adjusted <= optimum * (1.0 + 1e-6));
        let gain = 100.0 * (row.number("joint_sir_linear") / common - 1.0);
        assert!((row.number("joint_gain_percent") - gain).abs() < 1e-3);
    }
    for row in table.rows(&[]) {
        let at_altitude = {
            let relays = (1..=100)
                .find(|n| f64::from(*n) == row.number("relays"))
                .unwrap();
            link(
                usize::try_from(relays).unwrap(),
                150.0,
                row.number("common_altitude_m"),
            )
        };
        within(
            row.number("common_sir_linear"),
            at_altitude.optimum().unwrap(),
            1e-5,
            2e-6,
        );
        assert!(row.number("joint_sir_linear") >= row.number("adjust_sir_linear") * (1.0 - 1e-4));
        assert!(row.number("joint_messages") <= row.number("adjust_messages"));
    }
}

fn link_of_one(y_i: f64) -> Link {
    Link {
        y_i,
        relays: vec![Relay {
            altitude_m: ALTITUDES_M.0,
            power_w: RELAY_W,
        }],
        ..Link::paper(1)
    }
}

/// Returns the best SIR of one relay from the recorded optima, linear.
///
/// The interferer is at y = `y_i`, m. The relay may have |y| up to `room_m`, and altitudes up to `most_m`.
fn judged(y_i: f64, room_m: f64, most_m: f64) -> f64 {
    let corridor = Corridor {
        least_m: ALTITUDES_M.0,
        most_m,
        left_m: -room_m,
        right_m: room_m,
    };
    let best = optimum(&link_of_one(y_i), corridor, &[]).unwrap();
    best.unwrap().sir
}

#[test]
fn lateral_positions_agree_with_the_reference() {
    let table = Table::read("aside");
    for offset in OFFSETS_M {
        let rows = table.rows(&[("interferer_y_m", offset)]);
        assert_eq!(
            rows.last().unwrap().number("room_m"),
            f64::from(MOST_ROOM_M)
        );
        for row in rows {
            let (room, best) = (row.number("room_m"), row.number("sir_linear"));
            let place = Place {
                x_m: row.number("x_m"),
                y_m: row.number("y_m"),
                altitude_m: ALTITUDES_M.0,
            };
            assert!(off(best, sir(&link_of_one(offset), &[place]).unwrap()) < 1e-5);
            assert!(place.y_m.abs() <= room && place.y_m <= 0.0);
            within(best, judged(offset, room, ALTITUDES_M.0), 1e-5, 1e-5);
        }
    }
}

#[test]
fn gains_by_side_and_altitude_agree_with_the_reference() {
    let table = Table::read("aside-gain");
    for row in table.rows(&[]) {
        let y = row.number("interferer_y_m");
        let (low, high) = ALTITUDES_M;
        let both = row.number("both_sir_linear");
        let of = [
            (row.number("line_sir_linear"), 0.0, low),
            (row.number("altitude_sir_linear"), 0.0, high),
            (row.number("side_sir_linear"), ROOM_M, low),
            (both, ROOM_M, high),
        ];
        for (got, room, most) in of {
            within(got, judged(y, room, most), 1e-5, 1e-5);
            assert!(got <= both * (1.0 + 1e-6));
        }
        // Lateral freedom gains more than altitude.
        assert!(of[2].0 >= of[1].0 * (1.0 - 1e-6) || y <= 0.0, "{y}");
    }
}
