//! Linux companion and ground station as processes on pseudo-terminals. Their chain is compared with the simulated one.
#![cfg(target_os = "linux")]

mod astray;
mod bench;
mod binary;
mod captured;
mod change;
mod cleared;
mod datagrams;
mod ending;
mod file;
mod flying;
mod hub;
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
mod signed;
mod soak;
mod stand;
mod stays;
mod systemd;
mod unanswered;
mod unplugged;
mod upload;
mod views;
mod words;

use std::time::{Duration, Instant};

use medium::{Medium, Noise, QUIET};
use process::{Ended, Relay};
use pty::Pty;
use rustix::process::Signal;
use uav_relay::{Adjust, Method};
use uav_relay_scenario::mission;
use uav_relay_scenario::{BetaPoint, Field, Interference, Scenario, Source};
use uav_relay_sim::simulator::chain;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

/// Returns the bits of x, y, altitude and target of every relay of the simulated chain.
fn simulated(scenario: &Scenario, relays: u16) -> Vec<[u32; 4]> {
    simulated_by(Method::Align, scenario, relays)
}

fn simulated_by(method: Method, scenario: &Scenario, relays: u16) -> Vec<[u32; 4]> {
    let (mission, _) = mission::mission(scenario, relays, 1e-4).unwrap();
    let mut setup = Setup::new(mission);
    setup.settings.method = method;
    let outcome = chain::run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    let ends = outcome.relays.iter().map(|relay| {
        let place = relay.setpoint.unwrap();
        [
            place.x_m,
            place.y_m,
            place.altitude_m,
            relay.target.unwrap(),
        ]
        .map(f32::to_bits)
    });
    ends.collect()
}

/// Relays 1 to N and the N - 1 wires between them.
struct Chain {
    wires: Vec<Medium>,
    relays: Vec<Relay>,
    options: Vec<String>,
}

impl Chain {
    fn start(relays: usize, noise: Noise, options: &[&str]) -> Self {
        let mut chain = Self::of_wires(relays, noise);
        chain.options = options.iter().map(ToString::to_string).collect();
        chain.relays = (1..=relays).map(|index| chain.relay(index)).collect();
        chain
    }

    /// Creates the wires, without relays.
    fn of_wires(relays: usize, noise: Noise) -> Self {
        let wire = |index: usize| Noise {
            seed: noise.seed * 100 + u64::try_from(index).unwrap(),
            ..noise
        };
        Self {
            wires: (1..relays)
                .map(|index| Medium::new(2, wire(index)))
                .collect(),
            relays: Vec::new(),
            options: Vec::new(),
        }
    }

    fn relay(&self, index: usize) -> Relay {
        let (number, of) = (index.to_string(), (self.wires.len() + 1).to_string());
        let mut arguments = vec!["--index", &number, "--of", &of];
        if index > 1 {
            arguments.extend(["--upstream", self.wires[index - 2].tty(1)]);
        }
        if let Some(wire) = self.wires.get(index - 1) {
            arguments.extend(["--downstream", wire.tty(0)]);
        }
        arguments.extend(self.options.iter().map(String::as_str));
        Relay::start(&arguments)
    }

    fn settled(&mut self) -> Vec<[u32; 4]> {
        self.relays.iter_mut().map(Relay::settled).collect()
    }
}

#[test]
fn three_processes_settle_where_the_simulated_chain_does() {
    let mut chain = Chain::start(3, QUIET, &[]);
    assert_eq!(chain.settled(), simulated(&Scenario::default(), 3));
    for relay in chain.relays {
        relay.signal(Signal::TERM);
        let Ended {
            status,
            stdout,
            stderr,
        } = relay.end();
        assert_eq!((status, stderr), (Some(0), Vec::new()));
        let last = stdout.last().unwrap();
        assert!(last.contains("stopped: "), "{last}");
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
        interference: Interference::Sources(vec![Source {
            power_w: 55.5,
            x_m: 987.6,
            y_m: -321.0,
        }]),
        ..Scenario::default()
    };
    let options = [
        "--distance",
        "2345.6",
        "--altitude",
        "33.3",
        "--band",
        "22.2,44.4",
        "--min-separation",
        "7.5",
        "--tx-power",
        "12.25",
        "--uav-power",
        "0.7",
        "--interferer",
        "55.5,987.6,-321",
        "--baud",
        "57600",
        "--network",
        "4711",
    ];
    let mut chain = Chain::start(4, QUIET, &options);
    for relay in &mut chain.relays {
        assert!(relay.line("started: ").contains("network 4711, "));
    }
    let expected = simulated(&scenario, 4);
    assert_eq!(chain.settled(), expected);
    assert_ne!(expected, simulated(&Scenario::default(), 4));
}

/// Starts the relays above their best altitudes.
#[test]
fn three_processes_choose_the_altitudes_of_the_simulated_chain() {
    let scenario = Scenario {
        altitude_m: 60.0,
        altitude_max_m: 300.0,
        interference: Interference::Sources(vec![Source {
            power_w: 80.0,
            x_m: 500.0,
            y_m: 150.0,
        }]),
        ..Scenario::default()
    };
    let given = ["--altitude", "60", "--band", "20,300"];
    let options = [&given[..], &["--interferer", "80,500,150", "--method"]].concat();
    let adjust = Method::Adjust(Adjust::default());
    for (name, method) in [("joint", Method::Joint), ("adjust", adjust)] {
        let expected = simulated_by(method, &scenario, 3);
        let before = 60.0_f32.to_bits();
        assert!(
            expected
                .iter()
                .all(|[_, _, altitude, _]| *altitude != before)
        );
        let mut chain = Chain::start(3, QUIET, &[&options[..], &[name]].concat());
        for (relay, expected) in chain.relays.iter_mut().zip(expected) {
            relay.settles_at(expected);
        }
    }
}

#[test]
fn three_processes_in_a_field_settle_where_the_simulated_chain_does() {
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
    let options = ["--field", "-50:2.5e6,400:2e6,1000:4e6"];
    let mut chain = Chain::start(3, QUIET, &options);
    assert_eq!(chain.settled(), simulated(&scenario, 3));
}

#[test]
fn the_tty_is_set_to_the_speed_asked_for() {
    let pty = Pty::new();
    let path = pty.path().to_str().unwrap();
    // The last one is no standard rate.
    for baud in [1_200, 57_600, 115_200, 250_000] {
        let text = baud.to_string();
        let mut relay = Relay::start(&[
            "--index",
            "1",
            "--of",
            "2",
            "--downstream",
            path,
            "--baud",
            &text,
        ]);
        relay.line("started: ");
        assert_eq!(pty.baud(), baud);
    }
}

#[test]
fn over_wires_that_lose_and_change_bytes_they_settle_at_the_same_places() {
    let expected = simulated(&Scenario::default(), 3);
    let mut faults = [0; 2];
    for seed in 1..=4 {
        let mut chain = Chain::start(3, Noise::bad(seed), &[]);
        assert_eq!(chain.settled(), expected, "seed {seed}");
        chain.wires.iter().for_each(|wire| wire.count(&mut faults));
    }
    let [lost, corrupted] = faults;
    println!("{lost} bytes lost, {corrupted} changed");
    assert!(lost > 0 && corrupted > 0, "{lost}, {corrupted}");
}

#[test]
fn on_one_shared_channel_they_settle_at_the_same_places() {
    let expected = simulated(&Scenario::default(), 3);
    let mut faults = [0; 2];
    for noise in [QUIET, Noise::bad(5), Noise::bad(6), Noise::bad(7)] {
        let channel = Medium::new(3, noise);
        let start = |index: usize| {
            let number = index.to_string();
            Relay::start(&[
                "--index",
                &number,
                "--of",
                "3",
                "--shared",
                channel.tty(index - 1),
            ])
        };
        let mut relays: Vec<Relay> = (1..=3).map(start).collect();
        let settled: Vec<_> = relays.iter_mut().map(Relay::settled).collect();
        assert_eq!(settled, expected, "{noise:?}");
        channel.count(&mut faults);
    }
    let [lost, corrupted] = faults;
    println!("{lost} bytes lost, {corrupted} changed");
    assert!(lost > 0 && corrupted > 0, "{lost}, {corrupted}");
}

#[test]
fn a_killed_process_is_noticed_by_both_neighbours_and_so_is_its_return() {
    let mut chain = Chain::start(
        3,
        QUIET,
        &["--probe-after-ms", "400", "--dead-after-ms", "1200"],
    );
    let settled = chain.settled();
    let killed = Instant::now();
    // A dropped relay is killed.
    drop(chain.relays.remove(1));
    chain.relays[0].line("lost: relay 2 downstream does not reply");
    let first = killed.elapsed();
    chain.relays[1].line("lost: relay 2 upstream does not reply");
    let took = killed.elapsed();
    println!(
        "noticed after {} and {} ms",
        first.as_millis(),
        took.as_millis()
    );
    // The loss is reported after eight times `dead_after` at the latest, however long a busy machine delays the processes.
    assert!(took < Duration::from_secs(10), "{took:?}");

    let mut again = chain.relay(2);
    chain.relays[0].line("back: relay 2 downstream");
    chain.relays[1].line("back: relay 2 upstream");
    // The chain has requested a view since its lease expired: the returning relay gets its position with that view.
    assert_eq!(again.settled(), settled[1]);
    drop(chain.relays.remove(0));
    let mut head = chain.relay(1);
    assert_eq!(head.settled(), settled[0]);
}

#[test]
fn neighbours_with_different_missions_say_so() {
    let wire = Medium::new(2, QUIET);
    let mut first = Relay::start(&["--index", "1", "--of", "2", "--downstream", wire.tty(0)]);
    let altitude = ["--altitude", "21"];
    let mut second = Relay::start(
        &[
            &["--index", "2", "--of", "2", "--upstream", wire.tty(1)][..],
            &altitude,
        ]
        .concat(),
    );
    second.line("mismatch: relay 1 flies another mission than 0x");
    assert!(!second.has_said("setpoint") && !first.has_said("setpoint"));
}
