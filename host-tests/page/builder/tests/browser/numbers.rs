//! The page's numbers equal those of `cargo chain --json`, to the last digit.

use std::process::Command;

use crate::chromium::Browser;
use crate::opened::{choose, opened, press, root, sir};

fn native(browser: &mut Browser) -> String {
    let toml = browser.text("window.last.toml");
    let words = browser.text("window.last.words");
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), toml).unwrap();
    let output = Command::new("cargo")
        .current_dir(root())
        .args(["chain", "--json", "--scenario"])
        .arg(file.path())
        .args(words.split_whitespace())
        .output()
        .unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Extracts the report, character by character, from the result for the page.
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
