//! Options for failures, partitions, attacks and uploads.

use crate::command::{Failure, whole};
use crate::simulator::attack::Attack;
use crate::simulator::setup::{Partition, Setup};
use clap::Args;
use uav_relay::{Instant, Sites, Wiring};

use super::air::Air;
use super::flight::Flight;
use super::times::{instant, seconds, span};
use super::upload::Uploads;

/// Command-line options for events in the air.
#[derive(Args, Debug)]
#[command(next_help_heading = "Hostile air")]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
pub struct Hostile {
    /// Relay I goes silent at second S of virtual time; the others form a new chain. Repeatable
    #[arg(long, value_name = "I@S", value_parser = one)]
    pub kill: Vec<One>,
    /// Relay I reboots at second S; of its state it keeps only persisted data such as an uploaded mission. Repeatable
    #[arg(long, value_name = "I@S", value_parser = one)]
    boot: Vec<One>,
    /// Relays 1 to K and the others do not receive each other from second S until T, or permanently. Repeatable
    #[arg(long, value_name = "K@S[-T]", value_parser = partition, conflicts_with = "wires")]
    partition: Vec<Partition>,
    /// An attacker sends N forged frames, 1 to 100000. With guessed tags, altered, without tags, with another key
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1_u32, 100_000))]
    forge: Option<u32>,
    /// An attacker replays N received frames, 1 to 100000
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
    /// Connect all relays by one radio channel, which reaches four relays far. Default with any of --kill, --boot, --partition,
    /// --deaf, --soak, --air, --fly, --forge, --replay and --upload
    #[arg(long, conflicts_with = "wires")]
    shared: bool,
    /// Connect each relay to its neighbours by wires even then. A failure is reported, but the gap is not closed
    #[arg(long)]
    wires: bool,
    #[command(flatten)]
    pub air: Air,
    #[command(flatten)]
    pub flight: Flight,
}

/// Event of a relay with its time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct One {
    index: u16,
    at: Instant,
}

/// Duration of an attack after the last other event, s.
const ATTACK_S: u64 = 30;

/// Time limit of a run after its last event, s.
const PATIENCE_S: u64 = 3_600;

impl Hostile {
    /// Returns true if the options add events to the run.
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

    /// Returns the time of the last event, without attacks.
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

    /// Checks the options against a chain of `uavs` relays. If `is_loop` is true, `--closed-loop` is checked, too.
    pub fn agree(&self, uavs: u16, is_loop: bool) -> Result<(), Failure> {
        for (name, ones) in [("--kill", &self.kill), ("--boot", &self.boot)] {
            if let Some(one) = ones.iter().find(|one| !(1..=uavs).contains(&one.index)) {
                let line = format!("{name} {}@..: relay must be within 1 to {uavs}", one.index);
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
            let after = part.after;
            let line = match uavs {
                1 => format!("--partition {after}@..: one relay cannot be parted"),
                _ => format!(
                    "--partition {after}@..: relay must be within 1 to {}",
                    uavs - 1
                ),
            };
            return Err(Failure::input(line));
        }
        self.air.agree(uavs)?;
        self.flight.agree(uavs)?;
        self.in_time()?;
        if self.is_eventful() && is_loop {
            let line = "--closed-loop goes with none of --kill, --boot, --partition, --deaf, --soak, --fly, --forge, --replay and --upload";
            return Err(Failure::input(line));
        }
        if self.uploads.are_planned() && self.no_auth {
            let line = "--upload needs frames with tags, and --no-auth leaves them out";
            return Err(Failure::input(line));
        }
        Ok(())
    }

    /// Checks the order of the kills and boots of each relay.
    fn in_order(&self) -> Result<(), Failure> {
        let kills = self.kill.iter().map(|one| (one, true));
        let mut all: Vec<(&One, bool)> = kills
            .chain(self.boot.iter().map(|one| (one, false)))
            .collect();
        // Kills sort before boots of the same time.
        all.sort_by_key(|(one, _)| (one.index, one.at));
        for (place, (one, is_kill)) in all.iter().enumerate() {
            let of_it = |(other, _): &&(&One, bool)| other.index == one.index;
            let (before, after) = all.split_at(place);
            let last = before.iter().rev().find(of_it);
            let first = after
                .iter()
                .skip(1)
                .filter(of_it)
                .find(|(_, is_kill)| *is_kill);
            let One { index, at } = one;
            let at = seconds(*at);
            if *is_kill && let Some((other, true)) = last {
                let line = format!(
                    "--kill {index}@{at}: would be ignored: the relay has been silent since --kill {index}@{}",
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

    /// Checks that all events begin before the run ends.
    fn in_time(&self) -> Result<(), Failure> {
        let Some(end) = self.air.soaked() else {
            return Ok(());
        };
        let named = |option: &'static str| {
            move |one: &One| {
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
                "{option}: would be ignored: the run ends before, see --soak {}",
                seconds(end)
            ))),
            None => Ok(()),
        }
    }

    /// Applies the options to a setup.
    pub fn prepare(&self, setup: &mut Setup, sites: Option<Sites>) -> Result<(), Failure> {
        let pairs = |ones: &[One]| ones.iter().map(|one| (one.index, one.at)).collect();
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
        let asks = self.is_attack() || self.uploads.are_planned();
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

fn one(text: &str) -> Result<One, String> {
    let form = "must be I@S, a relay (1 to N) and seconds after the start (0 to 1e6)";
    let (index, at) = text.split_once('@').ok_or(form)?;
    Ok(One {
        index: index.parse().map_err(|_| form)?,
        at: instant(at).ok_or(form)?,
    })
}

fn partition(text: &str) -> Result<Partition, String> {
    let form = "must be K@S or K@S-T, a relay (1 to N - 1) and seconds after the start (0 to 1e6)";
    let (after, times) = text.split_once('@').ok_or(form)?;
    let after = after.parse().map_err(|_| form)?;
    let (from, until) = span(times).ok_or(form)?;
    if until.is_some_and(|until| until <= from) {
        return Err("must be K@S-T with T after S".to_owned());
    }
    Ok(Partition { after, from, until })
}
