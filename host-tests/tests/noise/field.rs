//! Noise in a field: quality of the bound on E[1 / (I + N)], and its use by a chain.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::mission::MissionError;
use uav_relay::optimiser::plan;
use uav_relay::{Field, FieldPoint, Interference, Mission, MissionConfig, Schedule, sir};
use uav_relay_oracle::random::{self, log_uniform};
use uav_relay_sim::report::place;

/// Returns E[f(u)] of u = I / I_max with a Beta distribution, by a sum over a grid.
fn mean(alpha: f64, beta: f64, f: impl Fn(f64) -> f64) -> f64 {
    // u = 1 / (1 + e^-z): the density in z is proportional to u^alpha (1 - u)^beta.
    let (mut sum, mut weight) = (0.0, 0.0);
    for step in -40_000..=40_000 {
        let z = f64::from(step) * 1e-3;
        let u = 1.0 / (1.0 + (-z).exp());
        let rest = 1.0 / (1.0 + z.exp());
        let density = (alpha * u.ln() + beta * rest.ln()).exp();
        sum += density * f(u);
        weight += density;
    }
    sum / weight
}

/// Checks that E[1 / (I + N)] is at most the crate's bound and at least 1 / (E[I] + N). I is the interference power,
/// N the noise power.
#[test]
fn noise_in_a_field_is_bounded_from_above() {
    let mut worst = Vec::new();
    for alpha in [1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 50.0] {
        let mut most = (0.0, 0.0);
        for beta in [0.5, 1.0, 2.0, 5.0, 20.0] {
            // I_max = 1.
            let upsilon = (alpha + beta - 1.0) / (alpha - 1.0);
            let mean_i = alpha / (alpha + beta);
            for part in [1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0] {
                let noise = part / upsilon;
                let exact = mean(alpha, beta, |u| 1.0 / (u + noise));
                let bound = 1.0 / (1.0 / upsilon + noise);
                let below = 1.0 / (mean_i + noise);
                assert!(
                    below <= exact * (1.0 + 1e-6) && exact <= bound * (1.0 + 1e-6),
                    "{alpha} {beta} {noise}: {below} {exact} {bound}"
                );
                if bound / exact > most.0 {
                    most = (bound / exact, part);
                }
            }
        }
        worst.push((alpha, most.0));
    }
    println!("alpha, and how many times the true E[1 / (I + N)] the bound is at most: {worst:.3?}");
    // I varies less for larger alpha.
    assert!(
        worst.windows(2).all(|pair| pair[1].1 <= pair[0].1),
        "{worst:?}"
    );
}

fn mission(points: &[(f32, f32)], noise_w: f32, relays: u16) -> Result<Mission, MissionError> {
    let points: Vec<FieldPoint> = points
        .iter()
        .map(|&(x_m, upsilon_per_w)| FieldPoint { x_m, upsilon_per_w })
        .collect();
    Mission::try_new(MissionConfig {
        interference: Interference::Field(Field::try_new(points.leak()).unwrap()),
        noise_w,
        ..*host_tests::fixtures::mission(relays).config()
    })
}

/// Checks that noise power N acts as if each Upsilon = E[1/I] were Upsilon / (1 + N Upsilon).
#[test]
fn a_chain_in_a_noisy_field_follows_its_table() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1131));
    for round in 0..300 {
        let noise_w = log_uniform(&mut rng, 1e-13, 1e-8) as f32;
        let mut x_m = 0.0;
        let table: Vec<(f32, f32)> = (0..rng.random_range(1..8))
            .map(|_| {
                x_m += rng.random_range(50.0..400.0_f32);
                (x_m, log_uniform(&mut rng, 1e7, 1e12) as f32)
            })
            .collect();
        let of = |&(x_m, upsilon): &(f32, f32)| {
            let wide = f64::from(upsilon);
            (x_m, (wide / (1.0 + f64::from(noise_w) * wide)) as f32)
        };
        let told: Vec<(f32, f32)> = table.iter().map(of).collect();
        let relays = rng.random_range(1..12);
        let (noisy, told) = (
            mission(&table, noise_w, relays),
            mission(&told, 0.0, relays),
        );
        let [noisy, told] = [noisy.unwrap(), told.unwrap()];
        let common = noisy.config().common;
        let [of_noise, of_table] = [noisy, told]
            .map(|mission| plan::solve(&mission, Schedule::Bracketed, |_| common).unwrap());
        let apart = (of_noise.target / of_table.target - 1.0).abs();
        assert!(apart < 2e-4, "{round}: {of_noise:?} {of_table:?}");
        let places = |mission: &Mission, target: f32| -> Vec<f32> {
            (1..=relays)
                .map(|index| place(mission, target, index, |_| common).unwrap().x_m)
                .collect()
        };
        let first = places(&noisy, of_noise.target);
        let at = uav_relay::Placement::on_line(first[0], common.altitude_m);
        let quiet = [&noisy, &told].map(|mission| sir::quiet(mission, at));
        assert!(
            (quiet[0] / quiet[1] - 1.0).abs() < 1e-5,
            "{round}: {quiet:?}"
        );
    }
}
