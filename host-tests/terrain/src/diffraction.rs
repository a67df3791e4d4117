//! Diffraction loss of a terrain profile by Recommendation ITU-R P.526-15, section 4.5.
//!
//! It is the "delta-Bullington" method.
//!
//! The Bullington construction replaces the terrain by one knife edge, at the point where the horizons of the two
//! antennas meet. Its loss is La above the terrain and Ls above a smooth earth. The true loss of the smooth earth is
//! Lsph. The method returns L = La + max(Lsph - Ls, 0).
//!
//! | quantity | function | section of P.526-15 |
//! | --- | --- | --- |
//! | J(v), loss of a knife edge | [`knife_edge_db`] | 4.1 |
//! | La and Ls, Bullington's loss above the terrain and above a smooth earth | `bullington_db` | 4.5 |
//! | heights of the antennas above the smooth earth | `smooth_heights_m` | 4.5 |
//! | Lsph, loss of the smooth earth | `spherical_db` | 3.2, with the first term of 3.1.1 |
//!
//! All lengths are in metres. At the distances d1 and d2 from two points, the earth rises by d1 d2 / 2a above the
//! straight line between them; a is the effective earth radius. The ground is average land (relative permittivity 22,
//! 0.003 S/m), and the polarisation is vertical; above 100 MHz both have little effect.

/// Effective radius of the earth for radio propagation, m: 4/3 of the real radius.
pub const EARTH_M: f64 = 8.5e6;

/// Speed of light, m/s.
pub const LIGHT_M_S: f64 = 299_792_458.0;

/// Point of a profile: distance along the ground from the first antenna, m, and ground height, m.
pub type Point = [f64; 2];

/// Electrical properties of the ground, and the polarisation of the antennas.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Surface {
    /// Relative permittivity of the ground.
    pub permittivity: f64,
    /// Conductivity of the ground, S/m.
    pub conductivity: f64,
    /// True for vertical, false for horizontal polarisation.
    pub is_vertical: bool,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            permittivity: 22.0,
            conductivity: 0.003,
            is_vertical: true,
        }
    }
}

/// Returns the diffraction loss of the path over `profile`, dB, at least 0; equal in both directions.
///
/// `ends_m` are the heights above the sea of the antennas at the first and the last point of the profile. The profile
/// has at least two points; their distances begin with 0 and increase.
pub fn loss_db(profile: &[Point], ends_m: [f64; 2], wavelength_m: f64) -> f64 {
    loss_over_db(profile, ends_m, wavelength_m, Surface::default())
}

/// Returns the diffraction loss, dB, for the ground `surface`. See [`loss_db`].
pub fn loss_over_db(
    profile: &[Point],
    ends_m: [f64; 2],
    wavelength_m: f64,
    surface: Surface,
) -> f64 {
    let Some(&[length, _]) = profile.last().filter(|[length, _]| *length > 0.0) else {
        return 0.0;
    };
    let actual = bullington_db(profile.iter().copied(), length, ends_m, wavelength_m);
    let heights = smooth_heights_m(profile, ends_m);
    let flat = profile.iter().map(|[d, _]| [*d, 0.0]);
    let smooth = bullington_db(flat, length, heights, wavelength_m);
    let spherical = spherical_db(length, heights, wavelength_m, surface);
    actual + (spherical - smooth).max(0.0)
}

/// Returns the loss of a knife edge with the diffraction parameter `v`, dB, at least 0.
pub fn knife_edge_db(v: f64) -> f64 {
    if v <= -0.78 {
        return 0.0;
    }
    let over = v - 0.1;
    6.9 + 20.0 * ((over * over + 1.0).sqrt() + over).log10()
}

/// Returns the loss of the Bullington construction (one knife edge), dB.
///
/// `from`, `to` and the points of the profile are heights above the sea, m.
fn bullington_db(
    profile: impl Iterator<Item = Point> + Clone,
    length: f64,
    [from, to]: [f64; 2],
    wavelength: f64,
) -> f64 {
    let inner = profile.filter(|[d, _]| *d > 0.0 && *d < length);
    let raised = inner.map(|[d, height]| (d, height + d * (length - d) / (2.0 * EARTH_M)));
    let slope = (to - from) / length;
    // Diffraction parameter of an edge at the distance d. `above` is the edge's height above the line between the
    // antennas.
    let parameter =
        |d: f64, above: f64| above * (2.0 * length / (wavelength * d * (length - d))).sqrt();
    let above = |d: f64, height: f64| height - (from + slope * d);
    let rise = raised.clone().map(|(d, height)| (height - from) / d);
    let rise = rise.fold(f64::NEG_INFINITY, f64::max);
    let edge = if rise < slope {
        let all = raised.map(|(d, height)| parameter(d, above(d, height)));
        all.fold(f64::NEG_INFINITY, f64::max)
    } else {
        let fall = raised.map(|(d, height)| (height - to) / (length - d));
        let fall = fall.fold(f64::NEG_INFINITY, f64::max);
        // The horizon lines of the two antennas meet between them, or at an antenna that is below the ground.
        let meet = ((to - from + fall * length) / (rise + fall))
            .clamp(1e-6 * length, (1.0 - 1e-6) * length);
        // If the horizon lines have no single meeting point, the ground just touches the line of sight.
        if meet.is_nan() {
            0.0
        } else {
            parameter(meet, above(meet, from + rise * meet))
        }
    };
    let loss = if edge.is_finite() {
        knife_edge_db(edge)
    } else {
        0.0
    };
    loss + (1.0 - (-loss / 6.0).exp()) * (10.0 + 0.02 * length / 1000.0)
}

/// Returns the heights of the antennas above a smooth surface, m, at least 0.
///
/// The surface is fitted to the profile.
fn smooth_heights_m(profile: &[Point], [from, to]: [f64; 2]) -> [f64; 2] {
    let (Some([_, first]), Some([length, last])) = (profile.first(), profile.last()) else {
        return [0.0; 2];
    };
    let (mut v1, mut v2) = (0.0, 0.0);
    for ([d0, h0], [d, h]) in profile.iter().zip(profile.iter().skip(1)) {
        v1 += (d - d0) * (h + h0);
        v2 += (d - d0) * (h * (2.0 * d + d0) + h0 * (d + 2.0 * d0));
    }
    let mut surface = [
        (2.0 * v1 * length - v2) / (length * length),
        (v2 - v1 * length) / (length * length),
    ];
    // These are the highest obstacle, and the steepest angles to obstacles, above the line between the antennas.
    let mut highest: f64 = 0.0;
    let mut angles: [f64; 2] = [0.0; 2];
    for [d, h] in profile.iter().filter(|[d, _]| *d > 0.0 && d < length) {
        let above = h - (from * (length - d) + to * d) / length;
        highest = highest.max(above);
        angles = [
            angles[0].max(above / d),
            angles[1].max(above / (length - d)),
        ];
    }
    if highest > 0.0 {
        let sum = angles[0] + angles[1];
        surface = [
            surface[0] - highest * angles[0] / sum,
            surface[1] - highest * angles[1] / sum,
        ];
    }
    [from - surface[0].min(*first), to - surface[1].min(*last)].map(|height| height.max(0.0))
}

/// Returns the diffraction loss of a smooth spherical earth, dB.
///
/// `heights` are the heights of the antennas above this sphere, m.
fn spherical_db(length: f64, heights: [f64; 2], wavelength: f64, surface: Surface) -> f64 {
    let [h1, h2] = heights;
    let roots = h1.sqrt() + h2.sqrt();
    if length >= (2.0 * EARTH_M).sqrt() * roots {
        return first_term_db(length, heights, wavelength, EARTH_M, surface);
    }
    // This is the point at which the line of sight is closest to the earth, and its clearance there.
    let c = (h1 - h2) / (h1 + h2);
    let m = length * length / (4.0 * EARTH_M * (h1 + h2));
    let inner = 3.0 * c / 2.0 * (3.0 * m / (m + 1.0).powi(3)).sqrt();
    let b = 2.0
        * ((m + 1.0) / (3.0 * m)).sqrt()
        * (std::f64::consts::FRAC_PI_3 + inner.clamp(-1.0, 1.0).acos() / 3.0).cos();
    let d1 = length / 2.0 * (1.0 + b);
    let d2 = length - d1;
    let bulge = |d: f64| d * d / (2.0 * EARTH_M);
    let clearance = ((h1 - bulge(d1)) * d2 + (h2 - bulge(d2)) * d1) / length;
    let required = 0.552 * (d1 * d2 * wavelength / length).sqrt();
    if clearance > required {
        return 0.0;
    }
    // This is the earth radius at which the line of sight just touches the earth.
    let touching = 0.5 * (length / roots).powi(2);
    let loss = first_term_db(length, heights, wavelength, touching, surface);
    (1.0 - clearance / required) * loss.max(0.0)
}

/// Returns the first term of the residue series of spherical-earth diffraction, dB; it may be below 0.
fn first_term_db(
    length: f64,
    heights: [f64; 2],
    wavelength: f64,
    radius: f64,
    surface: Surface,
) -> f64 {
    use std::f64::consts::PI;
    let Surface {
        permittivity,
        conductivity,
        is_vertical,
    } = surface;
    // Normalised admittance K of the ground.
    let imaginary = 60.0 * wavelength * conductivity;
    let square = imaginary * imaginary;
    let horizontal = (2.0 * PI * radius / wavelength).powf(-1.0 / 3.0)
        * ((permittivity - 1.0).powi(2) + square).powf(-0.25);
    let k = if is_vertical {
        horizontal * (permittivity * permittivity + square).sqrt()
    } else {
        horizontal
    };
    let k2 = k * k;
    let beta = (1.0 + 1.6 * k2 + 0.67 * k2 * k2) / (1.0 + 4.5 * k2 + 1.53 * k2 * k2);
    let x = beta * (PI / (wavelength * radius * radius)).cbrt() * length;
    let distance = if x >= 1.6 {
        11.0 + 10.0 * x.log10() - 17.6 * x
    } else {
        -20.0 * x.log10() - 5.6488 * x.powf(1.425)
    };
    let gain = |height: f64| {
        let y = 2.0 * beta * (PI * PI / (wavelength * wavelength * radius)).cbrt() * height;
        let b = beta * y;
        let gain = if b > 2.0 {
            17.6 * (b - 1.1).sqrt() - 5.0 * (b - 1.1).log10() - 8.0
        } else {
            20.0 * (b + 0.1 * b * b * b).log10()
        };
        gain.max(2.0 + 20.0 * k.log10())
    };
    -distance - gain(heights[0]) - gain(heights[1])
}
