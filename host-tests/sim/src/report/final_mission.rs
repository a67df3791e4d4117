//! Final mission of the chain: the original or an uploaded one.

use uav_relay::Mission;

use super::remaining::left;
use crate::simulator::outcome::Outcome;
use crate::simulator::setup::Setup;

/// Returns the mission that the chain flies at the end of a run, with all its relays.
pub fn flown(setup: &Setup, outcome: &Outcome) -> Mission {
    let version = version(outcome);
    let mut uploads = setup.uploads.iter().map(|spec| spec.upload);
    uploads
        .find(|upload| upload.version() == version)
        .and_then(|upload| Mission::try_new(*upload.config()).ok())
        .unwrap_or(setup.mission)
}

/// Returns the version of that mission; the newest one if the relays differ.
pub(super) fn version(outcome: &Outcome) -> u16 {
    let chain = left(outcome);
    let versions = chain.iter().map(|(_, relay)| relay.version);
    versions.max().unwrap_or(0)
}
