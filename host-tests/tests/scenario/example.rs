//! `examples/scenario.toml` has exactly the existing keys.

use std::collections::BTreeSet;
use std::path::Path;

use super::*;

/// Returns the keys in a scenario file, also those in comments, as `table.key`.
fn shown(text: &str) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    let (mut table, mut list) = (String::new(), String::new());
    for line in text.lines() {
        let line = line.trim_start_matches("# ").trim();
        if let Some(name) = line
            .strip_prefix('[')
            .and_then(|rest| rest.split(']').next())
        {
            name.trim_start_matches('[').clone_into(&mut table);
            continue;
        }
        if let Some(entry) = line.strip_prefix('{') {
            keys.extend(
                entry.split(',').filter_map(|pair| {
                    Some(format!("{list}.{}", pair.split_once(" = ")?.0.trim()))
                }),
            );
            continue;
        }
        let Some((name, value)) = line.split_once(" = ") else {
            continue;
        };
        if name.contains(' ') || table.is_empty() {
            continue;
        }
        let name = format!("{table}.{name}");
        if let Some(entry) = value.strip_prefix('{') {
            keys.extend(
                entry.split(',').filter_map(|pair| {
                    Some(format!("{name}.{}", pair.split_once(" = ")?.0.trim()))
                }),
            );
        } else if value.starts_with('[') && !value.starts_with("[\"") {
            list = name;
        } else {
            keys.insert(name);
        }
    }
    keys
}

#[test]
fn the_example_has_every_key() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scenario.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let known: BTreeSet<String> = uav_relay_scenario::keys().into_iter().collect();
    assert!(known.len() > 50, "{known:?}");
    let shown = shown(&text);
    assert_eq!(
        known.difference(&shown).collect::<Vec<_>>(),
        Vec::<&String>::new(),
        "the example lacks"
    );
    assert_eq!(
        shown.difference(&known).collect::<Vec<_>>(),
        Vec::<&String>::new(),
        "no such keys"
    );
    Scenario::load(&file).unwrap();
}
