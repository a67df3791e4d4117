//! Frames of uav-relay field by field: what each says, by the tables of `FORMAT.md`, or why it is refused.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`mod@format`] | the tables of `FORMAT.md`, read |
//! | [`value`], [`walk`] | what a field says; a body field by field |
//! | [`frame`], [`refusal`] | a frame, taken apart; why one is no message |
//! | [`members`] | whether tags are right |
//! | [`source`] | frames from a capture or a stream of bytes |
//! | [`shown`] | a frame as text and as JSON |
//! | [`dissector`] | the same tables for Wireshark |

pub mod dissector;
pub mod format;
pub mod frame;
pub mod members;
pub mod refusal;
pub mod shown;
pub mod source;
pub mod value;
pub mod walk;
