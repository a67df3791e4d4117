//! Whether the target that was found is the highest there is.
//!
//! Where one interferer is known and all relays are alike, it is. In an uneven field the search may have stepped over a
//! narrow hill (see [`scan`](super::scan)); but if every hop from a place farther on ends farther on as well, a higher
//! target leaves every relay nearer to Rx, and the first hop, if it fails there for every place from the first relay's on,
//! fails for every higher target.

use crate::mission::Mission;
use crate::root::sqrt;
use crate::sir::square;

/// Whether no target above `target` (linear) can be met by a chain of equals, whose first relay stands at `first_m` for it, m.
///
/// `false` means that it is not known. Work: two square roots a point of the field.
pub fn is_most(mission: &Mission, target: f32, first_m: f32) -> bool {
    let Some(field) = mission.field() else {
        return true;
    };
    if field.is_constant() {
        return true;
    }
    let config = mission.config();
    let per_unit = mission.relay_gain(config.common.power_w).value() / (target * field.largest());
    let first = mission.tx_gain().value() / (target * field.largest());
    let beyond = square(config.common.altitude_m);
    let mut pairs = field.points().windows(2);
    let stretches = pairs.all(|pair| {
        let [left, right] = pair else { return true };
        let slope = (right.upsilon_per_w - left.upsilon_per_w) / (right.x_m - left.x_m);
        // d = sqrt(c Upsilon): d' = c slope / 2d, steepest where Upsilon is least.
        let step = sqrt(per_unit * left.upsilon_per_w);
        let ordered = slope <= 0.0 || per_unit * slope <= 2.0 * step;
        // The first hop fails at x if c Upsilon(x) - h^2 < x^2; the left side minus the right has its top at c slope / 2.
        let (low, high) = (left.x_m.max(first_m), right.x_m.min(config.distance_m));
        if low >= high {
            return ordered;
        }
        let top = (0.5 * first * slope).max(low).min(high);
        let excess = first * field.upsilon(top) - beyond - square(top);
        ordered && excess <= 1e-3 * square(top)
    });
    let last = field.points().last().map_or(0.0, |point| point.x_m);
    let held = first_m.max(last);
    // Beyond the points Upsilon is what it is at the last of them.
    stretches && first * field.upsilon(held) - beyond - square(held) <= 1e-3 * square(held)
}
