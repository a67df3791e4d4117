//! A round of agreement: one pass along the chain and what comes back of it, for every algorithm.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`state`] | the state table of a pass, and its number |
//! | `core` | what a relay holds while it does its share |
//! | `sweep`, `sweeping` | a sweep of targets (Algorithms 1 and 4) and its verdict |
//! | `course` | trials of the joint method |
//! | `turn`, `turning` | a turn of Algorithm 2 |
//! | `leader`, `task` | what comes before a pass begins: which one, and what for |

mod core;
mod course;
mod leader;
pub(crate) mod state;
mod sweep;
mod sweeping;
mod task;
mod turn;
mod turning;

use super::PAUSE;
use super::context::{Context, Effects};
use super::retransmit::{Retransmit, Trip};
use super::view::earliest;
use crate::mission::{Heading, Profile};
use crate::place::Placement;
use crate::time::Instant;
use crate::wire::message::Message;

use self::core::{ADJUST, ALTITUDE, Own, Share};
use state::{Next, Phase};

/// What is to be sent.
#[derive(Clone, Copy, Debug, Default)]
struct Due {
    onward: bool,
    back: bool,
    busy: bool,
}

/// The rounds of one relay.
#[derive(Clone, Debug)]
pub(crate) struct Round {
    share: Share,
    retransmit: Retransmit,
    work_at: Option<Instant>,
    due: Due,
}

impl Round {
    /// A relay that has just been switched on. The leader numbers its passes from `number` on, and has work to do.
    pub(crate) const fn new(leads: bool, number: u16, profile: Profile, seed: u32) -> Self {
        Self {
            share: Share::new(leads, number, profile),
            retransmit: Retransmit::new(seed),
            work_at: None,
            due: Due {
                onward: false,
                back: false,
                busy: false,
            },
        }
    }

    /// A message of the mission and the view that this relay is in, from the neighbour that has it to say. Bounded by 16 reaches.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let own = Own::new(context);
        let share = &mut self.share;
        let next = match message {
            Message::Sweep(sweep) => share.on_sweep(own, sweep),
            Message::Verdict(answer) => share.on_verdict(own, answer),
            Message::Course(course) if ALTITUDE => share.on_course(own, course),
            Message::Worth(worth) if ALTITUDE => share.on_worth(own, worth),
            Message::Token(token) if ADJUST => share.on_token(own, token),
            Message::Moved(moved) if ADJUST => share.on_moved(own, moved),
            Message::Busy { sweep } => {
                if share.phase() == Phase::Waiting && *sweep == share.number() {
                    // It has arrived: what is missing is the answer, and that may take its time.
                    self.retransmit.heard();
                    self.await_answer(context);
                }
                return Effects::NONE;
            }
            _ => return Effects::NONE,
        };
        self.proceed(context, next)
    }

    /// Does what is due. Bounded by one portion of a computation.
    pub(crate) fn handle_timeout(&mut self, context: &Context<'_>) -> Effects {
        let resent = self.retransmit.is_due(context.now) && self.share.phase() == Phase::Waiting;
        self.due.onward |= resent;
        if !self.work_at.is_some_and(|at| at <= context.now) {
            return Effects {
                resent,
                ..Effects::NONE
            };
        }
        self.work_at = None;
        let sweeps = self.share.sweeps;
        let next = self.share.work(Own::new(context));
        let began = self.share.sweeps != sweeps;
        let effects = self.proceed(context, next);
        Effects {
            resent,
            began,
            ..effects
        }
    }

    /// Does what the relay's share asks for.
    fn proceed(&mut self, context: &Context<'_>, next: Next) -> Effects {
        let moved = |moved| Effects {
            moved,
            ..Effects::NONE
        };
        match next {
            Next::Nothing => Effects::NONE,
            Next::Foreign => Effects::FOREIGN,
            Next::Stale => Effects::STALE,
            Next::Work { moved: to } => {
                // What there was to say of the pass before would be stale.
                self.due = Due::default();
                self.retransmit.stop();
                self.work_soon(context.now);
                moved(to)
            }
            Next::Think => {
                self.work_soon(context.now);
                Effects::NONE
            }
            Next::Forward { moved: to } => {
                // An answer to the pass before would be stale.
                self.due = Due {
                    onward: true,
                    ..Due::default()
                };
                self.retransmit.heard();
                self.retransmit.stop();
                self.work_at = None;
                moved(to)
            }
            Next::Busy => {
                self.due.busy = true;
                Effects::REPEATED
            }
            Next::Repeat => {
                self.due.back = true;
                Effects::REPEATED
            }
            Next::Answer { moved: to, agreed } => {
                self.due = Due {
                    back: true,
                    ..Due::default()
                };
                self.retransmit.stop();
                self.work_at = None;
                Effects {
                    converged: agreed,
                    ..moved(to)
                }
            }
            Next::Infeasible => {
                self.retransmit.stop();
                Effects {
                    infeasible: true,
                    ..Effects::NONE
                }
            }
        }
    }

    /// Goes on with a computation after a pause, so that a caller's loop gets its turn.
    pub(crate) fn work_soon(&mut self, now: Instant) {
        self.work_at = Some(now + PAUSE);
    }

    /// The leader begins again from the start.
    pub(crate) fn restart(&mut self, context: &Context<'_>) -> Effects {
        self.share.restart();
        self.proceed(context, Next::Work { moved: false })
    }

    /// A view is proposed: what was under way is over.
    pub(crate) fn suspend(&mut self) {
        self.share.suspend();
        self.due = Due::default();
        self.retransmit.stop();
        self.work_at = None;
    }

    /// The new view is in force, in which this relay `leads` or not, and has something to work out at once or not.
    pub(crate) fn renew(&mut self, now: Instant, leads: bool, works: bool) {
        self.share.renew(leads);
        if leads || works {
            self.work_soon(now);
        }
    }

    /// Another mission is flown from now on, in which this relay is given `profile`. It stays where it is.
    pub(crate) fn load(&mut self, profile: Profile) {
        self.share.load(profile);
    }

    /// What could not be said to the neighbour after can be now.
    pub(crate) fn resend(&mut self) {
        self.due.onward |= self.share.phase() == Phase::Waiting;
    }

    /// What is to be sent onward. It is taken for sent; nothing goes out without a neighbour, and comes again.
    pub(crate) fn take_onward(
        &mut self,
        context: &Context<'_>,
        reachable: bool,
    ) -> Option<Message> {
        let due = ::core::mem::take(&mut self.due.onward);
        if !due || self.share.phase() != Phase::Waiting {
            return None;
        }
        self.await_answer(context);
        if !reachable {
            return None;
        }
        self.share.onward(Own::new(context))
    }

    /// What is to be sent back; it is taken for sent then.
    pub(crate) fn take_back(&mut self, context: &Context<'_>, reachable: bool) -> Option<Message> {
        if ::core::mem::take(&mut self.due.back) && self.share.has_answer() && reachable {
            return self.share.back(Own::new(context));
        }
        let busy = ::core::mem::take(&mut self.due.busy) && reachable;
        busy.then_some(Message::Busy {
            sweep: self.share.number(),
        })
    }

    fn await_answer(&mut self, context: &Context<'_>) {
        let chain = context.chain;
        let hops = match chain.mission.heading() {
            Heading::TowardRx => chain.mission.relays().saturating_sub(chain.index),
            Heading::TowardTx => chain.index.saturating_sub(1),
        };
        let trip = Trip {
            hop_time: chain.settings.hop_time,
            hops,
            slow: self.share.is_slow(),
        };
        self.retransmit.sent(context.now, trip);
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.work_at, self.retransmit.next_timeout())
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.share.phase()
    }

    /// Whether no pass and no view has been taken part in yet.
    pub(crate) fn is_fresh(&self) -> bool {
        self.share.phase() == Phase::Idle
    }

    /// Whether it has still to find out where it is to be by the joint method, and is at that.
    pub(crate) fn is_solving(&self, context: &Context<'_>) -> bool {
        self.work_at.is_some() && self.share.is_solving(Own::new(context))
    }

    /// Whether it has just been made.
    #[cfg(feature = "upload")]
    pub(crate) const fn is_untouched(&self) -> bool {
        self.share.is_untouched()
    }

    /// Where to be in the end.
    pub(crate) const fn setpoint(&self) -> Option<Placement> {
        self.share.setpoint
    }

    pub(crate) const fn target(&self) -> Option<f32> {
        self.share.target
    }

    pub(crate) const fn bound(&self) -> Option<f32> {
        self.share.bound
    }

    pub(crate) const fn profile(&self) -> Profile {
        self.share.profile()
    }

    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        self.share.rounds()
    }
}
