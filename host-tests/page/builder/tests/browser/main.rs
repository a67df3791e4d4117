//! The page in a headless Chromium, opened as a file: what a hand does moves the chain, and its numbers are those of `cargo chain --json`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs
)]

mod chromium;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use chromium::Browser;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(3)
        .unwrap()
}

/// The page, built once.
fn page() -> &'static PathBuf {
    static PAGE: OnceLock<PathBuf> = OnceLock::new();
    PAGE.get_or_init(|| {
        let built = Command::new(env!("CARGO_BIN_EXE_page")).output().unwrap();
        assert!(built.status.success(), "{built:?}");
        PathBuf::from(String::from_utf8(built.stdout).unwrap().trim())
    })
}

fn opened(width: u32, height: u32) -> Browser {
    let mut browser = Browser::start(&format!("file://{}", page().display()), width, height);
    browser.until("window.ready === true");
    browser
}

/// What `cargo chain --json` prints for the last run of the page.
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

/// The page's own text of its report, as the code in it wrote it.
const REPORT: &str = r#"(() => {
    const told = wasm_bindgen.chain(window.last.words, window.last.toml);
    const begins = told.indexOf('{"report":') + '{"report":'.length;
    return told.slice(begins, told.indexOf(',"stands":['));
})()"#;

/// Whether the last run is of what is wanted.
const SETTLED: &str = "window.last.toml === scenario() && window.last.words === options()";

fn is_native(browser: &mut Browser, what: &str) {
    let (own, native) = (browser.text(REPORT), native(browser));
    assert!(native.len() > 200, "{what}: {native}");
    assert_eq!(own, native, "{what}");
}

fn choose(browser: &mut Browser, id: &str, value: &str) {
    browser.run(&format!(
        "(() => {{ const field = document.getElementById('{id}'); field.value = '{value}'; \
         field.dispatchEvent(new Event('change', {{ bubbles: true }})); }})()"
    ));
}

fn press(browser: &mut Browser, id: &str) {
    browser.run(&format!("document.getElementById('{id}').click()"));
}

fn sir(browser: &mut Browser) -> f64 {
    browser
        .value("window.last.told.report.sir")
        .as_f64()
        .unwrap()
}

/// Where that sign is on the screen.
fn middle(browser: &mut Browser, id: &str) -> [f64; 2] {
    let at = browser.value(&format!(
        "(() => {{ const box = document.querySelector('#{id} .halo').getBoundingClientRect(); \
         return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
    ));
    [0, 1].map(|part| at[part].as_f64().unwrap())
}

#[test]
fn the_numbers_are_those_of_the_command_to_the_bit() {
    let mut browser = opened(1280, 900);
    is_native(&mut browser, "as it begins");
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
    assert!(browser.value("window.last.told.stands.length").as_u64() > Some(20));
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_hand_and_the_keyboard_move_the_chain() {
    let mut browser = opened(1280, 900);
    let before = sir(&mut browser);
    let [x, y] = middle(&mut browser, "jammer");
    browser.drag([x, y], [x - 60.0, y - 200.0], 10);
    browser.until("window.last.toml.indexOf('y_m = 400.0') < 0");
    browser.until(SETTLED);
    let dragged = sir(&mut browser);
    assert!(dragged < before, "nearer to the line: {dragged}");
    is_native(&mut browser, "dragged");

    let [x, y] = middle(&mut browser, "rx");
    browser.drag([x, y], [x - 100.0, y], 10);
    browser.until("window.last.toml.indexOf('distance_m = 1000.0') < 0");
    browser.until(SETTLED);
    assert!((sir(&mut browser) - dragged).abs() > 1e-6, "another way");
    is_native(&mut browser, "another site");

    let toml = browser.text("window.last.toml");
    browser.run("document.getElementById('jammer').focus()");
    browser.key("ArrowDown", 40);
    browser.until(&format!(
        "window.last.toml !== {}",
        serde_json::to_string(&toml).unwrap()
    ));
    is_native(&mut browser, "by an arrow");
    assert_eq!(browser.text("document.activeElement.id"), "jammer");

    // A relay is switched off by a press, and on again by the keyboard.
    browser.until("!shown.gliding");
    let at = middle(&mut browser, "relay4");
    browser.drag(at, at, 0);
    browser.until("window.last.told.report.left === 7 && want.off.has(4)");
    is_native(&mut browser, "relay 4 is off");
    browser.run("document.getElementById('relay4').focus()");
    browser.key(" ", 32);
    browser.until("window.last.told.report.relays.length === 8");
    is_native(&mut browser, "and on again");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_lost() {
    let mut browser = opened(1280, 900);
    let before = browser.text("document.getElementById('summary').textContent");
    choose(&mut browser, "uavs", "0");
    let wrong = browser.text("document.getElementById('wrong').textContent");
    assert_eq!(wrong, "Relays 0: must be within 1 to 100");
    choose(&mut browser, "uavs", "8");
    assert!(browser.value("document.getElementById('wrong').hidden") == true);
    // Forty relays do not fit on the shortest line.
    choose(&mut browser, "uavs", "40");
    browser.run("(() => { want.rx = want.tx + 50; run(); })()");
    let wrong = browser.text("document.getElementById('wrong').textContent");
    assert!(wrong.contains("no placement"), "{wrong}");
    let kept = browser.text("document.getElementById('summary').textContent");
    assert!(kept.contains("40 relays"), "{kept}");
    assert!(before.contains("8 relays"), "{before}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// Times here are noisy: what is asserted is a ratio to the same code without a browser, and a bound far above what is printed.
#[test]
fn it_is_there_at_once_and_follows_a_hand() {
    let mut browser = opened(1280, 900);
    let paint = browser
        .value("performance.getEntriesByName('first-contentful-paint')[0].startTime")
        .as_f64()
        .unwrap();
    choose(&mut browser, "uavs", "50");
    let took = (0..9).map(|_| {
        browser.run("run()");
        browser.value("window.took_ms").as_f64().unwrap()
    });
    let mut took: Vec<f64> = took.collect();
    took.sort_by(f64::total_cmp);
    let (words, toml) = (
        browser.text("window.last.words"),
        browser.text("window.last.toml"),
    );
    let alone = (0..9).map(|_| {
        let begun = Instant::now();
        assert!(uav_relay_page::chain(&words, &toml).contains("\"sir\":"));
        begun.elapsed().as_secs_f64() * 1e3
    });
    let mut alone: Vec<f64> = alone.collect();
    alone.sort_by(f64::total_cmp);
    println!(
        "first paint after {paint:.0} ms; 50 relays agree in {:.1} ms, {:.2} times what they take without a browser ({:.1} ms)",
        took[4],
        took[4] / alone[4],
        alone[4]
    );
    assert!(took[4] < 10.0 * alone[4]);
    assert!(paint < 2_000.0 && took[4] < 2_000.0);
}

#[test]
fn it_is_laid_out_for_wide_and_for_narrow_screens() {
    for (name, width, height) in [("wide", 1280, 900), ("narrow", 390, 844)] {
        let mut browser = opened(width, height);
        let over = browser.value("document.documentElement.scrollWidth - window.innerWidth");
        assert!(over.as_i64().unwrap() <= 0, "{name}: {over} px too wide");
        let views = browser.value(
            "[...document.querySelectorAll('svg')].map((svg) => svg.getBoundingClientRect().width)",
        );
        let least = f64::from(width) * 0.5;
        for view in views.as_array().unwrap() {
            assert!(view.as_f64().unwrap() > least, "{name}: {view}");
        }
        std::thread::sleep(Duration::from_millis(600));
        let picture = root().join(format!("target/page/{name}.png"));
        std::fs::write(picture, browser.screenshot()).unwrap();
        assert_eq!(browser.errors(), Vec::<String>::new());
    }
}
