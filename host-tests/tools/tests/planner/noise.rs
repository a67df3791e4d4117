//! Reported noise computed from bandwidth and noise figure.

use std::io::Write as _;

use serde_json::Value;

use super::{plan, said};

/// Returns the paper's scenario with extra lines in `[power]`.
fn with(sections: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    let text = std::fs::read_to_string(super::example("scenario.toml")).unwrap();
    let text = text.replace("[power]", &format!("[power]\n{sections}"));
    writeln!(file, "{text}").unwrap();
    file
}

fn json(file: &tempfile::NamedTempFile) -> Value {
    let output = plan(&format!(
        "--json --uavs 6 --scenario {}",
        file.path().display()
    ));
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// k T0 B F: 1.380649e-23 J/K x 290 K x 20 MHz x 10^0.6 = 3.1879483e-13 W, which is -94.96489 dBm.
#[test]
fn the_noise_is_k_t_b_f_and_says_of_what() {
    let noisy = "\n[noise]\nbandwidth_hz = 20e6\nfigure_db = 6.0\n";
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    let plain = std::fs::read_to_string(super::example("scenario.toml")).unwrap();
    std::fs::write(file.path(), format!("{plain}{noisy}")).unwrap();
    let table = said(&format!("--uavs 6 --scenario {}", file.path().display()));
    let line = "noise: -94.965 dBm, 3.187948e-13 W, at every receiver: k T0 B F with T0 = 290 K, B = 20000000 Hz, F = 6 dB\n";
    assert!(table.contains(line), "{table}");
    let noise = &json(&file)["noise"];
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
    let effective = json(&aired)["noise"]["effective_w"].as_f64().unwrap();
    assert!(
        (effective / 1.597_759_0e-13 - 1.0).abs() < 1e-6,
        "{effective:e}"
    );

    // No derivation for a power stated in the file, or without noise.
    for given in ["\n[noise]\npower_dbm = -95.0\n", ""] {
        std::fs::write(file.path(), format!("{plain}{given}")).unwrap();
        assert!(json(&file)["noise"].is_null(), "{given}");
    }
}
