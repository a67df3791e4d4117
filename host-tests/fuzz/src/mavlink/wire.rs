//! Frames and streams, written without the crate's codec.

use crate::input::Input;

/// Returns the CRC-16/MCRF4XX of `covered` and `extra`, computed bit by bit.
pub(super) fn checksum(covered: &[u8], extra: u8) -> u16 {
    covered.iter().chain([&extra]).fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| {
            crc >> 1 ^ if crc & 1 == 1 { 0x8408 } else { 0 }
        })
    })
}

/// Kind of a MAVLink message: its number, the CRC_EXTRA byte of its checksum, and its payload length.
pub(super) type Kind = (u32, u8, usize);

pub(super) const HEARTBEAT: Kind = (0, 50, 9);
pub(super) const GLOBAL_POSITION: Kind = (33, 104, 28);
pub(super) const POSITION_TARGET: Kind = (87, 150, 51);
pub(super) const EXTENDED_STATE: Kind = (245, 130, 2);
pub(super) const ACK: Kind = (77, 143, 10);
pub(super) const TUNNEL: Kind = (385, 147, 133);
pub(super) const SET_POSITION: Kind = (86, 5, 53);
pub(super) const COMMAND: Kind = (76, 152, 33);
pub(super) const TIMESYNC: Kind = (111, 34, 16);
pub(super) const TEXT: Kind = (253, 83, 54);
pub(super) const VALUE: Kind = (251, 170, 18);

pub(super) fn id(frame: &[u8]) -> u32 {
    let id = frame.get(7..).and_then(<[u8]>::first_chunk);
    let [a, b, c] = id.copied().unwrap_or_default();
    u32::from_le_bytes([a, b, c, 0])
}

/// Returns the CRC_EXTRA byte of a message's checksum; 0 for an unknown message.
pub(super) fn extra(id: u32) -> u8 {
    let known = [
        HEARTBEAT,
        GLOBAL_POSITION,
        POSITION_TARGET,
        EXTENDED_STATE,
        ACK,
        TUNNEL,
        SET_POSITION,
        COMMAND,
        TIMESYNC,
        TEXT,
        VALUE,
    ];
    let mut known = known.into_iter();
    known
        .find(|(number, ..)| *number == id)
        .map_or(0, |(_, extra, _)| extra)
}

pub(super) const SENT: [Kind; 7] = [HEARTBEAT, COMMAND, ACK, SET_POSITION, TIMESYNC, TEXT, VALUE];

/// Builds a MAVLink frame from the system and component `from`, without trailing zeros of the payload.
///
/// At least one byte of the payload is kept.
///
/// If `flags` has the bit for a signed frame (1), 13 arbitrary bytes follow as the signature.
pub(super) fn frame(kind: Kind, from: [u8; 2], payload: &[u8], flags: u8) -> Vec<u8> {
    let (id, extra, _) = kind;
    let zeros = payload.iter().rev().take_while(|byte| **byte == 0).count();
    let kept = (payload.len() - zeros).max(1).min(payload.len());
    let payload = payload.get(..kept).unwrap_or_default();
    let [a, b, c, _] = id.to_le_bytes();
    let length = u8::try_from(payload.len()).unwrap_or(u8::MAX);
    let [system, component] = from;
    let mut frame = vec![0xFD, length, flags, 0, 0, system, component, a, b, c];
    frame.extend(payload);
    let sum = checksum(frame.get(1..).unwrap_or_default(), extra);
    frame.extend(sum.to_le_bytes());
    if flags & 1 == 1 {
        frame.extend([0x5A; 13]);
    }
    frame
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) at: usize,
}

/// Maximum number of parts (frames and pieces of noise) of a stream. The test parses each stream twice.
const MAX_PARTS: usize = 64;

/// Builds a stream of noise and of intact, damaged and truncated frames.
///
/// Also returns the offsets of the intact frames. Zeros follow at the end, so that no parser waits for the rest of a
/// truncated frame.
pub(super) fn stream(input: &mut Input<'_>) -> (Vec<u8>, Vec<Placed>) {
    let (mut bytes, mut placed) = (Vec::new(), Vec::new());
    for _ in 0..MAX_PARTS {
        if input.is_empty() {
            break;
        }
        match input.below(4) {
            0 => bytes.extend(input.piece()),
            1 => {
                placed.push(Placed { at: bytes.len() });
                bytes.extend(any_frame(input));
            }
            2 => {
                let mut frame = any_frame(input);
                let at = usize::from(input.byte()) % frame.len().max(1);
                if let Some(byte) = frame.get_mut(at) {
                    *byte ^= input.byte();
                }
                bytes.extend(frame);
            }
            _ => {
                let frame = any_frame(input);
                let kept = usize::from(input.byte()) % frame.len().max(1);
                bytes.extend(frame.get(..kept).unwrap_or_default());
            }
        }
    }
    bytes.extend([0; 300]);
    (bytes, placed)
}

fn any_frame(input: &mut Input<'_>) -> Vec<u8> {
    let kinds = [
        HEARTBEAT,
        GLOBAL_POSITION,
        POSITION_TARGET,
        EXTENDED_STATE,
        ACK,
        TUNNEL,
    ];
    let chosen = usize::from(input.below(6));
    let kind = kinds.get(chosen).copied().unwrap_or(HEARTBEAT);
    let from = [input.byte(), input.byte()];
    let flags = input.below(2);
    let mut payload = input.piece().to_vec();
    payload.resize(kind.2, 0);
    frame(kind, from, &payload, flags)
}
