//! Mouse, finger and keyboard input.

use super::chromium::Browser;
use super::opened::{choose, is_native, middle, number, opened, said, settled, sir};

#[test]
fn a_hand_and_the_keyboard_move_the_chain() {
    let mut browser = opened(1280, 900);
    let before = sir(&mut browser);
    let [x, y] = middle(&mut browser, "jammer");
    browser.drag([x, y], [x - 60.0, y - 200.0], 10);
    browser.until("window.last.toml.indexOf('y_m = 400.0') < 0");
    settled(&mut browser);
    let dragged = sir(&mut browser);
    assert!(dragged < before, "nearer to the line: {dragged}");
    is_native(&mut browser, "dragged");

    let [x, y] = middle(&mut browser, "rx");
    browser.drag([x, y], [x - 100.0, y], 10);
    browser.until("window.last.toml.indexOf('distance_m = 1000.0') < 0");
    settled(&mut browser);
    assert!((sir(&mut browser) - dragged).abs() > 1e-6, "another way");
    is_native(&mut browser, "another site");

    let toml = browser.text("window.last.toml");
    browser.run("byId('jammer').focus()");
    browser.key("ArrowDown", 40);
    let toml = serde_json::to_string(&toml).unwrap();
    browser.until(&format!("window.last.toml !== {toml}"));
    settled(&mut browser);
    is_native(&mut browser, "by an arrow");
    assert_eq!(browser.text("document.activeElement.id"), "jammer");

    // A click switches a relay off, the keyboard switches it on again.
    let at = middle(&mut browser, "relay4");
    browser.drag(at, at, 0);
    browser.until("window.last.told.report.left === 7 && want.off.has(4)");
    settled(&mut browser);
    is_native(&mut browser, "relay 4 is off");
    browser.run("byId('relay4').focus()");
    browser.key(" ", 32);
    browser.until("window.last.told.report.relays.length === 8");
    settled(&mut browser);
    is_native(&mut browser, "and on again");
    // Tab reaches one relay; arrow keys move from there to the next.
    let stops = "document.querySelectorAll('#above [role=switch][tabindex=\"0\"]').length";
    assert_eq!(browser.value(stops), 1);
    browser.key("ArrowRight", 39);
    assert_eq!(browser.text("document.activeElement.id"), "relay5");
    assert_eq!(browser.value(stops), 1);
    choose(&mut browser, "uavs", "3");
    assert_eq!(
        browser.value(stops),
        1,
        "where relay 5 is not there any more"
    );
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_finger_drags_what_it_touches_and_else_scrolls_the_page() {
    let mut browser = opened(390, 600);
    browser.run("byId('above').scrollIntoView({ block: 'center' })");
    let [x, y] = middle(&mut browser, "jammer");
    browser.finger([x, y], [x + 40.0, y - 60.0], 8);
    browser.until("want.y < 300 && want.x > 600");
    settled(&mut browser);
    is_native(&mut browser, "by a finger");

    let before = number(&mut browser, "window.scrollY");
    let [x, y] = middle(&mut browser, "jammer");
    // A point on the picture, away from everything on it.
    let from = [x - 150.0, y - 20.0];
    let below = browser.value(&format!(
        "document.elementFromPoint({}, {}).closest('svg').id",
        from[0], from[1]
    ));
    assert_eq!(below, "above", "the finger is on the picture");
    browser.finger(from, [from[0], from[1] - 150.0], 12);
    browser.until(&format!("window.scrollY > {before} + 50"));
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// Checks that a typed number takes effect at once, while the input field still has the keyboard focus.
#[test]
fn a_number_counts_as_soon_as_it_is_typed() {
    let mut browser = opened(1280, 900);
    browser.run("byId('uavs').focus(); byId('uavs').select()");
    browser.types("12");
    browser.until("window.last.told.report.relays.length === 12");
    assert_eq!(browser.text("document.activeElement.id"), "uavs");
    settled(&mut browser);
    let runs = number(&mut browser, "window.last.runs");
    browser.run("byId('uavs').blur()");
    settled(&mut browser);
    let after = number(&mut browser, "window.last.runs");
    assert!((after - runs).abs() < 0.5, "it is not run again: {after}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_drag_that_is_refused_is_explained() {
    let mut browser = opened(1280, 900);
    let [x, y] = middle(&mut browser, "relay4");
    browser.drag([x, y], [x + 10.0, y - 90.0], 10);
    let words = said(&mut browser, "wrong");
    assert!(words.starts_with("Relays cannot be dragged"), "{words}");
    assert_eq!(browser.value("want.off.size"), 0, "a drag is no press");

    let [x, y] = middle(&mut browser, "tx");
    browser.drag([x, y], [x + 10.0, y + 90.0], 10);
    let words = said(&mut browser, "wrong");
    assert!(
        words.starts_with("Tx and Rx cannot leave the line"),
        "{words}"
    );
    let seen = "(() => { const box = byId('wrong').getBoundingClientRect(); \
        return box.top >= 0 && box.bottom <= window.innerHeight; })()";
    browser.run("scrollTo(0, 1e6)");
    assert_eq!(
        browser.value(seen),
        true,
        "wherever the page is scrolled to"
    );
    settled(&mut browser);
    assert_eq!(browser.errors(), Vec::<String>::new());
}

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
    let wrong = "Number of relays = 0: must be within 1 to 100";
    assert_eq!(complaint(&mut browser), wrong);
    choose(&mut browser, "power", "8");
    assert_eq!(complaint(&mut browser), wrong, "it is still there");
    let toml = browser.text("window.last.toml");
    assert!(toml.contains("power_w = 8.0"), "{toml}");
    choose(&mut browser, "loss", "95");
    let both = format!("{wrong}\nFrames lost, % = 95: must be within 0 to 90");
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
