//! Telemetry messages in a build without the feature `telemetry`: forwarded, not stored.
//!
//! Only the last message (`Watch` or `Report`) is kept, until it can be sent to the other neighbour.
//!
//! Without the feature `auth` nothing is forwarded, because ground stations sign all frames.

#![expect(
    clippy::unused_self,
    reason = "the same interface as that of `reports`"
)]

use super::context::{Member, OwnState};
use super::neighbour::Neighbours;
use crate::features::AUTH;
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::wire::message::Message;

/// Telemetry message that this relay still has to forward, with the side of its destination. The destination is the
/// neighbour on the side opposite to the sender. `None` if there is no message.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reporting([Option<(Side, Message)>; AUTH as usize]);

impl Reporting {
    pub(crate) fn handle_position(&mut self, _: Instant, _: Placement) {}

    pub(crate) fn handle_frame(&mut self, _: Instant, _: &Member, _: u16, _: u16) {}

    pub(crate) fn handle_session(&mut self, _: Instant, _: &Member, _: Side, _: u16) {}

    pub(crate) fn handle_measured(&mut self, _: f32) {}

    pub(crate) fn poll_greeting(&mut self) -> Option<u16> {
        None
    }

    pub(crate) fn schedule(&mut self, _: &Member, _: bool) {}

    pub(crate) fn handle_timeout(&mut self, _: Instant) {}

    pub(crate) fn handle(
        &mut self,
        _: Instant,
        _: &Member,
        (side, _): (Side, u16),
        message: &Message,
    ) -> bool {
        let Some(handed) = self.0.first_mut() else {
            return false;
        };
        let copy = match message {
            Message::Watch { number, mission } => Message::Watch {
                number: *number,
                mission: *mission,
            },
            Message::Report(report) => Message::Report(report.clone()),
            _ => return false,
        };
        *handed = Some((side.other(), copy));
        true
    }

    pub(crate) fn is_due(&self, _: Instant, _: Duration) -> bool {
        self.0.iter().any(Option::is_some)
    }

    pub(crate) fn next_timeout(&self, _: Duration) -> Option<Instant> {
        None
    }

    pub(crate) fn poll(
        &mut self,
        _: Instant,
        member: &Member,
        neighbours: &Neighbours,
        _: Duration,
        _: OwnState,
    ) -> Option<(Side, u16, Message)> {
        let (side, message) = self.0.first_mut()?.take()?;
        let to = neighbours.next(member, side)?;
        let is_report = matches!(message, Message::Report(_));
        (is_report || member.is_relay(to)).then_some((side, to, message))
    }
}
