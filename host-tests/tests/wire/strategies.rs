//! What proptest draws: messages in range with all their extremes, bodies that are nearly messages, headers, streams.
//!
//! Nested ones are boxed: by value their trees overflow the stack of a test's thread.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay::wire::frame::Header;

use super::codec::{
    Call, Decided, Fenced, Greeting, Handed, Heard, Judged, Proposed, Said, Seats, Shifted,
    SizedView, Swept, plain, sealed, targets, wire,
};
use super::offered::{NUMBERS, offers};

/// The largest node number.
const MAX_NODE: u16 = 4094;

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

fn metres(least: f32) -> impl Strategy<Value = f32> {
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

/// Anchor, gap code and growth code of a valid ladder.
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

/// A sweep in range, of `least` reaches at least and with as many targets as that takes.
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
                    mission,
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

fn altitudes() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 15.0..400.0_f32, 1 => 0.1..=1e5_f32, 1 => Just(0.1), 1 => Just(1e5)]
}

fn powers() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.1..10.0_f32, 1 => 1e-6..=1e6_f32, 1 => Just(1e-6), 1 => Just(1e6)]
}

/// From 0 to `most`, small and large alike.
fn up_to(most: f32) -> BoxedStrategy<f32> {
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

/// The sweeps of `plain` with a measured Upsilon.
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

/// The sweeps of `plain` from beside the line.
pub(crate) fn asides(plain: BoxedStrategy<Said>) -> BoxedStrategy<Said> {
    (plain, beside())
        .prop_map(|(said, y_m)| match said {
            Said::Sweep(sweep) => Said::Aside { sweep, y_m },
            other => other,
        })
        .boxed()
}

/// How far from the line, on either side.
fn beside() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -100.0..=100.0_f32,
        1 => up_to(1e5),
        1 => up_to(1e5).prop_map(|y_m| -y_m),
    ]
}

/// What relays bring along, in range.
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
                mission,
                after,
                seats,
            }
        })
        .boxed()
}

/// A place along x.
fn along() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.0..=1000.0_f32, 1 => up_to(1e6)]
}

/// A turn's byte, how far it may go, columns and rows.
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
                    mission,
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
                mission,
                x_m,
                altitude_m,
                any,
                worst,
            })
        })
        .boxed()
}

/// How many relays, or which of them: small numbers mostly.
fn counts(least: u16) -> BoxedStrategy<u16> {
    prop_oneof![4 => least..=9, 1 => least..=1000, 1 => Just(least), 1 => Just(1000)].boxed()
}

/// The name of a view: of number 1 or more, by a node of a chain.
fn proposals() -> BoxedStrategy<u32> {
    let numbers = prop_oneof![4 => 1..8_u32, 1 => 1..=0x003F_FFFF_u32, 1 => Just(0x003F_FFFF)];
    (numbers, counts(1))
        .prop_map(|(number, node)| number << 10 | u32::from(node))
        .boxed()
}

/// A view that a node has proposed, and its size.
fn views() -> impl Strategy<Value = SizedView> {
    (proposals(), counts(1)).prop_map(|(id, relays)| SizedView { id, relays })
}

fn spans() -> impl Strategy<Value = u16> {
    prop_oneof![4 => 0..200_u16, 1 => any::<u16>(), 1 => Just(u16::MAX)]
}

/// A hello, a proposal, a decision or a fence.
fn formings() -> BoxedStrategy<Said> {
    let versions = || prop_oneof![4 => 0..8_u16, 1 => any::<u16>()];
    let stamps = || (any::<u16>(), versions());
    let newest = prop_oneof![4 => proposals(), 1 => Just(0), 1 => any::<u32>()];
    let sight = (0..16_u8, 0..32_u8);
    let near = (counts(0), counts(1));
    let numbers = (any::<u16>(), any::<u16>());
    let hello = (newest, numbers, near, stamps(), sight).prop_map(
        |(newest, (mission, nonce), (neighbour, behind), holds, (hears, flags))| {
            Said::Hello(Greeting {
                mission,
                neighbour,
                behind,
                newest,
                holds,
                nonce,
                hears,
                flags,
            })
        },
    );
    let calls = || {
        (stamps(), proposals(), counts(1)).prop_map(|(of, view, place)| Call { of, view, place })
    };
    // One after the other: what is agreed on, a view, what it was decided by, what is proposed.
    let order = [proposals(), proposals(), proposals(), proposals()].prop_map(|mut order| {
        order.sort_unstable();
        order
    });
    let order = prop_oneof![
        3 => order.clone(),
        1 => order.prop_map(|[_, a, b, c]| [0, a, b, c]),
    ];
    let votes = any::<proptest::sample::Index>();
    let sizes = (counts(1), votes, proptest::option::of(counts(1)));
    let proposal = (calls(), order, sizes, (spans(), spans()), any::<bool>()).prop_filter_map(
        "proposed before what has come of it",
        |(call, order, (relays, votes, successor), (lease_left, rest), proposer)| {
            let [agreed, id, decided_by, view] = order;
            let votes = votes.index(usize::from(relays) + 1);
            (decided_by < view).then_some(Said::Proposal(Proposed {
                call: Call { view, ..call },
                agreed: SizedView { id: agreed, relays },
                votes: u16::try_from(votes).unwrap(),
                lease_left,
                rest,
                proposer,
                successor: successor.map(|relays| (decided_by, SizedView { id, relays })),
            }))
        },
    );
    let granted = proptest::option::of(views());
    let bases = prop_oneof![
        3 => views(),
        1 => counts(1).prop_map(|relays| SizedView { id: 0, relays }),
    ];
    let decision = (calls(), bases, granted, counts(1), spans());
    let decision = decision.prop_filter_map(
        "proposed after what it follows",
        |(call, base, view, there, lease_left)| {
            (base.id < call.view).then_some(Said::Decision(Decided {
                call,
                base,
                view,
                there,
                lease_left,
            }))
        },
    );
    let fence = (
        1..=u16::MAX,
        any::<[u16; 3]>(),
        [-1e7, -1e7, -1e7, -1e7, 0.0].map(metres),
        0_u8..32,
    )
        .prop_map(|(number, [mission, echo, fence], places, flags)| {
            Said::Fence(Fenced {
                number,
                mission,
                echo,
                fence,
                places: [
                    places[0].min(1e7),
                    places[1].min(1e7),
                    places[2].min(1e7),
                    places[3].min(1e7),
                    places[4].min(1e5),
                ],
                flags,
            })
        });
    prop_oneof![hello, proposal, decision, fence].boxed()
}

/// A pulse, or what came back of one.
fn pulses() -> BoxedStrategy<Said> {
    let pulse = (any::<[u16; 2]>(), spans()).prop_map(|([number, mission], span)| Said::Pulse {
        number,
        mission,
        lease: span.max(1),
    });
    let pulsed =
        (any::<[u16; 2]>(), any::<bool>()).prop_map(|([number, mission], done)| Said::Pulsed {
            number,
            mission,
            done,
        });
    prop_oneof![pulse, pulsed].boxed()
}

/// What the relays hear and believe.
fn hearings() -> BoxedStrategy<Heard> {
    let powers =
        || prop_oneof![1 => Just(0.0), 3 => 1e-12..1e-3_f32, 1 => Just(1e-30), 1 => Just(1e6)];
    let sides = || {
        let any = (up_to(1e7), any::<bool>());
        any.prop_map(|(metres, below)| if below { -metres } else { metres })
    };
    let sources = prop_oneof![3 => 0.1..100.0_f32, 1 => Just(1e-6), 1 => Just(1e9)];
    let source = (sources, sides(), sides(), powers())
        .prop_map(|(power_w, x_m, y_m, receiver_w)| (4, [power_w, x_m, y_m, receiver_w]));
    let told = prop_oneof![1 => (0..4_u8).prop_map(|kind| (kind, [0.0; 4])), 2 => source];
    let sums = prop_oneof![1 => Just(vec![0.0; 18]), 4 => vec((up_to(f32::MAX), any::<bool>()), 18).prop_map(|sums| {
        let signed = |(at, (sum, below)): (usize, (f32, bool))| {
            if below && (1..14).contains(&at) { -sum } else { sum }
        };
        sums.into_iter().enumerate().map(signed).collect()
    })];
    let offs = prop_oneof![2 => Just(0), 2 => 1..9_u16, 1 => 0..=MAX_NODE, 1 => Just(MAX_NODE)];
    (any::<[u16; 3]>(), told, sums, (powers(), up_to(1e9)), offs)
        .prop_map(
            |([number, mission, told], (kind, source), sums, (heard_w, count), off)| Heard {
                number,
                mission,
                told,
                kind,
                source,
                sums: sums.try_into().unwrap(),
                receiver: [heard_w, count],
                off,
            },
        )
        .boxed()
}

/// What the relays hear and believe, onward or back.
pub(crate) fn heard() -> BoxedStrategy<Said> {
    prop_oneof![
        hearings().prop_map(Said::Sense),
        hearings().prop_map(Said::Sensed),
    ]
    .boxed()
}

fn questions() -> impl Strategy<Value = u16> {
    prop_oneof![2 => Just(0), 3 => 0..9_u16, 1 => any::<u16>()]
}

/// A message in range.
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
                mission,
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
        1 => (any::<u16>(), prop_oneof![Just(1e-30), 1e-12..1e-3_f32, Just(1e6)])
            .prop_map(|(mission, power_w)| Said::Level { mission, power_w }),
        1 => (any::<u16>(), questions(), questions())
            .prop_map(|(mission, ask, answer)| Said::Heartbeat { mission, ask, answer }),
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

/// Bytes that are a body, nearly one, or none.
pub(crate) fn bodies() -> BoxedStrategy<Vec<u8>> {
    let valid = || messages().prop_map(|said| said.body()).boxed();
    let replaced = (valid(), any::<proptest::sample::Index>(), any::<u8>()).prop_map(
        |(mut body, at, byte)| {
            let at = at.index(body.len());
            body[at] = byte;
            body
        },
    );
    let strange = proptest::sample::select(&[
        0.0,
        -0.0,
        -1.0,
        3e9,
        1e-40,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
    ]);
    let renumbered =
        (valid(), any::<proptest::sample::Index>(), strange).prop_map(|(mut body, at, number)| {
            // Where numbers begin in the messages of each tag; in lists every four bytes from the last of them.
            let starts: &[usize] = match body[0] {
                0 => &[5, 11, 15, 20, 24],
                1 => &[8, 9, body.len() - 4],
                4 | 5 => &[5, 11, 15, 19, 24, 28],
                6 => &[5, 9, 13, 17, 22, 26, 30, 34, 38],
                7 => &[6, 7, 10, 11, 70, 71],
                8 => &[5, 9, 13, 18, 24],
                9 => &[5, 9, 14],
                10..=12 => &[5, 7],
                14 => &NUMBERS,
                17 | 18 => &[8, 12, 16, 20, 24, 28, 80, 84, 88, 92, 96, 100],
                19 => &[3],
                _ => &[1],
            };
            let at = starts[at.index(starts.len())];
            if let Some(place) = body.get_mut(at..at + 4) {
                place.copy_from_slice(&f32::to_le_bytes(number));
            }
            body
        });
    let cut = (valid(), any::<proptest::sample::Index>()).prop_map(|(mut body, at)| {
        body.truncate(at.index(body.len()));
        body
    });
    let longer = (valid(), vec(any::<u8>(), 1..4)).prop_map(|(body, more)| [body, more].concat());
    // Every byte that is no part of a number.
    let recounted = (valid(), any::<proptest::sample::Index>(), any::<u8>()).prop_map(
        |(mut body, at, byte)| {
            let bytes: &[usize] = match body[0] {
                0 => &[9, 10, 19],
                1 => &[5, 6, 7, body.len() - 5, body.len() - 1],
                3 => &[3],
                4 | 5 => &[9, 10, 23],
                6 => &[21],
                7 => &[5, 6],
                8 => &[17, 22, 23],
                9 => &[13],
                10..=12 => &[5, 6, 7, 8, 9, 10, 11, 12, 13],
                14 => &[1, 2, 5, 6],
                17 | 18 => &[7, 104, 105],
                _ => &[0],
            };
            let at = bytes[at.index(bytes.len())];
            if let Some(place) = body.get_mut(at) {
                *place = if byte % 2 == 0 { byte / 2 % 20 } else { byte };
            }
            body
        },
    );
    let padded = (valid(), any::<bool>(), 0..9_usize).prop_map(|(mut body, tag, more)| {
        pad(&mut body, tag, more);
        body
    });
    let tagged = (0..=19_u8, vec(any::<u8>(), 0..=120)).prop_map(|(tag, mut body)| {
        body.insert(0, tag);
        body
    });
    prop_oneof![
        2 => valid(),
        3 => replaced.boxed(),
        2 => renumbered.boxed(),
        2 => recounted.boxed(),
        1 => cut.boxed(),
        1 => longer.boxed(),
        1 => padded.boxed(),
        2 => tagged.boxed(),
        1 => vec(any::<u8>(), 0..=120).boxed(),
    ]
    .boxed()
}

/// Writes the tag or the count of a body as a varint with one byte more, and another `more` on top.
pub(crate) fn pad(body: &mut Vec<u8>, tag: bool, more: usize) {
    let count = match body[0] {
        0 => 19,
        1 => 7 + usize::from(body[6]),
        4 | 5 => 23,
        6 | 7 => 7,
        _ => 0,
    };
    let at = if tag { 0 } else { count };
    body[at] |= 0x80;
    for _ in 0..more {
        body.insert(at + 1, 0x80);
    }
    body.insert(at + 1 + more, 0);
}

/// Pieces of a stream: good frames, damaged ones, noise, oversized ones, delimiters.
pub(crate) fn pieces(heads: impl Strategy<Value = Header> + 'static) -> BoxedStrategy<Vec<u8>> {
    let heads = heads.boxed();
    let good = (heads.clone(), messages())
        .prop_map(|(head, said)| wire(&plain(head, &said.body())))
        .boxed();
    let sealed_body = (heads, bodies()).prop_map(|(head, body)| wire(&plain(head, &body)));
    let sealed_noise = vec(any::<u8>(), 0..=124).prop_map(|bytes| wire(&sealed(bytes)));
    let damaged = (good.clone(), any::<proptest::sample::Index>(), 0..8_u8).prop_map(
        |(mut frame, at, bit)| {
            let at = at.index(frame.len());
            frame[at] ^= 1 << bit;
            frame
        },
    );
    let cut = (
        good.clone(),
        any::<proptest::sample::Index>(),
        any::<bool>(),
    )
        .prop_map(|(mut frame, at, ended)| {
            frame.truncate(at.index(frame.len()));
            if ended {
                frame.push(0);
            }
            frame
        });
    let noise = vec(any::<u8>(), 0..300);
    let oversized = vec(1..=u8::MAX, 100..700).prop_map(|mut bytes| {
        bytes.push(0);
        bytes
    });
    prop_oneof![
        4 => good,
        2 => sealed_body.boxed(),
        1 => sealed_noise.boxed(),
        2 => damaged.boxed(),
        1 => cut.boxed(),
        1 => noise.boxed(),
        1 => oversized.boxed(),
        1 => vec(Just(0), 1..4).boxed(),
    ]
    .boxed()
}
