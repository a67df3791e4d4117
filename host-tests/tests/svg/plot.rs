//! Axes, interferers inside and outside the plot, and silent relays.

use super::*;

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
fn relays_at_one_altitude_are_in_the_middle_of_the_plot() {
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
    // Nearer ones are on the axis, which is extended for them, with text beside their markers.
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
    // The left arrow's tip is left of its marker on the axis, the right one's right.
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
fn many_interferers_beyond_the_plot_share_one_line() {
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
    // Each cross has two strokes, and the legend has two.
    assert_eq!((crosses, dashed, legend), (6, 4, true));
    assert_eq!(lost.len(), 2);
    assert!(
        lost[0].starts_with("relay 3: x = 333.33 m, h = 20.00 m"),
        "{lost:?}"
    );
    assert!(lost[1].starts_with("relay 8:"), "{lost:?}");
}
