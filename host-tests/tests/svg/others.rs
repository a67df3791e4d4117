//! Interferers of a replaced mission, and estimated interferers.

use roxmltree::{Document, Node};
use uav_relay_sim::svg::{OtherInterferers, Picture, draw};

use super::{all, level, number, tip};

#[test]
fn the_interferer_of_the_previous_mission_is_faint() {
    let mut picture = level(8);
    let without = draw(&picture);
    picture.others = vec![(30.0, 200.0, -100.0)];
    let svg = draw(&picture);
    let document = Document::parse(&svg).unwrap();
    let [before] = all(&document, "path", "before").try_into().unwrap();
    assert_eq!(
        tip(&before),
        "interferer of the previous mission: 30 W, x = 200 m, y = -100 m"
    );
    let [words] = all(&document, "text", "faint").try_into().unwrap();
    assert_eq!(words.text(), Some("before"));
    // The text is between the relays at the same fraction of the line.
    let relays = all(&document, "circle", "relay");
    let (left, right) = (number(&relays[0], "cx"), number(&relays[1], "cx"));
    assert!((left..right).contains(&number(&words, "x")));
    // The rest of the picture is the same.
    let plain = Document::parse(&without).unwrap();
    for (name, class) in [("line", "hop"), ("circle", "relay"), ("path", "source")] {
        let shapes = |document: &Document| -> Vec<Vec<String>> {
            let values = |shape: &Node| {
                let attributes = shape.attributes();
                attributes.map(|one| one.value().to_owned()).collect()
            };
            all(document, name, class).iter().map(values).collect()
        };
        assert_eq!(shapes(&document), shapes(&plain), "{name}.{class}");
    }
}

/// Checks that earlier or estimated interferers that would spoil the picture are not drawn.
///
/// Such an interferer is at the position of another drawn interferer, far away, or at an undefined position.
#[test]
fn a_previous_interferer_under_a_present_one_is_left_out() {
    let same = level(8).interferers;
    for others in [
        same,
        vec![(80.0, 5000.0, 0.0)],
        vec![(80.0, f64::NAN, 0.0)],
        Vec::new(),
    ] {
        let picture = Picture {
            others: others.clone(),
            ..level(8)
        };
        assert_eq!(draw(&picture), draw(&level(8)), "{others:?}");
    }
}

/// Checks that an estimated interferer is drawn even next to the true interferer.
#[test]
fn the_estimated_interferer_is_drawn_beside_the_true_one() {
    for (x, y) in [(200.0, -100.0), (500.5, 399.0)] {
        let picture = Picture {
            others: vec![(30.0, x, y)],
            others_are: OtherInterferers::NewEstimate,
            ..level(8)
        };
        let svg = draw(&picture);
        let document = Document::parse(&svg).unwrap();
        let [believed] = all(&document, "path", "before").try_into().unwrap();
        let tip = tip(&believed);
        assert!(tip.starts_with("estimated interferer: 30 W"), "{tip}");
        assert_eq!(all(&document, "path", "source").len(), 1 + 1);
    }
}
