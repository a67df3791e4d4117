//! Operations on a chain and their random distribution.
//!
//! Bytes that select a line, a relay or a frame are taken modulo their number, so that every operation has an effect, also while
//! proptest shortens the sequence.

use proptest::collection::vec;
use proptest::prelude::*;

/// Operation on a chain. A line is one direction of a link, counted among those with a frame in flight.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    /// The next frame of a line arrives.
    Deliver(u8),
    /// The next frame on this line is lost.
    Drop(u8),
    /// The next frame of a line arrives twice.
    Twice(u8),
    /// A frame of one line overtakes the frames before it.
    Overtake(u8, u8),
    /// Several frames of one line arrive in one read: the line, and the number of frames.
    Burst(u8, u8),
    /// The next frame of a line is delayed: line, ms.
    Delay(u8, u16),
    /// The next frame of a line arrives damaged: line, and for each byte its position and the flipped bits.
    Damage(u8, Vec<(u8, u8)>),
    /// The clock advances to the next timer of any relay.
    Tick,
    /// The clock advances by this many ms: every timer is served in time, and no frames arrive.
    Wait(u16),
    /// The clock advances by this many ms while all main loops are suspended: timers are served late.
    Sleep(u16),
    /// The clock advances by this many ms without faults: frames arrive in order.
    Flow(u16),
    /// A relay reboots with another seed.
    Reboot(u8, u32),
    /// A link is cut after this many bytes of the next frames: link, bytes.
    Cut(u8, u8),
    /// A link is restored.
    Join(u8),
    /// The leader is commanded to restart the agreement.
    Restart,
    /// A recorded frame of a line arrives again, if the chain signs its frames, which must withstand that.
    Replay(u8, u8),
    /// A relay measures this percentage of the agreed interference: relay, per cent.
    Measure(u8, u8),
}

/// Seed increment that raises the number of a leader's first pass by 64, the smallest distance.
const NEXT_LIFE: u32 = 54_336;

/// Draws a relay's seed. Any, or one that makes a leader's pass numbers close to those of an earlier life.
pub(crate) fn seeds() -> impl Strategy<Value = u32> {
    prop_oneof![any::<u32>(), (0..4_u32).prop_map(|life| life * NEXT_LIFE)]
}

/// Draws an operation: most let the chain proceed, each fault comes every few dozen operations.
pub(crate) fn operations() -> impl Strategy<Value = Operation> {
    let pick = any::<u8>;
    prop_oneof![
        30 => pick().prop_map(Operation::Deliver),
        20 => Just(Operation::Tick),
        8 => (1..1_500_u16).prop_map(Operation::Flow),
        4 => (1..50_u16).prop_map(Operation::Wait),
        2 => (50..2_000_u16).prop_map(Operation::Wait),
        1 => (2_000..20_000_u16).prop_map(Operation::Sleep),
        3 => pick().prop_map(Operation::Drop),
        3 => pick().prop_map(Operation::Twice),
        3 => (pick(), pick()).prop_map(|(line, frame)| Operation::Overtake(line, frame)),
        3 => (pick(), 2..6_u8).prop_map(|(line, frames)| Operation::Burst(line, frames)),
        3 => (pick(), 1..3_000_u16).prop_map(|(line, ms)| Operation::Delay(line, ms)),
        3 => (pick(), vec((pick(), 1..=u8::MAX), 1..6))
            .prop_map(|(line, bytes)| Operation::Damage(line, bytes)),
        2 => (pick(), seeds()).prop_map(|(relay, seed)| Operation::Reboot(relay, seed)),
        1 => (pick(), pick()).prop_map(|(link, bytes)| Operation::Cut(link, bytes)),
        3 => pick().prop_map(Operation::Join),
        2 => Just(Operation::Restart),
        3 => (pick(), pick()).prop_map(|(line, frame)| Operation::Replay(line, frame)),
        3 => (pick(), 40..250_u8).prop_map(|(relay, part)| Operation::Measure(relay, part)),
    ]
}
