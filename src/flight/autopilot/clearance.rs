//! Operator's command that reports lost relays as landed: COMMAND_LONG 31010, answered by COMMAND_ACK.
//!
//! The guard keeps clear of a silent relay, because its drone may still hover. Only a person can know that it has
//! landed. The guard clears all relays of one side at once, so a command must contain the number of every lost relay of
//! that side.
//!
//! | command to this system and component | result |
//! | --- | --- |
//! | its seven parameters are, apart from zeros, exactly the numbers of the lost relays of one side | accepted: [`AutopilotEvent::LostCleared`] |
//! | the same command, marked as a repetition | accepted, without an effect |
//! | any other numbers | denied: [`AutopilotEvent::ClearRefused`] |
//! | any, while the last command's answer, event or side has not been polled | ignored: an operator's station repeats it |

use heapless::Vec;

use super::report::{AutopilotEvent, MOST, RelayNumbers};
use crate::event::Event;
use crate::flight::mavlink::frame::Address;
use crate::side::Side;

/// Number of the command MAV_CMD_USER_1, by which an operator reports that lost relays have landed.
pub(super) const CLEAR_LOST: u16 = 31_010;

/// Value of `MAV_RESULT` for an accepted command.
const ACCEPTED: u8 = 0;
/// Value of `MAV_RESULT` for a denied command.
const DENIED: u8 = 2;

/// Lost relays on one side of this relay, either upstream or downstream.
#[derive(Clone, Debug, Default)]
struct LostSide {
    nodes: Vec<u16, MOST>,
    /// True if more relays are lost on this side than one command can contain ([`MOST`]). In this case no command can
    /// report the relays of this side as landed.
    is_full: bool,
}

/// Lost relays on both sides, and the operator's command that reports them as landed.
#[derive(Clone, Debug, Default)]
pub(super) struct Clearance {
    upstream: LostSide,
    downstream: LostSide,
    /// Last accepted command: its sender, and the numbers of the landed relays. `None` before the first command. A
    /// repetition of the last command is answered and has no other effect.
    accepted: Option<(Address, RelayNumbers)>,
    /// Unsent answer to a command: addressee and `MAV_RESULT`; `None` if there is none.
    answer: Option<(Address, u8)>,
    /// Side whose lost relays have landed according to the operator. The relay has not been informed yet. `None` if
    /// there is no such side.
    cleared: Option<Side>,
}

impl Clearance {
    const fn side_mut(&mut self, side: Side) -> &mut LostSide {
        match side {
            Side::Upstream => &mut self.upstream,
            Side::Downstream => &mut self.downstream,
        }
    }

    /// Adds to the lost relays a node that `event` reports as lost or as permitted to leave. Removes from them a node
    /// that is received again.
    pub(super) fn handle_event(&mut self, event: Event) {
        match event {
            Event::NeighbourLost { side, node } | Event::MayLeaveTold { side, node } => {
                let lost = self.side_mut(side);
                if !lost.nodes.contains(&node) && lost.nodes.push(node).is_err() {
                    lost.is_full = true;
                }
            }
            Event::NeighbourBack { side, node } => {
                self.side_mut(side).nodes.retain(|it| *it != node);
            }
            _ => {}
        }
    }

    /// Processes the operator's command that reports lost relays as landed. Returns the event for the firmware. `from`
    /// is the sender of the command, and `parameters` are the numbers of the landed relays.
    pub(super) fn command(
        &mut self,
        from: Address,
        parameters: [f32; MOST],
        is_repeated: bool,
    ) -> Option<AutopilotEvent> {
        let relays = parameters.map(number);
        if is_repeated && self.accepted == Some((from, relays)) {
            self.answer = Some((from, ACCEPTED));
            return None;
        }
        let named = parameters.iter().filter(|it| **it != 0.0).count();
        let is_valid = named > 0 && relays.iter().filter(|it| **it != 0).count() == named;
        let sides = [Side::Upstream, Side::Downstream];
        let side = sides
            .into_iter()
            .find(|side| is_valid && self.side_mut(*side).is_all_of(&relays));
        let Some(side) = side else {
            self.answer = Some((from, DENIED));
            return Some(AutopilotEvent::ClearRefused { relays, from });
        };
        self.side_mut(side).nodes.clear();
        self.accepted = Some((from, relays));
        self.answer = Some((from, ACCEPTED));
        self.cleared = Some(side);
        Some(AutopilotEvent::LostCleared { side, relays, from })
    }

    /// Returns true while a command is unanswered, or the relay has not been informed of the landed relays.
    pub(super) const fn is_busy(&self) -> bool {
        self.answer.is_some() || self.cleared.is_some()
    }

    /// Removes and returns the pending answer to a command: addressee and `MAV_RESULT`.
    pub(super) const fn take_answer(&mut self) -> Option<(Address, u8)> {
        self.answer.take()
    }

    /// Removes and returns the side whose lost relays have landed; `None` if there is none.
    pub(super) const fn take_cleared(&mut self) -> Option<Side> {
        self.cleared.take()
    }
}

impl LostSide {
    /// Returns true if `named` contains exactly the lost relays of this side. False if no relay is lost.
    fn is_all_of(&self, named: &RelayNumbers) -> bool {
        let is_named = |node: &u16| named.contains(node);
        let is_lost = |node: &u16| *node == 0 || self.nodes.contains(node);
        !self.is_full
            && !self.nodes.is_empty()
            && self.nodes.iter().all(is_named)
            && named.iter().all(is_lost)
    }
}

/// Returns the relay number in a command's parameter; 0 for an invalid number.
fn number(parameter: f32) -> u16 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates, and is compared"
    )]
    let number = parameter as u16;
    if f32::from(number).to_bits() == parameter.to_bits() {
        number
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::{ACCEPTED, Clearance, DENIED};
    use crate::event::Event;
    use crate::flight::autopilot::AutopilotEvent;
    use crate::flight::mavlink::frame::Address;
    use crate::side::Side;

    const FROM: Address = Address {
        system: 255,
        component: 190,
    };

    fn parameters(named: &[f32]) -> [f32; 7] {
        core::array::from_fn(|at| named.get(at).copied().unwrap_or(0.0))
    }

    #[test]
    fn a_command_names_exactly_the_lost_relays_of_one_side() {
        let mut clearance = Clearance::default();
        let side = Side::Downstream;
        for node in [4, 5] {
            clearance.handle_event(Event::NeighbourLost { side, node });
        }
        clearance.handle_event(Event::NeighbourLost {
            side: Side::Upstream,
            node: 2,
        });
        for wrong in [
            &[][..],
            &[4.0],
            &[4.0, 5.0, 2.0],
            &[4.0, 6.0],
            &[4.5, 5.0],
            &[-4.0, 5.0],
            &[f32::NAN],
            &[f32::INFINITY, 4.0, 5.0],
            &[4.0, 5.0, 0.5],
        ] {
            let event = clearance.command(FROM, parameters(wrong), false);
            let is_refused = matches!(event, Some(AutopilotEvent::ClearRefused { from: FROM, .. }));
            assert!(is_refused, "{wrong:?}: {event:?}");
            assert_eq!(clearance.take_answer(), Some((FROM, DENIED)));
            assert_eq!(clearance.take_cleared(), None);
        }
        let named = parameters(&[5.0, 0.0, 4.0]);
        let event = clearance.command(FROM, named, false);
        let relays = [5, 0, 4, 0, 0, 0, 0];
        let cleared = AutopilotEvent::LostCleared {
            side,
            relays,
            from: FROM,
        };
        assert_eq!(event, Some(cleared));
        assert_eq!(clearance.take_answer(), Some((FROM, ACCEPTED)));
        assert_eq!(clearance.take_cleared(), Some(side));
        // The answer was lost. The repeated command has no further effect.
        assert_eq!(clearance.command(FROM, named, true), None);
        assert_eq!(clearance.take_answer(), Some((FROM, ACCEPTED)));
        assert_eq!(clearance.take_cleared(), None);
        // A new command of the same kind names no lost relay.
        let event = clearance.command(FROM, named, false);
        assert!(matches!(event, Some(AutopilotEvent::ClearRefused { .. })));
    }

    #[test]
    fn a_command_clears_at_most_seven_lost_relays() {
        let mut clearance = Clearance::default();
        let side = Side::Upstream;
        clearance.handle_event(Event::NeighbourLost { side, node: 2 });
        clearance.handle_event(Event::NeighbourBack { side, node: 2 });
        let event = clearance.command(FROM, parameters(&[2.0]), false);
        assert!(matches!(event, Some(AutopilotEvent::ClearRefused { .. })));
        for node in 1..=8 {
            clearance.handle_event(Event::NeighbourLost { side, node });
        }
        let all = core::array::from_fn(|at| at as f32 + 1.0);
        let event = clearance.command(FROM, all, false);
        assert!(matches!(event, Some(AutopilotEvent::ClearRefused { .. })));
    }
}
