//! Fitted slots in uploads: refusals, and slot shares that end with their agreement.

use uav_relay::ground::Progress;
use uav_relay::{Event, LineError, Listen, Method, Phase, Relay, Settings, UploadError, Wiring};

use super::wires::Wires;
use super::*;

const ENDS: [Side; 2] = [Side::Upstream, Side::Downstream];

/// Returns `base` with fitted slots: time slots as long as each hop needs.
fn fitted(base: &Mission) -> MissionConfig {
    MissionConfig {
        fitted_gap: 2.0,
        ..*base.config()
    }
}

/// Returns the settings of a relay with the joint method, which a mission with fitted slots needs. Fitted slots are
/// time slots that are as long as each hop needs.
fn joint() -> Settings {
    Settings {
        method: Method::Joint,
        ..Settings::default()
    }
}

fn shares(wires: &Wires) -> Vec<bool> {
    let relays = wires.bench.relays.iter();
    relays.map(|relay| relay.slot_shares().is_some()).collect()
}

/// Checks that relays refuse fitted slots that their settings or the interference do not allow.
///
/// Fitted slots are time slots that are as long as each hop needs. The refusal is counted and reported like the refusal
/// of a mission outside the geofence. A newer mission is then flown.
#[test]
fn fitted_slots_against_the_settings_are_refused() {
    let base = mission(3);
    let listening = Settings {
        listen: Some(Listen::default()),
        ..joint()
    };
    let unknown = MissionConfig {
        interference: Interference::Unknown,
        ..fitted(&base)
    };
    for (settings, config) in [
        (Settings::default(), fitted(&base)),
        (listening, fitted(&base)),
        (joint(), unknown),
    ] {
        for (end, nearest) in ENDS.into_iter().zip([1, 3]) {
            let mut wires = Wires::new(base, 1, |_| settings);
            assert!(wires.until(60, Wires::has_converged));
            let upload = Upload::new(&base, 5, config).unwrap();
            wires.upload(&base, end, upload);
            let is_refused = |it: &Wires| it.progress(end) == Progress::Refused { by: nearest };
            assert!(wires.until(20, is_refused), "{:?}", wires.progress(end));
            let at = usize::from(nearest) - 1;
            let why = LineError::Slots;
            assert!(wires.bench.has_raised(at, Event::UploadRefused { why }));
            assert_eq!(wires.versions(), [0; 3]);
            let now = wires.bench.now;
            let relay = &mut wires.bench.relays[at];
            assert!(relay.stats().mission > 0);
            let by_hand = Err(UploadError::Line(why));
            assert_eq!(relay.handle_upload(now, &upload), by_hand);
            let equal = Upload::new(&base, 6, moved(&base, 700.0, -300.0)).unwrap();
            wires.upload(&base, end, equal);
            assert!(wires.until(20, |it| it.versions() == [6; 3]));
        }
    }
    assert!(LineError::Slots.to_string().contains("fitted"));
}

/// Checks that no relay has slot shares of the previous mission once it flies an upload.
///
/// Slot shares are the start and end of a relay's time slots, as fractions of the frame.
#[test]
fn shares_end_with_their_mission() {
    let equal = mission(4);
    let base = Mission::try_new(fitted(&equal)).unwrap();
    for config in [
        *equal.config(),
        fitted(&Mission::try_new(moved(&equal, 700.0, -300.0)).unwrap()),
    ] {
        let mut wires = Wires::new(base, 1, |_| joint());
        assert!(wires.until(60, |it| shares(it) == [true; 4]));
        wires.upload(
            &base,
            Side::Upstream,
            Upload::new(&base, 1, config).unwrap(),
        );
        let mut was_without = [false; 4];
        let is_over = wires.until(60, |it| {
            for (at, without) in was_without.iter_mut().enumerate() {
                let relay = it.relay(at + 1);
                assert!(relay.version() == 1 || relay.slot_shares().is_some());
                *without |= relay.version() == 1 && relay.slot_shares().is_none();
            }
            let settled = |relay: &Relay| relay.lease().is_some();
            it.versions() == [1; 4] && it.bench.relays.iter().all(settled)
        });
        assert!(is_over && was_without == [true; 4]);
        assert_eq!(shares(&wires), [config.fitted_gap > 0.0; 4]);
    }
}

/// Checks that relays without a lease or without a quorum have no slot shares until the next agreement.
///
/// Slot shares are the start and end of a relay's time slots. On a shared channel relays 3 to 5 have a quorum, and the
/// shares of their view. On wires these relays cannot close the gap that relays 1 and 2 leave.
#[test]
fn shares_end_without_a_quorum() {
    let base = Mission::try_new(fitted(&mission(5))).unwrap();
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut wires = Wires::new(base, 1, |_| Settings { wiring, ..joint() });
        let is_whole = |it: &Wires| {
            let is_held = |relay: &Relay| relay.lease().is_some() && relay.slot_shares().is_some();
            it.bench.relays.iter().all(is_held)
        };
        assert!(wires.until(100, is_whole));
        // Relays 1 and 2 no longer reach the others.
        wires.bench.fate = Box::new(|frame| (frame.from <= 2) == (frame.to <= 2));
        let mut refused = [false; 5];
        wires.until(200, |it| {
            for index in 1..=5 {
                let relay = it.relay(index);
                refused[index - 1] |= relay.phase() == Phase::NoQuorum;
                let lapsed = it.bench.has_raised(index - 1, Event::LeaseLapsed);
                let has_none =
                    relay.phase() == Phase::NoQuorum || (lapsed && relay.lease().is_none());
                assert!(!has_none || index > 2 || relay.slot_shares().is_none());
            }
            false
        });
        let is_shared = wiring == Wiring::Shared;
        assert!(refused[0] || !is_shared, "{wiring:?} {refused:?}");
        let kept = [false, false, is_shared, is_shared, is_shared];
        assert_eq!(shares(&wires), kept, "{wiring:?} {refused:?}");
        wires.bench.fate = Box::new(|_| true);
        assert!(wires.until(200, is_whole), "{wiring:?}");
    }
}
