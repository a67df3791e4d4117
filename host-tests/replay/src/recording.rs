//! Frames of one capture file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{Header, Opened, open};
use uav_relay::wire::message::Message;
use uav_relay_capture::Direction;
use uav_relay_decode::source::{Item, Packet, SourceError, read};

/// Intact frame of a capture.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Time of the frame, s since 1970.
    ///
    /// Before a merge of files the time is that of the clock of the frame's own file; after a merge, that of the first
    /// file's clock.
    pub at: f64,
    /// Direction of the frame, seen from the node that wrote the file.
    pub direction: Direction,
    /// Bytes of the frame on the wire.
    pub wire: Vec<u8>,
    /// Network, sender, destination and counter of the frame.
    pub header: Header,
    /// Message of the frame; `None` for a handshake, and for a message that no relay would accept.
    pub message: Option<Message>,
    /// Operator's commands in the capture's comments on this frame and on omitted packets before it.
    ///
    /// Empty without such comments.
    pub comment: String,
}

/// Appends `more` to a comment.
fn join(comment: &mut String, more: &str) {
    if !comment.is_empty() && !more.is_empty() {
        comment.push_str("; ");
    }
    comment.push_str(more);
}

/// Removes the frames that `is_kept` rejects.
///
/// The comment of a removed frame is appended to the comment of the next kept frame, or of the last kept frame if no
/// kept frame follows. `last` is the comment on packets after the last frame.
pub(crate) fn retain(frames: &mut Vec<Frame>, last: &str, mut is_kept: impl FnMut(&Frame) -> bool) {
    let mut acts = String::new();
    frames.retain_mut(|frame| {
        join(&mut acts, &std::mem::take(&mut frame.comment));
        let is_kept = is_kept(frame);
        if is_kept {
            frame.comment = std::mem::take(&mut acts);
        }
        is_kept
    });
    join(&mut acts, last);
    if let Some(frame) = frames.last_mut() {
        join(&mut frame.comment, &acts);
    }
}

/// Frames of one capture file, in the order of the file.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Name of the capture file.
    pub name: String,
    /// Intact frames of the file's network.
    pub frames: Vec<Frame>,
    /// Network number of most frames.
    pub network: u16,
    /// Digest of the mission loaded before flight, as most frames state it; `None` if no frame states it.
    pub mission: Option<u16>,
    /// Fault of the file after its last readable frame, if any.
    pub fault: Option<String>,
}

impl Recording {
    /// Reads a capture file. Frames of other networks are left out.
    ///
    /// # Errors
    /// One line with the file's name and the reason: it cannot be read, or has no intact frame.
    pub fn load(file: &Path) -> Result<Self, String> {
        let name = file.display().to_string();
        let unread = |error: std::io::Error| format!("{name}: cannot be read: {error}");
        let input = File::open(file).map_err(unread)?;
        let (mut frames, mut all, mut is_stream) = (Vec::new(), 0_usize, false);
        let mut acts = String::new();
        let ended = read(BufReader::new(input), |item| {
            if let Item::Packet(packet) = item {
                all += 1;
                is_stream |= packet.at.is_none();
                // A packet without an intact frame may also have a comment with an operator's command.
                join(&mut acts, packet.comment);
                if let Some(frame) = frame(&packet) {
                    let comment = std::mem::take(&mut acts);
                    frames.push(Frame { comment, ..frame });
                }
                // If the file has no times, it is not read to its end.
                return if is_stream { Err(()) } else { Ok(()) };
            }
            Ok(())
        });
        let fault = match ended {
            Ok(()) | Err(SourceError::Taken(())) => None,
            Err(SourceError::Read(error)) => return Err(unread(error)),
            Err(SourceError::Capture(error)) => Some(error),
        };
        if is_stream {
            return Err(format!("{name}: is not a capture (pcapng)"));
        }
        let network = most(frames.iter().map(|it| it.header.network));
        let Some(network) = network else {
            return Err(match (fault, all) {
                (Some(fault), _) => format!("{name}: is not a valid capture: {fault}"),
                (None, 0) => format!("{name}: has no frames of relays"),
                (None, _) => {
                    format!("{name}: none of its {all} frames is an intact frame of a relay")
                }
            });
        };
        retain(&mut frames, &acts, |it| it.header.network == network);
        let mission = most(frames.iter().filter_map(|it| loaded(it.message.as_ref()?)));
        Ok(Self {
            name,
            frames,
            network,
            mission,
            fault,
        })
    }
}

fn frame(packet: &Packet<'_>) -> Option<Frame> {
    let mut deframer = Deframer::new();
    let (last, rest) = packet
        .wire
        .split_last()
        .filter(|_| packet.wire.len() == packet.len)?;
    for byte in rest {
        deframer.push(*byte);
    }
    let Opened {
        header,
        body,
        handshake,
        ..
    } = open(deframer.push(*last)?.ok()?).ok()?;
    Some(Frame {
        at: packet.at?.as_secs_f64(),
        direction: packet.direction,
        wire: packet.wire.to_vec(),
        header,
        message: Message::decode(body).ok().filter(|_| !handshake),
        comment: String::new(),
    })
}

/// Returns the digest of the mission that the sender loaded before flight.
///
/// `None` if the message does not contain this digest.
fn loaded(message: &Message) -> Option<u16> {
    match message {
        Message::Heartbeat { mission, .. }
        | Message::Level { mission, .. }
        | Message::Watch { mission, .. } => Some(*mission),
        Message::Hello(hello) => Some(hello.mission),
        Message::Report(report) => Some(report.mission()),
        _ => None,
    }
}

/// Returns the most frequent of the numbers, if any.
fn most(numbers: impl Iterator<Item = u16>) -> Option<u16> {
    let mut counts = BTreeMap::<u16, usize>::new();
    for number in numbers {
        *counts.entry(number).or_default() += 1;
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count)?;
    Some(most.0)
}
