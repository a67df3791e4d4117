//! Which mission a chain flies: the one that it took off with, or one that was uploaded since.

use uav_relay::Mission;

use super::left::left;
use crate::simulator::outcome::Outcome;
use crate::simulator::setup::Setup;

/// The mission that the chain flies when a run of `setup` has ended, with all its relays: what a report has to be of.
pub fn flown(setup: &Setup, outcome: &Outcome) -> Mission {
    let version = version(outcome);
    let mut uploads = setup.uploads.iter().map(|spec| spec.upload);
    uploads
        .find(|upload| upload.version() == version)
        .and_then(|upload| Mission::try_new(*upload.config()).ok())
        .unwrap_or(setup.mission)
}

/// Its version; of relays that have not agreed yet, the newest that one of them flies.
pub(super) fn version(outcome: &Outcome) -> u16 {
    let chain = left(outcome);
    let versions = chain.iter().map(|(_, relay)| relay.version);
    versions.max().unwrap_or(0)
}
