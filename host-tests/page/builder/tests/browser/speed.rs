//! Loading and response times of the page.
//!
//! Times are noisy: the asserted limits are far above the printed values, except for ratios within one run.

use std::time::{Duration, Instant};

use crate::chromium::Browser;
use crate::opened::{address, choose, number, opened};

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Returns the computing time of a run without recording, as during dragging, ms.
fn took(browser: &mut Browser, times: u32) -> f64 {
    let all = (0..times).map(|_| {
        let runs = number(browser, "window.last.runs");
        browser.run("hand.holds = 'jammer'; run(); hand.holds = null");
        browser.until(&format!("window.last.runs > {runs} && !engine.running"));
        number(browser, "window.last.took_ms")
    });
    median(all.collect())
}

#[test]
fn it_is_there_at_once_and_follows_a_hand() {
    let first = "performance.getEntriesByName('first-contentful-paint')[0]";
    let paints = (0..5).map(|_| {
        // The browser is already running: its own start is not counted.
        let mut browser = Browser::start("about:blank", 1280, 900);
        std::thread::sleep(Duration::from_secs(1));
        browser.open(&address());
        browser.until(first);
        number(&mut browser, &format!("{first}.startTime"))
    });
    let paint = median(paints.collect());
    println!("first paint after {paint:.0} ms");
    assert!(paint < 1_000.0);

    let mut browser = opened(1280, 900);
    choose(&mut browser, "uavs", "50");
    for (method, times) in [("align", 9), ("adjust", 3), ("joint", 3)] {
        choose(&mut browser, "method", method);
        let took = took(&mut browser, times);
        let (words, toml) = (
            browser.text("window.last.words"),
            browser.text("window.last.toml"),
        );
        let alone = (0..times).map(|_| {
            let begun = Instant::now();
            assert!(uav_relay_page::chain(&words, &toml, false).contains("\"sir\":"));
            begun.elapsed().as_secs_f64() * 1e3
        });
        let alone = median(alone.collect());
        println!(
            "{method}: 50 relays agree in {took:.1} ms, {:.2} times what the same code takes without a browser ({alone:.1} ms)",
            took / alone
        );
        assert!(took < 5.0 * alone, "{took} ms, {alone} ms");
    }
    assert_eq!(browser.errors(), Vec::<String>::new());
}

/// Checks that during a long run the page is redrawn, and new input does not wait for its end.
#[test]
fn the_page_stays_awake_while_it_computes() {
    let mut browser = opened(1280, 900);
    choose(&mut browser, "uavs", "100");
    browser.run(
        "window.longest = 0; window.frames_drawn = 0; let last = performance.now(); \
         const turn = () => { const now = performance.now(); window.longest = Math.max(window.longest, now - last); last = now; \
           window.frames_drawn += 1; requestAnimationFrame(turn); }; \
         requestAnimationFrame(turn); \
         byId('method').value = 'joint'; typed()",
    );
    browser.until("window.last.words === options() && !engine.running");
    let computed = number(&mut browser, "window.last.took_ms");
    let longest = number(&mut browser, "window.longest");
    println!("{computed:.0} ms of computing, and at most {longest:.0} ms without a picture");
    assert!(computed > 500.0, "there was something to wait for");
    assert!(longest < 0.5 * computed, "{longest} ms of {computed} ms");

    // A long run is cancelled for newer input.
    browser.run("window.begun = performance.now(); run(); setTimeout(() => { byId('method').value = 'align'; typed(); }, GIVEN_UP + 100)");
    browser.until(
        "window.last.words === options() && window.last.words.includes('align') && !engine.running",
    );
    assert_eq!(browser.errors(), Vec::<String>::new());
}
