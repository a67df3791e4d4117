//! Error messages of the page.

use crate::chromium::Browser;
use crate::opened::{choose, middle, opened, said, settled};

fn complaint(browser: &mut Browser) -> String {
    let shown = browser.value("!byId('wrong').hidden") == true;
    let words = said(browser, "wrong");
    assert_eq!(shown, !words.is_empty(), "{words}");
    words
}

#[test]
fn a_field_that_is_out_of_its_range_is_said_until_it_is_mended_and_holds_back_no_other() {
    let mut browser = opened(1280, 900);
    choose(&mut browser, "uavs", "0");
    let wrong = "Relays 0: must be within 1 to 100";
    assert_eq!(complaint(&mut browser), wrong);
    choose(&mut browser, "power", "8");
    assert_eq!(complaint(&mut browser), wrong, "it is still there");
    let toml = browser.text("window.last.toml");
    assert!(toml.contains("power_w = 8.0"), "{toml}");
    choose(&mut browser, "loss", "95");
    let both = format!("{wrong}\nFrames lost, % 95: must be within 0 to 90");
    assert_eq!(complaint(&mut browser), both);
    choose(&mut browser, "uavs", "9");
    choose(&mut browser, "loss", "5");
    assert_eq!(complaint(&mut browser), "");
    let words = browser.text("window.last.words");
    assert_eq!(words, "--uavs 9 --method align --loss 0.05");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_chain_that_cannot_be_is_said_and_the_last_one_is_shown_as_that() {
    let mut browser = opened(1280, 900);
    choose(&mut browser, "uavs", "40");
    let stale = "byId('above').classList.contains('stale')";
    assert_eq!(browser.value(stale), false);
    // Forty relays do not fit on the shortest line.
    browser.run("want.rx = want.tx + APART; run()");
    settled(&mut browser);
    let wrong = complaint(&mut browser);
    assert!(wrong.contains("no placement"), "{wrong}");
    let kept = said(&mut browser, "summary");
    assert!(kept.contains("40 relays"), "{kept}");
    assert_eq!(browser.value(stale), true, "it is of other sites");
    browser.run("want.rx = want.tx + 900; run()");
    settled(&mut browser);
    assert_eq!(complaint(&mut browser), "");
    assert_eq!(browser.value(stale), false);
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_site_that_is_dragged_too_near_says_why_it_stops() {
    let mut browser = opened(1280, 900);
    let [x, y] = middle(&mut browser, "rx");
    browser.drag([x, y], [x - 540.0, y], 10);
    browser.until("want.rx === 50");
    settled(&mut browser);
    let wrong = complaint(&mut browser);
    assert!(wrong.contains("at least 50 m apart"), "{wrong}");
    let [x, y] = middle(&mut browser, "rx");
    browser.drag([x, y], [x + 300.0, y], 10);
    browser.until("want.rx > 400");
    settled(&mut browser);
    assert_eq!(complaint(&mut browser), "");
    assert_eq!(browser.errors(), Vec::<String>::new());
}
