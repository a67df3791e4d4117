//! Parts of a body: numbers that are mostly valid, otherwise arbitrary.

use uav_relay::ViewId;
use uav_relay::wire::digest::MissionId;

use crate::input::Input;

/// State of the tested relay that a neighbour can know.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RelayState {
    /// Digest of the mission that was loaded into the tested relay before flight.
    pub digest: u16,
    /// Number of relays in the mission that was loaded into the tested relay before flight.
    pub relays: u16,
    /// Digest of the mission that the tested relay uses now.
    pub flown: u16,
    /// Version and digest of the newest mission that the tested relay has stored, in use or not.
    pub held: MissionId,
    /// View (agreed membership of the chain) that the tested relay has accepted last.
    pub view: ViewId,
    /// Number of the current pass, a message that travels along the chain and back.
    pub number: u16,
    /// Session number in the tested relay's last message of its collision guard (a fence); 0 for none.
    ///
    /// Each relay draws this number at random for the session with its neighbour.
    pub association: u16,
    /// Number in the last hello of the tested relay; 0 for none. A mission offer to this relay must repeat the number.
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
    /// Appends the number of a pass (message along the chain and back) to the message. It is the next, the current, an
    /// earlier or an arbitrary number.
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

    /// Appends the number of a pass to the message, and the digest of mission and view. A pass is a message along the
    /// chain and back.
    ///
    /// Rarely the digest belongs to another view.
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

    /// Appends the name of a view (membership of the chain) to the message.
    ///
    /// The view is the accepted view of the tested relay, an earlier view, or any view; or it is a view with one of the
    /// next numbers and one of the first four relays as proposer.
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

    /// Appends a sequence number to the message: mostly 0 (none) to 11.
    ///
    /// Heartbeats and other messages contain such numbers.
    pub(super) fn request_number(&mut self) {
        let number = match self.input.byte() {
            small @ 0..240 => u16::from(small % 12),
            _ => self.input.word(),
        };
        self.word(number);
    }

    /// Appends the duration of a lease, mostly short, to the message. The unit is a tenth of a second.
    pub(super) fn lease(&mut self) {
        let tenths = match self.input.byte() {
            few @ 0..240 => u16::from(few),
            _ => self.input.word(),
        };
        self.word(tenths);
    }

    /// Appends the last part of a lease renewal to the message. This part is the flag `in_place` and, in half of the
    /// messages, the node that leaves and the node that joins. At least one of these two nodes is not 0.
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

    /// Appends a byte to the message, mostly from `least` to `most`; returns the byte.
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

    /// Appends a lateral position y, m, to the message. Its maximum distance from the line is 100 m in some draws and
    /// 1e5 m in others.
    pub(super) fn lateral(&mut self) {
        let most_m = if self.input.flag() { 1e5 } else { 100.0 };
        self.float(|input| input.even(-most_m, most_m));
    }

    /// Appends a list of up to `most` floats, with its count, to the message. All floats are equal, or each is drawn
    /// between `low` and `high`.
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

    /// Appends the number of a lease renewal, mostly a small one, and a digest to the message.
    ///
    /// The digest is usually the digest of the mission and the view (list of the chain's members), rarely a wrong
    /// digest.
    pub(super) fn pulse_number(&mut self) {
        self.request_number();
        let wrong = u16::from(self.input.byte() == u8::MAX);
        let digest = self.state.flown.wrapping_add(mark(self.state.view));
        self.word(digest ^ wrong);
    }

    /// Returns version and digest of a mission. The mission is the newest mission stored by the tested relay, the
    /// mission loaded into this relay before flight, or another mission with a newer, older or arbitrary version.
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

    /// Appends the session number of a fence, a message of the collision guard, to the message.
    ///
    /// The number is the session number of the tested relay, a small number, or any number.
    pub(super) fn association(&mut self) {
        let word = match self.input.byte() {
            small @ 0..96 => u16::from(small),
            96..192 => self.state.association,
            _ => self.input.word(),
        };
        self.word(word);
    }
}

/// Returns a 16-bit digest of a view, for the sum of mission digest and view digest in a message. It is the lower half
/// of the view's name plus the byte-swapped upper half.
fn mark(view: ViewId) -> u16 {
    let [a, b, c, d] = view.bits().to_le_bytes();
    u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
}
