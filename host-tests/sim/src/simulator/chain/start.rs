//! Creation of a relay when it is switched on.

use uav_relay::SetupError;
use uav_relay::Upload;
use uav_relay::{Identity, Instant, Relay, Settings, ViewRecord};

use super::super::forge::NETWORK;
use super::super::setup::Setup;

#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Relay number, from 1.
    pub(super) index: u16,
    /// Number of the start, from 1.
    pub(super) number: u32,
    pub(super) seed: u32,
    pub(super) now: Instant,
}

/// Creates a relay and restores its persistent state.
pub(super) fn switched_on(
    setup: &Setup,
    start: Start,
    stored: Option<&Upload>,
    record: Option<&ViewRecord>,
) -> Result<Relay, SetupError> {
    let Start {
        index,
        number,
        seed,
        now,
    } = start;
    let own = setup.profiles.iter().find(|(of, _)| *of == index);
    let settings = Settings {
        profile: own.map(|(_, profile)| *profile),
        hold_altitude: setup.held.contains(&index),
        hop_time: setup.hop_time(),
        auth: setup.proof(number).or(setup.settings.auth),
        ..setup.settings
    };
    let identity = Identity {
        network: NETWORK,
        index,
    };
    let mut relay = Relay::new(setup.mission, identity, settings, seed, now)?;
    if let Some(upload) = stored {
        let resumed = relay.resume(upload);
        debug_assert_eq!(resumed, Ok(()), "it was uploaded for this mission");
    }
    if let Some(record) = record {
        let resumed = relay.resume_view(now, record);
        debug_assert_eq!(resumed, Ok(()), "it has left it itself");
    }
    Ok(relay)
}
