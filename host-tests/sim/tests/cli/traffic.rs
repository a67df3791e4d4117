//! Data traffic on the command line: delivered rates, delays, queues, and the time without a relay.

use serde_json::Value;

use super::{chain, example, json, refusals};

/// Largest accepted ratio of the delivered to the promised data rate. It allows for rounding.
const MOST: f64 = 1.0 + 1e-5;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// Returns the JSON report of a run of `cargo chain` with data traffic and a bandwidth of 10 MHz.
fn sent(arguments: &str) -> Value {
    json(&format!("--traffic --bandwidth-hz 1e7 {arguments}"))
}

/// Checks that every offered packet of a report was delivered, dropped or lost, or is in a queue.
fn assert_complete(report: &Value) {
    for flow in report["traffic"]["flows"].as_array().unwrap() {
        let of = |key: &str| flow[key].as_u64().unwrap();
        let gone = ["delivered", "dropped", "lost", "queued"];
        let gone: u64 = gone.iter().map(|key| of(&format!("{key}_packets"))).sum();
        assert_eq!(of("offered_packets"), gone, "{flow}");
    }
}

#[test]
fn the_report_of_the_traffic_in_words() {
    let output = chain("--uavs 2 --traffic both --bandwidth-hz 1e7");
    let text = String::from_utf8(output.stdout).unwrap();
    insta::assert_snapshot!(text);
}

/// Checks the promised and the delivered data rate against bandwidth * log2(1 + SIR) / number of slots.
#[test]
fn the_promised_rate_is_delivered() {
    for (more, slots) in [("", 9.0), ("--offer-bps 1e9", 9.0)] {
        let report = sent(more);
        let promised = 1e7 * (1.0 + number(&report["sir"])).log2() / slots;
        let told = number(&report["promised_bps"][0]);
        assert!((told / promised - 1.0).abs() < 1e-5, "{report}");
        let delivered = number(&report["delivered_bps"][0]);
        let share = delivered / promised;
        assert!((0.95..=MOST).contains(&share), "{report}");
        assert_eq!(report["delivered_bps"].as_array().unwrap().len(), 1);
        assert_complete(&report);
    }
    // Less is offered: all of it arrives, and no packet waits for longer than a frame.
    let report = sent("--offer-bps 1e6");
    let packets = &report["traffic"]["flows"][0];
    let offered = packets["offered_packets"].as_u64().unwrap();
    assert!(packets["delivered_packets"].as_u64().unwrap() + 2 >= offered);
    let frame_s = 12_000.0 / number(&report["promised_bps"][0]);
    let most_s = number(&packets["delay_99_s"]);
    assert!(
        most_s <= 2.0 * frame_s && most_s > frame_s,
        "{most_s} {frame_s}"
    );
}

/// Checks the data rates with equal slots, fitted slots, and a frequency for each hop.
///
/// All nine hops have the same SIR, so fitted slots are equal slots, and separate frequencies carry nine times as
/// much.
#[test]
fn the_scenarios_access_method_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let rate = |access: &str| {
        let file = folder.path().join(format!("{access}.toml"));
        let text = format!(
            "[link]\naccess = \"{access}\"\nbandwidth_hz = 1e7\n{}",
            uav_relay_scenario::DEFAULT
        );
        std::fs::write(&file, text).unwrap();
        let report = json(&format!("--traffic --scenario {}", file.display()));
        assert_eq!(report["traffic"]["access"].as_str(), Some(access));
        let promised = number(&report["promised_bps"][0]);
        let share = number(&report["delivered_bps"][0]) / promised;
        assert!((0.95..=MOST).contains(&share), "{report}");
        promised
    };
    let slots = rate("slots");
    assert!((rate("channels") / slots - 9.0).abs() < 1e-6);
    assert!((rate("fitted") / slots - 1.0).abs() < 1e-4);
}

#[test]
fn a_lost_relay_stops_the_traffic_until_the_chain_closes_up() {
    let report = sent("--kill 3@20");
    assert_complete(&report);
    let periods = report["traffic"]["periods"].as_array().unwrap();
    let (first, last) = (&periods[0], &periods[periods.len() - 1]);
    for (period, relays) in [(first, 8), (last, 7)] {
        assert_eq!(period["state"].as_str(), Some("agreed"), "{period}");
        assert_eq!(period["relays"].as_u64(), Some(relays), "{period}");
    }
    let share = number(&first["delivered_bps"][0]) / number(&first["promised_bps"][0]);
    assert!((0.95..=1.0).contains(&share), "{first}");
    let broken = &periods[1];
    assert_eq!(broken["state"].as_str(), Some("broken"), "{broken}");
    assert!((number(&broken["from_s"]) - 20.0).abs() < 1e-9, "{broken}");
    // Packets beyond the gap still arrive.
    let share = number(&broken["delivered_bps"][0]) / number(&first["promised_bps"][0]);
    assert!(share < 0.01, "{broken}");
    assert!(broken["missing_packets"][0].as_u64().unwrap() > 100);
    // Fewer relays have fewer slots: the rate is larger, and more than the offered rate while the queues become empty.
    assert!(number(&last["promised_bps"][0]) > number(&first["promised_bps"][0]));
    let [delivered, offered] = [&last["delivered_bps"], &report["offered_bps"]];
    assert!(number(&delivered[0]) > 0.99 * number(&offered[0]), "{last}");
    // The queue before the gap was full.
    let queues = report["traffic"]["flows"][0]["queues"].as_array().unwrap();
    assert_eq!(queues[2]["node"].as_str(), Some("2"), "{queues:?}");
    assert_eq!(queues[2]["most_packets"].as_u64(), Some(100), "{queues:?}");
    // On wires the gap stays.
    let output = chain("--json --traffic --bandwidth-hz 1e7 --kill 3@20 --wires");
    let wires: Value = serde_json::from_slice(&output.stdout).unwrap();
    let periods = wires["traffic"]["periods"].as_array().unwrap();
    let last = &periods[periods.len() - 1];
    assert_eq!(last["state"].as_str(), Some("broken"), "{last}");
}

#[test]
fn no_data_passes_below_the_first_step() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let steps = "[link]\nbandwidth_hz = 1e7\nsteps = [{ sinr_db = 80, bits_per_hz = 1 }]\n";
    std::fs::write(&file, format!("{steps}{}", uav_relay_scenario::DEFAULT)).unwrap();
    let path = file.path().display();
    for more in ["", "--offer-bps 1e6"] {
        let report = json(&format!("--traffic --scenario {path} {more}"));
        for key in ["promised_bps", "delivered_bps"] {
            assert!(number(&report[key][0]).abs() < f64::EPSILON, "{report}");
        }
        assert_complete(&report);
    }
}

/// Checks that data is delivered in all kinds of runs.
///
/// Drones or the interferer move; the interference is from several interferers or a random field; a mission is
/// uploaded.
#[test]
fn every_kind_of_run_carries_traffic() {
    let several = example("multi_interferer.toml");
    let field = example("field.toml");
    for arguments in [
        "--uavs 3 --fly",
        "--uavs 3 --listen --move-interferer 1,0",
        "--uavs 3 --upload 20:x_m=300",
        "--uavs 3 --method joint",
        "--uavs 3 --partition 1@10-40 --loss 0.1",
        &format!("--uavs 3 --scenario {several}"),
        &format!("--uavs 3 --scenario {field} --method stochastic"),
    ] {
        let report = sent(arguments);
        assert_complete(&report);
        assert!(number(&report["delivered_bps"][0]) > 0.0, "{arguments}");
        assert_eq!(
            report,
            sent(arguments),
            "the same seed gives the same output"
        );
    }
}

#[test]
fn wrong_traffic_options_are_named_with_what_is_allowed() {
    insta::assert_snapshot!(refusals(&[
        "--traffic",
        "--traffic backward",
        "--traffic --bandwidth-hz 0.5",
        "--traffic --bandwidth-hz 1e7 --offer-bps 0",
        "--traffic --bandwidth-hz 1e7 --packet-bytes 0",
        "--traffic --bandwidth-hz 1e7 --queue-packets 0",
        "--bandwidth-hz 1e7",
        "--offer-bps 1e6",
        "--packet-bytes 1500",
        "--queue-packets 10",
        "--traffic both --bandwidth-hz 1e7 --method stochastic --scenario EXAMPLES/field.toml",
        "--traffic both --bandwidth-hz 1e7 --upload 20",
        "--traffic --bandwidth-hz 1",
        "--traffic --bandwidth-hz 1e12 --kill 3@20",
    ]));
}
