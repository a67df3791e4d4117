//! Decoder of uav-relay frames by the tables of `FORMAT.md`: fields, or the reason of a rejection.
//!
//! `format`, `value`, `walk`, `write`, `range` and `draw` are a second codec. They share no code with the crate.
//!
//! | module | content |
//! | --- | --- |
//! | [`mod@format`] | the tables of `FORMAT.md` |
//! | [`value`], [`walk`], [`mod@write`] | values of fields; decoding and encoding of a body |
//! | [`range`] | ranges of the values |
//! | [`draw`] | random messages, valid over the whole range of every field |
//! | [`envelope`] | frame around a body: header, CRC and COBS |
//! | [`frame`], [`refusal`] | a decoded frame; reasons for rejection |
//! | [`tags`] | verification of tags |
//! | [`source`] | frames from a capture or a byte stream |
//! | [`shown`] | a frame as text and as JSON |
//! | [`vectors`] | test vectors |
//! | [`dissector`] | the Wireshark dissector |

pub mod dissector;
pub mod draw;
pub mod envelope;
pub mod format;
pub mod frame;
pub mod range;
pub mod refusal;
pub mod shown;
pub mod source;
pub mod tags;
pub mod value;
pub mod vectors;
pub mod walk;
pub mod write;
