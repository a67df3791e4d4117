//! Deframer: independence of cuts, oversized frames, and comparison with another COBS implementation.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::MAX_DECODED;
use uav_relay::{Port, Wiring};
use uav_relay_decode::envelope::{self, stuffed};

use super::bench::Bench;
use super::config;
use super::golden::vectors;
use super::strategies::{headers, pieces};

type Outcome = Result<Vec<u8>, DeframeError>;

/// Returns the frames and errors that the deframer finds in a stream, byte by byte. Checks that it finds the same in
/// runs of several bytes.
fn deframed(stream: &[u8]) -> Vec<Outcome> {
    let mut deframer = Deframer::new();
    let mut out = Vec::new();
    for &byte in stream {
        if let Some(outcome) = deframer.push(byte) {
            out.push(outcome.map(<[u8]>::to_vec));
        }
    }
    assert_eq!(deframed_in_runs(stream), out, "the same in runs");
    out
}

/// Returns the frames and errors that the deframer finds in a stream that it decodes in runs of bytes.
fn deframed_in_runs(stream: &[u8]) -> Vec<Outcome> {
    let mut deframer = Deframer::new();
    let mut out = Vec::new();
    let mut rest = stream;
    while let Some((&byte, after)) = deframer.push_run(rest).split_first() {
        rest = after;
        if let Some(outcome) = deframer.push(byte) {
            out.push(outcome.map(<[u8]>::to_vec));
        }
    }
    out
}

/// Decodes `stuffed`, the bytes between two delimiters, by the format's COBS rules. Returns a frame or an error.
pub(crate) fn unstuffed(stuffed: &[u8]) -> Outcome {
    let (plain, whole) = envelope::unstuffed(stuffed);
    if plain.len() > MAX_DECODED {
        Err(DeframeError::Oversized)
    } else if whole {
        Ok(plain)
    } else {
        Err(DeframeError::Truncated)
    }
}

/// Returns the parts of a stream between delimiters: its COBS frames. Empty parts and an incomplete last part are
/// left out.
pub(crate) fn chunks(stream: &[u8]) -> Vec<&[u8]> {
    let mut chunks: Vec<&[u8]> = stream.split(|&byte| byte == 0).collect();
    chunks.pop();
    chunks.retain(|chunk| !chunk.is_empty());
    chunks
}

fn by_the_rules(stream: &[u8]) -> Vec<Outcome> {
    chunks(stream).into_iter().map(unstuffed).collect()
}

/// Returns a relay's state as text after a stream that arrives in pieces. `cuts` has the lengths of the pieces,
/// repeated as needed.
fn state_after(stream: &[u8], cuts: &[usize]) -> String {
    let mut bench = Bench::new(2, 8, Wiring::Pair);
    let (start, mut rest) = (bench.now, stream);
    for &cut in cuts.iter().cycle() {
        let (now, later) = rest.split_at(cut.min(rest.len()));
        bench.handle_bytes(start, Port::Upstream, now);
        rest = later;
        if rest.is_empty() {
            break;
        }
    }
    format!("{bench:?}")
}

/// Returns a stream of all test vectors. Noise, and cut, oversized and empty frames are between them.
fn fixed_stream() -> Vec<u8> {
    let mut stream = b"noise before the first delimiter\0\0\0".to_vec();
    for (k, vector) in vectors().frames.into_iter().enumerate() {
        let wire = vector.wire;
        stream.extend(&wire);
        match k % 5 {
            0 => stream.extend([0, 0]),
            1 => stream.extend(&wire[..wire.len() / 2]),
            2 => stream.extend([&wire[..wire.len() / 2], &[0]].concat()),
            3 => stream.extend([&[0x55; 260][..], &wire].concat()),
            _ => stream.extend([0xFF, 1, 1, 0]),
        }
    }
    stream
}

#[test]
fn every_chunk_size_gives_the_same_frames() {
    let stream = fixed_stream();
    let outcomes = deframed(&stream);
    assert_eq!(outcomes, by_the_rules(&stream));
    for error in [DeframeError::Oversized, DeframeError::Truncated] {
        assert!(outcomes.contains(&Err(error)), "{error}");
    }
    let whole = state_after(&stream, &[stream.len()]);
    for size in 1..stream.len() {
        assert!(state_after(&stream, &[size]) == whole, "chunks of {size}");
    }
}

#[test]
fn the_tail_of_an_oversized_frame_is_never_a_frame() {
    let vectors = vectors().frames;
    let good = &vectors[0].wire;
    // Wherever a deframer restarts too early, one of these fillings makes it find a valid frame.
    let data_runs = |len: usize| -> Vec<u8> {
        let bytes = std::iter::repeat_n([0x64; 100], len / 100 + 1).flatten();
        bytes.take(len).collect()
    };
    for len in MAX_DECODED + 3..=800 {
        for before in [data_runs(len), vec![1; len], vec![0xFF; len], vec![2; len]] {
            let stream = [&before[..], good, good].concat();
            let outcomes = deframed(&stream);
            assert_eq!(
                outcomes,
                [Err(DeframeError::Oversized), Ok(vectors[0].plain.clone())],
                "{len} bytes of {}",
                before[0]
            );
        }
    }
}

#[test]
fn the_longest_frame_fits_and_one_byte_more_does_not() {
    for zeros in 0..=MAX_DECODED + 1 {
        for len in [97, 98, 99, 100]
            .into_iter()
            .chain(MAX_DECODED - 1..MAX_DECODED + 3)
        {
            let plain: Vec<u8> = (0..len).map(|k| u8::from(k >= zeros)).collect();
            let expected = if len <= MAX_DECODED {
                Ok(plain.clone())
            } else {
                Err(DeframeError::Oversized)
            };
            assert_eq!(deframed(&stuffed(&plain)), [expected], "{zeros} zeros");
        }
    }
}

/// Draws streams of pieces of frames, or of random bytes. One in 64 of the random bytes is a delimiter, and half of
/// the random bytes are small, so that the stream has short runs and frequent zeros.
fn streams() -> impl Strategy<Value = Vec<u8>> {
    let byte = any::<[u8; 2]>().prop_map(|draw| match draw {
        [_, 0..4] => 0,
        [byte, 4..128] => byte % 8,
        [byte, _] => byte,
    });
    prop_oneof![
        vec(pieces(headers()), 0..12).prop_map(|pieces| pieces.concat()),
        vec(byte, 0..1000),
    ]
}

proptest! {
    #![proptest_config(config(6000))]

    #[test]
    fn decoding_agrees_with_the_cobs_crate(stuffed in vec(1..=u8::MAX, 1..=MAX_DECODED)) {
        let small: Vec<u8> = stuffed.iter().map(|byte| (byte - 1) % 9 + 1).collect();
        for stuffed in [stuffed, small] {
            let expected = cobs::decode_vec(&stuffed).map_err(|_| DeframeError::Truncated);
            let stream = [&stuffed[..], &[0]].concat();
            prop_assert_eq!(deframed(&stream), [expected]);
        }
    }

    #[test]
    fn any_stream_is_split_as_the_rules_say(stream in streams()) {
        prop_assert_eq!(deframed(&stream), by_the_rules(&stream));
    }
}

proptest! {
    #![proptest_config(config(300))]

    #[test]
    fn every_split_of_a_stream_gives_the_same(stream in streams(), cuts in vec(0..60_usize, 1..8)) {
        prop_assume!(cuts.iter().any(|&cut| cut > 0));
        prop_assert_eq!(state_after(&stream, &cuts), state_after(&stream, &[stream.len() + 1]));
    }
}
