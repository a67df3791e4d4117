//! `cargo plan`, run as a program: table and JSON output.
#![cfg(test)]

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use uav_relay_oracle::cases::{self, Case};
use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::Corridor;

fn plan(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn json(arguments: &str) -> Value {
    let output = plan(&format!("--json {arguments}"));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success() && text.is_empty(),
        "{arguments}: {text}"
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

fn refusal(arguments: &str) -> (i32, String) {
    let output = plan(arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
    (output.status.code().unwrap(), text)
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// Writes a scenario file with the geometry and powers of `case` and the text `interference`.
///
/// `case` is a case of the reference. The channel is the default, which is the paper's.
fn scenario(case: &Case, interference: &str) -> tempfile::NamedTempFile {
    let p = &case.params;
    let mut text = String::new();
    write!(
        text,
        "[geometry]\ndistance_m = {:?}\naltitude_m = {:?}\naltitude_min_m = {:?}\naltitude_max_m = {:?}\n\
         [power]\ntx_w = {:?}\nuav_w = {:?}\n{interference}",
        p.d,
        p.h.clamp(p.h_min, p.h_max),
        p.h_min,
        p.h_max,
        p.p_t,
        p.p_u
    )
    .unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    file
}

fn interferer(case: &Case) -> String {
    let p = &case.params;
    format!(
        "[[interferer]]\npower_w = {:?}\nx_m = {:?}\ny_m = {:?}\n",
        p.p_msi, p.x, p.y
    )
}

/// Returns the reference cases of `function` with the paper's channel, the default of a scenario file.
fn with_the_papers_channel(function: &str) -> Vec<Case> {
    let mut cases = cases::of(function).unwrap();
    cases.retain(|case| (case.params.mu_los - 7_191.811_792).abs() < 1e-3);
    assert!(!cases.is_empty(), "{function}");
    cases
}

#[test]
fn the_command_prints_the_references_theorems() {
    for (function, options) in [
        ("theorem1", "--uavs 1"),
        ("theorem3", "--uavs 1 --altitude free"),
        ("theorem2", "--uavs 1 --x-m"),
    ] {
        for mut case in with_the_papers_channel(function) {
            case.params.h = case.arg("h").unwrap_or(case.params.h_min);
            let x_m = case.arg("x").map(|x| format!("{x:?}")).unwrap_or_default();
            let file = scenario(&case, &interferer(&case));
            let path = file.path().display();
            let report = json(&format!("--scenario {path} {options} {x_m}"));
            let sir = number(&report["sir"]);
            assert!(
                (sir / case.part("sir").unwrap() - 1.0).abs() < 1e-5,
                "{}: {sir}",
                case.id
            );
            let theorem = function.trim_start_matches("theorem").parse().unwrap();
            assert_eq!(report["theorem"].as_u64(), Some(theorem), "{}", case.id);
            if let Some(expected) = case.part("case") {
                assert!(
                    (number(&report["case"]) - expected).abs() < 0.5,
                    "{}",
                    case.id
                );
            }
            assert_eq!(report["proven"].as_bool(), Some(true));
        }
    }
}

/// Checks that a relay with lateral freedom has the reference's SIR.
#[test]
fn one_lateral_relay_agrees_with_the_3d_reference() {
    let side = example("side.toml");
    let report = json(&format!("--scenario {side} --uavs 1 --altitude free"));
    assert_eq!(report["theorem"].as_u64(), Some(4), "{report}");
    assert_eq!(
        report["how"].as_str(),
        Some("the optimum of one relay with a lateral offset")
    );
    assert_eq!(report["proven"].as_bool(), Some(true));
    assert!((1..=8).contains(&report["case"].as_u64().unwrap()));
    let link = Link {
        y_i: 150.0,
        ..Link::paper(1)
    };
    let corridor = Corridor {
        least_m: 20.0,
        most_m: 300.0,
        left_m: -280.0,
        right_m: 280.0,
    };
    let best = optimum(&link, corridor, &[]).unwrap().unwrap();
    let sir = number(&report["sir"]);
    assert!((sir / best.sir - 1.0).abs() < 1e-5, "{sir} {best:?}");
    // With a given altitude the relay has no lateral offset.
    let report = json(&format!("--scenario {side} --uavs 1"));
    assert_eq!(report["theorem"].as_u64(), Some(1), "{report}");
}

#[test]
fn the_command_prints_the_references_counts() {
    for case in with_the_papers_channel("min_uavs") {
        let file = scenario(&case, &interferer(&case));
        let target = format!("{:?}", case.arg("gamma").unwrap());
        let path = file.path().to_str().unwrap();
        let report = json(&format!("--scenario {path} --target-sir {target}"));
        assert!(
            (number(&report["uavs"]) - case.part("N").unwrap()).abs() < 0.5,
            "{}",
            case.id
        );
        assert_eq!(
            report["relays"].as_array().unwrap().len() as u64,
            report["uavs"].as_u64().unwrap()
        );
        assert!(number(&report["sir"]) >= case.arg("gamma").unwrap() * (1.0 - 1e-5));
        assert_eq!(report["proven"].as_bool(), Some(true));
        let db = format!("{:?}", 10.0 * case.arg("gamma").unwrap().log10());
        let again = json(&format!("--scenario {path} --target-sir-db {db}"));
        assert_eq!(again["uavs"], report["uavs"], "{}", case.id);
        // One fewer relay misses the target.
        let fewer = report["uavs"].as_u64().unwrap() - 1;
        if fewer > 0 {
            let best = json(&format!("--scenario {path} --uavs {fewer}"));
            assert!(
                number(&best["sir"]) < case.arg("gamma").unwrap(),
                "{}",
                case.id
            );
        }
    }
}

#[test]
fn rates_are_divided_by_the_slots() {
    for relays in [1_u32, 4, 8] {
        let uavs = relays.to_string();
        let report = json(&format!("--uavs {uavs} --bandwidth-hz 1e7"));
        let hop = 1e7 * (1.0 + number(&report["sir"])).log2();
        let slots = relays + 1;
        assert!((number(&report["hop_rate_bps"]) / hop - 1.0).abs() < 1e-12);
        assert!((number(&report["rate_bps"]) / (hop / f64::from(slots)) - 1.0).abs() < 1e-12);
        assert_eq!(report["slots"].as_u64(), Some(slots.into()));
        assert_eq!(report["best_uavs"].as_u64(), Some(1), "{report}");
        assert!((number(&report["best_rate_bps"]) / 6.58e6 - 1.0).abs() < 1e-3);
        assert_eq!(report["best_is_proven"].as_bool(), Some(true), "{report}");
    }
    let output = plan("--uavs 12 --bandwidth-hz 1e7");
    let table = String::from_utf8(output.stdout).unwrap();
    for part in [
        "data rate: 1.57",
        "e6 bit/s: 13 hops share one frequency in 13 equal time slots; worst hop while it transmits (without its pauses): ",
        "largest data rate: 1 relay carries 6.58",
        "e6 bit/s, more than 12 relays do; no other number of relays carries a larger rate\n",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
    // Without a bandwidth there is no rate.
    assert!(json("--uavs 2")["rate_bps"].is_null());
}

#[test]
fn the_fewest_relays_meet_a_rate_or_the_largest_is_named() {
    let report = json("--target-rate-bps 6e6 --bandwidth-hz 1e7");
    assert_eq!(report["uavs"].as_u64(), Some(1), "{report}");
    assert!(number(&report["rate_bps"]) >= 6e6);
    // With twelve relays each hop sends 20 Mbit/s, but only a thirteenth of the time.
    let (status, line) = refusal("--target-rate-bps 2e7 --bandwidth-hz 1e7");
    assert_eq!(status, 1, "{line}");
    for part in [
        "--target-rate-bps 20000000.0: no number of relays carries this rate, if all hops share one frequency in equal time slots",
        "1 relay carries 6.58",
        "a larger bandwidth than 10000000.0 Hz",
    ] {
        assert!(line.contains(part), "{part}: {line}");
    }
    // In noise alone more relays carry more, up to some number.
    let file = tempfile::NamedTempFile::new().unwrap();
    let noisy = "[geometry]\ndistance_m = 10000\naltitude_m = 20\n[power]\ntx_w = 1\nuav_w = 1\n[channel]\nexcess_loss_los_db = 30\n\
                 excess_loss_nlos_db = 50\n[noise]\nbandwidth_hz = 1e7\n[[interferer]]\npower_w = 1e-6\nx_m = 5000\ny_m = 1e6\n";
    std::fs::write(file.path(), noisy).unwrap();
    let path = file.path().to_str().unwrap();
    let ask = |more: &str| json(&format!("--scenario {path} --bandwidth-hz 1e7 {more}"));
    let one = ask("--uavs 1");
    let best = one["best_uavs"].as_u64().unwrap();
    assert!(best > 1, "{one}");
    assert!(number(&one["best_rate_bps"]) > number(&one["rate_bps"]));
    let at_best = ask(&format!("--uavs {best}"));
    assert_eq!(at_best["rate_bps"], one["best_rate_bps"]);
    for beside in [best - 1, best + 1] {
        let rate = number(&ask(&format!("--uavs {beside}"))["rate_bps"]);
        assert!(rate <= number(&one["best_rate_bps"]), "{beside}: {rate}");
    }
    // These are the fewest relays that meet the target, and not the number with the largest rate.
    let half = 0.5 * (number(&one["rate_bps"]) + number(&one["best_rate_bps"]));
    let met = ask(&format!("--target-rate-bps {half:?}"));
    let uavs = met["uavs"].as_u64().unwrap();
    assert!(uavs > 1 && uavs <= best, "{met}");
    let fewer = ask(&format!("--uavs {}", uavs - 1));
    assert!(number(&fewer["rate_bps"]) < half, "{fewer}");
}

/// Checks the SIR of each hop from Rx to Tx against formulas in this test.
#[test]
fn the_way_back_is_reported_for_every_hop() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = uav_relay_scenario::DEFAULT.replace("uav_w = 1.0", "uav_w = 1.0\nrx_w = 5.0\n");
    assert!(text.contains("rx_w"));
    std::fs::write(&file, text).unwrap();
    let report = json(&format!("--uavs 3 --scenario {}", file.path().display()));
    let relays = report["relays"].as_array().unwrap();
    let place = |index: usize| ["x_m", "y_m", "h_m"].map(|key| number(&relays[index][key]));
    let apart = |[ax, ay, ah]: [f64; 3], [bx, by, bh]: [f64; 3]| {
        (ax - bx).powi(2) + (ay - by).powi(2) + (ah - bh).powi(2)
    };
    let jammer = [500.0, 400.0, 0.0];
    let between_los_and_nlos = 10_f64.powf(2.09);
    let found = relays.iter().map(|relay| &relay["sir_back"]);
    let found: Vec<f64> = found.chain([&report["rx_sir_back"]]).map(number).collect();
    assert_eq!(found.len(), 4);
    let mut worst = f64::INFINITY;
    for (hop, found) in found.into_iter().enumerate() {
        let to = if hop == 0 { [0.0; 3] } else { place(hop - 1) };
        let (from, power_w) = if hop == 3 {
            ([1000.0, 0.0, 0.0], 5.0)
        } else {
            (place(hop), 1.0)
        };
        // The interferer reaches Tx along the ground, with the larger excess loss.
        let interference =
            80.0 / apart(jammer, to) / if hop == 0 { between_los_and_nlos } else { 1.0 };
        let expected = power_w / apart(from, to) / interference;
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "hop {hop}: {found} {expected}"
        );
        worst = worst.min(expected);
    }
    assert!(
        (number(&report["worst_back"]) / worst - 1.0).abs() < 1e-6,
        "{report}"
    );
    let output = plan(&format!("--uavs 3 --scenario {}", file.path().display()));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("\nway back: worst hop SIR 0.0295"),
        "{table}"
    );
    assert!(table.contains(", from Rx to relay 3\n"), "{table}");
    // Without its own power Rx sends with the power of Tx.
    let default = json("--uavs 3");
    let ratio = number(&default["rx_sir_back"]) / number(&report["rx_sir_back"]);
    assert!((ratio / 16.0 - 1.0).abs() < 1e-9, "{ratio}");
    // In a field the interference at Tx is unknown.
    let field = format!("{}/../../examples/field.toml", env!("CARGO_MANIFEST_DIR"));
    assert!(json(&format!("--uavs 3 --scenario {field}"))["worst_back"].is_null());
}

/// Writes a scenario of 10 km whose hops are limited by noise, with `more` in its section `[link]`.
fn linked(more: &str) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = "[geometry]\ndistance_m = 10000\naltitude_m = 20\n[power]\ntx_w = 1\nuav_w = 1\n[channel]\nexcess_loss_los_db = 30\n\
                excess_loss_nlos_db = 50\n[noise]\nbandwidth_hz = 1e7\n[[interferer]]\npower_w = 1e-6\nx_m = 5000\ny_m = 1e6\n[link]\n";
    std::fs::write(&file, format!("{text}{more}")).unwrap();
    file
}

#[test]
fn a_frequency_for_each_hop_carries_the_rate_of_the_worst_hop() {
    let file = linked("access = \"channels\"\ngap_db = 3\n");
    let path = file.path().to_str().unwrap();
    let mut before = 0.0;
    for relays in [1, 4, 16] {
        let report = json(&format!("--scenario {path} --uavs {relays}"));
        let sir = number(&report["sir"]);
        let expected = 1e7 * (1.0 + sir / 10_f64.powf(0.3)).log2();
        let rate = number(&report["rate_bps"]);
        assert!((rate / expected - 1.0).abs() < 1e-12, "{report}");
        assert_eq!(report["slots"].as_u64(), Some(1));
        assert_eq!(report["access"].as_str(), Some("channels"));
        assert!(rate > before, "{relays}");
        before = rate;
    }
    let output = plan(&format!("--scenario {path} --uavs 4"));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("bit/s: each of the 5 hops has its own frequency; worst hop while it transmits (without its pauses): "),
        "{table}"
    );
}

#[test]
fn steps_of_a_radio_are_met_by_the_fewest_relays() {
    let steps = "steps = [{ sinr_db = -5, bits_per_hz = 0.2 }, { sinr_db = 5, bits_per_hz = 1 }]\n";
    let file = linked(&format!("access = \"channels\"\n{steps}"));
    let path = file.path().to_str().unwrap();
    let met = json(&format!("--scenario {path} --target-rate-bps 9e6 --rates"));
    let uavs = met["uavs"].as_u64().unwrap();
    assert!(
        number(&met["sir_db"]) >= 5.0 && (number(&met["rate_bps"]) - 1e7).abs() < 1e-6,
        "{met}"
    );
    let fewer = json(&format!("--scenario {path} --uavs {}", uavs - 1));
    assert!(number(&fewer["sir_db"]) < 5.0, "{fewer}");
    assert!((number(&fewer["rate_bps"]) - 2e6).abs() < 1e-6, "{fewer}");
    // The last rate step is reached, so no other number carries more.
    assert_eq!(met["best_uavs"].as_u64(), Some(uavs), "{met}");
    assert_eq!(met["best_is_proven"].as_bool(), Some(true), "{met}");
    let rates = met["rates"].as_array().unwrap();
    assert_eq!(rates.len() as u64, uavs);
    for (relays, rate) in (1..).zip(rates) {
        assert_eq!(rate["uavs"].as_u64(), Some(relays));
    }
    // With one frequency the rate is divided by the number of slots.
    let slots = linked(steps);
    let path = slots.path().to_str().unwrap();
    let shared = json(&format!("--scenario {path} --uavs {uavs}"));
    let expected = 1e7 / (number(&shared["uavs"]) + 1.0);
    assert!(
        (number(&shared["rate_bps"]) / expected - 1.0).abs() < 1e-12,
        "{shared}"
    );
    // Below the first rate step no data passes.
    let high = linked("steps = [{ sinr_db = 80, bits_per_hz = 1 }]\n");
    let output = plan(&format!("--scenario {} --uavs 2", high.path().display()));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("largest data rate: 0 bit/s: the SINR of the worst hop with any number of relays is below the lowest SINR in link.steps\n"), "{table}");
}

#[test]
fn a_rate_needs_one_bandwidth() {
    let (status, line) = refusal("--target-rate-bps 5");
    assert_eq!(status, 2, "{line}");
    let allowed = "the bandwidth is missing; give --bandwidth-hz, link.bandwidth_hz or noise.bandwidth_hz, 1 to 1e12 Hz";
    assert!(
        line.contains(&format!("--target-rate-bps 5.0: {allowed}")),
        "{line}"
    );
    let (_, line) = refusal("--uavs 2 --rates");
    assert!(line.contains(&format!("--rates: {allowed}")), "{line}");
    let file = linked("");
    let noise = json(&format!("--scenario {} --uavs 1", file.path().display()));
    assert!(
        (number(&noise["bandwidth_hz"]) - 1e7).abs() < 1e-6,
        "{noise}"
    );
    let own = linked("bandwidth_hz = 1e7\n");
    let (status, line) = refusal(&format!(
        "--uavs 1 --bandwidth-hz 2e7 --scenario {}",
        own.path().display()
    ));
    assert_eq!(status, 2, "{line}");
    assert!(
        line.contains("--bandwidth-hz 20000000.0: contradicts link.bandwidth_hz = 10000000.0 of "),
        "{line}"
    );
}

#[test]
fn the_answer_names_what_the_model_leaves_out() {
    for arguments in ["--uavs 3", "--target-sir 3"] {
        let table = String::from_utf8(plan(arguments).stdout).unwrap();
        assert!(
            table.contains(
                "; not modelled: terrain and obstacles; not optimised: the way back from Rx to Tx\n"
            ) && table.contains("proven for this model: "),
            "{table}"
        );
    }
}

/// Checks that the planner reports a wrong UDP port of the autopilot in one line.
#[test]
fn an_autopilot_at_no_udp_port_is_named_in_one_line() {
    let drone = include_str!("../../../examples/drone.toml");
    let begin = "autopilot = \"/dev/ttyAMA0\"";
    assert!(drone.contains(begin));
    let file = tempfile::NamedTempFile::new().unwrap();
    let wrong = drone.replace(begin, "autopilot = \"udp:localhost:65000\"");
    std::fs::write(&file, wrong).unwrap();
    let name = file.path().to_str().unwrap();
    let (status, line) = refusal(&format!("--uavs 1 --scenario {name}"));
    let named = "companion.autopilot = \"udp:localhost:65000\" needs @LOCAL, because the default local port, PORT + 1000 = 66000, is above 65535";
    assert!(status == 2 && line.contains(named), "{line}");
}

#[test]
fn an_unreachable_target_is_status_1_and_names_the_maximum() {
    let output = plan("--target-sir-db 60 --json");
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let most = number(&report["best_sir"]);
    assert!(
        report["error"]
            .as_str()
            .unwrap()
            .contains("gives every hop an SIR of 60 dB: the highest SIR is 20.980 dB, with "),
        "{report}"
    );
    // The reported maximum can be met, and no higher SIR.
    let told = format!("{:?}", most * (1.0 - 1e-5));
    assert!(number(&json(&format!("--target-sir {told}"))["sir"]) >= most * (1.0 - 1e-4));
    let more = format!("{:?}", most * 1.001);
    assert_eq!(refusal(&format!("--target-sir {more}")).0, 1);
    // So many relays do not fit between Tx and Rx.
    let (status, line) = refusal("--uavs 1000");
    assert!(status == 1 && line.contains("min_separation_m"), "{line}");
}

#[test]
fn the_table_names_method_and_proof_and_a_picture_is_drawn() {
    let svg = tempfile::NamedTempFile::new().unwrap();
    let path = svg.path().to_str().unwrap();
    let output = plan(&format!("--uavs 8 --svg {path}"));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("worst hop: SIR 2.4655") && table.contains("8 relays, by Algorithm 1"),
        "{table}"
    );
    assert!(table.contains("no positions are better"), "{table}");
    let drawing = std::fs::read_to_string(path).unwrap();
    assert!(roxmltree::Document::parse(&drawing).is_ok());
    let output = plan("--target-sir 5");
    let table = String::from_utf8(output.stdout).unwrap();
    for part in [
        "with 22 relays, by the paper's optimisation problem (Opt)",
        "fewer relays do not meet the target",
        "highest SIR of this number of relays is 5.16",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
}

#[test]
fn several_interferers_get_a_rated_hypothetical_one() {
    let case = &with_the_papers_channel("hyp_msi")[0];
    let two = |x: [f64; 2], y: f64| {
        x.map(|x| format!("[[interferer]]\npower_w = 40.0\nx_m = {x:?}\ny_m = {y:?}\n"))
            .concat()
    };
    // Interferers close together: the hypothetical interferer is good enough.
    let file = scenario(case, &two([490.0, 510.0], 400.0));
    let path = file.path().to_str().unwrap();
    let near = json(&format!("--scenario {path} --uavs 8"));
    let one = &near["hypothetical"];
    for key in [
        "power_w",
        "x_m",
        "y_m",
        "mean_abs_error_w",
        "relative_error",
    ] {
        assert!(one[key].is_number(), "{key} in {one}");
    }
    assert!(
        number(&one["relative_error"]) < 1e-3 && one["kept"] == true,
        "{one}"
    );
    assert!(
        (number(&one["x_m"]) - 500.0).abs() < 1.0 && (number(&one["power_w"]) - 80.0).abs() < 1.0
    );
    let alone = json("--uavs 8");
    assert!((number(&near["sir"]) / number(&alone["sir"]) - 1.0).abs() < 0.01);
    // Interferers far apart: the hypothetical interferer is not good enough, and the plan has better positions.
    let file = scenario(case, &two([100.0, 900.0], 150.0));
    let path = file.path().to_str().unwrap();
    let far = json(&format!("--scenario {path} --uavs 8"));
    let one = &far["hypothetical"];
    assert!(one["kept"] == false && number(&one["gain"]) > 0.01, "{far}");
    let gained = number(&far["sir"]) / number(&one["sir"]) - 1.0;
    assert!((gained - number(&one["gain"])).abs() < 1e-9);
    let table = String::from_utf8(plan(&format!("--scenario {path} --uavs 8")).stdout).unwrap();
    assert!(
        table.contains("positions for the hypothetical interferer are not good enough")
            && table.contains("a gain of"),
        "{table}"
    );
}

#[test]
fn free_altitudes_give_the_joint_optimum() {
    let altitudes = example("altitudes.toml");
    let free = json(&format!("--scenario {altitudes} --uavs 8 --altitude free"));
    assert!(
        (number(&free["sir"]) / 1.235_783_8 - 1.0).abs() < 1e-3,
        "{free}"
    );
    assert_eq!(free["proven"].as_bool(), Some(false));
    // With free altitudes no more relays are needed.
    let given = json(&format!("--scenario {altitudes} --target-sir 2"));
    let fewer = json(&format!(
        "--scenario {altitudes} --target-sir 2 --altitude free"
    ));
    assert!(number(&fewer["uavs"]) <= number(&given["uavs"]), "{fewer}");
    assert!(number(&fewer["sir"]) >= 2.0);
}

fn output_of(arguments: &str) -> String {
    let output = plan(arguments);
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn example(name: &str) -> String {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    file.join(name).to_str().unwrap().to_owned()
}

#[test]
fn invalid_requests_are_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map");
    let map = map.to_str().unwrap();
    let examples = example("");
    let mut all = String::new();
    for case in [
        "",
        "--uavs 0",
        "--uavs 1001",
        "--uavs 3 --target-sir 2",
        "--target-sir 0",
        "--target-sir nan",
        "--target-sir -3",
        "--target-sir-db 91",
        "--target-rate-bps 5",
        "--uavs 1 --bandwidth-hz 0",
        "--uavs 1 --altitude low",
        "--uavs 1 --x-m -1",
        "--uavs 1 --x-m 1000.5",
        "--uavs 1 --x-m nan",
        "--uavs 2 --x-m 3",
        "--target-sir 2 --x-m 3",
        "--uavs 1 --tolerance 0",
        "--uavs 1 --scenario no-such-file.toml",
        "--uavs 1 --svg /no/such/folder/x.svg",
        "--uavs 3 --geojson MAP",
        "--uavs 3 --kml MAP",
        "--uavs 3 --scenario EXAMPLES/scenario.toml",
        "--uavs 1 --x-m 3 --altitude free",
        "--uavs 1 --x-m far",
        "--uavs 1 --x-m 3 --out MAP",
        "--uavs 3 --altitude free --out MAP --scenario EXAMPLES/field.toml",
        "--uavs 3 --out /no/such/folder/plan.toml",
        "--uavs 3 --scenario EXAMPLES/site.toml --kml /no/such/folder/x.kml",
        "--uavs 3 --force",
        "--uavs ten",
        "--uavs 99999999999999999999",
        "--uavs 3 --altitude fre",
        "--uavs 3 --jsn",
    ] {
        let options = case.replace("MAP", map).replace("EXAMPLES/", &examples);
        let (status, line) = refusal(&options);
        assert_eq!(status, 2, "{case}: {line}");
        let line = line.replace(map, "MAP").replace(&examples, "EXAMPLES/");
        writeln!(all, "{case}\n    {}", line.trim_end()).unwrap();
    }
    insta::assert_snapshot!(all);
    assert!(!std::path::Path::new(map).exists());
    let field = example("field.toml");
    let (status, line) = refusal(&format!("--uavs 1 --x-m 3 --scenario {field}"));
    assert!(status == 2 && line.contains("[[interferer]]"), "{line}");
    // Without a scenario file the message names the keys to change in one.
    let (status, line) = refusal("--uavs 300");
    assert_eq!(status, 1);
    assert!(
        line.starts_with("no placement: 300 relays that stay 4 m apart need 1196 m, but Tx and Rx are 1000 m apart: use fewer relays, or change geometry.min_separation_m or geometry.distance_m in a --scenario FILE"),
        "{line}"
    );
}

#[test]
fn maps_are_written_for_scenarios_with_sites() {
    let folder = tempfile::tempdir().unwrap();
    let [geojson, kml] = ["plan.geojson", "plan.kml"]
        .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    output_of(&format!(
        "--scenario {} --uavs 3 --geojson {geojson} --kml {kml}",
        example("site.toml")
    ));
    let geojson: Value = serde_json::from_str(&std::fs::read_to_string(geojson).unwrap()).unwrap();
    // Tx, Rx, three relays, the interferer, and four hops.
    assert_eq!(geojson["features"].as_array().unwrap().len(), 10);
    let kml = std::fs::read_to_string(kml).unwrap();
    let kml = roxmltree::Document::parse(&kml).unwrap();
    let places = kml
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.opengis.net/kml/2.2", "Placemark")));
    assert_eq!(places.count(), 10);
}

#[test]
fn a_target_in_decibels_is_answered_in_decibels() {
    let (status, line) = refusal("--target-sir-db 60");
    assert_eq!(status, 1);
    assert!(line.starts_with("no number of relays, up to 1000, gives every hop an SIR of 60 dB: the highest SIR is 20.980 dB, with "), "{line}");
    let (_, line) = refusal("--target-sir 1000");
    assert!(
        line.contains("an SIR of 1000: the highest SIR is 125.31"),
        "{line}"
    );
    let (_, line) = refusal(&format!(
        "--target-sir-db 60 --scenario {}",
        example("multi_interferer.toml")
    ));
    assert!(
        line.contains("an SIR of 60 dB: the highest SIR found is ") && line.contains(" dB"),
        "{line}"
    );

    let table = output_of("--target-sir-db 6");
    for part in [
        "worst hop: 6.000 dB (SIR 3.98107",
        "target: SIR 6 dB; the highest SIR of this number of relays is 6.",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
    let table = output_of("--target-sir 4");
    for part in [
        "worst hop: SIR 4.00000",
        "target: SIR 4; the highest SIR of this number of relays is 4.",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
}

#[test]
fn json_has_both_units() {
    let read =
        |arguments: &str| -> Value { serde_json::from_slice(&plan(arguments).stdout).unwrap() };
    let pairs = |report: &Value, names: &[&str]| {
        for name in names {
            let of = |name: &str| {
                report[name]
                    .as_f64()
                    .unwrap_or_else(|| panic!("{name}: {report}"))
            };
            let db = 10.0 * of(name).log10();
            assert!(
                (db - of(&format!("{name}_db"))).abs() < 1e-9,
                "{name}: {report}"
            );
        }
    };
    let met = read("--target-sir-db 6 --json");
    pairs(&met, &["sir", "target_sir", "most_sir", "rx_sir"]);
    pairs(
        &read("--target-sir-db 60 --json"),
        &["best_sir", "target_sir"],
    );
}

#[test]
fn a_theorems_case_is_explained_for_the_drone() {
    let json = json("--uavs 1");
    let table = output_of("--uavs 1");
    let words = json["case_words"].as_str().unwrap();
    assert!(words.starts_with("the drone "), "{words}");
    let line = format!(
        "{words} (Theorem {}, case {})\n",
        json["theorem"], json["case"]
    );
    assert!(table.contains(&line), "{line}: {table}");
    for (arguments, theorem) in [
        ("--x-m 300", "(Theorem 2, case "),
        ("--altitude free", "(Theorem 3, case "),
        (
            &format!("--altitude free --scenario {}", example("side.toml")),
            "(the optimum of one relay with a lateral offset, case ",
        ),
    ] {
        let table = output_of(&format!("--uavs 1 {arguments}"));
        let line = table
            .lines()
            .find(|line| line.contains(theorem))
            .unwrap_or_else(|| panic!("{table}"));
        assert!(line.contains("the drone "), "{line}");
    }
}

/// Checks that numbers on a map are rounded for display: to mm, thousandths of a dB, or whole counts.
#[test]
fn a_map_has_rounded_numbers_with_units_in_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let [geojson, kml] = ["plan.geojson", "plan.kml"]
        .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let scenario = example("decibels.toml");
    let maps = format!("--geojson {geojson} --kml {kml}");
    output_of(&format!("--scenario {scenario} --uavs 3 {maps}"));
    let is_short = |name: &str, number: &str| {
        let decimals = number.split_once('.').map_or("", |(_, decimals)| decimals);
        let most = match name {
            "index" | "hop" => 0,
            "sir_ratio" => 6,
            _ => 3,
        };
        decimals.len() <= most && !number.contains('e')
    };
    let text = std::fs::read_to_string(&geojson).unwrap();
    let map: Value = serde_json::from_str(&text).unwrap();
    let mut names = std::collections::BTreeSet::new();
    for feature in map["features"].as_array().unwrap() {
        for (name, value) in feature["properties"].as_object().unwrap() {
            let Value::Number(number) = value else {
                continue;
            };
            names.insert(name.clone());
            let is_count = matches!(name.as_str(), "index" | "hop");
            assert_eq!(number.is_u64(), is_count, "{name}: {number}");
            assert!(
                is_count || is_short(name, number.to_string().trim_end_matches(".0")),
                "{name}: {number}"
            );
        }
    }
    let known = [
        "amsl_m",
        "eirp_dbm",
        "h_m",
        "hop",
        "index",
        "sir_db",
        "sir_ratio",
        "x_m",
        "y_m",
    ];
    assert!(names.iter().eq(known), "{names:?}");
    let text = std::fs::read_to_string(&kml).unwrap();
    let descriptions = text.split("<description>").skip(1);
    let mut numbers = 0;
    for description in descriptions {
        for pair in description.split('<').next().unwrap().split(", ") {
            let (name, number) = pair.split_once(" = ").unwrap();
            assert!(is_short(name, number), "{pair}");
            numbers += 1;
        }
    }
    assert!(numbers > 20, "{text}");
}

/// Writes a copy of `examples/scenario.toml` with the lines `sections` at the start of `[power]`.
fn with(sections: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    let text = std::fs::read_to_string(example("scenario.toml")).unwrap();
    let text = text.replace("[power]", &format!("[power]\n{sections}"));
    writeln!(file, "{text}").unwrap();
    file
}

fn json_of(file: &tempfile::NamedTempFile) -> Value {
    let output = plan(&format!(
        "--json --uavs 6 --scenario {}",
        file.path().display()
    ));
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Checks the planner's noise power k T0 B F.
///
/// It is 1.380649e-23 J/K x 290 K x 20 MHz x 10^0.6 = 3.1879483e-13 W, or -94.96489 dBm.
#[test]
fn the_noise_is_k_t_b_f_and_names_its_terms() {
    let noisy = "\n[noise]\nbandwidth_hz = 20e6\nfigure_db = 6.0\n";
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    let plain = std::fs::read_to_string(example("scenario.toml")).unwrap();
    std::fs::write(file.path(), format!("{plain}{noisy}")).unwrap();
    let table = output_of(&format!("--uavs 6 --scenario {}", file.path().display()));
    let line = "noise: -94.965 dBm, 3.187948e-13 W, at every receiver: k T0 B F with T0 = 290 K, B = 20000000 Hz, F = 6 dB\n";
    assert!(table.contains(line), "{table}");
    let noise = &json_of(&file)["noise"];
    let is = |name: &str, expected: f64, within: f64| {
        let value = noise[name].as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < within, "{name}: {noise}");
    };
    is("power_w", 3.187_948_3e-13, 1e-7);
    is("power_dbm", -94.964_89, 1e-6);
    is("bandwidth_hz", 20e6, 1e-15);
    is("figure_db", 6.0, 1e-15);
    is("temperature_k", 290.0, 1e-15);
    is("effective_w", 3.187_948_3e-13, 1e-7);

    // Antennas of 3 dBi at the relays and 5 dBi at the receiver: the lower gain counts, 10^0.3 = 1.99526231.
    let gains = "uav_gain_dbi = 3.0\nrx_gain_dbi = 5.0";
    let aired = with(gains);
    let text = std::fs::read_to_string(aired.path()).unwrap();
    std::fs::write(aired.path(), format!("{text}{noisy}")).unwrap();
    let effective = json_of(&aired)["noise"]["effective_w"].as_f64().unwrap();
    assert!(
        (effective / 1.597_759_0e-13 - 1.0).abs() < 1e-6,
        "{effective:e}"
    );

    // The report has no terms of the noise if the file gives its power, or without noise.
    for given in ["\n[noise]\npower_dbm = -95.0\n", ""] {
        std::fs::write(file.path(), format!("{plain}{given}")).unwrap();
        assert!(json_of(&file)["noise"].is_null(), "{given}");
    }
}

fn status_with_closed_output(tool: &str, arguments: &str) -> Option<i32> {
    let pipe = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        Stdio::from(writer)
    };
    let status = Command::new(tool)
        .args(arguments.split_whitespace())
        .stdout(pipe())
        .stderr(pipe())
        .status();
    status.unwrap().code()
}

#[test]
fn a_closed_output_does_not_change_the_status() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [plan, provision, figures] = [
        env!("CARGO_BIN_EXE_plan"),
        env!("CARGO_BIN_EXE_provision"),
        env!("CARGO_BIN_EXE_figures"),
    ];
    let (block, blocks, pages) = (path("block.bin"), path("blocks"), path("figures"));
    for (tool, arguments, status) in [
        (plan, "--uavs 8", 0),
        (plan, "--uavs 8 --json", 0),
        (plan, "--help", 0),
        (plan, "--uavs x", 2),
        (plan, "--target-sir-db 60", 1),
        (provision, &format!("--uavs 3 --index 1 --out {block}"), 0),
        (provision, &format!("--uavs 3 --all --out-dir {blocks}"), 0),
        (provision, &format!("--uavs 3 --all --out-dir {blocks}"), 2),
        (provision, "--help", 0),
        (figures, &format!("--only locus --out {pages}"), 0),
        (figures, "--only none", 2),
        (figures, "--help", 0),
    ] {
        assert_eq!(
            status_with_closed_output(tool, arguments),
            Some(status),
            "{tool} {arguments:?}"
        );
    }
}
