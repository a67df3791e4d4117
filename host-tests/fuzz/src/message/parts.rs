//! Parts of a body: numbers that are mostly valid, otherwise arbitrary.

use uav_relay::ViewId;
use uav_relay::wire::digest::MissionId;

use crate::input::Input;

/// State of a relay that its neighbour may know.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Known {
    /// Digest of the loaded mission.
    pub digest: u16,
    /// Number of relays in the loaded mission.
    pub relays: u16,
    /// Digest of the flown mission.
    pub flown: u16,
    /// Newest mission held.
    pub held: MissionId,
    /// View that the relay under test has agreed on.
    pub view: ViewId,
    /// Number of the current pass.
    pub number: u16,
    /// Association number in its last fence message, 0 for none.
    pub association: u16,
    /// Nonce of its last hello, 0 for none.
    pub asked: u16,
    /// Distance from transmitter to receiver, m.
    pub distance_m: f32,
}

pub(super) struct Body<'a, 'b> {
    pub(super) bytes: Vec<u8>,
    pub(super) input: &'a mut Input<'b>,
    pub(super) known: &'a Known,
}

impl Body<'_, '_> {
    /// Appends a pass number: that of the current, the next or an earlier pass, or any number.
    pub(super) fn number(&mut self) {
        let number = match self.input.byte() {
            0..96 => self.known.number.wrapping_add(1),
            96..192 => self.known.number,
            behind @ 192..248 => self.known.number.wrapping_sub(u16::from(behind - 190)),
            _ => self.input.word(),
        };
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub(super) fn digest(&mut self) {
        let wrong = u16::from(self.input.byte() == u8::MAX);
        self.word(self.known.digest ^ wrong);
    }

    pub(super) fn word(&mut self, word: u16) {
        self.bytes.extend_from_slice(&word.to_le_bytes());
    }

    /// Appends number and mark of a pass in the relay's view, rarely of another view.
    pub(super) fn pass(&mut self) {
        self.number();
        let mark = mark(self.known.view);
        let mark = match self.input.byte() {
            u8::MAX => self.input.word(),
            up @ 240.. => mark.wrapping_add(u16::from(up - 240)),
            _ => mark,
        };
        self.word(self.known.flown.wrapping_add(mark));
    }

    /// Appends a view: the relay's, one of the next from a possible proposer, an earlier one, or any.
    pub(super) fn view(&mut self) {
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

    pub(super) fn sized(&mut self) {
        self.view();
        self.relay();
    }

    /// Appends a question number, mostly none or one of the first.
    pub(super) fn question(&mut self) {
        let number = match self.input.byte() {
            small @ 0..240 => u16::from(small % 12),
            _ => self.input.word(),
        };
        self.word(number);
    }

    /// Appends a lease in tenths of a second, mostly short.
    pub(super) fn lease(&mut self) {
        let tenths = match self.input.byte() {
            few @ 0..240 => u16::from(few),
            _ => self.input.word(),
        };
        self.word(tenths);
    }

    /// Appends a relay of a short chain, or any.
    pub(super) fn relay(&mut self) {
        let relay = match self.input.byte() {
            small @ 0..240 => u16::from(small % 6),
            _ => self.input.word(),
        };
        self.word(relay);
    }

    pub(super) fn float(&mut self, usual: impl FnOnce(&mut Input<'_>) -> f32) -> f32 {
        let number = self.input.mostly(usual);
        self.bytes.extend_from_slice(&number.to_le_bytes());
        number
    }

    /// Appends a byte from `least` to `most`, rarely any; returns it.
    pub(super) fn small(&mut self, least: u8, most: u8) -> u8 {
        let byte = self.input.byte();
        let small = if byte < 240 {
            least + byte % (most - least + 1)
        } else {
            self.input.byte()
        };
        self.bytes.push(small);
        small
    }

    pub(super) fn profile(&mut self) {
        self.altitude();
        self.power();
    }

    pub(super) fn altitude(&mut self) {
        self.float(|input| input.scaled(0.1, 1e5));
    }

    pub(super) fn power(&mut self) {
        self.float(|input| input.scaled(1e-6, 1e6));
    }

    pub(super) fn sir(&mut self) {
        self.float(|input| input.scaled(1e-6, 1e6));
    }

    pub(super) fn place(&mut self) {
        let distance_m = self.known.distance_m;
        self.float(|input| input.even(0.0, distance_m));
    }

    /// Appends a lateral position, m: up to the allowed range, or small.
    pub(super) fn beside(&mut self) {
        let most_m = if self.input.flag() { 1e5 } else { 100.0 };
        self.float(|input| input.even(-most_m, most_m));
    }

    /// Appends a list of floats with its count: one number repeated, or separate numbers.
    pub(super) fn list(&mut self, most: u8, low: f32, high: f32) {
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

    /// Appends a pulse's number, mostly one of the first, and the digest of the view, rarely a wrong one.
    pub(super) fn pulse_number(&mut self) {
        self.question();
        let wrong = u16::from(self.input.byte() == u8::MAX);
        let digest = self.known.flown.wrapping_add(mark(self.known.view));
        self.word(digest ^ wrong);
    }

    /// Returns the mission that the relay holds, the loaded one, a newer or older version, or any.
    pub(super) fn mission_id(&mut self) -> MissionId {
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

    /// Appends an association number: the number known from the relay, a small number, or any.
    pub(super) fn association(&mut self) {
        let word = match self.input.byte() {
            small @ 0..96 => u16::from(small),
            96..192 => self.known.association,
            _ => self.input.word(),
        };
        self.word(word);
    }
}

/// Returns the view's mark, which is added to the mission's digest. The lower half plus the byte-swapped upper half.
fn mark(view: ViewId) -> u16 {
    let [a, b, c, d] = view.bits().to_le_bytes();
    u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
}
