//! Safety properties of every state.

extern crate std;

use std::vec::Vec;

use super::chain::{Chain, Sized};
use super::check::{Check, Rule};
use crate::view::ViewId;

impl Check {
    /// Returns true if every agreed view follows an agreed view, and no two follow the same one.
    pub(super) fn is_one_chain(chain: &Chain) -> bool {
        let follows = |(id, _): &Sized| {
            let decree = chain.decrees.iter().find(|decree| decree.view.0 == *id);
            decree.map(|decree| decree.follows)
        };
        let mut before: Vec<_> = chain.agreed.iter().map(follows).collect();
        let known = before.iter().all(|view| {
            view.is_some_and(|view| {
                view == ViewId::LOADED || chain.agreed.iter().any(|(id, _)| *id == view)
            })
        });
        before.sort();
        let count = before.len();
        before.dedup();
        known && before.len() == count
    }

    pub(super) fn has_one_size(chain: &Chain) -> bool {
        let twice = |all: &[ViewId]| all.windows(2).any(|pair| pair[0] == pair[1]);
        let decrees: Vec<_> = chain.decrees.iter().map(|decree| decree.view.0).collect();
        let agreed: Vec<_> = chain.agreed.iter().map(|view| view.0).collect();
        !twice(&decrees) && !twice(&agreed)
    }

    /// Returns true if each relay's agreed view was agreed on and has at most as many members as its size.
    pub(super) fn is_known_and_counted(&self, chain: &Chain) -> bool {
        self.rule == Rule::Everybody
            || chain.units.iter().all(|unit| {
                let view = unit.change.electorate.agreed();
                let members = chain.units.iter().filter(|unit| {
                    let electorate = unit.change.electorate;
                    electorate.agreed() == view && electorate.member
                });
                let known =
                    view.id == ViewId::LOADED || chain.agreed.contains(&(view.id, view.relays));
                known && members.count() <= usize::from(view.relays)
            })
    }
}
