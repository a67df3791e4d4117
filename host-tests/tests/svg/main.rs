//! Pictures of chains: well-formed, complete and readable at every size.

mod above;
mod hops;
mod lost;
mod others;
mod plot;

use roxmltree::{Document, Node};
use uav_relay_sim::svg::{Picture, draw};

/// Width and height of the picture, in its own units.
const SIZE: (f64, f64) = (480.0, 330.0);

/// Returns the picture of equally spaced relays with artificial SIRs. The worst hop (0 dB) is in the middle.
fn chain(relays: usize, distance_m: f64, altitude: impl Fn(f64) -> f64) -> Picture {
    let hops = relays as f64 + 1.0;
    let share = |number: usize| number as f64 / hops;
    Picture {
        title_method: "align".to_owned(),
        distance_m,
        interferers: vec![(80.0, distance_m / 2.0, 400.0)],
        nodes: (1..=relays)
            .map(|number| (distance_m * share(number), altitude(share(number))))
            .collect(),
        hop_sir: (0..=relays)
            .map(|hop| 1.0 + hop.abs_diff(relays / 2) as f64)
            .collect(),
        lost: vec![],
        ..Picture::default()
    }
}

fn level(relays: usize) -> Picture {
    chain(relays, 1000.0, |_| 20.0)
}

/// Returns pictures of chains that together contain every kind of drawn object.
fn gallery() -> Vec<Picture> {
    let mut pictures: Vec<Picture> = [1, 2, 8, 20, 21, 50, 100, 1000].map(level).into();
    pictures.push(chain(5, 10.0, |_| 20.0));
    pictures.push(chain(30, 1e5, |_| 120.0));
    pictures.push(chain(8, 1000.0, |share| {
        20.0 + 200.0 * share * (1.0 - share)
    }));
    pictures.push(chain(
        12,
        1000.0,
        |share| if share < 0.5 { 20.0 } else { 80.0 },
    ));
    let far = vec![
        (80.0, -3000.0, 4.0),
        (1e9, 1e7, -1e7),
        (1e-6, 1201.0, 0.0),
        (3.0, -199.0, 7.0),
        (5.0, 0.0, 9.0),
    ];
    pictures.push(Picture {
        interferers: far,
        lost: vec![1, 4, 8],
        ..level(8)
    });
    let many = (0..40)
        .map(|index| (80.0, 50.0 * f64::from(index), 300.0))
        .collect();
    pictures.push(Picture {
        interferers: many,
        ..level(8)
    });
    pictures.push(Picture {
        interferers: vec![],
        ..level(8)
    });
    pictures.push(Picture {
        others: vec![(30.0, 200.0, -100.0), (5.0, -150.0, 1.0)],
        ..level(8)
    });
    pictures
}

fn all<'a>(document: &'a Document<'a>, tag: &'a str, class: &'a str) -> Vec<Node<'a, 'a>> {
    let classes = |node: &Node| {
        node.attribute("class")
            .unwrap_or_default()
            .split(' ')
            .any(|one| one == class)
    };
    document
        .descendants()
        .filter(|node| node.has_tag_name(tag) && classes(node))
        .collect()
}

fn number(node: &Node, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

/// Returns the visible text of an SVG node and of the nodes in it.
fn words(node: &Node) -> String {
    node.descendants()
        .filter(Node::is_text)
        .filter_map(|text| text.text())
        .collect()
}

fn has_text(document: &Document, wanted: &str) -> bool {
    document
        .descendants()
        .any(|node| node.has_tag_name("text") && words(&node) == wanted)
}

fn tip(node: &Node) -> String {
    words(
        &node
            .children()
            .find(|child| child.has_tag_name("title"))
            .unwrap(),
    )
}

/// Returns the rectangle that a text covers, for letters of ordinary width: left, right, top, bottom.
fn extent(node: &Node, size: f64) -> [f64; 4] {
    let (x, y) = (number(node, "x"), number(node, "y"));
    let half = 0.5 * 0.556 * size * words(node).chars().count() as f64;
    [x - half, x + half, y - 0.72 * size, y]
}

/// Draws a picture, and checks that it contains finite numbers only.
fn drawn(picture: &Picture) -> String {
    let svg = draw(picture);
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    svg
}

/// Asserts that all coordinates are within the width and height. Returns the number of coordinates.
fn assert_inside(document: &Document, (width, height): (f64, f64)) -> usize {
    let mut checked = 0;
    for node in document.descendants() {
        for (names, limit) in [
            (["x1", "x2", "cx", "x"], width),
            (["y1", "y2", "cy", "y"], height),
        ] {
            for value in names.iter().filter_map(|name| node.attribute(*name)) {
                let value: f64 = value.parse().unwrap();
                assert!((0.0..=limit).contains(&value), "{node:?}");
                checked += 1;
            }
        }
    }
    checked
}

/// Asserts that no two texts of some classes cover each other. Returns their rectangles. `classes` has the class
/// names and font sizes.
fn assert_apart(document: &Document, classes: &[(&str, f64)]) -> Vec<[f64; 4]> {
    let mut extents: Vec<([f64; 4], String)> = Vec::new();
    for (class, size) in classes {
        let texts = all(document, "text", class);
        extents.extend(texts.iter().map(|text| (extent(text, *size), words(text))));
    }
    for (index, (a, one)) in extents.iter().enumerate() {
        for (b, other) in &extents[..index] {
            let apart = a[1] <= b[0] || b[1] <= a[0] || a[3] <= b[2] || b[3] <= a[2];
            assert!(apart, "{one} at {a:?} covers {other} at {b:?}");
        }
    }
    extents.into_iter().map(|(extent, _)| extent).collect()
}

#[test]
fn every_picture_is_well_formed_and_stays_in_its_frame() {
    for picture in gallery() {
        let svg = drawn(&picture);
        let document = Document::parse(&svg).unwrap();
        let root = document.root_element();
        assert_eq!(root.tag_name().name(), "svg");
        assert_eq!(root.attribute("viewBox"), Some("0 0 480 330"));
        assert!(assert_inside(&document, SIZE) > 50);
    }
}

#[test]
fn extreme_input_still_makes_a_picture() {
    let mut picture = level(4);
    picture.title_method = "<b>&\"'\u{0}\n]]>".to_owned();
    picture.nodes[1] = (f64::NAN, 20.0);
    picture.nodes[2] = (1e300, -5.0);
    picture.hop_sir = vec![f64::INFINITY, -1.0];
    picture.interferers = vec![
        (f64::NAN, 0.0, 0.0),
        (1.0, f64::NEG_INFINITY, 0.0),
        (1.0, 1e308, 1e308),
    ];
    picture.lost = vec![0, 2, 99];
    picture.left_out = vec![0, 4, 4, 99];
    picture.events = vec![
        (f64::NAN, "<&\u{0}".to_owned()),
        (f64::INFINITY, String::new()),
    ];
    let empty = Picture::default();
    let nan = Picture {
        distance_m: f64::NAN,
        ..level(3)
    };
    let huge = chain(3, 1e308, |_| 1e308);
    let tiny = chain(3, 1e-300, |_| 1e-300);
    for (picture, circles) in [(picture, 3), (empty, 0), (nan, 0), (huge, 3), (tiny, 3)] {
        let svg = drawn(&picture);
        let document = Document::parse(&svg).unwrap();
        let count = all(&document, "circle", "relay").len();
        assert!(
            count == circles || picture.distance_m.is_nan(),
            "{count} of {circles}"
        );
        assert!(svg.len() < 20_000);
    }
}

#[test]
fn a_picture_has_a_title_and_is_reproducible() {
    let svg = draw(&level(8));
    let document = Document::parse(&svg).unwrap();
    assert!(has_text(&document, "align, N = 8 relays"));
    assert!(has_text(&document, "SIRS= 1.0000 (0.00 dB)"));
    assert_eq!(
        tip(&document.root_element()),
        "Relay chain: align, N = 8, chain SIR 1.0000 (0.00 dB)"
    );
    let one = draw(&level(1));
    assert!(has_text(
        &Document::parse(&one).unwrap(),
        "align, N = 1 relay"
    ));
    assert_eq!(svg, draw(&level(8)));
}
