//! Upload of a mission in flight to all relays or none; `COUNT` and `SEED` select other schedules.

mod chain;
mod flights;
mod hand;
mod restarts;
mod schedules;
mod sites;
mod told;
mod wires;

use std::collections::{BTreeMap, BTreeSet};

use host_tests::fixtures::mission;
use host_tests::flights::{bad_day, eight_apart, exact, own_profiles, seconds};
use uav_relay::{Instant, Interference, Interferer, Mission, MissionConfig, Side, Upload};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Moment, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::{Setup, UploadSpec};

/// Returns `base` with another interferer position.
fn moved(base: &Mission, x_m: f32, y_m: f32) -> MissionConfig {
    MissionConfig {
        interference: Interference::Source(Interferer {
            power_w: 80.0,
            x_m,
            y_m,
        }),
        ..*base.config()
    }
}

/// Returns a chain of `base` with signed frames, on one radio or on wires.
fn signed(base: Mission, shared: bool) -> Setup {
    let mut setup = if shared {
        Setup::on_shared_channel(base)
    } else {
        Setup::new(base)
    };
    setup.auth = true;
    setup
}

fn upload(
    base: &Mission,
    end: Side,
    at: Instant,
    version: u16,
    config: MissionConfig,
) -> UploadSpec {
    UploadSpec {
        end,
        at,
        upload: Upload::new(base, version, config).unwrap(),
    }
}

/// Checks a run. Returns the first fault as an error.
///
/// Members of a view fly the same mission, which a quorum has held; setpoints are within limits; a settled chain flies `version`
/// in the positions of an undisturbed chain with `config`.
fn judge(
    setup: &Setup,
    outcome: &Outcome,
    version: u16,
    config: MissionConfig,
) -> Result<(), String> {
    let mut flown = BTreeMap::new();
    let mut holders: BTreeMap<u16, BTreeSet<u16>> = BTreeMap::new();
    for moment in &outcome.moments {
        match moment.what {
            TimelineEvent::Uploaded(version) => {
                holders.entry(version).or_default().insert(moment.relay);
            }
            TimelineEvent::ViewAccepted {
                view,
                version,
                relays,
                ..
            } => {
                if *flown.entry(view).or_insert(version) != version {
                    return Err(format!("view {view} is of several missions"));
                }
                let hold = holders.get(&version).map_or(0, BTreeSet::len);
                if version > 0 && hold < relays.into() {
                    return Err(format!("{hold} of {relays} held mission {version}"));
                }
            }
            _ => {}
        }
    }
    if outcome.unsafe_setpoints > 0 {
        return Err(format!("{} unsafe setpoints", outcome.unsafe_setpoints));
    }
    if outcome.ending != Ending::Settled {
        return Err(format!("{:?}", outcome.ending));
    }
    let left: Vec<_> = (1_u16..)
        .zip(&outcome.relays)
        .filter(|(_, relay)| relay.killed.is_none())
        .collect();
    let relays = u16::try_from(left.len()).unwrap();
    let mission = Mission::try_new(config).unwrap();
    let mut clean = Setup::new(mission.with_relays(relays).unwrap());
    clean.settings = setup.settings;
    clean.settings.wiring = uav_relay::Wiring::Pair;
    for (index, (number, _)) in (1..).zip(&left) {
        let own = setup.profiles.iter().find(|(of, _)| of == number);
        let own = own.map(|(_, profile)| (index, *profile));
        clean.profiles.extend(own);
        clean
            .held
            .extend(setup.held.contains(number).then_some(index));
    }
    let clean = run(clean).unwrap();
    assert_eq!(clean.ending, Ending::Settled);
    let target =
        |relay: &uav_relay_sim::simulator::outcome::RelayEnd| relay.target.map(f32::to_bits);
    for ((number, relay), alone) in left.into_iter().zip(&clean.relays) {
        if relay.version != version {
            return Err(format!("relay {number} flies mission {}", relay.version));
        }
        if relay.setpoint != alone.setpoint || target(relay) != target(alone) {
            return Err(format!(
                "relay {number} is at {:?}, not at {:?}",
                relay.setpoint, alone.setpoint
            ));
        }
    }
    Ok(())
}
