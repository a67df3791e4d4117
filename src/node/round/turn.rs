//! A relay's move in Algorithm 2, and the result of the moves of the relays after it.
//!
//! The relay that has the token searches for a better position. It reports its position to the next relay with the
//! token, and to the previous one with the result. In the first pass no relay moves, so that all learn their
//! neighbours' positions. The result also contains the worst SIR, which the leader needs after every round.

use super::computation::{Computation, LeaderTask, PassKind, TurnPass};
use super::state::Action;
use crate::node::context::Context;
use crate::optimiser::local::{HopEnd, Hops};
use crate::place::Placement;
use crate::wire::message::{AdjustStep, Moved, Token};
use core::task::Poll;

/// Number of positions that one call of [`Computation::continue_turn`] evaluates in Algorithm 2. In Algorithm 2 the
/// relays move in turn. The first value is for data from Tx to Rx only, the second for data in both directions.
///
/// A call ends only when all positions at the current altitude are evaluated. These can be 24 more positions, or 194
/// for data in both directions.
const PLACES_AT_ONCE: [u16; 2] = [600, 300];

fn neighbour(context: &Context<'_>, place: Placement, power_w: f32) -> HopEnd {
    HopEnd {
        place,
        apart_m: context.mission().config().min_separation_m,
        power_w,
    }
}

impl Computation {
    /// Handles the token of Algorithm 2 (relays move in turn), received from the previous relay.
    pub(crate) fn on_token(&mut self, context: &Context<'_>, token: &Token) -> Action {
        let same = matches!(&self.pass, PassKind::Turn(turn_pass) if turn_pass.turn == token.turn);
        let arrival = self.state.arrival(token.number, same);
        if let Some(next) = arrival.refused() {
            return next;
        }
        if self.agreed_place.is_none() {
            // This relay has missed the agreement on positions, so it has no position to report.
            return Action::Foreign;
        }
        if context.mission().interferer().is_none() || !context.is_between(token.place) {
            // Tx and Rx have no relay beyond them.
            return Action::Stale;
        }
        self.state.accept(token.number);
        let before = neighbour(context, token.place, token.power_w);
        self.take_turn(context, TurnPass::new(token.turn, token.sir, Some(before)))
    }

    /// Starts this relay's search for a better position, because it has the token of Algorithm 2. In Algorithm 2 the
    /// relays move in turn: the relay with the token moves.
    pub(super) fn take_turn(&mut self, context: &Context<'_>, mut turn_pass: TurnPass) -> Action {
        self.state.wait();
        let mut searching = false;
        if let Some(at) = self.agreed_place
            && let Some(interferer) = context.mission().interferer()
            && (context.is_last_of_view() || self.after.is_some())
        {
            let band = context.band(at.altitude_m);
            let hops = Hops::new(
                context.mission(),
                interferer,
                turn_pass.before,
                self.profile.power_w,
                self.after,
            );
            searching = turn_pass.begin(hops, at, (band.least_m, band.most_m));
        }
        self.pass = PassKind::Turn(turn_pass);
        if searching {
            Action::ContinueWithoutReply
        } else {
            self.forward_turn(context)
        }
    }

    /// Continues the search for a better position by one step.
    pub(super) fn continue_turn(&mut self, context: &Context<'_>) -> Action {
        let PassKind::Turn(turn_pass) = &mut self.pass else {
            return Action::Stale;
        };
        let [one_way, both_ways] = PLACES_AT_ONCE;
        let is_one_way = !(context.mission().reverse() > 0.0);
        match turn_pass.step(if is_one_way { one_way } else { both_ways }) {
            Poll::Pending => Action::ContinueWithoutReply,
            Poll::Ready(None) => self.forward_turn(context),
            Poll::Ready(Some(place)) => {
                self.agree_on(place, place.cross_section());
                self.forward_turn(context)
            }
        }
    }

    pub(super) fn forward_turn(&mut self, context: &Context<'_>) -> Action {
        if !context.is_last_of_view() {
            return Action::Forward;
        }
        self.conclude_turn(context, f32::MAX)
    }

    /// Handles the next relay's reply to the token of Algorithm 2 (relays move in turn).
    pub(crate) fn on_moved(&mut self, context: &Context<'_>, moved: &Moved) -> Action {
        if let PassKind::Turn(turn_pass) = &mut self.pass
            && !turn_pass.is_searching()
            && self.state.is_awaited(moved.number)
            && context.is_between(moved.place)
        {
            turn_pass.any |= moved.position_changed;
            self.after = Some(neighbour(context, moved.place, moved.power_w));
            return self.conclude_turn(context, moved.worst_sir);
        }
        Action::Stale
    }

    /// Ends this relay's part in a pass of Algorithm 2, and prepares its reply to the token. The reply contains the
    /// worst SIR of all hops from this relay to Rx. `worst` is the worst SIR of the hops from the next relay to Rx,
    /// linear.
    pub(super) fn conclude_turn(&mut self, context: &Context<'_>, worst: f32) -> Action {
        let (PassKind::Turn(turn_pass), Some(at), Some(interferer)) = (
            &mut self.pass,
            self.agreed_place,
            context.mission().interferer(),
        ) else {
            return Action::Stale;
        };
        let hops = Hops::new(
            context.mission(),
            interferer,
            turn_pass.before,
            self.profile.power_w,
            self.after,
        );
        let (incoming, outgoing) = hops.both(at);
        turn_pass.worst = worst.min(outgoing).min(f32::MAX);
        let stop = turn_pass.turn == AdjustStep::Stop;
        if stop {
            self.target = Some(turn_pass.sir);
        }
        if stop {
            self.state.hold();
        } else {
            self.state.answer();
        }
        if let LeaderTask::Adjusting(rounds) = &mut self.task {
            if !rounds.advance(turn_pass.any, turn_pass.worst.min(incoming)) {
                return Action::ContinueWithoutReply;
            }
            self.task.clear();
        }
        Action::Answer { agreed: stop }
    }
}
