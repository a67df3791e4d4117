//! Bytes on the link: [`deframe`] cuts the byte stream at delimiters and undoes COBS, [`frame`] checks integrity and holds
//! the addresses, [`message`] is what neighbours say, [`digest`] how they tell missions apart. `FORMAT.md` beside this file has byte tables and examples.

mod body;
pub mod crc;
pub mod deframe;
pub mod digest;
pub mod frame;
pub mod message;
