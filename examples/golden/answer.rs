//! Answers of the test firmware. They are the same, byte by byte, on the target and on a PC.

use uav_relay::optimiser::pass::Verdict;
use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::{self, FrameError, MAX_FRAME};
use uav_relay::wire::message::{Message, MessageError, SweepVerdict};

/// First bytes that the firmware sends: it is ready to receive frames.
pub const READY: &[u8] = b"ready\0";

/// Generator of the answers to received frames.
///
/// The answer to a valid frame is that frame, decoded and encoded again. After a sweep message (search for positions) a
/// verdict with values of this message follows. The answer to an invalid frame is a digit for the error, and a
/// delimiter.
pub struct Answerer {
    deframer: Deframer,
}

impl Answerer {
    /// Creates an answerer without any received bytes.
    pub const fn new() -> Self {
        Self {
            deframer: Deframer::new(),
        }
    }

    /// Processes a received `byte`. If it completes a frame, calls `send` with the answer.
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
        let mut buffer = [0; MAX_FRAME];
        let mut say = |message: &Message| {
            let len = frame::encode(header, message, &mut buffer);
            send(buffer.get(..len).unwrap_or_default());
        };
        say(&message);
        if let Message::Sweep(sweep) = message {
            say(&Message::Verdict(SweepVerdict {
                number: sweep.number,
                view_digest: sweep.view_digest,
                verdict: Verdict {
                    commit: None,
                    slacks: sweep.ladder.targets(),
                },
                own: sweep.chosen,
                required_x_m: None,
            }));
        }
    }
}
