//! Diffraction loss: the ITU's validation examples, and a second implementation.
//!
//! The four terrain profiles are in `data/itu_profiles.csv`, one per line, with a height every 50 m. Profiles and
//! losses are those of the document "Validation examples for the delta Bullington diffraction prediction method" of
//! ITU-R Study Group 3.

use rand::RngExt as _;
use uav_relay_terrain::diffraction::{LIGHT_M_S, Surface, knife_edge_db, loss_db, loss_over_db};

use crate::judge::{Loss, Path};
use crate::{rng, seeds};

const LENGTHS_KM: [f64; 4] = [83.07993853, 132.315397, 17.39688966, 40.51112702];

/// Five links that the ITU's examples have over each profile.
///
/// A link has the heights of its two antennas above the ground, m, and a frequency, MHz.
const LINKS: [[f64; 3]; 5] = [
    [30.0, 30.0, 1000.0],
    [50.0, 10.0, 2500.0],
    [20.0, 20.0, 600.0],
    [40.0, 50.0, 200.0],
    [70.0, 5.0, 150.0],
];

/// Published losses of the ITU's examples, dB: La, Ls, Lsph and the resulting loss.
///
/// La is for the actual profile, Ls for the smooth profile, and Lsph for the spherical earth.
const PUBLISHED: [[f64; 4]; 20] = [
    [32.84284766, 13.74840484, 15.3485837, 34.44302652],
    [37.229036, 18.5970601, 23.6973069, 42.32928281],
    [31.22595813, 15.79373777, 20.91384864, 36.34606901],
    [24.87792613, 11.50981857, 14.32933641, 27.69744396],
    [24.78223928, 14.93033347, 33.13883693, 42.99074274],
    [36.20419305, 35.82816509, 69.45434151, 69.83036947],
    [44.81240928, 39.66871934, 85.53863749, 90.68232743],
    [34.43917939, 34.29503068, 66.31647651, 66.46062522],
    [28.37368149, 27.74009568, 45.7547348, 46.38832061],
    [34.61746032, 26.58559997, 43.35361839, 51.38547874],
    [17.62040631, 0.0, 0.0, 17.62040631],
    [25.1016907, 0.0, 0.0, 25.1016907],
    [20.25488733, 0.0, 0.0, 20.25488733],
    [10.1899085, 0.0, 0.0, 10.1899085],
    [16.27593106, 6.17409081, 10.63765222, 20.73949248],
    [7.8709851352, 0.0, 0.0, 7.870985135],
    [0.0, 0.0, 0.0, 0.0],
    [15.30876397, 0.0, 0.0, 15.30876397],
    [6.526730443, 0.0, 0.0, 6.526730443],
    [0.0, 0.0, 0.0, 0.0],
];

#[test]
fn both_implementations_give_the_losses_that_the_itu_published() {
    let profiles = include_str!("data/itu_profiles.csv")
        .lines()
        .zip(LENGTHS_KM);
    let mut published = PUBLISHED.iter();
    let mut worst = [0.0_f64; 2];
    for (line, length_km) in profiles {
        let h: Vec<f64> = line
            .split(',')
            .map(|height| height.parse().unwrap())
            .collect();
        let n = h.len();
        let d: Vec<f64> = (0..n)
            .map(|i| {
                if i + 1 == n {
                    length_km
                } else {
                    0.05 * i as f64
                }
            })
            .collect();
        for [ht, hr, mhz] in LINKS {
            let [actual, smooth, spherical, total] = *published.next().unwrap();
            let (hts, hrs) = (ht + h[0], hr + h[n - 1]);
            let path = Path {
                d: d.clone(),
                h: h.clone(),
                hts,
                hrs,
                f_ghz: mhz / 1000.0,
                vertical: false,
                light: 3e8,
            };
            let loss = path.loss();
            let parts = [
                loss.actual - actual,
                loss.smooth - smooth,
                loss.spherical - spherical,
                loss.total - total,
            ];
            let error = parts
                .iter()
                .fold(0.0_f64, |worst, part| worst.max(part.abs()));
            assert!(error < 1e-3, "{length_km} km, {mhz} MHz: {parts:?}");
            let points: Vec<[f64; 2]> = d.iter().zip(&h).map(|(d, h)| [1000.0 * d, *h]).collect();
            let surface = Surface {
                is_vertical: false,
                ..Surface::default()
            };
            let own = loss_over_db(&points, [hts, hrs], 3e8 / (mhz * 1e6), surface);
            assert!(
                (own - total).abs() < 1e-3,
                "{length_km} km, {mhz} MHz: {own} {total}"
            );
            worst = [worst[0].max(error), worst[1].max((own - total).abs())];
        }
    }
    assert!(published.next().is_none());
    println!(
        "largest error against the ITU's 20 examples: judge {:.5} dB, crate {:.5} dB",
        worst[0], worst[1]
    );
}

/// Draws a random hilly profile (a sum of a few sines), with antennas above or just below the hills.
fn random(rng: &mut impl rand::Rng) -> Path {
    let length: f64 = 10_f64.powf(rng.random_range(-1.0..1.7));
    let n = rng.random_range(20..400);
    let size = 10_f64.powf(rng.random_range(0.0..2.5));
    let base = rng.random_range(0.0..1500.0);
    let waves: Vec<[f64; 3]> = (0..5)
        .map(|_| {
            [
                rng.random_range(0.1..1.0),
                rng.random_range(0.5..20.0),
                rng.random_range(0.0..6.3),
            ]
        })
        .collect();
    let d: Vec<f64> = (0..n)
        .map(|i| length * f64::from(i) / f64::from(n - 1))
        .collect();
    let height = |d: &f64| {
        base + size
            * waves
                .iter()
                .map(|[a, k, p]| a * (k * d / length + p).sin())
                .sum::<f64>()
    };
    let h: Vec<f64> = d.iter().map(height).collect();
    let mut mast = || 10_f64.powf(rng.random_range(0.0..2.3));
    let (hts, hrs) = (h[0] + mast(), h[h.len() - 1] + mast());
    Path {
        d,
        h,
        hts,
        hrs,
        f_ghz: 10_f64.powf(rng.random_range(-1.0..1.0)),
        vertical: true,
        light: LIGHT_M_S,
    }
}

#[test]
fn random_profiles_have_the_loss_of_the_second_implementation() {
    let (mut worst, mut kinds) = (0.0_f64, [0; 3]);
    for seed in seeds(200) {
        let path = random(&mut rng(seed));
        let Loss {
            total,
            spherical,
            smooth,
            ..
        } = path.loss();
        let points: Vec<[f64; 2]> = path
            .d
            .iter()
            .zip(&path.h)
            .map(|(d, h)| [1000.0 * d, *h])
            .collect();
        let wavelength = LIGHT_M_S / (path.f_ghz * 1e9);
        let own = loss_db(&points, [path.hts, path.hrs], wavelength);
        assert!((own - total).abs() < 0.01, "seed {seed}: {own} {total}");
        worst = worst.max((own - total).abs());
        kinds[usize::from(total > 0.0) + usize::from(spherical > smooth)] += 1;
        // The loss must be the same in the opposite direction.
        let length = points[points.len() - 1][0];
        let back: Vec<[f64; 2]> = points.iter().rev().map(|[d, h]| [length - d, *h]).collect();
        let back = loss_db(&back, [path.hrs, path.hts], wavelength);
        assert!((back - own).abs() < 1e-6, "seed {seed}: {own} {back}");
    }
    println!(
        "largest difference {worst:.6} dB; no loss, loss by obstacles, loss by the smooth earth: {kinds:?}"
    );
    if std::env::var_os("SEED").is_none() {
        assert!(kinds.iter().all(|count| *count > 10), "{kinds:?}");
    }
}

#[test]
fn a_single_edge_at_the_line_of_sight_costs_six_decibels_and_more_with_height() {
    assert!((knife_edge_db(0.0) - 6.03).abs() < 0.01);
    assert_eq!(knife_edge_db(-0.79), 0.0);
    let mut before = 0.0;
    for height in 0..60 {
        let points = [[0.0, 0.0], [500.0, f64::from(height)], [1000.0, 0.0]];
        let loss = loss_db(&points, [20.0, 20.0], 0.15);
        assert!(
            loss >= before && loss.is_finite(),
            "{height}: {loss} {before}"
        );
        before = loss;
    }
    assert!(before > 20.0);
    // Degenerate hops must have a loss of 0, not NaN.
    for (points, ends) in [
        (vec![[0.0, 5.0]], [6.0, 6.0]),
        (vec![[0.0, 5.0], [0.0, 5.0]], [6.0, 6.0]),
        (vec![[0.0, 5.0], [9.0, 5.0]], [1.0, 1.0]),
    ] {
        assert!(loss_db(&points, ends, 0.15).is_finite(), "{points:?}");
    }
}
