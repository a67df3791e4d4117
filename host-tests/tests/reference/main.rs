//! f64 reference, compared with a separate program, with brute force, and between its methods.

use host_tests::make;
use uav_relay_oracle::cases::{self, Case};
use uav_relay_oracle::reference::Link;

mod degenerate;
mod random;

fn close(got: f64, want: f64, rtol: f64, what: &str) {
    let near = (got - want).abs() <= rtol * want.abs();
    assert!(
        near || got == want,
        "{what}: got {got:e}, want {want:e} within {rtol:e}"
    );
}

fn close_all(got: &[f64], want: &[f64], rtol: f64, what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    for (&got, &want) in got.iter().zip(want) {
        close(got, want, rtol, what);
    }
}

/// Returns the test cases of a function from the file with results of a separate program.
///
/// Panics if the file has no case of `function`.
fn of(function: &str) -> Vec<Case> {
    let found = cases::of(function).unwrap();
    assert!(!found.is_empty(), "no case of {function}");
    found
}

#[test]
fn every_case_of_the_file_is_used() {
    let used = [
        "sir_tx",
        "sir_rx",
        "sir_mid",
        "sir_chain",
        "far_first",
        "far_mid",
        "dmax",
        "chain_far",
        "gamma_star",
        "algorithm1_schedule",
        "psi",
        "feasibility_bound_printed",
        // Cases used by the tests `theorems` and `plan`.
        "locus",
        "quartic_coeffs",
        "quartic_roots_in_0_D",
        "theorem1",
        "theorem2",
        "theorem3",
        // Cases used by the tests `fleet` and `plan`.
        "min_uavs",
        "problem1",
        // Cases used by the tests `multi_interferer` and `plan`.
        "hyp_msi",
        // Cases used by the tests `baseline` and `figures`.
        "baseline_single",
        "baseline_multi",
        "algorithm4",
        "forward_mode_derivative",
    ];
    let all = cases::load().unwrap();
    assert_eq!(
        all.len(),
        used.iter()
            .map(|function| of(function).len())
            .sum::<usize>()
    );
}

#[test]
fn the_paper_scenario_has_the_channel_of_the_file() {
    let case = &of("gamma_star")[0];
    let (paper, params) = (Link::paper(3), &case.params);
    close(paper.mu_los, params.mu_los, 1e-14, "mu_los");
    close(paper.mu_nlos, params.mu_nlos, 1e-14, "mu_nlos");
    assert_eq!(
        Link {
            mu_los: params.mu_los,
            mu_nlos: params.mu_nlos,
            eta: params.eta,
            ..paper
        },
        case.link(3)
    );
}

#[test]
fn single_hops_match_the_file() {
    for case in of("sir_tx") {
        let mut link = case.link(1);
        link.relays[0].altitude_m = case.arg("h").unwrap();
        let sir = link.sir_relay(1, 0.0, case.arg("x").unwrap()).unwrap();
        close(sir, case.value().unwrap(), case.rtol, &case.id);
    }
    for case in of("sir_rx") {
        let mut link = case.link(1);
        link.relays[0].altitude_m = case.arg("h").unwrap();
        let sir = link.sir_rx(case.arg("x").unwrap()).unwrap();
        close(sir, case.value().unwrap(), case.rtol, &case.id);
    }
    for case in of("sir_mid") {
        let mut link = case.link(2);
        link.relays[0].altitude_m = case.arg("h_prev").unwrap();
        link.relays[1].altitude_m = case.arg("h").unwrap();
        let sir = link
            .sir_relay(2, case.arg("x_prev").unwrap(), case.arg("x").unwrap())
            .unwrap();
        close(sir, case.value().unwrap(), case.rtol, &case.id);
    }
}

/// Checks that hops between air and ground use the path loss `eta`, and hops between drones `mu_los`.
///
/// The SIRs are worked out by hand, because the two factors are equal in all cases of the file.
#[test]
fn each_hop_uses_its_own_path_loss() {
    let relays = [(30.0, 4.0), (15.0, 7.0)]
        .map(|(altitude_m, power_w)| make::reference_relay(altitude_m, power_w));
    let link = Link {
        distance_m: 100.0,
        min_separation_m: 0.0,
        tx_w: 6.0,
        interferer_w: 5.0,
        x_i: 50.0,
        y_i: 20.0,
        mu_los: 2.0,
        mu_nlos: 12.0,
        eta: 3.0,
        noise_w: 0.0,
        relays: relays.to_vec(),
    };
    let first = (6.0 / 7500.0) / (5.0 / 4200.0);
    let second = (4.0 / 1250.0) / (5.0 / 2175.0);
    let last = (7.0 / 5475.0) / (5.0 / 34800.0);
    close_all(
        &link.sir_hops(&[40.0, 60.0]),
        &[first, second, last],
        1e-14,
        "by hand",
    );
}

#[test]
fn chains_match_the_file() {
    for case in of("sir_chain") {
        let (x, h) = (case.arg_list("x").unwrap(), case.arg_list("h").unwrap());
        let mut link = case.link(0);
        link.relays = h
            .iter()
            .map(|&altitude_m| make::reference_relay(altitude_m, case.params.p_u))
            .collect();
        let want = case.values().unwrap();
        close_all(&link.sir_hops(&x), &want, case.rtol, &case.id);
        close(
            link.chain_sir(&x),
            want.iter().copied().fold(f64::MAX, f64::min),
            case.rtol,
            &case.id,
        );
    }
    for case in of("chain_far") {
        let x = case
            .link(case.relays().unwrap())
            .feasible(case.arg("gamma").unwrap());
        assert_eq!(
            x.is_some(),
            case.out["feasible"].as_bool().unwrap(),
            "{}",
            case.id
        );
        close_all(
            &x.unwrap(),
            &case.part_list("x").unwrap(),
            case.rtol,
            &case.id,
        );
    }
}

#[test]
fn reaches_match_the_file() {
    for case in of("far_first") {
        let reach = case.link(1).farthest(1, 0.0, case.arg("gamma").unwrap());
        let want = case.part("d1").unwrap();
        assert_eq!(reach.is_none(), want.is_nan(), "{}", case.id);
        close(
            reach.unwrap_or(0.0),
            if want.is_nan() { 0.0 } else { want },
            case.rtol,
            &case.id,
        );
    }
    for case in of("far_mid") {
        let s = case.arg("s").unwrap();
        let reach = case
            .link(2)
            .farthest(2, s, case.arg("gamma").unwrap())
            .unwrap();
        close(reach - s, case.part("d").unwrap(), case.rtol, &case.id);
    }
    for case in of("dmax") {
        let reach = case.link(1).rx_reach(case.arg("gamma").unwrap()).unwrap();
        close(reach, case.value().unwrap(), case.rtol, &case.id);
    }
}

#[test]
fn optima_match_the_file_and_the_table() {
    for case in of("gamma_star") {
        let link = case.link(case.relays().unwrap());
        let target = link.optimum().unwrap();
        close(target, case.part("gamma").unwrap(), case.rtol, &case.id);
        close_all(
            &link.feasible(target).unwrap(),
            &case.part_list("x").unwrap(),
            case.rtol,
            &case.id,
        );
    }
    for (n, want) in cases::OPTIMA {
        let n = usize::from(n);
        close(
            Link::paper(n).optimum().unwrap(),
            want,
            1e-8,
            &format!("optimum of {n}"),
        );
    }
}

#[test]
fn the_fixed_step_needs_the_known_number_of_targets() {
    for case in of("algorithm1_schedule") {
        let link = case.link(case.relays().unwrap());
        let (count, target) = link.fixed_step(case.arg("eps").unwrap()).unwrap();
        assert_eq!(
            f64::from(count),
            case.part("sweeps").unwrap(),
            "{}",
            case.id
        );
        close(target, case.part("gamma").unwrap(), case.rtol, &case.id);
        let x = link.feasible(target).unwrap();
        close_all(&x, &case.part_list("x").unwrap(), case.rtol, &case.id);
        close(
            link.chain_sir(&x),
            case.part("sir").unwrap(),
            case.rtol,
            &case.id,
        );
    }
    for (n, want) in [(1, 10247), (2, 10245), (8, 10237), (32, 10184), (100, 9857)] {
        assert_eq!(Link::paper(n).fixed_step(0.1).unwrap().0, want, "N = {n}");
    }
    assert_eq!(Link::paper(2).fixed_step(0.0), None);
    // The targets are 1026, 2, and then none above zero: the step skips every feasible target.
    assert_eq!(Link::paper(1).fixed_step(1024.0), None);
}

#[test]
fn the_printed_bound_and_the_turning_points_match_the_file() {
    for case in of("feasibility_bound_printed") {
        let (link, terms) = (case.link(2), case.part_list("terms").unwrap());
        let (x, d) = (case.params.x, case.params.d_min);
        close(
            link.sir_relay(1, 0.0, 0.0).unwrap(),
            terms[0],
            case.rtol,
            &case.id,
        );
        // Hop 2 at the minimum separation is worst abreast of the interferer.
        close(
            link.sir_relay(2, x - d, x).unwrap(),
            terms[1],
            case.rtol,
            &case.id,
        );
        close(
            link.sir_rx(case.params.d).unwrap(),
            terms[2],
            case.rtol,
            &case.id,
        );
        let least = terms.iter().copied().fold(f64::MAX, f64::min);
        close(least, case.part("bound").unwrap(), case.rtol, &case.id);
        close(
            terms[0].min(terms[2]),
            case.part("gamma0").unwrap(),
            case.rtol,
            &case.id,
        );
    }
    for case in of("psi") {
        let mut link = case.link(1);
        link.relays[0].altitude_m = case.arg("h").unwrap();
        let sir = |x: f64| link.sir_relay(1, 0.0, x).unwrap();
        let (turn, level) = (case.part("psi_x").unwrap(), case.part("psi_h").unwrap());
        if turn.is_infinite() {
            assert!(
                [1.0, 10.0, 1e3, 1e6]
                    .windows(2)
                    .all(|x| sir(x[0]) > sir(x[1])),
                "{}",
                case.id
            );
            assert!(level.is_infinite() && sir(1e6) > case.params.p_t / case.params.p_msi);
        } else {
            assert!(
                sir(turn) < sir(turn * 1.001) && sir(turn) < sir(turn * 0.999),
                "{}",
                case.id
            );
            // Tx and the interferer are equally far away, at any altitude.
            close(
                sir(level),
                case.params.p_t / case.params.p_msi,
                case.rtol,
                &case.id,
            );
        }
    }
}

#[test]
fn the_slack_at_rx_and_its_derivative_match_the_file() {
    for case in of("forward_mode_derivative") {
        let link = case.link(case.relays().unwrap());
        let slack = |target: f64| {
            let mut from = 0.0;
            for k in 1..=link.len() {
                from = link.farthest(k, from, target).unwrap();
            }
            from + link.rx_reach(target).unwrap() - link.distance_m
        };
        let target = case.arg("gamma").unwrap();
        let slope = |step: f64| (slack(target + step) - slack(target - step)) / (2.0 * step);
        close(
            slack(target),
            case.part("residual").unwrap(),
            case.rtol,
            &case.id,
        );
        // Richardson extrapolation: the wide difference has four times the error of the narrow one.
        let narrow = (4.0 * slope(0.005) - slope(0.01)) / 3.0;
        close(
            narrow,
            case.part("d_residual_d_gamma").unwrap(),
            case.rtol,
            &case.id,
        );
    }
}
