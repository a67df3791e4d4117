//! Locus of equal SIR of both hops of a single relay: the paper's Lemma 1.
//!
//! With u = h^2, a = (x - X)^2 + Y^2, b = x^2, c = (D - x)^2 and G = (p_u / p_t)(mu_nlos / eta)((X - D)^2 + Y^2), SIR_1 = SIR_2
//! is (a + u)(c + u) = G (b + u), or
//!
//! ```text
//! u^2 + (a + c - G) u + a c - G b = 0,
//! ```
//!
//! which is the paper's A u^2 + B u + C = 0 divided by A = p_t. With noise the denominator of SIR_1 has a factor 1 + nu (a + u),
//! K includes the noise at Rx, and
//!
//! ```text
//! (1 - G nu) u^2 + (a + c - G - G nu (a + b)) u + a c - G b - G nu a b = 0.
//! ```
//!
//! Computed in f64, and so exact to the last place of the f32 result. Accuracy: `the_locus_is_where_the_hops_are_equal` in
//! `host-tests/tests/theorems/`.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

use crate::mission::Mission;

/// Returns the altitudes, m, lower first, at which a relay of `power_w` watts at `x_m` has SIR_1 = SIR_2: the paper's h^- and
/// h^+.
///
/// Any `x_m`, m, and `power_w`, W. Altitudes are above 0, and not limited to the mission's band. `None` for each that does not
/// exist, and for both in a field. Constant work.
pub fn altitudes(mission: &Mission, x_m: f32, power_w: f32) -> [Option<f32>; 2] {
    let Some(interferer) = mission.interferer() else {
        return [None; 2];
    };
    let wide = |x: f32| f64::from(x);
    let squared = |x: f64| x * x;
    let x = wide(x_m);
    let a = squared(x - wide(interferer.x_m)) + squared(wide(interferer.y_m));
    let b = squared(x);
    let c = squared(wide(mission.config().distance_m) - x);
    let g = mission.last_to_first(power_w);
    let lost = g * wide(mission.noise_at_a_metre());
    let half = 0.5 * (a + c - g - lost * (a + b));
    let (square, product) = (1.0 - lost, a * c - g * b - lost * a * b);
    let discriminant = half * half - square * product;
    if discriminant < 0.0 {
        return [None; 2];
    }
    // The larger root first, the other one from their product: neither cancels.
    let far = -(half + libm::copysign(libm::sqrt(discriminant), half));
    let near = if libm::fabs(far) > 0.0 {
        product / far
    } else {
        0.0
    };
    let far = far / square;
    [near.min(far), near.max(far)]
        .map(|u| (u > 0.0 && u.is_finite()).then(|| narrow(libm::sqrt(u))))
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "an altitude is given as an f32"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}
