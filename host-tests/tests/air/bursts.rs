//! Losses in bursts.

use chacha20::ChaCha8Rng;
use rand::SeedableRng;
use uav_relay_sim::simulator::faults::Bursts;

const FRAMES: usize = 1_000_000;

#[test]
fn mean_loss_and_mean_burst_length_are_as_requested() {
    for (share, length) in [
        (0.1, 5.0),
        (0.3, 20.0),
        (0.5, 20.0),
        (0.7, 4.0),
        (0.9, 10.0),
    ] {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut bursts = Bursts::new(share, length);
        let lost: Vec<bool> = (0..FRAMES).map(|_| bursts.loses(0, 1, &mut rng)).collect();
        let count = lost.iter().filter(|lost| **lost).count() as f64;
        let runs = lost.chunk_by(|one, next| one == next).filter(|run| run[0]);
        let mean = count / runs.count() as f64;
        println!("{share}, {length}: {:.4}, {mean:.3}", count / FRAMES as f64);
        assert!(
            (count / FRAMES as f64 - share).abs() < 0.01,
            "{share}, {length}"
        );
        assert!(
            (mean / length - 1.0).abs() < 0.03,
            "{share}, {length}: {mean}"
        );
    }
}

#[test]
fn burst_lengths_are_geometric_for_each_direction() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut bursts = Bursts::new(0.4, 10.0);
    let (mut both, mut one, mut long, mut runs) = (0, 0, 0, 0);
    let mut run = 0;
    for _ in 0..FRAMES {
        let (there, back) = (bursts.loses(3, 4, &mut rng), bursts.loses(4, 3, &mut rng));
        both += u32::from(there && back);
        one += u32::from(there);
        if there {
            run += 1;
        } else if run > 0 {
            runs += 1;
            long += u32::from(run > 10);
            run = 0;
        }
    }
    let joint = f64::from(both) / f64::from(one);
    assert!((joint - 0.4).abs() < 0.02, "{joint}");
    // A geometric run of mean 10 is longer than 10 with probability 0.9^10.
    let share = f64::from(long) / f64::from(runs);
    assert!((share - 0.9_f64.powi(10)).abs() < 0.01, "{share}");
}
