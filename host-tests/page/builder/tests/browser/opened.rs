//! The page, and user actions.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::chromium::Browser;

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

/// Condition: the last run matches the input, has a recording, and nothing is pending.
const SETTLED: &str = "!engine.running && !engine.next && !hand.holds && window.last.toml === scenario() \
    && window.last.words === options() && window.last.runs > 1";

/// Waits until the page has settled, and moves playback to the end.
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

/// Returns the text of that element.
pub(crate) fn said(browser: &mut Browser, id: &str) -> String {
    browser.text(&format!("byId('{id}').textContent"))
}

pub(crate) fn number(browser: &mut Browser, expression: &str) -> f64 {
    browser.value(expression).as_f64().unwrap()
}

pub(crate) fn sir(browser: &mut Browser) -> f64 {
    number(browser, "window.last.told.report.sir")
}

/// Returns the screen position of that sign.
pub(crate) fn middle(browser: &mut Browser, id: &str) -> [f64; 2] {
    let at = browser.value(&format!(
        "(() => {{ const box = document.querySelector('#{id} .halo').getBoundingClientRect(); \
         return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
    ));
    [0, 1].map(|part| at[part].as_f64().unwrap())
}
