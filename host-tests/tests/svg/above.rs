//! View from above, present only if there is lateral room.

use roxmltree::{Document, Node};
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::svg::{LateralView, Picture, draw, lateral_view};

use super::{all, assert_apart, assert_inside, chain, drawn, has_text, level, number, tip};

/// Bottom of the view from the side without its legend, in units of the picture.
const SIDE: f64 = 282.0;

/// Returns the picture of a chain whose relays have offsets to the left, away from the interferer. The largest offset
/// is the fraction `edge` of the permitted offset.
fn swung(relays: usize, edge: f64) -> Picture {
    let picture = chain(relays, 1000.0, |share| 20.0 + 800.0 * share * (1.0 - share));
    let share = |number: usize| number as f64 / (relays as f64 + 1.0);
    let y_m =
        (1..=relays).map(|number| -4.0 * edge * 280.0 * share(number) * (1.0 - share(number)));
    Picture {
        interferers: vec![(80.0, 500.0, 150.0)],
        lateral_view: Some(LateralView {
            least_m: -280.0,
            most_m: 280.0,
            y_m: y_m.collect(),
        }),
        ..picture
    }
}

fn gallery() -> Vec<Picture> {
    let mut pictures: Vec<Picture> = [1, 2, 8, 20, 50, 1000]
        .map(|relays| swung(relays, 0.9))
        .into();
    pictures.push(swung(8, 0.0));
    pictures.push(Picture {
        interferers: vec![
            (80.0, 500.0, 0.0),
            (40.0, 100.0, 279.0),
            (5.0, 900.0, -3000.0),
            (1.0, 5000.0, 20.0),
        ],
        others: vec![(30.0, 200.0, -100.0)],
        lost: vec![3],
        left_out: vec![5],
        events: vec![(5.0, "relay 3 silent".to_owned())],
        ..swung(8, 1.0)
    });
    let mut narrow = swung(8, 0.01);
    narrow.lateral_view = narrow.lateral_view.map(|view| LateralView {
        least_m: 0.0,
        most_m: 3.0,
        ..view
    });
    pictures.push(narrow);
    pictures
}

/// Returns the shapes of a class: in the view from the side, and in the view from above. `key` is the attribute with
/// a shape's y.
fn parts<'a>(
    document: &'a Document<'a>,
    tag: &'a str,
    class: &'a str,
    key: &str,
) -> [Vec<Node<'a, 'a>>; 2] {
    let (side, above) = all(document, tag, class)
        .into_iter()
        .partition(|node| number(node, key) < SIDE);
    [side, above]
}

#[test]
fn without_lateral_range_there_is_one_view() {
    let svg = draw(&level(8));
    let document = Document::parse(&svg).unwrap();
    assert!(!has_text(&document, "from above") && !has_text(&document, "y (m)"));
    assert!(all(&document, "line", "edge").is_empty());
}

/// Checks that the view from above shows an interferer beside a straight chain.
///
/// A side view would show it below the chain.
#[test]
fn the_view_from_above_shows_an_interferer_at_its_offset() {
    let (mission, _) = mission::mission(&Scenario::default(), 8, 1e-4).unwrap();
    let picture = level(8);
    for (y, sign) in [(400.0, 1.0), (-400.0, -1.0)] {
        let interferers = vec![(80.0, 500.0, y)];
        let svg = draw(&Picture {
            lateral_view: lateral_view(&mission, [0.0; 8], &interferers),
            interferers,
            ..picture.clone()
        });
        let document = Document::parse(&svg).unwrap();
        assert!(has_text(&document, "from above") && has_text(&document, "y (m)"));
        assert!(all(&document, "line", "edge").is_empty(), "no room");
        let [_, relays] = parts(&document, "circle", "relay", "cy");
        assert_eq!(relays.len(), 8);
        let line = number(&relays[0], "cy");
        assert!(relays.iter().all(|relay| number(relay, "cy") == line));
        let marks = all(&document, "path", "source");
        let tops: Vec<f64> = marks.iter().filter_map(top).collect();
        let above = tops.iter().copied().fold(0.0, f64::max) + 6.0;
        assert!(sign * (above - line) > 60.0, "{above} and {line}");
    }
    for interferers in [vec![(80.0, 500.0, 0.0)], vec![], vec![(80.0, 9e3, 5.0)]] {
        assert_eq!(lateral_view(&mission, [0.0; 8], &interferers), None);
    }
}

/// Checks that an interferer far beside the line is drawn as an arrow at the edge. The axes of the view from above
/// remain readable.
#[test]
fn an_interferer_far_beside_the_line_is_an_arrow_at_the_edge() {
    let (mission, _) = mission::mission(&Scenario::default(), 8, 1e-4).unwrap();
    for (y, words) in [
        (5_000.0, "80 W, y = 5000 m"),
        (-9e4, "80 W, y = -90000 m"),
        (1e7, "80 W, y = 1e7 m"),
    ] {
        let interferers = vec![(80.0, 500.0, y)];
        let svg = draw(&Picture {
            lateral_view: lateral_view(&mission, [0.0; 8], &interferers),
            interferers,
            ..level(8)
        });
        let document = Document::parse(&svg).unwrap();
        assert!(has_text(&document, words), "{words}\n{svg}");
        // Ticks of the vertical axis are whole metres.
        let ticks = all(&document, "text", "end");
        let ticks: Vec<f64> = ticks
            .iter()
            .filter_map(|tick| super::words(tick).parse().ok())
            .collect();
        assert!(ticks.iter().any(|tick| tick * f64::signum(y) >= 100.0));
        assert!(ticks.iter().all(|tick| tick.fract() == 0.0), "{ticks:?}");
        let [_, relays] = parts(&document, "circle", "relay", "cy");
        let line = number(&relays[0], "cy");
        let marks = all(&document, "path", "source");
        let [mark] = marks
            .iter()
            .filter(|mark| tip_of(mark).is_some() && !has_class(mark, "beside"))
            .collect::<Vec<_>>()[..]
        else {
            panic!("{marks:?}")
        };
        let corners = mark.attribute("d").unwrap().matches('L').count() + 1;
        assert_eq!(corners, 3, "an arrow");
        assert!((top(mark).unwrap() - line) * f64::signum(y) > 60.0);
    }
}

/// Checks that in the side view the marker of an interferer beside the line is hollow. On the line it is filled. The legend must explain
/// each marker.
#[test]
fn from_the_side_an_interferer_beside_the_line_is_hollow() {
    let draws = |y: f64| {
        let svg = draw(&Picture {
            interferers: vec![(80.0, 500.0, y)],
            ..level(8)
        });
        let document = Document::parse(&svg).unwrap();
        let marks = all(&document, "path", "source");
        let marks = marks.iter().filter(|mark| tip_of(mark).is_some());
        let hollow: Vec<bool> = marks.map(|mark| has_class(mark, "beside")).collect();
        let legend = ["interferer", "beside the line"].map(|words| has_text(&document, words));
        (hollow, legend)
    };
    assert_eq!(draws(0.0), (vec![false], [true, false]));
    for y in [400.0, -0.5] {
        assert_eq!(draws(y), (vec![true], [true, true]));
    }
}

fn has_class(node: &Node, class: &str) -> bool {
    let classes = node.attribute("class").unwrap_or_default();
    classes.split(' ').any(|one| one == class)
}

fn tip_of(node: &Node) -> Option<String> {
    let mut children = node.children();
    let title = children.find(|child| child.has_tag_name("title"))?;
    Some(super::words(&title))
}

/// Returns the top corner (x, y) of a marker that has a tooltip; `None` for other shapes.
fn corner(mark: &Node) -> Option<(f64, f64)> {
    mark.children().find(|child| child.has_tag_name("title"))?;
    let start = mark.attribute("d")?[1..].split('L').next()?;
    let (x, y) = start.split_once(' ')?;
    Some((x.parse().ok()?, y.parse().ok()?))
}

fn top(mark: &Node) -> Option<f64> {
    corner(mark).map(|(_, y)| y)
}

#[test]
fn both_views_have_every_relay_and_every_hop_inside_the_frame() {
    for picture in gallery() {
        let svg = drawn(&picture);
        let document = Document::parse(&svg).unwrap();
        let high = number(&document.root_element(), "height");
        assert_inside(&document, (480.0, high));
        let relays = picture.nodes.len();
        for view in parts(&document, "circle", "relay", "cy") {
            assert_eq!(view.len(), relays);
        }
        let hops = relays + 1 - picture.left_out.len();
        for view in parts(&document, "line", "hop", "y1") {
            assert_eq!(view.len(), hops);
        }
        for wanted in ["from the side", "from above", "h (m)", "y (m)"] {
            assert!(has_text(&document, wanted), "{wanted}");
        }
    }
}

/// Checks that the view from above draws all objects at their y, to one scale.
///
/// The objects are the relays, the interferer, and the edges of the permitted offsets. Positive y is to the right of
/// the direction from Tx to Rx, and therefore drawn downward.
#[test]
fn the_view_from_above_is_to_scale() {
    let picture = swung(8, 0.9);
    let svg = draw(&picture);
    let document = Document::parse(&svg).unwrap();
    let edges: Vec<f64> = all(&document, "line", "edge")
        .iter()
        .map(|line| number(line, "y1"))
        .collect();
    let [left, right] = edges[..] else {
        panic!("{edges:?}")
    };
    assert!(left < right, "{edges:?}");
    let at = |y: f64| left + (y + 280.0) / 560.0 * (right - left);
    let [_, above] = parts(&document, "circle", "relay", "cy");
    let view = picture.lateral_view.unwrap();
    for ((circle, y), number_of) in above.iter().zip(view.y_m).zip(1..) {
        assert!((number(circle, "cy") - at(y)).abs() < 0.02, "{number_of}");
        assert!(
            tip(circle).contains(&format!("y = {y:.2} m")),
            "{}",
            tip(circle)
        );
    }
    let marks = all(&document, "path", "source");
    let tops: Vec<(f64, f64)> = marks.iter().filter_map(corner).collect();
    // The interferer is on the ground from the side, and at its position from above: the top corner is 6 above.
    let [side, above] = tops[..] else {
        panic!("{tops:?}")
    };
    assert_eq!(side.0, above.0);
    assert!((above.1 + 6.0 - at(150.0)).abs() < 0.02, "{tops:?}");
}

#[test]
fn words_never_cover_each_other_in_either_view() {
    let classes = [
        ("sir", 10.0),
        ("node", 9.0),
        ("faint", 10.0),
        ("bold", 10.0),
    ];
    for picture in gallery() {
        let svg = draw(&picture);
        assert_apart(&Document::parse(&svg).unwrap(), &classes);
    }
}

#[test]
fn a_short_chain_has_every_number_in_both_views() {
    for relays in [1, 2, 8] {
        let svg = draw(&swung(relays, 0.9));
        let document = Document::parse(&svg).unwrap();
        for view in parts(&document, "text", "sir", "y") {
            assert_eq!(view.len(), relays + 1);
        }
        let [_, above] = parts(&document, "text", "node", "y");
        assert_eq!(above.len(), relays);
    }
}

#[test]
fn extreme_lateral_views_still_make_a_picture() {
    for view in [
        LateralView::default(),
        LateralView {
            least_m: f64::NAN,
            most_m: f64::INFINITY,
            y_m: vec![f64::NAN, 1e300, -1e308],
        },
        LateralView {
            least_m: -1e300,
            most_m: 1e-300,
            y_m: vec![0.0; 99],
        },
    ] {
        let svg = drawn(&Picture {
            lateral_view: Some(view),
            ..level(8)
        });
        Document::parse(&svg).unwrap();
    }
}
