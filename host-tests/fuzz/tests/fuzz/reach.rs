//! Coverage of the corpora: all counters, all methods and bad links.

use std::collections::BTreeMap;

use uav_relay::{Method, Phase, Relay, Wiring};
use uav_relay_fuzz::counted::all;
use uav_relay_fuzz::watch::Watched;
use uav_relay_fuzz::{chain, relay};

use super::corpus;

/// Returns the name of the method by which a relay computes positions.
fn method(watched: &Watched) -> &'static str {
    match watched.settings().method {
        _ if watched.relay().mission().field().is_some() => "field",
        Method::Align => "align",
        Method::Joint => "joint",
        Method::Adjust(_) => "adjust",
    }
}

/// Adds up the statistics counters of `relays`: one sum for each counter.
fn counted<'a>(relays: impl IntoIterator<Item = &'a Watched>) -> [u64; 23] {
    relays.into_iter().fold([0; 23], |sums, watched| {
        let counters = all(watched.relay().stats());
        std::array::from_fn(|at| sums[at] + u64::from(counters[at]))
    })
}

#[test]
#[cfg_attr(miri, ignore = "takes too long there")]
fn the_relay_corpus_reaches_every_counter_and_method() {
    let relays: Vec<Watched> = corpus("relay")
        .iter()
        .filter_map(|(_, bytes)| relay::flown(bytes))
        .collect();
    let counters = counted(&relays);
    println!("{counters:?}");
    assert!(counters.iter().all(|&count| count > 0), "{counters:?}");
    let mut places = BTreeMap::new();
    for watched in &relays {
        let held = u32::from(watched.relay().agreed_place().is_some());
        *places.entry(method(watched)).or_insert(0) += held;
    }
    println!("{places:?}");
    assert_eq!(places.len(), 4, "{places:?}");
    assert!(places.values().all(|&held| held > 0), "{places:?}");
    let measured = relays
        .iter()
        .any(|watched| watched.relay().measured_per_w().is_some());
    assert!(measured, "nobody measures");
    let holds = |flies: bool| {
        let with = |relay: &Relay| relay.upload().is_some() && (relay.version() > 0) == flies;
        relays
            .iter()
            .filter(|watched| with(watched.relay()))
            .count()
    };
    println!("{} hold an upload, {} fly one", holds(false), holds(true));
    assert!(
        holds(false) > 0 && holds(true) > 0,
        "nobody is offered anything"
    );
}

#[test]
#[cfg_attr(miri, ignore = "takes too long there")]
fn the_chain_corpus_agrees_by_every_method() {
    let chains: Vec<Vec<Watched>> = corpus("chain")
        .iter()
        .filter_map(|(_, bytes)| chain::flown(bytes))
        .collect();
    let mut agreed = BTreeMap::new();
    for relays in &chains {
        let all = relays
            .iter()
            .all(|watched| watched.relay().phase() == Phase::Holding);
        let shared = relays[0].settings().wiring == Wiring::Shared;
        *agreed.entry((method(&relays[0]), shared)).or_insert(0) += u32::from(all);
    }
    println!("{agreed:?}");
    for shared in [false, true] {
        let mixed = chains.iter().filter(|relays| {
            let settings = relays[0].settings();
            settings.method == Method::Joint
                && (settings.wiring == Wiring::Shared) == shared
                && relays.iter().any(|one| one.settings().hold_altitude)
                && relays
                    .iter()
                    .all(|one| one.relay().phase() == Phase::Holding)
        });
        assert!(
            mixed.count() > 0,
            "no chain agrees on what it gathered, shared: {shared}"
        );
    }
    let signed = chains.iter().filter(|relays| {
        let signs = relays[0].settings().auth.is_some();
        signs
            && relays
                .iter()
                .all(|one| one.relay().phase() == Phase::Holding)
    });
    assert!(signed.count() > 0, "no signed chain agrees");
    for shared in [false, true] {
        let uploaded = chains.iter().filter(|relays| {
            let wiring = relays[0].settings().wiring;
            (wiring == Wiring::Shared) == shared
                && relays.iter().all(|one| one.relay().version() == 2)
        });
        assert!(
            uploaded.count() > 0,
            "no chain is uploaded twice, shared: {shared}"
        );
    }
    for method in ["align", "joint", "adjust", "field"] {
        for shared in [false, true] {
            let count = agreed.get(&(method, shared)).copied().unwrap_or(0);
            assert!(count > 0, "no chain agrees by {method}, shared: {shared}");
        }
    }
    let [
        _,
        repeats,
        _,
        _,
        repeated,
        overheard,
        _,
        truncated,
        crc,
        ..,
        stale,
        _,
    ] = counted(chains.iter().flatten());
    let bad = [repeats, repeated, overheard, truncated, crc, stale];
    println!("{bad:?}");
    assert!(bad.iter().all(|&count| count > 0), "{bad:?}");
}
