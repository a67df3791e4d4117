//! Geographic output of a plan: sites, relays, hops and interferers for a map or globe.

use std::{fmt, io};

use geojson::{FeatureCollection, Geometry, GeometryValue, JsonObject};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};
use uav_relay_scenario::{Line, Scenario};
use uav_relay_terrain::profile::State;
use uav_relay_terrain::report::TerrainReport;

use super::Plan;

/// Object on the map: Tx, Rx, a relay, an interferer or a hop.
#[derive(Clone, PartialEq, Debug)]
pub struct Feature {
    /// Label of the object on the map, for example `relay 3`.
    pub name: String,
    /// Kind of the object: `tx`, `rx`, `relay`, `interferer`, `hop` or `ground`.
    pub kind: &'static str,
    /// Coordinates of the object: one point, the two ends of a hop, or the points of a line.
    pub at: Vec<Geodetic>,
    /// True for a line without heights, which a globe program draws on its own terrain.
    pub is_clamped: bool,
    /// Numbers of the object, such as its position and SIR, with their names. Each name ends in the unit.
    pub numbers: Vec<(&'static str, Number)>,
}

/// Number on the map, rounded for display.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// Count or index, shown exactly.
    Whole(u16),
    /// Length in m, level in dB and so on, rounded to three decimals.
    Rounded(f64),
    /// Ratio, for example a linear SIR, rounded to six decimals.
    Ratio(f64),
}

impl Number {
    /// Returns the rounded value; counts are exact.
    fn rounded(self) -> f64 {
        let (value, decimals) = match self {
            Self::Whole(count) => return f64::from(count),
            Self::Rounded(value) => (value, 1e3),
            Self::Ratio(value) => (value, 1e6),
        };
        // Adding 0 turns -0 into 0.
        (value * decimals).round() / decimals + 0.0
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(count) => count.fmt(f),
            other => other.rounded().fmt(f),
        }
    }
}

/// Geographic map of a plan, from which the GeoJSON and KML files are made.
#[derive(Clone, PartialEq, Debug)]
pub struct Map {
    /// Objects on the map: Tx and Rx, relays and interferers, then the hops in order from Tx.
    pub features: Vec<Feature>,
    /// Height of the mean sea level above the ellipsoid, m, if the scenario states it.
    pub geoid_m: Option<f64>,
    /// Numbers, from 1, of the interferers that are too far away for the map.
    pub left_out: Vec<usize>,
}

impl Map {
    /// Creates the map of the chain in `plan`.
    ///
    /// # Errors
    /// A text that names the missing part of the scenario.
    pub fn new(scenario: &Scenario, plan: &Plan) -> Result<Self, String> {
        let line = scenario.line.as_ref().ok_or(
            "site: is missing; allowed: [site] with tx and rx, each { lat_deg, lon_deg, amsl_m }, which say where on earth the line is",
        )?;
        let [tx, rx] = line.sites;
        let site = |name: &str, kind, at| Feature {
            name: name.to_owned(),
            kind,
            at: vec![at],
            is_clamped: false,
            numbers: Vec::new(),
        };
        let mut features = vec![site("Tx", "tx", tx), site("Rx", "rx", rx)];
        let mut ends = vec![tx];
        for (index, (place, profile)) in (1..).zip(&plan.places) {
            let at = point(line, *place).ok_or_else(|| {
                format!(
                    "relay {index}: must be at most {:.0} m from the line from Tx to Rx",
                    Axis::AROUND_M
                )
            })?;
            ends.push(at);
            features.push(Feature {
                name: format!("relay {index}"),
                kind: "relay",
                at: vec![at],
                is_clamped: false,
                numbers: vec![
                    ("index", Number::Whole(index)),
                    ("x_m", Number::Rounded(place.x_m.into())),
                    ("y_m", Number::Rounded(place.y_m.into())),
                    ("h_m", Number::Rounded(place.altitude_m.into())),
                    ("eirp_dbm", Number::Rounded(dbm(profile.power_w.into()))),
                ],
            });
        }
        ends.push(rx);
        let mut left_out = Vec::new();
        for (number, (power_w, x_m, y_m)) in (1..).zip(scenario.sources()) {
            #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
            let ground = Placement {
                x_m: x_m as f32,
                y_m: y_m as f32,
                altitude_m: 0.0,
            };
            let Some(at) = point(line, ground) else {
                left_out.push(number);
                continue;
            };
            features.push(Feature {
                name: format!("interferer {number}"),
                kind: "interferer",
                at: vec![at],
                is_clamped: false,
                numbers: vec![
                    ("x_m", Number::Rounded(x_m)),
                    ("y_m", Number::Rounded(y_m)),
                    ("eirp_dbm", Number::Rounded(dbm(power_w))),
                ],
            });
        }
        let hops = ends.iter().zip(ends.iter().skip(1)).zip(&plan.sirs);
        for (number, ((from, to), sir)) in (1..).zip(hops) {
            features.push(Feature {
                name: format!("hop {number}: {:.2} dB", 10.0 * sir.log10()),
                kind: "hop",
                at: vec![*from, *to],
                is_clamped: false,
                numbers: vec![
                    ("hop", Number::Whole(number)),
                    ("sir_ratio", Number::Ratio(*sir)),
                    ("sir_db", Number::Rounded(10.0 * sir.log10())),
                ],
            });
        }
        Ok(Self {
            features,
            geoid_m: line.geoid_m,
            left_out,
        })
    }

    /// Adds the terrain's effect on each hop (clear, grazing or blocked), and the ground below the hop.
    ///
    /// The ground is on the map twice: with the heights of the elevation files, and clamped to the ground of the globe.
    #[must_use]
    pub fn above(mut self, line: &Line, terrain: &TerrainReport) -> Self {
        let hops = self.features.iter_mut().filter(|one| one.kind == "hop");
        for (feature, hop) in hops.zip(&terrain.hops) {
            if hop.state != State::Clear {
                feature.name = format!("{}, {:?}", feature.name, hop.state).to_lowercase();
            }
            let numbers = [
                ("clearance_m", hop.clearance_m),
                ("diffraction_db", hop.diffraction_db),
                ("terrain_sir_db", hop.sir_db),
            ];
            let numbers = numbers.map(|(name, value)| (name, Number::Rounded(value)));
            feature.numbers.extend(numbers);
        }
        for (number, profile) in (1..).zip(&terrain.profiles) {
            let [from, to] = profile.nodes;
            let length = profile.length_m().max(f64::MIN_POSITIVE);
            let every = profile.points.len().div_ceil(MAP_POINTS).max(1);
            let last = profile.points.len().saturating_sub(1);
            let points = profile.points.iter().enumerate();
            let points = points.filter(|(at, _)| at % every == 0 || *at == last);
            let points = points.filter_map(|(_, [along, height])| {
                let at = |from: f64, to: f64| from + along / length * (to - from);
                #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
                let place = Placement {
                    x_m: at(from.x_m, to.x_m) as f32,
                    y_m: at(from.y_m, to.y_m) as f32,
                    altitude_m: 0.0,
                };
                #[expect(clippy::cast_possible_truncation, reason = "heights on earth")]
                let amsl_mm = (height * 1e3).round() as i32;
                Some(Geodetic {
                    amsl_mm,
                    ..point(line, place)?
                })
            });
            let at: Vec<Geodetic> = points.collect();
            let ground = |name: &str, is_clamped| Feature {
                name: format!("{name} of hop {number}"),
                kind: "ground",
                at: at.clone(),
                is_clamped,
                numbers: vec![("hop", Number::Whole(number))],
            };
            self.features
                .extend([ground("ground", false), ground("track", true)]);
        }
        self
    }
}

/// Approximate largest number of ground points of a hop on the map.
const MAP_POINTS: usize = 400;

fn point(line: &Line, place: Placement) -> Option<Geodetic> {
    line.axis.point(place)
}

fn dbm(power_w: f64) -> f64 {
    10.0 * power_w.log10() + 30.0
}

/// Returns longitude and latitude, degrees, and the height above mean sea level, m, of a point.
fn position(at: Geodetic) -> [f64; 3] {
    [
        f64::from(at.lon_e7) / 1e7,
        f64::from(at.lat_e7) / 1e7,
        f64::from(at.amsl_mm) / 1e3,
    ]
}

// GeoJSON (RFC 7946) output of a plan.
//
// Positions are longitude and latitude, and with `site.geoid_m` the height above the ellipsoid, as the RFC defines the third
// number. Heights above mean sea level are in the property `amsl_m`. Hops across the antimeridian are split there.

/// Returns the map as the text of a GeoJSON file.
pub fn geojson(map: &Map) -> String {
    let shown = map.features.iter().filter(|one| !one.is_clamped);
    let features = shown.map(|one| feature(one, map.geoid_m));
    let mut text = FeatureCollection::new(features).to_string();
    text.push('\n');
    text
}

fn feature(feature: &Feature, geoid_m: Option<f64>) -> geojson::Feature {
    let shown = |[lon, lat, amsl]: [f64; 3]| match geoid_m {
        Some(geoid_m) => vec![lon, lat, Number::Rounded(amsl + geoid_m).rounded()],
        None => vec![lon, lat],
    };
    let at: Vec<[f64; 3]> = feature.at.iter().map(|at| position(*at)).collect();
    let value = if let [at] = at.as_slice() {
        GeometryValue::new_point(shown(*at))
    } else {
        let mut parts = vec![Vec::new()];
        for (from, to) in at.iter().zip(at.iter().skip(1)) {
            let Some(part) = parts.last_mut() else { break };
            if part.is_empty() {
                part.push(shown(*from));
            }
            if let Some([before, after]) = cut(*from, *to) {
                part.push(shown(before));
                parts.push(vec![shown(after), shown(*to)]);
            } else {
                part.push(shown(*to));
            }
        }
        match parts.as_slice() {
            [line] => GeometryValue::new_line_string(line.clone()),
            _ => GeometryValue::new_multi_line_string(parts),
        }
    };
    let mut properties = JsonObject::new();
    properties.insert("name".to_owned(), feature.name.clone().into());
    properties.insert("kind".to_owned(), feature.kind.into());
    if let [at] = at.as_slice() {
        properties.insert("amsl_m".to_owned(), at[2].into());
    } else if at.len() > 2 {
        let heights: Vec<f64> = at.iter().map(|at| at[2]).collect();
        properties.insert("amsl_m".to_owned(), heights.into());
    }
    for (name, number) in &feature.numbers {
        let value = match number {
            Number::Whole(count) => (*count).into(),
            other => other.rounded().into(),
        };
        properties.insert((*name).to_owned(), value);
    }
    geojson::Feature {
        geometry: Some(Geometry::new(value)),
        properties: Some(properties),
        ..geojson::Feature::default()
    }
}

/// Returns the points at which a hop crosses the antimeridian, at longitude 180 and -180 degrees.
///
/// The hop is on the shorter of the two ways around the earth. `None` if it does not cross the antimeridian.
fn cut(from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let [lon, lat, high] = from;
    let [other_lon, other_lat, other_high] = to;
    if (other_lon - lon).abs() <= 180.0 {
        return None;
    }
    let edge = if lon > 0.0 { 180.0 } else { -180.0 };
    // Both longitudes are relative to the side of the first point.
    let share = (edge - lon) / (other_lon + 2.0 * edge - lon);
    let at = |from: f64, to: f64| from + share * (to - from);
    let (lat, high) = (at(lat, other_lat), at(high, other_high));
    Some([[edge, lat, high], [-edge, lat, high]])
}

const NAMESPACE: &str = "http://www.opengis.net/kml/2.2";

/// Colours of the objects on a KML map, by kind, as hexadecimal alpha, blue, green and red.
const STYLES: [(&str, &str); 6] = [
    ("tx", "ff00a000"),
    ("rx", "ffa06000"),
    ("relay", "ffffffff"),
    ("interferer", "ff0000e0"),
    ("hop", "ff00d0ff"),
    ("ground", "ff2a5a8a"),
];

type Xml = Writer<Vec<u8>>;

/// Returns the map as the text of a KML file with the given title.
pub fn kml(map: &Map, title: &str) -> io::Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("kml")
        .with_attribute(("xmlns", NAMESPACE))
        .write_inner_content(|xml| {
            xml.create_element("Document").write_inner_content(|xml| {
                leaf(xml, "name", title)?;
                for (kind, color) in STYLES {
                    style(xml, kind, color)?;
                }
                for feature in &map.features {
                    placemark(xml, feature)?;
                }
                Ok(())
            })?;
            Ok(())
        })?;
    let mut text = String::from_utf8(xml.into_inner()).map_err(io::Error::other)?;
    text.push('\n');
    Ok(text)
}

/// Writes the XML element `name` that contains only `text`.
fn leaf(xml: &mut Xml, name: &str, text: &str) -> io::Result<()> {
    xml.create_element(name)
        .write_text_content(BytesText::new(text))?;
    Ok(())
}

fn style(xml: &mut Xml, kind: &str, color: &str) -> io::Result<()> {
    xml.create_element("Style")
        .with_attribute(("id", kind))
        .write_inner_content(|xml| {
            xml.create_element("IconStyle")
                .write_inner_content(|xml| leaf(xml, "color", color))?;
            xml.create_element("LineStyle").write_inner_content(|xml| {
                leaf(xml, "color", color)?;
                leaf(xml, "width", "3")
            })?;
            Ok(())
        })?;
    Ok(())
}

fn placemark(xml: &mut Xml, feature: &Feature) -> io::Result<()> {
    let numbers = feature.numbers.iter();
    let numbers: Vec<String> = numbers.map(|(name, it)| format!("{name} = {it}")).collect();
    let at: Vec<String> = feature
        .at
        .iter()
        .map(|at| {
            let [lon, lat, amsl] = position(*at);
            format!("{lon:.7},{lat:.7},{amsl:.3}")
        })
        .collect();
    xml.create_element("Placemark").write_inner_content(|xml| {
        leaf(xml, "name", &feature.name)?;
        if !numbers.is_empty() {
            leaf(xml, "description", &numbers.join(", "))?;
        }
        leaf(xml, "styleUrl", &format!("#{}", feature.kind))?;
        let shape = if at.len() > 1 { "LineString" } else { "Point" };
        xml.create_element(shape).write_inner_content(|xml| {
            if feature.is_clamped {
                // Only a tessellated line follows the ground between its points.
                leaf(xml, "tessellate", "1")?;
            }
            if shape == "Point" {
                // Draws a vertical line down to the ground.
                leaf(xml, "extrude", "1")?;
            }
            let mode = if feature.is_clamped {
                "clampToGround"
            } else {
                "absolute"
            };
            leaf(xml, "altitudeMode", mode)?;
            leaf(xml, "coordinates", &at.join(" "))
        })?;
        Ok(())
    })?;
    Ok(())
}
