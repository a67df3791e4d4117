//! Serial numbers of 16 bits that wrap around, compared as in RFC 1982.

/// Returns the number after `number`. It is never 0, which stands for "no number".
#[inline(never)] // called from several places
pub(crate) const fn next_nonzero(number: u16) -> u16 {
    match number.wrapping_add(1) {
        0 => 1,
        next => next,
    }
}

/// Returns true if `number` is newer than `than`: at most 32 767 numbers ahead of it.
pub(crate) const fn is_newer(number: u16, than: u16) -> bool {
    let ahead = number.wrapping_sub(than);
    ahead != 0 && ahead < 0x8000
}

#[cfg(test)]
mod tests {
    use super::{is_newer, next_nonzero};

    #[test]
    fn numbers_are_newer_across_the_wrap() {
        for (number, than, expected) in [
            (2, 1, true),
            (1, 1, false),
            (1, 2, false),
            (0, u16::MAX, true),
            (5, u16::MAX - 5, true),
            (0x8000, 1, true),
            (0x8001, 1, false),
        ] {
            assert_eq!(is_newer(number, than), expected, "{number}, {than}");
        }
    }

    #[test]
    fn no_number_follows_the_largest_but_one() {
        assert_eq!(next_nonzero(u16::MAX), 1);
        assert_eq!(next_nonzero(7), 8);
    }
}
