//! How long a message to a neighbour and its answer take, as the link has shown: the smoothed round trip of RFC 6298.
//!
//! | what came back | what it tells | what is made of it |
//! | --- | --- | --- |
//! | the answer to a question, which bears its number | the round trip | a sample |
//! | that a message has arrived, which was sent again once: the first one is not acknowledged | the round trip | a sample |
//! | the same of one that was sent again more often | that it takes no less than since the last time | a sample if that is longer than usual |
//! | a pulse that was sent once, over so many hops | that it takes no more than one hop's part of that: a relay on the way may have waited for what was lost | a sample if that is shorter than usual |
//!
//! So Karn's rule holds: what may answer one of several is no sample, unless the link is certain to be slower than was known.
//!
//! Of RFC 6298 the smoothed round trip alone is used, and twice that is waited for (RFC 793), not four times what it strays as well. On a
//! channel that is shared and loses frames it strays by more than it takes: chains took up to five times as long to agree.

use crate::time::Duration;

/// The longest that is believed, µs.
const MOST: u32 = 60_000_000;

/// The smoothed round trip, µs; 0 before any.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct RoundTrip(u32);

/// A round trip that was seen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Took {
    Exactly(Duration),
    /// It may be that of a message sent earlier.
    AtLeast(Duration),
    /// Somebody may have waited on the way.
    AtMost(Duration),
}

impl RoundTrip {
    /// Nothing was seen yet.
    pub(crate) const NONE: Self = Self(0);

    /// One more round trip.
    pub(crate) fn see(&mut self, took: Took) {
        let (Took::Exactly(span) | Took::AtLeast(span) | Took::AtMost(span)) = took;
        let span = u32::try_from(span.as_micros()).unwrap_or(MOST).min(MOST);
        let news = match took {
            Took::Exactly(_) => true,
            Took::AtLeast(_) => span > self.0,
            Took::AtMost(_) => span < self.0,
        };
        if news {
            let usual = if self.0 == 0 { span } else { self.0 };
            self.0 = usual - usual / 8 + span / 8;
        }
    }

    /// How long it takes usually; zero if that is not known.
    pub(crate) fn smoothed(self) -> Duration {
        Duration::from_micros(u64::from(self.0))
    }

    /// How long one hop is to be waited for: half of it, `least` at least.
    pub(crate) fn hop_time(self, least: Duration) -> Duration {
        Duration::from_micros(u64::from(self.0 / 2)).max(least)
    }
}

#[cfg(test)]
mod tests {
    use super::{MOST, RoundTrip, Took};
    use crate::time::Duration;

    const fn ms(span: u64) -> Duration {
        Duration::from_millis(span)
    }

    #[test]
    fn the_first_sample_is_believed_and_the_others_count_an_eighth() {
        let mut link = RoundTrip::NONE;
        assert_eq!(link.smoothed(), ms(0));
        link.see(Took::AtMost(ms(80)));
        assert_eq!(link, RoundTrip::NONE, "a bound from above is no sample");
        link.see(Took::Exactly(ms(80)));
        assert_eq!(link.smoothed(), ms(80));
        link.see(Took::Exactly(ms(160)));
        assert_eq!(link.smoothed(), ms(90));
        link.see(Took::Exactly(ms(10)));
        assert_eq!(link.smoothed(), ms(80));
    }

    #[test]
    fn a_bound_is_a_sample_only_where_it_tells_something() {
        let mut link = RoundTrip::NONE;
        link.see(Took::AtLeast(ms(80)));
        assert_eq!(link.smoothed(), ms(80));
        link.see(Took::AtLeast(ms(8)));
        link.see(Took::AtMost(ms(800)));
        assert_eq!(link.smoothed(), ms(80));
        link.see(Took::AtLeast(ms(160)));
        assert_eq!(link.smoothed(), ms(90));
        link.see(Took::AtMost(ms(10)));
        assert_eq!(link.smoothed(), ms(80));
    }

    #[test]
    fn a_hop_takes_half_of_it_and_never_less_than_the_setting() {
        let mut link = RoundTrip::NONE;
        assert_eq!(link.hop_time(ms(30)), ms(30));
        link.see(Took::Exactly(ms(50)));
        assert_eq!(link.hop_time(ms(30)), ms(30));
        link = RoundTrip::NONE;
        link.see(Took::Exactly(ms(80)));
        assert_eq!(link.hop_time(ms(30)), ms(40));
    }

    #[test]
    fn nothing_longer_than_a_minute_is_believed() {
        let mut link = RoundTrip::NONE;
        link.see(Took::AtLeast(Duration::from_micros(u64::MAX)));
        assert_eq!(link.smoothed().as_micros(), u64::from(MOST));
    }
}
