//! Offers that are withheld in a live session and replayed later.

use crate::air::mission;
use uav_relay::MAX_FRAME;
use uav_relay::{
    Ground, Interference, Interferer, Mission, MissionConfig, Progress, Settings, Side, Upload,
    Wiring,
};

use crate::air::{Air, KEY, auth};

fn moved(base: &Mission, version: u16) -> Upload {
    let interference = Interference::Source(Interferer {
        power_w: 80.0,
        x_m: 700.0,
        y_m: 100.0 * f32::from(version),
    });
    let config = MissionConfig {
        interference,
        ..*base.config()
    };
    Upload::new(base, version, config).unwrap()
}

/// Offers are by far the longest frames of the ground.
const fn is_offer(bytes: &[u8]) -> bool {
    bytes.len() > MAX_FRAME - 24
}

fn station(base: &Mission, epoch: u32) -> Ground {
    Ground::new(
        base,
        Side::Upstream,
        7,
        Wiring::Shared,
        auth(KEY, epoch).unwrap(),
    )
}

/// Returns four relays, and the withheld offers of version 1.
fn caught(base: &Mission, loss: f64) -> (Air, Vec<Vec<u8>>) {
    let mut air = Air::of(base, |_| auth(KEY, 1), loss);
    air.run(60);
    air.withheld = is_offer;
    begin_upload(&mut air, base, 1);
    while air.recorded.is_empty() {
        air.run(1);
    }
    air.ground = None;
    let offers = std::mem::take(&mut air.recorded);
    (air, offers)
}

fn begin_upload(air: &mut Air, base: &Mission, epoch: u32) {
    let mut ground = station(base, epoch);
    ground.upload(air.now, moved(base, 1)).unwrap();
    air.ground = Some(ground);
}

/// An attacker withholds the ground's offers and replays them after the upload was given up.
#[test]
fn an_offer_that_was_withheld_is_refused_and_the_true_one_is_flown_all_the_same() {
    let after = Settings::default().dead_after.times(2).as_micros() / 1_000_000;
    for (wait, loss) in [(after + 2, 0.0), (3_600, 0.0), (after + 2, 0.3)] {
        let base = mission(4);
        let (mut air, mut offers) = caught(&base, loss);
        air.run(wait);
        offers.append(&mut air.recorded);
        let stale = |air: &Air| {
            air.relays
                .iter()
                .map(|relay| relay.stats().stale)
                .sum::<u32>()
        };
        let before = stale(&air);
        for _ in 0..5 {
            for offer in &offers {
                air.play(offer);
            }
            air.run(1);
        }
        assert!(
            air.relays.iter().all(|relay| relay.upload().is_none()),
            "wait {wait}"
        );
        assert!(stale(&air) > before, "it is counted");
        // A new session of the ground station uploads the same mission.
        air.withheld = |_| false;
        begin_upload(&mut air, &base, 2);
        let mut seconds = 0;
        while air.relays.iter().any(|relay| relay.version() != 1) {
            air.run(1);
            seconds += 1;
            assert!(seconds < 300, "loss {loss}");
        }
        println!("flown by all {seconds} s after the upload began, loss {loss}");
        air.run(10);
        let progress = air.ground.as_ref().unwrap().progress();
        assert!(matches!(progress, Progress::Flown { .. }), "{progress:?}");
    }
}

/// The same offer is accepted within the time limit: only the delay matters.
#[test]
fn an_offer_that_comes_at_once_is_taken() {
    let base = mission(4);
    let (mut air, offers) = caught(&base, 0.0);
    air.run(10);
    air.play(&offers[0]);
    air.run(1);
    assert!(air.relays[0].upload().is_some());
}
