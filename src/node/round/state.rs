//! State table of a pass and of its result, for all algorithms.
//!
//! An algorithm is a sequence of passes. The leader (relay 1, in a field relay N) starts a pass; each relay computes its part and
//! forwards it *onward*. The last relay knows the result, which travels *back* through all relays.
//!
//! | phase | new pass received | duplicate received | result received | work due |
//! | --- | --- | --- | --- | --- |
//! | `Idle` | compute, forward; `Waiting` | - | ignore as stale | - |
//! | `Planning` (leader) | - | - | ignore as stale | compute; then start a pass; `Waiting` |
//! | `Waiting` | compute, forward | reply that it is in progress | agreement: set the agreed position, reply; `Holding`. Else reply; `Answered` | continue, then forward |
//! | `Answered` | compute, forward; `Waiting` | reply again | ignore as stale | leader: start a pass; `Waiting` |
//! | `Holding` | compute, forward; `Waiting` | reply again | ignore as stale | - |
//! | `Infeasible` (leader) | - | - | ignore as stale | - |
//!
//! The last relay is `Waiting` only while it computes. The leader has no previous relay to reply to, and without an
//! agreement it continues to compute. A pass with a number just below the current one is stale in every phase. Only an
//! agreement or a move in Algorithm 2 changes the agreed position. In `Holding` and `Infeasible` the leader may still
//! start a sensing pass.

use crate::node::circulation::LateMessages;

/// Phase of a relay in the agreement on positions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// No message of an agreement on positions has been received yet.
    Idle,
    /// Leader only: it computes the target SIRs that the chain tries next.
    Planning,
    /// A message along the chain has been forwarded, and its result is not known yet.
    Waiting,
    /// The last message along the chain has come back without an agreement on positions.
    Answered,
    /// The chain has agreed on the positions, and this relay holds its position.
    Holding,
    /// The leader has found that no target SIR is feasible. All relays keep their positions.
    Infeasible,
    /// A new view (list of members) is proposed. The agreement on positions waits for the decision.
    ViewChange,
    /// A quorum is missing: too few relays are reachable. The relays keep their positions.
    NoQuorum,
}

/// Action of a relay after a received message or a step of its computation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Action {
    Nothing,
    /// Ignore the received message, and count it as outdated.
    Stale,
    /// Continue the computation after a pause, and no longer await a reply to the last message.
    ContinueWithoutReply,
    /// Continue the computation after a pause. A message that awaits a reply still awaits it.
    Continue,
    /// Forward the message to the next relay, and retransmit it until there is a reply.
    Forward,
    /// Repeat the reply, because the received message is a duplicate.
    Repeat,
    /// Send the result to the previous relay.
    Answer {
        /// True if the result is the agreement of the chain on its positions.
        agreed: bool,
    },
    /// End the leader's pass along the chain. The leader has no further pass to start.
    EndTask,
    /// Report that no target SIR is feasible.
    Infeasible,
    /// Request a new view, because this relay cannot take part in the leader's present pass.
    Foreign,
}

/// Class of a received message of a pass along the chain: new, duplicate, late or foreign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Arrival {
    New,
    Duplicate,
    Late,
    /// The leader has restarted, or this relay has missed earlier passes along the chain.
    Foreign,
}

impl Arrival {
    /// Returns the action for a message that is not new; `None` for a new message, which must be handled.
    pub(crate) const fn refused(self) -> Option<Action> {
        match self {
            Self::New => None,
            Self::Duplicate => Some(Action::Repeat),
            Self::Late => Some(Action::Stale),
            Self::Foreign => Some(Action::Foreign),
        }
    }
}

/// Maximum difference between the number of the current pass and that of a late message. A larger difference shows that
/// the leader has restarted.
const MAX_LATE: u16 = 32;

/// Common divisor of the numbers of first passes (messages along the chain). A first pass is the leader's first one in
/// a view or after its start. Only first passes have multiples of 64 as numbers. So a relay can join a first pass
/// without knowledge of earlier passes.
const INCARNATION: u16 = 64;

/// Phase of the relay, and number of the current pass along the chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundState {
    phase: Phase,
    number: u16,
    /// True once a pass along the chain has been started or received in this view. In the initial view, only passes
    /// since this relay's last start count.
    begun: bool,
    late_messages: LateMessages,
}

impl RoundState {
    pub(crate) const fn new(phase: Phase, number: u16) -> Self {
        Self {
            phase,
            number,
            begun: false,
            late_messages: LateMessages::NONE,
        }
    }

    pub(crate) const fn phase(self) -> Phase {
        self.phase
    }

    pub(crate) const fn number(self) -> u16 {
        self.number
    }

    pub(crate) const fn plan(&mut self) {
        self.phase = Phase::Planning;
    }

    pub(crate) const fn wait(&mut self) {
        self.phase = Phase::Waiting;
    }

    /// Sets the phase to `Answered`: the current pass along the chain has ended without an agreement.
    pub(crate) const fn answer(&mut self) {
        self.phase = Phase::Answered;
    }

    pub(crate) const fn hold(&mut self) {
        self.phase = Phase::Holding;
    }

    pub(crate) const fn give_up(&mut self) {
        self.phase = Phase::Infeasible;
    }

    pub(crate) const fn renew(&mut self, leads: bool) {
        if leads {
            self.plan();
        } else {
            self.answer();
        }
        self.begun = false;
        self.late_messages = LateMessages::NONE;
    }

    /// Sets the number of a new pass along the chain, which the leader starts.
    pub(crate) const fn begin(&mut self) {
        self.number = if self.begun {
            self.next()
        } else {
            self.number.wrapping_add(INCARNATION) & !(INCARNATION - 1)
        };
        self.begun = true;
    }

    const fn next(self) -> u16 {
        let next = self.number.wrapping_add(1);
        if next.is_multiple_of(INCARNATION) {
            next.wrapping_add(1)
        } else {
            next
        }
    }

    /// Makes the new pass along the chain with the number `number` the current one.
    pub(crate) const fn accept(&mut self, number: u16) {
        self.number = number;
        self.begun = true;
        self.late_messages = LateMessages::NONE;
    }

    /// Classifies a received message by the `number` of its pass along the chain. `same` is true if the message has the
    /// same content as that of the current pass.
    pub(crate) fn arrival(&mut self, number: u16, same: bool) -> Arrival {
        if !self.begun {
            // A relay that has missed the first pass cannot join later ones, and requests a new view.
            return if number.is_multiple_of(INCARNATION) {
                Arrival::New
            } else {
                Arrival::Foreign
            };
        }
        let ahead = number.wrapping_sub(self.number);
        match (ahead, self.number.wrapping_sub(number)) {
            (0, _) if same => Arrival::Duplicate,
            _ if number == self.next() => Arrival::New,
            (_, 1..=MAX_LATE) => self.straggler(),
            _ => Arrival::Foreign,
        }
    }

    /// Counts and classifies a late message. After too many late messages in a row the result is foreign, because the
    /// leader must have restarted.
    const fn straggler(&mut self) -> Arrival {
        if self.late_messages.count_one() {
            Arrival::Foreign
        } else {
            Arrival::Late
        }
    }

    /// Returns true if `number` is the current pass along the chain, and its result has not arrived yet.
    pub(crate) fn is_awaited(self, number: u16) -> bool {
        self.phase == Phase::Waiting && number == self.number
    }

    /// Returns true if the result of the current pass along the chain has arrived since the state `before`.
    pub(crate) fn answers(self, before: Self) -> bool {
        let came = before.phase == Phase::Waiting && self.phase != Phase::Waiting;
        came && self.number == before.number
    }

    /// Returns true if a new pass along the chain has started since the earlier state `before`. `before` must be a
    /// state in which the result of the last pass was known.
    pub(crate) fn follows(self, before: Self) -> bool {
        before.is_answered() && self.number != before.number
    }

    /// Returns true if the result of the current pass along the chain is known and can be sent as a reply.
    pub(crate) fn is_answered(self) -> bool {
        matches!(self.phase, Phase::Answered | Phase::Holding)
    }
}

#[cfg(test)]
mod tests {
    use super::{Arrival, INCARNATION, MAX_LATE, Phase, RoundState};
    use crate::node::circulation::SUSPICIOUS;

    /// Returns the state of a relay that has accepted the pass along the chain with the number 200.
    fn begun() -> RoundState {
        let mut state = RoundState::new(Phase::Idle, 0);
        state.accept(200);
        state
    }

    #[test]
    fn who_has_missed_the_beginning_takes_up_a_first_pass_alone() {
        for number in 0..=u16::MAX {
            let mut state = RoundState::new(Phase::Idle, 7);
            let expected = if number % INCARNATION == 0 {
                Arrival::New
            } else {
                Arrival::Foreign
            };
            assert_eq!(state.arrival(number, false), expected, "{number}");
        }
    }

    #[test]
    fn the_next_pass_alone_is_new_and_those_beyond_are_foreign() {
        for last in [192, 200, 254, 255, u16::MAX - 1, u16::MAX] {
            // The leader skips the numbers of first passes: after 255 comes 257.
            let next = match last {
                255 => 257,
                u16::MAX => 1,
                _ => last + 1,
            };
            for off in 1..=u16::MAX {
                let number = last.wrapping_add(off);
                let expected = if number == next {
                    Arrival::New
                } else if last.wrapping_sub(number) <= MAX_LATE {
                    Arrival::Late
                } else {
                    Arrival::Foreign
                };
                let mut state = begun();
                state.accept(last);
                assert_eq!(
                    state.arrival(number, false),
                    expected,
                    "{number} after {last}"
                );
            }
        }
    }

    #[test]
    fn the_same_again_is_answered_and_the_fourth_straggler_in_a_row_is_none() {
        let mut state = begun();
        assert_eq!(state.arrival(200, true), Arrival::Duplicate);
        assert_eq!(state.arrival(200, false), Arrival::Foreign);
        for _ in 1..SUSPICIOUS {
            assert_eq!(state.arrival(199, false), Arrival::Late);
        }
        assert_eq!(state.arrival(199, false), Arrival::Foreign);
        assert_eq!(state.arrival(199, false), Arrival::Late);
    }

    #[test]
    fn a_leader_begins_each_life_and_view_with_a_first_number_and_has_no_other() {
        let mut state = RoundState::new(Phase::Planning, 0xFFF0);
        for view in 0..3 {
            for pass in 0..200 {
                state.begin();
                assert_eq!(
                    state.number.is_multiple_of(INCARNATION),
                    pass == 0,
                    "{view}, {pass}"
                );
            }
            state.renew(true);
        }
    }
}
