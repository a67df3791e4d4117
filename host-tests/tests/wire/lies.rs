//! Well-formed frames with false contents, and a relay's own frames.

use std::cell::Cell;

use host_tests::fixtures::NETWORK;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::Message;
use uav_relay::{Instant, Port, Wiring};

use super::codec::{Decided, Fenced, Handed, Judged, Proposed, Said, Shifted, plain, wire};
use super::config;
use super::receive::{drain, relay};
use super::strategies::{messages, sweeps};
use super::stream::unstuffed;

/// Returns the view of that number proposed by relay 1; proposed numbers are above 0.
fn view(number: u16) -> u32 {
    u32::from(number.max(1)) << 10 | 1
}

/// Sets the number and digest of a message, where it has them.
pub(crate) fn renamed(mut said: Said, as_number: u16, as_mission: u16) -> Said {
    match &mut said {
        Said::Sweep(sweep) | Said::Measured { sweep, .. } | Said::Aside { sweep, .. } => {
            (sweep.number, sweep.view_digest) = (as_number, as_mission);
        }
        Said::Gather(seats) | Said::Gathered(seats) => {
            (seats.number, seats.view_digest) = (as_number, as_mission);
        }
        Said::Verdict(Judged {
            number,
            view_digest: mission,
            ..
        })
        | Said::Token(Handed {
            number,
            view_digest: mission,
            ..
        })
        | Said::Moved(Shifted {
            number,
            view_digest: mission,
            ..
        })
        | Said::Pulse {
            number,
            view_digest: mission,
            ..
        }
        | Said::Pulsed {
            number,
            view_digest: mission,
            ..
        } => (*number, *mission) = (as_number, as_mission),
        Said::Claim { number, .. } => *number = as_number.into(),
        Said::Busy { number } => *number = as_number,
        // A fence's number is that of its association, never 0.
        Said::Heartbeat { mission, .. }
        | Said::Fence(Fenced {
            line_digest: mission,
            ..
        })
        | Said::Level { mission, .. } => {
            *mission = as_mission;
        }
        Said::Hello(hello) => (hello.latest_view, hello.mission) = (view(as_number), as_mission),
        // The view has the loaded mission.
        Said::Proposal(proposed) => {
            let Proposed {
                call,
                agreed,
                successor,
                ..
            } = proposed;
            (call.view, call.of) = (view(as_number), (as_mission, 0));
            if agreed.id >= call.view {
                agreed.id = 0;
            }
            *successor = successor.filter(|(proposal, _)| *proposal < call.view);
        }
        Said::Decision(Decided { call, base, .. }) => {
            (call.view, call.of) = (view(as_number), (as_mission, 0));
            if base.id >= call.view {
                base.id = 0;
            }
        }
        Said::Offer(offer) => offer.base = as_mission,
        Said::Sense(heard) | Said::Sensed(heard) => {
            (heard.number, heard.view_digest) = (as_number, as_mission);
        }
    }
    said
}

/// Sends plausible false messages about the sweep in progress: setpoints stay on the line.
#[test]
fn lies_within_the_ranges_never_lead_out_of_bounds() {
    let setpoints = Cell::new(0);
    let lies = vec((sweeps(0), messages(), any::<bool>()), 1..6);
    TestRunner::new(config(1000))
        .run(&(lies, prop_oneof![Just(4_u16), Just(8)]), |(lies, own)| {
            let mut relay = relay(own, 8, Wiring::Pair);
            let mission = digest(relay.mission());
            let now = Instant::ZERO;
            for (number, (sweep, verdict, plausible)) in (0..).zip(lies) {
                let mut sweep = renamed(sweep, number, mission);
                if let Said::Sweep(sweep) = &mut sweep
                    && plausible
                {
                    for reach in &mut sweep.reaches {
                        *reach %= 1000.0;
                    }
                }
                let verdict = renamed(verdict, number, mission);
                for (sender, port, said) in [
                    (own - 1, Port::Upstream, sweep),
                    (own + 1, Port::Downstream, verdict),
                ] {
                    let header = Header {
                        network: NETWORK,
                        sender,
                        destination: own,
                        counter: 0,
                    };
                    let bytes = wire(&plain(header, &said.body()));
                    relay.handle_bytes(now, port, &bytes);
                    drain(&mut relay, now);
                    if let Some(place) = relay.setpoint() {
                        prop_assert!((0.0..=1000.0).contains(&place.x_m), "{place:?}");
                        prop_assert_eq!(place.altitude_m, 20.0);
                        setpoints.set(setpoints.get() + 1);
                    }
                }
            }
            prop_assert_eq!(relay.stats().mission, 0);
            Ok(())
        })
        .unwrap();
    println!("{} setpoints", setpoints.get());
    assert!(setpoints.get() > 20);
}

#[test]
fn what_a_relay_sends_is_what_the_rules_give() {
    let mut head = relay(1, 8, Wiring::Pair);
    let mut buffer = [0; MAX_FRAME];
    let mut counter = 0;
    while counter < 3 {
        let now = head.poll_timeout().unwrap();
        head.handle_timeout(now);
        head.persist(|_| true);
        while let Some(transmit) = head.poll_transmit(now, &mut buffer) {
            let chunk = &buffer[..transmit.len - 1];
            let bytes = unstuffed(chunk).unwrap();
            let said = Said::read(&bytes[10..bytes.len() - 4]).unwrap();
            let header = Header {
                network: NETWORK,
                sender: 1,
                destination: 2,
                counter,
            };
            assert_eq!(bytes, plain(header, &said.body()), "frame {counter}");
            let (_, message) = frame::decode(&bytes).unwrap();
            if let Message::Sweep(sweep) = message {
                assert_eq!(sweep.view_digest, digest(head.mission()));
            }
            counter += 1;
        }
    }
}
