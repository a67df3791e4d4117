//! Consistent overhead byte stuffing: frames by a published encoder, and what a damaged one still says, by the definition.

/// `plain` without its zeros, and the delimiter.
pub fn stuffed(plain: &[u8]) -> Vec<u8> {
    let mut out = cobs::encode_vec(plain);
    out.push(0);
    out
}

/// The bytes that `stuffed`, without its delimiter, stands for, and whether its last run is whole.
///
/// No published decoder: a stream cut short is judged too, by what came before the cut.
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
