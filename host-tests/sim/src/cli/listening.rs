//! Options for relays that measure the interference instead of knowing it.

use crate::command::{Failure, number, whole};
use crate::simulator::setup::Setup;
use crate::simulator::true_interference::TrueInterference;
use clap::Args;
use uav_relay::{Instant, Interference, Interferer, Listen, Mission, MissionConfig};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;

use super::given::given;

/// Command-line options for measurements.
#[derive(Args, Debug)]
#[command(next_help_heading = "Listening")]
pub struct Listening {
    /// Hide the interferers from the relays. Each measures the interference at its position once a second, and together they
    /// estimate an equivalent interferer. The scenario's listening parameters apply, if any
    #[arg(long)]
    listen: bool,
    /// Independent samples per measurement, 1 to 1000000; default 1000
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = whole(1_u32, 1_000_000))]
    samples: Option<u32>,
    /// Standard deviation of the shadowing at a position, dB, 0 to 20; default 0
    #[arg(long, value_name = "DB", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.0, 20.0))]
    shadow: Option<f64>,
    /// Velocity of all interferers, m/s along the line and to its right, each -100 to 100
    #[arg(long, value_name = "VX,VY", allow_hyphen_values = true, value_parser = velocity)]
    move_interferer: Option<[f64; 2]>,
    /// Virtual duration of the measurements, s, 10 to 1e5; default 120
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = |text: &str| number(text, 10.0, 1e5))]
    listen_for: Option<f64>,
}

impl Listening {
    /// Rejects measurement options without `--listen`.
    pub fn agree(&self) -> Result<(), Failure> {
        let velocity = self
            .move_interferer
            .map(|[along, aside]| format!("{along},{aside}"));
        let told = [
            given("--samples", self.samples),
            given("--shadow", self.shadow),
            given("--move-interferer", velocity),
            given("--listen-for", self.listen_for),
        ];
        match told.into_iter().flatten().next() {
            Some(option) if !self.listen => Err(Failure::input(format!(
                "{option}: would be ignored without --listen"
            ))),
            _ => Ok(()),
        }
    }

    /// Changes the setup so that the relays have to find the interferers of `scenario`.
    pub fn prepare(
        &self,
        setup: &mut Setup,
        scenario: &Scenario,
        uavs: u16,
    ) -> Result<(), Failure> {
        if !self.listen {
            return Ok(());
        }
        if setup.soak.is_some() || !setup.uploads.is_empty() || setup.attack.is_some() {
            let line = "--listen goes with neither --soak nor --upload nor an attacker";
            return Err(Failure::input(line.to_owned()));
        }
        let Some(scene) = Scene::new(scenario, uavs) else {
            let line = "--listen needs an [[interferer]], and the scenario has a [field]";
            return Err(Failure::input(line.to_owned()));
        };
        let unknown = Mission::try_new(MissionConfig {
            interference: Interference::Unknown,
            ..*setup.mission.config()
        });
        setup.mission = unknown.map_err(|error| Failure::input(error.to_string()))?;
        let mut listen = match (scenario.listen, self.move_interferer) {
            (Some(spec), _) => spec.of(uavs),
            (None, Some(_)) => Listen::following(uavs),
            (None, None) => Listen::default(),
        };
        let samples = self.samples.unwrap_or(1_000);
        #[expect(clippy::cast_possible_truncation, reason = "of 1e-3 to 1")]
        let error = (1.0 / f64::from(samples).sqrt()).max(1e-3) as f32;
        let said = scenario.listen.and_then(|spec| spec.relative_error);
        if said.is_none() {
            listen.relative_error = error;
        }
        setup.settings.listen = Some(listen);
        let mut sky = TrueInterference::of(scene);
        sky.samples = samples;
        sky.shadow_db = self.shadow.unwrap_or_default();
        sky.velocity_mps = self.move_interferer.unwrap_or_default();
        sky.seed = setup.seed;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "10 to 1e5"
        )]
        let until = (self.listen_for.unwrap_or(120.0) * 1e3) as u64;
        sky.until = Instant::from_millis(until);
        setup.sky = Some(sky);
        Ok(())
    }

    /// Returns `mission` with the interferer's position at `then`.
    pub fn moved(&self, mission: Mission, then: Instant) -> Mission {
        let (Some([along, aside]), Some(source)) = (self.move_interferer, mission.known_source())
        else {
            return mission;
        };
        let seconds = then.as_micros() as f64 * 1e-6;
        let there = Interferer {
            x_m: narrow(f64::from(source.x_m) + along * seconds),
            y_m: narrow(f64::from(source.y_m) + aside * seconds),
            ..source
        };
        Mission::try_new(MissionConfig {
            interference: Interference::Source(there),
            ..*mission.config()
        })
        .unwrap_or(mission)
    }
}

fn velocity(text: &str) -> Result<[f64; 2], String> {
    let form = "must be VX,VY, m/s along the line and to its right, each -100 to 100";
    let (along, aside) = text.split_once(',').ok_or(form)?;
    Ok([number(along, -100.0, 100.0)?, number(aside, -100.0, 100.0)?])
}
