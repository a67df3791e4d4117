//! Page of a recorded flight in a browser: from a file, without a server.

use std::path::Path;
use std::time::Duration;

use clap::Parser as _;
use uav_relay_capture::{Capture, Direction, Frame};
use uav_relay_scenario::Scenario;
use uav_relay_sim::cli::{Options, Prepared};
use uav_relay_sim::simulator::setup::Setup;

use super::chromium::Browser;
use super::opened::number;

/// Records a simulated flight in `folder`; returns its replay page and the drones' final positions.
///
/// `words` are further options of `cargo chain`.
fn recorded(folder: &Path, words: &str) -> (String, Vec<[f64; 2]>) {
    let words = format!("chain --fly --watch tx {words}");
    let options = Options::try_parse_from(words.split_whitespace()).unwrap();
    let prepared = Prepared::new(&options, Scenario::default(), None).unwrap();
    let setup = Setup {
        record: true,
        ..prepared.setup.clone()
    };
    let end = setup.soak.unwrap();
    let mut chain = prepared.fly(setup, |_| Ok(())).unwrap();
    chain.advance(end);
    let path = folder.join("air.pcapng");
    let file = std::fs::File::create(&path).unwrap();
    let mut capture = Capture::new(file, "a test", "").unwrap();
    let channel = capture.interface("channel", "").unwrap();
    for frame in chain.frames(end) {
        let frame = Frame {
            at: Duration::from_micros(frame.at.as_micros()),
            bytes: &frame.bytes,
            len: frame.bytes.len(),
            direction: Direction::Unknown,
            comment: "",
        };
        capture.frame(channel, &frame).unwrap();
    }
    capture.finish().unwrap();
    let shown = uav_relay_replay::replay(&[path], None).unwrap();
    let page = folder.join("flight.html");
    std::fs::write(&page, shown.html).unwrap();
    let places = chain.live(end).map(|it| {
        let at = it.report.position.unwrap();
        [f64::from(at.x_m), f64::from(at.y_m)]
    });
    (format!("file://{}", page.display()), places.collect())
}

fn save(name: &str, picture: &[u8]) {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("recorded-{name}.png"));
    std::fs::write(&file, picture).unwrap();
    println!("{}", file.display());
}

#[test]
fn a_recorded_flight_is_played_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let (url, places) = recorded(
        folder.path(),
        "--kill 3@120 --takeover 6@200-260 --soak 400",
    );
    let mut browser = Browser::start(&url, 1280, 900);
    browser.until("document.readyState === 'complete' && map.frames > 0");
    let foreign = browser.value(
        "performance.getEntriesByType('resource').filter((it) => it.name !== 'data:,').length",
    );
    assert_eq!(foreign, 0);

    // The end: each relay is where its drone is, except relay 3, which was switched off.
    browser.run("seek(1e9)");
    let is_last = "received.last.time_s === flight.duration && replay.step === flight.steps.length - 1 && byId('bar').value === byId('bar').max";
    assert_eq!(browser.value(is_last), true);
    for (index, [x, y]) in places.iter().enumerate().filter(|(index, _)| *index != 2) {
        let off = number(
            &mut browser,
            &format!(
                "Math.hypot(received.last.relays[{index}].position.x_m - {x}, received.last.relays[{index}].position.y_m - {y})"
            ),
        );
        assert!(off < 1.0, "relay {}: {off} m", index + 1);
    }
    assert_eq!(browser.text("byId('rows').children[2].className"), "lost");
    let hops = browser.text("received.last.hops.map((hop) => hop.to).join()");
    assert_eq!(hops, "1,2,4,5,6,7,8,Rx");
    let last = browser.text("JSON.stringify(received.last)");
    let lines = browser.value("byId('lines').childElementCount");
    save("end", &browser.seen());

    // Back before the loss, by the keys: fewer lines, no alarm, and the ways until then. Forward again: the same state.
    browser.run("byId('bar').focus(); seek(112)");
    browser.key("j", 74);
    assert!((number(&mut browser, "received.last.time_s") - 102.0).abs() < 0.51);
    assert_eq!(browser.text("byId('rows').children[2].className"), "normal");
    assert_eq!(
        browser.value("received.last.alarms.filter(({ cleared_s: end }) => end === null).length"),
        0
    );
    let fewer = browser.value(&format!("byId('lines').childElementCount < {lines}"));
    assert_eq!(fewer, true);
    browser.run("byId('bar').value = 399; byId('bar').dispatchEvent(new Event('input'))");
    browser.run("seek(1e9)");
    assert_eq!(browser.text("JSON.stringify(received.last)"), last);
    let again = browser.value("byId('lines').childElementCount");
    assert_eq!(again, lines);

    // A mark leads to its alarm, and the flight is played from there, fifty times faster.
    browser.run("document.querySelector('#marks .critical').click()");
    let title = browser.text("document.title");
    assert!(title.contains("relay 3"), "{title}");
    let begun = number(&mut browser, "replay.time");
    browser.run("for (let at = 0; at < 9; at += 1) faster(1)");
    assert_eq!(browser.text("byId('speed').textContent"), "50 ×");
    browser.key(" ", 32);
    browser.until(&format!("replay.time > {begun} + 20"));
    browser.until("replay.time === flight.duration && !replay.playing");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn the_report_and_the_time_bar_fit_a_phone_and_a_wall() {
    let folder = tempfile::tempdir().unwrap();
    let (url, _) = recorded(folder.path(), "--kill 3@60 --soak 200");
    let sizes = [(390, 844), (1280, 900), (1920, 1080)];
    let schemes = ["light", "dark"];
    for ((width, height), scheme) in sizes.into_iter().flat_map(|it| schemes.map(|of| (it, of))) {
        let mut browser = Browser::start(&url, width, height);
        if scheme == "dark" {
            browser.prefer_dark();
        }
        browser.until("document.readyState === 'complete' && map.frames > 0");
        browser.run("seek(150)");
        browser.until("map.pending === 0");
        let is = number(&mut browser, "document.documentElement.scrollWidth");
        assert!(is <= f64::from(width), "{width}: {is} px wide");
        let bar = number(
            &mut browser,
            "window.innerHeight - byId('replay').getBoundingClientRect().bottom",
        );
        assert!(
            bar.abs() < 1.0,
            "{width}: the time bar is {bar} px above the window's end"
        );
        if width > 900 {
            let covered = "document.querySelector('.legend').getBoundingClientRect().bottom - byId('replay').getBoundingClientRect().top";
            let covered = number(&mut browser, covered);
            assert!(
                covered <= 0.0,
                "{width}: the bar covers {covered} px of the legend"
            );
            let share = "byId('chart').getBoundingClientRect().width / byId('report').clientWidth";
            let share = number(&mut browser, share);
            assert!(share > 0.95, "{width}: the chart has {share} of the width");
        }
        save(&format!("{width}-{scheme}-seen"), &browser.seen());
        save(&format!("{width}-{scheme}"), &browser.screenshot());
        browser.passes_axe(&format!("replay, {width} px, {scheme}"));
        assert_eq!(browser.errors(), Vec::<String>::new());
    }
}
