//! Plans with altitudes and lateral offsets, compared with agreements and the reference optimiser.

use host_tests::make;
use host_tests::placing::{profile_of, reference};
use uav_relay::{Method, Profile};
use uav_relay_oracle::random::joint::Scenario as Drawn;
use uav_relay_oracle::random::joint::judged::{COUNT, numbered, optima};
use uav_relay_oracle::recorded;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{self, Corridor};
use uav_relay_scenario::mission;
use uav_relay_scenario::{AirGround, ChannelSpec, Interference, Scenario, Source};
use uav_relay_sim::report::hop_sirs;
use uav_relay_sim::simulator::chain;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_tools::plan::{Number, Plan, PlanRequest, plan};

const TOLERANCE: f64 = 1e-4;

fn example(name: &str) -> Scenario {
    let path = format!("{}/../examples/{name}", env!("CARGO_MANIFEST_DIR"));
    Scenario::parse(name, &std::fs::read_to_string(path).unwrap()).unwrap()
}

fn free(scenario: &Scenario, number: Number) -> Plan {
    let ask = PlanRequest {
        number,
        free_altitude: true,
        x_m: None,
        tolerance: TOLERANCE,
    };
    plan(scenario, &ask).unwrap()
}

/// Returns the linear SIR of the worst hop that simulated relays agree on; 0 without an agreement.
fn agreed(scenario: &Scenario, relays: u16) -> f64 {
    let (mission, own) = mission::mission(scenario, relays, TOLERANCE).unwrap();
    let mut setup = Setup::new(mission);
    setup.settings.method = Method::Joint;
    setup.profiles.clone_from(&own);
    setup.held = mission::fixed_altitude_relays(scenario, relays);
    let outcome = chain::run(setup).unwrap();
    if outcome.ending != Ending::Settled {
        return 0.0;
    }
    let flown: Vec<_> = (1..)
        .zip(&outcome.relays)
        .map(|(index, relay)| {
            let place = relay.setpoint.unwrap();
            let profile = profile_of(&mission, &own, index);
            let altitude_m = place.altitude_m;
            (
                place,
                Profile {
                    altitude_m,
                    ..profile
                },
            )
        })
        .collect();
    let sirs = hop_sirs(&mission, &flown);
    sirs.into_iter().reduce(f64::min).unwrap()
}

/// Returns the scenario of a link within `corridor`, with every relay like the first relay.
fn of_link(link: &Link, corridor: Corridor) -> Scenario {
    const LIGHT_M_PER_S: f64 = 299_792_458.0;
    let waves = link.mu_los.sqrt();
    let weight = (link.mu_nlos - link.eta) / (link.mu_nlos - link.mu_los).max(f64::MIN_POSITIVE);
    Scenario {
        distance_m: link.distance_m,
        altitude_m: corridor.least_m,
        altitude_min_m: corridor.least_m,
        altitude_max_m: corridor.most_m,
        lateral_min_m: corridor.left_m,
        lateral_max_m: corridor.right_m,
        min_separation_m: link.min_separation_m,
        tx_w: link.tx_w,
        rx_w: link.tx_w,
        uav_w: link.relays[0].power_w,
        channel: ChannelSpec {
            carrier_hz: waves * LIGHT_M_PER_S / (4.0 * std::f64::consts::PI),
            excess_loss_los_db: 0.0,
            excess_loss_nlos_db: 10.0 * (link.mu_nlos / link.mu_los).log10(),
            air_ground: AirGround::Weight(weight.clamp(0.0, 1.0)),
        },
        interference: Interference::Sources(vec![make::source(
            link.interferer_w,
            link.x_i,
            link.y_i,
        )]),
        ..Scenario::default()
    }
}

/// Returns the fraction by which a plan's SIR is below the SIR at the simulated relays' positions.
///
/// The result is -inf if the simulated relays reach no agreement.
fn short(scenario: &Scenario, relays: u16) -> f64 {
    1.0 - free(scenario, Number::Of(relays)).sir() / agreed(scenario, relays)
}

#[test]
fn a_plan_has_the_positions_that_the_relays_agree_on() {
    let (above, beside) = (example("altitudes.toml"), example("side.toml"));
    let mut all: Vec<(Scenario, u16)> = Vec::new();
    for relays in [2, 3, 8, 20] {
        all.push((above.clone(), relays));
        all.push((beside.clone(), relays));
    }
    all.push((Scenario::default(), 10));
    for number in (3..COUNT).step_by(97) {
        let Drawn { link, corridor, .. } = numbered(number);
        let relays = u16::try_from(link.len()).unwrap();
        if (2..=30).contains(&relays) {
            all.push((of_link(&link, corridor), relays));
        }
    }
    for (scenario, relays) in &all {
        let short = short(scenario, *relays);
        assert!(
            short.abs() < TOLERANCE,
            "{short:e} of {relays} {scenario:?}"
        );
    }
    println!("{} scenarios", all.len());
}

#[test]
fn a_plan_for_different_relays_is_what_they_agree_on() {
    let mut scenario = example("side.toml");
    for (index, altitude_m, power_w) in [
        (2, Some(100.0), None),
        (5, None, Some(2.0)),
        (7, Some(40.0), Some(0.7)),
    ] {
        let own = make::relay_override(altitude_m, power_w);
        scenario.relays.insert(index, own);
        for relays in [8, 15] {
            let short = short(&scenario, relays);
            println!(
                "{} of their own, {relays} relays: {short:e}",
                scenario.relays.len()
            );
            assert!(short.abs() < TOLERANCE, "{short:e}");
            let plan = free(&scenario, Number::Of(relays));
            for (&index, own) in &scenario.relays {
                let (place, profile) = plan.places[usize::from(index) - 1];
                let holds = |held: f64| (f64::from(place.altitude_m) / held - 1.0).abs() < 1e-6;
                assert!(own.altitude_m.is_none_or(holds), "{place:?}");
                let power_w = own.power_w.unwrap_or(scenario.uav_w);
                assert!((f64::from(profile.power_w) / power_w - 1.0).abs() < 1e-6);
            }
        }
    }
}

/// Checks that the relays reach the SIR of the plan if one of them keeps a high altitude. For this the other relays may have to move to the
/// other side of the interferer.
#[test]
fn the_others_take_the_side_of_a_fixed_altitude() {
    for altitude_m in [60.0, 120.0, 200.0, 300.0] {
        let mut scenario = example("side.toml");
        let own = make::relay_override(Some(altitude_m), None);
        scenario.relays.insert(3, own);
        let (agreed, planned) = (agreed(&scenario, 5), free(&scenario, Number::Of(5)).sir());
        println!("{altitude_m} m: {agreed} of {planned}");
        assert!(
            agreed >= planned * (1.0 - TOLERANCE),
            "{altitude_m} m: {agreed} of {planned}"
        );
        assert!(agreed > 1.15, "{altitude_m} m: {agreed}");
    }
}

/// Returns the SIR of a plan as a fraction of the reference optimum, for scenario `number`.
fn over_the_judge(number: u32, optimum: f64) -> f64 {
    let Drawn { link, corridor, .. } = numbered(number);
    let relays = u16::try_from(link.len()).unwrap();
    let plan = free(&of_link(&link, corridor), Number::Of(relays));
    // Only a single relay right above the line is proven, by a theorem.
    assert!(!plan.proven || relays == 1);
    let places: Vec<_> = plan.places.iter().map(|(at, _)| reference(*at)).collect();
    // The f32 rounding of two positions reduces the separation.
    let rounded = Link {
        min_separation_m: (link.min_separation_m - 1e-6 * link.distance_m).max(0.0),
        ..link.clone()
    };
    assert!(
        joint::keeps_rules(&rounded, corridor, &[], &places),
        "{number}"
    );
    joint::sir(&link, &places).unwrap() / optimum
}

/// Checks that plans for forty scenarios of up to 30 relays come near the stored optima.
///
/// `COUNT=2000` runs all scenarios, with up to 100 relays. Every plan reaches at least 0.98 of the optimum. Only these plans are more than
/// a thousandth below the optimum:
///
/// | number | relays | reached | why |
/// | --- | --- | --- | --- |
/// | 1759 | 97 | 0.9805 | interferer right before Rx: a start leads into another basin |
/// | 1637 | 70 | 0.995 | separation impossible next to the interferer: lateral positions are those without the separation |
/// | 1607 | 18 | 0.996 | band of one altitude, and separation that binds along much of the chain |
/// | 957 | 4 | 0.997 | relays alternate between two positions, which are polished one at a time |
/// | 839 | 2 | 0.9987 | both relays would have to move at once |
///
/// The reference itself is short by 0.03 % at 566.
#[test]
fn a_plan_comes_near_the_references_optimum() {
    let optima = optima().unwrap();
    let count: Option<usize> = std::env::var("COUNT")
        .ok()
        .map(|text| text.parse().unwrap());
    let (enough, most) = count.map_or((40, 30), |count| (count, 100));
    let chosen: Vec<u32> = (0..COUNT)
        .filter(|&number| numbered(number).link.len() <= most && optima[number as usize] > 0.0)
        .take(enough)
        .collect();
    let judge = |part: &[u32]| -> Vec<(u32, f64)> {
        let ratio = |&number: &u32| (number, over_the_judge(number, optima[number as usize]));
        part.iter().map(ratio).collect()
    };
    let (left, right) = chosen.split_at(chosen.len() / 2);
    let ratios = std::thread::scope(|scope| {
        let other = scope.spawn(|| judge(right));
        let mut ratios = judge(left);
        ratios.extend(other.join().unwrap());
        ratios
    });
    let judged = ratios.len();
    let better: Vec<_> = ratios
        .iter()
        .filter(|(_, ratio)| *ratio > 1.0 + 1e-5)
        .collect();
    let missed: Vec<_> = ratios.iter().filter(|(_, ratio)| *ratio < 0.999).collect();
    let least = ratios
        .iter()
        .map(|(_, ratio)| *ratio)
        .fold(f64::INFINITY, f64::min);
    println!(
        "{} of {judged} short by more than a thousandth: {missed:?}; least {least}; better than the judge: {better:?}",
        missed.len(),
    );
    assert!(better.len() <= usize::from(count.is_some()), "{better:?}");
    assert!(better.iter().all(|(_, ratio)| *ratio < 1.001));
    assert!(missed.len() * 200 <= judged);
    assert!(least > 0.98);
}

#[test]
fn the_fewest_for_a_target_use_lateral_offsets() {
    let scenario = example("side.toml");
    let target = 0.999 * free(&scenario, Number::Of(8)).sir();
    let fewest = free(&scenario, Number::Meeting(target));
    assert!(fewest.places.len() <= 8 && fewest.sir() >= target && !fewest.proven);
    let fewer = u16::try_from(fewest.places.len()).unwrap() - 1;
    assert!(free(&scenario, Number::Of(fewer)).sir() < target);
    let aside = fewest.places.iter().map(|(place, _)| place.y_m.abs());
    assert!(aside.fold(0.0, f32::max) > 1.0);
    // Mirrored interferer.
    let Interference::Sources(sources) = &scenario.interference else {
        panic!("{scenario:?}");
    };
    let mirrored = Scenario {
        interference: Interference::Sources(vec![Source {
            y_m: -sources[0].y_m,
            ..sources[0].clone()
        }]),
        ..scenario.clone()
    };
    let ratio = free(&mirrored, Number::Of(8)).sir() / free(&scenario, Number::Of(8)).sir();
    assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
}

/// Checks that two interferers at one position act like one interferer with the sum of their powers.
#[test]
fn two_interferers_at_one_position_are_one() {
    let scenario = example("side.toml");
    let Interference::Sources(sources) = &scenario.interference else {
        panic!("{scenario:?}");
    };
    let half = Source {
        power_w: sources[0].power_w / 2.0,
        ..sources[0].clone()
    };
    for relays in [3, 8] {
        let halves = Scenario {
            interference: Interference::Sources(vec![half.clone(), half.clone()]),
            ..scenario.clone()
        };
        let link = Link {
            y_i: sources[0].y_m,
            min_separation_m: scenario.min_separation_m,
            ..Link::paper(usize::from(relays))
        };
        let corridor = Corridor {
            least_m: scenario.altitude_min_m,
            most_m: scenario.altitude_max_m,
            left_m: scenario.lateral_min_m,
            right_m: scenario.lateral_max_m,
        };
        let judge = recorded::optimum(&link, corridor, &[]).unwrap().unwrap();
        let plan = free(&halves, Number::Of(relays));
        let ratio = plan.sir() / judge.sir;
        println!("{relays} relays: {ratio}");
        assert!((0.999..1.000_01).contains(&ratio), "{relays}: {ratio}");
    }
}
