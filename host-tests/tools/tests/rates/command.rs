//! `cargo plan` for both directions, run as a program.

use std::process::{Command, Output};

use serde_json::Value;

/// Writes the default scenario file with `rx_w` as the power of Rx, W, and the section `[link]`.
fn scenario(rx_w: f64, link: &str) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    let powers = format!("uav_w = 1.0\nrx_w = {rx_w:?}\n");
    let text = uav_relay_scenario::DEFAULT.replace("uav_w = 1.0", &powers);
    assert!(text.contains("rx_w"));
    std::fs::write(&file, format!("{text}\n[link]\n{link}\n")).unwrap();
    file
}

fn plan(file: &tempfile::NamedTempFile, options: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .args(["--scenario", file.path().to_str().unwrap()])
        .args(options.split_whitespace())
        .output()
        .unwrap()
}

fn text(file: &tempfile::NamedTempFile, options: &str) -> String {
    let output = plan(file, options);
    assert!(output.status.success(), "{options}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn json(file: &tempfile::NamedTempFile, options: &str) -> Value {
    serde_json::from_str(&text(file, &format!("--json {options}"))).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// Returns the linear SIRs of all hops in a report: for data toward Rx, and for data toward Tx.
fn sirs(report: &Value) -> [Vec<f64>; 2] {
    [("sir", "rx_sir"), ("sir_back", "rx_sir_back")].map(|(of, of_rx)| {
        let relays = report["relays"].as_array().unwrap().iter();
        let relays = relays.map(|relay| number(&relay[of]));
        relays.chain([number(&report[of_rx])]).collect()
    })
}

fn worst(sirs: &[f64]) -> f64 {
    sirs.iter().copied().fold(f64::INFINITY, f64::min)
}

#[test]
fn relays_are_planned_for_both_directions_on_request() {
    for (reverse, uavs) in [(0.5, 1), (0.5, 3), (0.5, 8), (1.0, 3), (0.1, 20)] {
        let one_way = json(&scenario(5.0, "reverse = 0.0"), &format!("--uavs {uavs}"));
        assert!(one_way["reverse"].is_null() && one_way["worst_both"].is_null());
        let file = scenario(5.0, &format!("reverse = {reverse:?}"));
        let report = json(&file, &format!("--uavs {uavs}"));
        let both = |report: &Value| {
            let [there, back] = sirs(report).map(|sirs| worst(&sirs));
            there.min(back / reverse)
        };
        let sir = number(&report["sir"]);
        assert!((both(&report) / sir - 1.0).abs() < 1e-5, "{report}");
        assert!((number(&report["worst_both"]) / sir - 1.0).abs() < 1e-5);
        assert!(sir > 1.2 * both(&one_way), "{report} {one_way}");
        assert!(sir < number(&one_way["sir"]), "{report} {one_way}");
        assert_eq!(number(&report["reverse"]), reverse);
        // It is proven by interval arithmetic (`plan::bound`).
        assert_eq!(report["proven"], true, "{report}");
        let how = if uavs == 1 {
            "the optimum of one relay for both directions"
        } else {
            "Algorithm 1 for both directions"
        };
        assert_eq!(report["how"], how);
        let fewest = json(&file, &format!("--target-sir {}", sir * 0.999));
        assert_eq!(
            (&fewest["uavs"], &fewest["proven"]),
            (&uavs.into(), &true.into()),
            "{fewest}"
        );
        assert!(number(&fewest["sir"]) > sir * 0.9985, "{fewest}");
    }
}

#[test]
fn both_directions_are_in_the_table_and_in_the_picture() {
    let file = scenario(5.0, "reverse = 0.5");
    let svg = tempfile::NamedTempFile::new().unwrap();
    let options = format!("--uavs 3 --svg {}", svg.path().display());
    let table = text(&file, &options);
    let report = json(&file, "--uavs 3");
    for part in [
        "SIR received  SIR [dB] SIR way back back [dB]\n",
        "required: 0.5 times the SIR toward Rx (link.reverse); limiting direction: both equally\n",
        "proven for this model: no positions are better; not modelled: terrain and obstacles\n",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
    assert_eq!(report["worst_direction"], "both");
    let picture = std::fs::read_to_string(svg.path()).unwrap();
    assert!(roxmltree::Document::parse(&picture).is_ok());
    let [there, back] = sirs(&report);
    let db = |sir: f64| 10.0 * sir.log10();
    for (hop, (there, back)) in (1..).zip(there.iter().zip(&back)) {
        let (there, back) = (db(*there), db(*back));
        let tip = format!("hop {hop}: SIR {there:.2} dB, back {back:.2} dB");
        assert!(picture.contains(&tip), "{tip}");
        assert!(
            picture.contains(&format!(">{there:.1} / {back:.1}<")),
            "{hop}"
        );
        assert!(table.contains(&format!(" {back:.3}\n")), "{table}");
    }
    assert!(picture.contains("At hops: SIR to Rx / back, dB"));
    // For one direction the table has no column for the way back.
    let one_way = text(&scenario(5.0, "reverse = 0.0"), "--uavs 3");
    assert!(!one_way.contains("SIR back"), "{one_way}");
}

#[test]
fn data_rates_count_both_directions() {
    for (access, slots) in [("slots", 8), ("channels", 2), ("fitted", 8)] {
        let link = format!("reverse = 0.5\naccess = \"{access}\"\nbandwidth_hz = 1e6");
        let report = json(&scenario(5.0, &link), "--uavs 3 --rates");
        let [there, back] = sirs(&report);
        let bits = |sirs: &[f64]| {
            sirs.iter()
                .map(|sir| (1.0 + sir).log2())
                .collect::<Vec<f64>>()
        };
        let time = |sirs: &[f64]| bits(sirs).iter().map(|bits| 1.0 / bits).sum::<f64>();
        let expected = match access {
            "slots" => [&there, &back].map(|sirs| 1e6 * worst(&bits(sirs)) / 8.0),
            "channels" => [&there, &back].map(|sirs| 1e6 * worst(&bits(sirs)) / 2.0),
            _ => {
                let rate = 1e6 / (time(&there) + 0.5 * time(&back));
                [rate, 0.5 * rate]
            }
        };
        let found = report["rate_bps"].as_array().unwrap();
        for (found, expected) in found.iter().zip(expected) {
            assert!((number(found) / expected - 1.0).abs() < 1e-5, "{report}");
        }
        assert_eq!(report["slots"], slots);
        assert_eq!(report["proven"], access != "fitted", "{report}");
        let rates = report["rates"].as_array().unwrap();
        let worse =
            |rate: &Value| number(&rate["rate_bps"][0]).min(number(&rate["rate_bps"][1]) / 0.5);
        let best = rates.iter().map(worse).fold(0.0, f64::max);
        let named = number(&report["best_rate_bps"]);
        assert!(named <= best && named > 0.9998 * best, "{report}");
        // The fewest relays that carry a target rate to Rx, and half of it back.
        let file = scenario(5.0, &link);
        let target = 0.999 * best;
        let met = json(&file, &format!("--target-rate-bps {target:?}"));
        let uavs = met["uavs"].as_u64().unwrap();
        assert!(
            number(&met["rate_bps"][0]) >= target && number(&met["rate_bps"][1]) >= 0.5 * target
        );
        for (_, fewer) in (1..uavs).zip(rates) {
            assert!(worse(fewer) < target, "{met}");
        }
        let refused = plan(&file, &format!("--target-rate-bps {:?}", 1.01 * best));
        let line = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(refused.status.code(), Some(1), "{line}");
        assert!(
            line.contains("to Rx, and at least 0.5 times this rate back (link.reverse)"),
            "{line}"
        );
    }
    let table = text(
        &scenario(5.0, "reverse = 0.5\nbandwidth_hz = 1e6"),
        "--uavs 3 --rates",
    );
    for part in [
        " back: 4 hops share one frequency in 4 equal time slots, each way half of the time; worst hop while it transmits (without its pauses): ",
        "\n    2 relays carry ",
        " times this rate back (link.reverse), more than 3 relays do; no other number of relays carries a larger rate\n",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
}

#[test]
fn free_altitudes_are_planned_by_the_joint_method_for_both_directions() {
    let file = scenario(5.0, "reverse = 0.5");
    let free = json(&file, "--uavs 3 --altitude free");
    assert_eq!(free["how"], "the joint method for both directions");
    let worse = number(&free["worst_both"]);
    assert!((worse / number(&free["sir"]) - 1.0).abs() < 1e-5, "{free}");
}

#[test]
fn what_has_no_way_back_is_refused_by_name() {
    let file = scenario(5.0, "reverse = 0.5");
    let output = plan(&file, "--uavs 1 --x-m 5");
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{line}");
    assert!(line.contains("link.reverse"), "{line}");
}

/// Checks plans for data in both directions, with several interferers and with an interference field.
#[test]
fn several_interferers_and_fields_are_planned_both_ways() {
    let several = scenario(
        5.0,
        "reverse = 0.5\n[[interferer]]\npower_w = 1.0\nx_m = 0.0\ny_m = 90.0",
    );
    let field = tempfile::NamedTempFile::new().unwrap();
    let text = std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/field.toml"
    ));
    let text = text.unwrap() + "\n[link]\nreverse = 0.5\n";
    std::fs::write(field.path(), text).unwrap();
    for file in [&several, &field] {
        let report = json(file, "--uavs 3");
        let [there, back] = sirs(&report);
        let both = worst(&there).min(worst(&back) / 0.5);
        let sir = number(&report["sir"]);
        assert!((both / sir - 1.0).abs() < 1e-5, "{report}");
        let fewest = json(file, &format!("--target-sir {}", sir * 0.999));
        assert!(fewest["uavs"].as_u64().unwrap() <= 3, "{fewest}");
        assert!(number(&fewest["sir"]) >= sir * 0.998, "{fewest}");
        let rates = json(file, "--uavs 3 --rates --bandwidth-hz 1e6");
        let bits = |sirs: &[f64]| 1e6 * (1.0 + worst(sirs)).log2() / 8.0;
        for (rate, sirs) in rates["rate_bps"]
            .as_array()
            .unwrap()
            .iter()
            .zip([there, back])
        {
            assert!((number(rate) / bits(&sirs) - 1.0).abs() < 1e-5, "{rates}");
        }
    }
}

/// Checks that a plan has the fitted slot of every hop, in order, and as long as the hop needs.
#[test]
fn fitted_slots_of_every_hop_are_in_the_plan() {
    for (reverse, options) in [
        (0.0, "--uavs 3"),
        (0.5, "--uavs 3"),
        (0.5, "--uavs 3 --altitude free"),
        (1.0, "--target-rate-bps 1e5"),
    ] {
        let link = format!("access = \"fitted\"\nbandwidth_hz = 1e6\nreverse = {reverse:?}");
        let file = scenario(5.0, &link);
        let report = json(&file, options);
        let rate = match &report["rate_bps"] {
            Value::Array(rates) => number(&rates[0]),
            rate => number(rate),
        };
        let [there, back] = sirs(&report);
        let share = |sir: &f64, bits: f64| bits * rate / (1e6 * (1.0 + sir).log2());
        let hops = report["hop_slots"].as_array().unwrap();
        assert_eq!(hops.len(), there.len(), "{report}");
        let back = back.iter().map(|sir| share(sir, reverse));
        let back = hops
            .iter()
            .zip(back)
            .map(|(hop, share)| (&hop["slot_back"], share));
        let back: Vec<_> = back.filter(|(_, share)| *share > 0.0).collect();
        let there = hops
            .iter()
            .zip(&there)
            .map(|(hop, sir)| (&hop["slot"], share(sir, 1.0)));
        let mut at = 0.0;
        for (slot, share) in there.chain(back.into_iter().rev()) {
            let [begin, end] = [0, 1].map(|end| number(&slot[end]));
            assert_eq!(begin, at, "{report}");
            assert!(
                (end - begin - share).abs() < 1e-5,
                "{slot} {share} {report}"
            );
            at = end;
        }
        assert_eq!(at, 1.0, "{report}");
        let table = text(&file, options);
        let row = |hop: &Value, key: &str| {
            [0, 1]
                .map(|end| format!("{:.6}", hop[key][end].as_f64().unwrap()))
                .join("   ")
        };
        assert!(table.contains(&row(&hops[1], "slot")), "{table}");
        let header = table.contains("    back from         to\n");
        assert_eq!(header, reverse > 0.0, "{table}");
    }
    let equal = json(&scenario(5.0, "bandwidth_hz = 1e6"), "--uavs 3");
    assert_eq!(equal["hop_slots"], Value::Null);
}

/// Checks that `--out` accepts or refuses plans with fitted slots by their data rate.
///
/// The scenario has several interferers. A fitted slot is as long as its hop needs.
#[test]
fn plans_in_fitted_slots_against_several_interferers_are_written_by_their_rate() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("plan.toml");
    let options = format!("--uavs 3 --altitude free --out {}", out.display());
    let written = |reverse: f64| {
        let text = std::fs::read_to_string(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../examples/multi_interferer.toml"
        ));
        let link = format!("access = \"fitted\"\nbandwidth_hz = 1e6\nreverse = {reverse:?}");
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), format!("{}\n[link]\n{link}\n", text.unwrap())).unwrap();
        plan(&file, &options)
    };
    let one_way = written(0.0);
    assert!(one_way.status.success(), "{one_way:?}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("method = \"joint\""), "{text}");
    std::fs::remove_file(&out).unwrap();
    let both = written(0.5);
    let line = String::from_utf8(both.stderr).unwrap();
    assert_eq!(both.status.code(), Some(1), "{line}");
    assert!(
        line.contains("bit/s/Hz instead of the") && !line.contains("[listen]"),
        "{line}"
    );
    assert!(!out.exists());
}

/// Checks that requests are refused if relays would not fly to the planned positions.
#[test]
fn wrong_requests_for_fitted_slots_and_free_altitudes_are_named() {
    let link = "access = \"fitted\"\nbandwidth_hz = 1e6";
    let refused = |link: &str, options: &str| {
        let output = plan(&scenario(5.0, link), options);
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{options}: {line}");
        line
    };
    for asked in ["--target-sir 5.0", "--target-sir-db 7.0"] {
        let line = refused(link, &format!("{asked} --altitude free"));
        for part in [asked, "link.access = \"fitted\"", "--target-rate-bps"] {
            assert!(line.contains(part), "{line}");
        }
        // Relays at given altitudes choose the positions of the largest SIR.
        assert!(plan(&scenario(5.0, link), asked).status.success());
    }
    let steps = format!("{link}\nsteps = [{{ sinr_db = 0.0, bits_per_hz = 1.0 }}]");
    for options in ["--uavs 2", "--target-rate-bps 1e4"] {
        let line = refused(&steps, &format!("{options} --altitude free"));
        assert!(
            line.contains("link.steps") && line.contains("link.gap_db"),
            "{line}"
        );
        assert!(plan(&scenario(5.0, &steps), options).status.success());
    }
}

/// Checks that `--out` refuses the joint method with `[listen]`, both ways or with fitted slots.
///
/// `cargo provision` refuses it, too.
#[test]
fn the_joint_method_with_listening_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.toml");
    for (link, parts) in [
        ("reverse = 0.5", ["--altitude free", "link.reverse"]),
        (
            "access = \"fitted\"\nbandwidth_hz = 1e6",
            ["link.access", "fitted"],
        ),
    ] {
        let file = scenario(5.0, &format!("{link}\n[listen]"));
        let options = format!("--uavs 2 --altitude free --out {}", out.display());
        let output = plan(&file, &options);
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(
            parts.iter().all(|part| line.contains(part)) && line.contains("[listen]"),
            "{line}"
        );
        assert!(!out.exists());
    }
}

/// Checks that a `reverse` and a noise bandwidth near 0 are refused, with key, value and range.
#[test]
fn a_reverse_and_a_noise_bandwidth_near_zero_are_refused() {
    for (link, options, parts) in [
        (
            "reverse = 1e-10",
            "--uavs 2",
            ["link.reverse", "1e-10", "1e-9 to 1.0"],
        ),
        (
            "reverse = 0.5",
            "--uavs 2 --rates",
            ["--rates", "bandwidth", "1 to 1e12 Hz"],
        ),
    ] {
        let file = scenario(5.0, &format!("{link}\n[noise]\nbandwidth_hz = 0.5"));
        let output = plan(&file, options);
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(parts.iter().all(|part| line.contains(part)), "{line}");
    }
}

/// Checks that fitted slots with free altitudes are planned by the joint method, as on board.
///
/// No number of relays is proven to be the best one.
#[test]
fn fitted_slots_with_free_altitudes_are_planned_as_on_board() {
    for reverse in [0.0, 0.5, 1.0] {
        let file = scenario(5.0, &format!("access = \"fitted\"\nreverse = {reverse:?}"));
        let least = |report: &Value| match &report["rate_bps"] {
            Value::Array(rates) => number(&rates[0]).min(number(&rates[1]) / reverse),
            rate => number(rate),
        };
        for uavs in [1, 2] {
            let bandwidth = format!("--uavs {uavs} --bandwidth-hz 1e6 --rates");
            let line = json(&file, &bandwidth);
            let free = json(&file, &format!("{bandwidth} --altitude free"));
            assert_eq!(
                free["how"],
                "the joint method for time slots fitted to the hops"
            );
            assert!(least(&free) >= least(&line) * (1.0 - 1e-5), "{line} {free}");
            assert_eq!(free["best_is_proven"], false, "{free}");
        }
    }
}

/// Checks that the list of rates with free altitudes equals the rates of single plans.
#[test]
fn rates_with_free_altitudes_are_those_of_the_plans() {
    for access in ["slots", "fitted"] {
        let file = scenario(5.0, &format!("access = \"{access}\"\nreverse = 1.0"));
        let options = "--bandwidth-hz 1e6 --altitude free";
        let listed = json(&file, &format!("--uavs 2 --rates {options}"));
        let best = listed["best_uavs"].as_u64().unwrap();
        let plan = json(&file, &format!("--uavs {best} {options}"));
        let rates = plan["rate_bps"].as_array().unwrap().iter().map(number);
        let worse = rates.fold(f64::INFINITY, f64::min);
        let ratio = number(&listed["best_rate_bps"]) / worse;
        assert!((ratio - 1.0).abs() < 1e-6, "{access} {listed} {plan}");
        assert_eq!(listed["best_is_proven"], false, "{listed}");
    }
}
