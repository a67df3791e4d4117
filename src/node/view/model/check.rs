//! Transitions of the model: each event and its effect on the chain.

#![allow(clippy::cast_possible_truncation, reason = "chains of a few relays")]

extern crate std;

use std::vec;
use std::vec::Vec;

use super::chain::{Body, Chain, Decree, Frame, Unit, put};
use crate::mission::Mission;
use crate::mission::tests::paper;
use crate::node::circulation::Circulation;
use crate::node::context::{Context, Decided, Effects, Member, News};
use crate::node::numbering::Stragglers;
use crate::node::view::asking::Asking;
use crate::node::view::change::ViewChange;
use crate::node::view::electorate::Held;
use crate::settings::Settings;
use crate::time::Instant;
use crate::view::ViewId;
use crate::wire::message::Message;

/// Rule of voting.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Rule {
    /// Rule of the firmware: only members vote.
    Members,
    /// Every present relay votes, and the quorum is half of the newest view known to any of them.
    Everybody,
}

/// Configuration of a check: rule and bounds on the events.
#[derive(Clone, Debug)]
pub(super) struct Check {
    pub(super) rule: Rule,
    pub(super) members: Vec<Member>,
    pub(super) partitions: Vec<Vec<u8>>,
    pub(super) cuts: u8,
    pub(super) proposals: u8,
    pub(super) reboots: u8,
    pub(super) losses: u8,
    /// True to check in every state that a healed chain settles.
    pub(super) heals: bool,
}

/// Returns all set partitions of `relays` relays.
pub(super) fn partitions(relays: usize) -> Vec<Vec<u8>> {
    let mut all = vec![vec![]];
    for _ in 0..relays {
        all = all
            .iter()
            .flat_map(|parts: &Vec<u8>| {
                let next = parts.iter().max().map_or(0, |most| most + 1);
                (0..=next).map(move |part| {
                    let mut parts = parts.clone();
                    parts.push(part);
                    parts
                })
            })
            .collect();
    }
    all
}

impl Check {
    pub(super) fn of(relays: u16) -> Self {
        let mission = Mission::try_new(paper(relays)).unwrap();
        Self {
            rule: Rule::Members,
            members: (1..=relays)
                .map(|node| Member::new(mission, Settings::default(), node))
                .collect(),
            partitions: partitions(usize::from(relays)),
            cuts: 2,
            proposals: 2,
            reboots: 0,
            losses: 0,
            heals: false,
        }
    }

    pub(super) fn unit(&self) -> Unit {
        let relays = self.members.len() as u16;
        Unit {
            change: ViewChange::new(relays, 1, 1),
            flies: (ViewId::LOADED, 0, relays),
        }
    }

    pub(super) fn context(&self, chain: &Chain, at: usize) -> Context<'_> {
        let member = &self.members[at];
        Context {
            now: Instant::ZERO,
            member,
            latest: member.active,
            end: chain.after(at).is_none(),
            held: Held::NONE,
        }
    }

    /// Returns the relays that have voted on `proposal`, as a bit mask.
    pub(super) fn asked(chain: &Chain, proposal: ViewId) -> u8 {
        let voters = chain.units.iter().zip(0..);
        let voters = voters.filter(|(unit, _)| unit.change.electorate.has_voted(proposal));
        let known = voters.fold(0, |members, (_, at)| members | 1 << at);
        let handed = chain
            .air
            .iter()
            .filter(|frame| matches!(frame.body, Body::Proposal { view, .. } if view == proposal));
        handed.fold(known, |members, frame| members | 1 << frame.from)
    }

    /// Sends the pending messages of relay `at`, and records the decision in `effects`.
    pub(super) fn settle(&self, chain: &mut Chain, at: usize, effects: Effects) {
        let (before, after) = (chain.before(at), chain.after(at));
        let context = self.context(chain, at);
        let decides = chain.units[at].change.proposed;
        let members = decides.map_or(0, |proposed| Self::asked(chain, proposed.view));
        let Chain {
            units,
            air,
            decrees,
            agreed,
            ..
        } = chain;
        let unit = &mut units[at];
        let mut send = |to: usize, message: &Message| {
            if let Some(body) = Body::of(message) {
                let from = at;
                put(air, Frame { from, to, body });
            }
        };
        if let Some(to) = after
            && let Some(message) = unit.change.take_onward(&context, to as u16 + 1)
        {
            send(to, &message);
        }
        if let Some(to) = before {
            while let Some(message) = unit.change.take_back() {
                send(to, &message);
            }
        }
        if let Some(proposed) = unit.change.proposed
            && let Some(News::Decided(decided)) = effects.news
        {
            if let Decided::Granted { relays, .. } = decided {
                unit.flies = (proposed.view, proposed.place, relays);
            }
            if let Some(view) = proposed.decided {
                if view.id == proposed.view && view.relays == proposed.place {
                    put(
                        decrees,
                        Decree {
                            view: (view.id, view.relays),
                            follows: proposed.poll.agreed.id,
                            members,
                        },
                    );
                }
                if proposed.place == 1 {
                    put(agreed, (view.id, view.relays));
                }
            }
        }
        let change = &mut unit.change;
        if self.rule == Rule::Everybody {
            change.electorate.count_everybody();
        }
        // Resets timers and everything that only repairs late messages, to reduce the number of states.
        change.newest = ViewId::LOADED;
        change.asking = Asking::new(1);
        change.refused = false;
        change.stragglers = Stragglers::NONE;
        change.circulation = Circulation::at_stage(change.circulation.stage());
    }

    pub(super) fn propose(&self, chain: &mut Chain, at: usize) {
        let newest = (0..chain.units.len())
            .filter(|&other| chain.parts[other] == chain.parts[at])
            .map(|other| chain.units[other].change.electorate.promised())
            .max()
            .unwrap();
        let context = self.context(chain, at);
        let change = &mut chain.units[at].change;
        change.heard_of(newest);
        if change.awaited().is_some() {
            change.heard_of(newest.next_by(self.members[at].node).unwrap());
        }
        change.asking = Asking::due(Instant::ZERO);
        let effects = change.handle_timeout(&context, true, false);
        self.settle(chain, at, effects);
    }

    pub(super) fn arrive(&self, chain: &mut Chain, frame: &Frame) {
        let at = frame.to;
        let neighbour = match frame.body {
            Body::Proposal { .. } => chain.before(at),
            Body::Decision { .. } => chain.after(at),
        };
        if neighbour != Some(frame.from) {
            return;
        }
        let context = self.context(chain, at);
        let message = frame.body.message(self.members[0].active);
        let effects = chain.units[at].change.handle(&context, &message);
        self.settle(chain, at, effects);
    }

    pub(super) fn end(&self, chain: &mut Chain, at: usize) {
        if chain.after(at).is_none() {
            let context = self.context(chain, at);
            let effects = chain.units[at].change.decide(&context);
            self.settle(chain, at, effects);
        }
    }

    pub(super) fn repeat(&self, chain: &mut Chain, at: usize) {
        chain.units[at].change.resend();
        self.settle(chain, at, Effects::NONE);
    }

    pub(super) fn pass(chain: &mut Chain, at: usize) {
        let Some(to) = chain.after(at) else {
            return;
        };
        let Unit { change, flies } = &chain.units[at];
        let (view, place, _) = *flies;
        let knows = change.electorate.agreed().id == view && change.awaited().is_none();
        let next = &mut chain.units[to];
        if knows
            && next.change.awaited().is_none()
            && next.flies.0 == view
            && next.flies.1 == place + 1
        {
            next.change.commit(view);
        }
    }

    pub(super) fn reboot(&self, chain: &mut Chain, at: usize, remembers: bool) {
        let electorate = chain.units[at].change.electorate;
        chain.units[at] = self.unit();
        if remembers {
            chain.units[at].change.electorate = electorate;
        }
        self.settle(chain, at, Effects::NONE);
    }
}
