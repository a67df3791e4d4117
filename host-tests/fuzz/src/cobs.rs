//! Consistent overhead byte stuffing. Encoding by a published encoder, decoding of damaged frames by the definition.

/// Encodes `plain` and appends the delimiter.
pub fn stuffed(plain: &[u8]) -> Vec<u8> {
    let mut out = cobs::encode_vec(plain);
    out.push(0);
    out
}

/// Decodes `stuffed`, without its delimiter; returns the bytes, and true if the last run is complete.
///
/// A published decoder would not do, because a truncated stream is checked up to the cut, too.
pub fn unstuffed(stuffed: &[u8]) -> (Vec<u8>, bool) {
    let mut plain = Vec::with_capacity(stuffed.len());
    let (mut rest, mut whole) = (stuffed, true);
    while let Some((&code, after)) = rest.split_first() {
        let run = usize::from(code).saturating_sub(1);
        whole = run <= after.len();
        let (run, after) = after.split_at_checked(run).unwrap_or((after, &[]));
        plain.extend_from_slice(run);
        if code < 255 && !after.is_empty() {
            plain.push(0);
        }
        rest = after;
    }
    (plain, whole)
}
