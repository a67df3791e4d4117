//! GeoJSON (RFC 7946) output of a plan.
//!
//! Positions are longitude and latitude, and with `site.geoid_m` the height above the ellipsoid, as the RFC defines the third
//! number. Heights above mean sea level are in the property `amsl_m`. Hops across the antimeridian are split there.

use geojson::{FeatureCollection, Geometry, GeometryValue, JsonObject};

use super::feature::{Feature, Map, Number, position};

/// Returns the text of the GeoJSON file.
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

/// Returns the points on either side of the antimeridian where the short way crosses it. `None` if it does not.
fn cut(from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let [lon, lat, high] = from;
    let [other_lon, other_lat, other_high] = to;
    if (other_lon - lon).abs() <= 180.0 {
        return None;
    }
    let edge = if lon > 0.0 { 180.0 } else { -180.0 };
    // Both longitudes relative to the side of the first point.
    let share = (edge - lon) / (other_lon + 2.0 * edge - lon);
    let at = |from: f64, to: f64| from + share * (to - from);
    let (lat, high) = (at(lat, other_lat), at(high, other_high));
    Some([[edge, lat, high], [-edge, lat, high]])
}
