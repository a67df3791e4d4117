//! Known values: of an independent program, counterexamples to the printed theorems, degenerate cases.

use host_tests::make;
use uav_relay_oracle::cases;
use uav_relay_oracle::reference::Link;
use uav_relay_tools::single::theorems;

use super::scene::Scene;

#[test]
fn the_reference_cases_hold() {
    for case in cases::of("theorem1").unwrap() {
        let mut scene = Scene::of(&case);
        let altitude = case.arg("h").unwrap();
        let profile = scene.profile(altitude);
        let (found, which) = theorems::best_at_altitude(&scene.mission, profile).unwrap();
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
        let guide = theorems::power_ratios(&scene.mission, profile.altitude_m).unwrap();
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
        let (found, _) = theorems::best_at_x(&scene.mission, x_m, power_w).unwrap();
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
        let (found, _) = theorems::best_free(&scene.mission, case.params.p_u as f32).unwrap();
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
        let [low, high] = theorems::equal_altitudes(&scene.mission, x_m, power_w);
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
            theorems::best_at_altitude(&scene.mission, scene.profile(altitude)).unwrap();
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

/// Checks that the best position is found where the printed Theorem 3 is wrong.
///
/// Degenerate positions of the interferer are checked, too.
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
        relays: vec![make::reference_relay(5.0, power_w)],
        ..Link::paper(1)
    };
    let best = |link: &Link, band| {
        let mut scene = Scene::new(link, band);
        let (found, case) =
            theorems::best_free(&scene.mission, link.relays[0].power_w as f32).unwrap();
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
    // Interferer on Tx: SIR_1 is constant, so SIR_2 decides.
    let (place, sir, case) = best(&link(100.0, 0.0, 0.0, 1.0, 2.0, 2.0), (5.0, 200.0));
    assert!(
        case == theorems::FreeCase::Lowest(theorems::PlaceCase::Level),
        "{case:?}"
    );
    assert!((sir - 1.0).abs() < 1e-12 && place.x_m > 99.9 && place.altitude_m < 5.1);
    // Interferer on Rx: no position helps.
    let (_, sir, case) = best(&link(100.0, 100.0, 0.0, 1.0, 2.0, 2.0), (5.0, 200.0));
    assert!(
        case == theorems::FreeCase::Lowest(theorems::PlaceCase::Drowned) && sir <= 0.0,
        "{case:?}"
    );
    // Interferer right beside Tx: SIR_1 only falls.
    let mut scene = Scene::new(&link(100.0, 0.0, 30.0, 1.0, 2.0, 2.0), (5.0, 5.0));
    let (found, case) = theorems::best_at_altitude(&scene.mission, scene.profile(5.0)).unwrap();
    assert!(case == theorems::PlaceCase::Crossing, "{case:?}");
    let most = scene.brute((0.0, 100.0), (5.0, 5.0));
    assert!(scene.sir_of(&found) >= most * (1.0 - 1e-6));
    // Outside [0, D] there is no position.
    for x_m in [-1.0, 100.1, f32::NAN] {
        assert!(theorems::best_at_x(&scene.mission, x_m, 1.0).is_none());
    }
}
