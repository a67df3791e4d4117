//! Reference parser by the definition of frames: finds the earliest valid frame, then the next.

use uav_relay::flight::mavlink::frame;

use super::wire::checksum;

#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) at: usize,
    pub(super) end: usize,
    pub(super) id: u32,
    pub(super) from: (u8, u8),
    pub(super) is_signed: bool,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Reference {
    pub(super) frames: Vec<Frame>,
    /// Number of invalid frames whose header is that of a known message.
    pub(super) broken: usize,
    pub(super) checksums: usize,
}

impl Reference {
    pub(super) fn read(bytes: &[u8]) -> Self {
        let mut all = Self::default();
        let mut at = 0;
        while let Some(&[magic, length, flags, _, _, system, component, a, b, c]) =
            bytes.get(at..).and_then(<[u8]>::first_chunk)
        {
            let id = u32::from_le_bytes([a, b, c, 0]);
            let known = frame::find_known(id)
                .filter(|known| magic == 0xFD && u16::from(length) <= u16::from(known.length) + 24);
            let Some(known) = known else {
                at += 1;
                continue;
            };
            if flags > 1 {
                all.broken += 1;
                at += 1;
                continue;
            }
            let checked = at + 10 + usize::from(length);
            let end = checked + 2 + if flags == 1 { 13 } else { 0 };
            let Some(frame) = bytes.get(at..end) else {
                // This incomplete frame may still become valid, so the bytes after its start are not examined yet.
                break;
            };
            all.checksums += 1;
            let covered = frame.get(1..checked - at).unwrap_or_default();
            let said = frame.get(checked - at..checked - at + 2);
            if said == Some(&checksum(covered, known.crc_extra).to_le_bytes()) {
                all.frames.push(Frame {
                    at,
                    end,
                    id,
                    from: (system, component),
                    is_signed: flags == 1,
                });
                at = end;
            } else {
                all.broken += 1;
                at += 1;
            }
        }
        all
    }
}
