//! Consistent overhead byte stuffing by its definition, to hold the crate's own against.

/// `plain` without its zeros, and the delimiter.
pub fn stuffed(plain: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(plain.len() + 3);
    let mut runs = plain.split(|&byte| byte == 0).peekable();
    while let Some(mut run) = runs.next() {
        let last = runs.peek().is_none();
        // A full run has no zero after it; the last one may be full without another behind it.
        while let Some((full, rest)) = run.split_at_checked(254)
            && !(last && rest.is_empty())
        {
            out.push(255);
            out.extend_from_slice(full);
            run = rest;
        }
        out.push(u8::try_from(run.len() + 1).unwrap_or(u8::MAX));
        out.extend_from_slice(run);
    }
    out.push(0);
    out
}

/// The bytes that `stuffed`, without its delimiter, stands for, and whether its last run is whole.
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
