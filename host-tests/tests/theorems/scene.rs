//! Single relay and interferer, with SIRs that share no formula with the crate.

use host_tests::make;
use rand::{Rng, RngExt};
use uav_relay::{Mission, MissionConfig};
use uav_relay_oracle::cases::Case;
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, log_uniform};
use uav_relay_oracle::reference::Link;
use uav_relay_tools::single::Found;

/// Scene with a single relay: the reference chain, rounded to f32, and the range of altitudes.
pub(crate) struct Scene {
    pub(crate) link: Link,
    pub(crate) band: (f64, f64),
    pub(crate) mission: Mission,
}

impl Scene {
    pub(crate) fn new(link: &Link, band: (f64, f64)) -> Self {
        let mut link = as_relays_know_it(link);
        let round = |value: f64| f64::from(value as f32);
        let band = (round(band.0), round(band.1));
        link.relays[0].altitude_m = band.0;
        let (mission, _) = of_link(&link, 1e-4).unwrap();
        let config = MissionConfig {
            band: make::band(band.0 as f32, band.1 as f32),
            ..*mission.config()
        };
        Self {
            link,
            band,
            mission: Mission::try_new(config).unwrap(),
        }
    }

    /// Draws a scene with Tx and Rx 10 m to 100 km apart and the interferer anywhere. The lowest altitude is 0.002 to
    /// 0.5 of that distance.
    pub(crate) fn random(rng: &mut impl Rng) -> Self {
        let style = make::style(1..=1, Chain::Alike);
        let link = random::link(rng, &style);
        let low = link.relays[0].altitude_m;
        let high = if rng.random_bool(0.1) {
            low
        } else {
            (low * log_uniform(rng, 1.0, 30.0)).min(1e5)
        };
        Self::new(&link, (low, high))
    }

    /// Draws a scene with receiver noise, from almost none to far above the interference.
    pub(crate) fn noisy(rng: &mut impl Rng) -> Self {
        let scene = Self::random(rng);
        let link = random::in_noise(rng, &scene.link);
        Self::new(&link, scene.band)
    }

    pub(crate) fn of(case: &Case) -> Self {
        Self::new(&case.link(1), (case.params.h_min, case.params.h_max))
    }

    /// Returns the smaller SIR of the two hops of a relay at x and altitude `h`, in f64.
    pub(crate) fn sir(&mut self, x: f64, h: f64) -> f64 {
        self.link.relays[0].altitude_m = h;
        let first = self.link.sir_relay(1, 0.0, x).unwrap();
        first.min(self.link.sir_rx(x).unwrap())
    }

    pub(crate) fn sir_of(&mut self, found: &Found) -> f64 {
        let place = found.place;
        self.sir(f64::from(place.x_m), f64::from(place.altitude_m))
    }

    pub(crate) fn profile(&self, altitude_m: f64) -> uav_relay::Profile {
        uav_relay::Profile {
            altitude_m: altitude_m as f32,
            ..self.mission.config().common
        }
    }
}
