//! Updates of the run's statistics after each event.

use super::super::flying::Seen;
use super::super::longest::longest;
use super::super::optima::Run;
use super::super::queue::QueuedEvent;
use super::super::watch::Watch;
use super::state::{Chain, Member};

/// Relays that an event may have changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Touched {
    Nobody,
    /// Index of a single relay, from 0.
    One(usize),
    /// Change that may affect any relay, or the connectivity.
    All,
}

impl Touched {
    pub(super) fn by(happening: &QueuedEvent, index: usize) -> Self {
        match happening {
            QueuedEvent::Bytes { .. } | QueuedEvent::Wake => Self::One(index),
            QueuedEvent::Air(_) | QueuedEvent::Ask | QueuedEvent::Heard { .. } => Self::Nobody,
            _ => Self::All,
        }
    }
}

impl Chain {
    /// Starts the statistics; `run` computes the reference positions.
    pub(super) fn begin_watch(&mut self, run: Run) {
        let seen = self.members.iter().map(seen).collect();
        self.watch = Some(Watch::new(seen, run));
    }

    /// Updates the statistics after an event.
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

    /// Returns true if at least one of the longest possible chains of the living relays holds its optimum.
    ///
    /// If all of these lack a quorum, no relay may hold a position, which counts as wrong.
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
