//! Collisions of frames.

use super::*;
use uav_relay_sim::simulator::medium::{HEADER, QUEUE, TURNAROUND};

#[test]
fn a_frame_takes_its_bytes_its_header_and_the_turnaround() {
    let mut bench = Bench::in_one_range(Access::Aloha, 2, 1);
    bench.offer(at(500), 0, &[7; 100]);
    bench.go_on(seconds(9));
    let (over, sent) = &bench.sent[0];
    let took = micros(TURNAROUND as u64) + micros(HEADER as u64 + 100);
    assert_eq!(over.as_micros(), 500 + took);
    assert_eq!(
        (sent.frame.as_slice(), &sent.heard_by),
        (&[7; 100][..], &vec![1])
    );
    assert_eq!(bench.medium.counts().air_time_us, micros(106));
}

#[test]
fn overlapping_frames_are_lost_where_both_are_received() {
    // Nodes 0 and 1 do not receive each other: 2 receives both, 3 only 0, 4 only 1.
    let hearers = vec![vec![2, 3], vec![2, 4], vec![], vec![], vec![]];
    for later in [0, 10, micros(50), micros(106) - 1] {
        let mut bench = Bench::new(Access::Aloha, hearers.clone(), 1);
        bench.offer(at(0), 0, &[1; 100]);
        bench.offer(at(later), 1, &[2; 100]);
        let (who, counts) = bench.end();
        assert_eq!(who, [(0, vec![3]), (1, vec![4])], "{later} us later");
        assert_eq!((counts.collided, counts.unheard), (2, 0));
    }
    // A frame that starts as the other ends does not collide.
    let mut bench = Bench::new(Access::Aloha, hearers, 1);
    bench.offer(at(0), 0, &[1; 100]);
    bench.offer(at(micros(106)), 1, &[2; 100]);
    let (who, counts) = bench.end();
    assert_eq!(who, [(0, vec![2, 3]), (1, vec![2, 4])]);
    assert_eq!(counts.collided, 0);
}

#[test]
fn of_three_overlapping_frames_none_is_received() {
    let hearers = vec![vec![3], vec![3], vec![3], vec![]];
    let mut bench = Bench::new(Access::Aloha, hearers, 1);
    for (node, later) in [(0, 0), (1, micros(80)), (2, micros(160))] {
        bench.offer(at(later), node, &[0; 100]);
    }
    let (who, counts) = bench.end();
    assert!(
        who.iter().all(|(_, heard_by)| heard_by.is_empty()),
        "{who:?}"
    );
    assert_eq!(counts.collided, 3);
}

#[test]
fn a_sender_receives_nothing() {
    // Node 1 starts to send during 0's frame, which it therefore loses; 2 receives 1 alone.
    let hearers = vec![vec![1], vec![0, 2], vec![]];
    let mut bench = Bench::new(Access::Aloha, hearers.clone(), 1);
    bench.offer(at(0), 0, &[1; 100]);
    bench.offer(at(micros(50)), 1, &[2; 20]);
    let (who, counts) = bench.end();
    assert_eq!(who, [(1, vec![2]), (0, vec![])]);
    assert_eq!((counts.collided, counts.unheard), (0, 2));
    // A node is deaf during its turnaround, too: 0 starts just as 1 is about to.
    let mut bench = Bench::new(Access::Aloha, hearers, 1);
    bench.offer(at(0), 1, &[2; 5]);
    bench.offer(at(1), 0, &[1; 100]);
    let (who, counts) = bench.end();
    assert_eq!(who, [(1, vec![2]), (0, vec![])]);
    assert_eq!(counts.unheard, 2);
}

#[test]
fn a_hidden_node_does_not_wait_and_one_in_range_does() {
    for seed in 0..200 {
        // Nodes in a row: 0 and 2 do not receive each other.
        let mut bench = Bench::new(Access::Csma, vec![vec![1], vec![0, 2], vec![1]], seed);
        bench.offer(at(0), 0, &[0; 200]);
        // The frame is on the air for twice the longest first wait.
        bench.offer(at(micros(100)), 2, &[2; 20]);
        let (who, counts) = bench.end();
        assert_eq!(who, [(2, vec![]), (0, vec![])], "seed {seed}");
        assert_eq!((counts.collided, counts.deferred), (2, 0));
        let mut bench = Bench::in_one_range(Access::Csma, 3, seed);
        bench.offer(at(0), 0, &[0; 200]);
        bench.offer(at(micros(100)), 2, &[2; 20]);
        let (who, counts) = bench.end();
        assert_eq!(who, [(0, vec![1, 2]), (2, vec![0, 1])], "seed {seed}");
        assert!(counts.deferred > 0 && counts.collided + counts.unheard == 0);
    }
}

#[test]
fn two_frames_collide_only_in_the_same_slot() {
    let (mut same, runs) = (0, 4_000);
    for seed in 0..runs {
        let mut bench = Bench::in_one_range(Access::Csma, 3, seed);
        for node in [0, 1] {
            bench.offer(at(0), node, &[0; 60]);
        }
        let (who, counts) = bench.end();
        let lost = who.iter().filter(|(_, by)| by.is_empty()).count();
        assert_eq!(counts.collided > 0, lost == 2, "seed {seed}");
        assert!(lost == 0 || lost == 2, "seed {seed}");
        same += u64::from(lost == 2);
    }
    // Frames collide if both nodes draw the same of eight slots. Otherwise the later node finds the channel busy and
    // waits.
    let share = same as f64 / runs as f64;
    assert!((share - 1.0 / 8.0).abs() < 0.02, "{share}");
}

#[test]
fn a_queue_holds_a_few_frames_in_order_and_drops_the_newest() {
    let mut bench = Bench::in_one_range(Access::Csma, 2, 1);
    let taken: Vec<bool> = (0..6)
        .map(|tag| bench.offer(at(0), 0, &[tag; 30]))
        .collect();
    assert_eq!(taken, [true, true, true, true, false, false]);
    bench.go_on(seconds(60));
    let tags: Vec<u8> = bench.sent.iter().map(|(_, sent)| sent.frame[0]).collect();
    assert_eq!((tags.as_slice(), QUEUE), (&[0, 1, 2, 3][..], 4));
    assert_eq!(bench.medium.counts().dropped, 2);
    assert!(bench.offer(seconds(61), 0, &[9; 30]));
}

#[test]
fn a_radio_that_is_switched_off_sends_nothing_more() {
    let mut bench = Bench::in_one_range(Access::Aloha, 2, 1);
    bench.offer(at(0), 0, &[1; 100]);
    bench.offer(at(1), 0, &[2; 100]);
    bench.go_on(at(micros(50)));
    bench.medium.switch_off(0);
    // After an immediate restart it sends its new frames.
    bench.offer(at(micros(50)), 0, &[3; 100]);
    bench.go_on(seconds(60));
    let heard: Vec<(u8, bool)> = bench
        .sent
        .iter()
        .map(|(_, sent)| (sent.frame[0], !sent.heard_by.is_empty()))
        .collect();
    assert_eq!(heard, [(1, false), (3, true)]);
}

#[test]
fn a_node_waits_longer_each_time_the_channel_is_busy() {
    let runs = 2_000;
    let mut times = 0;
    for seed in 0..runs {
        let mut bench = Bench::in_one_range(Access::Csma, 2, seed);
        bench.offer(at(0), 0, &[0; 400]);
        bench.offer(at(micros(100)), 1, &[1; 20]);
        times += bench.end().1.deferred;
    }
    // Times in bytes: the first frame lasts 300 to 370 more. Waits grow to 35, 75 and 155 on average, so three fit.
    let mean = times as f64 / runs as f64;
    assert!((2.5..4.5).contains(&mean), "{mean}");
}
