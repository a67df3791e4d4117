//! Fuzz target: one relay with arbitrary bytes, malicious neighbours, time jumps, samples and restarts.

mod addresses;

use uav_relay::wire::digest::{MissionId, digest};
use uav_relay::wire::frame::{Header, MAX_DECODED};
use uav_relay::{Duration, Instant, Mission, Port, Sample, Side, Stats, Upload, Wiring};
use uav_relay_decode::envelope::{sealed, stuffed, unsigned};

use super::counted::intact;
use super::input::Input;
use super::member::Member;
use super::message::{RelayState, body};
use super::setting;
use super::watch::Watched;
use addresses::{far, from, port};

/// Maximum number of fuzzed operations in one run; each takes some milliseconds.
const MAX_OPERATIONS: usize = 256;

/// Maximum number of relays in a mission, except that one mission in sixteen has 1000.
const MAX_RELAYS: u8 = 5;

/// Maximum number of timeouts handled by one operation.
const MAX_WAKES: u8 = 64;

/// Fuzz target. Reads `data` as a mission, the settings of one relay, and operations on this relay.
///
/// # Panics
/// If the relay breaks a rule that the module `watch` checks, or does not count an intact frame exactly once.
pub fn relay(data: &[u8]) {
    _ = flown(data);
}

/// Runs the fuzz target [`relay()`] and returns the relay at the end.
///
/// `None` if the mission or the settings are refused.
///
/// # Panics
/// Those of [`relay()`].
pub fn flown(data: &[u8]) -> Option<Watched> {
    let mut input = Input::new(data);
    let mut bench = Bench::new(&mut input)?;
    bench.exchange_handshakes();
    for _ in 0..MAX_OPERATIONS {
        if input.is_empty() {
            break;
        }
        bench.operate(&mut input);
        bench.settle();
    }
    Some(bench.watched)
}

struct Bench {
    watched: Watched,
    index: u16,
    mission: Mission,
    wiring: Wiring,
    now: Instant,
    /// Simulated neighbours of the relay: upstream, then downstream.
    ///
    /// An entry is `None` if the relay does not require tags (signatures), or if that neighbour has not received the
    /// relay's nonce.
    members: [Option<Member>; 2],
}

/// Frame for the relay, and the counter in which the relay must count it.
struct TestFrame {
    wire: Vec<u8>,
    counter: ExpectedCounter,
}

/// Counter in which the tested relay must count a received frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum ExpectedCounter {
    Counted,
    Read,
    Unsigned,
    Forged,
    Replayed,
}

impl Bench {
    fn new(input: &mut Input<'_>) -> Option<Self> {
        let mut mission = setting::mission(input, MAX_RELAYS)?;
        if input.below(16) == 15 {
            mission = mission.with_relays(1000).ok()?;
        }
        let index = u16::from(input.byte()) % mission.relays() + 1;
        let chain = setting::of_chain(input, &mission);
        let mut settings = setting::settings(input, &mission, chain);
        if input.below(8) == 7 {
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

    /// Exchanges handshakes between the relay and its neighbours, if the relay requires tags.
    fn exchange_handshakes(&mut self) {
        let (sent, _) = self.watched.settle(self.now);
        for side in [0, 1] {
            let there = [self.index > 1, self.index < self.mission.relays()];
            // The relay sends its handshakes first, upstream before downstream.
            let place = usize::from(side == 1 && there == [true; 2]);
            let heard = sent.get(place).filter(|_| there.get(side) == Some(&true));
            let member = heard.and_then(|frame| Member::from_handshake(&frame.bytes));
            let member = member.or_else(|| self.ground(side));
            self.introduce(side, member);
        }
    }

    /// Returns the node at `side` (0 upstream, 1 downstream) after a handshake, if this node is Tx or Rx.
    ///
    /// `None` if it is a relay, or without tags (signatures). The tested relay answers handshakes of Tx and Rx, but
    /// never starts one with them.
    fn ground(&mut self, side: usize) -> Option<Member> {
        let (header, port) = from(self.index, side, self.wiring);
        let signs = self.watched.settings().auth.is_some();
        if !signs || (1..=self.mission.relays()).contains(&header.sender) {
            return None;
        }
        let handshake = stuffed(&Member::unknown().handshake(header));
        self.watched.bytes(self.now, port, &handshake);
        let (sent, _) = self.watched.settle(self.now);
        let heard = sent
            .last()
            .and_then(|frame| Member::from_handshake(&frame.bytes));
        // The relay counts the handshake sent above as one from an earlier start.
        heard.map(|member| member.restarted())
    }

    /// Sets the simulated neighbour at `side` (0 upstream, 1 downstream), and delivers its handshake.
    ///
    /// `None` removes the neighbour at this side.
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
            0 => self.advance_time(Duration::from_micros(u64::from(input.word()))),
            1 => self.advance_time(Duration::from_millis(u64::from(input.word()))),
            // Time should not run backward. If it does, only delays may result.
            2 => {
                let back = u64::from(input.word());
                self.now = Instant::from_micros(self.now.as_micros().saturating_sub(back));
            }
            3..6 => self.wake(1 + input.below(MAX_WAKES)),
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

    /// Delivers arbitrary bytes to the relay.
    ///
    /// A valid handshake in the bytes changes the relay's nonces. The simulated neighbours do not know the new nonces,
    /// so they are removed then.
    fn noise(&mut self, port: Port, bytes: &[u8]) {
        let before = self.watched.relay().stats().handshakes;
        self.watched.bytes(self.now, port, bytes);
        if self.watched.relay().stats().handshakes > before {
            self.members = [None, None];
        }
    }

    fn advance_time(&mut self, span: Duration) {
        self.now = self.now + span;
    }

    /// Advances the time to the relay's next timeout, and handles it, `times` times.
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

    /// Reports a present or past position of the drone.
    ///
    /// Sometimes it reports instead that the lost relays on one side have landed.
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

    /// Delivers a message with a valid CRC.
    ///
    /// Header and port are mostly those of a neighbour. Sometimes either the port or one field of the header is
    /// different.
    fn message(&mut self, input: &mut Input<'_>) {
        let how = input.byte();
        let side = usize::from(how % 2);
        let (mut header, mut port) = from(self.index, side, self.wiring);
        match how / 2 % 32 {
            // The sender may become a neighbour of the relay on a shared channel.
            23..27 => header.sender = far(self.index, side, how / 64 + 1),
            // The top bits of this word are the version.
            27 => header.sender |= 0x2000,
            28 => header.network ^= 1,
            29 => header.destination = u16::from(input.byte()),
            30 => port = addresses::port(input.byte()),
            _ => {}
        }
        let state = RelayState {
            digest: digest(&self.mission),
            relays: self.mission.relays(),
            flown: self.flown(),
            held: self.held(),
            view: self.watched.relay().view(),
            number: self.watched.number(),
            association: self.watched.association(),
            offer_number: self.watched.offer_number(),
            distance_m: self.mission.config().distance_m,
        };
        let body = body(input, &state);
        let TestFrame { wire, mut counter } = self.test_frame(side, header, &body, input);
        if (header, port) != from(self.index, side, self.wiring) {
            counter = ExpectedCounter::Counted;
        }
        // This delimiter ends an incomplete frame.
        self.watched.bytes(self.now, port, &[0]);
        let heard = (port == Port::Shared) == (self.wiring == Wiring::Shared);
        self.deliver(port, &wire, heard.then_some(counter));
        if how / 64 == 3 {
            self.settle();
            let place = self.watched.relay().setpoint();
            let again = match counter {
                ExpectedCounter::Read => ExpectedCounter::Replayed,
                _ => counter,
            };
            self.deliver(port, &wire, heard.then_some(again));
            let same = place == self.watched.relay().setpoint();
            assert!(same, "a frame that came twice");
        }
    }

    fn flown(&self) -> u16 {
        let mission = self.watched.relay().mission();
        let whole = mission.with_relays(self.mission.relays());
        digest(&whole.unwrap_or(self.mission))
    }

    fn held(&self) -> MissionId {
        let loaded = MissionId {
            version: 0,
            digest: digest(&self.mission),
        };
        self.watched.relay().upload().map_or(loaded, Upload::id)
    }

    /// Delivers a frame, and checks that the relay counts it as `counter` says.
    ///
    /// `counter` is `None` at a port that the relay does not use.
    fn deliver(&mut self, port: Port, wire: &[u8], counter: Option<ExpectedCounter>) {
        let before = self.watched.relay().clone();
        self.watched.bytes(self.now, port, wire);
        let after = self.watched.relay();
        let (was, is) = (before.stats(), after.stats());
        let key = self.watched.settings().auth.is_some();
        let counted = frames(is, key) - frames(was, key);
        assert_eq!(counted, u64::from(counter.is_some()), "frames counted");
        let grown = match counter {
            None | Some(ExpectedCounter::Counted) => return,
            Some(ExpectedCounter::Read) => {
                return assert_eq!(refusals(is), refusals(was), "a member's frame");
            }
            Some(ExpectedCounter::Unsigned) => is.unsigned - was.unsigned,
            Some(ExpectedCounter::Forged) => is.forged - was.forged,
            Some(ExpectedCounter::Replayed) => is.replayed - was.replayed,
        };
        assert_eq!(grown, 1, "{counter:?}");
        assert_eq!(before.phase(), after.phase());
        assert_eq!(before.setpoint(), after.setpoint());
        assert_eq!(before.target(), after.target());
        assert_eq!(before.poll_timeout(), after.poll_timeout());
    }

    /// Builds a frame with this body, signed if the relay requires tags.
    ///
    /// In some cases the frame is altered, unsigned, or signed with a wrong key or nonce.
    fn test_frame(
        &mut self,
        side: usize,
        header: Header,
        body: &[u8],
        input: &mut Input<'_>,
    ) -> TestFrame {
        let Some(Some(member)) = self.members.get_mut(side) else {
            let (wire, counter) = (stuffed(&unsigned(header, body)), ExpectedCounter::Counted);
            return TestFrame { wire, counter };
        };
        let (plain, counter) = match input.below(16) {
            10 => {
                let mut plain = member.signed(header, body);
                plain.truncate(plain.len() - 4);
                let place = 10 + usize::from(input.byte()) % (plain.len() - 10);
                if let Some(byte) = plain.get_mut(place) {
                    *byte ^= 1 << input.below(8);
                }
                (sealed(plain), ExpectedCounter::Forged)
            }
            11 => (unsigned(header, body), ExpectedCounter::Unsigned),
            12 => (
                member.with_other_key().signed(header, body),
                ExpectedCounter::Forged,
            ),
            // The neighbour signs as after a restart, but without a new handshake.
            13 => (
                member.restarted().signed(header, body),
                ExpectedCounter::Forged,
            ),
            14 => {
                let mut member = member.restarted();
                let plain = member.signed(header, body);
                self.introduce(side, Some(member));
                (plain, ExpectedCounter::Read)
            }
            _ => (member.signed(header, body), ExpectedCounter::Read),
        };
        let counter = if plain.len() > MAX_DECODED {
            ExpectedCounter::Counted
        } else {
            counter
        };
        let wire = stuffed(&plain);
        TestFrame { wire, counter }
    }
}

/// Returns the number of frames that the relay has counted, accepted or rejected.
///
/// `key` is true if the relay has a signing key.
fn frames(stats: &Stats, key: bool) -> u64 {
    let broken = [stats.oversized, stats.truncated, stats.crc];
    let broken: u64 = broken.into_iter().map(u64::from).sum();
    broken + u64::from(intact(stats, key))
}

/// Returns the counters of frames without a valid tag: unsigned, forged, replayed.
const fn refusals(stats: &Stats) -> [u32; 3] {
    [stats.unsigned, stats.forged, stats.replayed]
}
