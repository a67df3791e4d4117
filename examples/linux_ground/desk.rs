//! Tasks of the page and of the status socket: previews, uploads, and the clearing of lost relays.
//!
//! | request | answer |
//! | --- | --- |
//! | `preview`: values of the new mission by the names of the `--new-` options, `receiver` as `X,Y`, and `shown`, the mission of the map | the preview's number; the result is part of the snapshots |
//! | `upload`: number and digest of the newest preview, which the page has shown, and the time of the page's newest snapshot | the upload begins. Each preview can be uploaded once |
//! | `clear`: number of a lost relay, and the time of the page's newest snapshot | the page no longer has the relay, until it reports again |
//!
//! The first two use the stages of an upload from the command line.

use std::collections::BTreeMap;
use std::sync::mpsc::Receiver;

use clap::Parser;
use serde::Deserialize;
use serde_json::{Value, json};
use uav_relay::flight::axis::Axis;
use uav_relay::{
    Duration, Geodetic, Ground, Instant, Mission, Placement, Profile, Report, Sites, Upload,
    UploadError,
};
use uav_relay_linux::command::one_line;
use uav_relay_linux::log::Log;
use uav_relay_linux::replug::Replug;
use uav_relay_linux::site::{degrees, site};
use uav_relay_screen::hops::{db, hop_sirs, hop_sirs_back};
use uav_relay_screen::{Post, Task};

use crate::change::{changes, fields};
use crate::forecast::Move;
use crate::new::{Basis, NewOptions};
use crate::options::Plan;
use crate::screen::Web;
use crate::uploading::{Form, Preview, Uploading, digest_of};

/// Maximum distance of a drone from its agreed position, m, for the drone to count as arrived.
const ARRIVED_M: f32 = 1.0;

/// Maximum age of the page's data, s, with which the page may request an upload.
///
/// A request with older data is refused, for example a request that was delayed on the way.
const OLDEST_S: f64 = 5.0;

/// Maximum number of characters that the log has of the answer to a task of the page or status socket.
const LOGGED: usize = 300;

/// Time after a refused task is logged in which further refused tasks are not logged.
const QUIET: Duration = Duration::from_millis(1_000);

/// Largest number of the page's tasks that one call handles.
const AT_ONCE: usize = 4;

/// Values entered for the preview of a new mission, parsed as on the command line.
#[derive(Parser, Debug)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Words {
    #[command(flatten)]
    new: NewOptions,
    /// Placeholder, because the other options need a version. The real version follows from the flown mission.
    #[arg(long)]
    version: Option<u16>,
    #[arg(long, allow_hyphen_values = true, value_parser = site)]
    site_tx: Option<Geodetic>,
}

/// Content of the page's request to upload a preview.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Confirmed {
    preview: u32,
    digest: String,
    /// Time of the newest data that the page showed at the request, s since the start of this program.
    time_s: f64,
}

/// Body of the page's request to remove a lost relay from the page.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cleared {
    relay: u16,
    /// Time of the newest data that the page showed at the request, s since the start of this program.
    time_s: f64,
}

/// Tasks of the page and of the status socket.
#[derive(Debug)]
pub(crate) struct Desk {
    /// Tasks that the page has sent to this program; `None` without a page.
    posts: Option<Receiver<Post>>,
    /// Number of upload previews so far.
    previews: u32,
    /// Time from which on a refused task is logged.
    logs_at: Instant,
}

/// Parts of the station that a task reads or changes.
pub(crate) struct Parts<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) ground: &'a mut Ground,
    pub(crate) uploading: &'a mut Option<Uploading>,
    pub(crate) web: Option<&'a mut Web>,
    pub(crate) tty: &'a mut Replug,
}

impl Desk {
    pub(crate) const fn new(posts: Option<Receiver<Post>>) -> Self {
        Self {
            posts,
            previews: 0,
            logs_at: Instant::ZERO,
        }
    }

    /// Handles the tasks that the page has sent, at most [`AT_ONCE`] in one call.
    pub(crate) fn turn(&mut self, now: Instant, log: &Log, mut parts: Parts<'_>) {
        let posts = self.posts.iter().flat_map(Receiver::try_iter);
        let posts: Vec<Post> = posts.take(AT_ONCE).collect();
        // A task whose browser has got a refusal already is dropped.
        for post in posts.into_iter().filter(Post::begin) {
            let by = format!("the page at {}", post.peer);
            let reply = self.perform(now, log, &mut parts, post.task, &post.body, &by);
            post.reply(reply);
        }
    }

    /// Handles a command of the status socket.
    ///
    /// Commands: `preview NAME=VALUE ...`, `upload NUMBER DIGEST` and `clear-lost NUMBER`.
    pub(crate) fn command(
        &mut self,
        now: Instant,
        log: &Log,
        mut parts: Parts<'_>,
        line: &str,
        by: &str,
    ) -> Value {
        let words: Vec<&str> = line.split_whitespace().collect();
        let task = match words.as_slice() {
            ["preview", values @ ..] => {
                let pairs = values.iter().map(|it| it.split_once('='));
                let pairs: Option<BTreeMap<_, _>> = pairs.collect();
                pairs.map(|it| (Task::Preview, json!(it)))
            }
            ["upload", number, digest] => number.parse::<u32>().ok().map(|number| {
                let time_s = now.as_micros() as f64 / 1e6;
                let body = json!({ "preview": number, "digest": digest, "time_s": time_s });
                (Task::Upload, body)
            }),
            ["clear-lost", relay] => relay.parse::<u16>().ok().map(|relay| {
                let time_s = now.as_micros() as f64 / 1e6;
                (Task::Clear, json!({ "relay": relay, "time_s": time_s }))
            }),
            _ => None,
        };
        let reply = match task.filter(|_| parts.plan.options.stand) {
            Some((task, body)) => self.perform(now, log, &mut parts, task, &body.to_string(), by),
            None => Err(format!(
                "command {line:?}: must be `preview NAME=VALUE ...`, `upload NUMBER DIGEST` or `clear-lost NUMBER`, which need a station with --stand, or empty to read the state"
            )),
        };
        let is_done = reply.is_ok();
        json!({ "done": is_done, "text": reply.unwrap_or_else(|why| why) })
    }

    fn perform(
        &mut self,
        now: Instant,
        log: &Log,
        parts: &mut Parts<'_>,
        task: Task,
        body: &str,
        by: &str,
    ) -> Result<String, String> {
        let (name, reply) = match task {
            Task::Preview => ("preview", self.preview(now, parts, body)),
            Task::Upload => ("upload", upload(now, parts, body)),
            Task::Clear => ("clear-lost", clear(now, parts, body)),
        };
        if reply.is_ok() && task != Task::Preview {
            let answer: Value =
                serde_json::from_str(reply.as_deref().unwrap_or_default()).unwrap_or_default();
            let number = answer.get("relay").or_else(|| answer.get("preview"));
            let number = number.unwrap_or_default();
            parts
                .tty
                .note(&format!("operator: {name} {number} by {by}"));
        }
        if reply.is_err() && now < self.logs_at {
            return reply;
        }
        if reply.is_err() {
            self.logs_at = now + QUIET;
        }
        let fields = json!({ "task": name, "by": by, "done": reply.is_ok() });
        let text = reply
            .as_ref()
            .map_or_else(|why| format!("refused: {why}"), Clone::clone);
        let text: String = text.chars().take(LOGGED).collect();
        log.event(now, "task", fields, format_args!("{name} by {by}: {text}"));
        reply
    }

    fn preview(
        &mut self,
        now: Instant,
        parts: &mut Parts<'_>,
        body: &str,
    ) -> Result<String, String> {
        let Parts {
            plan,
            ground,
            uploading,
            ..
        } = parts;
        if plan.loaded.mission.field().is_some() {
            return Err(UploadError::Field.to_string());
        }
        if uploading.as_ref().is_some_and(|it| !it.is_idle()) {
            return Err(
                "another preview or upload has not finished yet: try again later".to_owned(),
            );
        }
        let form = form(self.previews + 1, plan.sited, body)?;
        self.previews = form.number;
        let reply = json!({ "preview": form.number }).to_string();
        **uploading = Some(Uploading::begin(now, plan, None, Some(form), ground));
        Ok(reply)
    }
}

/// Reads the values of preview `number` from `body`, a JSON object of strings.
///
/// `sited` are the mission's Tx and Rx positions on earth. Only with them the receiver's new position may be given as
/// latitude and longitude.
fn form(number: u32, sited: Option<Sites>, body: &str) -> Result<Form, String> {
    let mut given: BTreeMap<String, String> = serde_json::from_str(body).map_err(|error| {
        format!("the request must be a JSON object whose values are strings: {error}")
    })?;
    let receiver_m = given
        .remove("receiver")
        .map(|text| place(&text))
        .transpose()?;
    let has_coordinates = receiver_m.is_some() || given.contains_key("interferer");
    let shown = given.remove("shown").filter(|_| has_coordinates);
    let moves_site = ["site-tx", "site-rx"]
        .iter()
        .any(|it| given.contains_key(*it));
    let mut words = vec!["--version=1".to_owned()];
    match sited {
        Some(line) => words.push(format!("--site-tx={}", degrees(line.tx))),
        None if moves_site => {
            return Err("site-tx and site-rx need sites (positions of Tx and Rx on earth) in the mission loaded before flight, which has none".to_owned());
        }
        None => {}
    }
    if receiver_m.is_some() && (moves_site || given.contains_key("distance")) {
        return Err("receiver: must be left out if a site or the distance is given".to_owned());
    }
    words.extend(
        given
            .iter()
            .map(|(name, value)| format!("--new-{name}={value}")),
    );
    let words = Words::try_parse_from(words).map_err(|error| one_line(&error))?;
    Ok(Form {
        number,
        new: words.new,
        receiver_m,
        shown,
    })
}

fn place(text: &str) -> Result<[f32; 2], String> {
    let parts: Option<Vec<f32>> = text.split(',').map(|it| it.trim().parse().ok()).collect();
    match parts.as_deref() {
        Some(&[x_m, y_m]) if x_m.is_finite() && y_m.is_finite() => Ok([x_m, y_m]),
        _ => Err(format!("receiver {text}: must be X,Y in m")),
    }
}

/// Checks that the page's data were recent at its request. `time_s` is the time of these data, s.
fn check_age(now: Instant, time_s: f64) -> Result<(), String> {
    let age_s = now.as_micros() as f64 / 1e6 - time_s;
    if (-1.0..=OLDEST_S).contains(&age_s) {
        return Ok(());
    }
    Err(format!(
        "the page shows the state of {age_s:.1} s ago, but at most {OLDEST_S} s are allowed: wait until the page is up to date, and try again"
    ))
}

/// Removes a lost relay from the page, as the page has requested with `body`.
fn clear(now: Instant, parts: &mut Parts<'_>, body: &str) -> Result<String, String> {
    let asked: Cleared = serde_json::from_str(body).map_err(|error| error.to_string())?;
    check_age(now, asked.time_s)?;
    let web = parts.web.as_mut();
    let web = web.ok_or("this station serves no page from which the relay could be cleared: start the station with --web")?;
    web.clear(now, asked.relay)?;
    Ok(json!({ "relay": asked.relay }).to_string())
}

/// Starts the upload of a preview that the operator has confirmed.
fn upload(now: Instant, parts: &mut Parts<'_>, body: &str) -> Result<String, String> {
    let asked: Confirmed = serde_json::from_str(body).map_err(|error| error.to_string())?;
    check_age(now, asked.time_s)?;
    let uploading = parts
        .uploading
        .as_mut()
        .ok_or("there is no preview: make a preview first")?;
    uploading.confirm(now, parts.ground, asked.preview, &asked.digest)?;
    Ok(json!({ "preview": asked.preview }).to_string())
}

/// Returns the state of previews and uploads for the page.
///
/// `shown` is the mission that the page's map shows, as [`name_of`](crate::uploading::name_of) returns it; `None` if
/// the mission is unknown.
pub(crate) fn state(
    plan: &Plan,
    shown: Option<&str>,
    reports: &[&Report],
    uploading: Option<&Uploading>,
) -> Value {
    let is_sited = plan.sited.is_some();
    if plan.loaded.mission.field().is_some() {
        return json!({ "why": UploadError::Field.to_string() });
    }
    let Some(uploading) = uploading else {
        return json!({ "sited": is_sited, "shown": shown });
    };
    let upload = uploading.upload();
    let version = upload.map(Upload::version);
    // Reports have no digest: before that they may be of another mission with this version.
    let is_adopted = uploading.is_adopted();
    let flying = reports
        .iter()
        .filter(|it| is_adopted && version.is_some() && it.version == version);
    let arrived = flying
        .clone()
        .filter(|it| has_arrived(it))
        .map(|it| it.relay);
    json!({
        "sited": is_sited,
        "shown": shown,
        "number": uploading.number(),
        "stage": uploading.stage(),
        "fault": uploading.fault(),
        "version": version,
        "digest": upload.map(digest_of),
        "preview": uploading.shown(),
        "adopted": flying.map(|it| it.relay).collect::<Vec<_>>(),
        "arrived": arrived.collect::<Vec<_>>(),
        "relays": plan.loaded.mission.relays(),
    })
}

fn has_arrived(report: &Report) -> bool {
    report.position.zip(report.agreed).is_some_and(|(is, to)| {
        let flat_m = (is.x_m - to.x_m).hypot(is.y_m - to.y_m);
        flat_m.hypot(is.altitude_m - to.altitude_m) <= ARRIVED_M
    })
}

/// Returns a preview for the page.
pub(crate) fn preview(plan: &Plan, preview: &Preview) -> Value {
    let Preview {
        before,
        after,
        moves,
    } = preview;
    let changes = changes(before, after);
    let changes = changes.map(|(name, old, new)| json!({ "value": name, "old": old, "new": new }));
    let moves = moves.as_deref();
    let places =
        |of: fn(&Move) -> Placement| moves.map(|moves| moves.iter().map(of).collect::<Vec<_>>());
    let lines = [before, after].map(|it| it.line.and_then(|line| Axis::between(line).ok()));
    // The page's map has the coordinates of the present line.
    let on_map = |to: Placement| match &lines {
        [Some(old), Some(new)] if before.line != after.line => old.place(new.point(to)?),
        _ => Some(to),
    };
    let targets = places(|it| it.after).unwrap_or_default().into_iter();
    let targets = targets.filter_map(on_map).map(|at| [at.x_m, at.y_m]);
    let worst = |basis, places: Option<Vec<_>>| places.map(|it| worst_db(plan, basis, &it));
    json!({
        "changes": changes.collect::<Vec<_>>(),
        "moves": moves.map(|moves| moves.iter().map(fields).collect::<Vec<_>>()),
        "targets": targets.collect::<Vec<_>>(),
        "worst_before": worst(before, places(|it| it.before)),
        "worst_after": worst(after, places(|it| it.after)),
    })
}

/// Returns the SIR of the worst hop toward Rx, and that of the worst hop toward Tx, dB.
///
/// `places` are the positions of the relays. `None` stands for an unknown SIR.
fn worst_db(plan: &Plan, basis: &Basis, places: &[Placement]) -> [Option<f64>; 2] {
    let Ok(mission) = Mission::try_new(basis.config) else {
        return [None; 2];
    };
    let profile = |relay: u16| {
        let own = plan.loaded.profiles.iter().find(|(of, _)| *of == relay);
        own.map_or(basis.config.common, |(_, profile): &(u16, Profile)| {
            *profile
        })
    };
    let flown: Vec<_> = (1..)
        .zip(places)
        .map(|(relay, at)| (*at, profile(relay)))
        .collect();
    let there = hop_sirs(&mission, &flown);
    let back = (mission.reverse() > 0.0).then(|| hop_sirs_back(&mission, &flown));
    [there, back.unwrap_or_default()].map(|sirs| sirs.into_iter().reduce(f64::min).map(db))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by it")]
    #![allow(clippy::cast_possible_truncation, reason = "as a mission has it")]

    use serde_json::json;
    use uav_relay::{
        Auth, GuardConfig, Identity, Instant, Key, LineError, Method, Mission, Placement, Relay,
        Settings, Side, Sites, Upload, UploadError,
    };
    use uav_relay_linux::site::site;
    use uav_relay_scenario::{Scenario, mission};
    use uav_relay_sim::simulator::chain;
    use uav_relay_sim::simulator::outcome::Ending;
    use uav_relay_sim::simulator::setup::{Setup, UploadSpec};

    use super::form;
    use crate::forecast::{Loaded, moves};
    use crate::new::Basis;
    use crate::report::FenceViolation;

    /// Pseudorandom numbers (an xorshift generator).
    struct Random(u64);

    impl Random {
        fn within(&mut self, least: f64, most: f64) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            least + (most - least) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }

        fn is(&mut self, share: f64) -> bool {
            self.within(0.0, 1.0) < share
        }
    }

    /// Returns the content of a random preview request. The relays were loaded with altitudes of 20 to 60 m.
    fn body(random: &mut Random, is_sited: bool) -> String {
        let mut values = json!({});
        let mut set = |name: &str, text: String| values[name] = json!(text);
        if random.is(0.6) {
            let [x, y] =
                [(100.0, 900.0), (-500.0, 500.0)].map(|(from, to)| random.within(from, to));
            set(
                "interferer",
                format!("{:.2},{x:.3},{y:.3}", random.within(1.0, 300.0)),
            );
        }
        if random.is(0.6) {
            let y_m = if is_sited {
                random.within(-30.0, 30.0)
            } else {
                0.0
            };
            set(
                "receiver",
                format!("{:.2},{y_m:.2}", random.within(700.0, 1_020.0)),
            );
        }
        if random.is(0.4) {
            set("altitude", format!("{:.2}", random.within(18.0, 62.0)));
        }
        if random.is(0.2) {
            let [low, high] =
                [(15.0, 30.0), (50.0, 70.0)].map(|(from, to)| random.within(from, to));
            set("band", format!("{low:.1},{high:.1}"));
        }
        if random.is(0.3) {
            set("noise", format!("{:e}", random.within(0.0, 1e-6)));
        }
        if random.is(0.2) {
            set("lateral-max-m", format!("{:.1}", random.within(0.0, 42.0)));
        }
        if random.is(0.3) {
            set("uav-power", format!("{:.3}", random.within(0.1, 2.0)));
        }
        values.to_string()
    }

    fn upload_of(
        random: &mut Random,
        version: u16,
        loaded: &Mission,
        sited: Option<Sites>,
        before: &Basis,
    ) -> Option<Upload> {
        let form = form(1, sited, &body(random, sited.is_some())).unwrap();
        let new = form.new.with_receiver(form.receiver_m, before).unwrap();
        new.upload(version, loaded, sited, before).ok()
    }

    /// Returns the final setpoints of a simulated chain that flies `uploads` one after the other.
    ///
    /// The simulated relays have neither drones nor a geofence.
    fn flown(loaded: &Mission, method: Method, uploads: &[Upload]) -> Option<Vec<Placement>> {
        let mut setup = Setup::new(*loaded);
        setup.auth = true;
        setup.settings.method = method;
        let specs = (1..).zip(uploads).map(|(turn, upload)| UploadSpec {
            end: Side::Upstream,
            at: Instant::from_millis(100_000 * turn),
            upload: *upload,
        });
        setup.uploads = specs.collect();
        let outcome = chain::run(setup).unwrap();
        let is_settled = outcome.ending == Ending::Settled;
        let ends = outcome.relays.iter().map(|relay| relay.setpoint);
        ends.collect::<Option<Vec<_>>>().filter(|_| is_settled)
    }

    /// Returns the name of the limit that makes a relay with a drone refuse the upload `new`.
    ///
    /// `None` if the relay accepts the upload. The relay flies the mission `before` at that time.
    fn limit(loaded: &Mission, before: Option<&Upload>, new: &Upload) -> Option<&'static str> {
        let settings = Settings {
            guard: Some(GuardConfig::of(loaded, loaded.config().common)),
            auth: Some(Auth {
                key: Key::new([7; 32]),
                epoch: 1,
            }),
            ..Settings::default()
        };
        let identity = Identity {
            network: 0,
            index: 1,
        };
        let mut relay = Relay::new(*loaded, identity, settings, 1, Instant::ZERO).unwrap();
        if let Some(before) = before {
            relay.resume(before).unwrap();
        }
        match relay.handle_upload(Instant::ZERO, new) {
            Ok(()) => None,
            Err(UploadError::Line(LineError::Altitude)) => Some("altitude "),
            Err(UploadError::Line(LineError::Lateral)) => Some("lateral range "),
            Err(UploadError::Line(LineError::Length)) => Some("distance "),
            Err(error) => panic!("{error}"),
        }
    }

    #[test]
    fn two_hundred_previews_are_what_is_flown_and_what_is_refused() {
        let mut random = Random(20_261_126);
        let line = Sites {
            tx: site("47.4,8.54,420").unwrap(),
            rx: site("47.4071,8.5483,431").unwrap(),
        };
        let (mut checked, mut refused, mut moved) = (0, [0; 3], 0);
        while checked < 200 {
            let sited = random.is(0.5).then_some(line);
            let along_m = uav_relay::flight::axis::Axis::between(line)
                .unwrap()
                .distance_m();
            let scenario = Scenario {
                distance_m: if sited.is_some() {
                    f64::from(along_m as f32)
                } else {
                    1_000.0
                },
                altitude_max_m: 60.0,
                lateral_max_m: if random.is(0.5) { 40.0 } else { 0.0 },
                ..Scenario::default()
            };
            let relays = 1 + checked % 5;
            let (mission, _) = mission::mission(&scenario, relays, 1e-4).unwrap();
            let method = if random.is(0.3) {
                Method::Joint
            } else {
                Method::Align
            };
            let loaded = Loaded {
                mission,
                method,
                profiles: Vec::new(),
                held: Vec::new(),
            };
            let own = Basis::loaded(&mission, sited);
            let first = random
                .is(0.5)
                .then(|| upload_of(&mut random, 1, &mission, sited, &own));
            let first = first
                .flatten()
                .filter(|it| limit(&mission, None, it).is_none());
            let before = first.map_or(own, |it| Basis::flown(it, sited));
            let Some(new) = upload_of(&mut random, 2, &mission, sited, &before) else {
                continue;
            };
            let lines = [before.line, Basis::flown(new, sited).line];
            let forecast = moves(&loaded, first.as_ref(), &new, lines);
            let fence = FenceViolation::of(&mission, &new);
            let fence = fence.map(|fence| fence.line(forecast.as_deref()));
            let limit = limit(&mission, first.as_ref(), &new);
            assert_eq!(fence.is_some(), limit.is_some(), "{fence:?}, {limit:?}");
            if let (Some(line), Some(limit)) = (fence, limit) {
                let names = forecast.is_none() || line.contains(": relay ");
                assert!(
                    line.starts_with(limit) && line.contains("must be within") && names,
                    "{line}"
                );
                let at = ["altitude ", "lateral range ", "distance "]
                    .iter()
                    .position(|it| *it == limit);
                refused[at.unwrap()] += 1;
            }
            let uploads: Vec<Upload> = first.into_iter().chain([new]).collect();
            let ends = flown(&mission, method, &uploads);
            let after = forecast
                .as_ref()
                .map(|all| all.iter().map(|it| it.after).collect::<Vec<_>>());
            let bits = |places: Vec<Placement>| {
                let places = places.into_iter();
                places
                    .map(|at| [at.x_m, at.y_m, at.altitude_m].map(f32::to_bits))
                    .collect::<Vec<_>>()
            };
            assert_eq!(
                after.map(bits),
                ends.map(bits),
                "preview {checked}: {new:?}"
            );
            moved += u32::from(forecast.is_some_and(|all| all.iter().any(|it| it.metres > 1.0)));
            checked += 1;
        }
        println!(
            "200 previews, {moved} of them move a relay by more than 1 m; refused by altitude, side, distance: {refused:?}"
        );
        assert!(
            moved > 100 && refused.iter().all(|it| *it > 0),
            "{moved}, {refused:?}"
        );
    }

    #[test]
    fn values_of_a_preview_are_checked_as_on_the_command_line() {
        for (body, why) in [
            ("[]", "must be a JSON object whose values are strings: "),
            (
                r#"{"altitude": 30}"#,
                "must be a JSON object whose values are strings: ",
            ),
            (
                r#"{"altitude": "0"}"#,
                "must be a number within 0.1 to 10000 m",
            ),
            (r#"{"altitude": "NaN"}"#, "must be a number within"),
            (r#"{"interferer": "80,700"}"#, "--new-interferer"),
            (r#"{"land": "1"}"#, "unexpected argument '--new-land'"),
            (r#"{"receiver": "1e39,0"}"#, "must be X,Y in m"),
            (r#"{"receiver": "900"}"#, "must be X,Y in m"),
            (
                r#"{"receiver": "900,0", "distance": "900"}"#,
                "must be left out",
            ),
            (r#"{"site-rx": "47,8,400"}"#, "need sites"),
        ] {
            let error = form(1, None, body).unwrap_err();
            assert!(
                error.contains(why) && !error.contains('\n'),
                "{body}: {error}"
            );
        }
        let beside = form(1, None, r#"{"receiver": "900,5"}"#).unwrap();
        let (mission, _) = mission::mission(&Scenario::default(), 1, 1e-4).unwrap();
        let basis = Basis::loaded(&mission, None);
        let error = beside
            .new
            .with_receiver(beside.receiver_m, &basis)
            .unwrap_err();
        assert!(error.contains("y 5 m: must be 0 m"), "{error}");
    }
}
