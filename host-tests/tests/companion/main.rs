//! Linux companion and ground station as processes on pseudo-terminals. Their chain is compared with the simulated one.
#![cfg(target_os = "linux")]

mod acting;
mod astray;
mod battery;
mod bench;
mod binary;
mod bundle;
mod captured;
mod chain;
mod change;
mod cleared;
mod datagrams;
mod faults;
mod file;
mod files;
mod flying;
mod idle;
mod listening;
mod mavsdk;
mod medium;
mod mistrust;
mod moved;
mod numbered;
mod options;
mod peer;
mod positions;
mod process;
mod pty;
mod reported;
mod signed;
mod soak;
mod stand;
mod stays;
mod systemd;
mod unanswered;
mod unplugged;
mod upload;
mod views;
mod web;
mod words;

use std::time::{Duration, Instant};

use chain::{Chain, simulated, simulated_by};
use medium::{Medium, Noise, QUIET};
use process::Relay;
use pty::Pty;
use rustix::process::Signal;
use uav_relay::{Adjust, Method};
use uav_relay_scenario::{BetaPoint, Field, Interference, Scenario, Source};

/// Returns the default scenario with one interferer of the given power and position.
fn with_source(power_w: f64, x_m: f64, y_m: f64) -> Scenario {
    let source = Source { power_w, x_m, y_m };
    Scenario {
        interference: Interference::Sources(vec![source]),
        ..Scenario::default()
    }
}

#[test]
fn three_processes_settle_like_the_simulation() {
    let mut chain = Chain::start(3, "");
    assert_eq!(chain.settled(), simulated(&Scenario::default(), 3));
    for (relay, signal) in chain
        .relays
        .into_iter()
        .zip([Signal::TERM, Signal::INT, Signal::TERM])
    {
        relay.signal(signal);
        let last = relay.succeeds().pop().unwrap();
        assert!(last.contains("stopped: relay "), "{last}");
    }
}

#[test]
fn every_option_of_the_mission_reaches_the_relays() {
    let scenario = Scenario {
        distance_m: 2345.6,
        altitude_m: 33.3,
        altitude_min_m: 22.2,
        altitude_max_m: 44.4,
        min_separation_m: 7.5,
        tx_w: 12.25,
        uav_w: 0.7,
        ..with_source(55.5, 987.6, -321.0)
    };
    let geometry = "--distance 2345.6 --altitude 33.3 --band 22.2,44.4 --min-separation 7.5";
    let power = "--tx-power 12.25 --uav-power 0.7 --interferer 55.5,987.6,-321";
    let mut chain = Chain::start(
        4,
        &format!("{geometry} {power} --baud 57600 --network 4711"),
    );
    for line in chain.lines("started: ") {
        assert!(line.contains("network 4711, "), "{line}");
    }
    let expected = simulated(&scenario, 4);
    assert_eq!(chain.settled(), expected);
    assert_ne!(expected, simulated(&Scenario::default(), 4));
}

/// Checks that relay processes choose the same altitudes as the relays of the simulated chain.
///
/// The relays start above their best altitudes.
#[test]
fn three_processes_choose_the_altitudes_of_the_simulated_chain() {
    let scenario = Scenario {
        altitude_m: 60.0,
        altitude_max_m: 300.0,
        ..with_source(80.0, 500.0, 150.0)
    };
    let adjust = Method::Adjust(Adjust::default());
    for (name, method) in [("joint", Method::Joint), ("adjust", adjust)] {
        let expected = simulated_by(method, &scenario, 3);
        let before = 60.0_f32.to_bits();
        assert!(
            expected
                .iter()
                .all(|[_, _, altitude, _]| *altitude != before)
        );
        let options = "--altitude 60 --band 20,300 --interferer 80,500,150 --method";
        Chain::start(3, &format!("{options} {name}")).settles_at(&expected);
    }
}

#[test]
fn three_relays_in_a_field_settle_like_the_simulation() {
    // Upsilon is (1 + beta) / I_max for alpha = 2.
    let beta = [(-50.0, 1.5), (400.0, 1.0), (1000.0, 3.0)];
    let beta = beta.map(|(x_m, beta)| BetaPoint {
        x_m,
        alpha: 2.0,
        beta,
    });
    let scenario = Scenario {
        interference: Interference::Field(Field {
            i_max_w: 1e-6,
            beta: beta.to_vec(),
        }),
        ..Scenario::default()
    };
    let mut chain = Chain::start(3, "--field -50:2.5e6,400:2e6,1000:4e6");
    assert_eq!(chain.settled(), simulated(&scenario, 3));
}

#[test]
fn the_tty_is_set_to_the_speed_asked_for() {
    let pty = Pty::new();
    // The last one is no standard rate.
    for baud in [1_200, 57_600, 115_200, 250_000] {
        let path = pty.path().display();
        let mut relay = Relay::start(&format!(
            "--index 1 --of 2 --downstream {path} --baud {baud}"
        ));
        relay.line("started: ");
        assert_eq!(pty.baud(), baud);
    }
}

/// Function that creates a chain on serial wires or on a shared channel, with the given noise.
type Media = fn(Noise) -> Chain;

#[test]
fn over_noisy_media_the_positions_are_the_same() {
    let expected = simulated(&Scenario::default(), 3);
    let kinds: [(Media, &[Noise]); 2] = [
        (
            |noise| Chain::on_wires(3, noise),
            &[1, 2, 3, 4].map(Noise::bad),
        ),
        (
            |noise| Chain::on_channel(3, Medium::new(3, noise)),
            &[QUIET, Noise::bad(5), Noise::bad(6), Noise::bad(7)],
        ),
    ];
    for (start, noises) in kinds {
        let mut faults = [0; 2];
        for &noise in noises {
            let mut chain = start(noise).started("");
            assert_eq!(chain.settled(), expected, "{noise:?}");
            chain
                .media
                .iter()
                .for_each(|medium| medium.count(&mut faults));
        }
        let [lost, corrupted] = faults;
        println!("{lost} bytes lost, {corrupted} changed");
        assert!(lost > 0 && corrupted > 0, "{lost}, {corrupted}");
    }
}

#[test]
fn a_killed_process_is_noticed_and_comes_back() {
    let mut chain = Chain::start(3, "--probe-after-ms 400 --dead-after-ms 1200");
    let settled = chain.settled();
    let killed = Instant::now();
    // A dropped relay is killed.
    drop(chain.relays.remove(1));
    chain.relays[0].line("lost: relay 2 downstream (toward Rx) does not reply");
    let first = killed.elapsed();
    chain.relays[1].line("lost: relay 2 upstream (toward Tx) does not reply");
    let took = killed.elapsed();
    println!(
        "noticed after {} and {} ms",
        first.as_millis(),
        took.as_millis()
    );
    // The loss is reported after eight times `dead_after` at the latest, however long a busy machine delays the processes.
    assert!(took < Duration::from_secs(10), "{took:?}");

    let mut again = chain.relay(2, "");
    chain.relays[0].line("back: relay 2 is now the neighbour downstream");
    chain.relays[1].line("back: relay 2 is now the neighbour upstream");
    // The chain has requested a view since its lease expired: the returning relay gets its position with that view.
    assert_eq!(again.settled(), settled[1]);
    drop(chain.relays.remove(0));
    assert_eq!(chain.relay(1, "").settled(), settled[0]);
}

#[test]
fn neighbours_with_different_missions_report_it() {
    let chain = Chain::on_wires(2, QUIET);
    let mut first = chain.relay(1, "");
    let mut second = chain.relay(2, "--altitude 21");
    second.line(
        "mismatch: relay 1 has another mission than this relay (digest of this relay's mission: 0x",
    );
    assert!(!second.has_printed("setpoint") && !first.has_printed("setpoint"));
}
