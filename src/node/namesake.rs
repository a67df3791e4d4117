//! Another node that uses this relay's own number, and which of the two stands down.
//!
//! The other one *takes part* if it says a hello that is not fresh, a pass, what comes back of one, or anything of a view. Then
//!
//! | this relay | hears a frame under its own number | what it does |
//! | --- | --- | --- |
//! | takes part, with a valid lease | any | `Event::IndexTaken`, and goes on |
//! | is fresh, or holds no valid lease | the other one does not take part, as far as it says | `Event::IndexTaken`, and goes on |
//! | is fresh, or holds no valid lease | the other one takes part | `Event::IndexTaken`; stands down |
//! | stands down | any that counts | goes on standing down |
//! | stands down | nothing that counts for twice `dead_after`, and up to an eighth more by chance | takes part again |
//! | stands down | its firmware says that the other one is gone | takes part again |
//!
//! A relay that stands down says nothing, takes nothing in and has no set-point. So of two relays with one number the one that was
//! switched on later is silent; if they were at the same time, both may be, until chance has one come back first.
//!
//! *Where frames are signed* most of what goes to others cannot be checked: the tag of a message is over nonces that only its two ends
//! know. What can be is a handshake, since its nonces stand in it. One with the right tag and a larger epoch than this relay's counts as
//! of a node that takes part: it can be no recorded one of this relay, and the neighbours will believe the other one and not this. Anything
//! else may be forged or played again: it raises the event, and has nobody stand down. Of two relays with one number and two epochs the
//! neighbours take the one with the larger, and the other one stands down once it has no lease any more.
//!
//! A relay's own frame may come back to it from its radio, so one that bears one of the last eight counters is its own.

use crate::jitter::Jitter;
use crate::settings::Settings;
use crate::time::Instant;

/// A frame whose counter is so many before the next one may be this relay's own.
const ECHO: u32 = 8;

/// What a frame under this relay's own number says of its sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Claim {
    /// Nothing that could be trusted.
    Unproven,
    /// It is there, and takes part in nothing as far as it says.
    There,
    TakesPart,
}

/// Whether a frame with that counter may be this relay's own, which sends `next` next.
pub(crate) const fn is_echo(counter: u32, next: u32) -> bool {
    let before = next.wrapping_sub(counter);
    before >= 1 && before <= ECHO
}

/// What is known of another node of this relay's number.
#[derive(Clone, Debug)]
pub(crate) struct Namesake {
    /// When a frame under this number, or a neighbour's number at both ports, was heard last.
    heard: [Option<Instant>; 2],
    /// Until when this relay stands down, if it does.
    until: Option<Instant>,
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
            until: None,
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

    /// A frame under this relay's own number, which `holds` a valid lease or not; whether it stands down from now on.
    pub(crate) fn hear(
        &mut self,
        now: Instant,
        claim: Claim,
        holds: bool,
        settings: &Settings,
    ) -> bool {
        let stood_down = self.stands_down();
        let counts = match claim {
            Claim::Unproven => false,
            Claim::There => stood_down,
            Claim::TakesPart => stood_down || !holds,
        };
        if counts {
            self.until = Some(now + self.jitter.spread(settings.dead_after.times(2)));
        }
        counts && !stood_down
    }

    pub(crate) const fn stands_down(&self) -> bool {
        self.until.is_some()
    }

    /// Whether it takes part again from now on.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> bool {
        let over = self.until.is_some_and(|until| until <= now);
        over && self.clear()
    }

    /// The other one is gone; whether it had this relay stand down.
    pub(crate) const fn clear(&mut self) -> bool {
        self.until.take().is_some()
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.until
    }
}

#[cfg(test)]
mod tests {
    use super::{Claim, Namesake, Settings, Twice, is_echo};
    use crate::time::Instant;

    fn at(seconds: u64) -> Instant {
        Instant::from_millis(1_000 * seconds)
    }

    /// The state table, row by row.
    #[test]
    fn who_has_no_lease_stands_down_before_who_takes_part() {
        let settings = Settings::default();
        for holds in [true, false] {
            for claim in [Claim::Unproven, Claim::There, Claim::TakesPart] {
                let mut namesake = Namesake::new(1);
                let down = namesake.hear(at(0), claim, holds, &settings);
                assert_eq!(down, claim == Claim::TakesPart && !holds, "{claim:?} {holds}");
                assert_eq!(namesake.stands_down(), down);
            }
        }
    }

    #[test]
    fn it_takes_part_again_once_the_other_was_silent_for_twice_dead_after_or_is_gone() {
        let settings = Settings::default();
        let mut namesake = Namesake::new(1);
        assert!(namesake.hear(at(0), Claim::TakesPart, false, &settings));
        assert!(!namesake.hear(at(20), Claim::There, false, &settings), "it does already");
        // What may be forged keeps nobody down.
        namesake.hear(at(40), Claim::Unproven, false, &settings);
        assert!(!namesake.handle_timeout(at(49)));
        assert!(namesake.next_timeout().is_some_and(|until| until >= at(50) && until <= at(65)));
        assert!(namesake.handle_timeout(at(65)) && !namesake.stands_down());
        assert!(namesake.hear(at(70), Claim::TakesPart, false, &settings));
        assert!(namesake.clear() && !namesake.stands_down() && !namesake.clear());
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

    #[test]
    fn a_relay_does_not_take_its_own_frame_for_anothers() {
        assert!(is_echo(7, 8) && is_echo(0, 8) && is_echo(u32::MAX, 0));
        assert!(!is_echo(8, 8) && !is_echo(0, 9) && !is_echo(900, 8));
    }
}
