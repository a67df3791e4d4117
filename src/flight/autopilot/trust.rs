//! Signature policy of the link. Without a key, all frames are accepted; with a key, only frames signed with that key.
//!
//! A link with a key signs its frames and accepts frames that are new and signed with the key. It also accepts unsigned
//! RADIO_STATUS, because a SiK radio cannot sign. An autopilot with a key ignores unsigned frames silently. So an event
//! reports each kind of mismatch to the firmware once, after three consecutive heartbeats of an autopilot.

use super::state::Kind;
use super::vehicle::AUTOPILOT;
use crate::flight::mavlink::incoming::{Incoming, Parser, Received};
use crate::flight::mavlink::outgoing::FrameBytes;
use crate::flight::mavlink::signing::{Flaw, Signing};
use crate::time::Instant;

/// Number of consecutive heartbeats with the same signature mismatch before the mismatch is reported.
const IN_A_ROW: u8 = 3;

/// Mismatch between the signatures of an autopilot and those of the link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Mistrust {
    /// The autopilot signs, the link has no key, and the autopilot answers no request. The autopilot seems to ignore
    /// unsigned frames.
    NoKey,
    /// The autopilot signs and the link has no key, but the autopilot answers unsigned requests.
    SignsOnly,
    /// The link has a key, and the autopilot does not sign, so its frames are ignored.
    Unsigned,
    /// The autopilot and the link sign with different keys.
    OtherKey,
    /// The autopilot's signed frames are old. Its clock has gone back, or a recording is replayed.
    Old,
}

impl Mistrust {
    const ALL: [Self; 4] = [Self::NoKey, Self::Unsigned, Self::OtherKey, Self::Old];

    /// Returns the bit of this kind of mismatch in a bit mask of kinds.
    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

impl From<Flaw> for Mistrust {
    fn from(flaw: Flaw) -> Self {
        match flaw {
            Flaw::Unsigned => Self::Unsigned,
            Flaw::Key => Self::OtherKey,
            Flaw::Old => Self::Old,
        }
    }
}

/// Signing key of the link, and the signature mismatches of the autopilot.
#[derive(Clone, Debug, Default)]
pub(super) struct Trust {
    signing: Option<Signing>,
    refused: u32,
    /// Signature mismatch of the last heartbeat, and the number of consecutive heartbeats with it. `None` if the last
    /// heartbeat had no mismatch.
    row: Option<(Mistrust, u8)>,
    /// Bit mask of the kinds of mismatch that must be reported.
    due: u8,
    /// Bit mask of the kinds of mismatch found since the start. Each is reported once.
    found: u8,
}

impl Trust {
    /// Returns the next received message that passes the signature check; `None` if there is none.
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

    /// Returns true if the frame is accepted: its signature is valid, or no signature is required.
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
            // The message is not decoded and thus has no effect, or its sender is a radio, which cannot sign.
            None | Some(Incoming::RadioStatus { .. }) => (true, None),
            Some(_) => match signing.check(now, received, frame) {
                Ok(()) => (true, None),
                Err(flaw) => (false, Some(flaw.into())),
            },
        }
    }

    /// Sets the key of `signing`, with which all frames are signed and all received frames are checked.
    pub(super) const fn sign_with(&mut self, signing: Signing) {
        self.signing = Some(signing);
    }

    /// Returns the number of frames rejected because of their signatures.
    pub(super) const fn refused(&self) -> u32 {
        self.refused
    }

    /// Returns `frame`: signed if the link has a key, otherwise unchanged.
    pub(super) fn sign(&mut self, now: Instant, frame: FrameBytes) -> FrameBytes {
        match &mut self.signing {
            Some(signing) => signing.sign(now, frame),
            None => frame,
        }
    }

    /// Returns the next signature mismatch to report; each kind is returned once. `hears` is true if the autopilot
    /// answers requests, and `None` if that is unknown.
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

fn is_heartbeat(received: &Received) -> bool {
    let of_autopilot = |message| matches!(message, Incoming::Heartbeat { kind, autopilot, .. } if Kind::of(autopilot, kind).is_some());
    received.from.component == AUTOPILOT && received.message.is_some_and(of_autopilot)
}
