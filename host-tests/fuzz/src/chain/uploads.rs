//! A newer mission for the chain.

use uav_relay::{Interference, Interferer, MissionConfig, Upload};

use super::super::input::Input;
use super::Chain;

impl Chain {
    /// A relay's firmware hands it a mission that is newer than all before, with the interferer somewhere else.
    pub(super) fn upload(&mut self, at: usize, input: &mut Input<'_>) {
        let config = *self.mission.config();
        let Some(interferer) = self.mission.interferer() else {
            return;
        };
        let moved = Interferer {
            x_m: input.even(0.0, config.distance_m),
            y_m: input.even(-config.distance_m, config.distance_m),
            ..*interferer
        };
        let config = MissionConfig {
            interference: Interference::Source(moved),
            ..config
        };
        self.version = self.version.saturating_add(1);
        let Ok(upload) = Upload::new(&self.mission, self.version, config) else {
            return;
        };
        if let Some(member) = self.members.get_mut(at) {
            member.watched.upload(self.now, &upload);
        }
        self.settle(at);
    }
}
