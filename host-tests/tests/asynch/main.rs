//! Relays on asynchronous ports in virtual time, including ports that block, fail, or are always ready.

mod autopilot;
mod chain;
mod ports;
mod time;
mod wire;

use chain::{Flown, fly, setpoints};
use host_tests::bench::agreed;
use host_tests::fixtures;
use uav_relay::serial::SerialStats;
use uav_relay::{Event, Instant, Mission, Port, Side, Wiring};
use wire::WriterFault;

const END: Instant = Instant::from_millis(20_000);

#[test]
fn five_async_relays_settle_like_bare_relays() {
    let expected = agreed(Mission::try_new(fixtures::paper(5)).unwrap());
    for wiring in [Wiring::Pair, Wiring::Shared] {
        for capacity in [1, 16, 1_000] {
            let flown = fly(wiring, 5, capacity, None, END);
            assert_eq!(setpoints(&flown), expected, "{wiring:?} {capacity}");
            for drone in &flown.drones {
                assert_eq!(drone.rejected, 0, "{wiring:?} {capacity}");
                assert_eq!(drone.counted, [SerialStats::default(); 2]);
            }
        }
    }
}

/// Checks that each code block of the guide that names a file is a part of that file. `cargo ci` builds these files.
#[test]
fn the_guide_has_the_code_of_this_test() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |name: &str| std::fs::read_to_string(root.join(name)).unwrap();
    let guide = read("src/docs/firmware.md");
    let mut shown = std::collections::BTreeSet::new();
    for part in guide.split("<!-- ").skip(1) {
        let (name, rest) = part.split_once(" -->\n```").unwrap();
        let (language, rest) = rest.split_once('\n').unwrap();
        let block = rest.split("```").next().unwrap();
        // Lines with `# ` are in the documentation test only.
        let visible = |line: &&str| !line.starts_with("# ");
        let block: String = if language.is_empty() {
            (block.split_inclusive('\n').filter(visible)).collect()
        } else {
            block.to_owned()
        };
        assert!(
            read(name).contains(&block),
            "{name} has no such part: {block}"
        );
        shown.insert(name.to_owned());
    }
    let ignored = guide.matches("```rust,ignore").count();
    let named = guide.matches(".rs -->\n```rust,ignore").count();
    assert_eq!(
        ignored, named,
        "what is not compiled is a part of a file that is"
    );
    for (template, files) in [
        (
            "common",
            &[
                "memory.x",
                "build.rs",
                ".cargo/config.toml",
                "src/mission.rs",
            ][..],
        ),
        ("blocking", &["Cargo.toml", "src/main.rs"]),
        ("rtic", &["Cargo.toml", "src/main.rs"]),
        ("embassy", &["Cargo.toml", "src/main.rs"]),
    ] {
        for file in files {
            let name = format!("examples/templates/{template}/{file}");
            assert!(shown.contains(&name), "the guide does not show {name}");
        }
    }
}

/// Returns the indices of the serial lines on which the frames or their times differ between two runs.
fn differing(one: &Flown, other: &Flown) -> Vec<usize> {
    let lines = one.lines.iter().zip(&other.lines);
    let all = lines.enumerate().filter(|(_, (one, other))| one != other);
    all.map(|(at, _)| at).collect()
}

/// Checks that a blocked port of one relay delays no frame of any other port, not even by 1 µs.
///
/// The frames are compared with those of a run in which the same port loses its bytes and does not block.
#[test]
fn a_stuck_port_delays_no_other_port() {
    let until = Instant::from_millis(60_000);
    for (port, line) in [(Port::Upstream, 5 + 3), (Port::Downstream, 3)] {
        let [stuck, cut] = [WriterFault::Stuck, WriterFault::Cut]
            .map(|fault| fly(Wiring::Pair, 5, 16, Some((3, port, fault)), until));
        assert_eq!(differing(&stuck, &cut), [line], "{port:?}");
        assert!(stuck.lines[line].is_empty() && cut.lines[line].len() > 10);
        let frames: usize = stuck.lines.iter().map(Vec::len).sum();
        println!(
            "{port:?} of relay 3 stuck: {frames} frames elsewhere, none at another microsecond"
        );
        assert!(frames > 500, "{frames}");
        for (stuck, cut) in stuck.drones.iter().zip(&cut.drones) {
            assert_eq!((&stuck.events, stuck.setpoint), (&cut.events, cut.setpoint));
        }
        // The relay still receives at the blocked port, but its neighbour there does not receive it.
        let lost = |drone: usize, side| {
            let mut events = stuck.drones[drone].events.iter();
            events.any(
                |(_, event)| matches!(event, Event::NeighbourLost { side: at, .. } if *at == side),
            )
        };
        let (deaf, side) = match port {
            Port::Upstream => (1, Side::Downstream),
            _ => (3, Side::Upstream),
        };
        assert!(lost(deaf, side), "{port:?}: nobody has missed it");
        let well = match port {
            Port::Upstream => Side::Downstream,
            _ => Side::Upstream,
        };
        assert!(!lost(2, well), "{port:?}: the other neighbour is there");
        let dropped = stuck.drones[2].counted.map(|stats| stats.dropped);
        let at = usize::from(port == Port::Downstream);
        assert!(dropped[at] > 0 && dropped[1 - at] == 0, "{dropped:?}");
    }
}

#[test]
fn a_stuck_radio_delays_no_other_on_its_channel() {
    let until = Instant::from_millis(60_000);
    let stuck = fly(
        Wiring::Shared,
        5,
        16,
        Some((3, Port::Shared, WriterFault::Stuck)),
        until,
    );
    assert!(
        stuck.drones[2].counted[0].dropped == 0,
        "frames wait in the relay"
    );
    let places = setpoints(&stuck);
    assert!(
        [0, 1, 3, 4].iter().all(|at| places[*at].is_some()),
        "{places:?}"
    );
    let reformed = |drone: usize| {
        let mut events = stuck.drones[drone].events.iter();
        events.any(|(_, event)| matches!(event, Event::ViewAccepted))
    };
    assert!(
        [0, 1, 3, 4].into_iter().all(reformed),
        "the others close up"
    );
}
