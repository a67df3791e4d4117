//! Start of a run: switches every relay on and schedules all planned events.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::{Instant, SetupError, Wiring};

use super::super::attack::Struck;
use super::super::bursts::Bursts;
use super::super::faults::Injected;
use super::super::film::Film;
use super::super::link::Line;
use super::super::medium::{Access, AirCounts, Medium};
use super::super::optima::Run;
use super::super::outcome::{Ending, Outcome};
use super::super::queue::{Queue, QueuedEvent};
use super::super::record::Record;
use super::super::setup::Setup;
use super::fleet::LANDS_AFTER;
use super::judge::Touched;
use super::start::{Start, switched_on};
use super::state::{Chain, Member};
use super::station::stations;

impl Chain {
    /// Switches every relay on at time 0. `run` computes the reference positions if the run is watched.
    pub(super) fn begin(setup: Setup, run: Run) -> Result<Self, SetupError> {
        let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
        let members = members(&setup, &mut rng)?;
        let mut queue = Queue::default();
        let stations = stations(&setup);
        let bursts = (setup.burst > 1.0).then(|| Bursts::new(setup.faults.loss, setup.burst));
        let shared = setup.settings.wiring == Wiring::Shared;
        let medium = (shared && setup.access != Access::Ideal).then(|| {
            let nodes = members.len() + stations.len();
            Medium::new(setup.access, setup.link, nodes, setup.seed)
        });
        for &(index, at) in &setup.kills {
            queue.put(at, usize::from(index.saturating_sub(1)), QueuedEvent::Kill);
        }
        for &(index, at) in &setup.boots {
            queue.put(at, usize::from(index.saturating_sub(1)), QueuedEvent::Boot);
        }
        for (which, spec) in setup.uploads.iter().enumerate() {
            queue.put(spec.at, which, QueuedEvent::Upload);
        }
        let mut ahead = put_fleet(&setup, &mut queue)
            + setup.kills.len()
            + setup.boots.len()
            + setup.uploads.len();
        let parts = setup.partitions.iter().map(|part| (part.from, part.until));
        let deaf = setup.deaf.iter().map(|deaf| (deaf.from, deaf.until));
        for (from, until) in parts.chain(deaf) {
            for at in [Some(from), until].into_iter().flatten() {
                queue.put(at, 0, QueuedEvent::Part);
                ahead += 1;
            }
        }
        let film = setup.film.then(Film::default);
        let record = setup.record.then(Record::default);
        let mut chain = Self {
            stations,
            setup,
            members,
            queue,
            rng,
            outcome: Outcome {
                ending: Ending::OutOfTime,
                relays: Vec::new(),
                rounds: Vec::new(),
                sweeps: 0,
                messages: 0,
                bytes: 0,
                ended: Instant::ZERO,
                injected: Injected::default(),
                noticed: BTreeMap::new(),
                struck: Struck::default(),
                moments: Vec::new(),
                nearest: None,
                nearest_lent: None,
                margin_m: f64::INFINITY,
                margin_at: None,
                stray_targets: 0,
                fleet: Vec::new(),
                unsafe_setpoints: 0,
                air: AirCounts::default(),
                watched: None,
                stands: Vec::new(),
                film,
            },
            now: Instant::ZERO,
            happenings: 0,
            holding: 0,
            ahead,
            attacker: None,
            flight: None,
            fleet: Vec::new(),
            handed_over_m: Vec::new(),
            medium,
            bursts,
            agreed: None,
            agreements: 0,
            listened: false,
            watch: None,
            record,
        };
        if shared || chain.setup.soak.is_some() {
            chain.begin_watch(run);
        }
        if let Some(sky) = &chain.setup.sky {
            let first = Instant::ZERO + sky.period;
            chain.queue.put(first, 0, QueuedEvent::Listen);
        }
        chain.expect_an_attack();
        chain.take_off();
        for index in 0..chain.members.len() {
            chain.drain(index);
        }
        chain.look(Touched::All);
        Ok(chain)
    }
}

fn members(setup: &Setup, rng: &mut ChaCha8Rng) -> Result<Vec<Member>, SetupError> {
    let mut members = Vec::new();
    for index in 1..=setup.mission.relays() {
        let start = Start {
            index,
            number: 1,
            seed: rng.random(),
            now: Instant::ZERO,
        };
        let relay = switched_on(setup, start, None, None)?;
        members.push(Member {
            node: index,
            lines: [Line::default(); 2],
            killed: None,
            lent: false,
            starts: 1,
            swept: 0,
            stored: None,
            record: None,
            safe: None,
            been: None,
            measured: None,
            filmed: None,
            relay,
            wake: None,
        });
    }
    Ok(members)
}

/// Schedules the events of drones with autopilots and returns their number.
fn put_fleet(setup: &Setup, queue: &mut Queue) -> usize {
    let Some(fleet) = &setup.fleet else {
        return 0;
    };
    let mut put = |at, relay: u16, happening| {
        queue.put(at, usize::from(relay.saturating_sub(1)), happening);
    };
    for &(relay, at) in &fleet.restarts {
        put(at, relay, QueuedEvent::Restart);
    }
    // A pilot who keeps the drone lands it; its relay is switched off.
    let kept = fleet.takeovers.iter().filter(|it| it.until.is_none());
    for takeover in kept.clone() {
        put(
            takeover.from + LANDS_AFTER,
            takeover.relay,
            QueuedEvent::Kill,
        );
    }
    fleet.restarts.len() + kept.count()
}
