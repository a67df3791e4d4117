//! Golden vectors on the target: results equal those on the host.

use std::io::{Read as _, Write as _};

use chacha20::ChaCha8Rng;
use host_tests::firmware::emulator::{Emulator, Life};
use rand::{RngExt, SeedableRng};
use uav_relay_decode::vectors::Vectors;
use uav_relay_tools::provision::config::LEN;

use crate::fleet::{PATIENCE, image};

#[path = "../../../examples/golden/answer.rs"]
#[expect(unreachable_pub, reason = "as in the image")]
mod answer;

/// Returns the answers of the firmware's code to the frames in `heard`. The code is compiled for this computer.
fn here(heard: &[u8]) -> Vec<Vec<u8>> {
    let mut answerer = answer::Answerer::new();
    let mut answers = vec![Vec::new()];
    for &byte in heard {
        let mut said: Vec<u8> = Vec::new();
        answerer.hear(byte, |answer| said.extend(answer));
        answers.last_mut().unwrap().extend(said);
        if byte == 0 {
            answers.push(Vec::new());
        }
    }
    answers
}

#[test]
fn the_target_handles_every_vector_like_the_host() {
    let vectors = Vectors::load().unwrap();
    assert!(vectors.frames.len() >= 20);
    let mut heard = Vec::new();
    for vector in &vectors.frames {
        let wire = &vector.wire;
        assert!(here(wire)[0].starts_with(wire), "{}", vector.name);
        heard.extend(wire);
    }
    // A thousand frames with up to three bytes changed, which are refused for various reasons.
    let seed = uav_relay_oracle::random::seed(31);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..1_000 {
        let vector = &vectors.frames[rng.random_range(0..vectors.frames.len())];
        let mut wire = vector.wire.clone();
        for _ in 0..rng.random_range(1..=3) {
            let at = rng.random_range(0..wire.len() - 1);
            wire[at] ^= rng.random_range(1..=u8::MAX);
        }
        heard.extend(wire);
    }
    let expected = here(&heard).concat();
    for refusal in [&b"2\0"[..], b"4\0"] {
        let times = expected.windows(2).filter(|two| *two == refusal).count();
        assert!(times > 10, "{times} times {refusal:?}");
    }

    let folder = tempfile::Builder::new().prefix("golden").tempdir().unwrap();
    let (_drone, [_, mut port, _, _]) = Emulator::start(
        &image("golden"),
        &[0; LEN],
        &[],
        folder.path(),
        "golden",
        Life::Fast,
    )
    .unwrap_or_else(|error| panic!("{error}"));
    port.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut ready = [0; answer::READY.len()];
    port.read_exact(&mut ready).unwrap();
    assert_eq!(ready, answer::READY);
    let mut out = port.try_clone().unwrap();
    let sender = std::thread::spawn(move || out.write_all(&heard));
    let mut answers = vec![0; expected.len()];
    let all = port.read_exact(&mut answers);
    sender.join().unwrap().unwrap();
    let at = answers.iter().zip(&expected).position(|(a, b)| a != b);
    assert_eq!(at, None, "the first byte that differs, of seed {seed}");
    all.unwrap();
}
