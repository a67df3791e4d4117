//! Terrain below a plan: its elevation files, its report, and the picture of its profile.

use std::path::PathBuf;

use uav_relay_scenario::Interference;
use uav_relay_scenario::area::Area;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Scenario, TerrainSpec};
use uav_relay_terrain::diffraction::LIGHT_M_S;
use uav_relay_terrain::grid::Terrain;
use uav_relay_terrain::profile::{Ground, State, bulge_m};
use uav_relay_terrain::report::{FreeSpace, InterfererHeight, TerrainReport};

use super::Plan;
use crate::figures::chart::{Axis, Chart, Line, Look, Stroke};

/// Position error of a relay, m, if the scenario has no `companion.position_error_m`.
///
/// It is the default of the program on the relay's companion computer.
pub const POSITION_ERROR_M: f64 = 1.0;

/// Elevation model of a scenario.
#[expect(missing_debug_implementations, reason = "millions of heights")]
pub struct Elevation {
    /// Terrain of the scenario. If the option `--dem` is given, the files are those of the option.
    pub spec: TerrainSpec,
    terrain: Terrain,
    /// Position error of the relays, m. Obstacles within this distance count as below the relay.
    position_error_m: f64,
}

impl Elevation {
    /// Reads the elevation files `dem`, or those of the scenario if `dem` is empty; `None` without files.
    ///
    /// # Errors
    /// A text that names the file and the problem.
    pub fn load(
        scenario: &Scenario,
        dem: &[PathBuf],
        position_error_m: f64,
    ) -> Result<Option<Self>, String> {
        let mut spec = scenario.terrain.clone();
        if !dem.is_empty() {
            let spec = spec.get_or_insert_with(|| TerrainSpec::of(Vec::new()));
            spec.files = dem.to_vec();
        }
        let Some(spec) = spec else { return Ok(None) };
        if scenario.line.is_none() {
            return Err("site: is missing, but elevation files need it; allowed: [site] with tx and rx, each { lat_deg, lon_deg, amsl_m }".to_owned());
        }
        let terrain = Terrain::load(&spec.files)?;
        Ok(Some(Self {
            spec,
            terrain,
            position_error_m,
        }))
    }

    /// Returns the terrain along the line Tx-Rx of `scenario`.
    ///
    /// # Errors
    /// A text that names the reason: no Tx and Rx sites in the scenario, a site that the files do not cover, or a site
    /// whose height contradicts the files.
    pub fn ground(&self, scenario: &Scenario) -> Result<Ground<'_>, String> {
        let line = scenario.line.as_ref().ok_or("site: is missing")?;
        let ground = Ground::new(&self.terrain, line.axis, line.sites, self.spec.mast_m)?;
        Ok(ground.with_error_m(self.spec.error_m))
    }

    /// Returns the scene of `relays` relays, with interferers that stand on the ground.
    ///
    /// `None` if the scenario lists no interferer, for example because it has the interference along the line Tx-Rx. An
    /// interferer that the files do not cover is at altitude 0.
    ///
    /// # Errors
    /// Those of [`ground`](Self::ground).
    pub fn scene(&self, scenario: &Scenario, relays: u16) -> Result<Option<Scene>, String> {
        let Some(scene) = Scene::new(scenario, relays) else {
            return Ok(None);
        };
        let heights = self.interferers(scenario)?.into_iter();
        let heights_m = heights.filter_map(|one| Some((one.index - 1, one.altitude_m?)));
        Ok(Some(Scene {
            heights_m: heights_m.collect(),
            ..scene
        }))
    }

    /// Returns the lowest and highest altitude of each interferer; empty if the scenario lists none.
    fn interferers(&self, scenario: &Scenario) -> Result<Vec<InterfererHeight>, String> {
        let Interference::Sources(sources) = &scenario.interference else {
            return Ok(Vec::new());
        };
        let ground = self.ground(scenario)?;
        let each = sources.iter().enumerate().map(|(at, source)| {
            let places = match scenario.areas.get(&at) {
                None => ground
                    .height_m(source.x_m, source.y_m)
                    .map(|height| vec![[source.x_m, source.y_m, height]]),
                Some(source) => heights(&ground, &source.area),
            };
            let mast_m = scenario.masts_m.get(&at).copied().unwrap_or_default();
            let none = [f64::INFINITY, f64::NEG_INFINITY];
            let altitude_m = places.ok().and_then(|places| {
                places
                    .into_iter()
                    .try_fold(none, |[low, high], [x, y, height]| {
                        let datum_m = f64::from(ground.point(x, y).ok()?.amsl_mm) / 1e3;
                        let altitude = height - datum_m + mast_m;
                        Some([low.min(altitude), high.max(altitude)])
                    })
            });
            InterfererHeight {
                index: at + 1,
                altitude_m,
            }
        });
        Ok(each.collect())
    }

    /// Returns the lowest and the highest ground within `aside_m` of the line Tx-Rx, m above the sea.
    ///
    /// The highest ground includes the assumed error of the heights.
    ///
    /// # Errors
    /// A text that names the place: it is not covered by the elevation files, or has no height.
    pub fn corridor_m(&self, scenario: &Scenario, aside_m: f64) -> Result<[f64; 2], String> {
        let ground = self.ground(scenario)?;
        let [from, to] = [[0.0, -aside_m], [scenario.distance_m, aside_m]];
        let corners = vec![from, [to[0], from[1]], to, [from[0], to[1]]];
        let heights = heights(&ground, &Area::Polygon(corners))?;
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        Ok(heights
            .into_iter()
            .fold(none, |[low, high], [x, _, height]| {
                [low.min(height), high.max(height + ground.raise_m(x))]
            }))
    }

    /// Returns the report of the terrain below `plan`.
    ///
    /// # Errors
    /// A text that names the place: it is not covered by the elevation files, or has no height.
    pub fn report(&self, scenario: &Scenario, plan: &Plan) -> Result<TerrainReport, String> {
        let chain = plan.chain();
        let relays = u16::try_from(chain.len()).unwrap_or(u16::MAX);
        let [sirs, sirs_back] = match self.scene(scenario, relays)? {
            Some(scene) => [scene.hop_sirs(&chain), scene.hop_sirs_back(&chain)],
            None => [plan.sirs.clone(), plan.sirs_back(scenario)],
        };
        let free = FreeSpace {
            sirs: &sirs,
            sirs_back: &sirs_back,
            reverse: scenario.reverse,
        };
        let carrier_hz = scenario.channel.carrier_hz;
        let ground = self.ground(scenario)?;
        let report = TerrainReport::new(&ground, &chain, free, carrier_hz, self.position_error_m)?;
        Ok(TerrainReport {
            interferers: self.interferers(scenario)?,
            ..report
        })
    }

    /// Returns the reason why the chain of `report` cannot be flown; `None` if it can.
    ///
    /// With `allow_blocked`, blocked hops are no reason.
    pub fn problem(&self, report: &TerrainReport, allow_blocked: bool) -> Option<String> {
        let most_m = self.spec.above_ground_max_m;
        let blocked = report.blocked().filter(|_| !allow_blocked);
        let lines = [
            report.too_low(self.spec.above_ground_m),
            most_m.and_then(|most_m| report.too_high(most_m)),
            blocked.map(|line| format!("{line}; --allow-blocked accepts it")),
        ];
        let lines: Vec<String> = lines.into_iter().flatten().collect();
        (!lines.is_empty()).then(|| lines.join("; "))
    }

    pub(super) const fn position_error_m(&self) -> f64 {
        self.position_error_m
    }

    /// Returns the least and the greatest height of a relay above the ground, m.
    pub(super) fn band_m(&self) -> [f64; 2] {
        let most_m = self.spec.above_ground_max_m;
        [self.spec.above_ground_m, most_m.unwrap_or(f64::INFINITY)]
    }
}

/// Returns points [x, y, height] of an area, m, among them its highest and its lowest ground.
///
/// The highest and lowest ground are at nodes of the elevation model, or on the boundary.
fn heights(ground: &Ground<'_>, area: &Area) -> Result<Vec<[f64; 3]>, String> {
    let mut points = Vec::new();
    let corners = area.corners();
    let next = corners.iter().cycle().skip(1);
    for (from, to) in corners.iter().zip(next) {
        let line = ground.line([*from, *to])?;
        let length = line.last().map_or(0.0, |[length, _]| *length);
        points.extend(line.into_iter().map(|[along, height]| {
            let share = along / length.max(f64::MIN_POSITIVE);
            let at = |from: f64, to: f64| from + share * (to - from);
            [at(from[0], to[0]), at(from[1], to[1]), height]
        }));
    }
    points.extend(ground.nodes(area.bounds(), |at| area.contains(at))?);
    Ok(points)
}

/// Returns the picture of the profile: ground, hops with the first Fresnel zone, and nodes.
///
/// Heights include the curvature of an earth of 4/3 of its radius, so that hops are straight.
pub fn chart(report: &TerrainReport, scenario: &Scenario) -> Chart {
    let wavelength_m = LIGHT_M_S / scenario.channel.carrier_hz;
    let raised = |x: f64, height: f64| (x, height + bulge_m(x, scenario.distance_m));
    let plain = |hue: usize, stroke| Look::number(hue).unsigned().joined(stroke);
    let (mut ground, mut nodes) = (Vec::new(), Vec::new());
    let mut hops = Vec::new();
    for (profile, hop) in report.profiles.iter().zip(&report.hops) {
        let [from, to] = profile.nodes;
        let length = profile.length_m().max(f64::MIN_POSITIVE);
        let at = |along: f64| {
            let share = along / length;
            let x = from.x_m + share * (to.x_m - from.x_m);
            let (_, sight) = raised(from.x_m, from.amsl_m);
            let (_, end) = raised(to.x_m, to.amsl_m);
            (x, sight + share * (end - sight))
        };
        ground.extend(
            profile
                .points
                .iter()
                .map(|[along, height]| raised(at(*along).0, *height)),
        );
        nodes.extend([at(0.0), at(length)]);
        let (name, hue) = match hop.state {
            State::Clear => ("hop", 0),
            State::Grazing => ("grazing hop", 4),
            State::Blocked => ("blocked hop", 2),
        };
        hops.push(Line::new(
            name,
            plain(hue, Stroke::Full),
            [at(0.0), at(length)],
        ));
        for side in [-1.0, 1.0] {
            let edge = (0..=60_u32).map(|step| {
                let along = length * f64::from(step) / 60.0;
                let (x, height) = at(along);
                (x, height + side * profile.fresnel_m(along, wavelength_m))
            });
            hops.push(Line::new(
                "first Fresnel zone",
                plain(5, Stroke::Dotted),
                edge,
            ));
        }
    }
    hops.push(Line::new("ground", plain(3, Stroke::Full), ground));
    let signs = Look::number(0).joined(Stroke::None);
    hops.push(Line::new("Tx, relays, Rx", signs, nodes));
    Chart::of(
        Axis::linear("x (m)").between(0.0, scenario.distance_m),
        Axis::linear("height above the sea (m)"),
        hops,
    )
}
