//! Check that neighbours and this relay receive each other, and share mission, network and key.
//!
//! A relay of the library answers the handshakes, but only hellos, claims, heartbeats and handshakes pass between it
//! and the ports. So it receives and sends no proposal and no vote, and cannot become a member of the chain. On a
//! shared channel its hellos also state that it is not a member.
//!
//! A flying chain would still take it for a relay that has restarted. So it first only listens, for one period of the
//! lease renewals, and then sends only while no relay flies:
//!
//! | heard from a relay | the relay |
//! | --- | --- |
//! | fence without the flag `LEFT`; report of a drone in the air; position that has moved by 5 m | flies |
//! | lease renewal, and no fence of a relay that is not flown | may fly |
//! | fence of a relay that is not flown | is on the ground |

use std::collections::{BTreeMap, VecDeque};

use uav_relay::guard::Fence;
use uav_relay::serial::SerialPort as _;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{Header, open};
use uav_relay::wire::message::{Entry, Message};
use uav_relay::{
    Auth, Departure, Duration, Event, Instant, MAX_FRAME, Placement, Port, Relay, Settings, Stats,
};
use uav_relay_linux::tty::Tty;

use super::Line;
use crate::options::Plan;
use crate::relay::seed;

/// Silence of a neighbour after which a heartbeat is requested.
const PROBE_AFTER: Duration = Duration::from_millis(2_000);

/// Number of sent frames that the check remembers, to recognise their echoes.
const REMEMBERED: usize = 64;

/// Minimum number of damaged frames at which a wrong data rate is suspected.
const DAMAGED: u32 = 5;

/// Age from which on data received from a neighbour are ignored.
const OLD: Duration = Duration::from_millis(10_000);

/// Time added to the longest lease-renewal period. Before it sends, the check listens for their sum.
const RESERVE: Duration = Duration::from_millis(2_000);

/// Maximum distance of a drone's reported position from the first one, m, for a drone on the ground.
const STANDS_WITHIN_M: f32 = 5.0;

/// Data about a neighbour, from frames that name it as their sender.
#[derive(Clone, Copy, Debug, Default)]
struct Heard {
    /// Time of the last frame that the neighbour sent to any relay in this network.
    received: Option<Instant>,
    /// Time of the neighbour's last frame to this relay with a correct authentication tag.
    verified: Option<Instant>,
    /// Time of the neighbour's last message that confirms that the neighbour receives this relay.
    hears: Option<Instant>,
    /// True if the neighbour's drone flies.
    flies: bool,
    /// True once the neighbour has sent a lease renewal. This shows that its chain has agreed on positions.
    takes_part: bool,
    /// First position that the neighbour reported while its drone did not fly to setpoints, if any.
    stands: Option<Placement>,
    /// Digest of the neighbour's mission; `None` if not received yet.
    mission: Option<u16>,
    /// Number of frames from the neighbour that were signed with a wrong key.
    forged: u32,
    unsigned: u32,
    network: Option<u16>,
    replayed: u32,
}

/// Port toward neighbours. `received` contains an incomplete frame, `outgoing` the bytes that are not sent yet.
struct Wire {
    port: Port,
    tty: Tty,
    received: Vec<u8>,
    outgoing: Vec<u8>,
}

pub(super) struct Radio {
    relay: Relay,
    wires: Vec<Wire>,
    index: u16,
    of: u16,
    network: u16,
    digest: u16,
    baud: u32,
    epoch: Option<u32>,
    heard: BTreeMap<u16, Heard>,
    sent: VecDeque<Vec<u8>>,
    /// Number of frames from another node that uses this relay's number, too.
    twins: u32,
    damaged: u32,
    sends_from: Instant,
}

impl Radio {
    pub(super) fn new(
        plan: &Plan,
        auth: Option<Auth>,
        ports: Vec<(Port, Tty)>,
        now: Instant,
    ) -> Result<Self, String> {
        let probe_after = plan.settings.probe_after.min(PROBE_AFTER);
        let settings = Settings {
            auth,
            guard: None,
            leave_without_guard: true,
            probe_after,
            dead_after: probe_after.times(3),
            ..plan.settings
        };
        let mut relay = Relay::new(plan.mission, plan.identity, settings, seed(), now)
            .map_err(|error| error.to_string())?;
        relay.leave(now, None);
        let wire = |(port, tty)| Wire {
            port,
            tty,
            received: Vec::new(),
            outgoing: Vec::new(),
        };
        Ok(Self {
            relay,
            wires: ports.into_iter().map(wire).collect(),
            index: plan.identity.index,
            of: plan.mission.relays(),
            network: plan.identity.network,
            digest: plan.mission.digest(),
            baud: plan.options.baud,
            epoch: auth.map(|auth| auth.epoch),
            heard: BTreeMap::new(),
            sent: VecDeque::new(),
            twins: 0,
            damaged: 0,
            // The longest period of the lease renewals is a quarter of `dead_after`.
            sends_from: now
                + Duration::from_micros(plan.settings.dead_after.as_micros() / 4)
                + RESERVE,
        })
    }

    /// Returns the time from which on the check may send.
    pub(super) const fn sends_from(&self) -> Instant {
        self.sends_from
    }

    /// Returns the numbers of the relays that may be in flight.
    ///
    /// A relay may be in flight if it reports so. It may also be in flight if its chain has agreed on positions, unless
    /// it has reported that its drone is on the ground.
    fn flying(&self) -> Vec<String> {
        let flies = |heard: &Heard| heard.flies || heard.takes_part && heard.stands.is_none();
        let flying = self.heard.iter().filter(|(_, heard)| flies(heard));
        flying.map(|(node, _)| node.to_string()).collect()
    }

    /// Receives frames from the neighbours, and sends to them if `may_send` is true and no relay may fly.
    pub(super) fn exchange(&mut self, now: Instant, may_send: bool) {
        for at in 0..self.wires.len() {
            for (port, frame) in self.read(at) {
                self.take(now, port, &frame);
            }
        }
        let may_send = may_send && now >= self.sends_from && self.flying().is_empty();
        // If the chain agrees on no view without this relay, this relay becomes a member again. Then it leaves once
        // more.
        if self.relay.departure(now) != Departure::Outside {
            self.relay.stay(now);
            self.relay.leave(now, None);
        }
        self.relay.handle_timeout(now);
        while let Some(event) = self.relay.poll_event() {
            if let Event::DuplicateIndex { node } = event
                && node == self.index
            {
                self.twins += 1;
            }
        }
        let mut frame = [0; MAX_FRAME];
        loop {
            // This relay's votes are never sent. So they need not be stored either.
            self.relay.persist(|_| true);
            let Some(transmit) = self.relay.poll_transmit(now, &mut frame) else {
                break;
            };
            let bytes = frame.get(..transmit.len).unwrap_or_default();
            if !may_send || !decoded(bytes).is_some_and(|(_, content)| content.is_harmless()) {
                continue;
            }
            self.sent.push_back(bytes.to_vec());
            if self.sent.len() > REMEMBERED {
                self.sent.pop_front();
            }
            for wire in self
                .wires
                .iter_mut()
                .filter(|wire| wire.port == transmit.port)
            {
                wire.outgoing.extend_from_slice(bytes);
            }
        }
        for wire in &mut self.wires {
            let sent = wire.tty.write(&wire.outgoing).unwrap_or(0);
            wire.outgoing.drain(..sent);
        }
    }

    /// Returns the complete frames received at port number `at`, each with its final delimiter.
    fn read(&mut self, at: usize) -> Vec<(Port, Vec<u8>)> {
        let Some(wire) = self.wires.get_mut(at) else {
            return Vec::new();
        };
        let mut bytes = [0; 256];
        while let Ok(count @ 1..) = wire.tty.read(&mut bytes) {
            wire.received
                .extend_from_slice(bytes.get(..count).unwrap_or_default());
        }
        let mut frames = Vec::new();
        while let Some(end) = wire.received.iter().position(|byte| *byte == 0) {
            frames.push((wire.port, wire.received.drain(..=end).collect()));
        }
        if wire.received.len() > 2 * MAX_FRAME {
            // Noise without a delimiter.
            frames.push((wire.port, std::mem::take(&mut wire.received)));
        }
        frames
    }

    fn take(&mut self, now: Instant, port: Port, frame: &[u8]) {
        let Some((header, content)) = decoded(frame) else {
            self.damaged += u32::from(frame.len() > 1);
            return;
        };
        if self.sent.iter().any(|sent| sent == frame) {
            return;
        }
        let heard = self.heard.entry(header.sender).or_default();
        if header.network != self.network {
            heard.network = Some(header.network);
            return;
        }
        if header.sender == self.index {
            self.twins += 1;
            return;
        }
        heard.received = Some(now);
        if let Content::Message(Message::Report(reports)) = &content {
            for entry in &reports.entries {
                self.heard.entry(entry.relay()).or_default().flies |= is_in_air(entry);
            }
            return;
        }
        heard.observe(&content);
        if !content.is_harmless() {
            return;
        }
        let before = *self.relay.stats();
        self.relay.handle_bytes(now, port, frame);
        let after = self.relay.stats();
        let more = |of: fn(&Stats) -> u32| of(after).saturating_sub(of(&before));
        if !self.sent.is_empty() {
            // Frames received before this relay has sent any may be for its earlier start.
            heard.forged += more(|stats| stats.forged);
        }
        heard.replayed += more(|stats| stats.replayed);
        heard.unsigned += more(|stats| stats.unsigned) + more(|stats| stats.version);
        if more(|stats| stats.received) + more(|stats| stats.handshakes) == 0 {
            return;
        }
        heard.verified = Some(now);
        let hears = match content {
            Content::Handshake(epoch) => self.epoch == Some(epoch),
            Content::Message(Message::Hello(hello)) => {
                let distance = header.sender.abs_diff(self.index);
                heard.mission = Some(hello.mission);
                let hears = (1..=4).contains(&distance) && hello.hears >> (distance - 1) & 1 == 1;
                heard.hears = heard.hears.filter(|_| hears);
                hears
            }
            Content::Message(Message::Heartbeat { mission, reply, .. }) => {
                heard.mission = Some(mission);
                reply != 0
            }
            Content::Message(_) => false,
        };
        if hears {
            heard.hears = Some(now);
        }
    }

    /// Returns the result lines of the check about chain, neighbours and this relay's number.
    pub(super) fn lines(&self, now: Instant) -> Vec<Line> {
        let flying = self.flying();
        let mut lines = vec![(
            "chain",
            if flying.is_empty() {
                Ok("no flying relay was received".to_owned())
            } else {
                Err(format!(
                    "the chain is possibly in flight: these relays were received, and did not report that their drones are on the ground: {}; use --check only before flight",
                    flying.join(", ")
                ))
            },
        )];
        let neighbours = [self.index.checked_sub(1), self.index.checked_add(1)];
        let neighbours = neighbours
            .into_iter()
            .flatten()
            .filter(|node| (1..=self.of).contains(node));
        lines.extend(neighbours.map(|node| ("neighbour", self.neighbour(now, node))));
        lines.push(("number", match self.twins {
            0 => Ok(format!("no other relay with number {} was received", self.index)),
            twins => Err(format!("another relay with number {} was received ({twins} frames): give each drone its own --index", self.index)),
        }));
        lines
    }

    fn neighbour(&self, now: Instant, node: u16) -> Result<String, String> {
        let heard = self.heard.get(&node).copied().unwrap_or_default();
        let digest = self.digest;
        let is_recent = |at: Option<Instant>| at.is_some_and(|at| now.since(at) < OLD);
        if heard.received.is_some() && !is_recent(heard.received) {
            return Err(format!(
                "relay {node}: no frame received for 10 s: check that it is switched on"
            ));
        }
        let is_verified = is_recent(heard.verified);
        if let Some(other) = heard
            .mission
            .filter(|other| is_verified && *other != digest)
        {
            return Err(format!(
                "relay {node} has another mission, digest 0x{other:04x} instead of 0x{digest:04x}: load the same mission into both"
            ));
        }
        if is_verified {
            return match (is_recent(heard.hears), heard.mission) {
                (true, Some(_)) => Ok(format!(
                    "relay {node}: both relays receive each other, mission digest 0x{digest:04x}"
                )),
                (true, None) => Err(format!(
                    "relay {node} receives this relay, but has not reported its mission: check that its mission has the digest 0x{digest:04x}"
                )),
                (false, _) => Err(format!(
                    "relay {node} is received, but does not receive this relay: check this relay's transmitter and the receiver of relay {node}"
                )),
            };
        }
        Err(match heard {
            Heard {
                network: Some(other),
                ..
            } => format!(
                "relay {node} is in network {other}, this relay in {}",
                self.network
            ),
            Heard { forged: 1.., .. } => {
                format!("relay {node} signs with another key: give both relays the same --key-file")
            }
            Heard { replayed: 1.., .. } => format!(
                "relay {node} signs with an epoch (start counter) that is not above its last one: raise the number in its --epoch-file"
            ),
            Heard { unsigned: 1.., .. } if self.epoch.is_some() => {
                format!("relay {node} does not sign its frames, or has another software version")
            }
            Heard { unsigned: 1.., .. } => {
                format!("relay {node} signs its frames, but this relay has no --key-file")
            }
            Heard {
                received: Some(_), ..
            } => format!(
                "relay {node} is received, but sends nothing to this relay: it does not receive this relay, or has another key"
            ),
            _ if self.damaged >= DAMAGED => format!(
                "relay {node}: only damaged frames were received, {} of them: check that both ends have the data rate {} bit/s",
                self.damaged, self.baud
            ),
            _ => format!(
                "relay {node}: no frame received: check that it is switched on, and its port or radio"
            ),
        })
    }
}

impl Heard {
    /// Records what a message shows: the neighbour's drone flies, or its chain has agreed on positions.
    fn observe(&mut self, content: &Content) {
        let Content::Message(message) = content else {
            return;
        };
        match message {
            Message::Fence { fence, .. } if fence.flags & Fence::LEFT == 0 => self.flies = true,
            Message::Fence { fence, .. } if fence.flags & Fence::UNPLACED != 0 => {
                let at = fence.across.at(fence.x_m);
                let first = *self.stands.get_or_insert(at);
                let moved_m = (at.x_m - first.x_m).hypot(at.y_m - first.y_m);
                self.flies |= moved_m.hypot(at.altitude_m - first.altitude_m) > STANDS_WITHIN_M;
            }
            Message::Pulse(_) | Message::Pulsed(_) => self.takes_part = true,
            _ => {}
        }
    }
}

/// Content of an intact frame.
enum Content {
    /// Handshake with the epoch of the relay that receives it, as far as the sender knows this epoch.
    Handshake(u32),
    Message(Message),
}

impl Content {
    /// Returns true for a message that cannot affect any agreement of a chain. The check receives and sends no other
    /// messages.
    const fn is_harmless(&self) -> bool {
        use Message::{Claim, Heartbeat, Hello};
        matches!(
            self,
            Self::Handshake(_) | Self::Message(Hello(_) | Claim(_) | Heartbeat { .. })
        )
    }
}

/// Returns true if a relay's entry in a report shows that its drone is in the air.
///
/// The control states in the air are standby, engaged and blind.
const fn is_in_air(entry: &Entry) -> bool {
    entry.control() >= 3
}

/// Returns header and content of an intact frame; `None` for a damaged frame.
fn decoded(frame: &[u8]) -> Option<(Header, Content)> {
    let mut deframer = Deframer::new();
    let (last, start) = frame.split_last()?;
    for byte in start {
        _ = deframer.push(*byte);
    }
    let opened = open(deframer.push(*last)?.ok()?).ok()?;
    let content = if opened.handshake {
        // The sender's nonce is followed by the receiver's nonce, whose upper half is the receiver's epoch.
        let epoch = opened.body.get(12..16).and_then(<[u8]>::first_chunk);
        Content::Handshake(u32::from_le_bytes(*epoch?))
    } else {
        Content::Message(Message::decode(opened.body).ok()?)
    };
    Some((opened.header, content))
}

#[cfg(test)]
mod tests {
    use uav_relay::wire::message::{Coarse, Entry};

    use super::is_in_air;

    /// Checks every control state, with and without the flag for a duplicate relay number.
    #[test]
    fn a_report_says_if_the_drone_is_in_the_air() {
        let states = [false, false, false, true, true, true, true];
        for (control, expected) in (0..).zip(states) {
            for duplicated in [0, 28_672] {
                let state = 4_095 + 4_096 * control + duplicated;
                let entry = Entry::new(3, 0, state, Coarse::of(None));
                assert_eq!(is_in_air(&entry), expected, "{control} {duplicated}");
            }
        }
    }
}
