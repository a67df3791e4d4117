//! Log lines of the station.

use serde_json::json;
use uav_relay::{
    FlownMission, Geofence, Ground, GuardConfig, Instant, Mission, MissionConfig, Placement,
    Progress, Side, Stats, Upload,
};
use uav_relay_linux::counters::counted;
use uav_relay_linux::log::Log;
use uav_relay_linux::site::Between;

use crate::forecast::Move;
use crate::measurements::name;
use crate::options::Plan;

/// Logs the station's end of the chain (transmitter or receiver), its port, and the signing epoch.
pub(crate) fn started(log: &Log, plan: &Plan, epoch: u32) {
    let (end, relays, network) = (
        name(plan.end),
        plan.loaded.mission.relays(),
        plan.options.network,
    );
    let (base, baud) = (plan.loaded.mission.digest(), plan.options.baud);
    let tty = plan.options.tty.display();
    log.event(
        Instant::ZERO,
        "started",
        json!({
            "end": end, "relays": relays, "network": network, "mission": base, "ports": [format!("--tty {tty}")], "baud": baud,
            "version": env!("CARGO_PKG_VERSION"),
        }),
        format_args!(
            "{end} of a chain of {relays} relays, network {network}, digest of the loaded mission 0x{base:04x}, --tty {tty}, {baud} bit/s"
        ),
    );
    log.signed(epoch);
}

pub(crate) fn progress(log: &Log, now: Instant, upload: &Upload, progress: Progress) {
    let (version, all) = (upload.version(), upload.config().relays);
    match progress {
        Progress::Offering => {
            let digest = upload.id().digest;
            let sites = upload.sites();
            let sites = sites.map_or(String::new(), |sites| format!(", {}", Between(sites)));
            let what = format_args!("the station offers version {version} of the mission to the nearest relays, digest 0x{digest:04x}{sites}");
            log.line(now, "offering", what);
        }
        Progress::Stored { by } => log.line(
            now,
            "stored",
            format_args!("relay {by} has stored version {version} of the mission; the station asks relay {by} which version the chain flies, until it is version {version}"),
        ),
        Progress::Adopted { by } => log.event(
            now,
            "adopted",
            json!({ "version": version, "flown_by": 1, "relays": all }),
            format_args!(
                "relay {by} is the first of {all} relays to report that it flies version {version} of the mission; the station asks relay {by} again until all relays fly this version"
            ),
        ),
        Progress::Flown { by, view, relays } => log.event(
            now,
            "flown",
            json!({ "version": version, "flown_by": relays, "relays": all }),
            format_args!(
                "{relays} of {all} relays fly version {version} of the mission, as relay {by} reports for the present members of the chain (view {})",
                view.number()
            ),
        ),
        // Other stages are logged elsewhere.
        _ => {}
    }
}

/// Returns the error text for an upload that is not newer than the relays' mission. `version` is the upload's version,
/// `held` that of the relays.
pub(crate) fn outdated(version: u16, held: u16) -> String {
    match held.checked_add(1) {
        Some(next) => {
            format!(
                "--version {version}: must be within {next} to 65535, because the relays have version {held} of the mission"
            )
        }
        None => {
            format!(
                "--version {version}: the relays have version {held}, the largest possible, so no upload is possible: load the new mission into the relays before their next flight"
            )
        }
    }
}

/// Logs the mission version that a relay reports: the relay flies it, or has stored it to fly it later.
pub(crate) fn flown(log: &Log, now: Instant, flown: &FlownMission) {
    let FlownMission {
        by, version, flies, ..
    } = *flown;
    let fields = json!({ "relay": by, "version": version, "flies": flies });
    let what = match (version, flies) {
        (0, _) => format!("relay {by} flies the mission loaded before flight"),
        (_, true) => format!("relay {by} flies version {version} of the mission"),
        (_, false) => {
            format!(
                "relay {by} has stored version {version} of the mission, but does not fly it yet"
            )
        }
    };
    log.event(now, "current", fields, what);
}

/// Returns the error text for an upload that relay `by` refused. The text names the value that has most likely caused
/// the refusal.
pub(crate) fn refused(plan: &Plan, upload: &Upload, by: u16) -> String {
    let version = upload.version();
    let who = format!("upload of version {version} refused by relay {by}, or by a relay beyond it");
    match FenceViolation::of(&plan.loaded.mission, upload) {
        Some(FenceViolation { what, .. }) => format!("{who}: {what}"),
        None => format!("{who}: the log of that relay has the reason"),
    }
}

/// Value of an uploaded mission that exceeds the relays' geofence.
pub(crate) struct FenceViolation {
    /// Text for the operator: the value that exceeds the geofence, and the permitted range.
    what: String,
    name: &'static str,
    /// Function that returns the coordinate of a position to which the geofence's limit applies, m. The coordinate is
    /// the altitude, y or x.
    coordinate: fn(&Placement) -> f32,
    range_m: [f32; 2],
}

impl FenceViolation {
    /// Returns the first value of `upload` that exceeds the relays' geofence; `None` if no value does.
    ///
    /// The relays' geofence is taken to be the default one, which is computed from the loaded mission.
    pub(crate) fn of(loaded: &Mission, upload: &Upload) -> Option<Self> {
        let (loaded, new) = (loaded.config(), upload.config());
        let fence = |config: &MissionConfig| {
            let mission = Mission::try_new(*config).ok()?;
            Some(GuardConfig::of(&mission, config.common).geofence)
        };
        let (own, asked) = (fence(loaded)?, fence(new)?);
        let leaves = |is: [f32; 2], of: [f32; 2]| is[0] < of[0] || is[1] > of[1];
        let altitudes = |of: Geofence| [of.least_altitude_m, of.most_altitude_m];
        let sides = |of: Geofence| [of.least_y_m, of.most_y_m];
        let (what, is, range_m, options, name, coordinate): (_, _, _, _, _, fn(&Placement) -> f32) =
            if leaves(altitudes(asked), altitudes(own)) {
                (
                    "altitude",
                    altitudes(asked),
                    altitudes(own),
                    "--altitude and --band",
                    "altitude",
                    |at| at.altitude_m,
                )
            } else if leaves(sides(asked), sides(own)) {
                (
                    "lateral range",
                    sides(asked),
                    sides(own),
                    "--lateral-min-m and --lateral-max-m",
                    "y",
                    |at| at.y_m,
                )
            } else if upload.sites().is_none() && asked.most_x_m > own.most_x_m {
                (
                    "distance",
                    [asked.most_x_m; 2],
                    [own.least_x_m, own.most_x_m],
                    "--distance",
                    "x",
                    |at| at.x_m,
                )
            } else {
                return None;
            };
        let is = match is {
            [least, most] if least.to_bits() == most.to_bits() => least.to_string(),
            [least, most] => format!("{least} to {most}"),
        };
        let [least, most] = range_m;
        let what = format!(
            "{what} {is} m: must be within {least} to {most} m (the relays' geofence, set before flight by {options})"
        );
        Some(Self {
            what,
            name,
            coordinate,
            range_m,
        })
    }

    /// Returns a text with the value, its permitted range, and the relay that would fly farthest outside.
    ///
    /// If no relay would fly outside (for example, only the receiver is outside), the text has the relay nearest to the
    /// limit. Without `moves` the text names no relay.
    pub(crate) fn line(&self, moves: Option<&[Move]>) -> String {
        let Self { what, name, .. } = self;
        let [least, most] = self.range_m;
        let beyond_m = |it: &Move| {
            let at = (self.coordinate)(&it.after);
            // A longer line exceeds the upper limit of x.
            let below_m = if *name == "x" { f32::MIN } else { least - at };
            below_m.max(at - most)
        };
        let who = format!("{what}; every relay that controls a drone refuses this mission");
        let moves = moves.unwrap_or_default().iter().rev();
        match moves.max_by(|one, other| beyond_m(one).total_cmp(&beyond_m(other))) {
            Some(it) => {
                let (at, index) = ((self.coordinate)(&it.after), it.index);
                let place = if beyond_m(it) > 0.0 {
                    "farthest outside"
                } else {
                    "nearest to the limit"
                };
                format!("{who}: relay {index} would be {place}, at {name} {at:.1} m")
            }
            None => who,
        }
    }
}

/// Returns the error text for an upload that exceeds its time limit, with the most likely cause.
pub(crate) fn timed_out(plan: &Plan, version: u16, progress: Progress, ground: &Ground) -> String {
    let seconds = plan.options.timeout;
    let state = match progress {
        Progress::Stored { by } => {
            format!(
                "relay {by} has stored version {version} of the mission, but the chain does not fly it yet; the relays may still adopt it"
            )
        }
        Progress::Adopted { by } => format!(
            "relay {by} flies version {version} of the mission, but has not reported that all relays fly it; the other relays may still adopt it"
        ),
        // The ground has only asked so far.
        Progress::Idle => format!(
            "no relay has reported the mission that it flies: {}",
            likely_reason(plan, ground.stats())
        ),
        _ => format!(
            "no relay is known to have stored version {version} of the mission: {}",
            likely_reason(plan, ground.stats())
        ),
    };
    let refused = ground.refused();
    format!(
        "upload not finished within --timeout {seconds} s: {state}; {refused} received frames were rejected"
    )
}

/// Returns the most likely reason for a missing answer of the relays, judged by the frame counters.
pub(crate) fn likely_reason(plan: &Plan, stats: &Stats) -> String {
    let faults = [
        (
            stats.mission,
            format!(
                "frames come from relays that were loaded with another mission than this station (digest of this station's mission: 0x{:04x}): give the station the mission that was loaded into the relays",
                plan.loaded.mission.digest()
            ),
        ),
        (
            stats.forged,
            "frames have a wrong signature (tag): --key-file must be the key of the relays".to_owned(),
        ),
        (
            stats.unsigned,
            "frames are not signed: give the relays a --key-file, because relays without a key accept no uploads".to_owned(),
        ),
        (
            stats.foreign,
            format!(
                "frames have another network number than --network {}",
                plan.options.network
            ),
        ),
        (
            stats.version,
            "frames have another version of the frame format: use the same software version at the relays and at this station".to_owned(),
        ),
        (
            stats.misaddressed.saturating_add(stats.overheard),
            format!(
                "frames were received, but none addressed to the {}: compare --key-file, --end and --of with the options of the relays, and read the log of the nearest relay",
                name(plan.end)
            ),
        ),
        (
            stats.crc,
            format!(
                "frames are damaged: --baud {} must be the data rate of the relays",
                plan.options.baud
            ),
        ),
    ];
    match faults.into_iter().find(|(count, _)| *count > 0) {
        Some((count, fault)) => format!("{count} {fault}"),
        None if stats.received > 0 => {
            "a relay replies, but has not stored the upload yet".to_owned()
        }
        // A relay with another mission sends only handshakes.
        None if stats.handshakes > 0 => format!(
            "a relay is received, but ignores this station: the relay was probably loaded with another mission than this station (digest of this station's mission: 0x{:04x})",
            plan.loaded.mission.digest()
        ),
        None => format!(
            "no frame was received: check that --tty {} leads to the chain, and check --network {}, --baud {}, --end and --key-file; a relay that receives this station logs why it rejects the station's frames",
            plan.options.tty.display(),
            plan.options.network,
            plan.options.baud
        ),
    }
}

pub(crate) fn received(log: &Log, now: Instant, node: u16, is_heard: bool) {
    let (event, what) = if is_heard {
        ("back", "and this station receive each other")
    } else {
        ("lost", "has not replied to this station for 5 s")
    };
    let text = format_args!("relay {node} {what}");
    log.event(now, event, json!({ "node": node }), text);
}

/// Logs the frame counters when a station that ran with `--stand` stops.
pub(crate) fn stopped(log: &Log, now: Instant, end: Side, ground: &Ground) {
    let stats = ground.stats();
    log.event(
        now,
        "stopped",
        counted(stats),
        format_args!(
            "{}, {} frames sent, {} received, {} rejected",
            name(end),
            stats.sent,
            stats.received.saturating_add(stats.handshakes),
            ground.refused()
        ),
    );
}
