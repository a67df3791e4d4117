//! Values of an independent program, and errors of the printed rules.

use host_tests::make;
use uav_relay_oracle::cases;
use uav_relay_oracle::mission::of_stochastic_link;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::stochastic::StochasticLink;
use uav_relay_tools::fewest::Fewest;

use super::chain;
use super::field::field;
use super::interferer::briefed;

#[test]
fn the_reference_cases_hold() {
    for case in cases::of("min_uavs").unwrap() {
        let (link, target) = (case.link(1), case.arg("gamma").unwrap());
        let (mission, profile_of) = briefed(&link);
        let found = Fewest::of(&mission, target as f32, &profile_of).unwrap();
        assert!(found.proven);
        assert!(
            (f64::from(found.relays) - case.part("N").unwrap()).abs() < 0.5,
            "{}",
            case.id
        );
        let x = chain(&mission, found.relays, target, &profile_of);
        let expected = case.part_list("x").unwrap();
        assert_eq!(expected.len(), x.len());
        for (x, expected) in x.iter().zip(expected) {
            let apart = (x - expected).abs();
            let near = apart < 1e-5 * link.distance_m;
            assert!(near, "{}: {x} {expected}", case.id);
        }
    }
    for case in cases::of("problem1").unwrap() {
        let (params, target) = (&case.params, case.arg("gamma").unwrap());
        let link = StochasticLink {
            distance_m: params.d,
            tx_w: params.p_t,
            mu_los: params.mu_los,
            eta: params.eta,
            upsilon: vec![(0.0, case.arg("upsilon").unwrap())],
            relays: vec![make::reference_relay(params.h, params.p_u)],
        };
        let mission = of_stochastic_link(&link, 0.0).unwrap();
        let common = mission.config().common;
        let found = Fewest::of(&mission, target as f32, |_| common).unwrap();
        assert!(found.proven);
        assert!(
            (f64::from(found.relays) - case.part("N").unwrap()).abs() < 0.5,
            "{}",
            case.id
        );
        let x = chain(&mission, found.relays, target, |_| common);
        let link = StochasticLink {
            relays: vec![link.relays[0]; x.len()],
            ..link
        };
        let sirs = link.hop_sirs(&x);
        assert!(
            sirs.iter().all(|sir| *sir >= target * (1.0 - 1e-5)),
            "{}: {sirs:?}",
            case.id
        );
    }
    // The printed rules give 16, 24, 36 and 54.
    let (mission, profile_of) = briefed(&Link::paper(1));
    for (target, relays) in [(5.0, 22), (10.0, 40), (20.0, 65), (40.0, 100)] {
        assert_eq!(
            Fewest::of(&mission, target, &profile_of).unwrap().relays,
            relays
        );
    }
    // The printed rule with rho has no solution here.
    let mut case = field(105.0, 10.0, vec![(0.0, 100.0)]);
    case.tx_w = 1.0;
    let mission = of_stochastic_link(&case, 0.0).unwrap();
    let common = mission.config().common;
    assert_eq!(Fewest::of(&mission, 1.0, |_| common).unwrap().relays, 12);
}
