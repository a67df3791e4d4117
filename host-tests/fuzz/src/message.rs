//! Valid frames with a body of every kind and fuzzed numbers, from a malicious neighbour.
//!
//! Bodies are written from the byte tables, independently of the crate, because the crate never writes some of them.

mod hearing;
mod offer;
mod parts;

use uav_relay::wire::digest::MissionId;

use super::input::Input;
use parts::Body;

pub use parts::RelayState;

/// Builds a message body of one of the kinds 0 to 22 except 20, or of arbitrary bytes.
///
/// Some fields have values near those of the tested relay in `state`, so that this relay often accepts the message.
pub fn body(input: &mut Input<'_>, state: &RelayState) -> Vec<u8> {
    let tag = match input.below(16) {
        15 => 15 + input.below(6),
        tag => tag,
    };
    let mut body = Body {
        bytes: vec![tag],
        input,
        state,
    };
    match tag {
        0 => body.sweep(Extra::Nothing),
        1 => body.verdict(),
        2 => body.number(),
        3 => {
            body.digest();
            body.request_number();
            body.request_number();
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
        17 | 18 => body.hearing(),
        19 => body.level(),
        _ => {
            body.bytes = body.input.piece().to_vec();
            // This order keeps the meaning of the recorded inputs.
            match *body.bytes {
                [21] => body.pass_of_mission(),
                [22] => body.report(),
                _ => {}
            }
        }
    }
    body.bytes
}

/// Additional field of a sweep message: none, Upsilon = E[1 / interference], or the lateral position.
///
/// In the message the field comes after the sender's power, and before the list of the farthest positions of the
/// sender, one for each target SIR.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Extra {
    Nothing,
    Upsilon,
    Aside,
}

impl Body<'_, '_> {
    fn sweep(&mut self, extra: Extra) {
        self.pass();
        let plain = self.input.flag();
        self.sir();
        if plain {
            // The sign bit of the anchor (a target SIR) marks a variant of the message.
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
            Extra::Aside => self.lateral(),
        }
        let distance_m = self.state.distance_m;
        self.list(if single { 1 } else { 16 }, 0.0, distance_m);
    }

    fn verdict(&mut self) {
        self.pass();
        self.small(0, 1);
        if self.small(0, 1) == 1 {
            self.small(0, 15);
        }
        let distance_m = self.state.distance_m;
        self.list(16, -distance_m, distance_m);
        if self.small(0, 1) == 1 {
            self.place();
        }
    }

    /// Appends profiles (altitude and power) of up to eight relays, mostly in ascending order.
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
        self.request_number();
        self.small(0, 15);
        self.small(0, 0xFE);
    }

    /// Appends the first fields of a Proposal or Decision: mission, view, and a relay's index in the view.
    ///
    /// A view is a membership of the chain.
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
        self.renewal_nodes();
    }

    fn pulsed(&mut self) {
        self.pulse_number();
        self.request_number();
        self.renewal_nodes();
        self.small(0, 1);
    }

    fn fence(&mut self) {
        self.association();
        self.digest();
        self.association();
        self.relay();
        let distance_m = self.state.distance_m;
        for _ in 0..4 {
            self.float(|input| input.even(-distance_m, 2.0 * distance_m));
        }
        self.float(|input| input.even(0.0, 0.1 * distance_m));
        self.small(0, 15);
    }

    /// Appends a sequence number and a mission digest, the first fields of a Watch message.
    fn pass_of_mission(&mut self) {
        self.request_number();
        self.digest();
    }

    fn report(&mut self) {
        self.pass_of_mission();
        if self.small(0, 1) == 1 {
            self.several(18);
            self.small(0, 4);
            self.small(0, 4);
            self.word(0x3f80);
            self.several(2);
        }
        for _ in 0..self.small(0, 4) {
            self.relay();
            self.several(1);
            self.word(0x0804);
            self.several(9);
        }
    }

    fn several(&mut self, count: usize) {
        for _ in 0..count {
            let byte = self.input.byte();
            self.bytes.push(byte);
        }
    }

    fn moved(&mut self) {
        self.pass();
        self.place();
        self.altitude();
        self.small(0, 1);
        self.sir();
        self.power();
    }
}
