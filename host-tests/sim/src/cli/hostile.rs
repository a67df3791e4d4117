//! Options for failures, partitions, attacks and uploads.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use uav_relay::flight::axis::{Axis, LONGEST_M, SHORTEST_M};
use uav_relay::{Duration, GuardConfig, Instant, Sites, Wiring};

use super::rotation::Rotation;
use super::time::{instant, span};
use super::upload::Uploads;
use crate::command::{Failure, carries, quantity, whole};
use crate::report::seconds;
use crate::simulator::attack::Attack;
use crate::simulator::drones::{BIAS_M, GUST_MPS, HOVER_M, NOISE_M, Point};
use crate::simulator::faults::{Bursts, OneWayFailure};
use crate::simulator::fleet::{FleetSpec, Takeover, somewhere};
use crate::simulator::medium::Access;
use crate::simulator::setup::{Partition, Setup};

/// Command-line options for failures and reboots of relays, partitions of the chain, and radio attacks.
#[derive(Args, Debug)]
#[command(next_help_heading = "Hostile air")]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
pub struct Hostile {
    /// Relay I goes silent at second S of virtual time; the others form a new chain. Repeatable
    #[arg(long, value_name = "I@S", value_parser = relay_event)]
    pub kill: Vec<RelayEvent>,
    /// Relay I reboots at second S; of its state it keeps only persisted data such as an uploaded mission. Repeatable
    #[arg(long, value_name = "I@S", value_parser = relay_event)]
    boot: Vec<RelayEvent>,
    /// Relays 1 to K and the others do not receive each other from second S until T, or permanently. Repeatable
    #[arg(long, value_name = "K@S[-T]", value_parser = partition, conflicts_with = "wires")]
    partition: Vec<Partition>,
    /// An attacker sends N forged frames, 1 to 100000. They have guessed tags (signatures), altered bytes, no tags, or another key
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1_u32, 100_000))]
    forge: Option<u32>,
    /// An attacker sends N frames again that relays have sent before, 1 to 100000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1_u32, 100_000))]
    replay: Option<u32>,
    #[command(flatten)]
    pub uploads: Uploads,
    /// Sign frames with a key drawn from the seed; default with an attacker or an upload
    #[arg(long, conflicts_with = "no_auth")]
    auth: bool,
    /// Send unsigned frames, even with an attacker; excludes uploads
    #[arg(long)]
    no_auth: bool,
    /// Connect all relays by one radio channel. A frame reaches the four nearest relays on each side (--reach). Default with any of --kill, --boot, --partition,
    /// --deaf, --soak, --air, --fly, --forge, --replay and --upload
    #[arg(long, conflicts_with = "wires")]
    shared: bool,
    /// Connect each relay to its neighbours by wires, even where --shared is the default. A failure is reported, but the gap is not closed
    #[arg(long)]
    wires: bool,
    #[command(flatten)]
    pub air: Air,
    #[command(flatten)]
    pub flight: Flight,
}

/// Relay to which an option applies, and the virtual time of the event, as in `--kill I@S`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RelayEvent {
    index: u16,
    at: Instant,
}

/// Time from the last planned event of the run to the end of an attack, s. An attack is no such event.
const ATTACK_S: u64 = 30;

/// Time from the last planned event of a run to the deadline of the run, s of virtual time.
const PATIENCE_S: u64 = 3_600;

impl Hostile {
    /// Returns true if the options add failures, attacks, uploads or drones, or fix the run's duration.
    fn is_eventful(&self) -> bool {
        !(self.kill.is_empty() && self.boot.is_empty() && self.partition.is_empty())
            || self.is_attack()
            || self.uploads.are_planned()
            || self.air.is_eventful()
            || self.flight.is_chosen()
    }

    fn is_attack(&self) -> bool {
        self.forge.is_some() || self.replay.is_some()
    }

    /// Returns the virtual time of the last event that the options request. Attacks are left out.
    fn last(&self) -> Instant {
        let ones = self.kill.iter().chain(&self.boot).map(|one| one.at);
        let parts = self
            .partition
            .iter()
            .map(|part| part.until.unwrap_or(part.from));
        let all = ones
            .chain(parts)
            .chain(self.uploads.times())
            .chain(self.air.times())
            .chain(self.flight.times());
        all.max().unwrap_or(Instant::ZERO)
    }

    /// Checks that the options do not contradict each other, and fit a chain of `uavs` relays.
    ///
    /// `is_loop` is true if `--closed-loop` is given. Options for failures, attacks, uploads or simulated drones are
    /// then errors.
    pub fn agree(&self, uavs: u16, is_loop: bool) -> Result<(), Failure> {
        for (name, ones) in [("--kill", &self.kill), ("--boot", &self.boot)] {
            if let Some(one) = ones.iter().find(|one| !(1..=uavs).contains(&one.index)) {
                let line = format!(
                    "{name} {}@{}: the relay's number must be within 1 to {uavs}",
                    one.index,
                    seconds(one.at)
                );
                return Err(Failure::input(line));
            }
        }
        self.in_order()?;
        self.uploads.agree(!self.boot.is_empty())?;
        if let Some(part) = self
            .partition
            .iter()
            .find(|part| !(1..uavs).contains(&part.after))
        {
            let option = format!("--partition {}@{}", part.after, seconds(part.from));
            let line = match uavs {
                1 => format!("{option}: one relay alone cannot be partitioned"),
                _ => format!(
                    "{option}: the relay's number must be within 1 to {}",
                    uavs - 1
                ),
            };
            return Err(Failure::input(line));
        }
        self.air.agree(uavs)?;
        self.flight.agree(uavs)?;
        self.in_time()?;
        if self.is_eventful() && is_loop {
            let line = "--closed-loop cannot be combined with --kill, --boot, --partition, --deaf, --soak, --fly, --forge, --replay or --upload";
            return Err(Failure::input(line));
        }
        if self.uploads.are_planned() && self.no_auth {
            let line = "--upload cannot be combined with --no-auth, because relays accept only signed uploads";
            return Err(Failure::input(line));
        }
        Ok(())
    }

    /// Rejects a `--kill` of a relay that an earlier `--kill` has switched off. Also rejects a `--boot` of a relay
    /// before its first `--kill`.
    ///
    /// A `--boot` of a relay without any `--kill` is allowed: the relay reboots.
    fn in_order(&self) -> Result<(), Failure> {
        let kills = self.kill.iter().map(|one| (one, true));
        let mut all: Vec<(&RelayEvent, bool)> = kills
            .chain(self.boot.iter().map(|one| (one, false)))
            .collect();
        // Kills sort before boots of the same time.
        all.sort_by_key(|(one, _)| (one.index, one.at));
        for (place, (one, is_kill)) in all.iter().enumerate() {
            let of_it = |(other, _): &&(&RelayEvent, bool)| other.index == one.index;
            let (before, after) = all.split_at(place);
            let last = before.iter().rev().find(of_it);
            let first = after
                .iter()
                .skip(1)
                .filter(of_it)
                .find(|(_, is_kill)| *is_kill);
            let RelayEvent { index, at } = one;
            let at = seconds(*at);
            if *is_kill && let Some((other, true)) = last {
                let line = format!(
                    "--kill {index}@{at}: has no effect, because the relay has been silent since --kill {index}@{}",
                    seconds(other.at)
                );
                return Err(Failure::input(line));
            }
            if let (false, None, Some((other, _))) = (is_kill, last, first) {
                let kill = seconds(other.at);
                let line = format!("--boot {index}@{at}: must be after --kill {index}@{kill}");
                return Err(Failure::input(line));
            }
        }
        Ok(())
    }

    /// Rejects events that begin after the end of the run, if `--soak` sets an end.
    fn in_time(&self) -> Result<(), Failure> {
        let Some(end) = self.air.soaked() else {
            return Ok(());
        };
        let named = |option: &'static str| {
            move |one: &RelayEvent| {
                let text = format!("{option} {}@{}", one.index, seconds(one.at));
                (text, one.at)
            }
        };
        let parts = self.partition.iter();
        let mut all = (self.kill.iter().map(named("--kill")))
            .chain(self.boot.iter().map(named("--boot")))
            .chain(parts.map(|part| {
                let text = format!("--partition {}@{}", part.after, seconds(part.from));
                (text, part.from)
            }))
            .chain(self.uploads.begins())
            .chain(self.air.begins())
            .chain(self.flight.begins());
        match all.find(|(_, at)| *at >= end) {
            Some((option, _)) => Err(Failure::input(format!(
                "{option}: has no effect, because --soak {} ends the run earlier",
                seconds(end)
            ))),
            None => Ok(()),
        }
    }

    /// Adds the requested failures, attack and uploads to `setup`. `sites` are the geographic positions of Tx and Rx,
    /// `None` if the scenario has none.
    pub fn prepare(&self, setup: &mut Setup, sites: Option<Sites>) -> Result<(), Failure> {
        let pairs = |ones: &[RelayEvent]| ones.iter().map(|one| (one.index, one.at)).collect();
        setup.kills = pairs(&self.kill);
        setup.boots = pairs(&self.boot);
        setup.partitions.clone_from(&self.partition);
        let after =
            |seconds: u64| Instant::from_micros(self.last().as_micros() + seconds * 1_000_000);
        if self.shared || self.air.is_chosen() || self.is_eventful() && !self.wires {
            setup.settings.wiring = Wiring::Shared;
        }
        if self.is_attack() {
            setup.attack = Some(Attack {
                forged: self.forge.unwrap_or(0),
                replayed: self.replay.unwrap_or(0),
                until: after(ATTACK_S),
            });
        }
        setup.watches = self.uploads.watches().into_iter().collect();
        let asks = self.is_attack() || self.uploads.are_planned() || !setup.watches.is_empty();
        setup.auth = self.auth || asks && !self.no_auth;
        setup.uploads = self.uploads.of(&setup.mission, sites)?;
        if !self.uploads.are_stored() {
            setup.forgetful = (1..=setup.mission.relays()).collect();
        }
        if self.is_eventful() {
            setup.deadline = after(PATIENCE_S);
        }
        Ok(())
    }
}

fn relay_event(text: &str) -> Result<RelayEvent, String> {
    let form = "must be I@S: relay I (1 to N) at S seconds after the start (0 to 1e6)";
    let (index, at) = text.split_once('@').ok_or(form)?;
    Ok(RelayEvent {
        index: index.parse().map_err(|_| form)?,
        at: instant(at).ok_or(form)?,
    })
}

fn partition(text: &str) -> Result<Partition, String> {
    let form = "must be K@S or K@S-T: relays 1 to K (K from 1 to N - 1) and the others do not receive each other from S until T seconds after the start (0 to 1e6), or without T to the end";
    let (after, times) = text.split_once('@').ok_or(form)?;
    let after = after.parse().map_err(|_| form)?;
    let (from, until) = span(times).ok_or(form)?;
    if until.is_some_and(|until| until <= from) {
        return Err("must be K@S-T with the end T after the start S".to_owned());
    }
    Ok(Partition { after, from, until })
}

/// Command-line options for links, the shared radio channel, and losses of frames.
#[derive(Args, Debug)]
#[command(next_help_heading = "Links and the radio channel")]
pub struct Air {
    /// Access method of a radio channel that all relays share, as with --shared; default csma
    #[arg(long = "air", value_name = "A", value_enum, conflicts_with = "wires")]
    sharing: Option<Sharing>,
    /// Bits per second of every link or of the channel, 300 to 10000000; a byte takes ten bits
    #[arg(long, value_name = "B", default_value_t = 115_200, allow_negative_numbers = true, value_parser = whole(300_u32, 10_000_000))]
    baud: u32,
    /// Silence after which a neighbour is probed, ms, 1 to 1200000; default 5000. After three times as long it counts as lost.
    /// Larger values allow more relays on a slow channel
    #[arg(long, value_name = "MS", value_parser = whole(1_u64, 1_200_000))]
    probe_after_ms: Option<u64>,
    /// Range of the radios: number of relays on each side that receive a frame, 1 to 1000; default 4
    #[arg(long, value_name = "K", conflicts_with = "wires", value_parser = whole(1_usize, 1_000))]
    reach: Option<usize>,
    /// Mean length of a burst of losses, frames, 1 to 1e6 (Gilbert-Elliott). It is independent for each direction of a link; --loss
    /// P is the mean share of lost frames. L is 1 for independent losses, otherwise at least 1 / (1 - P)
    #[arg(long, value_name = "L", default_value_t = 1.0, allow_negative_numbers = true, value_parser = |text: &str| quantity(text, 1.0, 1e6, "frames"))]
    burst: f64,
    /// Relay J does not receive relay I from second S until E, or permanently. Repeatable
    #[arg(long, value_name = "J:I@S[-E]", value_parser = deaf)]
    deaf: Vec<OneWayFailure>,
    /// End the run after S seconds of virtual time, 1 to 1e6, and report the chain's availability. This is the share of the time
    /// in which the longest possible chain is at its best positions
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = soak)]
    soak: Option<Instant>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Sharing {
    /// Half duplex: radios sense the channel before they send, and wait a random time
    Csma,
    /// Half duplex: radios send at once
    Aloha,
    /// Separate line for every sender: no collisions
    Ideal,
}

impl Air {
    /// Returns true if `--air` is given. All relays then share one radio channel with that access method.
    pub fn is_chosen(&self) -> bool {
        self.sharing.is_some()
    }

    /// Returns true if `--deaf` (one-way link failures) or `--soak` (a fixed duration of the run) is given.
    pub fn is_eventful(&self) -> bool {
        !self.deaf.is_empty() || self.soak.is_some()
    }

    /// Returns the end of the run that `--soak` sets; `None` without that option.
    pub const fn soaked(&self) -> Option<Instant> {
        self.soak
    }

    /// Returns each `--deaf` option as text, for error messages, and the start of its failure.
    pub fn begins(&self) -> impl Iterator<Item = (String, Instant)> {
        let name = |deaf: &OneWayFailure| {
            let OneWayFailure { by, of, from, .. } = deaf;
            (format!("--deaf {by}:{of}@{}", seconds(*from)), *from)
        };
        self.deaf.iter().map(name)
    }

    /// Returns the end of each `--deaf` failure, and the end of the run if `--soak` sets it. For a permanent failure,
    /// its start is returned instead of its end.
    pub fn times(&self) -> impl Iterator<Item = Instant> {
        self.deaf
            .iter()
            .map(|deaf| deaf.until.unwrap_or(deaf.from))
            .chain(self.soak)
    }

    /// Checks that the relays of all `--deaf` options are in a chain of `uavs` relays.
    pub fn agree(&self, uavs: u16) -> Result<(), Failure> {
        let wrong = self.deaf.iter().find(|deaf| {
            !(1..=uavs).contains(&deaf.by.min(deaf.of)) || deaf.by.max(deaf.of) > uavs
        });
        if let Some(OneWayFailure { by, of, from, .. }) = wrong {
            let line = format!(
                "--deaf {by}:{of}@{}: the numbers of both relays must be within 1 to {uavs}",
                seconds(*from)
            );
            return Err(Failure::input(line));
        }
        Ok(())
    }

    /// Applies the options about links to `setup`. `loss` is the probability that a frame is lost.
    ///
    /// The setup's wiring must already be set, because the access method depends on it.
    pub fn prepare(&self, setup: &mut Setup, loss: f64) -> Result<(), Failure> {
        if self.burst > 1.0 && loss <= 0.0 {
            let line = format!("--burst {}: has no effect without --loss", self.burst);
            return Err(Failure::input(line));
        }
        let least = Bursts::shortest(loss);
        if self.burst > 1.0 && self.burst < least {
            let line = format!(
                "--burst {}: mean length of a burst, frames: must be 1 (independent losses) or {least:.4} to 1e6; with --loss {loss} independent losses already have a mean length of {least:.4}",
                self.burst
            );
            return Err(Failure::input(line));
        }
        setup.burst = self.burst;
        setup.link.baud = self.baud;
        if let Some(ms) = self.probe_after_ms {
            setup.settings.probe_after = Duration::from_millis(ms);
            setup.settings.dead_after = Duration::from_millis(3 * ms);
        }
        if let Some(reach) = self.reach {
            if setup.settings.wiring == Wiring::Pair {
                let line = format!("--reach {reach}: has no effect without --air");
                return Err(Failure::input(line));
            }
            setup.radio_reach = reach;
        }
        setup.deaf.clone_from(&self.deaf);
        setup.access = match (setup.settings.wiring, self.sharing) {
            (Wiring::Pair, _) | (_, Some(Sharing::Ideal)) => Access::Ideal,
            (_, Some(Sharing::Aloha)) => Access::Aloha,
            (_, Some(Sharing::Csma) | None) => Access::Csma,
        };
        if let Some(load) = setup.load() {
            carries(self.baud, load, setup.settings.probe_after).map_err(Failure::input)?;
        }
        if let Some(until) = self.soak {
            setup.soak = Some(until);
            setup.deadline = until;
        }
        Ok(())
    }
}

fn deaf(text: &str) -> Result<OneWayFailure, String> {
    let form = "must be J:I@S or J:I@S-E: relay J does not receive relay I (each 1 to N) from S until E seconds after the start (0 to 1e6), or without E to the end";
    let (relays, times) = text.split_once('@').ok_or(form)?;
    let (by, of) = relays.split_once(':').ok_or(form)?;
    let by: u16 = by.parse().map_err(|_| form)?;
    let of: u16 = of.parse().map_err(|_| form)?;
    let (from, until) = span(times).ok_or(form)?;
    if until.is_some_and(|until| until <= from) {
        return Err("must be J:I@S-E with the end E after the start S".to_owned());
    }
    if by == of {
        return Err("J and I must be two different relays".to_owned());
    }
    Ok(OneWayFailure {
        by,
        of,
        from,
        until,
    })
}

fn soak(text: &str) -> Result<Instant, String> {
    quantity(text, 1.0, 1e6, "s")?;
    instant(text).ok_or_else(|| "must be a number within 1 to 1e6 s".to_owned())
}

/// Command-line options for simulated drones, their pilots and autopilots.
#[derive(Args, Debug)]
#[command(next_help_heading = "Drones")]
pub struct Flight {
    /// Simulate drones: limited speed and acceleration, position noise, gusts, autopilots, pilots, guard. The autopilots speak
    /// MAVLink (PX4 and ArduCopter in turn), and the pilots take off and hand over. The run ends when all flying drones hover at
    /// their positions
    #[arg(long)]
    fly: bool,
    /// The pilot of drone I takes over from second S until E, or permanently. Repeatable
    #[arg(long, value_name = "I@S[-E]", value_parser = takeover)]
    takeover: Vec<Takeover>,
    /// File with the position at which each pilot first hands the drone over to its relay. One line
    /// `index, x_m, y_m, h_m` per drone
    #[arg(long, value_name = "FILE", requires = "fly")]
    start: Option<PathBuf>,
    #[command(flatten)]
    pub rotation: Rotation,
}

/// Limit on |x|, on |y| and on the height, m, of each start position in the file of `--start`.
const START_WITHIN_M: f64 = 5_000.0;

impl Flight {
    pub const fn is_chosen(&self) -> bool {
        self.fly
    }

    /// Returns the number of drones of the fleet, if it is given.
    pub const fn fleet(&self) -> Option<u16> {
        self.rotation.fleet
    }

    /// Returns each `--takeover` option as text, for error messages, and the start of the takeover.
    pub fn begins(&self) -> impl Iterator<Item = (String, Instant)> {
        let name = |it: &Takeover| {
            let text = format!("--takeover {}@{}", it.relay, seconds(it.from));
            (text, it.from)
        };
        self.takeover.iter().map(name)
    }

    /// Returns the end of each takeover by a pilot, or its start if it is permanent.
    pub fn times(&self) -> impl Iterator<Item = Instant> {
        self.takeover
            .iter()
            .map(|takeover| takeover.until.unwrap_or(takeover.from))
    }

    /// Rejects `--takeover` without `--fly`, or of a drone that a chain of `uavs` relays does not have.
    pub fn agree(&self, uavs: u16) -> Result<(), Failure> {
        if let (false, Some((option, _))) = (self.fly, self.begins().next()) {
            let line = format!("{option}: has no effect without --fly");
            return Err(Failure::input(line));
        }
        let wrong = |takeover: &&Takeover| !(1..=uavs).contains(&takeover.relay);
        match self.takeover.iter().find(wrong) {
            Some(takeover) => Err(Failure::input(format!(
                "--takeover {}@{}: the relay's number must be within 1 to {uavs}",
                takeover.relay,
                seconds(takeover.from)
            ))),
            None => Ok(()),
        }
    }

    /// Adds the drones to `setup` if `--fly` is given. Without `--start` they start evenly spaced from Tx to Rx.
    ///
    /// `axis` is the geographic line from Tx to Rx. If it is `None`, the line is at an arbitrary place on Earth.
    pub fn prepare(&self, setup: &mut Setup, axis: Option<Axis>) -> Result<(), Failure> {
        if !self.fly {
            return Ok(());
        }
        let config = setup.mission.config();
        let distance_m = f64::from(config.distance_m);
        if self.rotation.fleet.is_some() {
            return self.rotation.prepare(setup);
        }
        let axis = axis.or_else(|| somewhere(distance_m)).ok_or_else(|| {
            Failure::input(format!(
                "--fly: the distance from Tx to Rx is {distance_m} m: must be within {SHORTEST_M} to {LONGEST_M} m"
            ))
        })?;
        let start = match &self.start {
            Some(file) => starts(file, config.relays)?,
            None => (0..config.relays)
                .map(|index| {
                    let share = (f64::from(index) + 0.5) / f64::from(config.relays);
                    [distance_m * share, 0.0, f64::from(config.common.altitude_m)]
                })
                .collect(),
        };
        let mut guard = GuardConfig::of(&setup.mission, config.common);
        guard.hover_m = HOVER_M;
        setup.settings.guard = Some(guard);
        setup.settings.sited = true;
        setup.fleet = Some(FleetSpec {
            axis,
            start,
            takeovers: self.takeover.clone(),
            restarts: Vec::new(),
            gust_mps: GUST_MPS,
            bias_m: BIAS_M,
            noise_m: NOISE_M,
        });
        Ok(())
    }
}

fn takeover(text: &str) -> Result<Takeover, String> {
    let form =
        "must be I@S or I@S-E: relay I (1 to N) from S to E seconds after the start (0 to 1e6)";
    let (relay, times) = text.split_once('@').ok_or(form)?;
    let relay = relay.parse().map_err(|_| form)?;
    let (from, until) = span(times).ok_or(form)?;
    if until.is_some_and(|until| until <= from) {
        return Err("must be I@S-E with the end E after the start S".to_owned());
    }
    Ok(Takeover {
        relay,
        from,
        until,
        to: None,
    })
}

/// Reads the start positions of all drones, relay 1 first, from the file of `--start`.
fn starts(file: &Path, relays: u16) -> Result<Vec<Point>, Failure> {
    let named = |what: String| Failure::input(format!("--start {}: {what}", file.display()));
    let text =
        std::fs::read_to_string(file).map_err(|error| named(format!("cannot be read: {error}")))?;
    let mut starts = vec![None; usize::from(relays)];
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let at = |what: String| named(format!("line {}: {what}", number + 1));
        let form = || {
            at(format!(
                "`{line}`: must be `index, x_m, y_m, h_m`, with numbers"
            ))
        };
        let mut parts = line.split(',').map(str::trim);
        let index: u16 = parts
            .next()
            .and_then(|part| part.parse().ok())
            .ok_or_else(form)?;
        let mut place = [0.0; 3];
        for (value, least) in place
            .iter_mut()
            .zip([-START_WITHIN_M, -START_WITHIN_M, 2.0])
        {
            *value = parts
                .next()
                .and_then(|part| part.parse::<f64>().ok())
                .ok_or_else(form)?;
            if !(least..=START_WITHIN_M).contains(value) {
                return Err(at(format!(
                    "{value} m: must be within {least} to {START_WITHIN_M}"
                )));
            }
        }
        if parts.next().is_some() {
            return Err(form());
        }
        let start = index
            .checked_sub(1)
            .and_then(|index| starts.get_mut(usize::from(index)))
            .ok_or_else(|| at(format!("drone {index}: must be within 1 to {relays}")))?;
        if start.replace(place).is_some() {
            return Err(at(format!("drone {index} is given twice")));
        }
    }
    let complete: Option<Vec<Point>> = starts.iter().copied().collect();
    complete.ok_or_else(|| {
        let missing = starts.iter().position(Option::is_none).unwrap_or(0) + 1;
        named(format!(
            "drone {missing} has no line: must have one line for each drone, 1 to {relays}"
        ))
    })
}
