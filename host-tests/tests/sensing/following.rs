//! Moving interferer, compared with a chain that stays in its first optimum.

use uav_relay_tools::listening::{mean, moving_shares, quantile};

use crate::count;

#[test]
fn a_moving_interferer_is_followed() {
    for (relays, speed_mps, least) in [
        (8, 1.2, 0.96),
        (8, 3.0, 0.95),
        (8, 9.0, 0.88),
        (3, 1.2, 0.0),
        (3, 3.0, 0.0),
        (3, 9.0, 0.0),
    ] {
        let mut shares = moving_shares(count(20), relays, speed_mps).unwrap();
        let (follows, stays) = (mean(&shares.followed), mean(&shares.stayed));
        println!(
            "N = {relays}, {speed_mps} m/s: {follows:.4} followed (the worst scene {:.4}), {stays:.4} stayed",
            quantile(&mut shares.followed, 0.0),
        );
        assert!(follows >= least && follows > stays, "{relays}, {speed_mps}");
    }
}
