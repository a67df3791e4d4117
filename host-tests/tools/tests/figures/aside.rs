//! Relay beside the line: positions and gains, against the three-dimensional reference.

use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::joint::{Corridor, Place, sir};
use uav_relay_oracle::reference::{Link, Station};
use uav_relay_tools::figures::aside::{ALTITUDES_M, MOST_ROOM_M, OFFSETS_M, RELAY_W, ROOM_M};

use super::{Table, off, within};

fn link(y_i: f64) -> Link {
    Link {
        y_i,
        relays: vec![Station {
            altitude_m: ALTITUDES_M.0,
            power_w: RELAY_W,
        }],
        ..Link::paper(1)
    }
}

/// Returns the reference's best SIR with this lateral room and up to this altitude.
fn judged(y_i: f64, room_m: f64, most_m: f64) -> f64 {
    let corridor = Corridor {
        least_m: ALTITUDES_M.0,
        most_m,
        left_m: -room_m,
        right_m: room_m,
    };
    let best = optimum(&link(y_i), corridor, &[]).unwrap();
    best.unwrap().sir
}

#[test]
fn the_places_beside_the_line_are_the_judges() {
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
            assert!(off(best, sir(&link(offset), &[place]).unwrap()) < 1e-5);
            assert!(place.y_m.abs() <= room && place.y_m <= 0.0);
            within(best, judged(offset, room, ALTITUDES_M.0), 1e-5, 1e-5);
        }
    }
}

#[test]
fn what_side_and_altitude_gain_is_what_the_judge_says() {
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
        // Lateral freedom is worth more than altitude, and with the largest room the lowest altitude is best.
        assert!(of[2].0 >= of[1].0 * (1.0 - 1e-6) || y <= 0.0, "{y}");
    }
}
