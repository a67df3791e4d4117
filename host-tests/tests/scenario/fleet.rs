//! Fleets with more relays than their chain.

use uav_relay_scenario::deployment::Deployment;
use uav_relay_scenario::fleet::FleetSize;

use super::*;

#[test]
fn errors_of_a_fleet_name_the_key_the_value_and_the_range() {
    let fleet = |network: &str, fleet: &str, more: &str| {
        small(&format!("[network]\n{network}\n[fleet]\n{fleet}\n{more}"))
    };
    let wired = |port: &str| format!("[companion]\n{port} = \"/dev/ttyUSB0\"\n");
    assert!(parse(&fleet("relays = 12", "flying = 8", &wired("shared"))).is_ok());
    assert!(parse(&fleet("relays = 12", "respacing_s = 8", &wired("upstream"))).is_ok());
    for (flying, range) in [(6, "7 to 12"), (13, "7 to 12")] {
        refused(
            &fleet("relays = 12", &format!("flying = {flying}"), ""),
            Problem::OutOfRange,
            &[&format!(
                "fleet.flying = {flying} is out of range; allowed: {range}, more than half of network.relays"
            )],
        );
    }
    refused(
        &fleet("id = 3", "flying = 8", ""),
        Problem::Missing,
        &[
            "network.relays is missing; allowed: 1 to 1000, the number of drones of which fleet.flying fly",
        ],
    );
    for port in ["upstream", "downstream"] {
        refused(
            &fleet("relays = 12", "flying = 8", &wired(port)),
            Problem::NeedsChannel,
            &[
                "fleet.flying = 8 needs a shared channel; allowed: companion.shared in place of upstream and downstream",
                "or leave fleet.flying out",
            ],
        );
    }
}

#[test]
fn a_plan_of_a_fleet_has_the_relays_that_fly() {
    let sections = |text: &str| Deployment::parse("flight.toml", &small(text)).unwrap();
    let fleet = sections("[network]\nrelays = 12\n[fleet]\nflying = 8\n");
    assert!(fleet.check_plan("flight.toml", Some(8)).is_ok());
    for (sections, planned, said) in [
        (
            &fleet,
            12,
            "fleet.flying = 8 contradicts plan.uavs; allowed: 12, ",
        ),
        (
            &sections("[network]\nrelays = 12\n"),
            8,
            "network.relays = 12 contradicts plan.uavs; allowed: 8, ",
        ),
    ] {
        let error = sections
            .check_plan("flight.toml", Some(planned))
            .unwrap_err();
        one_line(&error, "flight.toml", &[said]);
    }
    let differ = parse(&small("[[relay]]\nindex = 3\npower_w = 2\n")).unwrap();
    let error = fleet.check_identical("flight.toml", &differ).unwrap_err();
    one_line(
        &error,
        "flight.toml",
        &["fleet.flying = 8 contradicts [[relay]]; allowed: identical relays"],
    );
    let alike = sections("[network]\nrelays = 12\n[fleet]\nflying = 12\n");
    assert!(alike.check_identical("flight.toml", &differ).is_ok());
}

/// Checks the first chain and the spares of all fleets of up to 60 relays, and of the largest.
#[test]
fn spares_are_spread_over_the_numbers() {
    let size = |relays, flying| FleetSize { relays, flying };
    assert_eq!(size(12, 8).spares(), [3, 6, 9, 12]);
    assert_eq!(size(3, 2).spares(), [3]);
    assert_eq!(size(5, 5).spares(), [] as [u16; 0]);
    let sizes = (1..=60).flat_map(|all| (all / 2 + 1..=all).map(move |some| size(all, some)));
    for fleet in sizes.chain([size(1_000, 501), size(1_000, 999)]) {
        let ranks: Vec<Option<usize>> = (1..=fleet.relays).map(|it| fleet.rank(it)).collect();
        let flown: Vec<usize> = ranks.iter().copied().flatten().collect();
        assert_eq!(
            flown,
            (0..usize::from(fleet.flying)).collect::<Vec<_>>(),
            "{fleet:?}"
        );
        assert_eq!(ranks[0], Some(0), "{fleet:?}");
        // The numbers of two neighbours in the first chain differ by at most 2.
        assert!(
            ranks.windows(2).all(|pair| pair != [None, None]),
            "{fleet:?}"
        );
    }
}
