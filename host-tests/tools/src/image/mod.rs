//! Flash images: from the ELF that cargo links to the files that flash a board.
//!
//! | file | content |
//! | --- | --- |
//! | [`board`] | supported boards |
//! | [`elf`] | loadable bytes and their addresses |
//! | [`uf2`] | UF2 files |
//! | [`hex`] | Intel HEX files |

pub mod board;
pub mod elf;
pub mod hex;
pub mod uf2;
