//! Scenes with a way back: those of the feature's specification, and ones that are hard.

use rand::{Rng, RngExt};
use uav_relay::channel::AirGround;
use uav_relay::{
    Band, Channel, Field, FieldPoint, Interference, Interferer, Mission, MissionConfig, Profile,
};

use super::judge::Chain;

/// Path-loss factor of free space at 2 GHz, 1/m^2.
pub(crate) const LOS: f64 = 7_020.0;
/// Path-loss factor on the ground, 1/m^2: 20.9 dB above that of free space.
pub(crate) const NLOS: f64 = 7_020.0 * 123.0;

/// Pairs of the powers of Tx and Rx, W: both strong, both weak, and a strong Tx with a weak Rx.
pub(crate) const ENDS: [[f64; 2]; 3] = [[80.0, 80.0], [1.0, 1.0], [80.0, 1.0]];

/// Rounds a number to f32, the precision in which relays compute.
pub(crate) fn narrow(value: f64) -> f64 {
    f64::from(value as f32)
}

/// Draws a number from `least` to `most` whose logarithm is uniformly distributed.
pub(crate) fn log_uniform(rng: &mut impl Rng, least: f64, most: f64) -> f64 {
    rng.random_range(least.ln()..=most.ln()).exp()
}

fn carrier_hz() -> f64 {
    299_792_458.0 / (4.0 * std::f64::consts::PI)
}

/// Returns the mission that describes a reference chain.
pub(crate) fn mission(chain: &Chain) -> Mission {
    let [power_w, x_m, y_m] = chain.interferer.map(|value| value as f32);
    let points = chain.field.iter().map(|[x, upsilon]| FieldPoint {
        x_m: *x as f32,
        upsilon_per_w: *upsilon as f32,
    });
    let points: Vec<FieldPoint> = points.collect();
    let interference = if points.is_empty() {
        Interference::Source(Interferer { power_w, x_m, y_m })
    } else {
        Interference::Field(Field::try_new(points.leak()).unwrap())
    };
    Mission::try_new(MissionConfig {
        relays: chain.relays() as u16,
        distance_m: chain.distance_m as f32,
        min_separation_m: chain.apart_m as f32,
        tx_power_w: chain.powers_w[0] as f32,
        common: Profile {
            altitude_m: chain.altitude_m as f32,
            power_w: chain.powers_w[1] as f32,
        },
        band: Band::at(chain.altitude_m as f32),
        lateral: Band::NONE,
        channel: Channel::new(carrier_hz(), chain.loss[0], chain.loss[1], AirGround::Los).unwrap(),
        interference,
        noise_w: chain.noise_w as f32,
        reverse: chain.reverse as f32,
        rx_power_w: *chain.powers_w.last().unwrap() as f32,
        fitted_gap: 0.0,
        tolerance: 1e-5,
    })
    .unwrap()
}

/// Draws a scene of usual size: Tx and Rx 1 km apart, 1 to 50 relays at 20 m.
///
/// The interferer is 50 m to 800 m beside the line. `ends` are the powers of Tx and Rx, W. `reverse` is the fraction
/// of the target SIR that suffices on the way from Rx to Tx.
pub(crate) fn usual(rng: &mut impl Rng, ends: [f64; 2], reverse: f64) -> Chain {
    let relays = log_uniform(rng, 1.0, 50.99) as usize;
    let mut powers_w = vec![1.0; relays + 2];
    (powers_w[0], powers_w[relays + 1]) = (ends[0], ends[1]);
    Chain {
        distance_m: 1000.0,
        powers_w,
        altitude_m: 20.0,
        altitudes_m: Vec::new(),
        apart_m: 0.0,
        interferer: [
            narrow(log_uniform(rng, 1.0, 100.0)),
            narrow(rng.random_range(-200.0..=1200.0)),
            narrow(rng.random_range(50.0..=800.0)),
        ],
        others: Vec::new(),
        field: Vec::new(),
        loss: [LOS, NLOS],
        noise_w: 0.0,
        reverse: narrow(reverse),
    }
}

/// Draws a scene that is hard to solve: one to six relays, and the interferer close to the line.
///
/// `ends` are the powers of Tx and Rx, W. `reverse` is the fraction of the target SIR that suffices on the way from
/// Rx to Tx.
pub(crate) fn adversarial(rng: &mut impl Rng, ends: [f64; 2], reverse: f64) -> Chain {
    let mut chain = usual(rng, ends, reverse);
    let relays = rng.random_range(1..=6);
    chain.powers_w.drain(1..chain.powers_w.len() - 1);
    for _ in 0..relays {
        chain.powers_w.insert(1, 1.0);
    }
    chain.interferer = [
        narrow(log_uniform(rng, 0.3, 300.0)),
        narrow(rng.random_range(100.0..=1100.0)),
        narrow(log_uniform(rng, 1.0, 300.0)),
    ];
    chain
}

/// Draws a scene with a field of interference, given at points along the line. `kind` is 0 for the same interference everywhere, 1 for
/// random interference that varies by a factor of up to 25, and 2 for the interference of one to three interferers.
pub(crate) fn in_field(rng: &mut impl Rng, ends: [f64; 2], reverse: f64, kind: usize) -> Chain {
    let mut chain = usual(rng, ends, reverse);
    let points: usize = [1, rng.random_range(2..=9), 41][kind];
    let sources: Vec<[f64; 3]> = (0..rng.random_range(1..=3))
        .map(|_| {
            [
                log_uniform(rng, 1.0, 100.0),
                rng.random_range(-200.0..=1200.0),
                log_uniform(rng, 20.0, 800.0),
            ]
        })
        .collect();
    let heard_w = |x: f64| -> f64 {
        let each = sources
            .iter()
            .map(|[power_w, xi, yi]| power_w / (LOS * ((x - xi).powi(2) + yi * yi + 400.0)));
        each.sum()
    };
    let middle_w = heard_w(500.0);
    chain.field = (0..points)
        .map(|at| {
            let x = 1000.0 * at as f64 / (points - 1).max(1) as f64;
            let upsilon = match kind {
                0 => 1.0 / middle_w,
                1 => log_uniform(rng, 0.2, 5.0) / middle_w,
                _ => 1.0 / heard_w(x),
            };
            [narrow(x), narrow(upsilon)]
        })
        .collect();
    let quietest = chain.field.iter().min_by(|a, b| a[1].total_cmp(&b[1]));
    chain.interferer[1] = quietest.map_or(500.0, |point| point[0]);
    chain
}

/// Adds receiver noise to a scene: 1e-3 to 1e2 times the interference power at a random position.
///
/// The position is on the line from Tx to Rx.
pub(crate) fn in_noise(rng: &mut impl Rng, chain: Chain) -> Chain {
    let place = rng.random_range(0.0..=chain.distance_m);
    let [power_w, x, y] = chain.interferer;
    let heard_w = power_w / LOS / ((place - x).powi(2) + y * y + 400.0);
    Chain {
        noise_w: narrow(heard_w * log_uniform(rng, 1e-3, 1e2)),
        ..chain
    }
}
