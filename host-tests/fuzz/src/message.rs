//! Frames with a body of every kind and fuzzed numbers in it, right in everything else: what a mad neighbour may say.
//!
//! Bodies are written from the byte tables, not by the crate: what the crate would never write must come too.

mod offer;

use uav_relay::ViewId;
use uav_relay::wire::crc::CRC_32C;
use uav_relay::wire::digest::MissionId;

use super::input::Input;

/// What a neighbour may know of the relay it talks to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Known {
    /// Digest of the mission that it was loaded with.
    pub digest: u16,
    /// The relays of that.
    pub relays: u16,
    /// Digest of the mission that it flies.
    pub flown: u16,
    /// The newest mission that it holds.
    pub held: MissionId,
    /// The view that it has agreed to.
    pub view: ViewId,
    /// Number of its current pass.
    pub number: u16,
    /// Number of the talk that its last fence was of, 0 for none.
    pub association: u16,
    /// Number of the last hello that it said, 0 for none.
    pub asked: u16,
    /// D, m.
    pub distance_m: f32,
}

/// Who sends a frame to whom, as words: what stands in the top bits of an address goes on the wire too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Header {
    /// The network.
    pub network: u16,
    /// The sender, and above it the version less 1.
    pub sender: u16,
    /// The destination, and above it flags.
    pub destination: u16,
}

impl Header {
    /// The bytes of a frame before the tag and the check sequence, with some flags more.
    pub fn before(self, flags: u16, counter: u32, body: &[u8]) -> Vec<u8> {
        let mut plain = Vec::with_capacity(22 + body.len());
        for word in [
            1 << 12 | self.sender,
            flags | self.destination,
            self.network,
        ] {
            plain.extend_from_slice(&word.to_le_bytes());
        }
        plain.extend_from_slice(&counter.to_le_bytes());
        plain.extend_from_slice(body);
        plain
    }

    /// A frame without a tag, before COBS.
    pub fn unsigned(self, body: &[u8]) -> Vec<u8> {
        let mut plain = self.before(0, 0, body);
        sealed(&mut plain);
        plain
    }
}

/// What a view adds to the digest of the mission that it flies: its lower half, and its upper half with the bytes turned round.
fn mark(view: ViewId) -> u16 {
    let [a, b, c, d] = view.bits().to_le_bytes();
    u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
}

/// Adds the check sequence.
pub fn sealed(plain: &mut Vec<u8>) {
    plain.extend_from_slice(&CRC_32C.checksum(plain).to_le_bytes());
}

/// A body of any of the seventeen kinds, or of none.
pub fn body(input: &mut Input<'_>, known: &Known) -> Vec<u8> {
    let tag = match input.below(16) {
        15 => 15 + input.below(3),
        tag => tag,
    };
    let mut body = Body {
        bytes: vec![tag],
        input,
        known,
    };
    match tag {
        0 => body.sweep(Extra::Nothing),
        1 => body.verdict(),
        2 => body.number(),
        3 => {
            body.digest();
            body.question();
            body.question();
        }
        4 => body.sweep(Extra::Upsilon),
        5 => body.sweep(Extra::Aside),
        6 | 7 => body.roster(),
        8 => body.token(),
        9 => body.moved(),
        10 => body.hello(),
        11 => body.proposal(),
        12 => body.decision(),
        13 => body.fence(),
        14 => body.offer(),
        15 => body.pulse(),
        16 => body.pulsed(),
        _ => body.bytes = body.input.piece().to_vec(),
    }
    body.bytes
}

/// What a sweep may have between the sender's profile and its reaches.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Extra {
    Nothing,
    /// What it measures.
    Upsilon,
    /// How far it is from the line.
    Aside,
}

/// A body being written.
struct Body<'a, 'b> {
    bytes: Vec<u8>,
    input: &'a mut Input<'b>,
    known: &'a Known,
}

impl Body<'_, '_> {
    /// The current pass, the next, one before, or any.
    fn number(&mut self) {
        let number = match self.input.byte() {
            0..96 => self.known.number.wrapping_add(1),
            96..192 => self.known.number,
            behind @ 192..248 => self.known.number.wrapping_sub(u16::from(behind - 190)),
            _ => self.input.word(),
        };
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    fn digest(&mut self) {
        let wrong = u16::from(self.input.byte() == u8::MAX);
        self.word(self.known.digest ^ wrong);
    }

    fn word(&mut self, word: u16) {
        self.bytes.extend_from_slice(&word.to_le_bytes());
    }

    /// Of a pass of the relay's view, or, rarely, of another one.
    fn pass(&mut self) {
        self.number();
        let mark = mark(self.known.view);
        let mark = match self.input.byte() {
            u8::MAX => self.input.word(),
            up @ 240.. => mark.wrapping_add(u16::from(up - 240)),
            _ => mark,
        };
        self.word(self.known.flown.wrapping_add(mark));
    }

    /// A view: the relay's, one of the next by a node that may propose it, one before, or any.
    fn view(&mut self) {
        let own = self.known.view;
        let view = match self.input.byte() {
            0..32 => own.bits(),
            up @ 32..224 => {
                let number = own.number().wrapping_add(u32::from(up % 4));
                (number << 10) | (u32::from(up / 4 % 4) + 1)
            }
            down @ 224..240 => {
                let number = own.number().wrapping_sub(u32::from(down - 223));
                number << 10 | 1
            }
            240..244 => 0,
            _ => u32::from(self.input.word()) << 16 | u32::from(self.input.word()),
        };
        self.bytes.extend_from_slice(&view.to_le_bytes());
    }

    /// A view and its size.
    fn sized(&mut self) {
        self.view();
        self.relay();
    }

    /// The number of a question, mostly none or one of the first.
    fn question(&mut self) {
        let number = match self.input.byte() {
            small @ 0..240 => u16::from(small % 12),
            _ => self.input.word(),
        };
        self.word(number);
    }

    /// Tenths of a second, mostly few.
    fn lease(&mut self) {
        let tenths = match self.input.byte() {
            few @ 0..240 => u16::from(few),
            _ => self.input.word(),
        };
        self.word(tenths);
    }

    /// A relay of a short chain, or any.
    fn relay(&mut self) {
        let relay = match self.input.byte() {
            small @ 0..240 => u16::from(small % 6),
            _ => self.input.word(),
        };
        self.word(relay);
    }

    fn float(&mut self, usual: impl FnOnce(&mut Input<'_>) -> f32) -> f32 {
        let number = self.input.mostly(usual);
        self.bytes.extend_from_slice(&number.to_le_bytes());
        number
    }

    /// A byte from `least` to `most`, rarely any.
    fn small(&mut self, least: u8, most: u8) -> u8 {
        let byte = self.input.byte();
        let small = if byte < 240 {
            least + byte % (most - least + 1)
        } else {
            self.input.byte()
        };
        self.bytes.push(small);
        small
    }

    fn profile(&mut self) {
        self.altitude();
        self.power();
    }

    fn altitude(&mut self) {
        self.float(|input| input.scaled(0.1, 1e5));
    }

    fn power(&mut self) {
        self.float(|input| input.scaled(1e-6, 1e6));
    }

    fn sir(&mut self) {
        self.float(|input| input.scaled(1e-6, 1e6));
    }

    fn place(&mut self) {
        let distance_m = self.known.distance_m;
        self.float(|input| input.even(0.0, distance_m));
    }

    /// How far from the line: as far as relays may go, or hardly.
    fn beside(&mut self) {
        let most_m = if self.input.flag() { 1e5 } else { 100.0 };
        self.float(|input| input.even(-most_m, most_m));
    }

    /// A list of floats with its count: one number over and over, or each its own.
    fn list(&mut self, most: u8, low: f32, high: f32) {
        let count = self.small(0, most);
        let same = self.input.flag();
        let first = self.input.mostly(|input| input.even(low, high));
        for at in 0..count {
            if same || at == 0 {
                self.bytes.extend_from_slice(&first.to_le_bytes());
            } else {
                self.float(|input| input.even(low, high));
            }
        }
    }

    fn sweep(&mut self, extra: Extra) {
        self.pass();
        let plain = self.input.flag();
        self.sir();
        if plain {
            // The sign of the anchor.
            if let Some(byte) = self.bytes.last_mut() {
                *byte ^= 0x80;
            }
        }
        let single = self.input.flag();
        let (gap, growth) = if single {
            (0, 0)
        } else {
            (self.input.byte(), self.input.byte())
        };
        self.bytes.extend_from_slice(&[gap, growth]);
        self.profile();
        match extra {
            Extra::Nothing => {}
            Extra::Upsilon => {
                self.float(|input| input.scaled(1e-9, 1e32));
            }
            Extra::Aside => self.beside(),
        }
        let distance_m = self.known.distance_m;
        self.list(if single { 1 } else { 16 }, 0.0, distance_m);
    }

    fn verdict(&mut self) {
        self.pass();
        self.small(0, 1);
        if self.small(0, 1) == 1 {
            self.small(0, 15);
        }
        let distance_m = self.known.distance_m;
        self.list(16, -distance_m, distance_m);
        if self.small(0, 1) == 1 {
            self.place();
        }
    }

    /// Relays that bring along an altitude or a power of their own, most often after one another.
    fn roster(&mut self) {
        self.pass();
        let mut index = u16::from(self.small(0, 3));
        self.bytes.push(0);
        for _ in 0..self.small(0, 8) {
            index += 1 + u16::from(self.input.below(3));
            self.bytes.extend_from_slice(&index.to_le_bytes());
            if self.input.flag() {
                self.altitude();
            } else {
                self.bytes.extend_from_slice(&[0; 4]);
            }
            self.power();
        }
    }

    fn token(&mut self) {
        self.pass();
        self.place();
        self.altitude();
        self.power();
        if self.small(0, 2) == 2 {
            self.float(|input| input.even(0.0, 1e3));
            let grid = if self.input.flag() {
                [2 + self.input.below(16), 2 + self.input.below(16)]
            } else {
                [0, 0]
            };
            self.bytes.extend_from_slice(&grid);
        } else {
            self.bytes.extend_from_slice(&[0; 6]);
        }
        self.sir();
    }

    fn hello(&mut self) {
        self.digest();
        self.relay();
        self.relay();
        self.view();
        let MissionId { digest, version } = self.mission_id();
        self.word(digest);
        self.word(version);
        self.question();
        self.small(0, 15);
        self.small(0, 31);
    }

    /// A mission, a proposal of it and a place.
    fn call(&mut self) {
        let MissionId { digest, version } = self.mission_id();
        self.word(digest);
        self.word(version);
        self.view();
        self.relay();
    }

    fn proposal(&mut self) {
        self.call();
        self.sized();
        self.relay();
        self.lease();
        self.lease();
        self.small(0, 1);
        if self.small(0, 1) == 1 {
            self.view();
            self.sized();
        }
    }

    fn decision(&mut self) {
        self.call();
        self.sized();
        if self.small(0, 1) == 1 {
            self.sized();
        }
        self.relay();
        self.lease();
    }

    fn pulse(&mut self) {
        self.pulse_number();
        self.lease();
    }

    fn pulsed(&mut self) {
        self.pulse_number();
        self.small(0, 1);
    }

    /// The number of a pulse, one of the first, and the digest of the relay's view, or, rarely, of another one.
    fn pulse_number(&mut self) {
        self.question();
        let wrong = u16::from(self.input.byte() == u8::MAX);
        let digest = self.known.flown.wrapping_add(mark(self.known.view));
        self.word(digest ^ wrong);
    }

    /// The mission that the relay holds, the one that it was loaded with, one that is newer or older than the one held, or any.
    fn mission_id(&mut self) -> MissionId {
        let held = self.known.held;
        match self.input.byte() {
            0..128 => held,
            128..192 => MissionId {
                version: 0,
                digest: self.known.digest,
            },
            192..216 => MissionId {
                version: held.version.wrapping_add(1),
                ..held
            },
            216..240 => MissionId {
                version: held.version.saturating_sub(1),
                ..held
            },
            _ => MissionId {
                version: self.input.word(),
                digest: self.input.word(),
            },
        }
    }

    fn fence(&mut self) {
        self.association();
        self.digest();
        self.association();
        self.relay();
        let distance_m = self.known.distance_m;
        for _ in 0..4 {
            self.float(|input| input.even(-distance_m, 2.0 * distance_m));
        }
        self.float(|input| input.even(0.0, 0.1 * distance_m));
        self.small(0, 15);
    }

    /// The number of the relay's own talk on that side, a small one, or any.
    fn association(&mut self) {
        let word = match self.input.byte() {
            small @ 0..96 => u16::from(small),
            96..192 => self.known.association,
            _ => self.input.word(),
        };
        self.word(word);
    }

    fn moved(&mut self) {
        self.pass();
        self.place();
        self.altitude();
        self.small(0, 1);
        self.sir();
    }
}
