//! One relay's share of the joint method by messages, where relays hold what the others do not know.
//!
//! A course goes from the leader to the last relay with a few trials, each of a target and of a part of the step; every relay works out where
//! it is in each of them. The last relay says which one is gone by, and on the way back every relay works out its next step.

use super::link::{Room, Site, minus, tail, triple};
use super::outlook::Outlook;
use super::policy::Policy;
use super::trial::{Bar, SHARES, Trial, Trials};
use crate::mission::Mission;
use crate::place::{CrossSection, Placement};
use crate::sir::Sender;

/// A relay on a course.
#[derive(Clone, Debug)]
pub(crate) struct Coursing {
    pub(crate) bar: Bar,
    /// What the sender says, and where this relay is then.
    pub(crate) told: Trials,
    pub(crate) own: Trials,
    /// The sender's power, W; none of Tx.
    pub(crate) power_in_w: Option<f32>,
    /// The target, the sender's place and its own in the trial that was gone by last; none before the first course.
    nominal: Option<(f32, Placement, Placement)>,
    policy: Policy,
    /// What came of the last course, as the relay before is to know it: the trial, the slack at Rx, m, and its outlook.
    pub(crate) worth: Option<(Option<u8>, f32, Outlook)>,
}

/// What a relay is on a course.
#[derive(Clone, Copy)]
pub(crate) struct Courser<'a> {
    pub(crate) mission: &'a Mission,
    /// What its power is worth, and that of the relay or of Tx before it; across the line the sender is where the trial has it.
    pub(crate) power_w: f32,
    pub(crate) gain_in: crate::power_ratio::PowerRatio,
    pub(crate) first: bool,
    pub(crate) room: Room,
}

impl<'a> Courser<'a> {
    fn link(&self, from: Placement) -> Option<Site<'a>> {
        let sender = Sender {
            at: from.cross_section(),
            gain: self.gain_in,
        };
        let interferer = self.mission.interferer()?;
        Some(Site::new(
            self.mission,
            interferer,
            sender,
            self.first,
            self.room,
        ))
    }

    /// The slack at Rx of a trial of the last relay, m, and its outlook.
    fn tail(&self, target: f32, at: Placement) -> (f32, Outlook) {
        tail(self.mission, self.power_w, self.room, target, at)
    }
}

impl Coursing {
    pub(crate) const fn new(bar: Bar) -> Self {
        Self {
            bar,
            told: Trials::new(),
            own: Trials::new(),
            power_in_w: None,
            nominal: None,
            policy: Policy::NONE,
            worth: None,
        }
    }

    /// Where this relay is in the trials of a new course, for as many as it can take part in; at first it is at `wanted`.
    pub(crate) fn take(
        &mut self,
        relay: Courser<'_>,
        bar: Bar,
        told: &Trials,
        wanted: CrossSection,
    ) {
        self.bar = bar;
        self.told.clone_from(told);
        self.own.clear();
        for (trial, share) in told.iter().zip(SHARES) {
            let Some(own) = self.attempt(relay, *trial, share, wanted) else {
                break;
            };
            _ = self.own.push(own);
        }
    }

    fn attempt(
        &self,
        relay: Courser<'_>,
        told: Trial,
        share: f32,
        wanted: CrossSection,
    ) -> Option<Trial> {
        let from = told.place;
        let link = relay.link(from)?;
        let wanted = match self.nominal {
            None => wanted,
            Some((_, before, own)) => {
                let change = minus(triple(from), triple(before));
                link.wanted(told.target, from, own, &self.policy, share, change)
            }
        };
        let place = link.at(told.target, from.x_m, wanted)?;
        let penalty_m = told.penalty_m + link.penalty(told.target, place);
        // Where there is no room nearer to the line, a hop may end before Tx.
        let sound = place.x_m >= 0.0 && penalty_m <= f32::MAX;
        sound.then_some(Trial {
            penalty_m,
            place,
            ..told
        })
    }

    /// What the last relay says of the trials: the one that is gone by, its slack, m, and what Rx sees; `None` for all if there never was one.
    pub(crate) fn close(&self, relay: Courser<'_>) -> (Option<u8>, f32, Outlook) {
        let mut best: (f32, Option<u8>, f32) = (0.0, None, 0.0);
        for (trial, number) in self.own.iter().zip(0..) {
            let slack = relay.tail(trial.target, trial.place).0 - trial.penalty_m;
            let by = libm::logf(trial.target) - slack / self.bar.slope - self.bar.estimate;
            if by > best.0 {
                best = (by, Some(number), slack);
            }
        }
        let (_, trial, slack_m) = best;
        let (target, at) = match (self.chosen(trial), self.nominal) {
            (Some((told, own)), _) => (told.target, own.place),
            (None, Some((target, _, own))) => (target, own),
            (None, None) => return (None, 0.0, Outlook::default()),
        };
        (trial, slack_m, relay.tail(target, at).1)
    }

    fn chosen(&self, trial: Option<u8>) -> Option<(Trial, Trial)> {
        let at = usize::from(trial?);
        Some((*self.told.get(at)?, *self.own.get(at)?))
    }

    /// Whether this relay can go by `trial`.
    pub(crate) fn has(&self, trial: Option<u8>) -> bool {
        match trial {
            Some(_) => self.chosen(trial).is_some(),
            None => true,
        }
    }

    /// Goes by `trial`, of which the relay after sees `after`: what this one tells the relay before.
    pub(crate) fn conclude(
        &mut self,
        relay: Courser<'_>,
        trial: Option<u8>,
        after: &Outlook,
    ) -> Outlook {
        if let Some((told, own)) = self.chosen(trial) {
            self.nominal = Some((told.target, told.place, own.place));
        }
        let Some((target, from, own)) = self.nominal else {
            return *after;
        };
        let Some(link) = relay.link(from) else {
            return *after;
        };
        let trust = self.bar.trust_after(trial);
        let mut outlook = *after;
        self.policy = link.weigh(target, trust, from, own, &mut outlook);
        outlook
    }

    /// Where this relay is across the line in the trial that was gone by last.
    pub(crate) fn at(&self) -> Option<CrossSection> {
        self.nominal.map(|(_, _, own)| own.cross_section())
    }
}
