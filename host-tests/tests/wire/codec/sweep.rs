//! Sweep of targets, and its verdict.

use serde::{Deserialize, Serialize};
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::optimiser::pass::Verdict;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::message::{Answer, Message, Sweep};

/// Common content of all sweeps.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Swept {
    pub(crate) number: u16,
    pub(crate) view_digest: u16,
    /// Negative in a plain pass.
    pub(crate) anchor: f32,
    pub(crate) gap: u8,
    pub(crate) growth: u8,
    pub(crate) altitude_m: f32,
    pub(crate) power_w: f32,
    #[serde(rename = "reach_m")]
    pub(crate) reaches: Vec<f32>,
}

impl Swept {
    /// Converts to the crate's message, with a chosen lateral offset or a measured Upsilon.
    pub(super) fn message(&self, chosen_y_m: Option<f32>, measured_per_w: Option<f32>) -> Message {
        let ladder = Ladder::from_parts(self.anchor.abs(), self.gap, self.growth).unwrap();
        Message::Sweep(Sweep {
            number: self.number,
            view_digest: self.view_digest,
            ladder: ladder.plainly(self.anchor < 0.0),
            relay: Station {
                at: CrossSection {
                    y_m: chosen_y_m.unwrap_or(0.0),
                    altitude_m: self.altitude_m,
                },
                power_w: self.power_w,
            },
            chosen: chosen_y_m.is_some(),
            measured_per_w,
            reaches: PerTarget::from_slice(&self.reaches).unwrap(),
        })
    }
}

/// Content of a verdict.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Judged {
    pub(crate) number: u16,
    pub(crate) view_digest: u16,
    pub(crate) own: bool,
    pub(crate) commit: Option<u8>,
    #[serde(rename = "slack_m")]
    pub(crate) slacks: Vec<f32>,
    #[serde(rename = "required_x_m")]
    pub(crate) stand: Option<f32>,
}

impl Judged {
    pub(super) fn message(&self) -> Message {
        Message::Verdict(Answer {
            number: self.number,
            view_digest: self.view_digest,
            verdict: Verdict {
                commit: self.commit,
                slacks: PerTarget::from_slice(&self.slacks).unwrap(),
            },
            required_x_m: self.stand,
            own: self.own,
        })
    }
}
