//! A round of agreement: one pass along the chain and what comes back of it, for every algorithm.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`state`] | the state table of a pass, and its number |
//! | `computation` | what a relay holds while it does its share, and which pass the leader begins |
//! | `sweep` | a sweep of targets (Algorithms 1 and 4) and its verdict |
//! | `gathering` | the joint method: the pass that gathers what a relay has to know of the others, and its own solution of the chain |
//! | `turn` | a turn of Algorithm 2 |
//! | `sense` | the pass that adds up what is heard, and what a relay keeps of that |
//!
//! What answers a relay is a sign of life, from when the relay said what is answered: what came of a pass, by the neighbour onward, as of
//! when the pass was first handed on; the next pass, by the neighbour back, as of when what came of the last one was first handed back. A
//! leader whose firmware has it begin again does not wait for that: then the sign is too new by one pass at most.

mod computation;
mod gathering;
mod sense;
pub(crate) mod state;
mod sweep;
#[cfg(test)]
mod tests;
mod turn;

use super::circulation::{Circulation, Path, Reply};
use super::context::{Context, Effects, Member};
use super::sample::{Meter, Sample};
use super::timing::{PAUSE, earliest};
use crate::mission::Profile;
use crate::place::Placement;
use crate::settings::Settings;
use crate::time::Instant;
use crate::wire::message::Message;

use computation::{ADJUST, ALTITUDE, Computation};
use sense::{Findings, SENSING, Sensing};
use state::{Action, Phase};

/// The rounds of one relay.
#[derive(Clone, Debug)]
pub(crate) struct Round {
    circulation: Circulation,
    work_at: Option<Instant>,
    computation: Computation,
}

impl Round {
    /// A relay that has just been switched on. The leader numbers its passes from `number` on, and has work to do.
    pub(crate) const fn new(
        leads: bool,
        number: u16,
        profile: Profile,
        settings: &Settings,
        seed: u32,
        now: Instant,
    ) -> Self {
        Self {
            computation: Computation::new(leads, number, profile, settings, now),
            circulation: Circulation::new(seed),
            work_at: None,
        }
    }

    /// A message of the mission and the view that this relay is in, from the neighbour that has it to say. Bounded by 16 reaches.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let computation = &mut self.computation;
        let before = computation.state;
        let (forwarded_at, replied_at) = (
            self.circulation.started_at(),
            self.circulation.completed_at(),
        );
        let found = computation.sensing.found();
        let next = match message {
            Message::Sweep(sweep) => computation.on_sweep(context, sweep),
            Message::Verdict(answer) => computation.on_verdict(context, answer),
            Message::Gather(roster) if ALTITUDE => computation.on_gather(context, roster),
            Message::Gathered(roster) if ALTITUDE => computation.on_gathered(context, roster),
            Message::Sense(hearing) if SENSING => computation.on_sense(context, hearing),
            Message::Sensed(hearing) if SENSING => computation.on_sensed(context, hearing),
            Message::Token(token) if ADJUST => computation.on_token(context, token),
            Message::Moved(moved) if ADJUST => computation.on_moved(context, moved),
            Message::Busy { sweep } => {
                if computation.phase() == Phase::Waiting && *sweep == computation.number() {
                    let path = self.path(context);
                    self.circulation.on_in_progress(context.now, path);
                }
                return Effects::NONE;
            }
            _ => return Effects::NONE,
        };
        let state = computation.state;
        Effects {
            heard_onward: forwarded_at.filter(|_| state.answers(before)),
            heard_back: replied_at.filter(|_| state.follows(before)),
            ..self.proceed_with(context, next, found)
        }
    }

    /// Does what is due. Bounded by one portion of a computation.
    pub(crate) fn handle_timeout(&mut self, context: &Context<'_>) -> Effects {
        let hop_time = context.settings().hop_time;
        let resent = self.circulation.handle_timeout(context.now, hop_time);
        if SENSING
            && self.computation.sensing.take_due(context.now)
            && self.computation.may_sense(context)
        {
            let found = self.computation.sensing.found();
            let next = self.computation.begin_sense(context);
            return Effects {
                resent,
                began: true,
                ..self.proceed_with(context, next, found)
            };
        }
        if self.work_at.is_none_or(|at| at > context.now) {
            return Effects {
                resent,
                ..Effects::NONE
            };
        }
        self.work_at = None;
        let sweeps = self.computation.sweeps;
        let found = self.computation.sensing.found();
        let next = self.computation.work(context);
        let began = self.computation.sweeps != sweeps;
        let effects = self.proceed_with(context, next, found);
        Effects {
            resent,
            began,
            ..effects
        }
    }

    /// As [`proceed`](Self::proceed), and says what has been found since `before`.
    fn proceed_with(&mut self, context: &Context<'_>, next: Action, before: Findings) -> Effects {
        let effects = self.proceed(context, next);
        if !SENSING {
            return effects;
        }
        self.computation.plan_to_sense(context);
        let found = self.computation.sensing.found();
        Effects {
            believes: found.told != before.told,
            unclear: found.unfit.is_some() && found.unfit != before.unfit,
            off: found.newly_off(&before, context.member.node, context.member.all),
            ..effects
        }
    }

    /// Does what the relay's share asks for.
    fn proceed(&mut self, context: &Context<'_>, next: Action) -> Effects {
        match next {
            Action::Nothing => Effects::NONE,
            Action::Foreign => Effects::FOREIGN,
            Action::Stale => Effects::STALE,
            Action::Work => {
                // Messages of the pass before would be stale.
                self.circulation.withdraw();
                self.work_soon(context.now);
                Effects::NONE
            }
            Action::Think => {
                self.work_soon(context.now);
                Effects::NONE
            }
            Action::Forward => {
                self.circulation.start(context.now);
                self.work_at = None;
                Effects::NONE
            }
            Action::Repeat => {
                let path = context.path_to_leader();
                self.circulation.on_duplicate(context.now, path);
                Effects::REPEATED
            }
            Action::Answer { agreed } => {
                let path = context.path_to_leader();
                self.circulation.complete(context.now, path);
                // Now that it knows what the others bring along it may have the chain to solve.
                self.work_at = None;
                if self.computation.is_solving(context) {
                    self.work_soon(context.now);
                }
                Effects {
                    converged: agreed,
                    ..Effects::NONE
                }
            }
            Action::Settled => {
                self.circulation.close();
                Effects::NONE
            }
            Action::Infeasible => {
                self.circulation.close();
                Effects {
                    infeasible: true,
                    ..Effects::NONE
                }
            }
        }
    }

    /// One measurement, by a relay that measures; whether it was of use.
    pub(crate) fn handle_sample(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        if sample.is_heard() {
            return SENSING
                && member.settings.listen.is_some()
                && self.computation.sensing.take(now, member, sample);
        }
        let at = self.computation.setpoint.filter(|_| member.index == 1);
        self.computation.meter.take(&member.mission, at, sample)
    }

    /// Goes on with a computation after a pause, so that a caller's loop gets its turn.
    pub(crate) fn work_soon(&mut self, now: Instant) {
        self.work_at = Some(now + PAUSE);
    }

    /// The leader begins again from the start.
    pub(crate) fn restart(&mut self, context: &Context<'_>) -> Effects {
        self.computation.restart();
        self.proceed(context, Action::Work)
    }

    /// A view is proposed: what was under way is over.
    pub(crate) fn suspend(&mut self) {
        self.computation.suspend();
        self.circulation.cancel();
        self.work_at = None;
    }

    /// The new view is in force, in which this relay `leads` or not, and has something to work out at once or not.
    pub(crate) fn renew(&mut self, now: Instant, leads: bool, works: bool) {
        self.computation.renew(leads);
        if leads || works {
            self.work_soon(now);
        }
    }

    /// Another mission is flown from now on, in which this relay is given `profile`. It stays where it is.
    pub(crate) fn load(&mut self, profile: Profile) {
        self.computation.load(profile);
    }

    /// Discards the agreed place: the relay has none until the chain agrees anew.
    pub(crate) const fn discard_place(&mut self) {
        self.computation.discard_place();
    }

    /// What could not be said to the neighbour after can be now.
    pub(crate) fn resend(&mut self) {
        self.circulation.resend();
    }

    /// What is to be sent onward. It is taken for sent; nothing goes out without a neighbour, and comes again.
    pub(crate) fn take_onward(
        &mut self,
        context: &Context<'_>,
        reachable: bool,
    ) -> Option<Message> {
        let is_due = self.circulation.poll_forward();
        let message = self.computation.onward(context).filter(|_| is_due)?;
        let path = self.path(context);
        self.circulation.await_result(context.now, path);
        reachable.then_some(message)
    }

    /// What is to be sent back; it is taken for sent then.
    pub(crate) fn take_back(&mut self, context: &Context<'_>, reachable: bool) -> Option<Message> {
        match self.circulation.poll_reply().filter(|_| reachable)? {
            Reply::Result => self.computation.back(context),
            Reply::InProgress => Some(Message::Busy {
                sweep: self.computation.number(),
            }),
        }
    }

    fn path(&self, context: &Context<'_>) -> Path {
        Path {
            slow: self.computation.is_slow(),
            ..context.path_to_last()
        }
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let due = earliest(self.work_at, self.circulation.next_timeout());
        earliest(due, self.computation.sensing.next_timeout())
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.computation.phase()
    }

    /// Whether no pass and no view has been taken part in yet.
    pub(crate) fn is_fresh(&self) -> bool {
        self.computation.phase() == Phase::Idle
    }

    /// Whether it has still to find out where it is to be by the joint method, and is at that.
    pub(crate) fn is_solving(&self, context: &Context<'_>) -> bool {
        self.work_at.is_some() && self.computation.is_solving(context)
    }

    /// Whether it has just been made.
    pub(crate) const fn is_untouched(&self) -> bool {
        self.computation.is_untouched()
    }

    /// Where to be in the end.
    pub(crate) const fn setpoint(&self) -> Option<Placement> {
        self.computation.setpoint
    }

    /// What it has measured.
    pub(crate) const fn meter(&self) -> &Meter {
        &self.computation.meter
    }

    /// What it hears and believes of the interference.
    pub(crate) const fn sensing(&self) -> &Sensing {
        &self.computation.sensing
    }

    pub(crate) const fn target(&self) -> Option<f32> {
        self.computation.target
    }

    pub(crate) const fn bound(&self) -> Option<f32> {
        self.computation.bound
    }

    pub(crate) const fn profile(&self) -> Profile {
        self.computation.profile()
    }

    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        self.computation.rounds()
    }
}
