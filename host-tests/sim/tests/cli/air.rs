//! Options of the shared channel, and reports of soaks.

use serde_json::Value;

use super::{chain, json, refusal, refusals};

#[test]
fn a_shared_channel_is_csma_unless_said_otherwise() {
    for (extra, access) in [
        (&["--shared"][..], Some("csma")),
        (&["--air", "csma"], Some("csma")),
        (&["--air", "aloha"], Some("aloha")),
        (&["--air", "ideal"], None),
        (&["--wires"], None),
    ] {
        let report = json(&[&["--uavs", "4", "--loss", "0.2"], extra].concat());
        assert_eq!(report["air"]["access"].as_str(), access, "{extra:?}");
        let shared = (extra != ["--wires"]).then_some("shared");
        assert_eq!(report["channel"].as_str(), shared, "{extra:?}");
        assert!(report["sir"].as_f64().unwrap() > 1.0, "{extra:?}");
    }
}

#[test]
fn a_slow_link_takes_longer() {
    let took = |baud| json(&["--baud", baud])["virtual_s"].as_f64().unwrap();
    let (fast, usual, slow) = (took("1000000"), took("115200"), took("9600"));
    assert!(fast < usual && 5.0 * usual < slow, "{fast} {usual} {slow}");
}

#[test]
fn what_the_channel_cannot_carry_is_refused_before_flight() {
    for (uavs, sharing, least) in [
        ("2", "csma", 4_694),
        ("8", "csma", 32_854),
        ("8", "aloha", 32_854),
        ("100", "csma", 37_547),
    ] {
        let below = (least - 1).to_string();
        let arguments = ["--uavs", uavs, "--air", sharing, "--baud", &below];
        let (status, line) = refusal(&arguments);
        assert_eq!(status, 2, "{arguments:?}");
        let says = format!("--baud {below}: must be within {least} to 10000000: ");
        assert!(line.starts_with(&says), "{line}");
    }
    for (sharing, baud) in [("csma", "32854"), ("ideal", "9600")] {
        let report = json(&["--uavs", "8", "--air", sharing, "--baud", baud]);
        assert!(report["sir"].as_f64().unwrap() > 1.0, "{sharing}");
    }
    assert!(
        json(&["--baud", "9600", "--wires"])["sir"]
            .as_f64()
            .unwrap()
            > 1.0
    );
}

#[test]
fn a_soak_goes_on_to_its_end_and_says_how_much_of_it_was_right() {
    let arguments = ["--soak", "200", "--kill", "4@20", "--boot", "4@60"];
    let report = json(&arguments);
    assert_eq!(report["virtual_s"], 200.0);
    let number = |key: &str| report[key].as_f64().unwrap();
    assert!((0.5..0.98).contains(&number("availability")), "{report}");
    assert!(number("longest_outage_s") > 5.0 && number("first_agreement_s") < 2.0);
    assert_eq!(report["most_flying"], 1);
    assert!(number("least_separation_m") > 0.0);
    let text = String::from_utf8(chain(&arguments).stdout).unwrap();
    for line in [
        "air (csma, 115200 baud): load 0.",
        "availability: 0.",
        "at the same time: 1",
        "least separation of two relays: ",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
}

#[test]
fn a_soak_of_a_good_chain_is_right_all_the_time_by_any_link() {
    for extra in [&["--air", "ideal"][..], &["--wires"]] {
        let report = json(&[&["--soak", "60"], extra].concat());
        assert_eq!(report["availability"], 1.0, "{extra:?}");
        assert_eq!(report["longest_outage_s"], 0.0, "{extra:?}");
    }
}

#[test]
fn losses_in_runs_have_the_mean_share_that_was_asked_for() {
    let soaked = ["--soak", "600", "--air", "ideal", "--loss", "0.3"];
    for burst in ["1", "20"] {
        let report = json(&[&soaked[..], &["--burst", burst]].concat());
        let lost = report["faults"]["lost"].as_f64().unwrap();
        // On the ideal channel relays 1 to 8 have 4, 5, 6, 7, 7, 6, 5, 4 receivers and send about equally often.
        let received = report["messages"].as_f64().unwrap() * 5.5;
        assert!((lost / received - 0.3).abs() < 0.06, "{burst}: {report}");
    }
}

#[test]
fn the_story_tells_who_does_not_hear_whom() {
    let output = chain(&["--deaf", "4:3@5-9", "--soak", "20"]);
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "5.000 s  relay 4 does not receive relay 3",
        "9.000 s  relay 4 receives relay 3 again",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
    let report = json(&["--deaf", "4:3@5", "--soak", "20"]);
    let deaf: Vec<&Value> = report["timeline"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|moment| moment["what"] == "does not receive")
        .collect();
    assert_eq!(deaf.len(), 1);
    assert_eq!(
        (deaf[0]["relay"].as_u64(), deaf[0]["other"].as_u64()),
        (Some(4), Some(3))
    );
}

#[test]
fn wrong_options_of_the_air_are_named_with_what_is_allowed() {
    insta::assert_snapshot!(refusals(&[
        "--air csma --wires",
        "--air tdma",
        "--baud 299",
        "--burst 0.5",
        "--burst 2 --loss 0.7",
        "--deaf 4:3",
        "--deaf 4@3",
        "--deaf 4:4@1",
        "--deaf 4:3@9-5",
        "--deaf 9:3@1",
        "--deaf 3:0@1",
        "--soak 0",
    ]));
}
