//! Check of the drone's autopilot: mode, position, and the parameters of its bundle.
//!
//! It sends HEARTBEAT, SET_MESSAGE_INTERVAL and PARAM_REQUEST_READ, and never a target.

use std::path::{Path, PathBuf};

use uav_relay::flight::autopilot::{Kind, Signing};
use uav_relay::flight::axis::Axis;
use uav_relay::flight::mavlink::frame::{Address, HEADER, MAGIC, checksum, find_known, id};
use uav_relay::flight::mavlink::incoming::{Incoming, Parser};
use uav_relay::flight::mavlink::outgoing::{FrameBytes, Outgoing};
use uav_relay::{Duration, Geodetic, Instant, Placement};

use super::Line;
use crate::autopilot::{AutopilotPlan, Port, SigningKey, port, stamp};
use crate::options::Plan;

/// Link number of the check in MAVLink signatures; in flight a different number is used.
const LINK: u8 = 1;

/// Age from which the autopilot's last message or last position counts as missing.
const SILENT: Duration = Duration::from_millis(3_000);

/// Time between two heartbeats, and between two requests.
const EVERY: Duration = Duration::from_millis(1_000);

/// Number of parameters requested at a time.
const AT_A_TIME: usize = 6;

/// Two possible names of the parameter with the autopilot's MAVLink system number.
const SYSTEM: [&str; 2] = ["MAV_SYS_ID", "SYSID_THISMAV"];

/// Parameters that ArduCopter 4.7 has renamed: old name, new name, and old unit / new unit.
///
/// An autopilot has only one of the two names.
const NEW_NAMES: [(&str, &str, f64); 2] = [
    ("RTL_ALT", "RTL_ALT_M", 100.0),
    ("SYSID_THISMAV", "MAV_SYSID", 1.0),
];

/// Parameter of the autopilot: its value in the parameter file, and its value in the autopilot.
///
/// The value in the autopilot is `None` until it is received.
#[derive(Debug)]
struct Parameter {
    name: String,
    wanted: f64,
    found: Option<f64>,
}

/// Autopilot's state in its last HEARTBEAT.
#[derive(Clone, Copy, Debug)]
struct Heard {
    at: Instant,
    from: Address,
    kind: Kind,
    custom_mode: u32,
    is_armed: bool,
    status: u8,
}

pub(super) struct Drone {
    port: Port,
    name: String,
    parser: Parser,
    signing: Option<Signing>,
    axis: Axis,
    /// Planned position of this drone, if any. `within_m` is the permitted distance from the planned position.
    planned: Option<Placement>,
    within_m: f32,
    /// Folder with the parameter files.
    folder: Option<PathBuf>,
    file: Option<Result<(PathBuf, Vec<Parameter>), String>>,
    heard: Option<Heard>,
    position: Option<(Instant, Geodetic)>,
    is_in_air: bool,
    signs: bool,
    refused: u32,
    bytes: u64,
    sequence: u8,
    due: Instant,
}

impl Drone {
    /// Opens the autopilot's port.
    pub(super) fn open(plan: &Plan, autopilot: &AutopilotPlan) -> Result<Self, String> {
        let options = &plan.options;
        let key = autopilot.key.as_ref();
        Ok(Self {
            port: port(&autopilot.port)?,
            name: autopilot.port.to_string(),
            parser: Parser::new(),
            signing: key.map(|SigningKey(key)| Signing::new(*key, LINK, stamp(), Instant::ZERO)),
            axis: Axis::between(autopilot.sites).map_err(|error| error.to_string())?,
            planned: plan.planned,
            within_m: options.start_within,
            folder: options
                .config
                .as_deref()
                .and_then(Path::parent)
                .map(Path::to_owned),
            file: None,
            heard: None,
            position: None,
            is_in_air: false,
            signs: false,
            refused: 0,
            bytes: 0,
            sequence: 0,
            due: Instant::ZERO,
        })
    }

    /// Returns true once the autopilot has reported that it is disarmed and not in the air.
    ///
    /// Until then the check sends nothing to the neighbours.
    pub(super) fn is_disarmed(&self) -> bool {
        self.heard.is_some() && !self.is_armed()
    }

    /// Returns true if the autopilot is armed or in the air. While it is, the check sends nothing to the neighbours.
    pub(super) fn is_armed(&self) -> bool {
        self.is_in_air || self.heard.is_some_and(|heard| heard.is_armed)
    }

    /// Reads the autopilot's messages, and requests the missing data.
    pub(super) fn exchange(&mut self, now: Instant) {
        let mut bytes = [0; 1_024];
        while let Some(count) = self.port.read(&mut bytes) {
            self.bytes += count as u64;
            for byte in bytes.iter().take(count) {
                self.parser.push(*byte);
                while let Some((received, frame)) = self
                    .parser
                    .next_frame(|received, frame| (received, frame.to_vec()))
                {
                    self.signs |= received.is_signed;
                    let trusted = self
                        .signing
                        .as_mut()
                        .map(|it| it.check(now, &received, &frame));
                    if matches!(trusted, Some(Err(_))) {
                        self.refused += 1;
                        continue;
                    }
                    self.take(now, received.from, received.id, received.message, &frame);
                }
            }
        }
        if self.due <= now {
            self.due = now + EVERY;
            self.request(now);
        }
    }

    fn take(
        &mut self,
        now: Instant,
        from: Address,
        number: u32,
        message: Option<Incoming>,
        frame: &[u8],
    ) {
        if let Some(Incoming::Heartbeat {
            autopilot,
            base_mode,
            custom_mode,
            status,
            ..
        }) = message
            && from.component == 1
        {
            let kind = match autopilot {
                3 => Kind::ArduCopter,
                12 => Kind::Px4,
                _ => return,
            };
            let is_armed = base_mode & 128 != 0;
            self.heard = Some(Heard {
                at: now,
                from,
                kind,
                custom_mode,
                is_armed,
                status,
            });
            if self.file.is_none() {
                self.file = Some(parameters(self.folder.as_deref(), kind));
            }
        }
        let Some(heard) = self.heard.filter(|heard| heard.from == from) else {
            return;
        };
        match message {
            // Before its first fix an autopilot reports latitude 0 and longitude 0.
            Some(Incoming::GlobalPosition {
                lat_e7,
                lon_e7,
                amsl_mm,
                ..
            }) if (lat_e7, lon_e7) != (0, 0) => {
                self.position = Some((
                    now,
                    Geodetic {
                        lat_e7,
                        lon_e7,
                        amsl_mm,
                    },
                ));
            }
            Some(Incoming::ExtendedSysState { landed_state }) => self.is_in_air = landed_state > 1,
            _ if number == id::PARAM_VALUE => self.take_value(heard.kind, frame),
            _ => {}
        }
    }

    /// Stores the value of a received PARAM_VALUE.
    ///
    /// Payload: value (4 bytes), count and index (2 bytes each), name (16 bytes), type.
    fn take_value(&mut self, kind: Kind, frame: &[u8]) {
        let length = usize::from(frame.get(1).copied().unwrap_or(0));
        let mut payload = frame
            .get(HEADER..HEADER + length)
            .unwrap_or_default()
            .to_vec();
        payload.resize(25, 0);
        let (Some(value), Some(name)) = (payload.first_chunk(), payload.get(8..24)) else {
            return;
        };
        let is_integer = payload.get(24).is_some_and(|kind| *kind < 9);
        let found = match kind {
            // PX4 sends the bytes of an integer in the field for a float.
            Kind::Px4 if is_integer => f64::from(i32::from_le_bytes(*value)),
            _ => f64::from(f32::from_le_bytes(*value)),
        };
        let name = String::from_utf8_lossy(name);
        let name = name.trim_end_matches('\0');
        let renamed = NEW_NAMES.iter().find(|(_, new, _)| *new == name);
        let (name, found) = renamed.map_or((name, found), |(old, _, unit)| (*old, found * unit));
        if let Some(Ok((_, all))) = &mut self.file
            && let Some(parameter) = all.iter_mut().find(|it| it.name == name)
        {
            parameter.found = Some(found);
        }
    }

    fn request(&mut self, now: Instant) {
        let to = self.heard.map_or(
            Address {
                system: 1,
                component: 1,
            },
            |heard| heard.from,
        );
        let from = Address {
            component: 191,
            ..to
        };
        self.send(now, Outgoing::Heartbeat.encode(from, to, self.sequence));
        if self.heard.is_none() {
            return;
        }
        for (id, interval_us) in [
            (id::GLOBAL_POSITION_INT, 500_000),
            (id::EXTENDED_SYS_STATE, 500_000),
        ] {
            self.send(
                now,
                Outgoing::SetMessageInterval { id, interval_us }.encode(from, to, self.sequence),
            );
        }
        let missing: Vec<String> = match &self.file {
            Some(Ok((_, all))) => {
                let missing = all.iter().filter(|it| it.found.is_none());
                missing.map(|it| it.name.clone()).take(AT_A_TIME).collect()
            }
            _ => Vec::new(),
        };
        for name in missing {
            let new = NEW_NAMES.iter().find(|(old, ..)| *old == name);
            for name in std::iter::once(name.as_str()).chain(new.map(|(_, new, _)| *new)) {
                self.send(now, request(name, from, to, self.sequence));
            }
        }
        // If the first parameters are not answered, the next ones are requested.
        if let Some(Ok((_, all))) = &mut self.file {
            let missing = all.iter().filter(|it| it.found.is_none()).count();
            let (mut open, answered): (Vec<_>, Vec<_>) =
                all.drain(..).partition(|it| it.found.is_none());
            open.rotate_left(AT_A_TIME.min(missing));
            all.extend(open.into_iter().chain(answered));
        }
    }

    fn send(&mut self, now: Instant, frame: FrameBytes) {
        self.sequence = self.sequence.wrapping_add(1);
        let signing = self.signing.as_mut();
        let frame = match signing {
            Some(signing) => signing.sign(now, frame),
            None => frame,
        };
        self.port.write(&frame);
    }

    /// Returns the result lines of the check about the autopilot.
    pub(super) fn lines(&self, now: Instant) -> Vec<Line> {
        let heard = self.heard.filter(|heard| now.since(heard.at) < SILENT);
        let Some(heard) = heard else {
            let why = match (
                self.heard,
                self.refused,
                self.bytes,
                self.parser.counters().frames,
            ) {
                (Some(_), ..) => "no heartbeat for 3 s",
                (_, 1.., ..) => {
                    "its frames are not signed with the key of --autopilot-key-file, or are old"
                }
                (_, _, 0, _) => {
                    "no bytes received: check that the autopilot is switched on, that TX and RX are wired, and that its port has this data rate"
                }
                (_, _, _, 0) => {
                    "the bytes received are not MAVLink 2: check the data rate and the protocol of the autopilot's port"
                }
                _ => "no frame is from a PX4 or an ArduCopter (MAVLink component 1)",
            };
            return vec![("autopilot", Err(format!("{}: {why}", self.name)))];
        };
        let kind = match heard.kind {
            Kind::Px4 => "PX4",
            Kind::ArduCopter => "ArduCopter",
        };
        let heard_text = format!(
            "{}: {kind}, MAVLink system {}",
            self.name, heard.from.system
        );
        let all = self.file.as_ref().and_then(|file| file.as_ref().ok());
        let number = all.and_then(|(_, all)| {
            all.iter()
                .find(|it| SYSTEM.contains(&it.name.as_str()))
                .filter(|it| differ(it.wanted, heard.from.system.into()))
        });
        let trust = match number {
            _ if self.signs && self.signing.is_none() => Err(format!(
                "{heard_text}: it signs its frames: give --autopilot-key-file"
            )),
            Some(it) if it.found.is_some_and(|found| !differ(found, it.wanted)) => Err(format!(
                "{heard_text}, but its parameter {} is {}: restart the autopilot, because its parameters are stored but not active",
                it.name, it.wanted
            )),
            Some(it) => Err(format!(
                "{heard_text}, but the parameter file of this relay has system {}: is this the right drone?",
                it.wanted
            )),
            None => Ok(heard_text),
        };
        vec![
            ("autopilot", trust),
            ("mode", self.mode(heard)),
            ("position", self.place(now)),
            ("parameters", self.compared()),
        ]
    }

    fn mode(&self, heard: Heard) -> Result<String, String> {
        let number = heard.custom_mode;
        let (main, sub) = (number >> 16 & 0xFF, number >> 24);
        let (companion, returns) = match heard.kind {
            Kind::Px4 => (main == 6, main == 4 && matches!(sub, 5 | 6)),
            Kind::ArduCopter => (number == 4, matches!(number, 6 | 9 | 21)),
        };
        if self.is_armed() {
            return Err("the drone is armed or in the air: this check is for a drone on the ground; nothing was sent to the neighbours".to_owned());
        }
        if companion {
            return Err(
                "the mode is OFFBOARD or GUIDED: choose another mode now; the pilot chooses OFFBOARD or GUIDED in the air"
                    .to_owned(),
            );
        }
        if returns {
            return Err(format!(
                "in flight mode {number} the drone returns or lands: choose another mode"
            ));
        }
        if heard.status >= 5 {
            return Err(format!(
                "the autopilot is in a failsafe (MAV_STATE {})",
                heard.status
            ));
        }
        Ok(format!(
            "disarmed, mode {number}, neither OFFBOARD nor GUIDED"
        ))
    }

    fn place(&self, now: Instant) -> Result<String, String> {
        let recent = self.position.filter(|(at, _)| now.since(*at) < SILENT);
        let (_, at) =
            recent.ok_or("the autopilot reports no position: wait for its position fix")?;
        let Some(place) = self.axis.place(at) else {
            let away_m = self.axis.away_m(at).unwrap_or(f64::INFINITY);
            return Err(format!(
                "the drone is {:.0} km from the line from Tx to Rx: are these the positions of Tx and Rx for this flight?",
                away_m / 1e3
            ));
        };
        let Some(planned) = self.planned else {
            let x_m = f64::from(place.x_m);
            let along_m = x_m.clamp(0.0, self.axis.distance_m());
            let beyond_m = (x_m - along_m).hypot(place.y_m.into());
            let text = format!(
                "the drone is {beyond_m:.0} m from the line from Tx to Rx; its planned position is unknown, because the file has no [plan], or this relay is a spare"
            );
            return if beyond_m <= f64::from(self.within_m) {
                Ok(text)
            } else {
                Err(text)
            };
        };
        let off_m = (place.x_m - planned.x_m).hypot(place.y_m - planned.y_m);
        let text = format!("the drone is {off_m:.0} m from its planned place");
        if off_m <= self.within_m {
            Ok(text)
        } else {
            Err(format!(
                "{text}, more than {} m: is this the right drone, and the right file? --start-within permits a larger distance",
                self.within_m
            ))
        }
    }

    fn compared(&self) -> Result<String, String> {
        let (file, all) = match &self.file {
            Some(Ok(read)) => read,
            Some(Err(why)) => return Err(why.clone()),
            None => {
                return Err("not compared: no heartbeat of the autopilot received yet".to_owned());
            }
        };
        let mut all: Vec<&Parameter> = all.iter().collect();
        all.sort_by(|one, other| one.name.cmp(&other.name));
        let name = file.display();
        let differs = |it: &&&Parameter| it.found.is_some_and(|found| differ(found, it.wanted));
        let wrong = all.iter().filter(differs).map(|it| {
            format!(
                "{} is {} instead of {}",
                it.name,
                it.found.unwrap_or_default(),
                it.wanted
            )
        });
        let missing = all
            .iter()
            .filter(|it| it.found.is_none())
            .map(|it| format!("{} is not reported by the autopilot", it.name));
        let faults: Vec<String> = wrong.chain(missing).collect();
        if faults.is_empty() {
            Ok(format!("{} as in {name}", all.len()))
        } else {
            Err(format!("{}; see {name}", faults.join(", ")))
        }
    }
}

/// Returns true if two values differ by more than rounding and unit conversion can cause.
fn differ(found: f64, wanted: f64) -> bool {
    (found - wanted).abs() > 1e-4 * wanted.abs().max(1.0)
}

/// Returns the frame of PARAM_REQUEST_READ for the parameter `name`.
fn request(name: &str, from: Address, to: Address, sequence: u8) -> FrameBytes {
    let [a, b, c, _] = id::PARAM_REQUEST_READ.to_le_bytes();
    let mut frame = FrameBytes::new();
    // Index -1: the parameter is requested by its name.
    let head = [
        MAGIC,
        20,
        0,
        0,
        sequence,
        from.system,
        from.component,
        a,
        b,
        c,
        0xFF,
        0xFF,
        to.system,
        to.component,
    ];
    let mut padded = [0; 16];
    padded
        .iter_mut()
        .zip(name.bytes())
        .for_each(|(to, byte)| *to = byte);
    // The frame has room for both.
    let _ = frame.extend_from_slice(&head);
    let _ = frame.extend_from_slice(&padded);
    if let (Some(known), Some(covered)) = (find_known(id::PARAM_REQUEST_READ), frame.get(1..)) {
        let sum = checksum(covered, known);
        let _ = frame.extend_from_slice(&sum.to_le_bytes());
    }
    frame
}

/// Reads the autopilot's parameter file in `folder`, the folder of the configuration.
fn parameters(folder: Option<&Path>, kind: Kind) -> Result<(PathBuf, Vec<Parameter>), String> {
    let (name, form) = match kind {
        Kind::Px4 => (
            "px4.params",
            "SYSTEM, COMPONENT, NAME, VALUE and TYPE, separated by tabs",
        ),
        Kind::ArduCopter => ("ardupilot.parm", "NAME,VALUE"),
    };
    let folder =
        folder.ok_or_else(|| format!("not compared: without --config there is no {name}"))?;
    let file = folder.join(name);
    let failed = |why: &str| format!("{}: {why}", file.display());
    let text = std::fs::read_to_string(&file).map_err(|error| failed(&error.to_string()))?;
    let lines = text
        .lines()
        .filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let all: Result<Vec<Parameter>, String> = lines
        .map(|line| {
            let fields: Vec<&str> = line.split(['\t', ',']).map(str::trim).collect();
            let [.., name, value] = fields
                .get(..if kind == Kind::Px4 { 4 } else { 2 })
                .unwrap_or_default()
            else {
                return Err(failed(&format!("the line \"{line}\" must be {form}")));
            };
            let wanted = value.parse().map_err(|_| {
                failed(&format!(
                    "the line \"{line}\": the value of {name} must be a number"
                ))
            })?;
            Ok(Parameter {
                name: (*name).to_owned(),
                wanted,
                found: None,
            })
        })
        .collect();
    let mut all = all?;
    // A renamed parameter is listed under its old name only.
    all.retain(|it| NEW_NAMES.iter().all(|(_, new, _)| *new != it.name));
    Ok((file.clone(), all))
}
