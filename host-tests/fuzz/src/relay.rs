//! One relay under anything that may come: bytes, lying neighbours, time in leaps, samples, restarts.

mod addresses;

use uav_relay::wire::digest::{MissionId, digest};
use uav_relay::wire::frame::MAX_DECODED;
use uav_relay::{Duration, Instant, Mission, Port, Sample, Side, Stats, Upload, Wiring};

use super::cobs::stuffed;
use super::counted::intact;
use super::input::Input;
use super::member::Member;
use super::message::{Header, Known, body, sealed};
use super::setting;
use super::watch::Watched;
use addresses::{far, from, port};

/// Operations in one run: some milliseconds of computing.
const MOST_OPERATIONS: usize = 256;

/// The relays of a chain, at most; in one of sixteen missions there are a thousand.
const MOST_RELAYS: u8 = 5;

/// Wake-ups in one operation.
const MOST_WAKES: u8 = 64;

/// Reads `data` as a mission, one of its relays, its settings, and then as operations on it, until they end.
///
/// # Panics
/// Where the relay breaks a promise: `watch` has them, and every intact frame counts once.
pub fn relay(data: &[u8]) {
    _ = flown(data);
}

/// As [`relay()`], and what the relay is in the end; `None` where the bytes ask for a mission or settings that are refused.
///
/// # Panics
/// As [`relay()`].
pub fn flown(data: &[u8]) -> Option<Watched> {
    let mut input = Input::new(data);
    let mut bench = Bench::new(&mut input)?;
    bench.greet();
    for _ in 0..MOST_OPERATIONS {
        if input.is_empty() {
            break;
        }
        bench.operate(&mut input);
        bench.settle();
    }
    Some(bench.watched)
}

/// The relay and its clock.
struct Bench {
    watched: Watched,
    index: u16,
    mission: Mission,
    wiring: Wiring,
    now: Instant,
    /// The neighbours upstream and downstream, at a relay that asks for tags.
    members: [Option<Member>; 2],
}

/// A frame on the wire, and what must become of it.
struct Said {
    wire: Vec<u8>,
    fate: Fate,
}

/// What a frame must be counted as.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Fate {
    /// One of all counters.
    Counted,
    /// Its body counts.
    Read,
    Unsigned,
    Forged,
    Replayed,
}

impl Bench {
    fn new(input: &mut Input<'_>) -> Option<Self> {
        let mut mission = setting::mission(input, MOST_RELAYS)?;
        if input.below(16) == 15 {
            mission = mission.with_relays(1000).ok()?;
        }
        let index = u16::from(input.byte()) % mission.relays() + 1;
        let chain = setting::of_chain(input, &mission);
        let mut settings = setting::settings(input, &mission, chain);
        if input.below(8) == 7 {
            // As impatient as it can be.
            settings.hop_time = Duration::from_micros(1);
            settings.probe_after = Duration::from_micros(1);
            settings.dead_after = Duration::from_micros(2);
        }
        let now = Instant::from_micros(u64::from(input.word()));
        let seed = u32::from(input.word());
        let watched = Watched::new(mission, index, settings, seed, now)?;
        Some(Self {
            watched,
            index,
            mission,
            wiring: settings.wiring,
            now,
            members: [None, None],
        })
    }

    /// The neighbours of a relay that asks for tags take its handshakes, and greet it.
    fn greet(&mut self) {
        let (sent, _) = self.watched.settle(self.now);
        for side in [0, 1] {
            let there = [self.index > 1, self.index < self.mission.relays()];
            // Handshakes come first, to upstream before downstream.
            let place = usize::from(side == 1 && there == [true; 2]);
            let heard = sent.get(place).filter(|_| there.get(side) == Some(&true));
            let member = heard.and_then(|frame| Member::greeted(&frame.bytes));
            let member = member.or_else(|| self.ground(side));
            self.introduce(side, member);
        }
    }

    /// Tx or Rx, if that is next at `side` and the relay answers it: nobody is greeted there before they say something.
    fn ground(&mut self, side: usize) -> Option<Member> {
        let (header, port) = from(self.index, side, self.wiring);
        let signs = self.watched.settings().auth.is_some();
        if !signs || (1..=self.mission.relays()).contains(&header.sender) {
            return None;
        }
        let handshake = stuffed(&Member::unknown().handshake(header));
        self.watched.bytes(self.now, port, &handshake);
        let (sent, _) = self.watched.settle(self.now);
        let heard = sent.last().and_then(|frame| Member::greeted(&frame.bytes));
        // What it has said was of another life.
        heard.map(|member| member.restarted())
    }

    /// `member` is the neighbour at `side` from now on, and says handshake.
    fn introduce(&mut self, side: usize, member: Option<Member>) {
        let Some(place) = self.members.get_mut(side) else {
            return;
        };
        *place = member;
        if let Some(member) = place {
            let (header, port) = from(self.index, side, self.wiring);
            let handshake = stuffed(&member.handshake(header));
            let refused = refusals(self.watched.relay().stats());
            self.watched.bytes(self.now, port, &[0]);
            self.watched.bytes(self.now, port, &handshake);
            let stats = self.watched.relay().stats();
            assert_eq!(refusals(stats), refused, "a handshake that is refused");
            self.settle();
        }
    }

    fn settle(&mut self) {
        self.watched.settle(self.now);
    }

    fn operate(&mut self, input: &mut Input<'_>) {
        match input.below(16) {
            0 => self.pass(Duration::from_micros(u64::from(input.word()))),
            1 => self.pass(Duration::from_millis(u64::from(input.word()))),
            // Time should not run backward. Where it does, nothing worse may happen than that something comes late.
            2 => {
                let back = u64::from(input.word());
                self.now = Instant::from_micros(self.now.as_micros().saturating_sub(back));
            }
            3..6 => self.wake(1 + input.below(MOST_WAKES)),
            6 => {
                let port = port(input.byte());
                self.noise(port, input.piece());
            }
            7 => self.watched.restart(self.now),
            8 => self.sample(input),
            15 => self.position(input),
            _ => self.message(input),
        }
    }

    /// Any bytes. There may be a recorded handshake among them, of neighbours in another life: those that there were are strangers
    /// from then on.
    fn noise(&mut self, port: Port, bytes: &[u8]) {
        let before = self.watched.relay().stats().handshakes;
        self.watched.bytes(self.now, port, bytes);
        if self.watched.relay().stats().handshakes > before {
            self.members = [None, None];
        }
    }

    fn pass(&mut self, span: Duration) {
        self.now = self.now + span;
    }

    /// Comes back when the relay wants to be called, over and over.
    fn wake(&mut self, times: u8) {
        for _ in 0..times {
            let Some(next) = self.watched.relay().poll_timeout() else {
                return;
            };
            self.now = next.max(self.now);
            self.settle();
        }
    }

    fn sample(&mut self, input: &mut Input<'_>) {
        let count = input.byte();
        let kind = input.byte();
        let power_w = |input: &mut Input<'_>| input.mostly(|input| input.scaled(1e-30, 1e6));
        let sample = match kind % 8 {
            1 | 3 => Sample::Interference {
                power_w: power_w(input),
            },
            5 => Sample::Heard {
                at: setting::place(input, self.mission.config()),
                power_w: power_w(input),
            },
            6 => Sample::Transmitter {
                power_w: power_w(input),
            },
            7 => Sample::Receiver {
                power_w: power_w(input),
            },
            _ => Sample::FirstHop {
                sir: input.mostly(|input| input.scaled(1e-9, 1e9)),
            },
        };
        self.watched.sample(self.now, sample, count);
    }

    /// It is told where it is or was, now and then that a neighbour has landed.
    fn position(&mut self, input: &mut Input<'_>) {
        let how = input.byte();
        if how >= 0xF0 {
            let side = if how.is_multiple_of(2) {
                Side::Upstream
            } else {
                Side::Downstream
            };
            return self.watched.forget(self.now, side);
        }
        let ago = Duration::from_millis(u64::from(how % 16) * 20);
        let at = self.now.as_micros().saturating_sub(ago.as_micros());
        let place = setting::place(input, self.mission.config());
        let at = Instant::from_micros(at);
        self.watched.position(self.now, at, place);
    }

    /// A frame with a good CRC, from whichever node, at whichever port; mostly those it may come from.
    fn message(&mut self, input: &mut Input<'_>) {
        let how = input.byte();
        let side = usize::from(how % 2);
        let (mut header, mut port) = from(self.index, side, self.wiring);
        match how / 2 % 32 {
            // On a shared channel it may become a neighbour.
            23..27 => header.sender = far(self.index, side, how / 64 + 1),
            // The version is in the top bits of the same word.
            27 => header.sender |= 0x2000,
            28 => header.network ^= 1,
            29 => header.destination = u16::from(input.byte()),
            30 => port = addresses::port(input.byte()),
            _ => {}
        }
        let known = Known {
            digest: digest(&self.mission),
            relays: self.mission.relays(),
            flown: self.flown(),
            held: self.held(),
            view: self.watched.relay().view(),
            number: self.watched.number(),
            association: self.watched.association(),
            asked: self.watched.asked(),
            distance_m: self.mission.config().distance_m,
        };
        let body = body(input, &known);
        let Said { wire, mut fate } = self.said(side, header, &body, input);
        if (header, port) != from(self.index, side, self.wiring) {
            fate = Fate::Counted;
        }
        // The delimiter before it ends what may have begun.
        self.watched.bytes(self.now, port, &[0]);
        let heard = (port == Port::Shared) == (self.wiring == Wiring::Shared);
        self.hear(port, &wire, heard.then_some(fate));
        if how / 64 == 3 {
            self.settle();
            let place = self.watched.relay().setpoint();
            let again = match fate {
                Fate::Read => Fate::Replayed,
                _ => fate,
            };
            self.hear(port, &wire, heard.then_some(again));
            let same = place == self.watched.relay().setpoint();
            assert!(same, "a frame that came twice");
        }
    }

    /// Digest of the mission that the relay flies, with all its relays.
    fn flown(&self) -> u16 {
        let mission = self.watched.relay().mission();
        let whole = mission.with_relays(self.mission.relays());
        digest(&whole.unwrap_or(self.mission))
    }

    /// The newest mission that it holds.
    fn held(&self) -> MissionId {
        let loaded = MissionId {
            version: 0,
            digest: digest(&self.mission),
        };
        self.watched.relay().upload().map_or(loaded, Upload::id)
    }

    /// A frame arrives; `None` where nobody listens.
    fn hear(&mut self, port: Port, wire: &[u8], fate: Option<Fate>) {
        let before = self.watched.relay().clone();
        self.watched.bytes(self.now, port, wire);
        let after = self.watched.relay();
        let (was, is) = (before.stats(), after.stats());
        let key = self.watched.settings().auth.is_some();
        let counted = frames(is, key) - frames(was, key);
        assert_eq!(counted, u64::from(fate.is_some()), "frames counted");
        let grown = match fate {
            None | Some(Fate::Counted) => return,
            Some(Fate::Read) => {
                return assert_eq!(refusals(is), refusals(was), "a member's frame");
            }
            Some(Fate::Unsigned) => is.unsigned - was.unsigned,
            Some(Fate::Forged) => is.forged - was.forged,
            Some(Fate::Replayed) => is.replayed - was.replayed,
        };
        assert_eq!(grown, 1, "{fate:?}");
        assert_eq!(before.phase(), after.phase());
        assert_eq!(before.setpoint(), after.setpoint());
        assert_eq!(before.target(), after.target());
        assert_eq!(before.poll_timeout(), after.poll_timeout());
    }

    /// The frame of a body, signed where tags are asked for, or as an attacker would have it.
    fn said(&mut self, side: usize, header: Header, body: &[u8], input: &mut Input<'_>) -> Said {
        let Some(Some(member)) = self.members.get_mut(side) else {
            let (wire, fate) = (stuffed(&header.unsigned(body)), Fate::Counted);
            return Said { wire, fate };
        };
        let (plain, fate) = match input.below(16) {
            10 => {
                let mut plain = member.signed(header, body);
                plain.truncate(plain.len() - 4);
                let place = 10 + usize::from(input.byte()) % (plain.len() - 10);
                if let Some(byte) = plain.get_mut(place) {
                    *byte ^= 1 << input.below(8);
                }
                sealed(&mut plain);
                (plain, Fate::Forged)
            }
            11 => (header.unsigned(body), Fate::Unsigned),
            12 => (member.stranger().signed(header, body), Fate::Forged),
            // Switched on anew, and without a handshake since.
            13 => (member.restarted().signed(header, body), Fate::Forged),
            14 => {
                let mut member = member.restarted();
                let plain = member.signed(header, body);
                self.introduce(side, Some(member));
                (plain, Fate::Read)
            }
            _ => (member.signed(header, body), Fate::Read),
        };
        let fate = if plain.len() > MAX_DECODED {
            Fate::Counted
        } else {
            fate
        };
        let wire = stuffed(&plain);
        Said { wire, fate }
    }
}

/// Frames that have been taken or refused, at a relay with a key or without one.
fn frames(stats: &Stats, key: bool) -> u64 {
    let broken = [stats.oversized, stats.truncated, stats.crc];
    let broken: u64 = broken.into_iter().map(u64::from).sum();
    broken + u64::from(intact(stats, key))
}

/// Frames that were no member's, or not new.
const fn refusals(stats: &Stats) -> [u32; 3] {
    [stats.unsigned, stats.forged, stats.replayed]
}
