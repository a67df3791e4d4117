//! Keyed BLAKE2s (RFC 7693), for tags of eight bytes.
//!
//! Implemented here because the available crates leave a panic in the image, or take more flash than `auth` may. In `blake2` 0.11
//! an `expect` in `block-buffer` stays reachable, and with `size_opt` bounds checks of its tables too. With `size_opt` and
//! `opt-level = 3` it takes 1.6 KB more, and 11 100 instead of 12 800 instructions for the tag of a full sweep; without
//! `size_opt` 3.7 KB more and 4800 instructions. `hmac-sha256` indexes by tables too, and `hmac` with `sha2` takes several times
//! the flash. The tests compare this implementation with `blake2`. No branch or address depends on key or message.

const BLOCK: usize = 64;

/// Initial state of BLAKE2s: 32 fractional bits of the square roots of the first eight primes.
const START: [u32; 8] = [
    0x6A09_E667,
    0xBB67_AE85,
    0x3C6E_F372,
    0xA54F_F53A,
    0x510E_527F,
    0x9B05_688C,
    0x1F83_D9AB,
    0x5BE0_CD19,
];

/// Indices of the 16 message words that each of the ten rounds of BLAKE2s uses (RFC 7693). The first eight are for the
/// columns, the last eight for the diagonals.
const ORDER: [[[u8; 8]; 2]; 10] = [
    [[0, 1, 2, 3, 4, 5, 6, 7], [8, 9, 10, 11, 12, 13, 14, 15]],
    [[14, 10, 4, 8, 9, 15, 13, 6], [1, 12, 0, 2, 11, 7, 5, 3]],
    [[11, 8, 12, 0, 5, 2, 15, 13], [10, 14, 3, 6, 7, 1, 9, 4]],
    [[7, 9, 3, 1, 13, 12, 11, 14], [2, 6, 5, 10, 4, 0, 15, 8]],
    [[9, 0, 5, 7, 2, 4, 10, 15], [14, 1, 11, 12, 6, 8, 3, 13]],
    [[2, 12, 6, 10, 0, 11, 8, 3], [4, 13, 7, 5, 15, 14, 1, 9]],
    [[12, 5, 1, 15, 14, 13, 4, 10], [0, 7, 6, 3, 9, 2, 8, 11]],
    [[13, 11, 7, 14, 12, 1, 3, 9], [5, 0, 15, 4, 8, 6, 2, 10]],
    [[6, 15, 14, 9, 11, 3, 0, 8], [12, 2, 13, 7, 1, 4, 10, 5]],
    [[10, 2, 8, 4, 7, 6, 1, 5], [15, 11, 9, 14, 3, 12, 13, 0]],
];

/// Returns the eight-byte keyed BLAKE2s digest of `first` followed by `second`. Together they have fewer than 2^32
/// bytes.
pub(crate) fn mac(key: &[u8; 32], first: &[u8], second: &[u8]) -> [u8; 8] {
    let mut state = START;
    let [parameters, ..] = &mut state;
    // Lengths of key and digest; no tree.
    *parameters ^= 0x0101_0000 ^ 32 << 8 ^ 8;
    let mut block = [0; BLOCK];
    for (place, byte) in block.iter_mut().zip(key) {
        *place = *byte;
    }
    let mut count = 64;
    let mut rest = first.iter().chain(second).copied();
    let mut next = rest.next();
    while next.is_some() {
        compress(&mut state, &block, count, false);
        block = [0; BLOCK];
        for place in &mut block {
            let Some(byte) = next else { break };
            *place = byte;
            count += 1;
            next = rest.next();
        }
    }
    compress(&mut state, &block, count, true);
    let [low, high, ..] = state;
    (u64::from(high) << 32 | u64::from(low)).to_le_bytes()
}

/// Compresses one block into the state; `count` is the number of bytes so far, including this block. `last` is true
/// for the last block.
#[inline(never)]
fn compress(state: &mut [u32; 8], block: &[u8; BLOCK], count: u32, last: bool) {
    let mut words = [0; 16];
    for (word, bytes) in words.iter_mut().zip(block.as_chunks().0) {
        *word = u32::from_le_bytes(*bytes);
    }
    let [a0, a1, a2, a3, b0, b1, b2, b3] = *state;
    let [c0, c1, c2, c3, d0, d1, d2, d3] = START;
    let end = if last { u32::MAX } else { 0 };
    let mut rows = [
        [a0, a1, a2, a3],
        [b0, b1, b2, b3],
        [c0, c1, c2, c3],
        [d0 ^ count, d1, d2 ^ end, d3],
    ];
    for [columns, diagonals] in &ORDER {
        mix(&mut rows, &words, *columns);
        turn(&mut rows);
        mix(&mut rows, &words, *diagonals);
        turn_back(&mut rows);
    }
    let [
        [a0, a1, a2, a3],
        [b0, b1, b2, b3],
        [c0, c1, c2, c3],
        [d0, d1, d2, d3],
    ] = rows;
    let upper = [a0, a1, a2, a3, b0, b1, b2, b3];
    let lower = [c0, c1, c2, c3, d0, d1, d2, d3];
    for (word, (upper, lower)) in state.iter_mut().zip(upper.into_iter().zip(lower)) {
        *word ^= upper ^ lower;
    }
}

/// Applies the function G of RFC 7693 to four columns, with two message words for each.
#[inline(never)]
fn mix(rows: &mut [[u32; 4]; 4], words: &[u32; 16], order: [u8; 8]) {
    let [a, b, c, d] = rows;
    let columns = a.iter_mut().zip(b).zip(c.iter_mut().zip(d));
    for (((a, b), (c, d)), [first, second]) in columns.zip(order.as_chunks().0) {
        // Every number in the table is below 16; the mask shows that to the compiler.
        let word = |number: u8| words.get(usize::from(number & 15)).copied().unwrap_or(0);
        *a = a.wrapping_add(*b).wrapping_add(word(*first));
        *d = (*d ^ *a).rotate_right(16);
        *c = c.wrapping_add(*d);
        *b = (*b ^ *c).rotate_right(12);
        *a = a.wrapping_add(*b).wrapping_add(word(*second));
        *d = (*d ^ *a).rotate_right(8);
        *c = c.wrapping_add(*d);
        *b = (*b ^ *c).rotate_right(7);
    }
}

/// Rotates the rows of the state, a 4 x 4 matrix, so that its diagonals become columns for [`mix`].
fn turn([_, b, c, d]: &mut [[u32; 4]; 4]) {
    *b = [b[1], b[2], b[3], b[0]];
    *c = [c[2], c[3], c[0], c[1]];
    *d = [d[3], d[0], d[1], d[2]];
}

fn turn_back([_, b, c, d]: &mut [[u32; 4]; 4]) {
    *b = [b[3], b[0], b[1], b[2]];
    *c = [c[2], c[3], c[0], c[1]];
    *d = [d[1], d[2], d[3], d[0]];
}

#[cfg(test)]
mod tests {
    use super::mac;
    use blake2::Blake2sMac;
    use blake2::digest::consts::U8;
    use blake2::digest::{FixedOutput, Mac};

    /// Checks that this implementation and the crate `blake2` return the same digests. The inputs have up to 299
    /// bytes, split at any point.
    #[test]
    fn the_hash_equals_the_published_one() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state.to_be_bytes()[0]
        };
        let bytes: [u8; 300] = core::array::from_fn(|_| random());
        for len in 0..bytes.len() {
            let key: [u8; 32] = core::array::from_fn(|_| random());
            let mut published = Blake2sMac::<U8>::new_from_slice(&key).unwrap();
            published.update(&bytes[..len]);
            let published: [u8; 8] = published.finalize_fixed().into();
            for cut in [0, 16, usize::from(random()), 64, 128] {
                let (first, second) = bytes[..len].split_at(cut.min(len));
                assert_eq!(
                    mac(&key, first, second),
                    published,
                    "{len} bytes, cut at {cut}"
                );
            }
        }
    }
}
