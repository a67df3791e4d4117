//! One relay and one interferer: Lemmas 1 and 2, Corollary 1 and Theorems 1 to 3 against brute force in f64.
//!
//! `COUNT` and `SEED` in the environment take other scenarios.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    missing_docs
)]

use host_tests::brief::{as_relays_know_it, of_link};
use host_tests::cases::{self, Case};
use host_tests::random::{self, Chain, Style, log_uniform};
use host_tests::reference::Link;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::placement::single::{Found, free, given_altitude, given_x, guide, locus, noise};
use uav_relay::sir::{Turn, first_hop_turn};
use uav_relay::{Band, Mission, MissionConfig};

/// How far below the best SIR a place may be, relative.
const ALLOWED: f64 = 1e-4;

/// The scenarios of each theorem's test.
fn count() -> usize {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(100_000)
}

/// One relay, its link as the relay's own f32 numbers, and the band it may choose from.
struct Scene {
    link: Link,
    band: (f64, f64),
    mission: Mission,
}

impl Scene {
    fn new(link: &Link, band: (f64, f64)) -> Self {
        let mut link = as_relays_know_it(link);
        let round = |value: f64| f64::from(value as f32);
        let band = (round(band.0), round(band.1));
        link.relays[0].altitude_m = band.0;
        let (mission, _) = of_link(&link, 1e-4).unwrap();
        let config = MissionConfig {
            band: Band {
                least_m: band.0 as f32,
                most_m: band.1 as f32,
            },
            ..*mission.config()
        };
        Self {
            link,
            band,
            mission: Mission::try_new(config).unwrap(),
        }
    }

    /// 10 m to 100 km, the interferer before, between, beyond, on Tx, on Rx, on the line; the lowest altitude 0.002 to 0.5 of D.
    fn random(rng: &mut impl Rng) -> Self {
        let style = Style {
            relays: 1..=1,
            chain: Chain::Alike,
        };
        let link = random::link(rng, &style);
        let low = link.relays[0].altitude_m;
        let high = if rng.random_bool(0.1) {
            low
        } else {
            (low * log_uniform(rng, 1.0, 30.0)).min(1e5)
        };
        Self::new(&link, (low, high))
    }

    fn of(case: &Case) -> Self {
        Self::new(&case.link(1), (case.params.h_min, case.params.h_max))
    }

    /// The worse SIR of the two hops, in f64, with received powers instead of the crate's formulas.
    fn sir(&mut self, x: f64, h: f64) -> f64 {
        self.link.relays[0].altitude_m = h;
        let first = self.link.sir_relay(1, 0.0, x).unwrap();
        first.min(self.link.sir_rx(x).unwrap())
    }

    fn sir_of(&mut self, found: &Found) -> f64 {
        let place = found.place;
        self.sir(f64::from(place.x_m), f64::from(place.altitude_m))
    }

    fn profile(&self, altitude_m: f64) -> uav_relay::Profile {
        uav_relay::Profile {
            altitude_m: altitude_m as f32,
            ..self.mission.config().common
        }
    }

    /// The best SIR over the box `x` by `h`: a dense search along lines of both directions, the box's edges among them, and
    /// from the best three places a search of the plane about them. It knows of no theorem.
    fn brute(&mut self, x: (f64, f64), h: (f64, f64)) -> f64 {
        let lines = |(low, high): (f64, f64)| {
            if low < high {
                vec![0.0, 0.05, 0.3, 0.7, 1.0]
                    .into_iter()
                    .map(|share| low + share * (high - low))
                    .collect()
            } else {
                vec![low]
            }
        };
        let mut best: Vec<(f64, f64, f64)> = Vec::new();
        if x.0 < x.1 {
            let near = self.link.x_i;
            for up in lines(h) {
                let (sir, at) = along(x, near, |at| self.sir(at, up));
                best.push((sir, at, up));
            }
        }
        if h.0 < h.1 {
            for at in lines(x) {
                let (sir, up) = along(h, h.0, |up| self.sir(at, up));
                best.push((sir, at, up));
            }
        }
        if best.is_empty() {
            return self.sir(x.0, h.0);
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        let most = best[0].0;
        if x.0 < x.1 && h.0 < h.1 {
            best.truncate(3);
            best.into_iter()
                .map(|(_, at, up)| self.about((at, up), x, h))
                .fold(most, f64::max)
        } else {
            most
        }
    }

    /// The best SIR of a search of the plane that closes in from `place`.
    fn about(&mut self, place: (f64, f64), x: (f64, f64), h: (f64, f64)) -> f64 {
        let (mut at, mut up) = place;
        let mut half = ((x.1 - x.0) / 8.0, (h.1 - h.0) / 8.0);
        let mut most = self.sir(at, up);
        for _ in 0..20 {
            let centre = (at, up);
            for i in -2_i32..=2 {
                for j in -2_i32..=2 {
                    let try_x = (centre.0 + half.0 * f64::from(i) / 2.0).clamp(x.0, x.1);
                    let try_h = (centre.1 + half.1 * f64::from(j) / 2.0).clamp(h.0, h.1);
                    let sir = self.sir(try_x, try_h);
                    if sir > most {
                        (most, at, up) = (sir, try_x, try_h);
                    }
                }
            }
            half = (half.0 * 0.5, half.1 * 0.5);
        }
        most
    }
}

/// The best value of `f` over `range` and where: sampled evenly and ever closer to its ends and to `near`, then refined by
/// golden section around the best three samples.
fn along(range: (f64, f64), near: f64, mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    let (low, high) = range;
    let mut at = vec![low, high];
    for i in 1..24 {
        let share = f64::from(i) / 24.0;
        let close = 10_f64.powf(-8.0 * share) * (high - low);
        at.extend([
            low + share * (high - low),
            low + close,
            high - close,
            near - close,
            near + close,
        ]);
    }
    at.retain(|x| (low..=high).contains(x));
    at.sort_by(f64::total_cmp);
    let values: Vec<f64> = at.iter().map(|&x| f(x)).collect();
    let mut order: Vec<usize> = (0..at.len()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let mut best = (values[order[0]], at[order[0]]);
    for &peak in order.iter().take(3) {
        let (mut from, mut to) = (at[peak.saturating_sub(1)], at[(peak + 1).min(at.len() - 1)]);
        let ratio = (5_f64.sqrt() - 1.0) / 2.0;
        let (mut a, mut b) = (to - ratio * (to - from), from + ratio * (to - from));
        let (mut fa, mut fb) = (f(a), f(b));
        for _ in 0..40 {
            if fa > best.0 {
                best = (fa, a);
            }
            if fb > best.0 {
                best = (fb, b);
            }
            if fa < fb {
                (from, a, fa) = (a, b, fb);
                b = from + ratio * (to - from);
                fb = f(b);
            } else {
                (to, b, fb) = (b, a, fa);
                a = to - ratio * (to - from);
                fa = f(a);
            }
        }
    }
    best
}

/// Holds the places that `best` finds against brute force over the box that `over` says, and counts the cases.
fn no_worse_than_brute_force(
    seed: u64,
    over: impl Fn(&mut ChaCha8Rng, &Scene) -> ((f64, f64), (f64, f64)),
    best: impl Fn(&Scene, (f64, f64), (f64, f64)) -> (Found, String),
) -> std::collections::BTreeMap<String, u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(seed));
    let mut seen = std::collections::BTreeMap::new();
    let (mut worst, mut above, mut missed) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..count() {
        let mut scene = Scene::random(&mut rng);
        let (x, h) = over(&mut rng, &scene);
        let (found, case) = best(&scene, x, h);
        let place = found.place;
        assert!((x.0..=x.1).contains(&f64::from(place.x_m)), "{place:?}");
        assert!(
            (h.0..=h.1).contains(&f64::from(place.altitude_m)),
            "{place:?}"
        );
        let reached = scene.sir_of(&found);
        let most = scene.brute(x, h);
        let short = 1.0 - reached / most;
        assert!(
            most <= 0.0 || short <= ALLOWED,
            "short by {short:e} ({case}) in {:?} {:?}",
            scene.link,
            scene.band
        );
        let told = (f64::from(found.sir) / reached - 1.0).abs();
        assert!(
            most <= 0.0 || told <= 1e-5,
            "told {told:e} in {:?}",
            scene.link
        );
        if most > 0.0 {
            worst = worst.max(short);
            above = above.max(-short);
            missed += u32::from(short < -1e-6);
        }
        *seen.entry(case).or_insert(0) += 1;
    }
    println!(
        "short of brute force by at most {worst:.1e}; brute force fell short {missed} times, by at most {above:.1e}; {seen:?}"
    );
    seen
}

#[test]
fn theorem_1_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        501,
        |_, scene| ((0.0, scene.link.distance_m), (scene.band.0, scene.band.0)),
        |scene, _, h| {
            let (found, case) =
                given_altitude::best_place(&scene.mission, scene.profile(h.0)).unwrap();
            (found, format!("{case:?}"))
        },
    );
    assert_eq!(seen.len(), 10, "every case: {seen:?}");
}

#[test]
fn theorem_2_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        502,
        |rng, scene| {
            let d = scene.link.distance_m;
            let x = match rng.random_range(0..8) {
                0 => 0.0,
                1 => d,
                _ => f64::from(rng.random_range(0.0..=d) as f32).min(d),
            };
            ((x, x), scene.band)
        },
        |scene, x, _| {
            let power_w = scene.mission.config().common.power_w;
            let (found, case) = given_x::best_place(&scene.mission, x.0 as f32, power_w).unwrap();
            (found, format!("{case:?}"))
        },
    );
    assert_eq!(seen.len(), 4, "every case: {seen:?}");
}

#[test]
fn theorem_3_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        503,
        |_, scene| ((0.0, scene.link.distance_m), scene.band),
        |scene, _, _| {
            let power_w = scene.mission.config().common.power_w;
            let (found, case) = free::best_place(&scene.mission, power_w).unwrap();
            (found, format!("{case:?}"))
        },
    );
    for edge in ["Lowest", "Highest", "AboveRx"] {
        assert!(
            seen.keys().any(|case| case.starts_with(edge)),
            "{edge}: {seen:?}"
        );
    }
}

#[test]
fn the_locus_is_where_the_hops_are_equal() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(504));
    let mut roots = [0_u32; 3];
    for _ in 0..20_000 {
        let mut scene = Scene::random(&mut rng);
        let x = f64::from(rng.random_range(0.0..=scene.link.distance_m) as f32);
        let power_w = scene.mission.config().common.power_w;
        let found = locus::altitudes(&scene.mission, x as f32, power_w);
        let difference = |scene: &mut Scene, h: f64| {
            scene.link.relays[0].altitude_m = h;
            let first = scene.link.sir_relay(1, 0.0, x).unwrap();
            first / scene.link.sir_rx(x).unwrap() - 1.0
        };
        for h in found.into_iter().flatten() {
            let here = difference(&mut scene, f64::from(h));
            let beside = difference(&mut scene, f64::from(h) * (1.0 + 3e-7))
                - difference(&mut scene, f64::from(h) * (1.0 - 3e-7));
            // A double root is where the difference touches zero, and f64 has half its digits there.
            assert!(
                here.abs() <= beside.abs() + 1e-6,
                "{x} {h}: {here:e} in {:?}",
                scene.link
            );
        }
        // None is missed: the difference changes its sign nowhere else.
        let found: Vec<f64> = found.into_iter().flatten().map(f64::from).collect();
        roots[found.len()] += 1;
        let mut before: Option<(f64, f64)> = None;
        for step in 0..200 {
            let h = scene.link.distance_m * 10_f64.powf(f64::from(step) * 0.05 - 6.0);
            let here = difference(&mut scene, h);
            if !here.is_finite() {
                continue;
            }
            if let Some((low, old)) = before
                && (old > 0.0) != (here > 0.0)
            {
                let between = |root: &&f64| (low * 0.999_999..=h * 1.000_001).contains(*root);
                assert!(
                    found.iter().any(|root| between(&root)),
                    "{x}: a root in {low} to {h}"
                );
            }
            before = Some((h, here));
        }
    }
    println!("places with 0, 1 and 2 altitudes: {roots:?}");
    assert!(roots.iter().all(|&seen| seen > 100), "{roots:?}");
}

#[test]
fn turns_agree_with_a_scan() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(505));
    let mut seen = [0_u32; 4];
    for _ in 0..20_000 {
        let scene = Scene::random(&mut rng);
        let (link, h) = (&scene.link, scene.band.0);
        let sir = |x: f64| link.sir_relay(1, 0.0, x).unwrap();
        // By more than f64's own rounding: next to Tx an interferer leaves SIR_1 all but level.
        let rises = |x: f64, by: f64| sir(x * (1.0 + by)) > sir(x * (1.0 - by)) * (1.0 + 1e-14);
        match first_hop_turn(scene.mission.interferer().unwrap(), h as f32) {
            // So far away that f64 cannot tell the bottom from its surroundings.
            Turn::Valley(x) if f64::from(x) > 100.0 * link.distance_m => {
                for part in [0.01, 0.3, 1.0, 3.0] {
                    assert!(!rises(link.distance_m * part, 1e-3), "{link:?}");
                }
            }
            Turn::Valley(x) => {
                let x = f64::from(x);
                assert!(
                    sir(x) <= sir(x * 0.999) && sir(x) <= sir(x * 1.001),
                    "{link:?}"
                );
                assert!(!rises(x * 0.9, 1e-3), "{link:?}");
                assert!(rises(x * 1.1, 1e-3) || x > link.distance_m, "{link:?}");
                seen[0] += 1;
            }
            Turn::Hill(x) => {
                let x = f64::from(x);
                // Where the interferer is all but beside Tx the hill is flatter than f64 can tell.
                let top = sir(x) * (1.0 + 1e-14);
                assert!(top >= sir(x * 0.999) && top >= sir(x * 1.001), "{link:?}");
                seen[1] += 1;
            }
            Turn::Falls => {
                for part in [0.01, 0.3, 1.0, 3.0] {
                    assert!(!rises(link.distance_m * part, 1e-3), "{link:?}");
                }
                seen[2] += 1;
            }
            Turn::Level => {
                assert!((sir(0.0) / sir(link.distance_m) - 1.0).abs() < 1e-12);
                seen[3] += 1;
            }
        }
    }
    assert!(seen.iter().all(|&seen| seen > 50), "{seen:?}");
}

/// p_t / p_u against C_1 to C_3 says which case of Corollary 1 applies, for X in [0, D].
#[test]
fn the_guide_agrees_with_the_cases() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(506));
    let mut seen = [0_u32; 6];
    for _ in 0..50_000 {
        let scene = Scene::random(&mut rng);
        let link = &scene.link;
        if !(link.x_i > 0.0 && link.x_i < link.distance_m) {
            continue;
        }
        let (low, d) = (scene.band.0, link.distance_m);
        let guide = guide::ratios(&scene.mission, low as f32).unwrap();
        let (x, y2, h2) = (link.x_i, link.y_i * link.y_i, low * low);
        // As the paper prints them.
        let kappa = link.mu_nlos / link.eta;
        let at_rx = y2 + (d - x) * (d - x);
        let c1 = kappa * at_rx * h2 / ((x * x + y2 + h2) * (d * d + h2));
        let c2 = kappa * at_rx * (d * d + h2) / (h2 * (at_rx + h2));
        let q = x * x + y2;
        let psi = (q + (q * q + 4.0 * x * x * h2).sqrt()) / (2.0 * x);
        let c3 = kappa * (psi * psi + h2) * at_rx
            / (((psi - x) * (psi - x) + y2 + h2) * ((d - psi) * (d - psi) + h2));
        let c3_told = f64::from(guide.c3.unwrap());
        let told = [f64::from(guide.c1), f64::from(guide.c2), c3_told];
        for (told, printed) in told.into_iter().zip([c1, c2, c3]) {
            assert!(
                (told / printed - 1.0).abs() < 1e-4,
                "{told} {printed} {link:?}"
            );
        }
        let ratio = link.tx_w / link.relays[0].power_w;
        // On the border of two cases an f32 may take either; their places are the same there.
        let border = [psi / d, ratio / c1, ratio / c2, ratio / c3];
        if border.iter().any(|at| (at - 1.0).abs() < 1e-4) {
            continue;
        }
        let case = match (psi >= d, ratio) {
            (_, ratio) if ratio < c1 => 1,
            (true, ratio) if ratio <= c2 => 2,
            (true, _) => 3,
            (false, ratio) if ratio <= c3 => 4,
            (false, _) => 5,
        };
        let (_, found) = given_altitude::best_place(&scene.mission, scene.profile(low)).unwrap();
        assert_eq!(found.printed(), case, "{link:?}");
        seen[usize::from(case)] += 1;
    }
    assert!(seen[1..].iter().all(|&seen| seen > 100), "{seen:?}");
}

#[test]
fn the_reference_cases_hold() {
    for case in cases::of("theorem1").unwrap() {
        let mut scene = Scene::of(&case);
        let altitude = case.arg("h").unwrap();
        let profile = scene.profile(altitude);
        let (found, which) = given_altitude::best_place(&scene.mission, profile).unwrap();
        let expected = case.part("sir").unwrap();
        assert!(
            (scene.sir_of(&found) / expected - 1.0).abs() < 1e-6,
            "{}",
            case.id
        );
        let apart = f64::from(found.place.x_m) - case.part("x").unwrap();
        assert!(apart.abs() < 1e-5 * scene.link.distance_m, "{}", case.id);
        assert!(
            (f64::from(which.printed()) - case.part("case").unwrap()).abs() < 0.5,
            "{}",
            case.id
        );
        let guide = guide::ratios(&scene.mission, profile.altitude_m).unwrap();
        let told = [guide.c1, guide.c2, guide.c3.unwrap_or(f32::NAN)];
        for (told, name) in told.into_iter().zip(["C1", "C2", "C3"]) {
            let expected = case.part(name).unwrap();
            let apart = (f64::from(told) / expected - 1.0).abs();
            let neither = told.is_nan() && expected.is_nan();
            assert!(apart < 1e-5 || neither, "{} {name}", case.id);
        }
    }
    for case in cases::of("theorem2").unwrap() {
        let mut scene = Scene::of(&case);
        let (x_m, power_w) = (case.arg("x").unwrap() as f32, case.params.p_u as f32);
        let (found, _) = given_x::best_place(&scene.mission, x_m, power_w).unwrap();
        let expected = (case.part("h").unwrap(), case.part("sir").unwrap());
        assert!(
            (scene.sir_of(&found) / expected.1 - 1.0).abs() < 1e-6,
            "{}",
            case.id
        );
        assert!(
            (f64::from(found.place.altitude_m) / expected.0 - 1.0).abs() < 1e-5,
            "{}",
            case.id
        );
    }
    for case in cases::of("theorem3").unwrap() {
        let mut scene = Scene::of(&case);
        let (found, _) = free::best_place(&scene.mission, case.params.p_u as f32).unwrap();
        let expected = case.part("sir").unwrap();
        assert!(
            (scene.sir_of(&found) / expected - 1.0).abs() < 1e-6,
            "{}",
            case.id
        );
    }
    for case in cases::of("locus").unwrap() {
        let scene = Scene::of(&case);
        let (x_m, power_w) = (case.arg("x").unwrap() as f32, case.params.p_u as f32);
        let [low, high] = locus::altitudes(&scene.mission, x_m, power_w);
        let expected = case.part_list("h_minus_plus").unwrap();
        for (told, expected) in [low, high].into_iter().zip(expected) {
            match told {
                Some(told) => assert!(
                    (f64::from(told) / expected - 1.0).abs() < 1e-6,
                    "{}",
                    case.id
                ),
                None => assert!(expected.is_nan(), "{}", case.id),
            }
        }
    }
    // Theorem 1's crossing is the root of the paper's quartic.
    for (case, coefficients) in cases::of("quartic_roots_in_0_D")
        .unwrap()
        .into_iter()
        .zip(cases::of("quartic_coeffs").unwrap())
    {
        let scene = Scene::of(&case);
        let altitude = case.arg("h").unwrap();
        let (found, _) =
            given_altitude::best_place(&scene.mission, scene.profile(altitude)).unwrap();
        let (x, root) = (f64::from(found.place.x_m), case.values().unwrap()[0]);
        assert!((x - root).abs() < 1e-5 * root, "{x} {root}");
        let value = |x: f64| {
            coefficients
                .values()
                .unwrap()
                .iter()
                .fold(0.0, |sum, c| sum * x + c)
        };
        assert!(value(root * (1.0 - 1e-6)) * value(root * (1.0 + 1e-6)) < 0.0);
    }
}

/// What the printed Theorem 3 gets wrong, and the degenerate places of the interferer, by name.
#[test]
fn counterexamples_and_degenerate_places() {
    let link = |d: f64, x_i: f64, y_i: f64, tx_w: f64, power_w: f64, kappa: f64| Link {
        distance_m: d,
        x_i,
        y_i,
        tx_w,
        interferer_w: 1.0,
        mu_los: 1.0,
        mu_nlos: kappa,
        eta: 1.0,
        relays: vec![host_tests::reference::Station {
            altitude_m: 5.0,
            power_w,
        }],
        ..Link::paper(1)
    };
    let best = |link: &Link, band| {
        let mut scene = Scene::new(link, band);
        let (found, case) =
            free::best_place(&scene.mission, link.relays[0].power_w as f32).unwrap();
        let sir = scene.sir_of(&found);
        (found.place, sir, case)
    };
    let (place, sir, _) = best(&link(100.0, 98.0, 0.0, 1.0, 5.0, 1.0), (5.0, 200.0));
    assert!(
        (sir - 0.050_01).abs() < 1e-5 && (place.x_m - 80.638).abs() < 1e-2,
        "{sir} {place:?}"
    );
    let (place, sir, _) = best(&link(100.0, 95.0, 20.0, 1.0, 2.0, 2.0), (5.0, 200.0));
    assert!(
        (sir - 0.7650).abs() < 1e-4 && (place.x_m - 53.127).abs() < 1e-2,
        "{sir} {place:?}"
    );
    // The interferer on Tx: SIR_1 is the same everywhere, so it is SIR_2 that counts.
    let (place, sir, case) = best(&link(100.0, 0.0, 0.0, 1.0, 2.0, 2.0), (5.0, 200.0));
    assert!(
        case == free::Case::Lowest(given_altitude::Case::Level),
        "{case:?}"
    );
    assert!((sir - 1.0).abs() < 1e-12 && place.x_m > 99.9 && place.altitude_m < 5.1);
    // On Rx: nothing helps.
    let (_, sir, case) = best(&link(100.0, 100.0, 0.0, 1.0, 2.0, 2.0), (5.0, 200.0));
    assert!(
        case == free::Case::Lowest(given_altitude::Case::Drowned) && sir <= 0.0,
        "{case:?}"
    );
    // Right beside Tx: SIR_1 only falls.
    let mut scene = Scene::new(&link(100.0, 0.0, 30.0, 1.0, 2.0, 2.0), (5.0, 5.0));
    let (found, case) = given_altitude::best_place(&scene.mission, scene.profile(5.0)).unwrap();
    assert!(case == given_altitude::Case::Crossing, "{case:?}");
    let most = scene.brute((0.0, 100.0), (5.0, 5.0));
    assert!(scene.sir_of(&found) >= most * (1.0 - 1e-6));
    // Outside [0, D] there is no place to be given.
    for x_m in [-1.0, 100.1, f32::NAN] {
        assert!(given_x::best_place(&scene.mission, x_m, 1.0).is_none());
    }
}

#[test]
fn noise_is_no_worse_than_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(507));
    let (mut worst, mut middle) = (0.0_f64, 0);
    for _ in 0..20_000 {
        let scene = Scene::random(&mut rng);
        let noise = noise::Noise {
            relay_w: log_uniform(&mut rng, 1e-16, 1e-10) as f32,
            receiver_w: log_uniform(&mut rng, 1e-16, 1e-10) as f32,
        };
        let found = noise::best_place(&scene.mission, scene.profile(scene.band.0), noise);
        let link = &scene.link;
        let snr = |x: f64| {
            let h2 = scene.band.0 * scene.band.0;
            let gap = link.distance_m - x;
            let first = link.tx_w / (link.eta * (x * x + h2) * f64::from(noise.relay_w));
            let power_w = link.relays[0].power_w;
            first.min(power_w / (link.eta * (gap * gap + h2) * f64::from(noise.receiver_w)))
        };
        // The one falls and the other rises: the worse of them has a single top, which a search of thirds finds.
        let (mut low, mut high) = (0.0, link.distance_m);
        for _ in 0..120 {
            let third = (high - low) / 3.0;
            if snr(low + third) < snr(high - third) {
                low += third;
            } else {
                high -= third;
            }
        }
        let reached = snr(f64::from(found.place.x_m));
        worst = worst.max(1.0 - reached / snr(low));
        assert!((f64::from(found.sir) / reached - 1.0).abs() < 1e-5);
        let end = link.distance_m as f32;
        middle += u32::from(found.place.x_m > 0.0 && found.place.x_m < end);
    }
    println!("short by at most {worst:.1e}; {middle} between Tx and Rx");
    assert!(worst < ALLOWED && middle > 2000);
}
