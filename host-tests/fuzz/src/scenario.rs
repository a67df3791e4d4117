//! Fuzz target for scenario files: any text gives a scenario in its ranges, or a one-line error.

use uav_relay::Mission;

use uav_relay_scenario::mission;
use uav_relay_scenario::{AirGround, Field, Interference, Scenario};

const RELAYS: [u16; 4] = [1, 3, 8, 1000];

/// Fuzz target. Reads `data` as the text of a scenario file; ignores any text that is not UTF-8.
///
/// # Panics
/// If an error text has several lines, a number of the scenario is out of range, or a mission has a number that is not
/// finite.
pub fn scenario(data: &[u8]) {
    let Ok(text) = core::str::from_utf8(data) else {
        return;
    };
    match Scenario::parse("fuzz.toml", text) {
        Err(error) => is_one_line(&error.to_string()),
        Ok(scenario) => {
            look_at(&scenario);
            for relays in RELAYS {
                match mission::mission(&scenario, relays, 1e-4) {
                    Err(refusal) => is_one_line(&refusal.to_string()),
                    Ok((mission, profiles)) => {
                        assert!(profiles.iter().all(|(_, profile)| profile.is_valid()));
                        look_at_mission(&mission);
                    }
                }
                assert!(mission::fixed_altitude_relays(&scenario, relays).is_sorted());
            }
        }
    }
}

fn is_one_line(text: &str) {
    assert!(!text.is_empty());
    let ends = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    assert!(!text.contains(ends), "{text:?}");
}

fn within(value: f64, low: f64, high: f64) {
    assert!((low..=high).contains(&value), "{value} in {low} to {high}");
}

fn look_at(scenario: &Scenario) {
    within(scenario.distance_m, 1.0, 1e6);
    within(scenario.altitude_m, 0.1, 1e5);
    within(scenario.altitude_min_m, 0.1, scenario.altitude_m);
    within(scenario.altitude_max_m, scenario.altitude_m, 1e5);
    within(scenario.lateral_min_m, -1e5, 0.0);
    within(scenario.lateral_max_m, 0.0, 1e5);
    within(scenario.min_separation_m, 0.0, 1e5);
    within(scenario.tx_w, 1e-6, 1e6);
    within(scenario.uav_w, 1e-6, 1e6);
    let channel = &scenario.channel;
    within(channel.carrier_hz, 1e6, 1e12);
    within(channel.excess_loss_los_db, 0.0, 200.0);
    within(
        channel.excess_loss_nlos_db,
        channel.excess_loss_los_db,
        200.0,
    );
    if let AirGround::Weight(weight) = channel.air_ground {
        within(weight, 0.0, 1.0);
    }
    match &scenario.interference {
        Interference::Sources(sources) => {
            assert!(!sources.is_empty() || scenario.listen.is_some());
            for source in sources {
                within(source.power_w, 1e-6, 1e9);
                within(source.x_m, -1e7, 1e7);
                within(source.y_m, -1e7, 1e7);
            }
        }
        Interference::Field(field) => look_at_field(field),
    }
    for (&index, own) in &scenario.relays {
        within(f64::from(index), 1.0, 1000.0);
        assert!(own.altitude_m.is_some() || own.power_w.is_some());
        own.altitude_m.into_iter().for_each(|m| within(m, 0.1, 1e5));
        own.power_w.into_iter().for_each(|w| within(w, 1e-6, 1e6));
    }
}

fn look_at_field(field: &Field) {
    within(field.i_max_w, 1e-30, 1e6);
    assert!(!field.beta.is_empty());
    assert!(field.beta.is_sorted_by(|one, next| one.x_m < next.x_m));
    for point in &field.beta {
        within(point.x_m, -1e7, 1e7);
        within(point.alpha, 1.0_f64.next_up(), 1e6);
        within(point.beta, 0.0_f64.next_up(), 1e6);
    }
}

/// Checks that all numbers of a mission are finite.
fn look_at_mission(mission: &Mission) {
    let config = mission.config();
    let numbers = [
        config.distance_m,
        config.min_separation_m,
        config.tx_power_w,
        config.common.altitude_m,
        config.common.power_w,
        config.band.least_m,
        config.band.most_m,
        config.lateral.least_m,
        config.lateral.most_m,
        config.tolerance,
    ];
    assert!(
        numbers.iter().all(|number| number.is_finite()),
        "{config:?}"
    );
    let gains = [
        mission.tx_gain().value(),
        mission.relay_gain(config.common.power_w).value(),
        mission.receiver_gain(config.common.power_w),
    ];
    assert!(
        gains.iter().all(|gain| !gain.is_nan()),
        "{config:?} {gains:?}"
    );
}
