//! Whole chain for one target: reaches from the leader to the last relay, and required positions on the way back.

use super::pass::{self, Behind, Link};
use super::spacing::Stand;
use crate::mission::{Heading, Mission, Profile};

pub(crate) struct Walk<'a, F> {
    pub(crate) mission: &'a Mission,
    pub(crate) target: f32,
    pub(crate) plain: bool,
    pub(crate) profile_of: &'a F,
}

impl<F: Fn(u16) -> Profile> Walk<'_, F> {
    pub(crate) fn link(&self, index: u16) -> Link<'_> {
        let before = before(self.mission, index);
        Link {
            mission: self.mission,
            behind: before.map(|index| Behind::of((self.profile_of)(index))),
            index,
            own: (self.profile_of)(index).on_line(),
            measured_per_w: None,
            plain: self.plain,
            end_m: None,
        }
    }

    /// Computes the reaches of all relays; returns the final slack and the last relay's position.
    pub(crate) fn ends(&self, mut visit: impl FnMut(u16, f32)) -> Option<(f32, f32)> {
        let mut from_m = pass::origin(self.mission);
        let mut at = self.mission.leader();
        loop {
            let link = self.link(at);
            from_m = link.reach(self.target, from_m)?;
            visit(at, from_m);
            let Some(next) = self.mission.after(at) else {
                return link.ending(self.target, from_m);
            };
            at = next;
        }
    }

    /// Returns true if the chain closes, on a plain pass or with required positions that all relays can take.
    pub(crate) fn is_met(&self) -> bool {
        let closes = |chain: &Self| chain.ends(|_, _| {}).is_some_and(|(slack, _)| slack >= 0.0);
        closes(self)
            && (closes(&Self {
                plain: true,
                ..*self
            }) || self.place(0).is_some())
    }

    /// Returns the position of relay `index` if no relay has to hold back; 0 for any relay.
    fn at_reach(&self, index: u16) -> Option<f32> {
        let plain = Self {
            plain: true,
            ..*self
        };
        let (mut from_m, mut at) = (pass::origin(self.mission), self.mission.leader());
        let mut place = None;
        loop {
            let reach = self.link(at).reach(self.target, from_m)?;
            let same = plain.link(at).reach(self.target, from_m)?.to_bits() == reach.to_bits();
            if !same {
                return None;
            }
            from_m = reach;
            if at == index || index == 0 {
                place = Some(reach);
            }
            let Some(next) = self.mission.after(at) else {
                let (_, end) = self.link(at).ending(self.target, reach)?;
                return place.filter(|_| end.to_bits() == reach.to_bits());
            };
            at = next;
        }
    }

    /// Returns the reach of relay `index`, or the start of the pass for `None`.
    fn reach(&self, index: Option<u16>) -> Option<f32> {
        let mut from_m = pass::origin(self.mission);
        let Some(index) = index else {
            return Some(from_m);
        };
        let mut at = self.mission.leader();
        loop {
            from_m = self.link(at).reach(self.target, from_m)?;
            if at == index {
                return Some(from_m);
            }
            at = self.mission.after(at)?;
        }
    }

    /// Returns the x of relay `index`, m; `None` if a relay cannot take its required position. For an `index` of no relay, some
    /// x.
    pub(crate) fn place(&self, index: u16) -> Option<f32> {
        if self.plain && index > 0 {
            return self.reach(Some(index));
        }
        if let Some(place) = self.at_reach(index) {
            return Some(place);
        }
        let mut at = match self.mission.heading() {
            Heading::TowardRx => self.mission.relays(),
            Heading::TowardTx => 1,
        };
        let mut place = self.link(at).ending(self.target, self.reach(Some(at))?)?.1;
        loop {
            if at == index {
                return Some(place);
            }
            let link = self.link(at);
            let before = before(self.mission, at);
            let from_m = self.reach(before)?;
            place = match link.stand(self.target, from_m, place)? {
                Stand::AtReach => from_m,
                Stand::At(x_m) => x_m,
            };
            let Some(before) = before else {
                return Some(place);
            };
            at = before;
        }
    }
}

pub(crate) fn before(mission: &Mission, index: u16) -> Option<u16> {
    match mission.heading() {
        Heading::TowardRx => index.checked_sub(1).filter(|before| *before > 0),
        Heading::TowardTx => (index < mission.relays()).then(|| index.saturating_add(1)),
    }
}
