//! The numbers of nodes.

/// The largest node number an address can hold; 4095 is kept for a broadcast.
pub const MAX_NODE: u16 = 4094;
