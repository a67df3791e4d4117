//! Frames in flight, and the expected counts for received bytes.

use std::collections::VecDeque;

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::wire::message::Message;
use uav_relay::{Duration, Instant, Port};

use super::accepted_frames::EpochPair;

/// Time that a frame takes to a neighbour without faults.
pub(crate) const FLIGHT: Duration = Duration::from_millis(5);

/// Maximum number of frames in transit in one direction of a link; further frames are lost.
const ROOM: usize = 12;

/// Number of latest frames in each direction of a link that a simulated attacker has recorded.
const RECORDED: usize = 64;

#[derive(Clone, Debug)]
pub(crate) struct Flying {
    pub(crate) bytes: Vec<u8>,
    pub(crate) due: Instant,
    pub(crate) seal: EpochPair,
}

#[derive(Debug, Default)]
struct Line {
    flying: VecDeque<Flying>,
    /// Frames that a simulated fault delays. Frames sent later may arrive before them.
    late: Vec<Flying>,
    /// Bytes that the receiver got since the last delimiter.
    begun: Vec<u8>,
    /// Frames that the attacker has recorded, newest last.
    recorded: VecDeque<Flying>,
}

/// Counts of the frames whose end a receiver got: intact and broken frames.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ended {
    /// Number of frames that arrived unchanged over the wires.
    pub(crate) intact: u32,
    /// Number of frames that arrived changed or incomplete; empty frames do not count.
    pub(crate) broken: u32,
}

/// Links of a chain. Link k connects relays k and k + 1 (from 0). Its two directions are called lines: line 2 k is
/// downstream, and line 2 k + 1 is upstream.
#[derive(Debug)]
pub(crate) struct Wires {
    lines: Vec<Line>,
    cut: Vec<bool>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Pass {
    pub(crate) number: u16,
    /// Sum of the mission's digest and a number that depends on the membership view.
    pub(crate) digest: u16,
    /// True if Algorithm 2 moves relays by this pass (a message that travels along the chain).
    pub(crate) moves: bool,
    /// True if the relays need data for this pass that earlier messages along the chain have collected.
    pub(crate) follows: bool,
}

/// Returns the message in a frame; `None` for a handshake or a damaged frame.
pub(crate) fn message(frame: &[u8]) -> Option<Message> {
    let mut deframer = Deframer::new();
    for &byte in frame {
        if let Some(Ok(plain)) = deframer.push(byte) {
            return frame::decode(plain).ok().map(|(_, message)| message);
        }
    }
    None
}

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
        digest: message.digest()?,
        moves: matches!(message, Message::Token(_)),
        follows: match &message {
            Message::Gather(roster) => roster.after > 0,
            Message::Sweep(sweep) => sweep.chosen,
            _ => false,
        },
    })
}

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

    /// Puts a frame that relay `from` sent at `port` in transit.
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

    /// Returns one of the recorded frames of `line`, one direction of a link. `which` selects the frame. `None` if no frame is recorded.
    pub(crate) fn recorded(&self, line: usize, which: u8) -> Option<Flying> {
        let recorded = &self.lines[line].recorded;
        let at = usize::from(which) % recorded.len().max(1);
        recorded.get(at).cloned()
    }

    /// Returns the index of a line (direction of a link) with a frame in transit; `None` if there is none. `pick`
    /// selects one of these lines.
    pub(crate) fn pick(&self, pick: u8) -> Option<usize> {
        let busy: Vec<usize> = (0..self.lines.len())
            .filter(|&line| !self.lines[line].flying.is_empty())
            .collect();
        busy.get(usize::from(pick) % busy.len().max(1)).copied()
    }

    /// Removes and returns a frame in transit on `line`, one direction of a link.
    ///
    /// The frame overtakes `behind` frames in transit; with 0 it is the next frame to arrive. If too few frames are in
    /// transit, the last of them is taken.
    pub(crate) fn take(&mut self, line: usize, behind: u8) -> Option<Flying> {
        let flying = &mut self.lines[line].flying;
        let last = flying.len().checked_sub(1)?;
        flying.remove(usize::from(behind).min(last))
    }

    /// Receives bytes at the end of `line`, one direction of a link. Returns the numbers of frames that they
    /// complete. `whole` is the frame as it was sent.
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

    /// Discards the incomplete frames in transit to relay `at` (from 0), which has just been switched on.
    pub(crate) fn forget(&mut self, at: usize) {
        for (number, line) in self.lines.iter_mut().enumerate() {
            if end(number).0 == at {
                line.begun.clear();
            }
        }
    }

    /// Cuts a link, so that its frames in transit are lost. Returns the line index and the next frame of both
    /// directions of the link, because first bytes of these frames may still arrive.
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

    /// Delays the next frame of `line` (one direction of a link) until `due`, while later frames pass it.
    pub(crate) fn delay(&mut self, line: usize, due: Instant) {
        let Line { flying, late, .. } = &mut self.lines[line];
        late.extend(flying.pop_front().map(|frame| Flying { due, ..frame }));
    }

    /// Delivers the delayed frames whose delay ends by `now`, before the other frames in transit.
    pub(crate) fn hurry(&mut self, now: Instant) {
        for Line { flying, late, .. } in &mut self.lines {
            let due = late.extract_if(.., |frame| frame.due <= now);
            due.for_each(|frame| flying.push_front(frame));
        }
    }

    /// Releases all delayed frames at `now`, before their time.
    pub(crate) fn hurry_all(&mut self, now: Instant) {
        let late = self.lines.iter_mut().flat_map(|line| &mut line.late);
        late.for_each(|frame| frame.due = now);
        self.hurry(now);
    }

    /// Returns the arrival time and the line (direction of a link) of the next frame to arrive, if any.
    pub(crate) fn next(&self) -> Option<(Instant, usize)> {
        let lines = self.lines.iter().zip(0..);
        let coming = lines.flat_map(|(line, number)| {
            let frames = line.flying.front().into_iter().chain(&line.late);
            frames.map(move |frame| (frame.due, number))
        });
        coming.min()
    }
}
