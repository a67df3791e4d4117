//! The run under watch: what has changed, and whether the chain is right.

use super::super::flying::Seen;
use super::super::longest::longest;
use super::super::optima::Run;
use super::super::queue::Happening;
use super::super::watch::Watch;
use super::state::{Chain, Member};

/// Whom a happening may have changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Touched {
    Nobody,
    /// One relay, from 0.
    One(usize),
    /// Anybody, or who hears whom.
    All,
}

impl Touched {
    pub(super) fn by(happening: &Happening, index: usize) -> Self {
        match happening {
            Happening::Bytes { .. } | Happening::Wake => Self::One(index),
            Happening::Air(_) | Happening::Ask | Happening::Heard { .. } => Self::Nobody,
            _ => Self::All,
        }
    }
}

impl Chain {
    /// Begins to watch the relays; `run` finds what they are held against.
    pub(super) fn begin_watch(&mut self, run: Run) {
        let seen = self.members.iter().map(seen).collect();
        self.watch = Some(Watch::new(seen, run));
    }

    /// Sees what has changed.
    pub(super) fn look(&mut self, touched: Touched) {
        if touched == Touched::Nobody {
            return;
        }
        let Some(mut watch) = self.watch.take() else {
            return;
        };
        self.take_in(&mut watch, touched);
        self.watch = Some(watch);
    }

    fn take_in(&self, watch: &mut Watch, touched: Touched) {
        let range = match touched {
            Touched::One(index) => index..index + 1,
            _ => 0..self.members.len(),
        };
        let mut is_new = touched == Touched::All;
        let fresh = self.members.get(range.clone()).unwrap_or_default();
        for (at, member) in range.zip(fresh) {
            is_new |= watch.see(at, seen(member));
        }
        if !is_new {
            return;
        }
        watch.go_on(self.now);
        watch.take_in(self.now);
        if self.setup.soak.is_some() {
            let is_right = self.is_right(watch);
            watch.judge(is_right);
        }
    }

    /// Whether a longest chain that there can be of the relays that are on holds its optimum; of several, any one.
    ///
    /// Where all of those are too few for a quorum nobody may fly, and that counts as wrong like any other time without a chain.
    fn is_right(&self, watch: &mut Watch) -> bool {
        let on = |at: &usize| self.members.get(*at).is_some_and(|it| it.killed.is_none());
        let on: Vec<usize> = (0..self.members.len()).filter(on).collect();
        let links = |one, other| self.are_linked(one, other);
        let holds = |at: usize| {
            let seen = watch.seen.get(at);
            seen.is_some_and(|one| one.place.is_some())
        };
        let (_, chains) = longest(&on, links, holds);
        for chain in chains {
            let seen: Vec<Seen> = chain
                .iter()
                .filter_map(|at| watch.seen.get(*at).copied())
                .collect();
            let nodes: Vec<u16> = chain
                .iter()
                .map(|at| u16::try_from(at + 1).unwrap_or(u16::MAX))
                .collect();
            let places: Vec<_> = seen.iter().map(|one| one.place).collect();
            let version = seen.iter().map(|one| one.version).max().unwrap_or(0);
            if watch.optima.is_met(&self.setup, &nodes, version, &places) {
                return true;
            }
        }
        false
    }
}

fn seen(member: &Member) -> Seen {
    Seen::of(&member.relay, member.killed.is_none())
}
