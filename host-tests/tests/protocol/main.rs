//! State table of a relay, row by row, through its public interface.

use host_tests::bench::{self, Bench};
use host_tests::fixtures::{self, mission};
use host_tests::make;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::{self, MAX_FRAME};
use uav_relay::wire::message::Message;
use uav_relay::{
    Duration, Event, Instant, Interference, Interferer, Mission, MissionConfig, Phase, Port, Relay,
    Settings,
};

mod lost;
mod numbers;

fn relay(mission: Mission, index: u16) -> Relay {
    fixtures::relay(mission, index, Settings::default())
}

/// Returns the port, message and bytes of each frame that the relay wants to send.
fn drain(relay: &mut Relay, now: Instant) -> Vec<(Port, Message, Vec<u8>)> {
    let sent = bench::sent(relay, now).into_iter();
    let sent: Vec<_> = sent
        .map(|(port, bytes)| (port, message(&bytes), bytes))
        .collect();
    assert!(sent.len() < 16, "the relay never stops sending");
    assert!(
        relay.poll_timeout().is_none_or(|at| at > now),
        "a drained relay wants to be called at once"
    );
    sent
}

/// Returns the message of an intact frame.
fn message(bytes: &[u8]) -> Message {
    let mut deframer = Deframer::new();
    let message = bytes.iter().find_map(|&byte| {
        let plain = deframer.push(byte)?.unwrap();
        Some(frame::decode(plain).unwrap().1)
    });
    message.expect("a whole frame")
}

fn events(relay: &mut Relay) -> Vec<Event> {
    bench::events(relay).collect()
}

/// Runs the leader until it has predicted a target SIR and sends its first sweep message. Returns the time and the
/// frame.
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
    let len = frame::encode(make::header(sender, destination, 0), message, &mut buffer);
    buffer[..len].to_vec()
}

#[test]
fn two_relays_agree_in_two_frames_and_repeat_the_answer() {
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
fn a_sweep_is_repeated_and_a_waiting_relay_sends_busy() {
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
fn a_relay_rebooted_during_a_pass_takes_part_again() {
    let mut bench = Bench::of(mission(3), |_| Settings::default());
    let waits = |bench: &Bench| bench.relays[1].phase() == Phase::Waiting;
    bench
        .run_until(Duration::from_millis(5_000), waits)
        .unwrap();
    bench.flying.clear();
    let identity = make::identity(2);
    let rebooted = Relay::new(mission(3), identity, Settings::default(), 77, bench.now);
    bench.relays[1] = rebooted.unwrap();
    let took = bench.run_until(Duration::from_millis(60_000), Bench::holds);
    assert!(took.is_some());
    let x_m = |at: usize| bench.relays[at].setpoint().unwrap().x_m;
    assert!(x_m(0) < x_m(1));
}

#[test]
fn relays_of_different_missions_ignore_and_report_each_other() {
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
    // The pass may be of another view, to judge by its digest: the relays must exchange hellos.
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
fn foreign_misaddressed_and_misdirected_frames_are_counted() {
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
    // The relay answers the frame with its own number by a claim: a second relay 2 has sent that frame.
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
