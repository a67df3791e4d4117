//! Maps of the SIR for each position of an interferer: a picture, and geographic cells.

use std::fmt::Write as _;

use geojson::{Feature, FeatureCollection, Geometry, GeometryValue, JsonObject};
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};
use uav_relay_scenario::{Line, Scenario};

use super::Plan;
use super::area::Cell;

/// Width of the picture with its margins, in picture units.
const WIDTH: f64 = 900.0;
/// Width of the left and of the right margin of the picture, in picture units.
const MARGIN: f64 = 40.0;

/// Greatest height of the picture without margins, as a fraction of its width.
const TALLEST: f64 = 1.2;

/// Colours from the lowest to the highest SIR: red, green and blue. They also differ in brightness.
const COLOURS: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];

/// Number of steps of the colour scale in the legend.
const STEPS: u32 = 5;

/// Quantity that a map shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shown {
    /// SIR of the worst hop.
    Sir,
    /// Error of the interferer's position as relays estimate it from measurements.
    Error,
}

impl Shown {
    /// Returns the value of a cell on the colour scale: dB, or the logarithm of metres.
    fn number(self, cell: &Cell) -> f64 {
        match self {
            Self::Sir => cell.sir_db,
            Self::Error => cell.error_m.unwrap_or(MOST_M).clamp(0.01, MOST_M).log10(),
        }
    }

    fn say(self, number: f64) -> String {
        match self {
            Self::Sir => format!("{number:.2} dB"),
            Self::Error => format!("{:.1} m", 10_f64.powf(number)),
        }
    }
}

/// Largest error on the colour scale, m. Larger errors have the same colour.
const MOST_M: f64 = 1e5;

/// Returns the picture of `cells` from above. In the picture, x points to the right, and y down.
pub fn svg(scenario: &Scenario, plan: &Plan, cells: &[Cell], shown: Shown) -> String {
    let numbers = || cells.iter().map(|cell| shown.number(cell));
    let (least, most) = (
        numbers().fold(f64::INFINITY, f64::min),
        numbers().fold(f64::NEG_INFINITY, f64::max),
    );
    let colour = |number: f64| colour((number - least) / (most - least));
    let what = match shown {
        Shown::Sir => "SIR of the worst hop",
        Shown::Error => "Error of the relays' estimate of the interferer's position ([listen])",
    };
    let range = format!("{} to {}", shown.say(least), shown.say(most));
    let relays = plan
        .places
        .iter()
        .map(|(at, _)| [at.x_m, at.y_m].map(f64::from));
    let relays: Vec<[f64; 2]> = relays.collect();
    let ends = [[0.0, 0.0], [scenario.distance_m, 0.0]];
    let [low, high] = frame(scenario, &relays, cells);
    let inner = WIDTH - 2.0 * MARGIN;
    let scale = (inner / (high[0] - low[0])).min(TALLEST * inner / (high[1] - low[1]).max(1e-9));
    let tall = (high[1] - low[1]) * scale;
    let at = |[x, y]: [f64; 2]| [MARGIN + (x - low[0]) * scale, MARGIN + (y - low[1]) * scale];
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {0:.1}\" shape-rendering=\"crispEdges\" width=\"{WIDTH}\" height=\"{0:.1}\" role=\"img\" font-family=\"Helvetica,Arial,sans-serif\" font-size=\"11\">\n<title>{what} for each position of the interferer</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<text x=\"{MARGIN}\" y=\"20\" font-size=\"13\">{what} with the interferer at each position, {range}</text>\n",
        tall + 3.0 * MARGIN
    );
    for cell in cells {
        let [x, y] = at(cell.at.map(|middle| middle - 0.5 * cell.side_m));
        let side = cell.side_m * scale;
        _ = writeln!(
            out,
            "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{side:.2}\" height=\"{side:.2}\" fill=\"{}\"><title>x = {:.1} m, y = {:.1} m: {}</title></rect>",
            colour(shown.number(cell)),
            cell.at[0],
            cell.at[1],
            shown.say(shown.number(cell))
        );
    }
    for area in &scenario.no_fly {
        let corners: Vec<String> = area
            .corners
            .iter()
            .map(|corner| {
                let [x, y] = at(*corner);
                format!("{x:.1},{y:.1}")
            })
            .collect();
        _ = writeln!(
            out,
            "<polygon points=\"{}\" fill=\"#d55e00\" fill-opacity=\"0.2\" stroke=\"#d55e00\"><title>no-fly area</title></polygon>",
            corners.join(" ")
        );
    }
    let [[x1, y1], [x2, y2]] = ends.map(at);
    _ = writeln!(
        out,
        "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#888\" stroke-dasharray=\"4 3\"/>"
    );
    let named = relays
        .iter()
        .zip(1..)
        .map(|(at, index)| (*at, format!("{index}")));
    let sites = ends
        .iter()
        .zip(["Tx", "Rx"])
        .map(|(at, name)| (*at, name.to_owned()));
    for (node, name) in named.chain(sites) {
        let [x, y] = at(node);
        _ = writeln!(
            out,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" shape-rendering=\"auto\" fill=\"#fff\" stroke=\"#222\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" stroke=\"#fff\" stroke-width=\"2.5\" paint-order=\"stroke\">{name}</text>",
            y - 7.0
        );
    }
    for step in 0..STEPS {
        let number = least + (most - least) * f64::from(step) / f64::from(STEPS - 1);
        let (x, y) = (MARGIN + 110.0 * f64::from(step), tall + 2.4 * MARGIN);
        _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"14\" height=\"14\" fill=\"{}\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            colour(number),
            x + 19.0,
            y + 11.0,
            shown.say(number)
        );
    }
    out.push_str("</svg>\n");
    out
}

/// Returns the colour at `share` of the colour scale: 0 is its lowest value, 1 its highest value.
fn colour(share: f64) -> String {
    let place = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let mut mixed = [0.0; 3];
    for (at, colour) in COLOURS.iter().enumerate() {
        let weight = (1.0 - (place - at as f64).abs()).max(0.0);
        for (mixed, own) in mixed.iter_mut().zip(colour) {
            *mixed += weight * own;
        }
    }
    let [red, green, blue] = mixed.map(f64::round);
    format!("rgb({red},{green},{blue})")
}

/// Returns the least and the greatest x and y in the picture, m.
fn frame(scenario: &Scenario, relays: &[[f64; 2]], cells: &[Cell]) -> [[f64; 2]; 2] {
    let corners = cells
        .iter()
        .flat_map(|cell| [-0.5, 0.5].map(|side| cell.at.map(|middle| middle + side * cell.side_m)));
    let zones = scenario
        .no_fly
        .iter()
        .flat_map(|area| area.corners.iter().copied());
    let ends = [[0.0, 0.0], [scenario.distance_m, 0.0]];
    let all = corners
        .chain(zones)
        .chain(relays.iter().copied())
        .chain(ends);
    all.fold(
        [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
        |[low, high], at| {
            [
                [low[0].min(at[0]), low[1].min(at[1])],
                [high[0].max(at[0]), high[1].max(at[1])],
            ]
        },
    )
}

/// Returns the text of a GeoJSON file with a square for each cell, with `sir_db` and `error_m`.
///
/// # Errors
/// A text with a position that is too far from the line Tx-Rx for geographic coordinates.
pub fn geojson(line: &Line, cells: &[Cell]) -> Result<String, String> {
    let corner = |[x, y]: [f64; 2]| {
        #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
        let place = Placement {
            x_m: x as f32,
            y_m: y as f32,
            altitude_m: 0.0,
        };
        let Geodetic { lat_e7, lon_e7, .. } = line.axis.point(place).ok_or_else(|| {
            format!(
                "x = {x:.1} m, y = {y:.1} m: must be at most {:.0} m from the line from Tx to Rx",
                Axis::AROUND_M
            )
        })?;
        Ok(vec![f64::from(lon_e7) / 1e7, f64::from(lat_e7) / 1e7])
    };
    let feature = |cell: &Cell| {
        let [x, y] = cell.at;
        let half = 0.5 * cell.side_m;
        // Counter-clockwise seen from above, as RFC 7946 requires: y is to the right of x.
        let ring = [
            [-1.0, -1.0],
            [-1.0, 1.0],
            [1.0, 1.0],
            [1.0, -1.0],
            [-1.0, -1.0],
        ];
        let ring = ring.map(|[along, across]| corner([x + along * half, y + across * half]));
        let ring = ring.into_iter().collect::<Result<Vec<_>, String>>()?;
        let mut properties = JsonObject::new();
        properties.insert("interferer".to_owned(), (cell.source + 1).into());
        properties.insert("x_m".to_owned(), x.into());
        properties.insert("y_m".to_owned(), y.into());
        let sir_db = (cell.sir_db * 1e3).round() / 1e3;
        properties.insert("sir_db".to_owned(), sir_db.into());
        if let Some(error_m) = cell.error_m.filter(|error| error.is_finite()) {
            properties.insert(
                "error_m".to_owned(),
                ((error_m * 10.0).round() / 10.0).into(),
            );
        }
        Ok(Feature {
            geometry: Some(Geometry::new(GeometryValue::new_polygon(vec![ring]))),
            properties: Some(properties),
            ..Feature::default()
        })
    };
    let features = cells
        .iter()
        .map(feature)
        .collect::<Result<Vec<_>, String>>()?;
    Ok(format!("{}\n", FeatureCollection::new(features)))
}
