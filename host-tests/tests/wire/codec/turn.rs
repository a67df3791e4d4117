//! Turn of Algorithm 2: token and result.

use serde::{Deserialize, Serialize};
use uav_relay::wire::message::{AdjustStep, Message, Moved, Token};
use uav_relay::{Local, Placement};

/// Content of a token.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Handed {
    pub(crate) number: u16,
    pub(crate) view_digest: u16,
    pub(crate) x_m: f32,
    pub(crate) altitude_m: f32,
    pub(crate) power_w: f32,
    pub(crate) turn: u8,
    pub(crate) explore_m: f32,
    pub(crate) columns: u8,
    pub(crate) rows: u8,
    pub(crate) sir: f32,
}

impl Handed {
    pub(super) fn message(&self) -> Message {
        let explore_m = self.explore_m;
        let local = match (self.columns, self.rows) {
            (0, _) => Local::Fine,
            (columns, rows) => Local::Grid { columns, rows },
        };
        Message::Token(Token {
            number: self.number,
            view_digest: self.view_digest,
            place: Placement::on_line(self.x_m, self.altitude_m),
            power_w: self.power_w,
            turn: match self.turn {
                0 => AdjustStep::Look,
                1 => AdjustStep::Stop,
                _ => AdjustStep::Move { explore_m, local },
            },
            sir: self.sir,
        })
    }
}

/// Result of a turn.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Shifted {
    pub(crate) number: u16,
    pub(crate) view_digest: u16,
    pub(crate) x_m: f32,
    pub(crate) altitude_m: f32,
    #[serde(rename = "any_moved")]
    pub(crate) any: bool,
    #[serde(rename = "worst_sir")]
    pub(crate) worst: f32,
}

impl Shifted {
    pub(super) fn message(&self) -> Message {
        Message::Moved(Moved {
            number: self.number,
            view_digest: self.view_digest,
            place: Placement::on_line(self.x_m, self.altitude_m),
            any_moved: self.any,
            worst_sir: self.worst,
        })
    }
}
