//! The state table of a pass and what comes back of it: one for every algorithm.
//!
//! Every algorithm is made of passes: the leader (relay 1, in a field relay N) begins one, each relay works out its share
//! and hands it *onward*, the last one knows what came of it, and that travels *back* through all of them.
//!
//! | phase | a new pass comes | the same pass again | what came of it comes | work is due |
//! | --- | --- | --- | --- | --- |
//! | `Idle` | share, hand on: `Waiting` | - | stale | - |
//! | `Planning` (leader) | - | - | stale | compute on; then begin a pass: `Waiting` |
//! | `Waiting` | share, hand on | say busy | agreement: take the place, hand back, `Holding`; else hand back, `Answered` | go on with the share, then hand on |
//! | `Answered` | share, hand on: `Waiting` | hand back again | stale | (leader) begin a pass: `Waiting` |
//! | `Holding` | share, hand on: `Waiting` | hand back again | stale | - |
//! | `Infeasible` (leader) | - | - | stale | - |
//!
//! The last relay knows what came of it by itself and skips `Waiting`, but for the time its share takes. The leader has
//! nobody to hand back to: without an agreement it has work to do. A pass whose number is just behind the current one is
//! stale wherever it comes. Only an agreement, or a turn of Algorithm 2, moves the setpoint: a relay holds its place
//! through everything else.

use crate::node::numbering::Stragglers;

/// Where a relay is in the protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// No pass has come yet.
    Idle,
    /// The leader is computing what to begin with.
    Planning,
    /// A pass or a proposal is under way onward, and what came of it has not come back.
    Waiting,
    /// What came of the last pass was no agreement.
    Answered,
    /// The chain has agreed; the relay holds its place.
    Holding,
    /// The leader has found that no target can be met. Every relay stays where it is.
    Infeasible,
    /// A new view is proposed, and the decision awaited: no pass goes on.
    ViewChange,
    /// The leader of this part of the chain has found that too few relays can be reached: the part holds its places.
    NoQuorum,
}

/// What the node has to do now.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Action {
    /// Nothing at all.
    Nothing,
    /// Count a message of a pass that is over.
    Stale,
    /// Call `work` after a pause.
    Work,
    /// Call `work` after a pause; what there is to say stays.
    Think,
    /// Hand the pass onward, and again until something comes back.
    Forward,
    /// Reply to a duplicate.
    Repeat,
    /// What came of the pass is known: hand it back.
    Answer {
        /// Whether the chain has agreed with it.
        agreed: bool,
    },
    /// What came of the pass is known to the leader, which has no other one to begin.
    Settled,
    /// No target can be met.
    Infeasible,
    /// Ask for a new view: this pass cannot be taken part in.
    Foreign,
}

/// What a pass that has come in is to a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Arrival {
    New,
    Again,
    Straggler,
    /// Of another incarnation of its leader, or one that comes after others which were missed.
    Foreign,
}

impl Arrival {
    /// What to do about one that is not taken up.
    pub(crate) const fn refused(self) -> Option<Action> {
        match self {
            Self::New => None,
            Self::Again => Some(Action::Repeat),
            Self::Straggler => Some(Action::Stale),
            Self::Foreign => Some(Action::Foreign),
        }
    }
}

/// A pass that is this many numbers or fewer behind the current one is a straggler; one that is farther off, or ahead but not
/// next, is of another incarnation of its leader, or the relay has missed something.
const STRAGGLERS: u16 = 32;

/// The first pass that a leader begins has a number divisible by this, and no later one has.
const INCARNATION: u16 = 64;

/// Which pass is under way, and how far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundState {
    phase: Phase,
    number: u16,
    /// Whether a pass has come since the relay was switched on, or since the view.
    begun: bool,
    stragglers: Stragglers,
}

impl RoundState {
    /// The leader's `number` is a random one.
    pub(crate) const fn new(phase: Phase, number: u16) -> Self {
        Self {
            phase,
            number,
            begun: false,
            stragglers: Stragglers::NONE,
        }
    }

    pub(crate) const fn phase(self) -> Phase {
        self.phase
    }

    pub(crate) const fn number(self) -> u16 {
        self.number
    }

    /// The leader has to compute what to begin with.
    pub(crate) const fn plan(&mut self) {
        self.phase = Phase::Planning;
    }

    /// A pass is under way onward.
    pub(crate) const fn wait(&mut self) {
        self.phase = Phase::Waiting;
    }

    /// What came of the pass was no agreement, or there is no pass any more.
    pub(crate) const fn answer(&mut self) {
        self.phase = Phase::Answered;
    }

    /// The chain has agreed.
    pub(crate) const fn hold(&mut self) {
        self.phase = Phase::Holding;
    }

    /// No target can be met.
    pub(crate) const fn give_up(&mut self) {
        self.phase = Phase::Infeasible;
    }

    /// Nothing has come yet in a new view, in which this relay `leads` or not.
    pub(crate) const fn renew(&mut self, leads: bool) {
        if leads {
            self.plan();
        } else {
            self.answer();
        }
        self.begun = false;
        self.stragglers = Stragglers::NONE;
    }

    /// The leader numbers its next pass.
    pub(crate) const fn begin(&mut self) {
        self.number = if self.begun {
            self.next()
        } else {
            // The next one that is a first one.
            self.number.wrapping_add(INCARNATION) & !(INCARNATION - 1)
        };
        self.begun = true;
    }

    /// The number of the pass that its leader begins after the current one.
    const fn next(self) -> u16 {
        let next = self.number.wrapping_add(1);
        if next.is_multiple_of(INCARNATION) {
            next.wrapping_add(1)
        } else {
            next
        }
    }

    /// A pass of `number` is under way.
    pub(crate) const fn take(&mut self, number: u16) {
        self.number = number;
        self.begun = true;
        self.stragglers = Stragglers::NONE;
    }

    /// What a pass of `number` is; `same` tells whether it is the current one in everything else.
    pub(crate) fn arrival(&mut self, number: u16, same: bool) -> Arrival {
        if !self.begun {
            // What it missed it cannot take part in: it can ask for another beginning.
            return if number.is_multiple_of(INCARNATION) {
                Arrival::New
            } else {
                Arrival::Foreign
            };
        }
        let ahead = number.wrapping_sub(self.number);
        match (ahead, self.number.wrapping_sub(number)) {
            (0, _) if same => Arrival::Again,
            _ if number == self.next() => Arrival::New,
            (_, 1..=STRAGGLERS) => self.straggler(),
            _ => Arrival::Foreign,
        }
    }

    /// One more pass that should be over.
    const fn straggler(&mut self) -> Arrival {
        if self.stragglers.one_more() {
            Arrival::Foreign
        } else {
            Arrival::Straggler
        }
    }

    /// Whether what came of pass `number` is awaited.
    pub(crate) fn awaits(self, number: u16) -> bool {
        self.phase == Phase::Waiting && number == self.number
    }

    /// Whether what came of the pass of `before` has come since.
    pub(crate) fn answers(self, before: Self) -> bool {
        let came = before.phase == Phase::Waiting && self.phase != Phase::Waiting;
        came && self.number == before.number
    }

    /// Whether the next pass has come since `before`, whose own had been answered.
    pub(crate) fn follows(self, before: Self) -> bool {
        before.is_answered() && self.number != before.number
    }

    /// Whether something can be handed back.
    pub(crate) fn is_answered(self) -> bool {
        matches!(self.phase, Phase::Answered | Phase::Holding)
    }
}

#[cfg(test)]
mod tests {
    use super::{Arrival, INCARNATION, Phase, RoundState, STRAGGLERS};
    use crate::node::numbering::SUSPICIOUS;

    /// One that has taken part in pass 200.
    fn begun() -> RoundState {
        let mut state = RoundState::new(Phase::Idle, 0);
        state.take(200);
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
            // The leader leaves first numbers out: after 255 comes 257.
            let next = match last {
                255 => 257,
                u16::MAX => 1,
                _ => last + 1,
            };
            for off in 1..=u16::MAX {
                let number = last.wrapping_add(off);
                let expected = if number == next {
                    Arrival::New
                } else if last.wrapping_sub(number) <= STRAGGLERS {
                    Arrival::Straggler
                } else {
                    Arrival::Foreign
                };
                let mut state = begun();
                state.take(last);
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
        assert_eq!(state.arrival(200, true), Arrival::Again);
        assert_eq!(state.arrival(200, false), Arrival::Foreign);
        for _ in 1..SUSPICIOUS {
            assert_eq!(state.arrival(199, false), Arrival::Straggler);
        }
        assert_eq!(state.arrival(199, false), Arrival::Foreign);
        assert_eq!(state.arrival(199, false), Arrival::Straggler);
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
