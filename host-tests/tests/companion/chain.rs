//! Relays of one chain as processes, on wires or on one channel, with a folder for their files.

use uav_relay::Method;
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::simulator::chain;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

use crate::files::Files;
use crate::medium::{Medium, Noise, QUIET};
use crate::process::Relay;

/// Options of relays that notice the loss of a neighbour within seconds.
pub(crate) const QUICK: &str = "--probe-after-ms 500 --dead-after-ms 1500";

/// Agreed position and target SIR of a relay: x, y, altitude and target as f32 bits.
pub(crate) type Place = [u32; 4];

/// Returns all agreed positions of a simulated chain, for a comparison with those of relay processes.
pub(crate) fn simulated(scenario: &Scenario, relays: u16) -> Vec<Place> {
    simulated_by(Method::Align, scenario, relays)
}

pub(crate) fn simulated_by(method: Method, scenario: &Scenario, relays: u16) -> Vec<Place> {
    let (mission, _) = mission::mission(scenario, relays, 1e-4).unwrap();
    let mut setup = Setup::new(mission);
    setup.settings.method = method;
    simulated_with(setup)
}

pub(crate) fn simulated_with(setup: Setup) -> Vec<Place> {
    let outcome = chain::run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    let ends = outcome.relays.iter().map(|relay| {
        let at = relay.setpoint.unwrap();
        [at.x_m, at.y_m, at.altitude_m, relay.target.unwrap()].map(f32::to_bits)
    });
    ends.collect()
}

/// Chain of relay processes under test, with the media between them.
pub(crate) struct Chain {
    /// Serial wires between the relays, or one shared channel.
    pub(crate) media: Vec<Medium>,
    is_shared: bool,
    /// Serial wire between relay 1 (tty 1) and the ground station at the transmitter (tty 0). `None` in a chain
    /// without a ground station.
    pub(crate) tx: Option<Medium>,
    pub(crate) of: usize,
    pub(crate) files: Files,
    /// Command-line options of all relays.
    options: String,
    pub(crate) relays: Vec<Relay>,
}

impl Chain {
    /// Creates a chain on serial wires with the given noise. No relay is started yet.
    pub(crate) fn on_wires(of: usize, noise: Noise) -> Self {
        let wire = |index: usize| Noise {
            seed: noise.seed * 100 + u64::try_from(index).unwrap(),
            ..noise
        };
        let media = (1..of).map(|index| Medium::new(2, wire(index))).collect();
        Self::on(media, of, None)
    }

    /// Creates a chain on serial wires, with one more wire to the ground station at Tx. No relay is started yet.
    pub(crate) fn with_ground(of: usize, noise: Noise) -> Self {
        Self {
            tx: Some(Medium::new(2, noise)),
            ..Self::on_wires(of, noise)
        }
    }

    /// Creates a chain on the shared channel `channel`. No relay is started yet.
    ///
    /// The first `of` ttys of the channel are for the relays.
    pub(crate) fn on_channel(of: usize, channel: Medium) -> Self {
        Self {
            is_shared: true,
            ..Self::on(vec![channel], of, None)
        }
    }

    fn on(media: Vec<Medium>, of: usize, tx: Option<Medium>) -> Self {
        Self {
            media,
            is_shared: false,
            tx,
            of,
            files: Files::new(),
            options: String::new(),
            relays: Vec::new(),
        }
    }

    /// Sets the options of all relays that are started later.
    pub(crate) fn with(mut self, options: &str) -> Self {
        self.options = options.into();
        self
    }

    /// Starts a chain of relays on serial wires without noise.
    pub(crate) fn start(of: usize, options: &str) -> Self {
        Self::on_wires(of, QUIET).started(options)
    }

    /// Starts all relays with the given options.
    pub(crate) fn started(self, options: &str) -> Self {
        let mut chain = self.with(options);
        chain.relays = (1..=chain.of).map(|index| chain.relay(index, "")).collect();
        chain
    }

    /// Starts relay `index` with the common options of all relays and the additional options `own`.
    pub(crate) fn relay(&self, index: usize, own: &str) -> Relay {
        Relay::start(&self.arguments(index, own))
    }

    pub(crate) fn arguments(&self, index: usize, own: &str) -> String {
        let wire = |at: usize| self.media.get(at).filter(|_| !self.is_shared);
        let upstream = match index {
            1 => self.tx.as_ref(),
            _ => wire(index - 2),
        };
        let ports = [
            (upstream, "--upstream", 1),
            (wire(index - 1), "--downstream", 0),
            (
                self.media.first().filter(|_| self.is_shared),
                "--shared",
                index - 1,
            ),
        ];
        let ports = ports.iter().filter_map(|(wire, option, tty)| {
            Some(format!("{option} {}", wire.as_ref()?.tty(*tty)))
        });
        let ports = ports.collect::<Vec<_>>().join(" ");
        let (of, options) = (self.of, &self.options);
        format!("--index {index} --of {of} {ports} {options} {own}")
    }

    /// Waits for the first agreement of the chain. Returns the position and target of each relay.
    pub(crate) fn settled(&mut self) -> Vec<Place> {
        self.relays.iter_mut().map(Relay::settled).collect()
    }

    /// Waits until the relays have agreed on exactly `places`. Other agreements may come first.
    pub(crate) fn settles_at(&mut self, places: &[Place]) {
        assert!(places.len() >= self.relays.len());
        for (relay, place) in self.relays.iter_mut().zip(places) {
            relay.settles_at(*place);
        }
    }

    /// Waits until every relay has logged a line that contains `part`. Returns these lines.
    pub(crate) fn lines(&mut self, part: &str) -> Vec<String> {
        self.relays
            .iter_mut()
            .map(|relay| relay.line(part))
            .collect()
    }
}
