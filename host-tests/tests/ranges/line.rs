//! Chain on lossless links, with checks that must hold for any inputs.

use host_tests::bench::Bench;
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::{Event, Identity, Instant, Mission, Phase, Placement, Relay, Settings};

/// Creates a chain of relays whose settings are given by index, from 1. Returns `None` if a relay refuses its
/// settings.
pub(crate) fn line(
    mission: Mission,
    now: Instant,
    settings: impl Fn(u16) -> Settings,
) -> Option<Bench> {
    let relay = |index| {
        let identity = Identity { network: 7, index };
        let seed = 0x9E37_79B9_u32.wrapping_mul(u32::from(index));
        Relay::new(mission, identity, settings(index), seed, now).ok()
    };
    let relays: Option<Vec<Relay>> = (1..=mission.relays()).map(relay).collect();
    Some(Bench::new(relays?, now))
}

/// Returns true if all relays have agreed positions, or the leader reports that no target can be met.
pub(crate) fn has_agreed(line: &Bench) -> bool {
    let mut leaders = line.relays.iter();
    let is_leader = |relay: &&Relay| relay.index() == relay.mission().leader();
    leaders.any(|relay| is_leader(&relay) && relay.phase() == Phase::Infeasible)
        || line
            .relays
            .iter()
            .all(|relay| relay.phase() == Phase::Holding)
}

/// Returns true if a relay has reported that no target can be met.
pub(crate) fn is_infeasible(line: &Bench) -> bool {
    let mut events = line.events.iter();
    events.any(|(_, event)| *event == Event::Infeasible)
}

/// Checks that every reported number is finite, and that no relay refuses messages of another relay.
pub(crate) fn check(line: &Bench) {
    for relay in &line.relays {
        for place in [relay.setpoint(), relay.agreed_place()]
            .into_iter()
            .flatten()
        {
            assert!(is_finite(place), "{place:?}");
        }
        let numbers = [
            relay.target(),
            relay.bound(),
            relay.measured_per_w(),
            relay.level_w(uav_relay::Side::Upstream),
            relay.level_w(uav_relay::Side::Downstream),
            Some(relay.profile().altitude_m),
            relay.rounds().map(|(_, sir)| sir),
        ];
        assert!(
            numbers.into_iter().flatten().all(f32::is_finite),
            "{numbers:?}"
        );
        if let InterferenceEstimate::Source { source, receiver_w } =
            relay.interference_estimate().estimate
        {
            assert!(
                source.is_valid() && receiver_w.is_finite(),
                "{source:?} {receiver_w}"
            );
        }
        let stats = relay.stats();
        assert_eq!(
            stats.malformed,
            0,
            "relay {} at {:?}",
            relay.index(),
            line.now
        );
    }
}

fn is_finite(place: Placement) -> bool {
    [place.x_m, place.y_m, place.altitude_m]
        .iter()
        .all(|m| m.is_finite())
}
