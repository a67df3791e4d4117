//! Another node that uses this relay's own number, and which of the two stands down.
//!
//! The other one *takes part* if it says a hello that is not fresh, a pass, what comes back of one, or anything of a view. A relay is
//! *settled* if it has held a lease for twice `dead_after`, with no gap as long as that. Then
//!
//! | this relay | what happens | what it does |
//! | --- | --- | --- |
//! | any | a frame under its own number, the first for twice `dead_after` | `Event::IndexTaken` |
//! | holds a lease, or is settled | a frame under its own number | defends it: says a hello to its own number, at most one in a quarter of a second; nothing where frames are signed |
//! | is settled | the other one takes part | goes on |
//! | is not settled | the other one takes part, or did within twice `dead_after` | stands down |
//! | stands down | every `probe_after` | says a hello to its own number, so that the other one knows; nothing where frames are signed |
//! | stands down | the other one takes part | goes on standing down |
//! | stands down | the other one was not heard to for twice `dead_after`, and up to an eighth more by chance | takes part again |
//! | stands down | its firmware says that the other one is gone | takes part again |
//!
//! A relay that stands down says nothing else, takes nothing in and has no set-point. So of two relays with one number the one that was
//! switched on later is silent: before it has a place it has said many frames, and each is answered by one that has it stand down, as with
//! the defence of an address in RFC 5227. Where all of those got lost, it stands down when it hears the first. If both were switched on
//! within twice `dead_after`, both may be silent, until chance has one come back first.
//!
//! *Where frames are signed* most of what goes to others cannot be checked: the tag of a message is over nonces that only its two ends
//! know. What can be is a handshake, since its nonces stand in it. One with the right tag and a larger epoch than this relay's counts as
//! of a node that takes part: it can be no recorded one of this relay, and the neighbours will believe the other one and not this. Anything
//! else may be forged or played again: it raises the event and has nobody stand down, but who stands down goes on with it. So of two
//! relays with one number and two epochs the neighbours take the one with the larger, and the other one stands down once it has no lease.
//!
//! A radio must not hand a relay its own frames: it could not tell them from another's, and would stand down.

use super::lease::Tenure;
use crate::jitter::Jitter;
use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// What a frame under this relay's own number says of its sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Claim {
    /// Nothing that could be trusted.
    #[cfg_attr(
        all(not(feature = "auth"), not(test)),
        expect(dead_code, reason = "everything is trusted where nothing is signed")
    )]
    Unproven,
    /// It is there, and takes part in nothing as far as it says.
    There,
    TakesPart,
    /// Signed, with a larger epoch than this relay's: it counts as one that takes part, and no answer to it could be signed.
    #[cfg_attr(
        all(not(feature = "auth"), not(test)),
        expect(dead_code, reason = "nothing is signed")
    )]
    Ahead,
}

/// The least time from one answer to the next.
const DEFENCE_GAP: Duration = Duration::from_millis(250);

/// What is known of another node of this relay's number.
#[derive(Clone, Debug)]
pub(crate) struct Namesake {
    /// When a frame under this number, or a neighbour's number at both ports, was heard last.
    heard: [Option<Instant>; 2],
    /// When the other one was heard to take part last.
    claimed: Option<Instant>,
    /// Until when this relay stands down, if it does.
    until: Option<Instant>,
    /// When it says so next, or may answer again, and whether it is time to.
    say_at: Instant,
    due: bool,
    jitter: Jitter,
}

/// Of what a number is used twice.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Twice {
    /// This relay's.
    Own,
    /// A neighbour's.
    Neighbour,
}

impl Namesake {
    pub(crate) fn new(seed: u32) -> Self {
        Self {
            heard: [None; 2],
            claimed: None,
            until: None,
            say_at: Instant::ZERO,
            due: false,
            jitter: Jitter::new(seed),
        }
    }

    /// A number is used twice, as heard now; whether that is news.
    pub(crate) fn is_news(&mut self, now: Instant, twice: Twice, settings: &Settings) -> bool {
        let [own, neighbour] = &mut self.heard;
        let heard = match twice {
            Twice::Own => own,
            Twice::Neighbour => neighbour,
        };
        let since = heard.replace(now).map(|heard| now.since(heard));
        since.is_none_or(|since| since > settings.dead_after.times(2))
    }

    /// A frame under this relay's own number; whether it stands down from now on.
    pub(crate) fn hear(
        &mut self,
        now: Instant,
        claim: Claim,
        tenure: Tenure,
        settings: &Settings,
    ) -> bool {
        let counts = match claim {
            Claim::TakesPart | Claim::Ahead => true,
            Claim::Unproven => self.is_claimed(now, settings),
            Claim::There => false,
        };
        if counts {
            self.claimed = Some(now);
        }
        if counts && self.stands_down() {
            self.wait(now, settings);
        }
        let begins = self.review(now, tenure, settings);
        let heard = matches!(claim, Claim::There | Claim::TakesPart);
        if heard && tenure != Tenure::None && !self.stands_down() && self.say_at <= now {
            self.say_at = now + DEFENCE_GAP;
            self.due = true;
        }
        begins
    }

    fn is_claimed(&self, now: Instant, settings: &Settings) -> bool {
        let most = settings.dead_after.times(2);
        self.claimed
            .is_some_and(|claimed| now.since(claimed) <= most)
    }

    fn wait(&mut self, now: Instant, settings: &Settings) {
        self.until = Some(now + self.jitter.spread(settings.dead_after.times(2)));
    }

    /// Whether it stands down from now on: the other one takes part, and this one is not settled.
    pub(crate) fn review(&mut self, now: Instant, tenure: Tenure, settings: &Settings) -> bool {
        let begins =
            tenure != Tenure::Settled && !self.stands_down() && self.is_claimed(now, settings);
        if begins {
            self.wait(now, settings);
            self.say_at = now + settings.probe_after;
            self.due = true;
        }
        begins
    }

    pub(crate) const fn stands_down(&self) -> bool {
        self.until.is_some()
    }

    /// Whether a hello to its own number is due; it is taken for said then.
    pub(crate) const fn take_hello(&mut self) -> bool {
        core::mem::replace(&mut self.due, false)
    }

    /// Whether it takes part again from now on.
    pub(crate) fn handle_timeout(&mut self, now: Instant, settings: &Settings) -> bool {
        if self.say_at <= now {
            self.say_at = now + settings.probe_after;
            self.due = true;
        }
        let over = self.until.is_some_and(|until| until <= now);
        over && self.clear()
    }

    /// The other one is gone; whether it had this relay stand down.
    pub(crate) const fn clear(&mut self) -> bool {
        self.claimed = None;
        self.until.take().is_some()
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        self.until.map(|until| until.min(self.say_at))
    }
}

#[cfg(test)]
mod tests {
    use super::{Claim, Namesake, Settings, Tenure, Twice};
    use crate::time::Instant;

    fn at(seconds: u64) -> Instant {
        Instant::from_millis(1_000 * seconds)
    }

    /// The state table, row by row.
    #[test]
    fn who_is_not_settled_stands_down_before_who_takes_part() {
        let settings = Settings::default();
        for tenure in [Tenure::None, Tenure::Recent, Tenure::Settled] {
            for claim in [
                Claim::Unproven,
                Claim::There,
                Claim::TakesPart,
                Claim::Ahead,
            ] {
                let mut namesake = Namesake::new(1);
                let down = namesake.hear(at(0), claim, tenure, &settings);
                let counts = matches!(claim, Claim::TakesPart | Claim::Ahead);
                assert_eq!(
                    down,
                    counts && tenure != Tenure::Settled,
                    "{claim:?} {tenure:?}"
                );
                assert_eq!(namesake.stands_down(), down);
                let answerable = matches!(claim, Claim::There | Claim::TakesPart);
                let defends = answerable && tenure != Tenure::None && !down;
                assert_eq!(
                    namesake.take_hello(),
                    defends || down,
                    "{claim:?} {tenure:?}"
                );
            }
        }
    }

    #[test]
    fn a_number_is_defended_four_times_a_second_at_most() {
        let settings = Settings::default();
        let mut namesake = Namesake::new(1);
        let mut said = 0;
        for tenth in 0..100 {
            let now = Instant::from_millis(100 * tenth);
            namesake.hear(now, Claim::There, Tenure::Settled, &settings);
            said += u32::from(namesake.take_hello());
        }
        assert_eq!(said, 34, "one in three of those heard every 0.1 s");
    }

    #[test]
    fn it_takes_part_again_once_the_other_was_silent_for_twice_dead_after_or_is_gone() {
        let settings = Settings::default();
        let mut namesake = Namesake::new(1);
        let hear = |namesake: &mut Namesake, seconds, claim| {
            namesake.hear(at(seconds), claim, Tenure::None, &settings)
        };
        assert!(hear(&mut namesake, 0, Claim::TakesPart));
        assert!(
            !hear(&mut namesake, 20, Claim::TakesPart),
            "it does already"
        );
        // A relay that stands down as well keeps nobody down.
        hear(&mut namesake, 40, Claim::There);
        assert!(!namesake.handle_timeout(at(49), &settings) && namesake.take_hello());
        assert!(namesake.handle_timeout(at(55), &settings) && !namesake.stands_down());
        assert!(hear(&mut namesake, 70, Claim::TakesPart));
        assert!(namesake.clear() && !namesake.stands_down() && !namesake.clear());
    }

    #[test]
    fn who_is_settled_no_more_while_the_other_takes_part_stands_down_then() {
        let settings = Settings::default();
        let mut namesake = Namesake::new(1);
        let hear = |namesake: &mut Namesake, seconds, claim, tenure| {
            namesake.hear(at(seconds), claim, tenure, &settings)
        };
        assert!(!hear(&mut namesake, 0, Claim::Unproven, Tenure::None));
        assert!(!hear(&mut namesake, 0, Claim::TakesPart, Tenure::Settled));
        // What cannot be checked begins nothing, but goes on with it.
        assert!(!hear(&mut namesake, 25, Claim::Unproven, Tenure::Settled));
        let mut late = namesake.clone();
        assert!(!late.review(at(56), Tenure::None, &settings));
        assert!(namesake.review(at(54), Tenure::None, &settings));
    }

    #[test]
    fn a_number_used_twice_is_news_once_until_silence() {
        let settings = Settings::default();
        let mut namesake = Namesake::new(1);
        let mut news = |seconds, twice| namesake.is_news(at(seconds), twice, &settings);
        assert!(news(1, Twice::Own) && news(1, Twice::Neighbour));
        assert!(!news(31, Twice::Own) && !news(60, Twice::Own));
        assert!(news(91, Twice::Own) && news(91, Twice::Neighbour));
    }
}
