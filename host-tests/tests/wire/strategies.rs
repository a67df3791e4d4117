//! Random messages, nearly valid bodies, headers and streams.
//!
//! Nested strategies are boxed: by value their trees overflow the stack of a test's thread.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay::wire::frame::Header;
use uav_relay_decode::range::targets;

use super::codec::{Handed, Judged, Said, Seats, Shifted, Swept};
use super::offered::offers;
use super::view_strategies::{formings, heard, pulses};

pub(crate) const MAX_NODE: u16 = 4094;

pub(crate) fn headers() -> impl Strategy<Value = Header> {
    (any::<u16>(), 0..=MAX_NODE, 0..=MAX_NODE, any::<u32>()).prop_map(
        |(network, sender, destination, counter)| Header {
            network,
            sender,
            destination,
            counter,
        },
    )
}

pub(crate) fn metres(least: f32) -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => least.max(-1e6)..=1e6_f32,
        2 => least..=2e9_f32,
        1 => Just(least),
        1 => Just(2e9_f32),
        1 => Just(0.0),
        1 => Just(-0.0),
        1 => Just(f32::from_bits(1)),
    ]
}

/// Draws anchor, gap code and growth code of a valid ladder.
pub(crate) fn ladders() -> BoxedStrategy<(f32, u8, u8)> {
    let ordinary = (-20.0..20.0_f32).prop_map(f32::exp2);
    let any_normal = (0x0080_0000..0x7F80_0000_u32).prop_map(f32::from_bits);
    let anchors = prop_oneof![3 => ordinary, 1 => any_normal];
    let growths = prop_oneof![1 => Just(0), 3 => 0..32_u8, 1 => any::<u8>()];
    (anchors, any::<u8>(), growths)
        .prop_map(|(anchor, gap, growth)| (anchor, gap, if gap == 0 { 0 } else { growth }))
        .prop_filter("a ladder within the f32s", |&(anchor, gap, growth)| {
            let targets = targets(anchor, gap, growth);
            targets[0] >= f32::MIN_POSITIVE && targets[targets.len() - 1].is_finite()
        })
        .boxed()
}

pub(crate) fn sweeps(least: usize) -> BoxedStrategy<Said> {
    let ladders = prop_oneof![
        4 => ladders(),
        1 => (0.1..10.0_f32).prop_map(|anchor| (anchor, 0, 0)),
    ]
    .prop_filter("room for the reaches", move |&(_, gap, _)| {
        gap > 0 || least <= 1
    });
    let altitudes = prop_oneof![0.1..=1e5_f32, Just(0.1), Just(1e5)];
    let powers = prop_oneof![1e-6..=1e6_f32, Just(1e-6), Just(1e6)];
    // One pass in four is a plain one.
    let signs = prop_oneof![3 => Just(1.0_f32), 1 => Just(-1.0)];
    let numbers = (any::<u16>(), any::<u16>());
    (
        numbers,
        (ladders, signs),
        altitudes,
        powers,
        vec(metres(0.0), least..=16),
    )
        .prop_map(
            |(
                (number, mission),
                ((anchor, gap, growth), sign),
                altitude_m,
                power_w,
                mut reaches,
            )| {
                if gap == 0 {
                    reaches.truncate(1);
                }
                Said::Sweep(Swept {
                    number,
                    view_digest: mission,
                    anchor: sign * anchor,
                    gap,
                    growth,
                    altitude_m,
                    power_w,
                    reaches,
                })
            },
        )
        .boxed()
}

pub(crate) fn altitudes() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 15.0..400.0_f32, 1 => 0.1..=1e5_f32, 1 => Just(0.1), 1 => Just(1e5)]
}

pub(crate) fn powers() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.1..10.0_f32, 1 => 1e-6..=1e6_f32, 1 => Just(1e-6), 1 => Just(1e6)]
}

/// Draws from 0 to `most` over all magnitudes.
pub(crate) fn up_to(most: f32) -> BoxedStrategy<f32> {
    let any_size = (-40.0..=most.log2())
        .prop_map(f32::exp2)
        .prop_map(move |number| number.min(most));
    prop_oneof![
        2 => 0.0..=most,
        4 => any_size,
        1 => Just(0.0),
        1 => Just(-0.0),
        1 => Just(f32::from_bits(1)),
        1 => Just(most),
    ]
    .boxed()
}

fn sirs() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.0..10.0_f32, 1 => up_to(f32::MAX)]
}

/// Adds a measured Upsilon to the sweeps of `plain`.
pub(crate) fn measured(plain: BoxedStrategy<Said>) -> BoxedStrategy<Said> {
    let upsilons = prop_oneof![
        4 => (-29.0..106.0_f32).prop_map(f32::exp2),
        1 => Just(1e-9),
        1 => Just(1e32),
    ];
    (plain, upsilons)
        .prop_map(|(said, upsilon_per_w)| match said {
            Said::Sweep(sweep) => Said::Measured {
                sweep,
                upsilon_per_w,
            },
            other => other,
        })
        .boxed()
}

/// Adds a lateral offset to the sweeps of `plain`.
pub(crate) fn asides(plain: BoxedStrategy<Said>) -> BoxedStrategy<Said> {
    (plain, beside())
        .prop_map(|(said, y_m)| match said {
            Said::Sweep(sweep) => Said::Aside { sweep, y_m },
            other => other,
        })
        .boxed()
}

/// Draws a lateral offset on either side.
fn beside() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -100.0..=100.0_f32,
        1 => up_to(1e5),
        1 => up_to(1e5).prop_map(|y_m| -y_m),
    ]
}

/// Draws valid profiles of relays.
fn rosters() -> BoxedStrategy<Seats> {
    let held = prop_oneof![1 => Just(0.0), 2 => altitudes()];
    let numbers = (any::<u16>(), any::<u16>());
    let afters = prop_oneof![4 => Just(0), 1 => 0..1000_u16];
    (numbers, afters, vec((1..9_u16, held, powers()), 0..=8))
        .prop_map(|((number, mission), after, mut seats)| {
            let mut last = after;
            for seat in &mut seats {
                last += seat.0;
                seat.0 = last;
            }
            seats.retain(|seat| seat.0 <= 1000);
            Seats {
                number,
                view_digest: mission,
                after,
                seats,
            }
        })
        .boxed()
}

/// Draws a position along x.
pub(crate) fn along() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.0..=1000.0_f32, 1 => up_to(1e6)]
}

/// Draws a turn's byte, range, columns and rows.
fn turns() -> BoxedStrategy<(u8, f32, u8, u8)> {
    prop_oneof![
        1 => Just((0, 0.0, 0, 0)),
        1 => Just((1, 0.0, 0, 0)),
        2 => up_to(1e5).prop_map(|explore_m| (2, explore_m, 0, 0)),
        2 => (up_to(1e5), 2..12_u8, 2..12_u8).prop_map(|(most, columns, rows)| (2, most, columns, rows)),
        1 => (up_to(1e5), 2..=u8::MAX, 2..=u8::MAX)
            .prop_map(|(most, columns, rows)| (2, most, columns, rows)),
    ]
    .boxed()
}

fn tokens() -> BoxedStrategy<Said> {
    let numbers = (any::<u16>(), any::<u16>());
    (numbers, along(), altitudes(), powers(), turns(), sirs())
        .prop_map(
            |(
                (number, mission),
                x_m,
                altitude_m,
                power_w,
                (turn, explore_m, columns, rows),
                sir,
            )| {
                Said::Token(Handed {
                    number,
                    view_digest: mission,
                    x_m,
                    altitude_m,
                    power_w,
                    turn,
                    explore_m,
                    columns,
                    rows,
                    sir,
                })
            },
        )
        .boxed()
}

fn moves() -> BoxedStrategy<Said> {
    let numbers = (any::<u16>(), any::<u16>());
    (numbers, along(), altitudes(), any::<bool>(), sirs())
        .prop_map(|((number, mission), x_m, altitude_m, any, worst)| {
            Said::Moved(Shifted {
                number,
                view_digest: mission,
                x_m,
                altitude_m,
                any,
                worst,
            })
        })
        .boxed()
}

fn questions() -> impl Strategy<Value = u16> {
    prop_oneof![2 => Just(0), 3 => 0..9_u16, 1 => any::<u16>()]
}

pub(crate) fn messages() -> BoxedStrategy<Said> {
    let verdicts = (
        any::<u16>(),
        any::<u16>(),
        any::<bool>(),
        proptest::option::of(0..16_u8),
        vec(metres(-2e9), 0..=16),
        proptest::option::of(along()),
    )
        .prop_map(|(number, mission, own, commit, slacks, stand)| {
            Said::Verdict(Judged {
                number,
                view_digest: mission,
                own,
                commit,
                slacks,
                stand,
            })
        });
    prop_oneof![
        3 => sweeps(0),
        3 => verdicts,
        1 => any::<u16>().prop_map(|number| Said::Busy { number }),
        1 => (any::<[u32; 2]>(), 0..4_u8).prop_map(|([number, heard], flags)| Said::Claim { number, other_number: heard, flags }),
        1 => (any::<u16>(), prop_oneof![Just(1e-30), 1e-12..1e-3_f32, Just(1e6)])
            .prop_map(|(mission, power_w)| Said::Level { mission, power_w }),
        1 => (any::<u16>(), questions(), questions())
            .prop_map(|(mission, ask, answer)| Said::Heartbeat { mission, request: ask, reply: answer }),
        2 => measured(sweeps(0)),
        2 => asides(sweeps(0)),
        2 => rosters().prop_map(Said::Gather),
        2 => rosters().prop_map(Said::Gathered),
        2 => tokens(),
        2 => moves(),
        3 => formings(),
        2 => pulses(),
        2 => offers(),
        3 => heard(),
    ]
    .boxed()
}
