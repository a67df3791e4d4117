//! Playing a run from start to end.

use serde_json::Value;

use crate::chromium::Browser;
use crate::opened::{choose, middle, number, opened, press, said, settled};

/// Returns the playback steps (ticks) of the page as JSON objects.
///
/// Each object has the time in s, the sender of a frame, the SIR of the worst hop, the number of hops, the relays that
/// are off, and the number of relays with a position.
fn ticks(browser: &mut Browser) -> Vec<Value> {
    let ticks = browser.value(
        "player.ticks.map((tick) => ({ at_s: tick.at_s, says: tick.says, worst: Math.min(...tick.sirs), hops: tick.sirs.length, \
         off: [...tick.relays].filter(([, { on }]) => !on).map(([relay]) => relay), \
         told: [...tick.relays].filter(([, { place }]) => place).length }))",
    );
    ticks.as_array().unwrap().clone()
}

#[test]
fn an_agreement_goes_from_hop_to_hop() {
    let mut browser = opened(1280, 900);
    let all = ticks(&mut browser);
    assert_eq!(all[0]["told"], 0, "nobody knows a place before");
    assert_eq!(all.last().unwrap()["told"], 8);
    // Messages travel down the line and back.
    let says: Vec<(u64, i64)> = all
        .iter()
        .filter_map(|tick| tick["says"].as_array())
        .map(|says| (says[0].as_u64().unwrap(), says[1].as_i64().unwrap()))
        .collect();
    let there = (1..8).map(|relay| (relay, 1));
    let back = (2..=8).rev().map(|relay| (relay, -1));
    assert_eq!(says, there.chain(back).collect::<Vec<_>>());
    // Each message is counted when it is sent.
    let counted =
        browser.value("player.ticks.filter((tick) => tick.says).map((tick) => tick.messages)");
    let all_of_them: Vec<u64> = (1..=14).collect();
    assert_eq!(counted, serde_json::json!(all_of_them));
    let mut before = 0;
    for tick in &all {
        let told = tick["told"].as_u64().unwrap();
        assert!(told == before || told == before + 1, "one after the other");
        before = told;
    }
    let slider = browser.value("[byId('time').value, byId('time').max]");
    assert_eq!(slider[0], slider[1], "it stands at its end");
    // The final picture is that of the report.
    let off = number(
        &mut browser,
        "Math.max(...player.ticks.at(-1).sirs.map((sir, at) => Math.abs(sir / [...window.last.told.report.relays.map((it) => it.sir), \
         window.last.told.report.rx_sir][at] - 1)))",
    );
    assert!(off < 1e-6, "{off}");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn a_chain_is_seen_to_lose_a_relay_and_to_close_up() {
    let mut browser = opened(1280, 900);
    let at = middle(&mut browser, "relay4");
    browser.drag(at, at, 0);
    browser.until("window.last.told.report.left === 7 && player.playing");
    let begins = number(&mut browser, "player.now.at_s");
    assert!(begins > 19.0, "from just before the loss: {begins}");
    browser.until("player.playing && byId('relay4').classList.contains('off')");
    settled(&mut browser);
    let all = ticks(&mut browser);
    let silent = all.iter().position(|tick| tick["off"][0] == 4).unwrap();
    let at_s = all[silent]["at_s"].as_f64().unwrap();
    assert!((at_s - 20.0).abs() < 1e-6, "{at_s}");
    let worst = |at: usize| all[at]["worst"].as_f64().unwrap();
    let (before, gap, after) = (worst(silent - 1), worst(silent), worst(all.len() - 1));
    assert!(gap < 0.7 * before, "a hop of twice the length: {gap}");
    assert!(gap < after && after < before, "{gap} {after} {before}");
    assert_eq!(all.last().unwrap()["hops"], 8, "seven relays");

    // Moving the slider shows text and picture of that time.
    browser.run("byId('time').value = 0; byId('time').dispatchEvent(new Event('input'))");
    let words = said(&mut browser, "summary");
    assert_eq!(
        words,
        "At 0.000 s: 0 of 8 relays have an agreed position; 0 messages."
    );
    let waits = browser.value("document.querySelectorAll('#above .hop.waits').length");
    assert_eq!(waits, 9);
    browser.run(&format!("player.seek({silent})"));
    let worst =
        "['#above .hop.worst', '#hops .worst'].map((all) => document.querySelectorAll(all).length)";
    let worst = browser.value(worst).to_string();
    assert_eq!(worst, "[1,1]", "the hop over the gap is red");
    let words = said(&mut browser, "summary");
    assert!(words.starts_with("At 20.000 s: worst hop"), "{words}");
    let coming = browser.value("document.querySelectorAll('#events .coming').length");
    assert!(coming.as_u64() > Some(3), "the loss is noticed later");
    assert_eq!(browser.errors(), Vec::<String>::new());
}

#[test]
fn relays_that_follow_with_one_switched_off_are_shown_where_they_are() {
    let mut browser = opened(1280, 900);
    choose(&mut browser, "uavs", "5");
    press(&mut browser, "listen");
    press(&mut browser, "moving");
    let at = middle(&mut browser, "relay2");
    browser.drag(at, at, 0);
    browser.until("want.off.has(2)");
    settled(&mut browser);
    let last = browser.value(
        "relays().map(({ relay, on, x }) => [relay, on, x - shown.run.tx]).sort((a, b) => a[0] - b[0])",
    );
    let report = browser.value("window.last.told.report");
    let kept = report["relays"].as_array().unwrap();
    for relay in last.as_array().unwrap() {
        let of = kept.iter().find(|it| it["index"] == relay[0]);
        assert_eq!(relay[1] == true, of.is_some(), "{relay}: {report}");
        if let Some(of) = of {
            let [shown, told] = [&relay[2], &of["x_m"]].map(|x| x.as_f64().unwrap());
            assert!((shown - told).abs() < 1e-4, "{relay}: {told}");
        }
    }
    assert_eq!(last[1][1], false, "relay 2 is off");
    // A moving interferer: its final position is 3 m/s times the time from its start.
    let jammer = middle(&mut browser, "jammer");
    browser.run("player.seek(0)");
    let began = middle(&mut browser, "jammer");
    let metres = number(&mut browser, "pictures.above.unit") * (jammer[0] - began[0]);
    let ended_s = report["virtual_s"].as_f64().unwrap();
    assert!(
        (metres / ended_s - 3.0).abs() < 0.05,
        "{metres} m in {ended_s} s"
    );
    assert_eq!(browser.errors(), Vec::<String>::new());
}
