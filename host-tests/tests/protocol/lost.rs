//! Lost and returning neighbours, and rejected settings.

use host_tests::fixtures::mission;
use host_tests::make;
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::Message;
use uav_relay::{Duration, Event, Identity, Instant, Port, Relay, Settings, Side};

use super::*;

#[test]
fn a_lost_neighbour_that_comes_back_is_reported_once_each_way() {
    let beat = |ask, answer| {
        let mission = digest(&mission(2));
        let beat = Message::Heartbeat {
            mission,
            request: ask,
            reply: answer,
        };
        encode(1, 2, &beat)
    };
    // A relay that has taken part in a pass does not request a view.
    let mut tail = relay(mission(2), 2);
    let (start, sweep) = first_sweep(&mut relay(mission(2), 1));
    tail.handle_bytes(start, Port::Upstream, &sweep);
    drain(&mut tail, start);
    events(&mut tail);
    // Times of the heartbeat requests.
    let mut asked = Vec::new();
    let mut now = start;
    let mut seen = Vec::new();
    while now.since(start) < Duration::from_millis(60_000) {
        now = tail.poll_timeout().unwrap();
        tail.handle_timeout(now);
        let sent = drain(&mut tail, now);
        for (_, message, _) in &sent {
            if let Message::Claim(_) = message {
                continue;
            }
            let Message::Heartbeat {
                request: ask,
                reply: 0,
                ..
            } = message
            else {
                panic!("{message:?}");
            };
            asked.push(now);
            assert_eq!(usize::from(*ask), asked.len());
        }
        seen.extend(
            events(&mut tail)
                .into_iter()
                .map(|event| (now.since(Instant::ZERO).as_micros() / 1_000, event)),
        );
    }
    let [
        (
            lost_ms,
            Event::NeighbourLost {
                side: Side::Upstream,
                node: 1,
            },
        ),
    ] = seen[..]
    else {
        panic!("{seen:?}");
    };
    // The first request after `dead_after` reports the loss. Requests are 10 s / 64 apart, or up to an eighth more.
    assert!(
        (15_000..=15_000 + 157 * 9 / 8).contains(&lost_ms),
        "{lost_ms}"
    );
    let count = asked.len();
    // There are up to 64 requests in the ten seconds before the loss, then one every five seconds.
    assert!((60..=75).contains(&count), "{count} heartbeats in a minute");
    // Only a reply to one of the last four requests is a sign of life.
    let last = u16::try_from(count).unwrap();
    for (ask, answer) in [(9, 0), (0, last - 4), (0, 1), (0, last + 1), (0, u16::MAX)] {
        tail.handle_bytes(now, Port::Upstream, &beat(ask, answer));
        assert_eq!(events(&mut tail), [], "{ask} {answer}");
        drain(&mut tail, now);
    }
    // A reply counts from the time of its request.
    for before in 0..4_u16 {
        let mut after = tail.clone();
        let late = now + Duration::from_millis(100);
        after.handle_bytes(late, Port::Upstream, &beat(0, last - before));
        assert_eq!(
            events(&mut after),
            [Event::NeighbourBack {
                side: Side::Upstream,
                node: 1
            }],
            "{before}"
        );
        let heard = asked[count - 1 - usize::from(before)];
        let mut lost = late;
        while events(&mut after)
            != [Event::NeighbourLost {
                side: Side::Upstream,
                node: 1,
            }]
        {
            lost = after.poll_timeout().unwrap();
            after.handle_timeout(lost);
            drain(&mut after, lost);
        }
        // The neighbour is lost after `dead_after` at the earliest, and after 8 times `dead_after` at the latest.
        let due = heard + Duration::from_millis(15_000);
        let longest = heard + Duration::from_millis(8 * 15_000);
        let latest = longest + Duration::from_millis(157 * 9 / 8);
        assert!(
            due <= lost && lost <= latest,
            "{before}: {:?}",
            (heard, lost)
        );
    }
}

/// Function that makes relay settings invalid.
type Change = fn(&mut Settings);

#[test]
fn settings_are_checked() {
    use uav_relay::SetupError;
    use uav_relay::{Profile, Schedule};
    const UNKNOWN: Profile = make::profile(f32::NAN, 1.0);
    let with = |index, change: fn(&mut Settings)| {
        let mut settings = Settings::default();
        change(&mut settings);
        Relay::new(
            mission(3),
            Identity { network: 1, index },
            settings,
            1,
            Instant::ZERO,
        )
        .map(|_| ())
    };
    let wrong: [(u16, Change, SetupError); 7] = [
        (0, |_| (), SetupError::Index),
        (4, |_| (), SetupError::Index),
        (1, |s| s.profile = Some(UNKNOWN), SetupError::Profile),
        (
            1,
            |s| s.schedule = Schedule::FixedStep { step: 0.0 },
            SetupError::Step,
        ),
        (
            1,
            |s| s.schedule = Schedule::FixedStep { step: f64::NAN },
            SetupError::Step,
        ),
        (
            1,
            |s| s.hop_time = Duration::from_micros(0),
            SetupError::HopTime,
        ),
        (1, |s| s.dead_after = s.probe_after, SetupError::Silence),
    ];
    assert_eq!(with(1, |_| ()), Ok(()));
    for (index, change, error) in wrong {
        assert_eq!(with(index, change), Err(error));
    }
}
