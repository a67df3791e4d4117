//! Forecast of the relays' positions. Simulated relays with the on-board code adopt the new mission beforehand.

use std::collections::VecDeque;
use std::time::{Duration, Instant as Clock};

use uav_relay::MAX_FRAME;
use uav_relay::flight::axis::Axis;
use uav_relay::{
    Auth, Event, Geodetic, Identity, Instant, Interference, Key, Method, Mission, Placement, Port,
    Profile, Relay, Settings, Sites, Upload,
};

/// Time that a frame takes from one simulated relay to the next, µs.
const TURN_US: u64 = 1_000;

const TIME_LIMIT: Duration = Duration::from_secs(10);

/// Mission loaded into the relays before flight, and the settings for a forecast of their positions.
#[derive(Clone, Debug)]
pub(crate) struct Loaded {
    pub(crate) mission: Mission,
    pub(crate) method: Method,
    pub(crate) profiles: Vec<(u16, Profile)>,
    /// Numbers of the relays with a fixed altitude.
    pub(crate) held: Vec<u16>,
}

struct Letter {
    to: usize,
    port: Port,
    bytes: Vec<u8>,
}

/// Simulated chain of relays, whose links lose no frame.
struct Chain {
    relays: Vec<Relay>,
    agreed: Vec<bool>,
    letters: VecDeque<Letter>,
    now: Instant,
}

impl Chain {
    /// Creates simulated relays that fly the mission `flown`. With `None` they fly the mission loaded before flight.
    fn flying(loaded: &Loaded, flown: Option<&Upload>) -> Option<Self> {
        let relays = (1..=loaded.mission.relays()).map(|index| {
            let identity = Identity { network: 0, index };
            let own = loaded.profiles.iter().find(|(of, _)| *of == index);
            let settings = Settings {
                method: loaded.method,
                profile: own.map(|(_, profile)| *profile),
                hold_altitude: loaded.held.contains(&index),
                auth: Some(Auth {
                    key: Key::new([0; 32]),
                    epoch: 1,
                }),
                ..Settings::default()
            };
            let seed = u32::from(index) << 16;
            let mut relay =
                Relay::new(loaded.mission, identity, settings, seed, Instant::ZERO).ok()?;
            if let Some(flown) = flown {
                relay.resume(flown).ok()?;
            }
            Some(relay)
        });
        let relays: Vec<Relay> = relays.collect::<Option<_>>()?;
        Some(Self {
            agreed: vec![false; relays.len()],
            relays,
            letters: VecDeque::new(),
            now: Instant::ZERO,
        })
    }

    /// Simulates a millisecond: delivers the frames of the last millisecond, and collects new frames. Marks the relays
    /// that have agreed on positions in mission `version`.
    fn turn(&mut self, version: u16) {
        self.now = Instant::from_micros(self.now.as_micros() + TURN_US);
        let now = self.now;
        for Letter { to, port, bytes } in std::mem::take(&mut self.letters) {
            // Frames to the transmitter and the receiver are dropped.
            if let Some(relay) = to.checked_sub(1).and_then(|at| self.relays.get_mut(at)) {
                relay.handle_bytes(now, port, &bytes);
            }
        }
        let mut frame = [0; MAX_FRAME];
        for (number, (relay, agreed)) in (1..).zip(self.relays.iter_mut().zip(&mut self.agreed)) {
            relay.handle_timeout(now);
            relay.persist(|_| true);
            while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
                let (to, port) = match transmit.port {
                    Port::Upstream => (number - 1, Port::Downstream),
                    _ => (number + 1, Port::Upstream),
                };
                let bytes = frame.get(..transmit.len).unwrap_or_default().to_vec();
                self.letters.push_back(Letter { to, port, bytes });
            }
            while let Some(event) = relay.poll_event() {
                *agreed |= event == Event::Converged && relay.version() == version;
            }
        }
    }

    /// Runs the chain until all relays have agreed on positions in mission `version`.
    ///
    /// Returns these positions; `None` if the relays have not agreed by the time `end`.
    fn positions(&mut self, version: u16, end: Clock) -> Option<Vec<Placement>> {
        self.agreed.fill(false);
        while !self.agreed.iter().all(|agreed| *agreed) {
            if Clock::now() >= end {
                return None;
            }
            self.turn(version);
        }
        self.relays.iter().map(Relay::setpoint).collect()
    }
}

/// Agreed positions of a relay before and after an upload.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Move {
    pub(crate) index: u16,
    pub(crate) before: Placement,
    pub(crate) after: Placement,
    pub(crate) metres: f64,
}

/// Returns the move of each relay from the mission `flown` to `new`. `flown` is `None` if the relays fly the mission
/// that was loaded before flight.
///
/// `before` and `after` are the Tx and Rx positions of the two missions. The result is `None` if the positions cannot
/// be predicted: the relays measure the interference, or the simulated relays do not agree within ten seconds of
/// computing.
pub(crate) fn moves(
    loaded: &Loaded,
    flown: Option<&Upload>,
    new: &Upload,
    [before, after]: [Option<Sites>; 2],
) -> Option<Vec<Move>> {
    let config = flown.map_or(loaded.mission.config(), Upload::config);
    let is_measured = |interference| interference == Interference::Unknown;
    if is_measured(config.interference) || is_measured(new.config().interference) {
        return None;
    }
    let end = Clock::now() + TIME_LIMIT;
    let mut chain = Chain::flying(loaded, flown)?;
    let from = chain.positions(flown.map_or(0, Upload::version), end)?;
    let to = if flown.is_some_and(|flown| flown.id() == new.id()) {
        from.clone()
    } else {
        let now = chain.now;
        chain.relays.first_mut()?.handle_upload(now, new).ok()?;
        chain.positions(new.version(), end)?
    };
    let lines = [before, after].map(|sites| sites.and_then(|sites| Axis::between(sites).ok()));
    let pairs = from.into_iter().zip(to);
    let moves = (1..).zip(pairs).map(|(index, (before, after))| Move {
        index,
        before,
        after,
        metres: apart_m(&lines, before, after),
    });
    Some(moves.collect())
}

/// Returns the distance, m, between a relay's positions before and after an upload.
///
/// `lines` are the lines on earth from Tx to Rx before and after. If one of them is `None`, the line counts as
/// unchanged.
fn apart_m(lines: &[Option<Axis>; 2], before: Placement, after: Placement) -> f64 {
    let on_earth = |axis: &Option<Axis>, place| axis.as_ref().and_then(|axis| axis.point(place));
    let [one, other] = lines;
    if let (Some(before), Some(after)) = (on_earth(one, before), on_earth(other, after)) {
        return straight_m(before, after);
    }
    let step = |from: f32, to: f32| f64::from(to) - f64::from(from);
    step(before.x_m, after.x_m)
        .hypot(step(before.y_m, after.y_m))
        .hypot(step(before.altitude_m, after.altitude_m))
}

/// Returns the straight distance between two points on earth near each other, m.
fn straight_m(one: Geodetic, other: Geodetic) -> f64 {
    /// Metres per 1e-7 degree of latitude.
    const UNIT_M: f64 = 0.011_131_949;
    let step = |from: i32, to: i32| f64::from(to) - f64::from(from);
    let latitude = (f64::from(one.lat_e7) * 1e-7).to_radians();
    let north_m = step(one.lat_e7, other.lat_e7) * UNIT_M;
    let east_m = step(one.lon_e7, other.lon_e7) * UNIT_M * latitude.cos();
    let up_m = step(one.amsl_mm, other.amsl_mm) / 1e3;
    north_m.hypot(east_m).hypot(up_m)
}
