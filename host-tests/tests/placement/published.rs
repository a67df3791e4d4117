//! Worked cases of one hop, of a chain, and of the fixed step.

use uav_relay::Schedule;
use uav_relay::optimiser::plan;
use uav_relay::optimiser::spacing::Hop;
use uav_relay::sir::Sender;
use uav_relay_oracle::cases;

use super::*;

fn close(ours: f64, theirs: f64, what: &str) {
    assert!(
        (ours / theirs - 1.0).abs() < 3e-6,
        "{what}: {ours} against {theirs}"
    );
}

/// Checks the receiver's farthest x at which a hop meets a target SIR. The expected values come from the paper's
/// errata and from a public reference.
#[test]
fn reference_cases_of_one_hop_hold() {
    let mut checked = 0;
    for case in cases::of("far_first").unwrap() {
        let (mission, _) = of_link(&case.link(1), 1e-4).unwrap();
        let hop = Hop::new(
            &mission,
            mission.interferer().unwrap(),
            Sender::transmitter(&mission),
            1,
            mission.config().common.on_line().cross_section,
            0.0,
        );
        let ours = hop.reach(case.arg("gamma").unwrap() as f32, 0.0);
        match case.part("d1") {
            Some(d1) if d1.is_finite() => close(f64::from(ours.unwrap()), d1, &case.id),
            _ => assert_eq!(ours, None, "{}", case.id),
        }
        checked += 1;
    }
    for case in cases::of("far_mid").unwrap() {
        let (mission, _) = of_link(&case.link(2), 1e-4).unwrap();
        let common = mission.config().common;
        let hop = Hop::new(
            &mission,
            mission.interferer().unwrap(),
            Sender::relay(&mission, common.on_line()),
            2,
            common.on_line().cross_section,
            0.0,
        );
        let from = case.arg("s").unwrap();
        let reach = hop
            .reach(case.arg("gamma").unwrap() as f32, from as f32)
            .unwrap();
        // The distance is between two f32 positions, whose rounding is tolerated.
        let d = case.part("d").unwrap();
        let ours = f64::from(reach) - from;
        assert!(
            (ours - d).abs() < 3e-6 * d + 7e-5,
            "{}: {ours} against {d}",
            case.id
        );
        checked += 1;
    }
    for case in cases::of("dmax").unwrap() {
        let (mission, _) = of_link(&case.link(1), 1e-4).unwrap();
        let ours = receiver_reach(
            &mission,
            mission.config().common.on_line(),
            case.arg("gamma").unwrap() as f32,
        )
        .unwrap();
        close(f64::from(ours), case.value().unwrap(), &case.id);
        checked += 1;
    }
    assert!(checked >= 10, "{checked} cases");
}

#[test]
fn reference_cases_of_a_chain_hold() {
    let mut checked = 0;
    for case in cases::of("chain_far").unwrap() {
        let n = case.relays().unwrap();
        let link = Link {
            min_separation_m: 0.0,
            ..case.link(n)
        };
        let (mission, own) = of_link(&link, 1e-4).unwrap();
        let ours = xs(&places(&mission, &own, case.arg("gamma").unwrap() as f32));
        for (ours, theirs) in ours.iter().zip(case.part_list("x").unwrap()) {
            close(*ours, theirs, &case.id);
        }
        checked += 1;
    }
    for case in cases::of("gamma_star").unwrap() {
        let n = case.relays().unwrap();
        let link = Link {
            min_separation_m: 0.0,
            ..case.link(n)
        };
        let (mission, own) = of_link(&link, 1e-4).unwrap();
        let agreed = solve(&mission, &own).unwrap();
        let best = link.optimum().unwrap();
        let short = 1.0 - f64::from(agreed.target) / best;
        assert!((-1e-6..2e-4).contains(&short), "{}: {short}", case.id);
        checked += 1;
    }
    for case in cases::of("algorithm1_schedule").unwrap() {
        let (mission, own) = of_link(&case.link(case.relays().unwrap()), 1e-4).unwrap();
        let step = case.arg("eps").unwrap();
        let agreed = plan::solve(&mission, Schedule::FixedStep { step }, |i| {
            profile_of(&mission, &own, i)
        })
        .unwrap();
        assert_eq!(
            f64::from(agreed.sweeps),
            case.part("sweeps").unwrap(),
            "{}",
            case.id
        );
        close(
            f64::from(agreed.target),
            case.part("gamma").unwrap(),
            &case.id,
        );
        checked += 1;
    }
    assert!(checked >= 8, "{checked} cases");
}

#[test]
fn the_fixed_step_takes_as_many_targets_as_the_papers() {
    for (n, targets) in [
        (1, 10_247),
        (2, 10_245),
        (8, 10_237),
        (32, 10_184),
        (100, 9_857),
    ] {
        let link = Link::paper(n);
        let (mission, own) = of_link(&link, 1e-4).unwrap();
        let agreed = plan::solve(&mission, Schedule::FixedStep { step: 0.1 }, |i| {
            profile_of(&mission, &own, i)
        })
        .unwrap();
        let (count, target) = link.fixed_step(0.1).unwrap();
        assert_eq!((agreed.sweeps, count), (targets, targets), "N = {n}");
        assert!(
            (f64::from(agreed.target) / target - 1.0).abs() < 2.0 * SINGLE,
            "N = {n}: {} {target}",
            agreed.target
        );
    }
}
