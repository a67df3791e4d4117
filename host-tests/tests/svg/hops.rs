//! Relays and hops: complete, connected, coloured, with numbers that never overlap.

use super::*;

#[test]
fn each_relay_is_a_circle_and_each_hop_a_line() {
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
    // Relays rise along the chain, and both ends are on the ground.
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
        assert_apart(
            &Document::parse(&svg).unwrap(),
            &[("sir", 10.0), ("node", 9.0)],
        );
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
        // The worst hop's number is always shown.
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

/// Returns the y coordinate that most of the texts have.
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
fn colours_show_how_far_a_hop_is_above_the_worst() {
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
