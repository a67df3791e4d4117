//! Handshakes of two sessions, and a table with fewer entries than nodes.

use super::{Checked, HANDSHAKE_LENGTH, PEERS, Session};
use super::{RAISED, Rival, Sender};
use crate::time::{Duration, Instant};
use crate::wire::auth::{Auth, Key};
use crate::wire::frame::{self, FrameBuf, Header, MAX_FRAME};
use crate::wire::message::Message;

extern crate std;
use std::vec::Vec;

/// Capacity of the session table, equal to [`PEERS`] but of the type `u16`, like node numbers.
const ROOM: u16 = 8;

/// Silence after which a node is forgotten; the value of `Settings::dead_after`.
const GONE: Duration = Duration::from_millis(15_000);

const KEY: Key = Key::new([0xA5; 32]);

fn session() -> Session {
    Session::new(Auth { key: KEY, epoch: 5 }, 0, GONE)
}

type Plain = Vec<u8>;

fn plain(frame: &FrameBuf, len: usize) -> Plain {
    let mut deframer = crate::wire::deframe::Deframer::new();
    let decoded = frame[..len].iter().find_map(|&byte| {
        let plain = deframer.push(byte)?;
        Some(plain.unwrap().to_vec())
    });
    decoded.unwrap()
}

/// Returns a frame from the session `from`. It is a handshake, or a `Busy` message if `handshake` is false.
fn frame(from: &mut Session, addresses: (u16, u16), handshake: bool, counter: u32) -> Plain {
    let (sender, destination) = addresses;
    let header = Header {
        network: 7,
        sender,
        destination,
        counter,
    };
    let mut out = [0; MAX_FRAME];
    let body = from.handshake(destination);
    let signer = from.signer(destination);
    let len = if handshake {
        frame::encode_handshake(header, &body, signer, &mut out)
    } else {
        frame::encode_signed(header, &Message::Busy { number: 1 }, signer, &mut out)
    };
    plain(&out, len)
}

fn check(session: &mut Session, plain: &[u8]) -> Checked {
    check_at(session, 0, plain)
}

fn check_at(session: &mut Session, seconds: u64, plain: &[u8]) -> Checked {
    let opened = frame::open(plain).unwrap();
    let now = Instant::from_millis(1_000 * seconds);
    session.check(now, opened.header.sender, &opened)
}

/// Passes handshakes between two nodes until none is pending; returns the number of handshakes. `ends` are the nodes'
/// sessions and node numbers, `counters` their frame counters.
fn meet(ends: [(&mut Session, u16); 2], counters: &mut [u32; 2]) -> u32 {
    let [(one, a), (other, b)] = ends;
    let mut said = 0;
    loop {
        let (first, second) = (one.take_handshake(), other.take_handshake());
        let frames = [
            first.map(|to| (to, frame(one, (a, to), true, counters[0]))),
            second.map(|to| (to, frame(other, (b, to), true, counters[1]))),
        ];
        counters[0] += u32::from(first.is_some());
        counters[1] += u32::from(second.is_some());
        let [from_one, from_other] = frames;
        if let Some((to, plain)) = &from_one
            && *to == b
        {
            check(other, plain);
        }
        if let Some((_, plain)) = &from_other {
            check(one, plain);
        }
        if from_one.is_none() && from_other.is_none() {
            return said;
        }
        said += u32::from(from_one.is_some()) + u32::from(from_other.is_some());
    }
}

/// Returns a new session of node `node` in epoch `epoch`. It has exchanged handshakes with `own`, the session of node
/// 1.
fn met(own: &mut Session, node: u16, epoch: u32, counters: &mut [u32; 2]) -> Session {
    let mut other = Session::new(Auth { key: KEY, epoch }, 0, GONE);
    other.greet(1);
    counters[1] = 0;
    meet([(own, 1), (&mut other, node)], counters);
    assert!(own.knows(node) && other.knows(1), "{node}");
    other
}

#[test]
fn a_link_is_proven_by_three_handshakes_or_four_if_crossed() {
    for crossing in [false, true] {
        let (mut one, mut other) = (session(), session());
        one.greet(2);
        if crossing {
            other.greet(1);
        }
        let said = meet([(&mut one, 1), (&mut other, 2)], &mut [0; 2]);
        assert_eq!(said, if crossing { 4 } else { 3 });
        assert!(one.knows(2) && other.knows(1));
        // No handshake is pending.
        assert_eq!((one.take_handshake(), other.take_handshake()), (None, None));
    }
}

/// Checks that both nodes prove their presence to each other although one handshake is lost. A node without this proof
/// requests a handshake again.
#[test]
fn one_lost_handshake_leaves_both_ends_proven() {
    for lost in 0..4 {
        let (mut one, mut other) = (session(), session());
        one.greet(2);
        let mut counters = [0_u32; 2];
        let mut number = 0;
        for _ in 0..20 {
            for from_one in [true, false] {
                let (from, to, ends, counter) = if from_one {
                    (&mut one, &mut other, (1, 2), &mut counters[0])
                } else {
                    (&mut other, &mut one, (2, 1), &mut counters[1])
                };
                // A relay with a message to send.
                if from.find(ends.1).is_some() && !from.knows(ends.1) {
                    from.greet(ends.1);
                }
                if let Some(node) = from.take_handshake() {
                    let plain = frame(from, (ends.0, node), true, *counter);
                    *counter += 1;
                    if number != lost {
                        check(to, &plain);
                    }
                    number += 1;
                }
            }
        }
        assert!(one.knows(2) && other.knows(1), "without handshake {lost}");
        assert!(number < 8, "{number} handshakes without {lost}");
    }
}

#[test]
fn a_handshake_body_contains_the_known_nonces() {
    let mut own = session();
    assert_eq!(own.handshake(2), [0; HANDSHAKE_LENGTH]);
    own.greet(2);
    own.greet(3);
    assert_eq!(
        own.handshake(2)[..],
        [1, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]
    );
    assert_eq!(own.handshake(3)[..8], [2, 0, 0, 0, 5, 0, 0, 0]);
    let mut counters = [0; 2];
    own.take_handshake();
    own.take_handshake();
    met(&mut own, 2, 9, &mut counters);
    assert_eq!(
        own.handshake(2)[..],
        [1, 0, 0, 0, 5, 0, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0, 0]
    );
}

/// Checks that a full session table keeps the pinned entries and the newest entry. Recorded frames of a forgotten
/// node are rejected.
#[test]
fn a_forgotten_node_is_met_again_and_replays_are_rejected() {
    let mut own = session();
    own.pin([Some(2), Some(3)]);
    let mut counters = [0; 2];
    let mut neighbour = met(&mut own, 2, 1, &mut counters);
    met(&mut own, 3, 1, &mut counters);
    let mut forgotten = met(&mut own, 20, 1, &mut counters);
    let recorded = frame(&mut forgotten, (20, 1), false, 50);
    assert_eq!(check(&mut own, &recorded), Checked::Fresh { first: false });
    assert_eq!(check(&mut own, &recorded), Checked::Replayed);
    let to_it = frame(&mut own, (1, 20), false, 1000);
    forgotten.greet(1);
    let handshake = frame(&mut forgotten, (20, 1), true, 51);
    for node in 30..30 + ROOM {
        met(&mut own, node, 1, &mut counters);
    }
    assert_eq!(own.peers.len(), PEERS);
    assert_eq!(PEERS, usize::from(ROOM));
    assert!(own.knows(2) && own.knows(3) && !own.knows(20) && !own.knows(30));
    assert!(own.knows(29 + ROOM));
    assert_eq!(check(&mut own, &recorded), Checked::Forged);
    // A recorded handshake creates an entry but is no proof, since it contains another nonce.
    assert_eq!(check(&mut own, &handshake), Checked::Unproven);
    assert!(!own.knows(20));
    assert_eq!(check(&mut own, &recorded), Checked::Forged);
    assert_eq!(own.take_handshake(), Some(20));
    let asked = frame(&mut own, (1, 20), true, 2000);
    assert_eq!(
        check(&mut forgotten, &asked),
        Checked::Handshake { first: true }
    );
    assert_eq!(check(&mut forgotten, &to_it), Checked::Forged);
    let mut counters = [2001, 52];
    meet([(&mut own, 1), (&mut forgotten, 20)], &mut counters);
    assert!(own.knows(20) && forgotten.knows(1));
    let fresh = frame(&mut forgotten, (20, 1), false, 90);
    assert_eq!(check(&mut own, &fresh), Checked::Fresh { first: false });
    assert_eq!(check(&mut own, &recorded), Checked::Forged);
    let still = frame(&mut neighbour, (2, 1), false, 90);
    assert_eq!(check(&mut own, &still), Checked::Fresh { first: false });
}

/// Checks that replayed handshakes of many nodes evict no known node from the session table. The handshakes replace
/// only entries of nodes that have not proved their presence.
#[test]
fn recorded_handshakes_do_not_replace_known_nodes() {
    let mut handshakes = Vec::new();
    for node in 100..200 {
        let mut stranger = Session::new(Auth { key: KEY, epoch: 1 }, 0, GONE);
        stranger.greet(1);
        handshakes.push(frame(&mut stranger, (node, 1), true, 0));
    }
    let mut own = session();
    own.pin([Some(2), Some(3)]);
    let mut counters = [0; 2];
    for node in 2..=ROOM {
        met(&mut own, node, 1, &mut counters);
    }
    for _ in 0..3 {
        for handshake in &handshakes {
            assert_eq!(check(&mut own, handshake), Checked::Unproven);
            assert!(own.take_handshake().is_some());
            assert_eq!(own.take_handshake(), None, "one for one");
        }
    }
    for node in 2..=ROOM {
        assert!(own.knows(node));
    }
}

/// Checks that `greet` restores a session after one of the two nodes has restarted. Before that, the restarted node
/// cannot verify any frame.
#[test]
fn a_handshake_repairs_a_link_known_at_one_end() {
    let mut own = session();
    let mut counters = [0; 2];
    met(&mut own, 2, 1, &mut counters);
    let mut anew = Session::new(Auth { key: KEY, epoch: 2 }, 0, GONE);
    let unread = frame(&mut own, (1, 2), false, 1000);
    assert_eq!(check(&mut anew, &unread), Checked::Forged);
    assert!(own.knows(2));
    own.greet(2);
    assert!(!own.knows(2));
    let mut counters = [1001, 0];
    meet([(&mut own, 1), (&mut anew, 2)], &mut counters);
    assert!(own.knows(2) && anew.knows(1));
}

#[test]
fn a_handshake_of_another_length_is_forged() {
    let mut own = session();
    own.greet(2);
    let header = Header {
        network: 7,
        sender: 2,
        destination: 1,
        counter: 0,
    };
    let mut other = session();
    other.greet(1);
    for len in [0, 8, 16, 18, 40] {
        let mut body = other.handshake(1).to_vec();
        body.resize(len, 0);
        let mut out = [0; MAX_FRAME];
        let len = frame::encode_handshake(header, &body, other.signer(1), &mut out);
        assert_eq!(check(&mut own, &plain(&out, len)), Checked::Forged);
    }
}

#[test]
fn after_the_last_nonce_no_new_node_is_accepted() {
    let mut own = session();
    own.last_number = u32::MAX - 1;
    own.greet(2);
    own.greet(3);
    assert_eq!(own.take_handshake(), Some(2));
    assert_eq!(own.take_handshake(), None);
    assert_eq!(own.handshake(2)[..8], [0xFF, 0xFF, 0xFF, 0xFF, 5, 0, 0, 0]);
}

/// Checks that a node with an old or reused epoch is reported from its fifth handshake on. Replays of its frames are not
/// reported.
#[test]
fn an_epoch_that_went_back_is_reported_a_replay_never() {
    for epoch in [1, 7] {
        let mut own = session();
        let mut counters = [0; 2];
        met(&mut own, 2, 7, &mut counters);
        let mut back = Session::new(Auth { key: KEY, epoch }, 0, GONE);
        back.greet(1);
        for counter in 0..300 {
            let plain = frame(&mut back, (2, 1), true, counter);
            let expected = if counter >= 4 {
                Checked::WentBack
            } else {
                Checked::Replayed
            };
            assert_eq!(check(&mut own, &plain), expected, "{epoch} {counter}");
            for _ in 0..4 {
                assert_eq!(check(&mut own, &plain), Checked::Replayed);
            }
        }
    }
}

#[test]
fn frames_in_between_prevent_the_report_of_old_handshakes() {
    let mut own = session();
    let mut counters = [0; 2];
    let mut other = met(&mut own, 2, 7, &mut counters);
    let mut back = Session::new(Auth { key: KEY, epoch: 3 }, 0, GONE);
    back.greet(1);
    for counter in 0..20 {
        let old = frame(&mut back, (2, 1), true, counter);
        assert_eq!(check(&mut own, &old), Checked::Replayed);
        let fresh = frame(&mut other, (2, 1), false, 100 + counter);
        assert_eq!(check(&mut own, &fresh), Checked::Fresh { first: false });
    }
}

/// Checks which frames with the relay's own number as the sender reveal a second node with that number. Only handshakes
/// with the relay's key and with an epoch at least as new as the relay's reveal it.
#[test]
fn only_a_handshake_with_the_key_and_no_older_epoch_is_a_rival() {
    const FAR: u32 = 1 << 20;
    let own = Session::new(Auth { key: KEY, epoch: 5 }, FAR, GONE);
    let other_key = Key::new([1; 32]);
    let rival = |number, newer_epoch| {
        Sender::Rival(Rival {
            number,
            newer_epoch,
            passive: false,
            is_current: true,
        })
    };
    for (key, epoch, claim, handshake, expected) in [
        (KEY, 6, 0, true, rival(1, true)),
        (KEY, 5, 0, true, rival(1, false)),
        (KEY, 5, 2 * FAR, true, rival(2 * FAR + 1, false)),
        (KEY, 5, FAR, true, Sender::Itself),
        (KEY, 5, FAR | RAISED, true, Sender::Itself),
        (KEY, 4, 2 * FAR, true, Sender::Unknown),
        (KEY, 6, 0, false, Sender::Unknown),
        (other_key, 6, 0, true, Sender::Unknown),
    ] {
        let mut other = Session::new(Auth { key, epoch }, claim, GONE);
        other.greet(2);
        let plain = frame(&mut other, (1, 2), handshake, 0);
        let opened = frame::open(&plain).unwrap();
        assert_eq!(own.sender(&opened), expected, "{epoch} {claim} {handshake}");
    }
}

/// Checks that the relay recognises the echo of its own frames, a handshake and a message.
#[test]
fn own_frames_are_recognised() {
    let mut counters = [0; 2];
    let mut own = session();
    met(&mut own, 2, 7, &mut counters);
    for handshake in [true, false] {
        let plain = frame(&mut own, (1, 2), handshake, 50);
        assert_eq!(own.sender(&frame::open(&plain).unwrap()), Sender::Itself);
    }
}

/// Checks that two nodes with the same number are detected by their handshakes to node 1. Node 1 accepts the node with
/// the larger claim. Its reply to the node with the smaller claim contains the larger claim.
#[test]
fn the_smaller_claim_receives_the_larger_one() {
    const FAR: u32 = 1 << 20;
    let auth = Auth { key: KEY, epoch: 7 };
    for first_is_larger in [false, true] {
        let mut counters = [0; 2];
        let (mut one, mut small) = (session(), Session::new(auth, FAR, GONE));
        let mut large = Session::new(auth, 2 * FAR, GONE);
        let (first, second) = if first_is_larger {
            (&mut large, &mut small)
        } else {
            (&mut small, &mut large)
        };
        first.greet(1);
        meet([(&mut one, 1), (first, 2)], &mut counters);
        second.greet(1);
        let asks = frame(second, (2, 1), true, 0);
        let taken = if first_is_larger {
            Checked::Replayed
        } else {
            Checked::Unproven
        };
        assert_eq!(check(&mut one, &asks), taken);
        assert_eq!(one.take_handshake(), Some(2), "it is answered");
        let answer = frame(&mut one, (1, 2), true, 90);
        check(&mut small, &answer);
        let rival = Rival {
            number: 2 * FAR + 1,
            newer_epoch: false,
            passive: false,
            is_current: true,
        };
        assert_eq!(small.poll_rival(), Some(rival));
        check(&mut large, &answer);
        assert_eq!(large.poll_rival(), None);
        // The node raises its claim number, and is accepted from then on.
        small.restart(FAR | RAISED);
        small.greet(1);
        let asks = frame(&mut small, (2, 1), true, 0);
        assert_eq!(check(&mut one, &asks), Checked::Unproven);
    }
}

/// Checks when a node with a smaller claim replaces the node of the same number with a larger claim. The node with the
/// smaller claim is accepted once the node with the larger claim is silent. Recorded frames of the node with the larger
/// claim are then rejected, until that node sends new frames.
#[test]
fn the_smaller_claim_is_accepted_once_the_larger_is_silent() {
    const FAR: u32 = 1 << 20;
    let auth = Auth { key: KEY, epoch: 7 };
    let mut counters = [0; 2];
    let (mut one, mut small) = (session(), Session::new(auth, FAR, GONE));
    let mut large = Session::new(auth, 2 * FAR, GONE);
    large.greet(1);
    meet([(&mut one, 1), (&mut large, 2)], &mut counters);
    let fresh = frame(&mut large, (2, 1), false, counters[1]);
    let later = frame(&mut large, (2, 1), false, counters[1] + 1);
    assert_eq!(
        check_at(&mut one, 10, &fresh),
        Checked::Fresh { first: false }
    );
    small.greet(1);
    for (seconds, counter) in [(10, 0), (24, 1)] {
        let asks = frame(&mut small, (2, 1), true, counter);
        assert_eq!(check_at(&mut one, seconds, &asks), Checked::Replayed);
    }
    one.take_handshake();
    let asks = frame(&mut small, (2, 1), true, 2);
    assert_eq!(check_at(&mut one, 25, &asks), Checked::Unproven);
    assert_eq!(one.take_handshake(), Some(2));
    let answer = frame(&mut one, (1, 2), true, counters[0]);
    assert_eq!(
        check(&mut small, &answer),
        Checked::Handshake { first: true }
    );
    assert_eq!(small.poll_rival(), None);
    let proof = frame(&mut small, (2, 1), false, 3);
    assert_eq!(
        check_at(&mut one, 25, &proof),
        Checked::Fresh { first: true }
    );
    assert_eq!(check_at(&mut one, 26, &later), Checked::Forged);
    large.request_reply(1);
    let again = frame(&mut large, (2, 1), true, counters[1] + 2);
    assert_eq!(check_at(&mut one, 27, &again), Checked::Unproven);
}
