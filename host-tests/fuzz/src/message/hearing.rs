//! Sensing messages of a malicious neighbour: sums as relays compute them, or any eighteen numbers.

use super::parts::Body;
use crate::input::Input;

/// Number of sums over all measurements in a sensing message.
const SUMS: usize = 18;

impl Body<'_, '_> {
    pub(super) fn hearing(&mut self) {
        self.pass();
        self.request_number();
        if self.small(0, 4) == 4 {
            let distance_m = self.state.distance_m;
            self.float(|input| input.scaled(1e-6, 1e9));
            self.float(|input| input.even(-distance_m, 2.0 * distance_m));
            self.float(|input| input.even(-distance_m, distance_m));
            self.level_or_none();
        } else {
            self.bytes.extend_from_slice(&[0; 16]);
        }
        if self.input.below(4) == 0 {
            let most = self.input.scaled(1e-30, f32::MAX);
            for _ in 0..SUMS {
                self.float(|input| input.even(-most, most));
            }
        } else {
            for sum in of_places(self.input) {
                self.bytes.extend_from_slice(&sum.to_le_bytes());
            }
        }
        self.level_or_none();
        self.float(|input| input.scaled(1e-6, 1e9));
        self.relay();
    }

    pub(super) fn level(&mut self) {
        self.digest();
        self.float(|input| input.scaled(1e-30, 1e6));
    }

    /// Appends the interference power measured at Tx or Rx, W; 0 if none was measured.
    fn level_or_none(&mut self) {
        if self.input.flag() {
            self.float(|input| input.scaled(1e-30, 1e6));
        } else {
            self.bytes.extend_from_slice(&[0; 4]);
        }
    }
}

/// Returns the sums over random measurements at up to eight positions, as in a sensing message.
///
/// `input` decides if the powers are those of one interferer, or arbitrary.
fn of_places(input: &mut Input<'_>) -> [f32; SUMS] {
    let of_one = input.flag();
    let unit = input.scaled(1e-6, 1e12);
    let source = [input.even(-1.0, 3.0), input.even(-2.0, 2.0)];
    let mut sums = [0.0; SUMS];
    for _ in 0..input.below(9) {
        let [u, t, z] = [(); 3].map(|()| input.even(-1.0, 1.0));
        let v = if of_one {
            let [x, y] = source;
            unit * ((u - x) * (u - x) + (t - y) * (t - y) + z * z)
        } else {
            input.scaled(1e-12, 1e12)
        };
        let terms = [1.0, u, u * u - 1.0 / 3.0 + t * t + z * z, t];
        let weight = 1.0 / (v * v);
        let pairs = (0..4).flat_map(|one| (one..4).map(move |other| (one, other)));
        let products = pairs.filter_map(|(one, other)| {
            let number = terms.get::<usize>(one)? * terms.get::<usize>(other)?;
            Some(weight * number)
        });
        let with_v = terms.map(|term| weight * term * v);
        let rest = [weight * v * v, 1.0, 10.0, 1.0];
        let row = products.chain(with_v).chain(rest);
        for (sum, number) in sums.iter_mut().zip(row) {
            *sum += number;
        }
    }
    sums
}
