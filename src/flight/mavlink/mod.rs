//! MAVLink 2 subset for a companion: a table of messages, numbers instead of enums, and no panics.
//!
//! | module | content |
//! | --- | --- |
//! | [`frame`] | known messages: id, CRC seed, length; frame layout, and the checksum |
//! | [`incoming`] | messages from an autopilot; frames from a byte stream; units of a SiK radio |
//! | [`outgoing`] | messages of a companion |
//! | `signing` | signatures, with the feature `mavlink-signing` |
//!
//! Unknown enum values and unknown messages cost only their bytes. MAVLink 1 is not supported. An autopilot that starts
//! with it changes to MAVLink 2 once it has received a MAVLink 2 frame.

pub mod frame;
pub mod incoming;
pub mod outgoing;
#[cfg(feature = "mavlink-signing")]
pub mod signing;
/// Replacement for the module `signing` without the feature `mavlink-signing`. The type `Signing` has no values, so
/// that the compiler drops all code that signs.
#[cfg(not(feature = "mavlink-signing"))]
pub(crate) mod signing {
    use super::incoming::Received;
    use super::outgoing::FrameBytes;
    use crate::time::Instant;

    pub(crate) enum Flaw {
        Unsigned,
        Key,
        Old,
    }

    #[derive(Clone, Debug)]
    pub(crate) enum Signing {}

    impl Signing {
        pub(crate) fn sign(&mut self, _: Instant, _: FrameBytes) -> FrameBytes {
            match *self {}
        }

        pub(crate) fn check(&mut self, _: Instant, _: &Received, _: &[u8]) -> Result<(), Flaw> {
            match *self {}
        }
    }
}
