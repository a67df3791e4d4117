//! Autopilot link with arbitrary bytes and arbitrary calls.

use uav_relay::Geodetic;
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::autopilot::{Autopilot, AutopilotEvent, Kind};
use uav_relay::flight::axis::Axis;
use uav_relay::pointing::Bearing;
use uav_relay::{Duration, Event, Instant, Placement, Side};

use super::payload::{float, long, sized};
use super::peer::Peer;
use super::wire::{
    ACK, COMMAND, EXTENDED_STATE, GLOBAL_POSITION, HEARTBEAT, POSITION_TARGET, SENT, SET_POSITION,
    VALUE, checksum, frame,
};
use crate::heap::without_allocation;
use crate::input::Input;

const MAX_OPERATIONS: usize = 256;

/// Maximum number of frames that the link may send per cycle. A link that sends more seems never to stop.
///
/// The limit is twice the sum 13 of these frames: heartbeat, three message requests, command answer, flight target,
/// three status texts and four named values. A clock request (TIMESYNC) can come in addition.
const MAX_FRAMES: usize = 26;

/// Maximum distance of a flight target from the line Tx-Rx, m.
///
/// The link permits 5 km. The limit has 40 m more, because the test computes the distance on a flat earth.
const AROUND_M: f64 = 5_040.0;

/// Position of Tx: latitude and longitude, degrees; height above the sea, m.
const TX: [f64; 3] = [47.40, 8.54, 420.0];
/// Position of Rx: latitude and longitude, degrees; height above the sea, m.
const RX: [f64; 3] = [47.41, 8.55, 431.0];

const MOVED: [f64; 3] = [47.408, 8.556, 440.0];

/// Length of a degree of latitude and of longitude near Tx and Rx, m.
const DEGREE_M: [f64; 2] = [111_180.0, 75_470.0];

struct Link {
    autopilot: Autopilot,
    peer: Option<Peer>,
    axis: Axis,
    rx: [f64; 3],
    now: Instant,
    began: Instant,
    kind: Option<Kind>,
    told: [i32; 2],
}

fn line_to(rx: [f64; 3]) -> Option<Axis> {
    let site = |[lat, lon, amsl]: [f64; 3]| Geodetic::from_degrees(lat, lon, amsl);
    Axis::try_new(site(TX)?, site(rx)?).ok()
}

/// Reads the rest of `input` as operations on an autopilot link, and checks the link after each.
///
/// `signs` is true if the link signs its frames and requires signed frames from the autopilot.
pub(super) fn operate(input: &mut Input<'_>, signs: bool) {
    let Some(mut link) = Link::new(input, signs) else {
        return;
    };
    link.settle();
    for _ in 0..MAX_OPERATIONS {
        if input.is_empty() {
            return;
        }
        link.operate(input);
        link.settle();
    }
}

impl Link {
    fn new(input: &mut Input<'_>, signs: bool) -> Option<Self> {
        let axis = line_to(RX)?;
        let pace = Pace {
            speed_m_s: input.even(0.1, 20.0),
            acceleration_m_s2: input.even(0.1, 5.0),
        };
        let now = Instant::from_millis(u64::from(input.word()));
        let mut autopilot = Autopilot::new(axis, pace, now);
        let peer = signs.then(|| {
            let (peer, signing) = Peer::new(input, now);
            autopilot.sign(signing);
            peer
        });
        Some(Self {
            autopilot,
            peer,
            axis,
            rx: RX,
            now,
            began: now,
            kind: None,
            told: [0; 2],
        })
    }

    fn operate(&mut self, input: &mut Input<'_>) {
        match input.below(if self.peer.is_some() { 19 } else { 15 }) {
            0 => {
                let lengths = input.word();
                self.deliver_bytes(input.piece(), lengths);
            }
            1 | 2 => self.heartbeat(input),
            3 => match input.below(7) {
                6 => self.clear_lost_relay(input),
                landed => {
                    self.deliver_frame(input, &frame(EXTENDED_STATE, [1, 1], &[0, landed], 0));
                }
            },
            4 => {
                let place = nearby_place(input);
                self.position(input, place);
            }
            5 => {
                let raw = input.piece().to_vec();
                self.deliver_frame(input, &frame(GLOBAL_POSITION, [1, 1], &sized(raw, 28), 0));
            }
            6 => {
                let mut payload = vec![0; 4];
                let [lat, lon] = self.told;
                let off = i32::from(input.byte() / 8);
                payload.extend(lat.wrapping_add(off).to_le_bytes());
                payload.extend(lon.to_le_bytes());
                self.deliver_frame(
                    input,
                    &frame(POSITION_TARGET, [1, 1], &sized(payload, 51), 0),
                );
            }
            7 => self.now = self.now + Duration::from_millis(u64::from(input.word())),
            8 | 9 => {
                for _ in 0..input.below(64) {
                    self.now = self.now.max(self.autopilot.poll_timeout(self.now));
                    self.settle();
                }
            }
            10 => {
                let setpoint = input.flag().then(|| any_place(input));
                without_allocation(|| self.autopilot.handle_setpoint(self.now, setpoint));
            }
            11 => {
                let look = input.flag().then(|| Bearing {
                    azimuth_rad: input.mostly(|input| input.even(-3.2, 3.2)),
                    elevation_rad: 0.0,
                    distance_m: 1.0,
                });
                self.autopilot.handle_bearing(look);
            }
            12 => {
                let (sir, place) = (input.any_number(), any_place(input));
                without_allocation(|| {
                    self.autopilot
                        .handle_values(self.now, Some(sir), Some(place));
                });
            }
            13 => {
                let text = String::from_utf8_lossy(input.piece()).into_owned();
                without_allocation(|| self.autopilot.send_text(&text));
            }
            14 => {
                self.rx = if input.flag() { MOVED } else { RX };
                if let Some(axis) = line_to(self.rx) {
                    self.axis = axis;
                    without_allocation(|| self.autopilot.fly_along(self.now, axis));
                }
            }
            15 => {
                let before = self
                    .peer
                    .as_ref()
                    .and_then(|peer| peer.recorded_frame(input));
                self.deliver_bytes(&before.unwrap_or_default(), 0);
            }
            16 => {
                if let Some(peer) = &mut self.peer {
                    peer.set_clock(input);
                }
            }
            // The link's own clock jumps by up to 50 days.
            17 => self.now = self.now + Duration::from_millis(u64::from(input.long())),
            _ => {
                let frame = frame(ACK, [1, 1], &sized(input.piece().to_vec(), 10), 0);
                self.deliver_frame(input, &frame);
            }
        }
    }

    /// Delivers a frame of the autopilot to the link. If the link requires signatures, `input` decides if the frame's
    /// signature is right.
    fn deliver_frame(&mut self, input: &mut Input<'_>, frame: &[u8]) {
        match &mut self.peer {
            Some(peer) => {
                let signed = peer.sign_frame(input, frame);
                self.deliver_bytes(&signed, 0);
            }
            None => self.deliver_bytes(frame, 0),
        }
    }

    /// Delivers bytes to the link in one piece, and to a copy of the link in many pieces. The results must be equal.
    ///
    /// The pieces have two alternating lengths.
    fn deliver_bytes(&mut self, bytes: &[u8], lengths: u16) {
        let mut other = self.autopilot.clone();
        without_allocation(|| self.autopilot.handle_bytes(self.now, bytes));
        let mut rest = bytes;
        for len in lengths.to_le_bytes().into_iter().cycle() {
            if rest.is_empty() {
                break;
            }
            let len = (usize::from(len) + 1).min(rest.len());
            let (piece, after) = rest.split_at_checked(len).unwrap_or((rest, &[]));
            other.handle_bytes(self.now, piece);
            rest = after;
        }
        let mut both = [self.autopilot.clone(), other];
        let [one, other] = both.each_mut().map(|link| {
            let sent: Vec<_> = core::iter::from_fn(|| link.poll_transmit(self.now)).collect();
            let cleared = link.poll_cleared();
            (
                sent,
                link.poll_position(),
                cleared,
                link.state(),
                link.counters(),
            )
        });
        assert_eq!(one, other, "by how the bytes are cut");
        if let Some(peer) = &mut self.peer {
            peer.expect_bytes(self.now, bytes);
            assert_eq!(self.autopilot.refused(), peer.refused, "of {bytes:?}");
        }
    }

    /// Delivers a heartbeat to the link, from a PX4, an ArduCopter or any other system, in any flight mode.
    fn heartbeat(&mut self, input: &mut Input<'_>) {
        let autopilot = match input.below(8) {
            0..=3 => 12,
            4..=6 => 3,
            _ => input.byte(),
        };
        let mode: u32 = match input.below(8) {
            0..=3 if autopilot == 12 => 6 << 16,
            0..=3 => 4,
            4 => u32::from(input.byte()) << 16,
            _ => u32::from(input.byte()),
        };
        let component = if input.below(8) == 7 { input.byte() } else { 1 };
        let armed = if input.below(4) == 3 { 0 } else { 128 };
        let mut payload = mode.to_le_bytes().to_vec();
        payload.extend([2, autopilot, armed | 1, 4, 3]);
        self.deliver_frame(input, &frame(HEARTBEAT, [1, component], &payload, 0));
    }

    /// Reports a lost relay to the link, then delivers an operator's command that names relays as landed.
    fn clear_lost_relay(&mut self, input: &mut Input<'_>) {
        let node = 1 + u16::from(input.below(9));
        let side = if input.flag() {
            Side::Upstream
        } else {
            Side::Downstream
        };
        without_allocation(|| {
            self.autopilot
                .handle_event(Event::NeighbourLost { side, node });
        });
        let mut payload = Vec::new();
        for _ in 0..7 {
            let named = match input.below(4) {
                0 => f32::from(node),
                1 => input.any_number(),
                _ => 0.0,
            };
            payload.extend(named.to_le_bytes());
        }
        payload.extend(31_010_u16.to_le_bytes());
        let component = if input.below(4) == 3 { 1 } else { 191 };
        payload.extend([1, component, input.below(2)]);
        self.deliver_frame(input, &frame(COMMAND, [255, 190], &payload, 0));
    }

    /// Delivers the drone's position to the link, with a right, old or wrong timestamp.
    fn position(&mut self, input: &mut Input<'_>, place: Placement) {
        let clock = input.byte();
        let Some(point) = self.axis.point(place) else {
            return;
        };
        if clock == 255 {
            self.began = self.now;
        }
        let ms = self.now.since(self.began).as_micros() / 1_000;
        let boot = ms.saturating_sub(u64::from(clock % 16) * 100);
        let boot = u32::try_from(boot % (1 << 32)).unwrap_or(0);
        let mut payload = boot.to_le_bytes().to_vec();
        for number in [point.lat_e7, point.lon_e7, point.amsl_mm] {
            payload.extend(number.to_le_bytes());
        }
        self.deliver_frame(
            input,
            &frame(GLOBAL_POSITION, [1, 1], &sized(payload, 28), 0),
        );
    }

    /// Calls the link as a firmware's main loop does, and checks the link's frames, positions and events.
    fn settle(&mut self) {
        without_allocation(|| self.autopilot.handle_timeout(self.now));
        let mut frames = 0;
        while let Some(frame) = without_allocation(|| self.autopilot.poll_transmit(self.now)) {
            match &mut self.peer {
                Some(peer) => {
                    assert_eq!(frame.get(2), Some(&1));
                    let unsigned = peer.check_sent(self.now, &frame);
                    // The checksum also covers the flag that marks a signed frame.
                    self.check_frame(&unsigned, 1);
                }
                None => self.check_frame(&frame, 0),
            }
            frames += 1;
            assert!(frames <= MAX_FRAMES, "it never ends");
        }
        while let Some(position) = self.autopilot.poll_position() {
            let Placement {
                x_m,
                y_m,
                altitude_m,
            } = position.place;
            assert!([x_m, y_m, altitude_m].iter().all(|part| part.is_finite()));
            assert!(position.at <= self.now, "it comes from the future");
        }
        let cleared = self.autopilot.poll_cleared();
        assert_eq!(self.autopilot.poll_cleared(), None, "once");
        let (mut events, mut tells) = (0, false);
        while let Some(event) = self.autopilot.poll_event() {
            if let AutopilotEvent::Found(kind) = event {
                assert_eq!(self.kind.replace(kind), None, "found twice");
            }
            tells |= matches!(
                event,
                AutopilotEvent::LostCleared { .. } | AutopilotEvent::ClearRefused { .. }
            );
            events += 1;
            // There may be at most eight events, and four kinds of `Mistrust`.
            assert!(events <= 12, "it never ends");
        }
        assert!(tells || cleared.is_none(), "cleared without a word");
        assert_eq!(
            self.autopilot.is_flown(),
            self.autopilot.state() == State::Engaged
        );
        let wakes = self.autopilot.poll_timeout(self.now);
        assert!(wakes > self.now, "it wants to be called for nothing");
    }

    /// Checks a frame sent by the link, without its signature.
    ///
    /// `covered_flags` is the flags byte that the checksum covers.
    fn check_frame(&mut self, frame: &[u8], covered_flags: u8) {
        let Some((&[magic, length, flags, _, _, _, component, a, b, c], rest)) =
            frame.split_first_chunk()
        else {
            unreachable!("{frame:?}");
        };
        let id = u32::from_le_bytes([a, b, c, 0]);
        let Some((_, extra, longest)) = SENT.into_iter().find(|(number, ..)| *number == id) else {
            unreachable!("it sends message {id}");
        };
        assert_eq!((magic, flags, component), (0xFD, 0, 191));
        let Some((payload, sum)) = rest.split_at_checked(usize::from(length)) else {
            unreachable!("{frame:?}");
        };
        let mut covered = frame
            .get(1..10 + payload.len())
            .unwrap_or_default()
            .to_vec();
        if let Some(flags) = covered.get_mut(1) {
            *flags = covered_flags;
        }
        assert_eq!(sum, checksum(&covered, extra).to_le_bytes());
        let payload = sized(payload.to_vec(), longest);
        if id == SET_POSITION.0 {
            self.check_target(&payload);
        } else if id == VALUE.0 {
            assert!(float(&payload, 4).is_finite(), "{payload:?}");
        }
    }

    /// Checks a flight target: finite, near the line, within the speed limit, and permitted in this state.
    fn check_target(&mut self, payload: &[u8]) {
        let state = self.autopilot.state();
        let may = matches!(state, State::Engaged | State::Blind)
            || state == State::Standby && self.kind != Some(Kind::ArduCopter);
        assert!(may, "a target in {state:?}");
        self.told = [long(payload, 4), long(payload, 8)];
        let [lat, lon] = self.told.map(|units| f64::from(units) / 1e7);
        let amsl = f64::from(float(payload, 12));
        let velocity = [16, 20, 24].map(|at| float(payload, at));
        let yaw = float(payload, 40);
        let finite = velocity.iter().all(|part| part.is_finite()) && amsl.is_finite();
        assert!(finite, "{payload:?}");
        assert!(yaw.abs() <= 3.2, "yaw {yaw}");
        assert!(
            velocity.iter().all(|part| part.abs() <= 20.5),
            "{velocity:?}"
        );
        // The distance is computed on a flat earth.
        let [north_m, east_m] = DEGREE_M;
        let toward =
            |[to_lat, to_lon, _]: [f64; 3]| [(to_lat - TX[0]) * north_m, (to_lon - TX[1]) * east_m];
        let ([n, e], [rn, re]) = (toward([lat, lon, 0.0]), toward(self.rx));
        let length = rn.hypot(re);
        let along = (n * rn + e * re) / length;
        let aside = (e * rn - n * re) / length;
        assert!(aside.abs() <= AROUND_M, "{aside} m aside");
        assert!(
            (-AROUND_M..=length + AROUND_M).contains(&along),
            "{along} m along"
        );
        let datum = TX[2] + (self.rx[2] - TX[2]) * along / length;
        assert!((amsl - datum).abs() <= AROUND_M, "{amsl} m high");
    }
}

fn nearby_place(input: &mut Input<'_>) -> Placement {
    Placement {
        x_m: input.even(-5_100.0, 6_500.0),
        y_m: input.even(-5_100.0, 5_100.0),
        altitude_m: input.even(-100.0, 500.0),
    }
}

/// Reads a position near the line Tx-Rx. In some cases a coordinate is an arbitrary number.
fn any_place(input: &mut Input<'_>) -> Placement {
    Placement {
        x_m: input.mostly(|input| input.even(0.0, 1_400.0)),
        y_m: input.mostly(|input| input.even(-100.0, 100.0)),
        altitude_m: input.mostly(|input| input.even(0.0, 200.0)),
    }
}
