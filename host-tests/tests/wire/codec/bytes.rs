//! Encoders of the parts of bodies.

/// Encodes the start of a pass: tag, number, digest.
pub(super) fn pass(tag: u8, numbers: [u16; 2]) -> Vec<u8> {
    let mut out = vec![tag];
    words(&mut out, &numbers);
    out
}

pub(super) fn words(out: &mut Vec<u8>, numbers: &[u16]) {
    for number in numbers {
        out.extend(number.to_le_bytes());
    }
}

pub(super) fn option(out: &mut Vec<u8>, byte: Option<u8>) {
    match byte {
        None => out.push(0),
        Some(byte) => out.extend([1, byte]),
    }
}

pub(super) fn reals(out: &mut Vec<u8>, numbers: &[f32]) {
    for number in numbers {
        out.extend(number.to_le_bytes());
    }
}

pub(super) fn list(out: &mut Vec<u8>, numbers: &[f32]) {
    out.push(u8::try_from(numbers.len()).unwrap());
    reals(out, numbers);
}
