//! Range of node numbers.

/// Largest node number of an address; 4095 is reserved for a broadcast.
pub const MAX_NODE: u16 = 4094;
