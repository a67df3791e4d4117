//! CRC-32C (Castagnoli), the check sequence at the end of every frame.
//!
//! Its Hamming distance is 6 for the lengths used here, where the older CRC-32 has 5. The table of 256 words takes 1 KiB of
//! flash. Without one a full sweep, which passes the CRC twice, is far above its budget.

use crc::{CRC_32_ISCSI, Crc, Table};

/// CRC-32C: constant work a byte.
pub static CRC_32C: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);
