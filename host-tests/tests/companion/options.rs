//! Wrong options end the program with one error line and status 2.

use crate::process::{Ended, Relay};

/// Options to which the later ones of [`WRONG`] are added.
const GOOD: &[&str] = &[
    "--index",
    "2",
    "--of",
    "3",
    "--upstream",
    "a",
    "--downstream",
    "b",
];

/// Wrong options, and the parts of the error line.
const WRONG: &[(&[&str], &[&str])] = &[
    (
        &["--index", "0", "--of", "3"],
        &["--index", "'0'", "1 to 1000"],
    ),
    (
        &["--index", "-1", "--of", "3"],
        &["--index", "'-1'", "1 to 1000"],
    ),
    (
        &["--index", "1", "--of", "1001"],
        &["--of", "'1001'", "1 to 1000"],
    ),
    (&["--index", "4", "--of", "3"], &["--index 4", "1 to 3"]),
    (&["--index", "2"], &["--of", "not provided"]),
    (&[], &["--index", "--of", "not provided"]),
    (
        &["--index", "2", "--of", "3", "--upstream", "a"],
        &["--downstream", "relay 3"],
    ),
    (
        &["--index", "2", "--of", "3", "--downstream", "a"],
        &["--upstream", "relay 1"],
    ),
    (
        &["--index", "2", "--of", "2"],
        &["--upstream", "relay 1", "--shared"],
    ),
    (
        &["--shared", "x"],
        &["--shared x", "cannot be combined with --upstream"],
    ),
    (
        &["--baud", "1199"],
        &["--baud", "'1199'", "1200 to 4000000"],
    ),
    (&["--network", "65536"], &["--network", "'65536'", "65535"]),
    (
        &["--probe-after-ms", "0"],
        &["--probe-after-ms", "'0'", "1 to 3600000"],
    ),
    (
        &["--dead-after-ms", "5000"],
        &["--dead-after-ms 5000", "5001 to 3600000"],
    ),
    (
        &["--distance", "0.5"],
        &["--distance", "'0.5'", "1.0 to 1000000.0"],
    ),
    (
        &["--distance", "NaN"],
        &["--distance", "'NaN'", "1.0 to 1000000.0"],
    ),
    (
        &["--altitude", "-20"],
        &["--altitude", "'-20'", "0.1 to 10000.0"],
    ),
    (
        &["--tx-power", "0"],
        &["--tx-power", "'0'", "1e-6 to 1000000.0"],
    ),
    (
        &["--uav-power", "inf"],
        &["--uav-power", "'inf'", "1e-6 to 1000000.0"],
    ),
    (
        &["--min-separation", "-1"],
        &["--min-separation", "'-1'", "0.0 to 100000.0"],
    ),
    (
        &["--min-separation", "501"],
        &["--min-separation 501", "--distance 1000", "--of 3"],
    ),
    (
        &["--interferer", "80,500"],
        &["--interferer", "'80,500'", "P,X,Y"],
    ),
    (
        &["--interferer", "unknown"],
        &["--interferer unknown", "P,X,Y without --listen"],
    ),
    (&["--following"], &["--listen", "not provided"]),
    (
        &["--listen", "--listen-every", "0"],
        &["--listen-every", "'0'", "0.01 to 100000.0"],
    ),
    (
        &["--listen", "--listen-half-life", "-1"],
        &["--listen-half-life", "'-1'", "0.01 to 1000000000000.0"],
    ),
    (
        &["--listen", "--listen-error", "1.5"],
        &["--listen-error", "'1.5'", "0.001 to 1.0"],
    ),
    (
        &["--listen", "--field", "0:1e9"],
        &["--listen", "--field", "cannot be used with"],
    ),
    (
        &["--interferer", "-1,5,4"],
        &["--interferer", "'-1,5,4'", "P ", "1e-6 to 1000000000.0"],
    ),
    (
        &["--interferer", "80,x,4"],
        &[
            "--interferer",
            "'80,x,4'",
            "X ",
            "-10000000.0 to 10000000.0",
        ],
    ),
    (
        &["--method", "stochastic"],
        &["--method", "'stochastic'", "align, joint, adjust"],
    ),
    (&["--band", "20"], &["--band", "'20'", "LEAST,MOST"]),
    (
        &["--band", "0,20"],
        &["--band", "'0,20'", "LEAST ", "0.1 to 10000.0"],
    ),
    (
        &["--band", "20,NaN"],
        &["--band", "'20,NaN'", "MOST ", "0.1 to 10000.0"],
    ),
    (
        &["--band", "30,300"],
        &["--band 30,300", "LEAST to MOST", "--altitude 20"],
    ),
    (
        &["--band", "300,10"],
        &["--band 300,10", "LEAST to MOST", "--altitude 20"],
    ),
    (
        &["--field", "0:1e6,5"],
        &["--field", "'0:1e6,5'", "X:UPSILON"],
    ),
    (
        &["--field", "-1e8:1e6"],
        &["--field", "'-1e8:1e6'", "X ", "-10000000.0 to 10000000.0"],
    ),
    (
        &["--field", "0:0"],
        &["--field", "'0:0'", "UPSILON ", "1e-9 to 1e32"],
    ),
    (
        &["--field", "5:1e6,5:1e6"],
        &["--field", "'5:1e6,5:1e6'", "x_m must rise"],
    ),
    (
        &["--field", "0:1e6", "--interferer", "80,500,400"],
        &["--field", "--interferer", "cannot be used"],
    ),
    (
        &["--field", "0:1e6", "--method", "joint"],
        &["--method joint", "align with --field"],
    ),
    (&["--upload-file", "x"], &["--key-file", "not provided"]),
    (
        &["--site-tx", "91,8,400", "--site-rx", "47,8,400"],
        &["--site-tx", "'91,8,400'", "LAT,LON,AMSL", "-90 to 90"],
    ),
    (
        &["--site-tx", "47,8", "--site-rx", "47,8,400"],
        &["--site-tx", "'47,8'", "LAT,LON,AMSL"],
    ),
    (
        &["--site-tx", "47,NaN,400", "--site-rx", "47,8,400"],
        &["--site-tx", "'47,NaN,400'", "-180 to 180"],
    ),
    (
        &["--site-tx", "47,8,10001", "--site-rx", "47,8,400"],
        &["--site-tx", "'47,8,10001'", "-1000 to 10000"],
    ),
    (&["--site-tx", "47,8,400"], &["--site-rx", "not provided"]),
    (&["--site-rx", "47,8,400"], &["--site-tx", "not provided"]),
    (
        &["--site-tx", "47,8,400", "--site-rx", "47,8,420"],
        &["--site-rx", "0.00 m apart", "10 to 100000 m"],
    ),
    (
        &["--site-tx", "47,8,400", "--site-rx", "49,8,420"],
        &["--site-rx", "m apart", "10 to 100000 m"],
    ),
    (
        &["--site-tx", "47.4,8.54,420", "--site-rx", "47.41,8.55,431"],
        &["--distance 1000", "must be 1343.795 m", "--site-rx"],
    ),
    (&["--autopilot", "a"], &["--site-tx", "not provided"]),
    (&["--nonsense"], &["--nonsense"]),
];

/// Wrong options for a relay with an autopilot and its sites.
const WRONG_AUTOPILOT: &[(&[&str], &[&str])] = &[
    (
        &["--autopilot", "a", "--positions", "b"],
        &["--autopilot", "--positions", "cannot be used"],
    ),
    (
        &["--autopilot", "udp:localhost"],
        &["--autopilot udp:localhost:", "must be udp:HOST:PORT"],
    ),
    (
        &["--autopilot", "udp::14540"],
        &["--autopilot udp::14540:", "udp:HOST:PORT"],
    ),
    (
        &["--autopilot", "udp:localhost:0"],
        &["udp:localhost:0:", "1 to 65535"],
    ),
    (
        &["--autopilot", "udp:localhost:65536"],
        &["udp:localhost:65536:", "1 to 65535"],
    ),
    (
        &["--autopilot", "udp:localhost:64536"],
        &[
            "--autopilot udp:localhost:64536: needs @LOCAL",
            "PORT + 1000 = 65536",
            "PORT within 1 to 64535",
        ],
    ),
    (
        &["--autopilot", "udp:localhost:14580@0"],
        &[
            "--autopilot udp:localhost:14580@0: has a LOCAL",
            "udp:HOST:PORT@LOCAL",
            "1 to 65535",
        ],
    ),
    (
        &["--autopilot", "udp:localhost:14580@x"],
        &["udp:localhost:14580@x: has a LOCAL", "1 to 65535"],
    ),
    (
        &["--autopilot", "udp:localhost@14540"],
        &["udp:localhost@14540: has no PORT", "1 to 65535"],
    ),
    (
        &["--autopilot", "udp::14580@14540"],
        &["udp::14580@14540: has no HOST", "udp:HOST:PORT@LOCAL"],
    ),
    (
        &["--autopilot-key-file", "a"],
        &["--autopilot <TTY", "not provided"],
    ),
    (
        &["--autopilot", "a", "--autopilot-key-file", "nowhere"],
        &["--autopilot-key-file nowhere", "cannot be read"],
    ),
    (
        &["--autopilot", "a", "--autopilot-baud", "57"],
        &["--autopilot-baud", "'57'", "1200 to 4000000"],
    ),
    (
        &["--autopilot-baud", "57600"],
        &["--autopilot", "not provided"],
    ),
    (
        &["--autopilot", "a", "--speed", "21"],
        &["--speed", "'21'", "0.1 to 20.0"],
    ),
    (
        &["--autopilot", "a", "--speed", "NaN"],
        &["--speed", "'NaN'", "0.1 to 20.0"],
    ),
    (&["--speed", "5"], &["--autopilot", "not provided"]),
];

/// Sites and their distance.
const SITES: &[&str] = &[
    "--site-tx",
    "47.4,8.54,420",
    "--site-rx",
    "47.41,8.55,431",
    "--distance",
    "1343.795",
];

#[test]
fn wrong_options_of_an_autopilot_are_named_with_their_value_and_range() {
    for &(arguments, parts) in WRONG_AUTOPILOT {
        is_refused(&[GOOD, SITES, arguments].concat(), parts);
    }
}

/// Checks that the error names a link that cannot be opened.
#[test]
fn an_autopilot_that_is_not_there_at_the_start_is_a_mistake() {
    for (autopilot, why) in [
        ("/nowhere/tty", "--autopilot /nowhere/tty: No such file"),
        ("/dev/null", "--autopilot /dev/null: is no tty"),
        (
            "udp:nowhere.invalid:14540",
            "--autopilot udp:nowhere.invalid:14540: HOST nowhere.invalid is not found: ",
        ),
    ] {
        let alone = ["--index", "1", "--of", "1", "--autopilot", autopilot];
        let Ended { status, stderr, .. } = Relay::start(&[&alone, SITES].concat()).end();
        assert_eq!(status, Some(1), "{stderr:?}");
        assert!(
            stderr.len() == 1 && stderr[0].starts_with(why),
            "{stderr:?}"
        );
    }
}

#[test]
fn wrong_options_are_named_with_their_value_and_range() {
    for &(arguments, parts) in WRONG {
        let alone = arguments.is_empty() || arguments[0] == "--index";
        let all = if alone {
            arguments.to_vec()
        } else {
            [GOOD, arguments].concat()
        };
        is_refused(&all, parts);
    }
}

/// Checks that options are refused with one line that contains `parts`.
fn is_refused(options: &[&str], parts: &[&str]) {
    let Ended {
        status,
        stdout,
        stderr,
    } = Relay::start(options).end();
    assert_eq!(status, Some(2), "{options:?}: {stderr:?}");
    assert!(
        stdout.is_empty() && stderr.len() == 1,
        "{options:?}: {stderr:?}"
    );
    for part in parts {
        assert!(
            stderr[0].contains(part),
            "{options:?}: {part} not in {}",
            stderr[0]
        );
    }
}
