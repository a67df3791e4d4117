//! CRC-32C (Castagnoli), the check sequence at the end of every frame.
//!
//! Its Hamming distance is 6 for the lengths used here; that of CRC-32 is 5. The table of 256 words takes 1 KiB of flash. Without
//! a table a full sweep, for which the CRC is computed twice, is far above its budget of instructions.

use crc::{CRC_32_ISCSI, Crc, Table};

/// CRC-32C: constant work per byte.
pub static CRC_32C: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);
