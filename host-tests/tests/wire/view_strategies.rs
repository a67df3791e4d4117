//! Random messages on views and on interference.

use proptest::collection::vec;
use proptest::prelude::*;

use super::codec::{Call, Decided, Fenced, Greeting, Heard, Proposed, Said, SizedView};

use super::strategies::{MAX_NODE, metres, up_to};

/// Draws a number of relays or an index, mostly small.
pub(crate) fn counts(least: u16) -> BoxedStrategy<u16> {
    prop_oneof![4 => least..=9, 1 => least..=1000, 1 => Just(least), 1 => Just(1000)].boxed()
}

/// Draws a view identifier: number 1 or more, proposed by a node of a chain.
fn proposals() -> BoxedStrategy<u32> {
    let numbers = prop_oneof![4 => 1..8_u32, 1 => 1..=0x003F_FFFF_u32, 1 => Just(0x003F_FFFF)];
    (numbers, counts(1))
        .prop_map(|(number, node)| number << 10 | u32::from(node))
        .boxed()
}

/// Draws a proposed view with its size.
fn views() -> impl Strategy<Value = SizedView> {
    (proposals(), counts(1)).prop_map(|(id, relays)| SizedView { id, relays })
}

fn spans() -> impl Strategy<Value = u16> {
    prop_oneof![4 => 0..200_u16, 1 => any::<u16>(), 1 => Just(u16::MAX)]
}

/// Draws a hello, proposal, decision or fence.
pub(crate) fn formings() -> BoxedStrategy<Said> {
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
                latest_view: newest,
                latest_mission: holds,
                offer_number: nonce,
                hears,
                flags,
            })
        },
    );
    let calls = || {
        (stamps(), proposals(), counts(1)).prop_map(|(of, view, place)| Call { of, view, place })
    };
    // Views in order: agreed on, accepted, deciding proposal, proposed.
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
                reached: there,
                usable_in: lease_left,
            }))
        },
    );
    let fence = (
        1..=u16::MAX,
        any::<[u16; 3]>(),
        [-1e7, -1e7, -1e7, -1e7, 0.0].map(metres),
        0_u8..128,
    )
        .prop_map(|(number, [mission, echo, fence], places, flags)| {
            Said::Fence(Fenced {
                association: number,
                line_digest: mission,
                echo,
                number: fence,
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

/// Draws a lease renewal or its completion.
pub(crate) fn pulses() -> BoxedStrategy<Said> {
    let pulse = (any::<[u16; 2]>(), spans()).prop_map(|([number, mission], span)| Said::Pulse {
        number,
        view_digest: mission,
        lease: span.max(1),
    });
    let pulsed =
        (any::<[u16; 2]>(), any::<bool>()).prop_map(|([number, mission], done)| Said::Pulsed {
            number,
            view_digest: mission,
            done,
        });
    prop_oneof![pulse, pulsed].boxed()
}

/// Draws measurements and estimates.
pub(crate) fn hearings() -> BoxedStrategy<Heard> {
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
                view_digest: mission,
                estimate: told,
                kind,
                source,
                sums: sums.try_into().unwrap(),
                receiver: [heard_w, count],
                excluded: off,
            },
        )
        .boxed()
}

/// Draws a message with measurements and estimates.
pub(crate) fn heard() -> BoxedStrategy<Said> {
    prop_oneof![
        hearings().prop_map(Said::Sense),
        hearings().prop_map(Said::Sensed),
    ]
    .boxed()
}
