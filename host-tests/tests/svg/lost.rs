//! Chains that have lost relays, and the strip of events.

use roxmltree::Document;
use uav_relay_sim::svg::{Picture, draw};

use super::{SIZE, all, assert_apart, has_text, level, number, tip};

#[test]
fn hops_skip_relays_outside_the_chain() {
    let mut picture = level(8);
    picture.left_out = vec![3, 8];
    picture.hop_sir.truncate(7);
    let svg = draw(&picture);
    let document = Document::parse(&svg).unwrap();
    assert_eq!(all(&document, "line", "hop").len(), 7);
    assert_eq!(all(&document, "circle", "relay").len(), 8);
    assert_eq!(all(&document, "line", "cross").len(), 6);
    assert!(has_text(&document, "lost") && has_text(&document, "align, 6 of 8 relays"));
    let relays = all(&document, "circle", "relay");
    let hops = all(&document, "line", "hop");
    let third = hops
        .iter()
        .find(|hop| tip(hop).starts_with("hop 3:"))
        .unwrap();
    assert_eq!(number(third, "x1"), number(&relays[1], "cx"));
    assert_eq!(number(third, "x2"), number(&relays[3], "cx"));
    assert!(
        hops.iter()
            .all(|hop| !hop.attribute("style").unwrap().contains("dasharray"))
    );
    // Without relays there is no chain to draw.
    picture.left_out = (1..=8).collect();
    picture.hop_sir.clear();
    let svg = draw(&picture);
    let document = Document::parse(&svg).unwrap();
    assert_eq!(all(&document, "line", "hop").len(), 0);
    assert!(has_text(&document, "align, 0 of 8 relays"));
}

#[test]
fn events_are_listed_in_a_strip_below() {
    let event = |number: u32| (f64::from(number), format!("what number {number} of all"));
    for (count, shown) in [(1, 1), (2, 2), (8, 8), (9, 8), (1000, 8)] {
        let picture = Picture {
            events: (1..=count).map(event).collect(),
            ..level(8)
        };
        let svg = draw(&picture);
        let document = Document::parse(&svg).unwrap();
        let size = document.root_element().attribute("viewBox").unwrap();
        let height: f64 = size.rsplit(' ').next().unwrap().parse().unwrap();
        assert!(height > SIZE.1);
        let texts = all(&document, "text", "event");
        assert_eq!(texts.len(), 2 * shown);
        assert!(has_text(&document, "1.000 s") && has_text(&document, "Events, not to scale:"));
        if count > 8 {
            assert!(has_text(&document, &format!("{} more", count - 7)));
        }
        assert!(has_text(&document, &format!("{count}.000 s")));
        for a in assert_apart(&document, &[("event", 10.0)]) {
            assert!(a[0] >= 0.0 && a[1] <= SIZE.0 && a[3] <= height, "{a:?}");
        }
    }
}
