//! Tests of events about a neighbour.

use super::fixture::{NOW, hello, relay};
use crate::event::Event;
use crate::node::Node;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::{Hello, Message};

/// Returns a hello of node 1, which receives the nodes in `hears`.
fn hello_of(node: &Node, hears: u8) -> Message {
    let Message::Hello(hello) = hello(node, node.layers.update.latest()) else {
        unreachable!();
    };
    Message::Hello(Hello {
        ask: true,
        hears,
        ..hello
    })
}

fn events(node: &mut Node) -> heapless::Vec<Event, 16> {
    core::iter::from_fn(|| node.poll_event()).collect()
}

#[test]
fn a_node_that_does_not_hear_this_relay_is_told_of_once_until_it_does() {
    let mut node = relay(false);
    events(&mut node);
    let deaf = hello_of(&node, 0);
    for round in 1..=2 {
        for times in 1..=30 {
            node.handle_message(NOW, Side::Upstream, 1, &deaf);
            let told = events(&mut node).contains(&Event::NotHeard { node: 1 });
            assert_eq!(told, times == 8, "{round} {times}");
        }
        let hears = hello_of(&node, 1);
        node.handle_message(NOW, Side::Upstream, 1, &hears);
    }
}

#[test]
fn a_loss_and_a_mission_that_differs_are_told_with_the_node() {
    let mut node = relay(false);
    let lost = events(&mut node);
    let Message::Hello(hello) = hello_of(&node, 1) else {
        unreachable!();
    };
    let other = Message::Hello(Hello {
        mission: hello.mission ^ 1,
        ..hello
    });
    node.handle_message(NOW, Side::Upstream, 1, &other);
    assert_eq!(
        events(&mut node)[..],
        [Event::MissionMismatch { node: 1 }],
        "{lost:?}"
    );
    let mut told = heapless::Vec::<Event, 16>::new();
    for seconds in 10..200 {
        node.handle_timeout(Instant::from_millis(1_000 * seconds));
        while node
            .poll_message(Instant::from_millis(1_000 * seconds))
            .is_some()
        {}
        told.extend(events(&mut node));
    }
    for (side, other) in [(Side::Upstream, 1), (Side::Downstream, 3)] {
        let lost = Event::NeighbourLost { side, node: other };
        assert_eq!(
            told.iter().filter(|event| **event == lost).count(),
            1,
            "{told:?}"
        );
    }
}
