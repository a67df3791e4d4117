//! The page, and user actions.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use super::chromium::Browser;

pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(3)
        .unwrap()
}

pub(crate) fn page() -> &'static PathBuf {
    static PAGE: OnceLock<PathBuf> = OnceLock::new();
    PAGE.get_or_init(|| {
        let built = Command::new(env!("CARGO_BIN_EXE_page")).output().unwrap();
        assert!(built.status.success(), "{built:?}");
        PathBuf::from(String::from_utf8(built.stdout).unwrap().trim())
    })
}

pub(crate) fn address() -> String {
    format!("file://{}", page().display())
}

pub(crate) fn opened(width: u32, height: u32) -> Browser {
    let mut browser = Browser::start(&address(), width, height);
    browser.until("window.ready === true");
    settled(&mut browser);
    browser
}

/// JavaScript condition: the last simulation run is for the present input, and no run is pending.
///
/// The user must not be dragging a symbol, because a run during a drag has no recording.
const SETTLED: &str = "!engine.running && !engine.next && !hand.holds && window.last.toml === scenario() \
    && window.last.words === options() && window.last.runs > 1";

/// Waits until the page has no simulation run pending, then moves the playback to its end.
pub(crate) fn settled(browser: &mut Browser) {
    browser.until(SETTLED);
    browser.run("player.stop(); player.seek(Math.max(0, player.ticks.length - 1))");
    browser.until("shown.frame === 0");
}

pub(crate) fn choose(browser: &mut Browser, id: &str, value: &str) {
    browser.run(&format!(
        "const field = byId('{id}'); field.value = '{value}'; \
         field.dispatchEvent(new Event('change', {{ bubbles: true }}))"
    ));
    settled(browser);
}

pub(crate) fn press(browser: &mut Browser, id: &str) {
    browser.run(&format!("byId('{id}').click()"));
    settled(browser);
}

/// Returns the text of the page's element with this `id`.
pub(crate) fn said(browser: &mut Browser, id: &str) -> String {
    browser.text(&format!("byId('{id}').textContent"))
}

pub(crate) fn number(browser: &mut Browser, expression: &str) -> f64 {
    browser.value(expression).as_f64().unwrap()
}

pub(crate) fn sir(browser: &mut Browser) -> f64 {
    number(browser, "window.last.told.report.sir")
}

/// Returns the screen position, px, of the centre of the relay, interferer or other symbol `id`.
pub(crate) fn middle(browser: &mut Browser, id: &str) -> [f64; 2] {
    let at = browser.value(&format!(
        "(() => {{ const box = document.querySelector('#{id} .halo').getBoundingClientRect(); \
         return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
    ));
    [0, 1].map(|part| at[part].as_f64().unwrap())
}

fn native(browser: &mut Browser) -> String {
    let toml = browser.text("window.last.toml");
    let words = browser.text("window.last.words");
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), toml).unwrap();
    // With the variable `PROGRAMS` the program is built together with these tests.
    let mut command = if std::env::var_os("PROGRAMS").is_some() {
        let own = std::env::current_exe().unwrap();
        Command::new(own.ancestors().nth(2).unwrap().join("chain"))
    } else {
        let mut cargo = Command::new("cargo");
        cargo.arg("chain");
        cargo
    };
    let output = command
        .current_dir(root())
        .args(["--json", "--scenario"])
        .arg(file.path())
        .args(words.split_whitespace())
        .output()
        .unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Returns the member `report` of the JSON text `told`, the result of a simulation run in the page.
///
/// The text of the report is not changed, so that a test can compare it with the report of `cargo chain` byte by byte.
pub(crate) fn report(told: &str) -> &str {
    let report = told.strip_prefix("{\"report\":").unwrap();
    let end = report.find(",\"film\":{\"stands\":").unwrap();
    &report[..end]
}

pub(crate) fn is_native(browser: &mut Browser, what: &str) {
    let (own, native) = (browser.text("window.last.text"), native(browser));
    assert!(native.len() > 200, "{what}: {native}");
    assert_eq!(report(&own), native, "{what}");
}

#[test]
fn the_numbers_are_those_of_the_command_to_the_bit() {
    let mut browser = opened(1280, 900);
    is_native(&mut browser, "as it begins");
    let first = browser.text("byId('first').textContent");
    let again = browser.text("window.last.text");
    assert_eq!(first, again, "what the page brings along");
    assert!((sir(&mut browser) - 2.4655).abs() < 1e-3);
    for (id, value) in [
        ("uavs", "20"),
        ("method", "joint"),
        ("method", "adjust"),
        ("loss", "30"),
        ("power", "3"),
    ] {
        choose(&mut browser, id, value);
        is_native(&mut browser, &format!("{id} {value}"));
    }
    choose(&mut browser, "method", "align");
    choose(&mut browser, "uavs", "5");
    press(&mut browser, "listen");
    is_native(&mut browser, "listening");
    press(&mut browser, "moving");
    is_native(&mut browser, "following");
    assert!(browser.value("player.ticks.length").as_u64() > Some(100));
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// Checks the percentage that the page states: the chain's SIR divided by the best possible SIR.
///
/// One of six relays is switched off. The best possible SIR must be that of five relays.
#[test]
fn a_relay_that_is_off_does_not_count_in_the_share_of_the_optimum() {
    let mut browser = opened(1280, 900);
    choose(&mut browser, "uavs", "6");
    press(&mut browser, "listen");
    let at = middle(&mut browser, "relay4");
    browser.drag(at, at, 0);
    browser.until("want.off.has(4) && window.last.told.report.left === 5");
    settled(&mut browser);
    is_native(&mut browser, "listening without relay 4");
    let native: serde_json::Value = serde_json::from_str(&native(&mut browser)).unwrap();
    let share = native["share_of_optimum"].as_f64().unwrap();
    assert!(share > 0.9 && share < 1.01, "{native}");
    let words = said(&mut browser, "summary");
    let end = format!(
        " {:.1} % of the best SIR possible if the interferer were known.",
        100.0 * share
    );
    assert!(words.ends_with(&end), "{end}: {words}");
    assert!(words.contains(" with 5 relays; "), "{words}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}
