//! Two-way chains that have to locate the interferer, compared with the judge's best positions.

use host_tests::placing::xs;
use uav_relay::Interference;
use uav_relay_oracle::random::count;
use uav_relay_scenario::Interference as Known;
use uav_relay_sim::simulator::chain::run;
use uav_relay_tools::listening::RandomScene;

use super::judge::Chain;
use super::scenes::{ENDS, narrow};
use super::shares::Shares;

#[test]
fn an_interferer_that_is_located_is_placed_for_in_both_directions() {
    let [mut first, mut last, mut told] = [(); 3].map(|()| Shares::default());
    for round in 0..count(12) {
        let relays = [3, 5, 8][round % 3];
        let ends = ENDS[round / 3 % 3];
        let mut wild = RandomScene::new(round as u64, relays, 1);
        wild.scenario.reverse = [1.0, 0.25][round % 2];
        (wild.scenario.tx_w, wild.scenario.rx_w) = (ends[0], ends[1]);
        wild.scenario.min_separation_m = 0.0;
        let Known::Sources(sources) = &wild.scenario.interference else {
            panic!("an interferer");
        };
        let source = &sources[0];
        let mission = wild.mission(Interference::Unknown).unwrap();
        let channel = mission.config().channel;
        let mut powers_w = vec![wild.scenario.uav_w; usize::from(relays) + 2];
        (powers_w[0], powers_w[usize::from(relays) + 1]) = (ends[0], ends[1]);
        let chain = Chain {
            distance_m: wild.scenario.distance_m,
            powers_w,
            altitude_m: wild.scenario.altitude_m,
            altitudes_m: Vec::new(),
            apart_m: 0.0,
            interferer: [source.power_w, source.x_m, source.y_m].map(narrow),
            others: Vec::new(),
            field: Vec::new(),
            loss: [channel.eta(), channel.mu_nlos()],
            noise_w: 0.0,
            reverse: wild.scenario.reverse,
        };
        let outcome = run(wild.setup(Interference::Unknown).unwrap()).unwrap();
        let mut sirs = Vec::new();
        for stand in &outcome.snapshots {
            if stand.agreements as usize > sirs.len()
                && let Some(goals) = &stand.goals
            {
                sirs.push(chain.value(&xs(goals)));
            }
        }
        let best = chain.best().0;
        let places = wild.known_positions().unwrap();
        told.push(chain.value(&xs(&places)) / best);
        first.push(sirs[0] / best);
        last.push(sirs.last().unwrap() / best);
        // The SIR in reports also counts the worse direction.
        let reported = wild.scene().unwrap().chain_sir(&places);
        let judged = chain.value(&xs(&places));
        assert!(
            (reported / judged - 1.0).abs() < 1e-5,
            "{reported} {judged}"
        );
    }
    first.report("before any measurement");
    last.report("after the last agreement");
    told.report("told the interferer");
    assert!(told.worst() > 1.0 - 1e-3);
    assert!(last.percentile(50.0) > 0.95, "{}", last.percentile(50.0));
    assert!(last.percentile(50.0) > first.percentile(50.0));
}
