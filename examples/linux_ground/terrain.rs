//! Ground below the line from Tx to Rx, for the page.

use uav_relay::flight::axis::Axis;
use uav_relay::{Placement, Sites};
use uav_relay_scenario::TerrainSpec;
use uav_relay_screen::GroundProfile;
use uav_relay_terrain::grid::Terrain;
use uav_relay_terrain::profile::Ground;

/// Number of parts into which a terrain profile is divided. Each part has the height of its highest ground.
const PARTS: u16 = 240;

/// Elevation model of the configuration file, and the terrain profile below the chain's line Tx to Rx.
pub(crate) struct Elevation {
    terrain: Terrain,
    mast_m: f64,
    /// Positions of Tx and Rx for which `profile` was computed; `None` until a profile is computed.
    line: Option<Sites>,
    profile: Option<GroundProfile>,
}

impl Elevation {
    /// Reads the elevation files of the configuration file.
    ///
    /// # Errors
    /// One line that names the file and the fault.
    pub(crate) fn load(spec: &TerrainSpec) -> Result<Self, String> {
        Ok(Self {
            terrain: Terrain::load(&spec.files)?,
            mast_m: spec.mast_m,
            line: None,
            profile: None,
        })
    }

    /// Returns the terrain profile below the line Tx to Rx given by `line`.
    ///
    /// `None` if an earlier call for the same line has returned an error.
    ///
    /// # Errors
    /// One line with the reason, for example that the elevation files do not cover the line. Only the first call for a
    /// line returns it.
    pub(crate) fn along(&mut self, line: Sites) -> Result<Option<GroundProfile>, String> {
        if self.line != Some(line) {
            (self.line, self.profile) = (Some(line), None);
            self.profile = Some(profile(&self.terrain, self.mast_m, line)?);
        }
        Ok(self.profile.clone())
    }
}

fn profile(terrain: &Terrain, mast_m: f64, line: Sites) -> Result<GroundProfile, String> {
    let axis = Axis::between(line).map_err(|error| error.to_string())?;
    let ground = Ground::new(terrain, axis, [line.tx, line.rx], mast_m)?;
    let length_m = axis.distance_m();
    let part_m = length_m / f64::from(PARTS);
    let points = ground.line([[0.0, 0.0], [length_m, 0.0]])?;
    let highest_m = |part: u16| {
        let ends = [-0.5, 0.5].map(|off| (part_m * (f64::from(part) + off)).clamp(0.0, length_m));
        let inner = points
            .iter()
            .filter(|[x_m, _]| (ends[0]..=ends[1]).contains(x_m));
        let ends = ends.map(|x_m| Ok([x_m, ground.height_m(x_m, 0.0)?]));
        let mut highest_m = f64::NEG_INFINITY;
        for point in inner.copied().map(Ok::<_, String>).chain(ends) {
            let [x_m, height_m] = point?;
            // Altitudes of the chain count from the straight line between the sites.
            let datum_m = ground.relay(Placement::on_line(narrow(x_m), 0.0))?.amsl_m;
            highest_m = highest_m.max(height_m - datum_m);
        }
        Ok((10.0 * highest_m).round() / 10.0)
    };
    Ok(GroundProfile {
        length_m,
        mast_m,
        heights_m: (0..=PARTS).map(highest_m).collect::<Result<_, String>>()?,
    })
}

#[expect(clippy::cast_possible_truncation, reason = "metres of a mission")]
const fn narrow(metres: f64) -> f32 {
    metres as f32
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by it")]

    use std::path::Path;

    use uav_relay::Sites;
    use uav_relay_scenario::TerrainSpec;

    use super::Elevation;

    #[test]
    fn a_profile_has_the_highest_ground_of_each_part_above_the_line_of_the_sites() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hills.tif");
        let mut elevation = Elevation::load(&TerrainSpec::of(vec![file])).unwrap();
        let site = |text| uav_relay_linux::site::site(text).unwrap();
        let line = Sites {
            tx: site("47.20,8.510,482"),
            rx: site("47.20,8.576,500"),
        };
        let profile = elevation.along(line).unwrap().unwrap();
        assert_eq!((profile.heights_m.len(), profile.mast_m), (241, 2.0));
        assert!((4_990.0..5_010.0).contains(&profile.length_m));
        let sites = [0, 240].map(|at: usize| *profile.heights_m.get(at).unwrap());
        assert!(sites.iter().all(|it| it.abs() < 15.0), "{sites:?}");
        // The formula of the made-up hills, at its summits, less the line from 482 to 500 m.
        for (part, height_m) in (0_u16..).zip(&profile.heights_m) {
            let x_m = profile.length_m * f64::from(part) / 240.0;
            let datum_m = 482.0 + 18.0 * x_m / profile.length_m;
            let lon_deg = 8.510 + 0.066 * x_m / profile.length_m;
            let model_m = elevation.terrain.height_m(47.20, lon_deg).unwrap();
            let above_m = height_m + datum_m - model_m;
            assert!((-0.3..8.0).contains(&above_m), "{x_m} m: {above_m} m");
        }
        // Another line outside of the files is refused once, and then has no profile.
        let away = Sites {
            rx: site("47.90,8.576,500"),
            ..line
        };
        let error = elevation.along(away).unwrap_err();
        assert!(error.contains("site.rx"), "{error}");
        assert_eq!(elevation.along(away), Ok(None));
        assert!(elevation.along(line).unwrap().is_some());
    }
}
