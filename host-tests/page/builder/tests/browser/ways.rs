//! Both directions of every hop.

use super::opened::{choose, is_native, number, opened, press, root, said};

#[test]
fn both_directions_of_every_hop_are_shown_and_the_worst_one_is_marked() {
    let mut browser = opened(1280, 900);
    let listed = "document.querySelectorAll('#hops li').length";
    assert_eq!(browser.value(listed), 9);
    assert_eq!(
        browser.value("byId('ways').hidden && byId('rx_w').disabled"),
        true
    );
    choose(&mut browser, "reverse", "1");
    is_native(&mut browser, "both ways");
    assert_eq!(browser.value("byId('rx_w').disabled"), false);
    assert_eq!(browser.value(listed), 18);
    let rows = browser.text(
        "[...document.querySelectorAll('#hops li')].map((row) => row.textContent).join('\\n')",
    );
    let sir_back = number(&mut browser, "window.last.told.report.relays[1].sir_back");
    let row = format!("back to 1{sir_back:.4}, {:.2} dB", 10.0 * sir_back.log10());
    assert!(rows.contains(&row), "{row}: {rows}");
    assert!(
        rows.starts_with("to 1") && rows.contains("\nback to Tx") && rows.contains("\nto Rx"),
        "{rows}"
    );
    let words = said(&mut browser, "summary");
    assert!(
        words.contains(" dB), limited by both directions, with 8 relays; "),
        "{words}"
    );
    assert!((number(&mut browser, "Math.min(...sirs())") - 1.3503).abs() < 1e-3);

    // Hops that are worse on the way back are dashed in the picture, and the bars of the worst ones are marked.
    let marked = [
        "document.querySelectorAll('#above .hop.back').length",
        "document.querySelectorAll('#above .hop:not(.back)').length",
        "document.querySelectorAll('#hops i.back.worst').length",
        "document.querySelectorAll('#hops i.worst:not(.back)').length",
    ];
    for marked in marked {
        assert!(browser.value(marked).as_u64() > Some(0), "{marked}");
    }
    // A weak receiver.
    choose(&mut browser, "rx_w", "5");
    is_native(&mut browser, "a weak receiver");
    let toml = browser.text("window.last.toml");
    assert!(
        toml.contains("rx_w = 5.0") && toml.contains("reverse = 1.0"),
        "{toml}"
    );
    let words = said(&mut browser, "summary");
    let direction = browser.text("limitedBy(window.last.told.report.worst_direction)");
    assert!(words.contains(&direction), "{words}");
    let picture = root().join("target/page/both-ways.png");
    std::fs::create_dir_all(picture.parent().unwrap()).unwrap();
    std::fs::write(picture, browser.screenshot()).unwrap();

    choose(&mut browser, "method", "joint");
    is_native(&mut browser, "the joint method for both directions");

    // What relays cannot do both ways is refused, and the last result stays.
    press(&mut browser, "listen");
    let words = said(&mut browser, "wrong");
    assert!(words.contains("reverse"), "{words}");
    press(&mut browser, "listen");
    choose(&mut browser, "method", "align");
    choose(&mut browser, "reverse", "1.5");
    assert_eq!(
        said(&mut browser, "wrong"),
        "SIR required toward Tx, divided by the SIR toward Rx = 1.5: must be within 0 to 1"
    );
    choose(&mut browser, "reverse", "0");
    assert_eq!(browser.value(listed), 9);
    assert!((number(&mut browser, "Math.min(...sirs())") - 2.4655).abs() < 1e-3);
    assert_eq!(browser.errors(), Vec::<String>::new());
}
