//! Turn of Algorithm 2: token and result.

use serde::Deserialize;
use uav_relay::wire::message::{AdjustStep, Message, Moved, Token};
use uav_relay::{Local, Placement};

use super::bytes::{pass, reals};
use super::limits::{is_altitude, is_place, is_power, is_sir};
use super::reader::Reader;

/// Content of a token.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Handed {
    pub(crate) number: u16,
    pub(crate) mission: u16,
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
    pub(super) fn body(&self) -> Vec<u8> {
        let mut out = pass(8, [self.number, self.mission]);
        reals(&mut out, &[self.x_m, self.altitude_m, self.power_w]);
        out.push(self.turn);
        reals(&mut out, &[self.explore_m]);
        out.extend([self.columns, self.rows]);
        reals(&mut out, &[self.sir]);
        out
    }

    pub(super) fn message(&self) -> Message {
        let explore_m = self.explore_m;
        let local = match (self.columns, self.rows) {
            (0, _) => Local::Fine,
            (columns, rows) => Local::Grid { columns, rows },
        };
        Message::Token(Token {
            number: self.number,
            mission: self.mission,
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

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            number: rest.word()?,
            mission: rest.word()?,
            x_m: rest.real()?,
            altitude_m: rest.real()?,
            power_w: rest.real()?,
            turn: rest.byte()?,
            explore_m: rest.real()?,
            columns: rest.byte()?,
            rows: rest.byte()?,
            sir: rest.real()?,
        })
    }

    pub(super) fn in_range(&self) -> bool {
        let fine = (self.columns, self.rows) == (0, 0);
        let turn = match self.turn {
            0 | 1 => self.explore_m.to_bits() == 0 && fine,
            2 => {
                (0.0..=1e5).contains(&self.explore_m) && (fine || self.columns.min(self.rows) >= 2)
            }
            _ => false,
        };
        turn && is_place(self.x_m)
            && is_altitude(self.altitude_m)
            && is_power(self.power_w)
            && is_sir(self.sir)
    }
}

/// Result of a turn.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Shifted {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    pub(crate) x_m: f32,
    pub(crate) altitude_m: f32,
    pub(crate) any: bool,
    pub(crate) worst: f32,
}

impl Shifted {
    pub(super) fn body(&self) -> Vec<u8> {
        let mut out = pass(9, [self.number, self.mission]);
        reals(&mut out, &[self.x_m, self.altitude_m]);
        out.push(u8::from(self.any));
        reals(&mut out, &[self.worst]);
        out
    }

    pub(super) fn message(&self) -> Message {
        Message::Moved(Moved {
            number: self.number,
            mission: self.mission,
            place: Placement::on_line(self.x_m, self.altitude_m),
            any: self.any,
            worst: self.worst,
        })
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            number: rest.word()?,
            mission: rest.word()?,
            x_m: rest.real()?,
            altitude_m: rest.real()?,
            any: rest.bool()?,
            worst: rest.real()?,
        })
    }

    pub(super) fn in_range(&self) -> bool {
        is_place(self.x_m) && is_altitude(self.altitude_m) && is_sir(self.worst)
    }
}
