//! One side of a relay: which node it takes for its neighbour there, and what it does about silence.
//!
//! | state | the node taken is silent for `lost` | it says that it takes another | a node not taken hellos | time passes |
//! | --- | --- | --- | --- | --- |
//! | `Linked` | `Seeking` on a shared channel, else it goes on asking | `Courting` | taken instead, if it is nearer, can hear a node beyond and was heard all through a probation | - |
//! | `Courting` | `Seeking` | - | as above | after a span `Seeking` |
//! | `Seeking` | - | - | taken, if it takes this relay or nobody | after a span `End` |
//! | `End` | - | - | taken, if it takes this relay, or was heard all through a probation | the four nearest nodes are sent a hello every `lost`, and more often once one was heard |
//!
//! A span is as long as a silent neighbour is asked for, `lost` less `quiet`. A node that has been taken is courted until it
//! says that it has taken this relay, too.
//!
//! While it seeks, it hellos the four nearest nodes there: as many as three relays in a row may be lost at once. The probation
//! is `lost`, and twice as long after every loss on that side up to sixteen times: a link that comes and goes disturbs the
//! chain less and less. A node that has come back is counted `quiet` later: the other one beside it may be about to take it, too.

use super::MEMBERSHIP;
use super::liveness::{Neighbour, Silence, tick};
use crate::settings::Settings;
use crate::time::Instant;
use crate::wire::digest::MissionId;

/// Nodes on one side that are sent a hello.
pub(crate) const CANDIDATES: u16 = 4;

/// Doublings of the probation.
const DOUBLINGS: u8 = 4;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// The other node has taken this one, too, as far as it has said.
    Linked,
    /// It has not, or not any more.
    Courting {
        since: Instant,
    },
    Seeking {
        since: Instant,
    },
    End,
}

/// A node that may be taken once it has been heard for long enough.
#[derive(Clone, Copy, Debug)]
struct Probation {
    node: u16,
    since: Instant,
    heard: Instant,
}

/// What waits to be sent to the neighbour, apart from passes and what comes back of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Signs {
    /// A heartbeat that asks for one in return.
    pub(crate) ask: bool,
    /// A heartbeat in return.
    pub(crate) answer: bool,
}

/// What a silence has led to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Quiet {
    /// When to look again, later than now.
    pub(crate) look_again: Instant,
    /// Whether the neighbour counts as lost since this moment.
    pub(crate) lost: bool,
}

/// One side.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    /// The node taken, 0 for none.
    node: u16,
    /// The node that was there when the view was agreed on.
    agreed: u16,
    /// The node that was there when a call was answered last, granted or not.
    counted: u16,
    /// A node that has come back is not counted before: the other side may be about to take it, too.
    grace: Instant,
    /// The node that the last call for a new view came from.
    caller: u16,
    state: State,
    neighbour: Neighbour,
    probation: Option<Probation>,
    /// When a node that is not taken was heard last.
    near: Option<Instant>,
    losses: u8,
    pub(crate) signs: Signs,
    /// The newest mission that the node taken holds, as far as it has said.
    pub(crate) holds: Option<MissionId>,
    /// Whether a newer one is to be offered to it.
    #[cfg(feature = "upload")]
    pub(crate) offer: bool,
    /// Whether the ground at this side is owed a hello.
    #[cfg(feature = "upload")]
    pub(crate) ground: bool,
    /// Candidates that are owed a hello, and those of them that are asked for one: bit 0 is the nearest node.
    hellos: u8,
    asks: u8,
}

impl Beside {
    /// The side where `node` is taken to be, 0 for none.
    pub(crate) const fn new(node: u16, now: Instant) -> Self {
        Self {
            node,
            agreed: node,
            counted: node,
            grace: now,
            caller: node,
            state: if node == 0 { State::End } else { State::Linked },
            neighbour: Neighbour::new(now),
            probation: None,
            near: None,
            losses: 0,
            signs: Signs {
                ask: false,
                answer: false,
            },
            holds: None,
            #[cfg(feature = "upload")]
            offer: false,
            #[cfg(feature = "upload")]
            ground: false,
            hellos: 0,
            asks: 0,
        }
    }

    /// The node taken, 0 for none.
    pub(crate) const fn node(&self) -> u16 {
        self.node
    }

    /// Whether nobody is there, and nobody is sought any more.
    pub(crate) fn is_end(&self) -> bool {
        self.state == State::End
    }

    /// Whether nobody is needed there, or somebody can be heard.
    pub(crate) fn is_ready(&self) -> bool {
        match self.state {
            State::End => true,
            State::Linked | State::Courting { .. } => self.neighbour.is_there(),
            State::Seeking { .. } => false,
        }
    }

    /// Whether it is certain who is there, and somebody else than when a call was answered last.
    pub(crate) fn has_changed(&self, now: Instant) -> bool {
        match self.state {
            State::Linked => self.node != self.counted && now >= self.grace,
            State::End => self.counted != 0,
            State::Courting { .. } | State::Seeking { .. } => false,
        }
    }

    /// Whether it is who was there when the view was agreed on.
    pub(crate) const fn is_agreed(&self) -> bool {
        self.node == self.agreed
    }

    /// The call for a new view has come from whoever is there, or begins here if nobody is to be before this relay.
    pub(crate) const fn called(&mut self, begins: bool) {
        self.caller = if begins { 0 } else { self.node };
    }

    /// The call that came from this side was granted.
    pub(crate) const fn agree_with_caller(&mut self) {
        self.agreed = self.caller;
        self.counted = self.caller;
    }

    /// The call was not granted: there is nothing to ask again until somebody else is there.
    pub(crate) const fn refuse(&mut self) {
        self.counted = self.node;
    }

    /// Whether whoever is there has come back just now.
    pub(crate) fn has_grace(&self, now: Instant) -> bool {
        now < self.grace
    }

    /// The call that was granted goes on to whoever is there, or ends here.
    pub(crate) const fn agree(&mut self, ends: bool) {
        self.agreed = if ends { 0 } else { self.node };
        self.counted = self.agreed;
    }

    /// A frame from the neighbour; whether it had been lost until then.
    pub(crate) fn heard(&mut self, now: Instant) -> bool {
        self.neighbour.heard(now)
    }

    /// Whether somebody is there, and takes this relay for its neighbour, too, as far as it has said.
    pub(crate) fn is_mutual(&self) -> bool {
        self.state == State::Linked
    }

    /// The neighbour has said whether it takes this relay for its own; whether that is new.
    pub(crate) fn told(&mut self, mutual: bool, now: Instant) -> bool {
        let next = match (self.state, mutual) {
            (State::Courting { .. }, true) => State::Linked,
            (State::Linked, false) => State::Courting { since: now },
            _ => return false,
        };
        self.state = next;
        true
    }

    /// The silence so far of a neighbour of the same view is excused; whether there is one, and it is not lost.
    pub(crate) fn excuse(&mut self, now: Instant) -> bool {
        let counted = self.state == State::Linked && self.is_agreed();
        counted && self.neighbour.excuse(now)
    }

    /// Nothing has come for a while. `seeks` tells whether others could be heard here.
    pub(crate) fn silent(&mut self, now: Instant, settings: &Settings, seeks: bool) -> Quiet {
        if !MEMBERSHIP {
            let Silence { lost, look_again } = self.neighbour.silent(now, settings);
            self.signs.ask = true;
            return Quiet { look_again, lost };
        }
        let step = tick(settings);
        let span = settings
            .lost
            .as_micros()
            .saturating_sub(settings.quiet.as_micros());
        let is_over = |since: Instant| now.since(since).as_micros() >= span;
        let mut lost = false;
        let mut look_again = now + step;
        match self.state {
            State::Linked => {
                let silence = self.neighbour.silent(now, settings);
                lost = silence.lost;
                self.signs.ask = true;
                if lost && seeks {
                    self.losses = self.losses.saturating_add(1);
                    self.seek(now);
                } else {
                    look_again = silence.look_again;
                }
            }
            State::Courting { since } => {
                lost = self.neighbour.silent(now, settings).lost;
                self.hello_all();
                if lost || is_over(since) {
                    self.seek(now);
                }
            }
            State::Seeking { since } => {
                self.hello_all();
                if is_over(since) {
                    self.state = State::End;
                }
            }
            State::End => {
                self.hello_all();
                if !self.is_near(now, settings) {
                    look_again = now + settings.lost;
                }
            }
        }
        Quiet { look_again, lost }
    }

    fn is_near(&self, now: Instant, settings: &Settings) -> bool {
        self.near
            .is_some_and(|near| now.since(near) <= settings.lost)
    }

    /// A node that is not taken has been heard; whether the chain has ended here so far, and nobody was near.
    pub(crate) fn notice(&mut self, now: Instant, settings: &Settings) -> bool {
        let new = self.is_end() && !self.is_near(now, settings);
        self.near = Some(now);
        new
    }

    const fn seek(&mut self, now: Instant) {
        self.node = 0;
        self.state = State::Seeking { since: now };
        self.probation = None;
        self.hello_all();
    }

    /// A node that is not taken has sent a hello: whether it is taken from now on.
    ///
    /// `courts` is whether it takes this relay for its neighbour (else nobody), `nearer` whether it is nearer than the one
    /// taken, `ready` whether it can hear a node beyond.
    pub(crate) fn consider(
        &mut self,
        node: u16,
        courts: bool,
        nearer: bool,
        ready: bool,
        now: Instant,
        settings: &Settings,
    ) -> bool {
        let takes = match self.state {
            State::Seeking { .. } => true,
            State::End => courts || self.passes(node, now, settings),
            State::Linked | State::Courting { .. } => {
                nearer && ready && self.passes(node, now, settings)
            }
        };
        if !takes {
            return false;
        }
        if !matches!(self.state, State::Seeking { .. }) {
            self.grace = now + settings.quiet;
        }
        self.node = node;
        self.state = State::Courting { since: now };
        self.neighbour = Neighbour::new(now);
        self.neighbour.heard(now);
        self.probation = None;
        true
    }

    /// Whether a node that is heard now has been for the whole of its probation.
    fn passes(&mut self, node: u16, now: Instant, settings: &Settings) -> bool {
        let since = match self.probation {
            Some(known) if known.node == node && now.since(known.heard) <= settings.quiet => {
                known.since
            }
            _ => now,
        };
        self.probation = Some(Probation {
            node,
            since,
            heard: now,
        });
        let times = 1 << self.losses.min(DOUBLINGS);
        now.since(since) >= settings.lost.times(times)
    }

    /// Owes a hello to the candidate `distance` nodes away, which may be one that asks.
    pub(crate) const fn owe(&mut self, distance: u16, ask: bool) {
        if distance >= 1 && distance <= CANDIDATES {
            let bit = 1 << (distance - 1);
            self.hellos |= bit;
            if ask {
                self.asks |= bit;
            }
        }
    }

    const fn hello_all(&mut self) {
        self.hellos = 0x0F;
        self.asks = 0x0F;
    }

    /// The nearest candidate that is owed a hello: how many nodes away, and whether it is asked.
    pub(crate) fn take_hello(&mut self) -> Option<(u16, bool)> {
        let distance = (1..=CANDIDATES).find(|distance| self.hellos >> (distance - 1) & 1 == 1)?;
        let bit = 1 << (distance - 1);
        self.hellos &= !bit;
        let ask = self.asks & bit != 0;
        self.asks &= !bit;
        Some((distance, ask))
    }
}
