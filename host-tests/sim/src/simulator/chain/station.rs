//! Transmitter and receiver as nodes of the run.

use uav_relay::ground::{Ground, Progress};
use uav_relay::{Instant, Side};

use super::super::forge::NETWORK;
use super::super::link::Line;
use super::super::setup::Setup;

/// Ground station: the transmitter or the receiver.
#[derive(Debug)]
pub(super) struct Station {
    pub(super) end: Side,
    pub(super) ground: Ground,
    pub(super) line: Line,
    pub(super) wake: Option<Instant>,
}

impl Station {
    /// Returns true during an upload.
    pub(super) fn is_busy(&self) -> bool {
        matches!(
            self.ground.progress(),
            Progress::Offering | Progress::Held { .. } | Progress::Adopted { .. }
        )
    }
}

/// Creates the stations that upload or measure; none without keys.
pub(super) fn stations(setup: &Setup) -> Vec<Station> {
    let Some(proof) = setup.proof(1) else {
        return Vec::new();
    };
    let uploads = setup.uploads.iter().map(|spec| spec.end);
    let measures = setup.sky.as_ref().filter(|sky| sky.handed.is_empty());
    let both = measures.map(|_| [Side::Upstream, Side::Downstream]);
    let mut ends: Vec<Side> = uploads.chain(both.into_iter().flatten()).collect();
    ends.sort();
    ends.dedup();
    ends.into_iter()
        .map(|end| Station {
            end,
            ground: Ground::new(&setup.mission, end, NETWORK, setup.settings.wiring, proof),
            line: Line::default(),
            wake: None,
        })
        .collect()
}
