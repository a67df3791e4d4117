//! State table of a relay, row by row, through its public interface.

use host_tests::fixtures::{self, NETWORK, mission};
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::Message;
use uav_relay::{
    Event, Identity, Instant, Interference, Interferer, Mission, MissionConfig, Phase, Port, Relay,
    Settings,
};

mod lost;
mod numbers;

fn relay(mission: Mission, index: u16) -> Relay {
    fixtures::relay(mission, index, Settings::default())
}

/// Returns the port, message and bytes of each pending frame.
fn drain(relay: &mut Relay, now: Instant) -> Vec<(Port, Message, Vec<u8>)> {
    let mut buffer = [0; MAX_FRAME];
    let mut sent = Vec::new();
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(now, &mut buffer) {
        let bytes = buffer[..transmit.len].to_vec();
        let mut deframer = Deframer::new();
        let message = bytes.iter().find_map(|&byte| {
            let plain = deframer.push(byte)?.unwrap().to_vec();
            Some(frame::decode(plain.leak()).unwrap().1)
        });
        sent.push((transmit.port, message.expect("a whole frame"), bytes));
        assert!(sent.len() < 16, "the relay never stops sending");
    }
    assert!(
        relay.poll_timeout().is_none_or(|at| at > now),
        "a drained relay wants to be called at once"
    );
    sent
}

fn events(relay: &mut Relay) -> Vec<Event> {
    std::iter::from_fn(|| relay.poll_event()).collect()
}

/// Runs the leader's prediction until it sends its sweep.
fn first_sweep(head: &mut Relay) -> (Instant, Vec<u8>) {
    for _ in 0..10_000 {
        let now = head.poll_timeout().unwrap();
        head.handle_timeout(now);
        if let Some((Port::Downstream, Message::Sweep(_), bytes)) = drain(head, now).pop() {
            return (now, bytes);
        }
    }
    panic!("the head never begins");
}

fn encode(sender: u16, destination: u16, message: &Message) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    let len = frame::encode(
        Header {
            network: NETWORK,
            sender,
            destination,
            counter: 0,
        },
        message,
        &mut buffer,
    );
    buffer[..len].to_vec()
}

#[test]
fn two_relays_agree_in_two_frames_and_the_answer_is_repeated_for_a_repeated_sweep() {
    let (mut head, mut tail) = (relay(mission(2), 1), relay(mission(2), 2));
    assert_eq!((head.phase(), tail.phase()), (Phase::Planning, Phase::Idle));
    let (now, sweep) = first_sweep(&mut head);
    assert_eq!(head.phase(), Phase::Waiting);
    assert_eq!(head.setpoint(), None);

    tail.handle_bytes(now, Port::Upstream, &sweep);
    assert_eq!(tail.phase(), Phase::Holding);
    assert_eq!(
        events(&mut tail),
        [Event::SetpointChanged, Event::Converged]
    );
    let answers = drain(&mut tail, now);
    assert!(
        matches!(&answers[..], [(Port::Upstream, Message::Verdict(answer), _)] if answer.verdict.commit.is_some())
    );

    // The answer is lost: the repeated sweep causes the same answer and no other change.
    let before = tail.setpoint();
    tail.handle_bytes(now, Port::Upstream, &sweep);
    let again = drain(&mut tail, now);
    assert_eq!(again.len(), 1);
    assert_eq!(again[0].1, answers[0].1);
    assert_eq!((tail.setpoint(), events(&mut tail)), (before, vec![]));
    assert_eq!(tail.stats().repeated, 1);

    head.handle_bytes(now, Port::Downstream, &again[0].2);
    assert_eq!(head.phase(), Phase::Holding);
    assert_eq!(
        events(&mut head),
        [Event::SetpointChanged, Event::Converged]
    );
    assert!(drain(&mut head, now).is_empty());
    // The first answer arrives late.
    head.handle_bytes(now, Port::Downstream, &answers[0].2);
    assert_eq!(
        (head.phase(), head.stats().stale, events(&mut head)),
        (Phase::Holding, 1, vec![])
    );
    assert_eq!(head.target(), tail.target());
}

#[test]
fn a_sweep_is_repeated_until_it_is_answered_and_a_waiting_relay_says_busy() {
    let (mut head, mut middle) = (relay(mission(3), 1), relay(mission(3), 2));
    let (mut now, sweep) = first_sweep(&mut head);
    middle.handle_bytes(now, Port::Upstream, &sweep);
    let onward = drain(&mut middle, now);
    assert!(matches!(
        &onward[..],
        [(Port::Downstream, Message::Sweep(_), _)]
    ));
    assert_eq!(middle.phase(), Phase::Waiting);

    let mut repeats = 0;
    while repeats < 3 {
        now = head.poll_timeout().unwrap();
        head.handle_timeout(now);
        for (port, message, bytes) in drain(&mut head, now) {
            if matches!(message, Message::Sweep(_)) {
                assert_eq!(port, Port::Downstream);
                repeats += 1;
                middle.handle_timeout(now);
                middle.handle_bytes(now, Port::Upstream, &bytes);
                let said = drain(&mut middle, now);
                assert!(said.iter().any(|(port, message, _)| *port == Port::Upstream
                    && matches!(message, Message::Busy { .. })));
            }
        }
    }
    assert_eq!(head.stats().repeats, 3);
    assert_eq!(middle.stats().repeated, 3);
}

#[test]
fn a_relay_rebooted_while_the_chain_waits_takes_up_where_it_left() {
    let mission = mission(3);
    let (mut head, mut middle, mut tail) =
        (relay(mission, 1), relay(mission, 2), relay(mission, 3));
    let (mut now, sweep) = first_sweep(&mut head);
    middle.handle_bytes(now, Port::Upstream, &sweep);
    drain(&mut middle, now);
    middle = Relay::new(
        mission,
        Identity {
            network: NETWORK,
            index: 2,
        },
        Settings::default(),
        77,
        now,
    )
    .unwrap();
    for _ in 0..100 {
        now = [&head, &middle, &tail]
            .iter()
            .filter_map(|relay| relay.poll_timeout())
            .min()
            .unwrap();
        for _ in 0..4 {
            let mut sent = Vec::new();
            for (index, relay) in [&mut head, &mut middle, &mut tail].into_iter().enumerate() {
                relay.handle_timeout(now);
                sent.extend(
                    drain(relay, now)
                        .into_iter()
                        .map(|(port, _, bytes)| (index, port, bytes)),
                );
            }
            for (from, port, bytes) in sent {
                match (from, port) {
                    (0, Port::Downstream) => middle.handle_bytes(now, Port::Upstream, &bytes),
                    (1, Port::Upstream) => head.handle_bytes(now, Port::Downstream, &bytes),
                    (1, Port::Downstream) => tail.handle_bytes(now, Port::Upstream, &bytes),
                    (2, Port::Upstream) => middle.handle_bytes(now, Port::Downstream, &bytes),
                    other => panic!("nobody is there: {other:?}"),
                }
            }
        }
        if head.phase() == Phase::Holding {
            break;
        }
    }
    let phases = [head.phase(), middle.phase(), tail.phase()];
    assert_eq!(phases, [Phase::Holding; 3]);
    assert!(head.setpoint().unwrap().x_m < middle.setpoint().unwrap().x_m);
}

#[test]
fn relays_of_different_missions_ignore_each_other_and_say_so() {
    let mut other = *mission(2).config();
    other.interference = Interference::Source(Interferer {
        y_m: 401.0,
        ..*mission(2).interferer().unwrap()
    });
    let (mut head, mut tail) = (
        relay(mission(2), 1),
        relay(Mission::try_new(MissionConfig { ..other }).unwrap(), 2),
    );
    let (now, sweep) = first_sweep(&mut head);
    tail.handle_bytes(now, Port::Upstream, &sweep);
    // By its digest a pass may be of another view: the relays must exchange hellos.
    assert_eq!(
        (tail.phase(), tail.stats().view, tail.stats().mission),
        (Phase::Idle, 1, 0)
    );
    assert_eq!(events(&mut tail), []);
    let said = drain(&mut tail, now);
    let [(Port::Upstream, Message::Hello(hello), bytes)] = &said[..] else {
        panic!("{said:?}");
    };
    assert!(hello.requests_reply && !hello.requests_view, "{hello:?}");
    head.handle_bytes(now, Port::Downstream, bytes);
    assert_eq!((head.stats().mission, head.stats().rejected()), (1, 1));
    assert_eq!(events(&mut head), [Event::MissionMismatch { node: 2 }]);
    assert!(drain(&mut head, now).is_empty(), "it is not answered");
    // A heartbeat shows the mismatch too.
    let beat = Message::Heartbeat {
        mission: digest(head.mission()),
        request: 1,
        reply: 0,
    };
    tail.handle_bytes(now, Port::Upstream, &encode(1, 2, &beat));
    assert_eq!((tail.stats().mission, tail.stats().rejected()), (1, 2));
    assert_eq!(events(&mut tail), [Event::MissionMismatch { node: 1 }]);
    assert!(drain(&mut tail, now).is_empty());
    assert_eq!(tail.setpoint(), None);
}

#[test]
fn a_foreign_a_misaddressed_and_a_misdirected_frame_are_counted_and_nothing_else() {
    let beat = Message::Heartbeat {
        mission: digest(&mission(3)),
        request: 300,
        reply: 0,
    };
    let mut relay = relay(mission(3), 2);
    let now = Instant::ZERO;
    relay.handle_bytes(now, Port::Upstream, &encode(1, 3, &beat));
    relay.handle_bytes(now, Port::Upstream, &encode(3, 2, &beat));
    relay.handle_bytes(now, Port::Upstream, &encode(2, 2, &beat));
    assert_eq!(relay.stats().misaddressed, 3);
    relay.handle_bytes(
        now,
        Port::Upstream,
        &encode(1, 2, &Message::Busy { number: 1 }),
    );
    assert_eq!(relay.stats().misdirected, 1);
    relay.handle_bytes(now, Port::Shared, &encode(1, 2, &beat));
    assert_eq!(
        relay.stats().received,
        1,
        "a port that is not wired is deaf"
    );
    // The frame with the relay's own number is of another relay 2.
    assert!(matches!(
        &drain(&mut relay, now)[..],
        [(Port::Upstream, Message::Claim(_), _)]
    ));
    relay.handle_bytes(now, Port::Upstream, &encode(1, 2, &beat));
    assert!(matches!(
        &drain(&mut relay, now)[..],
        [(
            Port::Upstream,
            Message::Heartbeat {
                request: 0,
                reply: 300,
                ..
            },
            _
        )]
    ));
}
