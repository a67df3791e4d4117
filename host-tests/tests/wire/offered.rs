//! Random offers: valid missions with all extremes.

use proptest::prelude::*;

use super::codec::Said;
use super::offer::Offer;
use super::sited::A_KILOMETRE;

/// Draws from `least` to `most`, log-uniform, with frequent limits.
fn scaled(least: f32, most: f32) -> BoxedStrategy<f32> {
    let any_size =
        (least.log2()..=most.log2()).prop_map(move |log| log.exp2().max(least).min(most));
    prop_oneof![4 => any_size, 1 => Just(least), 1 => Just(most)].boxed()
}

/// Draws a number of relays, a distance, and a separation that fits.
fn rooms() -> BoxedStrategy<(u16, f32, f32)> {
    let relays = prop_oneof![4 => 1..=9_u16, 1 => 1..=1000_u16, 1 => Just(1), 1 => Just(1000)];
    let parts = prop_oneof![4 => 0.0..0.99_f32, 1 => Just(0.0), 1 => Just(-0.0)];
    (relays, scaled(1.0, 1e6), parts)
        .prop_map(|(relays, distance_m, part)| {
            let apart = (part * distance_m / f32::from(relays)).min(1e5);
            (relays, distance_m, apart)
        })
        .boxed()
}

/// Draws a fraction of the largest noise, often none.
fn noises() -> BoxedStrategy<f64> {
    prop_oneof![2 => Just(0.0), 2 => 0.0..=1.0_f64, 1 => Just(1.0)].boxed()
}

/// Draws path-loss factors in order.
fn factors() -> BoxedStrategy<[f64; 3]> {
    let parts = prop_oneof![4 => 0.0..=1.0_f64, 1 => Just(0.0), 1 => Just(1.0)];
    let logs = prop_oneof![4 => -3.0..=30.0_f64, 1 => Just(-3.0), 1 => Just(30.0)];
    let ratios = prop_oneof![4 => 0.0..=20.0_f64, 1 => Just(0.0), 1 => Just(20.0)];
    (logs, ratios, parts)
        .prop_map(|(log, ratio, part)| {
            let los = 10_f64.powf(log).clamp(1e-3, 1e30);
            let nlos = (los * 10_f64.powf(ratio)).clamp(los, 1e20 * los);
            let eta = (part * los + (1.0 - part) * nlos).clamp(los, nlos);
            [los, nlos, eta]
        })
        .boxed()
}

/// Draws the limits of a band and an altitude within.
fn bands() -> BoxedStrategy<[f32; 3]> {
    let ends = prop_oneof![
        3 => (scaled(0.1, 1e5), scaled(0.1, 1e5)),
        1 => scaled(0.1, 1e5).prop_map(|altitude_m| (altitude_m, altitude_m)),
    ];
    let parts = prop_oneof![4 => 0.0..=1.0_f32, 1 => Just(0.0), 1 => Just(1.0)];
    (ends, parts)
        .prop_map(|((one, other), part)| {
            let (least, most) = (one.min(other), one.max(other));
            [
                least,
                most,
                (least + part * (most - least)).clamp(least, most),
            ]
        })
        .boxed()
}

/// Draws room on one side: none, some or the maximum.
fn room() -> BoxedStrategy<f32> {
    prop_oneof![2 => Just(0.0), 1 => Just(-0.0), 4 => scaled(0.1, 1e5)].boxed()
}

/// Draws a coordinate along or beside the line.
fn beside() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -2e3..=2e3_f32,
        1 => -1e7..=1e7_f32,
        1 => Just(-1e7),
        1 => Just(1e7),
        1 => Just(-0.0),
    ]
}

/// Draws sites: none, anywhere on earth, or a kilometre apart.
fn sites() -> BoxedStrategy<[i32; 6]> {
    let site = || {
        (
            -900_000_000..=900_000_000_i32,
            -1_800_000_000..=1_800_000_000_i32,
            any::<i32>(),
        )
    };
    let anywhere = (site(), site()).prop_map(|((a, b, c), (d, e, f))| [a, b, c, d, e, f]);
    prop_oneof![2 => Just([0; 6]), 2 => anywhere, 1 => Just(A_KILOMETRE)].boxed()
}

pub(crate) fn offers() -> BoxedStrategy<Said> {
    let versions = prop_oneof![4 => 1..9_u16, 1 => 1..=u16::MAX];
    let powers = (scaled(1e-6, 1e6), scaled(1e-6, 1e6), scaled(1e-6, 1e9));
    (
        (versions, any::<u16>(), any::<u16>()),
        rooms(),
        powers,
        (beside(), beside(), prop::bool::weighted(0.1)),
        (scaled(1e-6, 0.1), noises()),
        factors(),
        bands(),
        ((room(), room()), sites()),
    )
        .prop_map(
            |(
                (version, base, answer),
                (relays, distance_m, min_separation_m),
                (tx_power_w, power_w, interferer_w),
                (x_m, y_m, unknown),
                (tolerance, noise),
                [mu_los, mu_nlos, eta],
                [least_m, most_m, altitude_m],
                ((left_m, right_m), sites),
            )| {
                let most_w = if unknown {
                    1.0
                } else {
                    // The limit is 1e12 times the interferer's power at a metre.
                    (9e11 * f64::from(interferer_w) / eta).min(1.0)
                };
                let [interferer_w, x_m, y_m] = if unknown {
                    [0.0; 3]
                } else {
                    [interferer_w, x_m, y_m]
                };
                Said::Offer(Offer {
                    version,
                    base,
                    relays,
                    distance_m,
                    min_separation_m,
                    tx_power_w,
                    altitude_m,
                    power_w,
                    interferer_w,
                    x_m,
                    y_m,
                    tolerance,
                    mu_los,
                    mu_nlos,
                    eta,
                    least_m,
                    most_m,
                    left_m: -left_m,
                    right_m,
                    noise_w: (noise * most_w) as f32,
                    sites,
                    offer_number: answer,
                })
            },
        )
        .boxed()
}
