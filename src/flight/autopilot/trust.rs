//! Whom the link believes: anybody, or with a key those that sign with it.
//!
//! A link with a key takes what is signed with it and is new, and signs what it says. It takes no other, but RADIO_STATUS: a SiK radio
//! cannot sign. An autopilot with a key ignores whoever has none, in silence, so the firmware is told of what does not fit, each kind
//! once: three heartbeats of an autopilot in a row tell that it is no accident.

use super::vehicle::AUTOPILOT;
use super::vehicle::Kind;
use crate::flight::mavlink::incoming::{Incoming, Parser, Received};
use crate::flight::mavlink::outgoing::FrameBytes;
#[cfg(feature = "mavlink-signing")]
use crate::flight::mavlink::signing::{Flaw, Signing};
use crate::time::Instant;

/// So many heartbeats in a row are no accident.
const IN_A_ROW: u8 = 3;

/// Why an autopilot and the link do not believe each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Mistrust {
    /// The autopilot signs, the link has no key, and no request of the link was answered: the autopilot seems to ignore what is not signed.
    NoKey,
    /// The autopilot signs, the link has no key, and the autopilot answers the link's requests all the same.
    SignsOnly,
    /// The link has a key, and the autopilot does not sign: it is not heard.
    Unsigned,
    /// They have different keys.
    OtherKey,
    /// The autopilot's frames are of the past: its clock has gone back, or somebody plays what was recorded.
    Old,
}

impl Mistrust {
    const ALL: [Self; 4] = [Self::NoKey, Self::Unsigned, Self::OtherKey, Self::Old];

    /// A bit of its own.
    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

#[cfg(feature = "mavlink-signing")]
impl From<Flaw> for Mistrust {
    fn from(flaw: Flaw) -> Self {
        match flaw {
            Flaw::Unsigned => Self::Unsigned,
            Flaw::Key => Self::OtherKey,
            Flaw::Old => Self::Old,
        }
    }
}

/// The key, and what came that does not fit.
#[derive(Clone, Debug, Default)]
pub(super) struct Trust {
    #[cfg(feature = "mavlink-signing")]
    signing: Option<Signing>,
    refused: u32,
    /// What was wrong with an autopilot's last heartbeat, and with how many in a row.
    row: Option<(Mistrust, u8)>,
    /// Bits of what is to be told, and of what has been found.
    due: u8,
    found: u8,
}

impl Trust {
    /// The next message of what has come that is to be taken.
    pub(super) fn next_received(&mut self, now: Instant, parser: &mut Parser) -> Option<Received> {
        loop {
            let taken = parser.next_frame(|received, frame| {
                self.takes(now, &received, frame).then_some(received)
            })?;
            if taken.is_some() {
                return taken;
            }
        }
    }

    /// Whether a frame counts.
    fn takes(&mut self, now: Instant, received: &Received, frame: &[u8]) -> bool {
        let (takes, wrong) = self.judge(now, received, frame);
        if !takes {
            self.refused = self.refused.saturating_add(1);
        }
        if is_heartbeat(received) {
            self.row = wrong.map(|wrong| match self.row {
                Some((before, times)) if before == wrong => (wrong, times.saturating_add(1)),
                _ => (wrong, 1),
            });
            if let Some((wrong, IN_A_ROW..)) = self.row {
                self.due |= wrong.bit() & !self.found;
                self.found |= wrong.bit();
            }
        }
        takes
    }

    #[cfg(feature = "mavlink-signing")]
    fn judge(
        &mut self,
        now: Instant,
        received: &Received,
        frame: &[u8],
    ) -> (bool, Option<Mistrust>) {
        let Some(signing) = &mut self.signing else {
            return (true, no_key(received));
        };
        match received.message {
            // It says nothing, or comes from what cannot sign.
            None | Some(Incoming::RadioStatus { .. }) => (true, None),
            Some(_) => match signing.check(now, received, frame) {
                Ok(()) => (true, None),
                Err(flaw) => (false, Some(flaw.into())),
            },
        }
    }

    #[cfg(not(feature = "mavlink-signing"))]
    #[expect(clippy::unused_self, reason = "there is no key")]
    fn judge(&self, _: Instant, received: &Received, _: &[u8]) -> (bool, Option<Mistrust>) {
        (true, no_key(received))
    }

    /// With a key from now on.
    #[cfg(feature = "mavlink-signing")]
    pub(super) const fn sign_with(&mut self, signing: Signing) {
        self.signing = Some(signing);
    }

    /// How many frames were not taken.
    pub(super) const fn refused(&self) -> u32 {
        self.refused
    }

    /// The frame as it is to be sent.
    pub(super) fn sign(&mut self, now: Instant, frame: FrameBytes) -> FrameBytes {
        #[cfg(feature = "mavlink-signing")]
        if let Some(signing) = &mut self.signing {
            return signing.sign(now, frame);
        }
        #[cfg(not(feature = "mavlink-signing"))]
        let _ = (self, now);
        frame
    }

    /// Returns what the firmware is to be told next. `hears` says whether the autopilot answers requests, once that is known.
    pub(super) fn take_event(&mut self, hears: Option<bool>) -> Option<Mistrust> {
        let is_known = |it: &Mistrust| *it != Mistrust::NoKey || hears.is_some();
        let mistrust = Mistrust::ALL
            .into_iter()
            .find(|it| self.due & it.bit() != 0 && is_known(it))?;
        self.due &= !mistrust.bit();
        Some(match mistrust {
            Mistrust::NoKey if hears == Some(true) => Mistrust::SignsOnly,
            other => other,
        })
    }
}

fn no_key(received: &Received) -> Option<Mistrust> {
    received.is_signed.then_some(Mistrust::NoKey)
}

/// Whether an autopilot says that it is there.
fn is_heartbeat(received: &Received) -> bool {
    let of_autopilot = |message| matches!(message, Incoming::Heartbeat { kind, autopilot, .. } if Kind::of(autopilot, kind).is_some());
    received.from.component == AUTOPILOT && received.message.is_some_and(of_autopilot)
}
