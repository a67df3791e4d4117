//! `FORMAT.md` as a test: worked frame, ladder, digest; and every rejected stream of the vectors.

use host_tests::fixtures::paper;
use uav_relay::wire::digest::digest;
use uav_relay::{Interference, Mission, MissionConfig, Port, Wiring};
use uav_relay_decode::vectors::bytes;

use super::bench::Bench;
use super::golden::vectors;
use super::kinds::{FIELD, mission, source};
use super::offer::low_half;

const DOCUMENT: &str = include_str!("../../../src/wire/FORMAT.md");

fn cells(row: &str) -> Vec<&str> {
    let row = row.trim().trim_matches('|');
    row.split('|').map(str::trim).collect()
}

/// Returns the rows of the first table in `text`, without its heading.
fn rows(text: &str) -> impl Iterator<Item = Vec<&str>> {
    let table = text.lines().skip_while(|line| !line.starts_with('|'));
    table
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(cells)
}

/// Returns the text of a table cell that is between two backticks.
fn code(cell: &str) -> &str {
    cell.strip_prefix('`').unwrap().strip_suffix('`').unwrap()
}

/// Returns the bytes of an example in `FORMAT.md` twice: from its table, and from its code block.
fn example(section: &str) -> (Vec<u8>, Vec<u8>) {
    let hex = |text: &str| bytes(&text.split_whitespace().collect::<String>()).unwrap();
    let mut plain = Vec::new();
    for row in rows(section) {
        assert_eq!(row[0], plain.len().to_string(), "offset in {section}");
        plain.extend(hex(code(row[1])));
    }
    let block = section.split("```").nth(1).unwrap();
    (plain, hex(block.strip_prefix("text").unwrap()))
}

#[test]
fn the_worked_frame_of_the_document_is_a_golden_vector() {
    let vectors = vectors();
    let section = DOCUMENT.split("### Worked: ").nth(1).unwrap();
    let signed = &vectors.signed[2];
    assert_eq!(section.lines().next(), Some(&*signed.name));
    assert_eq!(
        example(section),
        (signed.plain.clone(), signed.wire.clone())
    );
}

#[test]
fn the_ladders_of_the_document_are_golden_vectors() {
    let section = DOCUMENT.split("## Ladder").nth(1).unwrap();
    let vectors = vectors().ladders;
    let mut found = 0;
    for row in rows(section) {
        let targets: Vec<&str> = code(row[3]).split(' ').collect();
        assert!(vectors.iter().any(|vector| vector.targets == targets));
        found += 1;
    }
    assert!(found > 0);
}

#[test]
fn every_rejected_stream_is_counted_as_documented() {
    let rejected = vectors().rejected;
    assert!(rejected.len() >= 224, "{}", rejected.len());
    for vector in rejected {
        let mut bench = Bench::new(2, 8, Wiring::Pair);
        assert_ne!(bench.mission, 0x5A3C);
        let now = bench.now;
        bench.handle_bytes(now, Port::Upstream, &vector.wire);
        let mut wanted = vector.counted;
        wanted.sort_unstable();
        assert_eq!(bench.counted(), wanted, "{}", vector.what);
    }
}

/// Returns the digest of a mission by the rules of `FORMAT.md`. `interference` has the f32 numbers of the mission's
/// interference.
fn digest_by_the_rules(mission: &Mission, interference: &[f32]) -> u16 {
    let config = mission.config();
    let mut bytes = config.relays.to_le_bytes().to_vec();
    for number in [
        config.distance_m,
        config.min_separation_m,
        config.tx_power_w,
        config.common.altitude_m,
        config.common.power_w,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    for number in interference.iter().chain([&config.tolerance]) {
        bytes.extend(number.to_le_bytes());
    }
    let channel = config.channel;
    for number in [channel.mu_los(), channel.mu_nlos(), channel.eta()] {
        bytes.extend(number.to_le_bytes());
    }
    for band in [config.band, config.lateral] {
        bytes.extend(band.least_m.to_le_bytes());
        bytes.extend(band.most_m.to_le_bytes());
    }
    low_half(&bytes)
}

#[test]
fn the_digest_follows_the_document() {
    let base = paper(8);
    let Interference::Source(interferer) = base.interference else {
        panic!("the paper's mission has an interferer");
    };
    let source_numbers = [interferer.power_w, interferer.x_m, interferer.y_m];
    let points = FIELD.points().iter();
    let field: Vec<f32> = points
        .flat_map(|point| [point.x_m, point.upsilon_per_w])
        .collect();
    assert!(field.len() > 4);
    let wide = source();
    let mut seen = Vec::new();
    for (interference, numbers) in [
        (base.interference, &source_numbers[..]),
        (Interference::Field(FIELD), &field),
    ] {
        for (band, lateral) in [
            (base.band, base.lateral),
            (wide.band, base.lateral),
            (wide.band, wide.lateral),
        ] {
            let config = MissionConfig {
                band,
                lateral,
                ..mission(interference)
            };
            let mission = Mission::try_new(config).unwrap();
            let by_the_rules = digest_by_the_rules(&mission, numbers);
            assert_eq!(digest(&mission), by_the_rules);
            seen.push(by_the_rules);
        }
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 6);
}
