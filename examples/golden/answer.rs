//! What the golden image answers, byte by byte, on the target and on the host alike.

use uav_relay::FrameBuf;
use uav_relay::optimiser::verdict::Verdict;
use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::{self, FrameError, MAX_FRAME};
use uav_relay::wire::message::{Answer, Message, MessageError};

/// What it says once it can hear.
pub const READY: &[u8] = b"ready\0";

/// Answers what it hears: a good frame with itself, decoded and encoded again, and behind a sweep a verdict whose slacks are
/// the sweep's targets, with a word about own profiles that is the sweep's about places chosen; a bad frame with a digit that says why, and a delimiter.
pub struct Answerer {
    deframer: Deframer,
}

impl Answerer {
    /// Has heard nothing yet.
    pub const fn new() -> Self {
        Self {
            deframer: Deframer::new(),
        }
    }

    /// Hears `byte`, and sends the answer if that was the last one of a frame.
    pub fn hear(&mut self, byte: u8, mut send: impl FnMut(&[u8])) {
        let decoded = match self.deframer.push(byte) {
            None => return,
            Some(Err(DeframeError::Oversized)) => return send(b"1\0"),
            Some(Err(DeframeError::Truncated)) => return send(b"2\0"),
            Some(Err(_)) => return send(b"9\0"),
            Some(Ok(plain)) => frame::decode(plain),
        };
        let (header, message) = match decoded {
            Ok(decoded) => decoded,
            Err(FrameError::Short) => return send(b"3\0"),
            Err(FrameError::Crc) => return send(b"4\0"),
            Err(FrameError::Version) => return send(b"5\0"),
            Err(FrameError::Message(MessageError::Encoding)) => return send(b"6\0"),
            Err(FrameError::Message(MessageError::Value)) => return send(b"7\0"),
            Err(_) => return send(b"8\0"),
        };
        let mut buffer: FrameBuf = [0; MAX_FRAME];
        let mut say = |message: &Message| {
            let len = frame::encode(header, message, &mut buffer);
            send(buffer.get(..len).unwrap_or_default());
        };
        say(&message);
        if let Message::Sweep(sweep) = message {
            say(&Message::Verdict(Answer {
                number: sweep.number,
                mission: sweep.mission,
                verdict: Verdict {
                    commit: None,
                    slacks: sweep.ladder.targets(),
                },
                own: sweep.chosen,
                stand: None,
            }));
        }
    }
}
