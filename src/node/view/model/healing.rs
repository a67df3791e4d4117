//! Liveness property: a chain settles once its links are restored.

#![allow(clippy::cast_possible_truncation, reason = "chains of a few relays")]

use super::chain::{Chain, Unit};
use super::check::Check;
use crate::node::circulation::Stage;
use crate::view::ViewId;

/// Maximum number of proposals that a healed chain needs.
pub(super) const MOST: u8 = 3;

impl Check {
    /// Delivers all frames to the relays of `there` until nothing changes any more.
    pub(super) fn drain(&self, chain: &mut Chain, there: u8) {
        loop {
            let before = chain.clone();
            for at in (0..chain.units.len()).filter(|at| there >> at & 1 == 1) {
                self.end(chain, at);
                self.repeat(chain, at);
                Self::pass(chain, at);
            }
            for frame in before.air.clone() {
                self.arrive(chain, &frame);
            }
            if *chain == before {
                return;
            }
        }
    }

    /// Returns true if the relays of `there` are a quorum of the newest view that they know. They must also be a quorum of all
    /// views decided on since.
    pub(super) fn is_quorum(chain: &Chain, there: u8) -> bool {
        let known = |at: &usize| there >> at & 1 == 1;
        let agreed = (0..chain.units.len()).filter(known);
        let agreed = agreed.map(|at| chain.units[at].change.electorate.agreed().id);
        let newest = agreed.max().unwrap_or(ViewId::LOADED);
        let has_most = |members: u8, proposer: u16| {
            let has_proposer = there & members & 1 << (proposer - 1) != 0;
            2 * (there & members).count_ones() + u32::from(has_proposer) > members.count_ones()
        };
        let all = ((1_u16 << chain.units.len()) - 1) as u8;
        (newest > ViewId::LOADED || has_most(all, 1))
            && chain.decrees.iter().all(|decree| {
                decree.view.0 < newest || has_most(decree.members, decree.view.0.proposer())
            })
    }

    /// Returns the number of proposals until the relays of `there` are in one view. It is a view of them all, and they know it to
    /// be agreed on. Links between these relays are restored, all others are cut. Without a quorum the number is 0; `None` if
    /// [`MOST`] are not enough.
    pub(super) fn settles(&self, chain: &Chain, there: u8, keeps_air: bool) -> Option<u8> {
        let mut chain = chain.clone();
        for (part, at) in chain.parts.iter_mut().zip(0..) {
            *part = if there >> at & 1 == 1 { 0 } else { at + 1 };
        }
        if !keeps_air {
            chain.air.clear();
        }
        let first = there.trailing_zeros() as usize;
        self.drain(&mut chain, there);
        if !Self::is_quorum(&chain, there) {
            return Some(0);
        }
        for proposals in 0..=MOST {
            let agreed = chain.units[first].change.electorate.agreed();
            let settled = (0..chain.units.len())
                .filter(|at| there >> at & 1 == 1)
                .all(|at| {
                    let Unit { change, flies } = &chain.units[at];
                    let knows = change.electorate.agreed() == agreed && change.electorate.member;
                    knows
                        && change.circulation.stage() != Stage::Outstanding
                        && flies.0 == agreed.id
                });
            if settled && u32::from(agreed.relays) == there.count_ones() {
                return Some(proposals);
            }
            chain.air.clear();
            self.propose(&mut chain, first);
            self.drain(&mut chain, there);
        }
        None
    }

    /// Returns true if every set of relays that is a quorum settles.
    pub(super) fn is_alive(&self, chain: &Chain) -> bool {
        let all = ((1_u16 << chain.units.len()) - 1) as u8;
        (1..=all).all(|there| {
            [true, false]
                .iter()
                .all(|keeps_air| self.settles(chain, there, *keeps_air).is_some())
        })
    }
}
