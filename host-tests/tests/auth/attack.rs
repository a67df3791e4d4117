//! A million attacks on a chain with reboots and uploads: none is accepted, and none has an effect.

use std::collections::BTreeMap;

use uav_relay::{Instant, Phase, Side, Wiring};

use super::kinds::{Attack, Attacker, KINDS, Kind, raised};
use super::net::{Net, ScheduledEvent};

/// Scheduled events of the attack test, each with its time in ms. They are reboots, restarted agreements and mission
/// uploads.
const DEEDS: [(u64, ScheduledEvent); 11] = [
    (6_000, ScheduledEvent::Reboot(4)),
    (6_500, ScheduledEvent::Restart),
    (12_000, ScheduledEvent::Upload(Side::Upstream, 1)),
    (18_000, ScheduledEvent::Reboot(5)),
    (18_000, ScheduledEvent::Resume(8)),
    (18_500, ScheduledEvent::Restart),
    (30_000, ScheduledEvent::Reboot(1)),
    (36_000, ScheduledEvent::Upload(Side::Downstream, 2)),
    (42_000, ScheduledEvent::Resume(2)),
    (42_000, ScheduledEvent::Reboot(7)),
    (42_500, ScheduledEvent::Restart),
];

const END: Instant = Instant::from_millis(60_000);

fn attacked(
    net: &mut Net,
    attacker: &mut Attacker,
    kinds: &mut impl Iterator<Item = &'static Kind>,
    count: u64,
) -> BTreeMap<(Kind, &'static str), u64> {
    let mut table = BTreeMap::new();
    let mut done = 0;
    while done < count {
        let kind = *kinds.next().unwrap();
        let Some(Attack {
            to,
            port,
            wire,
            raises,
        }) = attacker.attack(net, kind)
        else {
            continue;
        };
        let before = net.stats(to);
        let sent = net.deliver_bytes(to, port, &wire);
        let after = net.stats(to);
        assert_eq!(
            raised(&before, &after),
            Some(raises),
            "{kind:?} at {:?}: {wire:02x?}",
            net.now
        );
        assert_eq!(sent, 0, "{kind:?} has been answered");
        assert_eq!(
            before.rejected() + 1 - u32::from(raises == "overheard"),
            after.rejected()
        );
        *table.entry((kind, raises)).or_default() += 1;
        done += 1;
    }
    table
}

fn under_attack(wiring: Wiring, count: u64) {
    let mut calm = Net::new(8, wiring, &DEEDS);
    calm.run(END);
    assert!(
        calm.relays
            .iter()
            .all(|relay| relay.phase() == Phase::Holding)
    );
    assert!(calm.relays.iter().all(|relay| relay.version() == 2));
    let share = count / calm.events_done;

    let mut net = Net::new(8, wiring, &DEEDS);
    let mut attacker = Attacker::new(1);
    let mut kinds = KINDS.iter().cycle();
    let mut table: BTreeMap<(Kind, &'static str), u64> = BTreeMap::new();
    let mut left = count;
    loop {
        let more = net.step(END);
        let now = if more { share } else { left };
        for (of, number) in attacked(&mut net, &mut attacker, &mut kinds, now) {
            *table.entry(of).or_default() += number;
        }
        left -= now;
        if !more {
            break;
        }
    }
    for ((kind, raises), number) in &table {
        println!("{number:8} {kind:?}: {raises}");
    }
    for kind in KINDS {
        let of_it: u64 = table
            .iter()
            .filter(|((of, _), _)| *of == kind)
            .map(|(_, number)| number)
            .sum();
        assert!(of_it > count / 100, "{kind:?}: {of_it}");
    }
    assert_eq!(table.values().sum::<u64>(), count);
    // Every sent byte is the same as without attacks, and only members' frames were accepted.
    assert_eq!(net.recorded, calm.recorded);
    assert_eq!(net.bits(), calm.bits());
    for (relay, calm) in net.relays.iter().zip(&calm.relays) {
        assert_eq!(
            (relay.version(), relay.upload()),
            (calm.version(), calm.upload())
        );
    }
    assert!(net.bits().iter().all(Option::is_some));
    for index in 1..=8 {
        let (stats, calm) = (net.stats(index), calm.stats(index));
        assert_eq!(stats.received, net.genuine[usize::from(index) - 1]);
        assert_eq!(
            (stats.received, stats.handshakes, stats.sent),
            (calm.received, calm.handshakes, calm.sent)
        );
        assert_eq!(stats.malformed, 0, "only what is authentic is read");
    }
}

/// Returns the number of attacks to simulate: the environment variable `COUNT`, or else a million.
fn count() -> u64 {
    std::env::var("COUNT")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(1_000_000)
}

#[test]
fn a_million_attacks_have_no_effect() {
    under_attack(Wiring::Pair, count());
}

#[test]
fn a_million_attacks_on_a_shared_channel_have_no_effect() {
    under_attack(Wiring::Shared, count() / 10);
}
