//! Relays that receive their drones' positions through a FIFO.

use std::time::{Duration, Instant};

use crate::chain::Chain;
use crate::files::{Files, write};
use crate::medium::QUIET;
use crate::process::{LIMIT, Relay, bits};

/// Checks that the first setpoint of each relay is its drone's position, so that no drone must jump.
///
/// The last setpoints must be those of a chain without motion guards.
#[test]
fn two_relays_with_positions_keep_apart_by_their_guards() {
    let mut free = Chain::start(2, "");
    free.lines(
        "unguarded: no --positions and no --autopilot: drones are not kept apart while they move",
    );
    let expected = free.settled();
    drop(free);

    let mut chain = Chain::on_wires(2, QUIET);
    let fifos = ["1", "2"].map(|name| chain.files.fifo(name));
    for (index, fifo) in (1..).zip(&fifos) {
        let relay = chain.relay(index, &format!("--positions {fifo}"));
        chain.relays.push(relay);
    }
    // The drones are always at their latest setpoints.
    let mut at = [[10.0, 0.0, 20.0], [30.0, 0.0, 20.0_f32]];
    for relay in &mut chain.relays {
        let line =
            relay.line("guarded: drones are kept apart while they move; this drone's positions are read from --positions");
        assert!(!line.contains("unguarded"), "{line}");
        assert!(!relay.has_printed("setpoint: "), "nobody knows where it is");
    }
    let began = Instant::now();
    let mut setpoints = [0; 2];
    let mut there = [false; 2];
    while there != [true; 2] {
        for (k, relay) in chain.relays.iter_mut().enumerate() {
            let [x, y, h] = at[k];
            write(&fifos[k], &format!("{x} {y} {h}\n"));
            for line in relay.lines_with("setpoint: ") {
                let [x, y, h] = bits(&line)[..3] else {
                    panic!("{line}")
                };
                let to = [x, y, h].map(f32::from_bits);
                assert!(
                    setpoints[k] > 0 || to == at[k],
                    "it is to stay first: {to:?}"
                );
                at[k] = to;
                setpoints[k] += 1;
            }
            there[k] = at[k].map(f32::to_bits) == expected[k][..3];
            let x_m = at.map(|at| at[0]);
            assert!(x_m[1] - x_m[0] >= 4.0, "{at:?}");
        }
        assert!(began.elapsed() < 2 * LIMIT, "{at:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn invalid_position_lines_are_counted_and_logged_once() {
    let files = Files::new();
    let fifo = files.fifo("positions");
    let mut relay = Relay::start(&format!("--index 1 --of 1 --positions {fifo}"));
    relay.line("converged: ");
    let long = "1 ".repeat(10_000);
    write(
        &fifo,
        &format!("x y z\n\n1 2\n1 2 3 4\n1 2 NaN\n1 2 inf\n{long}\n"),
    );
    relay.line(
        "position: invalid line \"x y z\" in --positions is ignored: \"x\" is not a number; a valid line is one of `x_m y_m altitude_m`, `endurance SECONDS HOME` (remaining time of flight, and time of the way home, both in s); ",
    );
    // A line that arrives in pieces: each piece alone would be counted as an invalid line.
    write(&fifo, "900 0");
    write(&fifo, " 20\nnonsense\n");
    relay.line("setpoint: ");
    let said = relay.stopped();
    let times = |part: &str| said.iter().filter(|line| line.contains(part)).count();
    assert_eq!(times("a valid line is one of `x_m"), 1, "{said:?}");
    assert!(
        times("position: 8 lines of --positions were invalid") > 0,
        "{said:?}"
    );
}

#[test]
fn a_path_that_is_not_a_fifo_is_refused() {
    let files = Files::new();
    let file = files.write("file", "1 2 3\n");
    for (path, why) in [
        (file, "is not a FIFO: make one with mkfifo"),
        (files.text("none"), "No such file"),
    ] {
        let line = Relay::start(&format!("--index 1 --of 1 --positions {path}")).refused(1);
        assert!(line.contains(&path) && line.contains(why), "{line}");
    }
}
