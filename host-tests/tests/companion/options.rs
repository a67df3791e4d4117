//! Wrong options end the program with one error line and status 2; the lines are in `snapshots`.

use std::fmt::Write as _;

use crate::process::Relay;

/// Valid options of a relay, which the test puts before each entry of [`WRONG`].
///
/// An entry that is empty or begins with `--index` is tried without these options.
const GOOD: &str = "--index 2 --of 3 --upstream a --downstream b ";

/// Options with the surveyed positions of transmitter and receiver, and their distance.
const SITES: &str = "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431 --distance 1343.795 ";

const WRONG: &[&str] = &[
    "--index 0 --of 3",
    "--index -1 --of 3",
    "--index 1 --of 1001",
    "--index 4 --of 3",
    "--index 2",
    "",
    "--index 2 --of 3 --upstream a",
    "--index 2 --of 3 --downstream a",
    "--index 2 --of 2",
    "--shared x",
    "--flying 3",
    "--index 1 --of 6 --shared a --flying 3",
    "--index 1 --of 6 --shared a --flying 7",
    "--index 1 --of 6 --shared a --flying 1001",
    // The channel cannot carry the chain.
    "--index 2 --of 50 --shared a --baud 57600",
    "--baud 1199",
    "--network 65536",
    "--probe-after-ms 0",
    "--dead-after-ms 5000",
    "--distance 0.5",
    "--distance NaN",
    "--altitude -20",
    "--tx-power 0",
    "--uav-power inf",
    "--min-separation -1",
    "--min-separation 501",
    "--interferer 80,500",
    "--interferer unknown",
    "--following",
    "--listen --listen-every 0",
    "--listen --listen-half-life -1",
    "--listen --listen-error 1.5",
    "--listen --field 0:1e9",
    "--interferer -1,5,4",
    "--interferer 80,x,4",
    "--method stochastic",
    "--band 20",
    "--band 0,20",
    "--band 20,NaN",
    "--band 30,300",
    "--band 300,10",
    "--field 0:1e6,5",
    "--field -1e8:1e6",
    "--field 0:0",
    "--field 5:1e6,5:1e6",
    "--field 0:1e6 --interferer 80,500,400",
    "--field 0:1e6 --method joint",
    "--upload-file x",
    "--site-tx 91,8,400 --site-rx 47,8,400",
    "--site-tx 47,8 --site-rx 47,8,400",
    "--site-tx 47,NaN,400 --site-rx 47,8,400",
    "--site-tx 47,8,10001 --site-rx 47,8,400",
    "--site-tx 47,8,400",
    "--site-rx 47,8,400",
    "--site-tx 47,8,400 --site-rx 47,8,420",
    "--site-tx 47,8,400 --site-rx 49,8,420",
    "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431",
    "--autopilot a",
    "--nonsense",
];

/// Wrong options for a relay that has an autopilot and knows the positions of Tx and Rx.
const WRONG_AUTOPILOT: &[&str] = &[
    "--autopilot a --positions b",
    "--autopilot udp:localhost",
    "--autopilot udp::14540",
    "--autopilot udp:localhost:0",
    "--autopilot udp:localhost:65536",
    "--autopilot udp:localhost:64536",
    "--autopilot udp:localhost:14580@0",
    "--autopilot udp:localhost:14580@x",
    "--autopilot udp:localhost@14540",
    "--autopilot udp::14580@14540",
    "--autopilot-key-file a",
    "--autopilot a --autopilot-key-file nowhere",
    "--autopilot a --autopilot-baud 57",
    "--autopilot-baud 57600",
    "--autopilot a --speed 21",
    "--autopilot a --speed NaN",
    "--speed 5",
];

/// Runs a relay with each of `cases` after the `good` options. Returns each case with its error line.
fn refusals(good: &str, cases: &[&str]) -> String {
    let mut all = String::new();
    for case in cases {
        let alone = case.is_empty() || case.starts_with("--index");
        let good = if alone { "" } else { good };
        let line = Relay::start(&format!("{good}{case}")).refused_at_once(2);
        writeln!(all, "{case}\n    {line}").unwrap();
    }
    all
}

#[test]
fn wrong_options_are_named_with_their_value_and_range() {
    insta::assert_snapshot!(refusals(GOOD, WRONG));
}

#[test]
fn wrong_options_of_an_autopilot_are_named() {
    let good = format!("{GOOD}{SITES}");
    insta::assert_snapshot!(refusals(&good, WRONG_AUTOPILOT));
}

/// Checks that the error line names an autopilot link that cannot be opened at the start.
#[test]
fn an_absent_autopilot_at_the_start_is_an_error() {
    for (autopilot, why) in [
        (
            "/nowhere/tty",
            "--autopilot /nowhere/tty: there is no such device",
        ),
        ("/dev/null", "--autopilot /dev/null: is not a tty"),
        (
            "udp:nowhere.invalid:14540",
            "--autopilot udp:nowhere.invalid:14540: HOST nowhere.invalid is not found: ",
        ),
    ] {
        let line =
            Relay::start(&format!("--index 1 --of 1 --autopilot {autopilot} {SITES}")).refused(1);
        assert!(line.starts_with(why), "{line}");
    }
}
