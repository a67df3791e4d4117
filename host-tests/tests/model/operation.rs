//! Operations on a chain and their random distribution.
//!
//! Bytes that select a line, a relay or a frame are taken modulo their number, so that every operation has an effect, also while
//! proptest shortens the sequence.

use proptest::collection::vec;
use proptest::prelude::*;

/// Operation on the simulated chain. A line is one direction of a link between neighbours. Only lines with a frame in
/// transit are numbered.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    /// The next frame on a line (one direction of a link) arrives.
    Deliver(u8),
    /// The next frame on a line (one direction of a link) is lost.
    Drop(u8),
    /// The next frame on a line (one direction of a link) arrives twice.
    Twice(u8),
    /// A frame overtakes frames before it. The fields are the line (direction of a link) and a number that selects
    /// one to four frames to overtake.
    Overtake(u8, u8),
    /// Several frames arrive in one read. The fields are the line (direction of a link) and the number of frames.
    Burst(u8, u8),
    /// The next frame on a line is delayed. The fields are the line (direction of a link) and the delay, ms.
    Delay(u8, u16),
    /// The next frame on a line arrives damaged. The fields are the line (direction of a link) and, for each damaged
    /// byte, its position and the flipped bits.
    Damage(u8, Vec<(u8, u8)>),
    /// The clock advances to the next timer of any relay.
    Tick,
    /// The clock advances by this many ms. Every timer is served in time, but no frames arrive.
    Wait(u16),
    /// The clock advances by this many ms while no main loop runs, so that timers are served late.
    Sleep(u16),
    /// The clock advances by this many ms without faults. Frames arrive in order.
    Flow(u16),
    /// A relay reboots. The fields are the relay and its new seed.
    Reboot(u8, u32),
    /// A link is cut. The fields are the link, and the number of bytes of the next frames that still arrive.
    Cut(u8, u8),
    /// A link that was cut is restored.
    Join(u8),
    /// The leader is commanded to restart the agreement on positions.
    Restart,
    /// A recorded frame arrives again, if the chain signs its frames. The fields are the line (direction of a link)
    /// and the frame.
    Replay(u8, u8),
    /// A relay measures interference. The fields are the relay, and the power in per cent of the agreed power.
    Measure(u8, u8),
}

/// Difference between two successive random seeds of a leader. It raises the number of the leader's first message by
/// 64, the smallest possible increase. A leader that reboots with such a seed therefore repeats recent numbers.
const NEXT_LIFE: u32 = 54_336;

/// Draws a relay's random seed. With some seeds, a rebooted leader repeats its recent message numbers, which is hard
/// to handle.
pub(crate) fn seeds() -> impl Strategy<Value = u32> {
    prop_oneof![any::<u32>(), (0..4_u32).prop_map(|life| life * NEXT_LIFE)]
}

/// Draws an operation. Most operations let the chain proceed; each fault comes every few dozen operations.
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
