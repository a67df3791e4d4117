//! From what cargo has linked to what a board is flashed with.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`board`] | the boards: what is built for each, and what it takes |
//! | [`elf`] | the bytes of an image, and where they go |
//! | [`uf2`] | the blocks of a UF2 file |
//! | [`hex`] | Intel HEX |

pub mod board;
pub mod elf;
pub mod hex;
pub mod uf2;
