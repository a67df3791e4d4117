//! SIR and data rate by the number of relays, one way and both ways.

use uav_relay_tools::figures::link::MOST_RELAYS;

use super::Table;

#[test]
fn the_rates_are_those_of_the_sirs_and_both_ways_cost_some() {
    let table = Table::read("link");
    assert_eq!(table.rows.len(), usize::from(MOST_RELAYS));
    for relays in 1..=MOST_RELAYS {
        let row = table.row(&[("relays", relays.into())]);
        let of = |name: &str| row.get(name).unwrap();
        let [one, both, judged] =
            ["one_way", "both_ways", "judged"].map(|name| of(&format!("{name}_sir_linear")));
        // 1e-4 is the tolerance of the agreed SIR.
        assert!(
            judged <= both * (1.0 + 1e-4) && both < one,
            "{relays}: {one} {both} {judged}"
        );
        let slots = f64::from(relays) + 1.0;
        let equal = |sir: f64, ways: f64| (1.0 + sir).log2() / slots / ways;
        let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-4;
        assert!(near(of("one_way_slots_bit_per_s_hz"), equal(one, 1.0)));
        assert!(near(of("both_ways_slots_bit_per_s_hz"), equal(both, 2.0)));
        for ways in ["one_way", "both_ways"] {
            let [fitted, slots] =
                ["fitted", "slots"].map(|access| of(&format!("{ways}_{access}_bit_per_s_hz")));
            assert!(fitted >= slots, "{relays} {ways}: {fitted} {slots}");
        }
    }
}

/// Checks that the README has the SIRs of the figure `link` for eight relays and both directions.
#[test]
fn the_readme_says_what_both_ways_give() {
    let table = Table::read("link");
    let row = table.row(&[("relays", 8.0)]);
    let of = |name: &str| row.get(name).unwrap();
    let line = format!(
        "| 8 relays, both directions (r = 1) | {:.3} in the worse one, {:.3} at the places for one; as many messages | `cargo figures --only link` |\n",
        of("both_ways_sir_linear"),
        of("judged_sir_linear")
    );
    let readme = include_str!("../../../../README.md");
    assert!(readme.contains(&line), "{line}");
}
