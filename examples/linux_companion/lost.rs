//! Lost relays, and the operator's command to clear them: `clear-lost 3`.
//!
//! The guard keeps clear of a silent relay, because its drone may still hover. Only a person can know that it has
//! landed. The guard stops keeping clear of all relays on one side at once, so the command must name every lost relay
//! on that side.

use std::collections::BTreeSet;

use serde_json::{Value, json};
use uav_relay::{Event, Instant, Relay, Side};

use crate::report::direction;
use uav_relay_linux::log::Log;

pub(crate) const CLEAR: &str = "clear-lost";

/// Relays that were lost since this relay's start, and that this relay does not receive at present.
#[derive(Debug)]
pub(crate) struct Lost {
    index: u16,
    /// Number of relays in the mission at the start.
    relays: u16,
    nodes: BTreeSet<u16>,
}

impl Lost {
    pub(crate) const fn new(index: u16, relays: u16) -> Self {
        Self {
            index,
            relays,
            nodes: BTreeSet::new(),
        }
    }

    pub(crate) fn handle_event(&mut self, event: Event) {
        match event {
            Event::NeighbourLost { node, .. } if (1..=self.relays).contains(&node) => {
                self.nodes.insert(node);
            }
            Event::NeighbourBack { node, .. } => {
                self.nodes.remove(&node);
            }
            _ => {}
        }
    }

    pub(crate) const fn nodes(&self) -> &BTreeSet<u16> {
        &self.nodes
    }

    /// Executes and logs an operator's command from the status socket; returns the answer.
    pub(crate) fn command(
        &mut self,
        now: Instant,
        log: &Log,
        relay: &mut Relay,
        command: &str,
        user: &str,
    ) -> Value {
        let done = self.clear(now, relay, command);
        let done = done.map(|text| ("cleared", text));
        log_command(now, log, done, command, user)
    }

    fn clear(&mut self, now: Instant, relay: &mut Relay, command: &str) -> Result<String, String> {
        let mut words = command.split_whitespace();
        if words.next() != Some(CLEAR) {
            return Err(format!(
                "unknown command `{command}`: allowed are `leave`, `stay` and `{CLEAR} N ..`, with the numbers of all lost relays on one side of this relay (toward Tx or toward Rx), once their drones have landed"
            ));
        }
        let named: BTreeSet<u16> = words
            .map(|word| self.number(relay, word))
            .collect::<Result<_, _>>()?;
        let side = match (named.first(), named.last()) {
            (Some(first), _) if *first > self.index => Side::Downstream,
            (_, Some(last)) if *last < self.index => Side::Upstream,
            (None, _) => {
                return Err(format!(
                    "{CLEAR} names no relay: when the drones of all lost relays on one side of this relay (toward Tx or toward Rx) have landed, give the numbers of these relays, as in `{CLEAR} 3`"
                ));
            }
            _ => {
                return Err(format!(
                    "{CLEAR} names relays on both sides of relay {}: send one command for each side",
                    self.index
                ));
            }
        };
        let on_side = |node: &u16| (*node > self.index) == (side == Side::Downstream);
        let missing = self.nodes.iter().filter(|node| on_side(node));
        let missing: Vec<u16> = missing.copied().filter(|it| !named.contains(it)).collect();
        if !missing.is_empty() {
            return Err(format!(
                "{} also lost on the same side of this relay, but not named in the command: when the drones of all lost relays on this side have landed, give all their numbers in one command",
                listed(missing)
            ));
        }
        relay.clear_lost(now, side);
        self.nodes.retain(|node| !named.contains(node));
        Ok(cleared(named, side))
    }

    /// Removes the relays `named` from the lost ones: they have landed, as reported over MAVLink.
    pub(crate) fn remove_cleared(&mut self, named: &[u16]) {
        self.nodes.retain(|node| !named.contains(node));
    }

    /// Parses the number of a relay that a command reports as landed.
    ///
    /// Returns an error if the number is that of this relay, or of a relay that it still receives.
    fn number(&self, relay: &Relay, word: &str) -> Result<u16, String> {
        let number = word.parse().ok();
        let Some(number) = number.filter(|number| (1..=self.relays).contains(number)) else {
            let most = self.relays;
            return Err(format!(
                "relay {word}: the number of a relay must be within 1 to {most}"
            ));
        };
        if number == self.index {
            return Err(format!(
                "relay {number} is this relay itself: name lost relays only"
            ));
        }
        let is_heard = relay.neighbours().contains(&Some(number)) && !self.nodes.contains(&number);
        if is_heard {
            return Err(format!(
                "relay {number} is not lost, because this relay receives it: if it has landed, switch it off first"
            ));
        }
        Ok(number)
    }
}

/// Logs an operator's command and its result; returns the answer.
///
/// `done` is the result: the name and the text of the event to log, or the text of a refusal.
pub(crate) fn log_command(
    now: Instant,
    log: &Log,
    done: Result<(&str, String), String>,
    command: &str,
    by: &str,
) -> Value {
    let is_done = done.is_ok();
    let (event, text) = done.unwrap_or_else(|text| ("command refused", text));
    let fields = json!({ "command": command, "by": by });
    let line = format_args!("{text} (command `{command}` from {by})");
    log.event(now, event, fields, line);
    json!({ "done": is_done, "text": text })
}

/// Returns the log text about lost relays on `side` that the operator reports as landed.
pub(crate) fn cleared(named: impl IntoIterator<Item = u16>, side: Side) -> String {
    let named: Vec<u16> = named.into_iter().collect();
    let they_have = if named.len() == 1 {
        "it has"
    } else {
        "they have"
    };
    format!(
        "{} cleared: the operator reported that {they_have} landed, so this relay no longer keeps clear of lost relays {}",
        listed(named),
        direction(side)
    )
}

fn listed(nodes: impl IntoIterator<Item = u16>) -> String {
    let nodes: Vec<String> = nodes.into_iter().map(|node| node.to_string()).collect();
    match &nodes[..] {
        [node] => format!("relay {node} is"),
        _ => format!("relays {} are", nodes.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::Lost;
    use uav_relay::{Event, Side};

    #[test]
    fn a_relay_is_lost_until_it_is_received_again() {
        let mut lost = Lost::new(2, 4);
        let side = Side::Downstream;
        for node in [3, 4, 5] {
            lost.handle_event(Event::NeighbourLost { side, node });
        }
        lost.handle_event(Event::NeighbourBack { side, node: 3 });
        assert_eq!(
            lost.nodes().iter().collect::<Vec<_>>(),
            [&4],
            "5 is the receiver"
        );
    }
}
