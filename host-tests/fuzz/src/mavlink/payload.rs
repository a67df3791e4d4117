//! Payloads: padding, and numbers at an offset.

pub(super) fn sized(mut payload: Vec<u8>, length: usize) -> Vec<u8> {
    payload.resize(length, 0);
    payload
}

fn four(payload: &[u8], at: usize) -> [u8; 4] {
    let bytes = payload.get(at..).and_then(<[u8]>::first_chunk);
    bytes.copied().unwrap_or_default()
}

pub(super) fn long(payload: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(four(payload, at))
}

pub(super) fn float(payload: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(four(payload, at))
}
