//! Relays and messages for the tests.

use crate::mission::tests::paper;
use crate::mission::{Interference, Interferer, Mission, MissionConfig};
use crate::node::Node;
use crate::settings::{Identity, Settings, Wiring};
use crate::time::Instant;
use crate::view::ViewId;
use crate::wire::auth::{Auth, Key};
use crate::wire::digest::MissionId;
use crate::wire::message::{Hello, Message};
use crate::wire::upload::Upload;

pub(super) const NOW: Instant = Instant::from_millis(10_000);

pub(super) fn base() -> Mission {
    Mission::try_new(paper(3)).unwrap()
}

pub(super) fn upload(version: u16) -> Upload {
    upload_to(&base(), version)
}

pub(super) fn upload_to(base: &Mission, version: u16) -> Upload {
    let interference = Interference::Source(Interferer {
        power_w: 80.0,
        x_m: 700.0,
        y_m: 100.0,
    });
    let config = MissionConfig {
        interference,
        ..*base.config()
    };
    Upload::new(base, version, config).unwrap()
}

/// Returns relay 2 of 3, with a key if it `signs`.
pub(super) fn relay(signs: bool) -> Node {
    relay_of(base(), 2, signs)
}

pub(super) fn relay_of(mission: Mission, index: u16, signs: bool) -> Node {
    let settings = Settings {
        wiring: Wiring::Shared,
        auth: signs.then_some(Auth {
            key: Key::new([1; 32]),
            epoch: 1,
        }),
        ..Settings::default()
    };
    let identity = Identity { network: 1, index };
    let mut node = Node::new(&mission, identity, &settings, 1, Instant::ZERO);
    node.begin(identity, 1, Instant::ZERO);
    // Discards the first messages, which the relay sends by itself.
    node.handle_timeout(NOW);
    said(&mut node);
    node
}

pub(super) fn said(node: &mut Node) -> heapless::Vec<(u16, Message), 8> {
    let mut said = heapless::Vec::new();
    while let Some((_, to, message)) = node.poll_message(NOW) {
        if let Message::Claim(_) = message {
            continue;
        }
        let known = matches!(
            message,
            Message::Hello(_)
                | Message::Proposal(_)
                | Message::Offer { .. }
                | Message::Heartbeat { .. }
        );
        assert!(known, "{message:?}");
        said.push((to, message)).unwrap();
    }
    said
}

/// Returns a hello of a neighbour that has selected relay 2.
pub(super) fn hello(node: &Node, holds: MissionId) -> Message {
    Message::Hello(Hello {
        mission: node.member.digest,
        newest: ViewId::LOADED,
        neighbour: 2,
        ask: false,
        form: false,
        fresh: false,
        ready: true,
        behind: 1,
        hears: 0x0F,
        holds,
        flies: true,
        whole: false,
        refused: false,
        nonce: 9,
    })
}
