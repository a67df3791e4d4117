//! Upload of a newer mission.

use uav_relay::{Geodetic, Interference, Interferer, MissionConfig, Sites, Upload};

use super::super::input::Input;
use super::Chain;

const SITES: Option<Sites> = Some(Sites {
    tx: Geodetic {
        lat_e7: 474_000_000,
        lon_e7: 85_400_000,
        amsl_mm: 420_000,
    },
    rx: Geodetic {
        lat_e7: 474_000_000,
        lon_e7: 85_532_474,
        amsl_mm: 431_000,
    },
});

impl Chain {
    /// Uploads a mission with a changed interferer to relay `at`. Its version is larger than all earlier versions.
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
        // One mission in four has Tx and Rx positions, if the distance between these positions is right.
        let sited = SITES.filter(|_| moved.x_m.to_bits() % 4 == 3);
        let upload = sited
            .and_then(|sites| upload.with_sites(sites).ok())
            .unwrap_or(upload);
        if let Some(member) = self.members.get_mut(at) {
            member.watched.upload(self.now, &upload);
        }
        self.settle(at);
    }
}
