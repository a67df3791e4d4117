//! Mission offers of a malicious neighbour: mostly numbers in range, some equal to the relay's own.

use super::parts::Body;

/// First five numbers of the paper's mission, in the order in which a mission offer has them.
///
/// Distance from Tx to Rx, m; minimum separation, m; power of Tx, W; altitude of every relay, m; power of every relay,
/// W.
const PAPER: [f32; 5] = [1000.0, 4.0, 80.0, 20.0, 1.0];

/// Path-loss factors of the paper: with line of sight, then without.
const LOSSES: [f64; 2] = [7_191.8, 884_786.1];

/// Positions of Tx, then Rx: latitude and longitude, 1e-7 degrees, and height, mm. Their distance is exactly 1000 m.
const SITES: [i32; 6] = [
    474_000_000,
    85_400_000,
    420_000,
    474_000_000,
    85_532_474,
    431_000,
];

impl Body<'_, '_> {
    pub(super) fn offer(&mut self) {
        self.version();
        self.digest();
        self.all();
        if self.input.flag() {
            self.paper();
        } else {
            self.wild();
        }
        let choice = self.input.byte();
        self.reals(&[if choice % 16 == 7 { 1e-12 } else { 0.0 }]);
        // SIR needed toward Tx, and power of Rx, W.
        self.reals(if choice % 16 == 9 {
            &[0.5, 5.0]
        } else {
            &[0.0, 80.0]
        });
        // SNR gap of fitted slots.
        self.reals(&[if choice % 16 == 11 { 2.0 } else { 0.0 }]);
        self.sites(choice);
        self.answer(choice);
    }

    /// Appends the number of the hello that the offer answers.
    ///
    /// If `choice` is below 240, it is the number of the relay's last hello; otherwise the fuzzer's input gives any
    /// number.
    fn answer(&mut self, choice: u8) {
        let answer = match choice {
            0..240 => self.state.offer_number,
            _ => self.input.word(),
        };
        self.word(answer);
    }

    /// Appends the positions of Tx and Rx, chosen by `choice`.
    ///
    /// In most cases all six numbers are 0, so that the offer has no positions. Otherwise the numbers are arbitrary, or
    /// the distance from Tx to Rx is 1000 m as in the paper.
    fn sites(&mut self, choice: u8) {
        let sites = match choice % 16 {
            0..12 => [0; 6],
            12..14 => SITES,
            _ => core::array::from_fn(|_| self.input.long().cast_signed()),
        };
        for number in sites {
            self.bytes.extend_from_slice(&number.to_le_bytes());
        }
    }

    /// Appends the version of the offered mission.
    ///
    /// It is the newest version that the tested relay stores, one of the next three versions, or any number.
    fn version(&mut self) {
        let held = self.state.held.version;
        let version = match self.input.byte() {
            up @ 0..240 => held.wrapping_add(u16::from(up % 4)),
            _ => self.input.word(),
        };
        self.word(version);
    }

    /// Appends the offered mission's number of relays: mostly that of the mission loaded before flight.
    fn all(&mut self) {
        let relays = match self.input.byte() {
            0..240 => self.state.relays,
            _ => self.input.word(),
        };
        self.word(relays);
    }

    /// Appends the paper's mission with another interferer, an altitude range and a lateral range.
    fn paper(&mut self) {
        self.reals(&PAPER);
        self.float(|input| input.scaled(1.0, 1e4));
        self.float(|input| input.even(-500.0, 1500.0));
        self.float(|input| input.even(-1000.0, 1000.0));
        self.reals(&[1e-4]);
        let [los, nlos] = LOSSES;
        self.losses([los, nlos, los]);
        let most_m = if self.input.flag() { 300.0 } else { 20.0 };
        self.reals(&[20.0, most_m]);
        let room_m = if self.input.flag() { 0.0 } else { 50.0 };
        self.reals(&[-room_m, room_m]);
    }

    fn wild(&mut self) {
        let distance_m = self.input.scaled(1.0, 1e6);
        self.float(|_| distance_m);
        let apart = distance_m / f32::from(self.state.relays.max(1));
        self.float(|input| input.even(0.0, apart));
        self.power();
        let (one, other) = (self.input.scaled(0.1, 1e5), self.input.scaled(0.1, 1e5));
        let (least_m, most_m) = (one.min(other), one.max(other));
        self.float(|input| input.even(least_m, most_m));
        self.power();
        self.float(|input| input.scaled(1e-6, 1e9));
        for _ in 0..2 {
            self.float(|input| input.even(-1e7, 1e7));
        }
        self.float(|input| input.scaled(1e-6, 0.1));
        let los = f64::from(self.input.scaled(1e-3, 1e30)).clamp(1e-3, 1e30);
        let nlos = los * f64::from(self.input.scaled(1.0, 1e20)).min(1e20);
        let eta = if self.input.flag() { los } else { nlos };
        self.losses([los, nlos, eta]);
        self.float(|_| least_m);
        self.float(|_| most_m);
        self.float(|input| input.even(-1e5, 0.0));
        self.float(|input| input.even(0.0, 1e5));
    }

    /// Appends the mission's three path-loss factors `losses`. In rare cases any number replaces one of them.
    fn losses(&mut self, mut losses: [f64; 3]) {
        let which = usize::from(self.input.byte());
        if let Some(loss) = losses.get_mut(which) {
            let (low, high) = (self.input.long(), self.input.long());
            *loss = f64::from_bits(u64::from(high) << 32 | u64::from(low));
        }
        for loss in losses {
            self.bytes.extend_from_slice(&loss.to_le_bytes());
        }
    }

    fn reals(&mut self, numbers: &[f32]) {
        for number in numbers {
            self.bytes.extend_from_slice(&number.to_le_bytes());
        }
    }
}
