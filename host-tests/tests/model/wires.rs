//! Which frames are in flight, and what the bytes that arrive must be counted as.

use std::collections::VecDeque;

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::wire::message::Message;
use uav_relay::{Duration, Instant, Port};

use super::seal::Seal;

/// From the moment a frame is handed to its line to the moment it arrives, where nothing is wrong.
pub(crate) const FLIGHT: Duration = Duration::from_millis(5);

/// The most frames in flight on one line: what is sent beyond that is lost.
const ROOM: usize = 12;

/// Frames that an attacker remembers of a line.
const RECORDED: usize = 64;

/// A frame in flight.
#[derive(Clone, Debug)]
pub(crate) struct Flying {
    pub(crate) bytes: Vec<u8>,
    pub(crate) due: Instant,
    pub(crate) seal: Seal,
}

/// One direction of a link.
#[derive(Debug, Default)]
struct Line {
    flying: VecDeque<Flying>,
    /// Frames that are held up: the others pass them by.
    late: Vec<Flying>,
    /// What has arrived since the last delimiter.
    begun: Vec<u8>,
    /// What has been sent, the newest last.
    recorded: VecDeque<Flying>,
}

/// Frames that a receiver has seen the ends of.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ended {
    /// As they were sent.
    pub(crate) intact: u32,
    /// Anything else that is not empty.
    pub(crate) broken: u32,
}

/// The links of a chain: link `k` is between relays `k` and `k + 1`, counted from 0; line `2 k` goes downstream on it.
#[derive(Debug)]
pub(crate) struct Wires {
    lines: Vec<Line>,
    cut: Vec<bool>,
}

/// One pass of one view of the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Pass {
    pub(crate) number: u16,
    /// The digest of the mission, and the mark of the view more.
    pub(crate) digest: u16,
    /// Whether it is one of Algorithm 2.
    pub(crate) moves: bool,
    /// Whether it is one that some relays have been asked before, or of places chosen by what they said.
    pub(crate) follows: bool,
}

/// The message in a frame; a handshake is none.
pub(crate) fn message(frame: &[u8]) -> Option<Message> {
    let mut deframer = Deframer::new();
    for &byte in frame {
        if let Some(Ok(plain)) = deframer.push(byte) {
            return frame::decode(plain).ok().map(|(_, message)| message);
        }
    }
    None
}

/// The pass that a frame hands onward, if that is what it does.
pub(crate) fn pass(frame: &[u8]) -> Option<Pass> {
    let message = message(frame)?;
    let number = match &message {
        Message::Sweep(sweep) => sweep.number,
        Message::Gather(roster) => roster.number,
        Message::Token(token) => token.number,
        _ => return None,
    };
    Some(Pass {
        number,
        digest: message.mission()?,
        moves: matches!(message, Message::Token(_)),
        follows: match &message {
            Message::Gather(roster) => roster.after > 0,
            Message::Sweep(sweep) => sweep.chosen,
            _ => false,
        },
    })
}

/// Where a line ends: the relay, and its port.
pub(crate) fn end(line: usize) -> (usize, Port) {
    if line.is_multiple_of(2) {
        (line / 2 + 1, Port::Upstream)
    } else {
        (line / 2, Port::Downstream)
    }
}

impl Wires {
    pub(crate) fn new(relays: usize) -> Self {
        let links = relays - 1;
        Self {
            lines: (0..2 * links).map(|_| Line::default()).collect(),
            cut: vec![false; links],
        }
    }

    /// Relay `from` hands a frame to its line.
    pub(crate) fn send(&mut self, from: usize, port: Port, frame: Flying) {
        let line = match port {
            Port::Upstream => 2 * from - 1,
            _ => 2 * from,
        };
        let Line {
            flying, recorded, ..
        } = &mut self.lines[line];
        if recorded.len() >= RECORDED {
            recorded.pop_front();
        }
        recorded.push_back(frame.clone());
        if !self.cut[line / 2] && flying.len() < ROOM {
            flying.push_back(frame);
        }
    }

    /// A frame that was sent on a line.
    pub(crate) fn recorded(&self, line: usize, which: u8) -> Option<Flying> {
        let recorded = &self.lines[line].recorded;
        let at = usize::from(which) % recorded.len().max(1);
        recorded.get(at).cloned()
    }

    /// One of the lines that have a frame in flight.
    pub(crate) fn pick(&self, pick: u8) -> Option<usize> {
        let busy: Vec<usize> = (0..self.lines.len())
            .filter(|&line| !self.lines[line].flying.is_empty())
            .collect();
        busy.get(usize::from(pick) % busy.len().max(1)).copied()
    }

    /// Takes the next frame off a line, or that so many behind it, as far as there are any.
    pub(crate) fn take(&mut self, line: usize, behind: u8) -> Option<Flying> {
        let flying = &mut self.lines[line].flying;
        let last = flying.len().checked_sub(1)?;
        flying.remove(usize::from(behind).min(last))
    }

    /// Bytes of a frame that was sent as `whole` arrive at the end of a line.
    pub(crate) fn arrive(&mut self, line: usize, bytes: &[u8], whole: &[u8]) -> Ended {
        let begun = &mut self.lines[line].begun;
        let mut ended = Ended::default();
        for &byte in bytes {
            begun.push(byte);
            if byte == 0 {
                ended.intact += u32::from(begun == whole);
                ended.broken += u32::from(begun != whole && begun.len() > 1);
                begun.clear();
            }
        }
        ended
    }

    /// Relay `at` is switched on: what had begun to arrive is forgotten.
    pub(crate) fn forget(&mut self, at: usize) {
        for (number, line) in self.lines.iter_mut().enumerate() {
            if end(number).0 == at {
                line.begun.clear();
            }
        }
    }

    /// Cuts a link: what was in flight is lost but for what is given back, the next frame of each of its lines.
    pub(crate) fn cut(&mut self, link: usize) -> [(usize, Option<Flying>); 2] {
        self.cut[link] = true;
        [2 * link, 2 * link + 1].map(|line| {
            let Line { flying, late, .. } = &mut self.lines[line];
            let next = flying.pop_front();
            flying.clear();
            late.clear();
            (line, next)
        })
    }

    pub(crate) fn join(&mut self, link: usize) {
        self.cut[link] = false;
    }

    pub(crate) fn links(&self) -> usize {
        self.cut.len()
    }

    /// Holds the next frame of a line up until `due`, and lets the others pass.
    pub(crate) fn delay(&mut self, line: usize, due: Instant) {
        let Line { flying, late, .. } = &mut self.lines[line];
        late.extend(flying.pop_front().map(|frame| Flying { due, ..frame }));
    }

    /// What has been held up until `now` goes on its way, ahead of what has been sent since.
    pub(crate) fn hurry(&mut self, now: Instant) {
        for Line { flying, late, .. } in &mut self.lines {
            let due = late.extract_if(.., |frame| frame.due <= now);
            due.for_each(|frame| flying.push_front(frame));
        }
    }

    /// Nothing is held up any more.
    pub(crate) fn hurry_all(&mut self, now: Instant) {
        let late = self.lines.iter_mut().flat_map(|line| &mut line.late);
        late.for_each(|frame| frame.due = now);
        self.hurry(now);
    }

    /// When the next frame arrives where nothing is wrong, and on which line.
    pub(crate) fn next(&self) -> Option<(Instant, usize)> {
        let lines = self.lines.iter().zip(0..);
        let coming = lines.flat_map(|(line, number)| {
            let frames = line.flying.front().into_iter().chain(&line.late);
            frames.map(move |frame| (frame.due, number))
        });
        coming.min()
    }
}
