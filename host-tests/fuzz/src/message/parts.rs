//! Parts of a message body: mostly valid numbers, otherwise arbitrary ones.

use uav_relay::ViewId;
use uav_relay::wire::digest::MissionId;

use crate::input::Input;

/// State of the tested relay that a neighbour can know from the relay's frames and the mission.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RelayState {
    /// Digest of the mission loaded before flight.
    pub digest: u16,
    /// Number of relays in the mission loaded before flight.
    pub relays: u16,
    /// Digest of the mission in use: the one loaded before flight, or one uploaded later.
    pub flown: u16,
    /// Version and digest of the newest mission that the relay stores, even if it is not in use yet.
    pub held: MissionId,
    /// Last accepted view (membership of the chain).
    pub view: ViewId,
    /// Number of the current pass (message along the chain and back).
    pub number: u16,
    /// Session number in the relay's last fence (message of the collision guard); 0 for none.
    ///
    /// The relay draws this number at random for the session with this neighbour.
    pub association: u16,
    /// Number in the relay's last hello; 0 for none. A mission offer must repeat this number.
    pub offer_number: u16,
    /// Distance from transmitter to receiver, m.
    pub distance_m: f32,
}

pub(super) struct Body<'a, 'b> {
    pub(super) bytes: Vec<u8>,
    pub(super) input: &'a mut Input<'b>,
    pub(super) state: &'a RelayState,
}

impl Body<'_, '_> {
    /// Appends the number of a pass (message along the chain and back): next, current, earlier or any.
    pub(super) fn number(&mut self) {
        let number = match self.input.byte() {
            0..96 => self.state.number.wrapping_add(1),
            96..192 => self.state.number,
            behind @ 192..248 => self.state.number.wrapping_sub(u16::from(behind - 190)),
            _ => self.input.word(),
        };
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub(super) fn digest(&mut self) {
        let wrong = u16::from(self.input.byte() == u8::MAX);
        self.word(self.state.digest ^ wrong);
    }

    pub(super) fn word(&mut self, word: u16) {
        self.bytes.extend_from_slice(&word.to_le_bytes());
    }

    /// Appends a pass number, and the sum of the mission's and the view's digest; rarely a wrong sum.
    ///
    /// A pass is a message along the chain and back; a view is a membership of the chain.
    pub(super) fn pass(&mut self) {
        self.number();
        let mark = mark(self.state.view);
        let mark = match self.input.byte() {
            u8::MAX => self.input.word(),
            up @ 240.. => mark.wrapping_add(u16::from(up - 240)),
            _ => mark,
        };
        self.word(self.state.flown.wrapping_add(mark));
    }

    /// Appends the identifier of a view (membership of the chain).
    ///
    /// It is 0, any number, or an identifier near that of the relay's accepted view: the same one, an earlier number,
    /// or a number up to 3 higher with one of the relays 1 to 4 as proposer.
    pub(super) fn view(&mut self) {
        let own = self.state.view;
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

    /// Appends a sequence number as in heartbeats: mostly 0 (which means none) to 11, rarely any number.
    pub(super) fn request_number(&mut self) {
        let number = match self.input.byte() {
            small @ 0..240 => u16::from(small % 12),
            _ => self.input.word(),
        };
        self.word(number);
    }

    /// Appends the duration of a lease, mostly short, in tenths of a second.
    pub(super) fn lease(&mut self) {
        let tenths = match self.input.byte() {
            few @ 0..240 => u16::from(few),
            _ => self.input.word(),
        };
        self.word(tenths);
    }

    /// Appends the last part of a lease renewal: the flag `in_place`, and often two node numbers.
    ///
    /// In half of the messages the numbers of the leaving and of the joining node follow the flag. At least one of the
    /// two numbers is not 0.
    pub(super) fn renewal_nodes(&mut self) {
        self.small(0, 1);
        if self.small(0, 1) == 1 {
            self.relay();
            self.relay();
            if self.bytes.ends_with(&[0; 4]) {
                self.bytes.truncate(self.bytes.len() - 2);
                self.word(1);
            }
        }
    }

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

    /// Appends a byte, mostly from `least` to `most`, and returns this byte.
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
        let distance_m = self.state.distance_m;
        self.float(|input| input.even(0.0, distance_m));
    }

    /// Appends a lateral position y, m: within 100 m of the line, or within 1e5 m.
    pub(super) fn lateral(&mut self) {
        let most_m = if self.input.flag() { 1e5 } else { 100.0 };
        self.float(|input| input.even(-most_m, most_m));
    }

    /// Appends the number of floats in a list, up to `most`, and then the floats.
    ///
    /// Either all floats have the same value, or each one has its own value from `low` to `high`.
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

    /// Appends the number of a lease renewal, mostly small, and a digest.
    ///
    /// The digest is the sum of the mission's digest and the digest of the view (membership of the chain). Rarely it is
    /// wrong.
    pub(super) fn pulse_number(&mut self) {
        self.request_number();
        let wrong = u16::from(self.input.byte() == u8::MAX);
        let digest = self.state.flown.wrapping_add(mark(self.state.view));
        self.word(digest ^ wrong);
    }

    /// Returns version and digest of a mission, chosen by the input bytes.
    ///
    /// It is the newest stored mission, the mission loaded before flight, or one with a newer, older or arbitrary
    /// version.
    pub(super) fn mission_id(&mut self) -> MissionId {
        let held = self.state.held;
        match self.input.byte() {
            0..128 => held,
            128..192 => MissionId {
                version: 0,
                digest: self.state.digest,
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

    /// Appends the session number of a fence (collision-guard message): the relay's, a small one, or any.
    pub(super) fn association(&mut self) {
        let word = match self.input.byte() {
            small @ 0..96 => u16::from(small),
            96..192 => self.state.association,
            _ => self.input.word(),
        };
        self.word(word);
    }
}

/// Returns the 16-bit digest of a view (membership of the chain).
///
/// Messages contain the sum of this digest and the mission's digest. The view's digest is the lower half of the view's
/// identifier plus the byte-swapped upper half.
fn mark(view: ViewId) -> u16 {
    let [a, b, c, d] = view.bits().to_le_bytes();
    u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
}
