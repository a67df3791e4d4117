//! Missions and settings of relays from a fuzzer's bytes, within the accepted ranges, limits included.

use uav_relay::GuardConfig;
use uav_relay::channel::AirGround;
use uav_relay::{
    Adjust, Band, Channel, Duration, Field, FieldPoint, Interference, Interferer, Listen, Local,
    Measure, Method, Mission, MissionConfig, Placement, Profile, Schedule, Settings, Wiring,
};
use uav_relay::{Auth, Key};

use super::input::Input;

/// Interference along x in some missions: the same at every x.
///
/// It is a constant like the fields below, because a `Field` borrows its points until the program ends.
const EVEN: Field = Field::new(&[at(0.0, 1e8)]);
/// Interference along x in some missions: differs by less than a fifth between positions.
const UNEVEN: Field = Field::new(&[at(0.0, 4.2e5), at(600.0, 3.75e5), at(1000.0, 4.4e5)]);
/// Interference along x in some missions: changes by a factor of 10 000 within 10 m.
const STEEP: Field = Field::new(&[at(100.0, 1e7), at(300.0, 1e10), at(310.0, 1e6)]);
/// Interference along x in some missions: the weakest permitted at Tx, the strongest permitted at 1 km.
const WILD: Field = Field::new(&[at(0.0, 1e32), at(1000.0, 1e-9)]);

/// Interferer in the missions with a lateral range.
const BESIDE: Interference = Interference::Source(Interferer {
    power_w: 80.0,
    x_m: 500.0,
    y_m: 150.0,
});

/// Signing key of every fuzzed network.
pub const KEY: [u8; 32] = *b"known to whoever reads this line";

const fn at(x_m: f32, upsilon_per_w: f32) -> FieldPoint {
    FieldPoint { x_m, upsilon_per_w }
}

/// Creates a mission of 1 to `most` relays; `None` if its parameters are rejected.
///
/// Half of the missions are the paper's scenario with one change. They take few bytes of the input, so that many bytes
/// remain for operations on the relays. In the other half, every parameter is drawn from its whole range.
pub fn mission(input: &mut Input<'_>, most: u8) -> Option<Mission> {
    let drawn = input.byte();
    let (kind, variant) = (drawn % 14, drawn / 14 % 8);
    let relays = u16::from(input.below(most.max(1))) + 1;
    let config = match kind {
        6..=12 => wild(input, kind, relays)?,
        _ => tame(kind, relays)?,
    };
    let config = match (variant, config.interference) {
        // In this mission the relays do not know the interferer.
        (6, Interference::Source(_)) => MissionConfig {
            interference: Interference::Unknown,
            ..config
        },
        (7, _) => MissionConfig {
            noise_w: input.scaled(1e-30, 1.0),
            ..config
        },
        _ => config,
    };
    Mission::try_new(config).ok()
}

/// Returns the paper's scenario, changed in one way; `kind` is the number of the change.
///
/// 0 is the unchanged scenario. `None` if there is no change with this number.
fn tame(kind: u8, relays: u16) -> Option<MissionConfig> {
    let paper = MissionConfig {
        relays,
        distance_m: 1000.0,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        common: Profile {
            altitude_m: 20.0,
            power_w: 1.0,
        },
        channel: Channel::from_db(2e9, 0.1, 21.0, AirGround::Los).ok()?,
        band: Band::at(20.0),
        lateral: Band::NONE,
        interference: Interference::Source(Interferer {
            power_w: 80.0,
            x_m: 500.0,
            y_m: 400.0,
        }),
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: 80.0,
        fitted_gap: 0.0,
        tolerance: 1e-4,
    };
    Some(match kind {
        0 => paper,
        1 => MissionConfig {
            band: Band {
                least_m: 20.0,
                most_m: 300.0,
            },
            ..paper
        },
        2 => MissionConfig {
            min_separation_m: 990.0 / f32::from(relays),
            ..paper
        },
        3 => MissionConfig {
            interference: Interference::Field(EVEN),
            ..paper
        },
        4 => MissionConfig {
            interference: Interference::Field(UNEVEN),
            ..paper
        },
        5 => MissionConfig {
            interference: Interference::Field(STEEP),
            ..paper
        },
        // The mission has a range of altitudes, and a lateral range to the left and right.
        _ => MissionConfig {
            band: Band {
                least_m: 20.0,
                most_m: 300.0,
            },
            lateral: Band {
                least_m: -280.0,
                most_m: 280.0,
            },
            interference: BESIDE,
            ..paper
        },
    })
}

fn wild(input: &mut Input<'_>, kind: u8, relays: u16) -> Option<MissionConfig> {
    let distance_m = input.scaled(1.0, 1e6);
    let (least_m, most_m) = {
        let (one, other) = (input.scaled(0.1, 1e5), input.scaled(0.1, 1e5));
        (one.min(other), one.max(other))
    };
    let separation = if input.flag() {
        input.even(0.0, distance_m.min(1e5))
    } else {
        0.0
    };
    let interference = match kind {
        9 => Interference::Field(WILD),
        10 => Interference::Field(EVEN),
        11 => Interference::Field(STEEP),
        _ => Interference::Source(interferer(input, distance_m)),
    };
    let lateral = if kind == 12 {
        Band {
            least_m: -input.scaled(1e-3, 1e5),
            most_m: input.scaled(1e-3, 1e5),
        }
    } else {
        Band::NONE
    };
    Some(MissionConfig {
        relays,
        distance_m,
        min_separation_m: separation,
        tx_power_w: input.scaled(1e-6, 1e6),
        common: Profile {
            altitude_m: input.even(least_m, most_m),
            power_w: input.scaled(1e-6, 1e6),
        },
        channel: channel(input)?,
        band: Band { least_m, most_m },
        lateral,
        interference,
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: 80.0,
        fitted_gap: 0.0,
        tolerance: input.scaled(1e-6, 0.1),
    })
}

/// Reads a drone's position: at any altitude, mostly between Tx and Rx and in the lateral range.
pub fn place(input: &mut Input<'_>, config: &MissionConfig) -> Placement {
    Placement {
        x_m: input.mostly(|input| input.even(0.0, config.distance_m)),
        y_m: aside(input, config.lateral),
        altitude_m: input.mostly(|input| input.scaled(0.1, 1e5)),
    }
}

/// Reads a lateral position, m, inside or outside of the mission's lateral range; 0 without a range.
pub fn aside(input: &mut Input<'_>, lateral: Band) -> f32 {
    if lateral.is_single() {
        0.0
    } else {
        input.mostly(|input| 1.5 * input.even(lateral.least_m, lateral.most_m))
    }
}

/// Reads an interferer: x is between Tx and Rx, at Rx or outside, and y is 0 or not.
///
/// `distance_m` is the distance from Tx to Rx, m.
fn interferer(input: &mut Input<'_>, distance_m: f32) -> Interferer {
    let power_w = input.scaled(1e-6, 1e9);
    let x_m = match input.below(4) {
        0 => input.even(0.0, distance_m),
        1 => input.even(-distance_m, 2.0 * distance_m),
        2 => input.even(-1e7, 1e7),
        _ => distance_m,
    };
    let y_m = match input.below(4) {
        0 => 0.0,
        1 => input.scaled(1e-3, distance_m),
        2 => -input.scaled(1e-3, distance_m),
        _ => input.even(-1e7, 1e7),
    };
    Interferer { power_w, x_m, y_m }
}

fn channel(input: &mut Input<'_>) -> Option<Channel> {
    let carrier_hz = f64::from(input.scaled(1e6, 1e12)).clamp(1e6, 1e12);
    let (one, other) = (input.even(0.0, 200.0), input.even(0.0, 200.0));
    let air_ground = match input.below(3) {
        0 => AirGround::Los,
        1 => AirGround::Nlos,
        _ => AirGround::Weighted(f64::from(input.even(0.0, 1.0))),
    };
    let (los, nlos) = (one.min(other), one.max(other));
    Channel::from_db(carrier_hz, los.into(), nlos.into(), air_ground).ok()
}

/// Reads the settings of one relay of `mission`. `chain` has the settings that all relays of the chain share.
pub fn settings(input: &mut Input<'_>, mission: &Mission, chain: Settings) -> Settings {
    let own = input.byte();
    let profile = (own % 4 == 1).then(|| Profile {
        altitude_m: input.scaled(0.1, 1e5),
        power_w: input.scaled(1e-6, 1e6),
    });
    let measures = own / 16 % 2 == 1 && mission.field().is_some();
    let guard = (own / 32 == 1).then(|| GuardConfig {
        hover_m: f32::from(input.below(4)),
        lag: Duration::from_millis(u64::from(input.byte())),
        ..GuardConfig::of(mission, profile.unwrap_or(mission.config().common))
    });
    Settings {
        profile,
        guard,
        hold_altitude: own / 4 % 4 == 1,
        measure: measures.then(|| Measure {
            i_max_w: input.scaled(1e-30, 1e6),
            samples: 100 + u32::from(input.below(8)),
        }),
        ..chain
    }
}

/// Reads the settings that all relays of a chain share.
pub fn of_chain(input: &mut Input<'_>, mission: &Mission) -> Settings {
    let how = input.byte();
    let method = match how % 4 {
        1 if mission.interferer().is_some() => Method::Joint,
        2 if mission.interferer().is_some() => Method::Adjust(adjust(input)),
        _ => Method::Align,
    };
    let unknown = mission.config().interference == Interference::Unknown;
    let listen = (unknown || how % 4 == 3 && mission.field().is_none()).then(|| {
        if (how / 4).is_multiple_of(2) {
            Listen::default()
        } else {
            Listen::following(mission.relays())
        }
    });
    let schedule = if how / 4 % 8 == 1 {
        Schedule::FixedStep {
            step: f64::from(input.scaled(1e-6, 1e6)),
        }
    } else {
        Schedule::Bracketed
    };
    let auth = matches!(how / 4 % 8, 2 | 3).then(|| Auth {
        key: Key::new(KEY),
        epoch: 1,
    });
    Settings {
        method,
        schedule,
        auth,
        listen,
        predict: how / 32 % 2 != 1,
        wiring: if how / 64 % 2 == 1 {
            Wiring::Shared
        } else {
            Wiring::Pair
        },
        hop_time: if how / 128 == 0 {
            Duration::from_millis(30)
        } else {
            Duration::from_millis(5)
        },
        ..Settings::default()
    }
}

fn adjust(input: &mut Input<'_>) -> Adjust {
    let grid = input.byte();
    Adjust {
        rounds: u16::from(input.below(4)),
        explore_m: input.even(0.0, 1e5),
        local: if grid % 2 == 1 {
            Local::Grid {
                columns: 2 + grid / 16,
                rows: 2 + input.below(32),
            }
        } else {
            Local::Fine
        },
    }
}
