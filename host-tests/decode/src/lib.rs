//! Decoder of uav-relay frames: each field by the tables of `FORMAT.md`, or the reason for rejection.
//!
//! | module | content |
//! | --- | --- |
//! | [`mod@format`] | the tables of `FORMAT.md` |
//! | [`value`], [`walk`] | values of fields; decoding of a body |
//! | [`frame`], [`refusal`] | a decoded frame; reasons for rejection |
//! | [`members`] | verification of tags |
//! | [`source`] | frames from a capture or a byte stream |
//! | [`shown`] | a frame as text and as JSON |
//! | [`dissector`] | the Wireshark dissector |

pub mod dissector;
pub mod format;
pub mod frame;
pub mod members;
pub mod refusal;
pub mod shown;
pub mod source;
pub mod value;
pub mod walk;
