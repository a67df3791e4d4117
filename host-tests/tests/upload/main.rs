//! Upload of a mission in flight to all relays or none; `COUNT` and `SEED` select other schedules.

mod chain;
mod fitted;
mod flights;
mod hand;
mod restarts;
mod schedules;
mod sites;
mod told;
mod wires;

use std::collections::{BTreeMap, BTreeSet};

use host_tests::fixtures::mission;
use host_tests::flights::{bad_day, eight_apart, own_profiles, seconds};
use host_tests::ledger::{self, left};
use host_tests::make;
use uav_relay::{Instant, Interference, Mission, MissionConfig, Side, Upload};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Moment, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::{Setup, UploadSpec};

/// Returns the mission `base` with its interferer at (`x_m`, `y_m`).
fn moved(base: &Mission, x_m: f32, y_m: f32) -> MissionConfig {
    MissionConfig {
        interference: Interference::Source(make::interferer(80.0, x_m, y_m)),
        ..*base.config()
    }
}

/// Returns the setup of a chain with the mission `base` and signed frames. The relays share one radio channel if
/// `shared`, else they are on wires.
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

/// Checks the rules of uploads in a run. Returns the first violation as an error.
///
/// All members of a membership view must use the same mission. An uploaded mission must be stored by at least as many
/// relays as the view has. Setpoints must be within limits. A settled chain must use mission `version`, in the
/// positions of a new chain with `config`.
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
    if outcome.ending != Ending::Settled {
        return Err(format!("{:?}", outcome.ending));
    }
    ledger::judge(setup, outcome, &left(outcome), version, config)
}

/// Runs `setup`. Checks that all surviving relays use mission `version` with `config` in the end.
fn flies(setup: &Setup, version: u16, config: MissionConfig, name: &str) -> Outcome {
    let outcome = run(setup.clone()).unwrap();
    judge(setup, &outcome, version, config).unwrap_or_else(|what| panic!("{name}: {what}"));
    outcome
}
