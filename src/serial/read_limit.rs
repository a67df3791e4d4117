//! Bound on the work of one poll.

#![cfg_attr(
    not(any(doc, feature = "internals")),
    allow(
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

/// Largest number of bytes, or of failed reads, that one poll takes from one port.
pub const READ_LIMIT: usize = 64;
