//! The run under watch: what has changed, and whether the chain is right.

use super::super::flying::Seen;
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
    /// Begins to watch the relays.
    pub(super) fn begin_watch(&mut self) {
        self.watch = Watch::new(self.members.iter().map(seen).collect());
    }

    /// Sees what has changed.
    pub(super) fn look(&mut self, touched: Touched) {
        if !self.watch.is_on || touched == Touched::Nobody {
            return;
        }
        let range = match touched {
            Touched::One(index) => index..index + 1,
            _ => 0..self.members.len(),
        };
        let mut is_new = touched == Touched::All;
        let fresh = self.members.get(range.clone()).unwrap_or_default();
        for (at, member) in range.zip(fresh) {
            is_new |= self.watch.see(at, seen(member));
        }
        if !is_new {
            return;
        }
        self.watch.go_on(self.now);
        self.watch.take_in(self.now);
        if self.setup.soak.is_some() {
            let is_right = self.is_right();
            self.watch.judge(is_right);
        }
    }

    /// Whether the largest part of the chain holds its optimum; of several that are as large, any one.
    fn is_right(&mut self) -> bool {
        let parts = self.linked_parts();
        let most = parts.iter().map(Vec::len).max().unwrap_or(0);
        let largest = parts.iter().filter(|part| part.len() == most && most > 0);
        for part in largest {
            let seen: Vec<Seen> = part
                .iter()
                .filter_map(|at| self.watch.seen.get(*at).copied())
                .collect();
            let nodes: Vec<u16> = part
                .iter()
                .map(|at| u16::try_from(at + 1).unwrap_or(u16::MAX))
                .collect();
            let places: Vec<_> = seen.iter().map(|one| one.place).collect();
            let version = seen.iter().map(|one| one.version).max().unwrap_or(0);
            let optima = &mut self.watch.optima;
            if optima.is_met(&self.setup, &nodes, version, &places) {
                return true;
            }
        }
        false
    }

    /// The relays that are on, part by part (from 0): in one part are those that links which hear both ways connect.
    fn linked_parts(&self) -> Vec<Vec<usize>> {
        let on = |at: &usize| self.members.get(*at).is_some_and(|it| it.killed.is_none());
        let mut left: Vec<usize> = (0..self.members.len()).filter(on).collect();
        let mut parts = Vec::new();
        while let Some(first) = left.pop() {
            let mut part = vec![first];
            let mut looked = 0;
            while let Some(one) = part.get(looked).copied() {
                looked += 1;
                part.extend(left.extract_if(.., |other| self.are_linked(one, *other)));
            }
            part.sort_unstable();
            parts.push(part);
        }
        parts
    }
}

fn seen(member: &Member) -> Seen {
    Seen::of(&member.relay, member.killed.is_none())
}
