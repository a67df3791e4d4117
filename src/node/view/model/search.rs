//! Exhaustive search of all states.

extern crate std;

use std::string::String;
use std::time::Instant;
use std::vec::Vec;
use std::{format, println, vec};

use stateright::{Checker, HasDiscoveries, Model, Property};

use super::chain::{Chain, Happens};
use super::check::Check;
use crate::node::context::Effects;

/// Property of all agreed views.
pub(super) const ONE_CHAIN: &str = "agreed views follow each other one by one";

impl Model for Check {
    type State = Chain;
    type Action = Happens;

    fn init_states(&self) -> Vec<Chain> {
        let relays = self.members.len();
        let mut chain = Chain {
            units: vec![self.unit(); relays],
            parts: vec![0; relays],
            air: vec![],
            decrees: vec![],
            agreed: vec![],
            cuts: self.cuts,
            proposals: self.proposals,
            reboots: self.reboots,
            losses: self.losses,
        };
        for at in 0..relays {
            self.settle(&mut chain, at, Effects::NONE);
        }
        vec![chain]
    }

    fn actions(&self, chain: &Chain, actions: &mut Vec<Happens>) {
        actions.extend(chain.air.iter().copied().map(Happens::Arrives));
        let relays = 0..chain.units.len();
        for at in relays {
            if chain.proposals > 0 && chain.before(at).is_none() {
                actions.push(Happens::Proposes(at));
            }
            actions.extend([
                Happens::EndsAt(at),
                Happens::Repeats(at),
                Happens::Passes(at),
            ]);
            if chain.reboots > 0 {
                actions.push(Happens::Reboots(at));
            }
            if chain.losses > 0 {
                actions.push(Happens::Forgets(at));
            }
        }
        if chain.cuts > 0 {
            actions.extend((0..self.partitions.len()).map(Happens::Part));
        }
    }

    fn next_state(&self, before: &Chain, action: Happens) -> Option<Chain> {
        let mut chain = before.clone();
        match action {
            Happens::Part(number) => chain.parts.clone_from(&self.partitions[number]),
            Happens::Arrives(frame) => self.arrive(&mut chain, &frame),
            Happens::Proposes(at) => self.propose(&mut chain, at),
            Happens::EndsAt(at) => self.end(&mut chain, at),
            Happens::Repeats(at) => self.repeat(&mut chain, at),
            Happens::Passes(at) => Self::pass(&mut chain, at),
            Happens::Reboots(at) => self.reboot(&mut chain, at, true),
            Happens::Forgets(at) => self.reboot(&mut chain, at, false),
        }
        if chain == *before {
            return None;
        }
        match action {
            Happens::Part(_) => chain.cuts -= 1,
            Happens::Proposes(_) => chain.proposals -= 1,
            Happens::Reboots(_) => chain.reboots -= 1,
            Happens::Forgets(_) => chain.losses -= 1,
            _ => {}
        }
        Some(chain)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![
            Property::always(ONE_CHAIN, |_, chain| Self::is_one_chain(chain)),
            Property::always("a view has one size", |_, chain| Self::has_one_size(chain)),
            Property::always(
                "what is known is so, and members are counted once",
                |check: &Self, chain| check.is_known_and_counted(chain),
            ),
            Property::always("once healed it settles", |check: &Self, chain| {
                !check.heals || check.is_alive(chain)
            }),
        ]
    }
}

/// Violated property and the events that lead to it.
pub(super) struct Counterexample {
    pub(super) what: &'static str,
    pub(super) how: String,
}

impl Check {
    /// Searches all states with two threads and prints their number.
    pub(super) fn search(&self) -> Option<Counterexample> {
        let began = Instant::now();
        let checker = self.clone().checker().threads(2);
        let checker = checker.finish_when(HasDiscoveries::Any).spawn_bfs().join();
        let Self {
            rule,
            cuts,
            proposals,
            reboots,
            losses,
            heals,
            ..
        } = self;
        println!(
            "{} relays, {rule:?}: {cuts} cuts, {proposals} proposals, {reboots} reboots, {losses} without memory, heals: {heals}: \
             {} states, depth {}, {:.1} s",
            self.members.len(),
            checker.unique_state_count(),
            checker.max_depth(),
            began.elapsed().as_secs_f32(),
        );
        let (what, path) = checker.discoveries().into_iter().next()?;
        let steps = path.into_vec().into_iter();
        let steps: Vec<String> = steps
            .map(|(chain, happens)| {
                let Chain { parts, agreed, .. } = chain;
                format!("{parts:?} agreed: {agreed:?}\n  {happens:?}\n")
            })
            .collect();
        let how = steps.concat();
        println!("it does not hold that {what}:\n{how}");
        Some(Counterexample { what, how })
    }

    pub(super) fn holds(&self) {
        assert!(self.search().is_none());
    }
}
