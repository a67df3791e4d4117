//! A plan as GeoJSON, RFC 7946.
//!
//! Positions are longitude, latitude and, where the scenario has `site.geoid_m`, the height above the ellipsoid, which is what the third number
//! of a position is there; heights above the mean sea level are in the property `amsl_m`. What crosses the antimeridian is cut there.

use geojson::{FeatureCollection, Geometry, GeometryValue, JsonObject};

use super::feature::{Feature, Map, Number, position};

/// The text of a GeoJSON file.
pub fn text(map: &Map) -> String {
    let features = map.features.iter().map(|one| feature(one, map.geoid_m));
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
    let value = match at.as_slice() {
        [from, to] => match cut(*from, *to) {
            Some([before, after]) => GeometryValue::new_multi_line_string([
                [*from, before].map(shown),
                [after, *to].map(shown),
            ]),
            None => GeometryValue::new_line_string([*from, *to].map(shown)),
        },
        at => GeometryValue::new_point(shown(at.first().copied().unwrap_or_default())),
    };
    let mut properties = JsonObject::new();
    properties.insert("name".to_owned(), feature.name.clone().into());
    properties.insert("kind".to_owned(), feature.kind.into());
    if let [at] = at.as_slice() {
        properties.insert("amsl_m".to_owned(), at[2].into());
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

/// Where the short way between two points crosses the antimeridian, as the point on either side of it; `None` where it does not.
fn cut(from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let [lon, lat, high] = from;
    let [other_lon, other_lat, other_high] = to;
    if (other_lon - lon).abs() <= 180.0 {
        return None;
    }
    let edge = if lon > 0.0 { 180.0 } else { -180.0 };
    // Both as they are on the side of the first.
    let share = (edge - lon) / (other_lon + 2.0 * edge - lon);
    let at = |from: f64, to: f64| from + share * (to - from);
    let (lat, high) = (at(lat, other_lat), at(high, other_high));
    Some([[edge, lat, high], [-edge, lat, high]])
}
