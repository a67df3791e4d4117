//! Second implementation of the delta-Bullington method, which shares no code with the first.
//!
//! It uses kilometres and gigahertz, and the formulas of Recommendations ITU-R P.452 and P.1812. Their section on
//! diffraction describes the same method.

use std::f64::consts::PI;

/// Profile and link in the units of the ITU Recommendation.
pub(crate) struct Path {
    /// Distances of the profile's points from the first point, km.
    pub(crate) d: Vec<f64>,
    /// Heights of the profile's points above the sea, m.
    pub(crate) h: Vec<f64>,
    pub(crate) hts: f64,
    pub(crate) hrs: f64,
    pub(crate) f_ghz: f64,
    pub(crate) vertical: bool,
    /// Speed of light, m/s. The ITU's examples use 3e8.
    pub(crate) light: f64,
}

const AE_KM: f64 = 8500.0;

/// Parts of the diffraction loss of a hop, dB, named as in ITU-R P.526.
pub(crate) struct Loss {
    pub(crate) actual: f64,
    pub(crate) smooth: f64,
    pub(crate) spherical: f64,
    pub(crate) total: f64,
}

fn j(v: f64) -> f64 {
    if v > -0.78 {
        6.9 + 20.0 * (((v - 0.1).powi(2) + 1.0).sqrt() + v - 0.1).log10()
    } else {
        0.0
    }
}

fn bullington(d: &[f64], h: &[f64], hts: f64, hrs: f64, wavelength: f64) -> f64 {
    let n = d.len();
    let dtot = d[n - 1];
    let ce = 1.0 / AE_KM;
    let (mut stim, mut srim) = (f64::MIN, f64::MIN);
    let mut vmax = f64::MIN;
    for i in 1..n - 1 {
        let curved = h[i] + 500.0 * ce * d[i] * (dtot - d[i]);
        stim = stim.max((curved - hts) / d[i]);
        srim = srim.max((curved - hrs) / (dtot - d[i]));
        let over = curved - (hts * (dtot - d[i]) + hrs * d[i]) / dtot;
        vmax = vmax.max(over * (0.002 * dtot / (wavelength * d[i] * (dtot - d[i]))).sqrt());
    }
    let str_ = (hrs - hts) / dtot;
    let luc = if stim < str_ {
        j(vmax)
    } else {
        let dbp = (hrs - hts + srim * dtot) / (stim + srim);
        let over = hts + stim * dbp - (hts * (dtot - dbp) + hrs * dbp) / dtot;
        j(over * (0.002 * dtot / (wavelength * dbp * (dtot - dbp))).sqrt())
    };
    luc + (1.0 - (-luc / 6.0).exp()) * (10.0 + 0.02 * dtot)
}

fn first_term(d_km: f64, h1: f64, h2: f64, a_km: f64, path: &Path) -> f64 {
    let Path {
        f_ghz,
        vertical,
        light,
        ..
    } = *path;
    // The Recommendations round these factors to 21.88, 0.9575, 0.036 and 18, which changes losses above 100 dB by 0.1
    // dB.
    let per_km = PI * 1e12 / light;
    let to_x = per_km.powf(1.0 / 3.0);
    let to_y = 2.0 * (per_km * per_km / 1e9).powf(1.0 / 3.0);
    let to_k = (2.0 * per_km).powf(-1.0 / 3.0);
    let to_s = 60e-9 * light;
    let (er, sigma) = (22.0_f64, 0.003);
    let s = (to_s * sigma / f_ghz).powi(2);
    let mut k = to_k / ((a_km * f_ghz).powf(1.0 / 3.0) * ((er - 1.0).powi(2) + s).powf(0.25));
    if vertical {
        k *= (er * er + s).sqrt();
    }
    let beta =
        (1.0 + 1.6 * k.powi(2) + 0.67 * k.powi(4)) / (1.0 + 4.5 * k.powi(2) + 1.53 * k.powi(4));
    let x = to_x * beta * (f_ghz / (a_km * a_km)).powf(1.0 / 3.0) * d_km;
    let fx = if x >= 1.6 {
        11.0 + 10.0 * x.log10() - 17.6 * x
    } else {
        -20.0 * x.log10() - 5.6488 * x.powf(1.425)
    };
    let g = |h: f64| {
        let b = beta * to_y * beta * (f_ghz * f_ghz / a_km).powf(1.0 / 3.0) * h;
        let g = if b > 2.0 {
            17.6 * (b - 1.1).sqrt() - 5.0 * (b - 1.1).log10() - 8.0
        } else {
            20.0 * (b + 0.1 * b.powi(3)).log10()
        };
        g.max(2.0 + 20.0 * k.log10())
    };
    -fx - g(h1) - g(h2)
}

/// Returns the diffraction loss of the smooth earth, dB.
///
/// A bisection finds the point at which the line of sight is closest to the earth. There both antennas have the same
/// elevation angle, as at a point of reflection.
fn spherical(d_km: f64, h1: f64, h2: f64, path: &Path) -> f64 {
    let horizon = (2.0 * AE_KM / 1000.0).sqrt() * (h1.sqrt() + h2.sqrt());
    if d_km >= horizon {
        return first_term(d_km, h1, h2, AE_KM, path);
    }
    let above = |h: f64, d: f64| h - 500.0 * d * d / AE_KM;
    let (mut low, mut high) = (0.0, d_km);
    for _ in 0..200 {
        let d1 = 0.5 * (low + high);
        if above(h1, d1) / d1 > above(h2, d_km - d1) / (d_km - d1) {
            low = d1;
        } else {
            high = d1;
        }
    }
    let inside = 0.5 * (low + high);
    let clearance = |d1: f64| (above(h1, d1) * (d_km - d1) + above(h2, d_km - d1) * d1) / d_km;
    let wavelength = path.light / (path.f_ghz * 1e9);
    let required = 17.456 * (inside * (d_km - inside) * wavelength / d_km).sqrt();
    if clearance(inside) > required {
        return 0.0;
    }
    let touching = 500.0 * (d_km / (h1.sqrt() + h2.sqrt())).powi(2);
    let ft = first_term(d_km, h1, h2, touching, path);
    if ft < 0.0 {
        0.0
    } else {
        (1.0 - clearance(inside) / required) * ft
    }
}

impl Path {
    pub(crate) fn loss(&self) -> Loss {
        let (d, h, n) = (&self.d, &self.h, self.d.len());
        let dtot = d[n - 1];
        let (mut v1, mut v2) = (0.0, 0.0);
        for i in 1..n {
            v1 += (d[i] - d[i - 1]) * (h[i] + h[i - 1]);
            v2 += (d[i] - d[i - 1])
                * (h[i] * (2.0 * d[i] + d[i - 1]) + h[i - 1] * (d[i] + 2.0 * d[i - 1]));
        }
        let (hst, hsr) = (
            (2.0 * v1 * dtot - v2) / dtot.powi(2),
            (v2 - v1 * dtot) / dtot.powi(2),
        );
        let over = |i: usize| h[i] - (self.hts * (dtot - d[i]) + self.hrs * d[i]) / dtot;
        let hobs = (1..n - 1).map(over).fold(f64::MIN, f64::max);
        let (mut hstp, mut hsrp) = (hst, hsr);
        if hobs > 0.0 {
            let at = (1..n - 1).map(|i| over(i) / d[i]).fold(f64::MIN, f64::max);
            let ar = (1..n - 1)
                .map(|i| over(i) / (dtot - d[i]))
                .fold(f64::MIN, f64::max);
            hstp = hst - hobs * at / (at + ar);
            hsrp = hsr - hobs * ar / (at + ar);
        }
        let (h1, h2) = (self.hts - hstp.min(h[0]), self.hrs - hsrp.min(h[n - 1]));
        let wavelength = self.light / (self.f_ghz * 1e9);
        let actual = bullington(d, h, self.hts, self.hrs, wavelength);
        let smooth = bullington(d, &vec![0.0; n], h1, h2, wavelength);
        let spherical = spherical(dtot, h1, h2, self);
        Loss {
            actual,
            smooth,
            spherical,
            total: actual + (spherical - smooth).max(0.0),
        }
    }
}
