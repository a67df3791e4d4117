//! What may happen to a chain, and how it is drawn.
//!
//! A byte that picks a line, a relay or a frame is taken modulo how many there are, so that every operation does something
//! whatever has gone before it, and goes on doing something while a sequence is being shortened.

use proptest::collection::vec;
use proptest::prelude::*;

/// Something that happens to a chain. Lines are directions of links, counted among those that have a frame in flight.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    /// The next frame of a line arrives.
    Deliver(u8),
    /// The next frame of a line never arrives.
    Drop(u8),
    /// The next frame of a line arrives twice.
    Twice(u8),
    /// A frame of a line overtakes those before it.
    Overtake(u8, u8),
    /// So many frames of a line arrive in one read.
    Burst(u8, u8),
    /// The next frame of a line is held up for so many ms.
    Delay(u8, u16),
    /// The next frame of a line arrives with these bytes changed: where, and by which bits.
    Damage(u8, Vec<(u8, u8)>),
    /// Time passes until the next timer of any relay.
    Tick,
    /// Time passes, ms; every timer is served at its time, and nothing arrives.
    Wait(u16),
    /// Time passes, ms, while every main loop stands still: timers are served late, and after what arrives next.
    Sleep(u16),
    /// Time passes, ms, without faults: frames arrive in order.
    Flow(u16),
    /// A relay is switched off and on again, with another seed.
    Reboot(u8, u32),
    /// A link is cut, when so many bytes of the next frames have got through.
    Cut(u8, u8),
    /// A link is joined again.
    Join(u8),
    /// The leader is told to begin again.
    Restart,
    /// A frame that was sent on a line, whatever became of it, arrives: on a chain that signs its frames, which is meant to
    /// bear that.
    Replay(u8, u8),
    /// A relay measures, so many times the interference that was agreed on, in per cent.
    Measure(u8, u8),
}

/// From one seed to the next so many, the number of a leader's first pass is 64 larger: as near as two first ones can be.
const NEXT_LIFE: u32 = 54_336;

/// What a relay is started with: any seed, or one with which a leader's numbers are near those of a life before.
pub(crate) fn seeds() -> impl Strategy<Value = u32> {
    prop_oneof![any::<u32>(), (0..4_u32).prop_map(|life| life * NEXT_LIFE)]
}

/// Operations as a bad day has them: most let the chain go on, each fault comes every few dozen.
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
