//! Pictures of chains: well-formed, complete, and readable at every size, as far as a program can tell.

mod above;
mod lost;
mod replaced;

use roxmltree::{Document, Node};
use uav_relay_sim::svg::{Picture, draw};

/// The picture's size, from its view box.
const SIZE: (f64, f64) = (480.0, 330.0);

/// A chain of equally spaced relays with made-up SIRs, the worst (0 dB) in the middle.
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

/// Pictures that between them hold everything a picture can hold.
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
        replaced: vec![(30.0, 200.0, -100.0), (5.0, -150.0, 1.0)],
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

/// What a reader sees of a text: all of it, parts included, in one go.
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

/// The rectangle a number beside a hop or a relay covers, with letters of ordinary width.
fn extent(node: &Node, size: f64) -> [f64; 4] {
    let (x, y) = (number(node, "x"), number(node, "y"));
    let half = 0.5 * 0.556 * size * words(node).chars().count() as f64;
    [x - half, x + half, y - 0.72 * size, y]
}

#[test]
fn every_picture_is_well_formed_and_stays_in_its_frame() {
    for picture in gallery() {
        let svg = draw(&picture);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let document = Document::parse(&svg).unwrap();
        assert_eq!(document.root_element().tag_name().name(), "svg");
        assert_eq!(
            document.root_element().attribute("viewBox"),
            Some("0 0 480 330")
        );
        let mut checked = 0;
        for node in document.descendants() {
            for (names, limit) in [
                (["x1", "x2", "cx", "x"], SIZE.0),
                (["y1", "y2", "cy", "y"], SIZE.1),
            ] {
                for value in names.iter().filter_map(|name| node.attribute(*name)) {
                    let value: f64 = value.parse().unwrap();
                    assert!((0.0..=limit).contains(&value), "{node:?}");
                    checked += 1;
                }
            }
        }
        assert!(checked > 50);
    }
}

#[test]
fn there_are_as_many_circles_as_relays_and_as_many_lines_as_hops() {
    for picture in gallery() {
        let svg = draw(&picture);
        let document = Document::parse(&svg).unwrap();
        let circles = document
            .descendants()
            .filter(|node| node.has_tag_name("circle"))
            .count();
        assert_eq!(circles, picture.nodes.len());
        let hops = all(&document, "line", "hop");
        assert_eq!(hops.len(), picture.hop_sir.len());
        for (index, sir) in picture.hop_sir.iter().enumerate() {
            let wanted = format!("hop {}: SIR {:.2} dB", index + 1, 10.0 * sir.log10());
            assert_eq!(
                hops.iter().filter(|hop| tip(hop) == wanted).count(),
                1,
                "{wanted}"
            );
        }
    }
}

#[test]
fn hops_join_the_nodes_from_tx_to_rx() {
    let svg = draw(&chain(8, 1000.0, |share| 20.0 + 100.0 * share));
    let document = Document::parse(&svg).unwrap();
    let mut hops = all(&document, "line", "hop");
    hops.sort_by_key(|hop| {
        tip(hop)
            .split([' ', ':'])
            .nth(1)
            .unwrap()
            .parse::<usize>()
            .unwrap()
    });
    let relays = all(&document, "circle", "relay");
    for (hop, relay) in hops.iter().zip(&relays) {
        assert_eq!(
            (number(hop, "x2"), number(hop, "y2")),
            (number(relay, "cx"), number(relay, "cy"))
        );
    }
    for (hop, relay) in hops.iter().skip(1).zip(&relays) {
        assert_eq!(
            (number(hop, "x1"), number(hop, "y1")),
            (number(relay, "cx"), number(relay, "cy"))
        );
    }
    // Relays rise along the chain, and both ends stand on the ground.
    assert!(
        relays
            .windows(2)
            .all(|pair| number(&pair[1], "cy") < number(&pair[0], "cy"))
    );
    assert_eq!(number(&hops[0], "y1"), number(&hops[8], "y2"));
    assert!(number(&hops[0], "y1") > number(&relays[0], "cy"));
}

#[test]
fn numbers_never_cover_each_other() {
    for picture in gallery() {
        let svg = draw(&picture);
        let document = Document::parse(&svg).unwrap();
        let mut extents: Vec<[f64; 4]> = all(&document, "text", "sir")
            .iter()
            .map(|text| extent(text, 10.0))
            .collect();
        extents.extend(
            all(&document, "text", "node")
                .iter()
                .map(|text| extent(text, 9.0)),
        );
        for (index, a) in extents.iter().enumerate() {
            for b in &extents[..index] {
                let apart = a[1] <= b[0] || b[1] <= a[0] || a[3] <= b[2] || b[3] <= a[2];
                assert!(
                    apart,
                    "{a:?} covers {b:?} with {} relays",
                    picture.nodes.len()
                );
            }
        }
    }
}

#[test]
fn short_chains_have_every_number_and_long_ones_a_few() {
    for relays in [1, 2, 8] {
        let svg = draw(&level(relays));
        let document = Document::parse(&svg).unwrap();
        assert_eq!(all(&document, "text", "sir").len(), relays + 1);
        assert_eq!(all(&document, "text", "node").len(), relays);
    }
    for relays in [50, 100, 1000] {
        let svg = draw(&level(relays));
        let document = Document::parse(&svg).unwrap();
        let sirs = all(&document, "text", "sir");
        assert!((6..=21).contains(&sirs.len()), "{} numbers", sirs.len());
        // Whatever is left out, the worst hop's is not.
        assert!(sirs.iter().any(|text| words(text) == "0.0"), "{relays}");
        let mut row: Vec<[f64; 4]> = sirs.iter().map(|text| extent(text, 10.0)).collect();
        row.retain(|extent| extent[3] == row_of_most(&sirs));
        row.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert!(row.len() >= 6);
        assert!(
            row.windows(2).all(|pair| pair[1][0] - pair[0][1] > 4.0),
            "{row:?}"
        );
    }
}

/// The height at which most of some texts stand.
fn row_of_most(texts: &[Node]) -> f64 {
    let heights: Vec<f64> = texts.iter().map(|text| number(text, "y")).collect();
    let count = |height: f64| heights.iter().filter(|other| **other == height).count();
    heights
        .iter()
        .copied()
        .max_by_key(|height| count(*height))
        .unwrap()
}

#[test]
fn colours_tell_how_far_a_hop_is_above_the_worst() {
    let at = |decibels: f64| 2.5 * 10f64.powf(decibels / 10.0);
    let hop_sir = vec![
        at(0.0),
        at(0.09),
        at(0.11),
        at(0.9),
        at(1.1),
        at(5.9),
        at(6.1),
        f64::NAN,
        0.0,
    ];
    let svg = draw(&Picture {
        hop_sir,
        ..level(8)
    });
    let document = Document::parse(&svg).unwrap();
    let mut colours: Vec<(String, String)> = all(&document, "line", "hop")
        .iter()
        .map(|hop| (tip(hop), hop.attribute("style").unwrap()[7..14].to_owned()))
        .collect();
    colours.sort();
    let expected = [
        "#d55e00", "#d55e00", "#e69f00", "#e69f00", "#56b4e9", "#56b4e9", "#0072b2", "#999999",
        "#999999",
    ];
    assert_eq!(
        colours
            .iter()
            .map(|(_, colour)| colour.as_str())
            .collect::<Vec<_>>(),
        expected
    );
    assert_eq!(colours[8].0, "hop 9: SIR unknown");
    let swatches = all(&document, "line", "swatch");
    let legend: Vec<&str> = swatches
        .iter()
        .map(|line| &line.attribute("style").unwrap()[7..14])
        .collect();
    assert_eq!(legend, ["#d55e00", "#e69f00", "#56b4e9", "#0072b2"]);
    assert!(has_text(&document, "SIRS= 2.5000 (3.98 dB)"), "{svg}");
}

#[test]
fn the_axes_have_units_and_round_ticks_from_the_ground_up() {
    for (picture, x_ticks, h_ticks) in [
        (level(8), ["0", "200", "1000"], ["0", "20", "25"]),
        (
            chain(3, 10.0, |_| 20.0),
            ["0", "2", "10"],
            ["0", "20", "25"],
        ),
        (
            chain(3, 1e5, |_| 0.2),
            ["0", "20000", "100000"],
            ["0.00", "0.20", "0.25"],
        ),
    ] {
        let svg = draw(&picture);
        let document = Document::parse(&svg).unwrap();
        for wanted in ["x (m)", "h (m)"] {
            assert!(has_text(&document, wanted), "{wanted}");
        }
        let shown = |class| {
            all(&document, "text", class)
                .iter()
                .map(words)
                .collect::<Vec<_>>()
        };
        for (ticks, class) in [(x_ticks, "tick"), (h_ticks, "end")] {
            let shown = shown(class);
            assert!(shown.len() <= 10, "{shown:?}");
            for tick in ticks {
                assert!(
                    shown.iter().any(|other| other == tick),
                    "no {tick} in {shown:?}"
                );
            }
        }
    }
}

#[test]
fn relays_all_at_one_altitude_are_neither_at_the_top_nor_at_the_bottom() {
    for picture in [level(8), chain(8, 1e5, |_| 1e5), chain(8, 10.0, |_| 0.1)] {
        let svg = draw(&picture);
        let document = Document::parse(&svg).unwrap();
        for relay in all(&document, "circle", "relay") {
            assert!((60.0..200.0).contains(&number(&relay, "cy")), "{relay:?}");
        }
    }
}

#[test]
fn interferers_beyond_the_plot_are_pointed_to() {
    let interferers = vec![
        (80.0, -3000.0, -4.0),
        (40.0, 5000.0, 400.0),
        (30.0, 1150.0, 77.0),
        (20.0, -150.0, 88.0),
    ];
    let svg = draw(&Picture {
        interferers,
        ..level(8)
    });
    let document = Document::parse(&svg).unwrap();
    assert!(has_text(
        &document,
        "interferer 80 W, x = -3000 m, |y| = 4 m"
    ));
    assert!(has_text(
        &document,
        "interferer 40 W, x = 5000 m, |y| = 400 m"
    ));
    // The nearer ones are on the axis, which is longer for their sake, and are told of beside their markers.
    for wanted in ["30 W", "|y| = 77 m", "20 W", "|y| = 88 m"] {
        assert!(has_text(&document, wanted), "{wanted}\n{svg}");
    }
    let shapes: Vec<f64> = all(&document, "path", "source")
        .iter()
        .filter(|path| path.children().any(|child| child.has_tag_name("title")))
        .map(|path| {
            path.attribute("d").unwrap()[1..]
                .split(' ')
                .next()
                .unwrap()
                .parse()
                .unwrap()
        })
        .collect();
    assert_eq!(shapes.len(), 4);
    // Arrows first: the left one's tip is left of its marker on the axis, the right one's right.
    assert!(shapes[0] < shapes[3] && shapes[1] > shapes[2], "{shapes:?}");
    let rx = all(&document, "text", "bold")
        .iter()
        .find(|text| words(text) == "Rx")
        .map(|text| number(text, "x"));
    assert!(shapes[2] > rx.unwrap(), "{shapes:?}");

    let far = (1..=9)
        .map(|index| (1.0, 5000.0 * f64::from(index), 0.0))
        .collect();
    let svg = draw(&Picture {
        interferers: far,
        ..level(8)
    });
    let document = Document::parse(&svg).unwrap();
    assert!(
        has_text(&document, "and 6 interferers more beyond the plot"),
        "{svg}"
    );
}

#[test]
fn a_crowd_of_interferers_is_told_of_in_one_line() {
    let crowd = (0..20)
        .map(|index| (1.0 + f64::from(index), 50.0 * f64::from(index), -300.0))
        .collect();
    let svg = draw(&Picture {
        interferers: crowd,
        ..level(8)
    });
    let document = Document::parse(&svg).unwrap();
    assert!(
        has_text(&document, "20 interferers, 1 to 20 W, |y| = 300 m"),
        "{svg}"
    );
}

#[test]
fn silent_relays_are_crossed_out() {
    let arms = |picture: &Picture| {
        let svg = draw(picture);
        let document = Document::parse(&svg).unwrap();
        let dashed = |node: &&Node| node.attribute("style").unwrap().contains("dasharray");
        let dashed = all(&document, "line", "hop").iter().filter(dashed).count();
        let lost = all(&document, "circle", "lost")
            .iter()
            .map(tip)
            .collect::<Vec<_>>();
        (
            all(&document, "line", "cross").len(),
            dashed,
            lost,
            has_text(&document, "silent"),
        )
    };
    assert_eq!(arms(&level(8)), (0, 0, vec![], false));
    let (crosses, dashed, lost, legend) = arms(&Picture {
        lost: vec![3, 8],
        ..level(8)
    });
    // Two strokes each, and two in the legend.
    assert_eq!((crosses, dashed, legend), (6, 4, true));
    assert_eq!(lost.len(), 2);
    assert!(
        lost[0].starts_with("relay 3: x = 333.33 m, h = 20.00 m"),
        "{lost:?}"
    );
    assert!(lost[1].starts_with("relay 8:"), "{lost:?}");
}

#[test]
fn hostile_input_still_makes_a_picture() {
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
        let svg = draw(&picture);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
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
fn the_title_is_said_and_the_same_picture_is_the_same_file() {
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
