//! Reports to the ground station: number of relays with a mission, refusals, competing stations.

use chacha20::ChaCha8Rng;
use host_tests::ledger::number;
use host_tests::make;
use rand::{RngExt as _, SeedableRng as _};
use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};
use uav_relay::GuardConfig;
use uav_relay::ground::Progress;
use uav_relay::{Band, Event, FlownMission, LineError, Profile, Settings};

use super::wires::Wires;
use super::*;

const ENDS: [Side; 2] = [Side::Upstream, Side::Downstream];

fn count() -> u64 {
    number("COUNT", 200)
}

fn seed() -> u64 {
    number("SEED", 1)
}

/// Checks that the ground station reports completion once all relays fly the upload, and not before. This must hold
/// although frames are lost and two ground stations are active.
#[test]
fn the_ground_reports_flown_once_every_relay_flies_it() {
    let told: Vec<bool> = (0..count())
        .into_par_iter()
        .map(|round| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed() + round);
            let relays = rng.random_range(1..=12);
            let base = mission(relays);
            let mut wires = Wires::new(base, round, |_| Settings::default());
            assert!(wires.until(60, Wires::has_converged));
            let loss = [0.0, 0.1, 0.3][rng.random_range(0..3)];
            wires.lose(loss);
            let end = ENDS[rng.random_range(0..2)];
            let config = moved(&base, 700.0, -300.0);
            wires.upload(&base, end, Upload::new(&base, 1, config).unwrap());
            let mut was_partial = false;
            let done = wires.until(300, |it| {
                let flying = it.versions().iter().filter(|it| **it == 1).count();
                match it.progress(end) {
                    Progress::Flown { relays: told, .. } => {
                        assert_eq!(
                            flying,
                            usize::from(relays),
                            "round {round}: {:?}",
                            it.versions()
                        );
                        // Losses may have excluded a relay from the counted view.
                        assert!(told <= relays && told >= 1, "round {round}: {told}");
                        true
                    }
                    Progress::Adopted { .. } => {
                        was_partial = true;
                        false
                    }
                    Progress::Offering | Progress::Stored { .. } => false,
                    other => panic!("round {round}: {other:?}"),
                }
            });
            assert!(
                done,
                "round {round}: {:?}, {:?}",
                wires.progress(end),
                wires.versions()
            );
            if loss == 0.0 {
                let Progress::Flown { relays: told, .. } = wires.progress(end) else {
                    unreachable!()
                };
                assert_eq!(told, relays, "round {round}");
            }
            was_partial
        })
        .collect();
    let partial = told.iter().filter(|it| **it).count();
    println!(
        "{} uploads, {partial} of them told of while one relay flew them",
        told.len()
    );
    assert!(partial > 0, "the model has to see it");
}

fn guarded(base: &Mission) -> Settings {
    Settings {
        guard: Some(GuardConfig::of(base, base.config().common)),
        ..Settings::default()
    }
}

fn at(base: &Mission, altitude_m: f32) -> MissionConfig {
    let common = Profile {
        altitude_m,
        ..base.config().common
    };
    let band = base.config().band;
    let is_in = (band.least_m..=band.most_m).contains(&altitude_m);
    MissionConfig {
        common,
        band: if is_in { band } else { Band::at(altitude_m) },
        ..*base.config()
    }
}

/// Returns a mission with the common altitude 120 m, whose relays may choose altitudes within `band`.
fn at_120(relays: u16, band: Band) -> Mission {
    let config = *mission(relays).config();
    Mission::try_new(MissionConfig {
        common: Profile {
            altitude_m: 120.0,
            ..config.common
        },
        band,
        ..config
    })
    .unwrap()
}

/// Gives relays with a motion guard the positions of their drones, which they need.
fn report_positions(wires: &mut Wires, base: &Mission) {
    let distance = base.config().distance_m;
    let step = distance / f32::from(base.relays() + 1);
    wires.place_drones(|index| {
        uav_relay::Placement::on_line(step * f32::from(index), base.config().common.altitude_m)
    });
}

#[test]
fn an_upload_outside_the_geofence_is_refused_and_reported() {
    let wide = make::band(50.0, 150.0);
    let aside = |base: &Mission| MissionConfig {
        lateral: make::band(-20.0, 0.0),
        ..*base.config()
    };
    let longer = |base: &Mission| MissionConfig {
        distance_m: base.config().distance_m + 200.0,
        ..*base.config()
    };
    let narrow = at_120(3, Band::at(120.0));
    let broad = at_120(3, wide);
    for (base, config, why) in [
        (narrow, at(&narrow, 100.0), Some(LineError::Altitude)),
        (narrow, at(&narrow, 5_000.0), Some(LineError::Altitude)),
        (broad, at(&broad, 49.0), Some(LineError::Altitude)),
        (narrow, aside(&narrow), Some(LineError::Lateral)),
        (narrow, longer(&narrow), Some(LineError::Length)),
        (broad, at(&broad, 100.0), None),
        (broad, at(&broad, 50.0), None),
        (narrow, moved(&narrow, 700.0, -300.0), None),
    ] {
        for end in ENDS {
            let mut wires = Wires::new(base, 1, |_| guarded(&base));
            report_positions(&mut wires, &base);
            assert!(wires.until(60, Wires::has_converged));
            wires.upload(&base, end, Upload::new(&base, 5, config).unwrap());
            let over = |it: &Wires| {
                matches!(
                    it.progress(end),
                    Progress::Flown { .. } | Progress::Refused { .. }
                )
            };
            assert!(wires.until(20, over), "{:?}", wires.progress(end));
            let nearest = if end == Side::Upstream { 1 } else { 3 };
            if let Some(why) = why {
                assert_eq!(wires.progress(end), Progress::Refused { by: nearest });
                let refused = Event::UploadRefused { why };
                assert!(
                    wires.bench.has_raised(usize::from(nearest) - 1, refused),
                    "{why:?}"
                );
                wires.until(10, |_| false);
                assert_eq!(wires.versions(), [0; 3], "{config:?}");
                // A newer valid mission is flown after the refusal.
                let fits = moved(&base, 700.0, -300.0);
                wires.upload(&base, end, Upload::new(&base, 6, fits).unwrap());
                assert!(wires.until(20, over), "{:?}", wires.progress(end));
                assert_eq!(wires.versions(), [6; 3]);
            } else {
                assert_eq!(wires.versions(), [5; 3]);
                // The drones fly to the new positions.
                let there = |it: &Wires| {
                    (1..=3).all(|index| {
                        it.relay(index)
                            .setpoint()
                            .is_some_and(|place| place.altitude_m == config.common.altitude_m)
                    })
                };
                assert!(wires.until(60, there), "{:?}", wires.relay(1).setpoint());
            }
        }
    }
}

/// Checks that a relay with its own altitude refuses an upload as the other relays do.
///
/// The uploaded altitude is outside the permitted range of all relays. The geofence of this relay includes its own
/// altitude, and therefore the uploaded altitude as well. The relay must refuse the upload nevertheless.
#[test]
fn a_relay_with_its_own_altitude_refuses_like_the_others() {
    let base = at_120(3, Band::at(120.0));
    let own = Profile {
        altitude_m: 140.0,
        ..base.config().common
    };
    let settings = |index| {
        if index == 3 {
            Settings {
                profile: Some(own),
                guard: Some(GuardConfig::of(&base, own)),
                ..Settings::default()
            }
        } else {
            guarded(&base)
        }
    };
    for (end, nearest) in [(Side::Upstream, 1), (Side::Downstream, 3)] {
        let mut wires = Wires::new(base, 1, settings);
        wires.until(5, |_| false);
        wires.upload(&base, end, Upload::new(&base, 1, at(&base, 130.0)).unwrap());
        wires.until(10, |_| false);
        assert_eq!(wires.progress(end), Progress::Refused { by: nearest });
        assert_eq!(wires.versions(), [0; 3]);
    }
}

/// Checks that a refusal by any relay reaches the ground station, also if frames are lost.
///
/// One relay, at any place in the chain, refuses because only this relay has a geofence. A newer mission that fits the
/// geofence must clear the refusal.
#[test]
fn a_refusal_of_any_relay_reaches_the_ground() {
    (0..count()).into_par_iter().for_each(|round| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed() + round);
        let relays = rng.random_range(1..=10);
        let base = at_120(relays, Band::at(120.0));
        let far = rng.random_range(1..=relays);
        let settings = |index| {
            if index == far {
                guarded(&base)
            } else {
                Settings::default()
            }
        };
        let end = ENDS[rng.random_range(0..2)];
        let mut wires = Wires::new(base, round, settings);
        wires.until(rng.random_range(0..30), |_| false);
        let loss = [0.0, 0.1, 0.3][rng.random_range(0..3)];
        wires.lose(loss);
        let [refused_s, flown_s] = if loss > 0.0 { [120, 300] } else { [30, 60] };
        wires.upload(&base, end, Upload::new(&base, 1, at(&base, 100.0)).unwrap());
        let refused = |it: &Wires| matches!(it.progress(end), Progress::Refused { .. });
        let told = wires.until(refused_s, refused);
        assert!(
            told,
            "round {round}: {far} of {relays}, {:?}",
            wires.progress(end)
        );
        assert_eq!(wires.versions(), vec![0; relays.into()], "round {round}");
        let fits = moved(&base, 700.0, -300.0);
        wires.upload(&base, end, Upload::new(&base, 2, fits).unwrap());
        let flown = |it: &Wires| matches!(it.progress(end), Progress::Flown { .. });
        let told = wires.until(flown_s, flown);
        assert!(
            told,
            "round {round}: {far} of {relays}, {:?}",
            wires.progress(end)
        );
        assert_eq!(wires.versions(), vec![2; relays.into()], "round {round}");
    });
}

/// Checks that of two uploads by two ground stations, all relays use the newer upload in the end.
///
/// The ground station with the older upload must receive information about the newer upload.
#[test]
fn the_newer_upload_of_two_stations_is_flown() {
    let settled: Vec<u64> = (0..count())
        .into_par_iter()
        .map(|round| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed() + round);
            let relays = rng.random_range(1..=8);
            let base = mission(relays);
            let mut wires = Wires::new(base, round, |_| Settings::default());
            wires.until(rng.random_range(0..30), |_| false);
            let loss = [0.0, 0.1, 0.3][rng.random_range(0..3)];
            wires.lose(loss);
            let version: u16 = rng.random_range(1..=2);
            let versions = [1, version];
            let uploads: Vec<Upload> = versions
                .iter()
                .zip([600.0, 700.0])
                .map(|(version, x_m)| {
                    Upload::new(&base, *version, moved(&base, x_m, -300.0)).unwrap()
                })
                .collect();
            let first = rng.random_range(0..2);
            wires.upload(&base, ENDS[first], uploads[first]);
            for _ in 0..rng.random_range(0..200) {
                wires.turn();
            }
            wires.upload(&base, ENDS[1 - first], uploads[1 - first]);
            let newer = usize::from(uploads[1].id() > uploads[0].id());
            let begun = wires.bench.now;
            let over = |it: &Wires| {
                let is_flown = |at: usize| matches!(it.progress(ENDS[at]), Progress::Flown { .. });
                let is_over = |at: usize| {
                    is_flown(at) || matches!(it.progress(ENDS[at]), Progress::Outdated { .. })
                };
                (is_flown(newer) || is_flown(1 - newer)) && is_over(newer) && is_over(1 - newer)
            };
            assert!(
                wires.until(300, over),
                "round {round}: {:?}, {:?}",
                ENDS.map(|end| wires.progress(end)),
                wires.versions()
            );
            // Of two missions with one version the first one that a relay has stored may remain.
            let is_late = matches!(wires.progress(ENDS[newer]), Progress::Outdated { .. });
            assert!(!is_late || versions[0] == versions[1], "round {round}");
            let flown = if is_late { 1 - newer } else { newer };
            assert_eq!(
                wires.versions(),
                vec![versions[flown]; relays.into()],
                "round {round}"
            );
            let flown = *uploads[flown].config();
            assert!((1..=usize::from(relays)).all(|index| {
                let mission = wires.relay(index).mission().config();
                mission.interference == flown.interference
            }));
            wires.bench.now.since(begun).as_micros() / 1_000
        })
        .collect();
    let worst = settled.iter().max().unwrap();
    println!(
        "{} pairs of uploads, all flown; the slowest after {worst} ms",
        settled.len()
    );
}

/// Checks that a ground station at either end learns which mission the relays use. This must hold although frames are
/// lost and missions are uploaded.
#[test]
fn the_ground_learns_which_mission_is_flown() {
    for round in 0..40 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed() + round);
        let relays = rng.random_range(1..=6);
        let base = mission(relays);
        let mut wires = Wires::new(base, round, |_| Settings::default());
        let loss = [0.0, 0.3][rng.random_range(0..2)];
        wires.lose(loss);
        let end = ENDS[rng.random_range(0..2)];
        wires.request_flown(&base, end);
        let known = |it: &Wires| it.flown(end).filter(FlownMission::is_known);
        assert!(wires.until(60, |it| known(it).is_some()), "round {round}");
        let near = if end == Side::Upstream { 1 } else { relays };
        let flown = known(&wires).unwrap();
        assert_eq!((flown.by, flown.version, flown.upload), (near, 0, None));
        // Another ground station uploads from the other end.
        let sent = Upload::new(&base, 4, moved(&base, 700.0, -300.0)).unwrap();
        wires.upload(&base, ENDS[1 - end as usize], sent);
        assert!(wires.until(300, |it| it.versions().iter().all(|it| *it == 4)));
        wires.request_flown(&base, end);
        assert!(wires.until(60, |it| known(it).is_some()), "round {round}");
        let flown = known(&wires).unwrap();
        assert_eq!((flown.by, flown.version), (near, 4));
        assert_eq!(flown.upload, Some(sent), "round {round}");
        assert!(flown.flies || loss > 0.0, "round {round}");
        // The first ground station continues with the next version.
        let next = Upload::new(&base, 5, moved(&base, 200.0, 100.0)).unwrap();
        wires.upload(&base, end, next);
        assert!(wires.until(300, |it| {
            matches!(it.progress(end), Progress::Flown { .. })
        }));
    }
}
