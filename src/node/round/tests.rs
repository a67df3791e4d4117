//! Tests of the agreement with three relays: proofs of a live neighbour, messages that await replies.

extern crate std;

use super::Round;
use super::computation::PassKind;
use super::state::Phase;
use crate::mission::Mission;
use crate::mission::tests::paper;
use crate::node::context::OtherLeases;
use crate::node::context::{Context, Effects, Member, Peer};
use crate::optimiser::search::Schedule;
use crate::sensing::Listen;
use crate::settings::{Adjust, Method, Settings};
use crate::time::{Duration, Instant};
use crate::view::ViewId;
use crate::wire::message::Message;
use std::vec::Vec;

const RELAYS: u16 = 3;

/// Chain of three relays for the tests, with one target SIR per sweep. The chain's clock advances by 1 ms with each
/// call of a relay's method.
struct Line {
    members: [Member; RELAYS as usize],
    rounds: [Round; RELAYS as usize],
    now: Instant,
}

impl Line {
    fn new() -> Self {
        Self::with(Settings {
            predict: false,
            schedule: Schedule::FixedStep { step: 0.1 },
            ..Settings::default()
        })
    }

    fn with(settings: Settings) -> Self {
        let mission = Mission::try_new(paper(RELAYS)).unwrap();
        let profile = mission.config().common;
        let of = |at: u16| Member::new(mission, settings, at + 1);
        let mut rounds =
            [0, 1, 2].map(|at| Round::new(at == 0, 7, profile, &settings, at, Instant::ZERO));
        rounds[0].work_soon(Instant::ZERO);
        Self {
            members: [0, 1, 2].map(of),
            rounds,
            now: Instant::ZERO,
        }
    }

    fn step<T>(&mut self, at: usize, call: impl FnOnce(&mut Round, &Context<'_>) -> T) -> T {
        self.now = self.now + Duration::from_millis(1);
        let member = &self.members[at];
        let context = Context {
            now: self.now,
            member,
            latest: member.active,
            is_last_reachable: member.index == RELAYS,
            other_leases: OtherLeases {
                lease_left: Duration::from_micros(0),
                view: ViewId::LOADED,
                earlier_lease_left: None,
            },
        };
        call(&mut self.rounds[at], &context)
    }

    fn hear(&mut self, at: usize, message: &Message) -> Effects {
        self.step(at, |round, context| round.handle(context, message))
    }

    fn onward(&mut self, at: usize) -> Message {
        loop {
            if let Some(message) = self.step(at, |round, context| round.poll_onward(context, true))
            {
                return message;
            }
            self.step(at, Round::handle_timeout);
        }
    }

    fn back(&mut self, at: usize) -> Message {
        self.step(at, |round, context| round.poll_back(context, true))
            .unwrap()
    }
}

/// Delivers messages between the relays until `ends` returns true for a message. Returns the delivered messages.
fn exchange(line: &mut Line, ends: impl Fn(&Line, &Message) -> bool) -> Vec<Message> {
    let mut all = Vec::new();
    for _ in 0..100_000 {
        for at in 0..usize::from(RELAYS) {
            line.step(at, Round::handle_timeout);
            let onward = line.step(at, |round, context| round.poll_onward(context, true));
            let back = line.step(at, |round, context| round.poll_back(context, true));
            for (message, to) in [(onward, at + 1), (back, at.wrapping_sub(1))] {
                if let Some(message) = message.filter(|_| to < usize::from(RELAYS)) {
                    line.hear(to, &message);
                    all.push(message);
                    if all.last().is_some_and(|message| ends(line, message)) {
                        return all;
                    }
                }
            }
        }
    }
    panic!("it does not end: {all:?}");
}

/// Checks that a leader that keeps its position after a sensing pass schedules no retransmission.
#[test]
#[cfg(feature = "sensing")]
fn a_leader_that_goes_on_holding_after_a_sensing_pass_awaits_nothing() {
    let mut line = Line::with(Settings {
        listen: Some(Listen::default()),
        ..Settings::default()
    });
    let holds = |line: &Line| line.rounds[0].phase() == Phase::Holding;
    exchange(&mut line, |line, message| {
        matches!(message, Message::Verdict(_)) && holds(line)
    });
    exchange(&mut line, |line, message| {
        matches!(message, Message::Sensed(_)) && holds(line)
    });
    assert_eq!(line.rounds[0].circulation.next_timeout(), None);
}

/// Checks that a relay that still searches for its position does not forward the token of Algorithm 2. The token must
/// report the position that the relay finds.
#[test]
#[cfg(feature = "adjust")]
fn a_relay_that_still_searches_hands_on_no_token() {
    let mut line = Line::with(Settings {
        method: Method::Adjust(Adjust::default()),
        ..Settings::default()
    });
    exchange(&mut line, |line, message| {
        let pass = &line.rounds[1].computation.pass;
        let searches = matches!(pass, PassKind::Turn(turn_pass) if turn_pass.is_searching());
        matches!(message, Message::Token(_)) && searches
    });
    line.step(1, |round, _| round.resend());
    let message = line.step(1, |round, context| round.poll_onward(context, true));
    assert_eq!(message, None);
}

fn heard(effects: Effects) -> [Option<Instant>; 2] {
    [Peer::Next, Peer::Previous].map(|of| {
        let alive = effects.alive.filter(|(peer, _)| *peer == of);
        alive.map(|(_, at)| at)
    })
}

#[test]
fn an_answer_counts_from_when_what_it_answers_was_said_and_nothing_that_comes_again_counts() {
    let mut line = Line::new();
    // Time at which relay 2 sent the result of the last sweep.
    let mut handed_back = None;
    let (mut old_sweep, mut old_verdict) = (None, None);
    for sweep in 0..5 {
        let pass = line.onward(0);
        assert!(matches!(pass, Message::Sweep(_)), "{pass:?}");
        assert_eq!(
            heard(line.hear(1, &pass)),
            [None, handed_back],
            "sweep {sweep}"
        );
        let handed_on = Some(line.now);
        assert_eq!(heard(line.hear(1, &pass)), [None; 2]);
        if let (Some(sweep), Some(verdict)) = (&old_sweep, &old_verdict) {
            assert_eq!(heard(line.hear(1, sweep)), [None; 2]);
            assert_eq!(heard(line.hear(1, verdict)), [None; 2]);
        }
        let on = line.onward(1);
        line.hear(2, &on);
        // After a retransmission a reply counts from the first transmission, because the reply does not show which
        // transmission it answers.
        line.step(1, |round, _| round.resend());
        line.onward(1);
        let verdict = line.back(2);
        assert_eq!(heard(line.hear(1, &verdict)), [handed_on, None]);
        handed_back = Some(line.now);
        assert_eq!(heard(line.hear(1, &verdict)), [None; 2]);
        let answer = line.back(1);
        assert!(line.hear(0, &answer).alive.is_some());
        (old_sweep, old_verdict) = (Some(pass), Some(verdict));
    }
}

#[test]
fn the_first_pass_of_a_view_answers_nothing() {
    let mut line = Line::new();
    let pass = line.onward(0);
    line.hear(1, &pass);
    let on = line.onward(1);
    line.hear(2, &on);
    let verdict = line.back(2);
    line.hear(1, &verdict);
    for at in 0..3 {
        line.rounds[at].suspend();
        line.rounds[at].renew(line.now, at == 0, false);
    }
    let pass = line.onward(0);
    assert_eq!(heard(line.hear(1, &pass)), [None; 2]);
}
