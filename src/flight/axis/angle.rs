//! Angles in the integers that autopilots speak.

/// Degrees of 10⁻⁷, in radians.
pub(super) const UNIT: f64 = core::f64::consts::PI / 1.8e9;

/// Sine and cosine of an angle in units of 10⁻⁷ degrees.
///
/// The angle within an eighth of a turn of an axis is exact in integers; the sine and cosine of that are fdlibm's series, within a unit in the
/// last place. A function for any f64 would be ten times as large, for turns that no place on earth makes.
#[inline(never)] // called from several places
pub(super) fn sine_and_cosine(units: i32) -> [f64; 2] {
    const EIGHTH: i32 = 450_000_000;
    let eighths = units / EIGHTH;
    let quarters = eighths / 2 + eighths % 2;
    let x = f64::from(units - quarters * 2 * EIGHTH) * UNIT;
    let z = x * x;
    let series = |terms: [f64; 6]| terms.into_iter().fold(0.0, |sum, term| sum * z + term);
    let sin = x + x * z * series(SINE);
    let cos = 1.0 - z / 2.0 + z * z * series(COSINE);
    match quarters & 3 {
        0 => [sin, cos],
        1 => [cos, -sin],
        2 => [-sin, -cos],
        _ => [-cos, sin],
    }
}

/// The same angle, which is one turn off at most, from -π to π.
pub(super) fn turned(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}

/// fdlibm's coefficients for up to an eighth of a turn, the highest power first.
const SINE: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_006_8e-6,
    -1.984_126_982_985_795e-4,
    8.333_333_333_322_49e-3,
    -1.666_666_666_666_663_2e-1,
];
const COSINE: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -1.388_888_888_887_411e-3,
    4.166_666_666_666_66e-2,
];

#[cfg(test)]
mod tests {
    use super::{UNIT, sine_and_cosine};

    #[test]
    fn sine_and_cosine_are_those_of_libm() {
        let mut units = i32::MIN;
        for step in 0_i32..20_000 {
            for units in [units, (step - 10_000) * 180_000] {
                let [sin, cos] = sine_and_cosine(units);
                // The angle as an f64 is off by more than the series is.
                let (expected_sin, expected_cos) = libm::sincos(f64::from(units) * UNIT);
                assert!((sin - expected_sin).abs() < 1e-15, "{units}");
                assert!((cos - expected_cos).abs() < 1e-15, "{units}");
            }
            units = units.wrapping_add(214_733);
        }
    }
}
