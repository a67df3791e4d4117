//! SIR of every hop by the mission's model, for relays at given positions.

use uav_relay::place::Station;
use uav_relay::sir::{Sender, at_receiver, at_transmitter};
use uav_relay::{Mission, Placement, Profile};

/// Converts a linear power ratio to dB.
pub fn db(linear: f64) -> f64 {
    // `libm` gives the same result on every machine, and in a browser.
    10.0 * libm::log10(linear)
}

/// Returns the linear SIR of every hop from Tx to Rx, for relays at `places`, relay 1 first.
///
/// Relays use the same formulas on board. The largest possible SIR is the largest f32, even if two positions nearly
/// coincide.
pub fn hop_sirs(mission: &Mission, places: &[(Placement, Profile)]) -> Vec<f64> {
    let mut sender = Sender::transmitter(mission);
    let mut from_m = 0.0;
    let mut sirs = Vec::with_capacity(places.len() + 1);
    for (place, profile) in places {
        sirs.push(f64::from(
            sender.sir_at(mission, from_m, *place).min(f32::MAX),
        ));
        let relay = Station {
            cross_section: place.cross_section(),
            power_w: profile.power_w,
        };
        sender = Sender::relay(mission, relay);
        from_m = place.x_m;
    }
    if let Some((place, profile)) = places.last() {
        sirs.push(f64::from(at_receiver(mission, *place, profile.power_w)));
    }
    sirs
}

/// Returns the linear SIR of every hop from Rx to Tx. Entry k - 1 is received by node k - 1; node 0 is Tx.
///
/// The formulas and the largest possible SIR are those of [`hop_sirs`]. The list is empty if the interferer is unknown.
/// For a random field it is empty unless the mission requires an SIR from Rx to Tx.
pub fn hop_sirs_back(mission: &Mission, places: &[(Placement, Profile)]) -> Vec<f64> {
    let is_known = mission.known_source().is_some();
    let is_both_ways = mission.config().reverse > 0.0 && mission.field().is_some();
    let Some((first, profile)) = places.first().filter(|_| is_known || is_both_ways) else {
        return Vec::new();
    };
    let limited = |sir: f32| f64::from(sir.min(f32::MAX));
    let mut sirs = vec![limited(at_transmitter(mission, *first, profile.power_w))];
    let senders = places.iter().skip(1).map(|(place, profile)| {
        let relay = Station {
            cross_section: place.cross_section(),
            power_w: profile.power_w,
        };
        (Sender::relay(mission, relay), place.x_m)
    });
    let rx = (Sender::receiver(mission), mission.config().distance_m);
    let hops = places.iter().zip(senders.chain([rx]));
    sirs.extend(hops.map(|((to, _), (sender, x_m))| limited(sender.sir_at(mission, x_m, *to))));
    sirs
}
