//! Cost of sweeps, verdicts, frames and the prediction of Algorithm 1.

use core::hint::black_box;
use cortex_m_semihosting::hprintln;
use uav_relay::optimiser::spacing::Hop;
use uav_relay::sir::Sender;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::{Instant, MAX_FRAME, Mission, MissionConfig, Phase, Port, Settings};

use super::counter::{instructions, next_frame, relay};
use super::missions::{INTERFERER, MISSION, mission};

#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn reach() {
    let common = MISSION.config().common;
    let middle = Hop::new(
        &MISSION,
        &INTERFERER,
        Sender::relay(&MISSION, common.on_line()),
        4,
        common.on_line().cross_section,
        0.0,
    );
    let mut most = 0;
    for from in [100.0_f32, 400.0, 499.9, 500.1, 600.0, 900.0] {
        for target in [0.005_f32, 0.0125, 1.0, 5.0, 40.0] {
            let (hop, target, from) = (black_box(&middle), black_box(target), black_box(from));
            most = most.max(instructions(|| hop.reach(target, from)));
        }
    }
    hprintln!("reach {}", most);
    reach_in_noise();
}

/// Measures the instructions of `Hop::reach` (farthest position with a target SIR) with receiver noise.
///
/// The noise power is 1e-4 to 100 times the interference power at 100 m from the interferer.
fn reach_in_noise() {
    const LEVELS: usize = 4;
    let mut all = [0; LEVELS * 30];
    let mut slots = all.iter_mut();
    for noise_w in [1e-10_f32, 1e-8, 1e-6, 1e-4] {
        let Ok(mission) = Mission::try_new(MissionConfig {
            noise_w,
            ..*MISSION.config()
        }) else {
            continue;
        };
        let common = mission.config().common;
        let sender = Sender::relay(&mission, common.on_line());
        let at = common.on_line().cross_section;
        let middle = Hop::new(&mission, &INTERFERER, sender, 4, at, 0.0);
        for from in [100.0_f32, 400.0, 499.9, 500.1, 600.0, 900.0] {
            for target in [0.005_f32, 0.0125, 1.0, 5.0, 40.0] {
                let (hop, target, from) = (black_box(&middle), black_box(target), black_box(from));
                if let Some(slot) = slots.next() {
                    *slot = instructions(|| hop.reach(target, from));
                }
            }
        }
    }
    all.sort_unstable();
    hprintln!("reach_noise {}", all.last().copied().unwrap_or(0));
    let middle = all.get(all.len() / 2).copied();
    hprintln!("reach_noise_median {}", middle.unwrap_or(0));
}

/// Instructions of the most expensive calls that handle a sweep message and its verdict.
///
/// A sweep message tries several target SIRs along the chain; the verdict brings the result back.
struct SweepCost {
    begin: u32,
    through: u32,
    at_tail: u32,
    back: u32,
    next: u32,
    /// Length of the longest sweep message from relay 1, bytes.
    longest: usize,
    /// True if the chain has agreed on positions.
    settled: bool,
}

/// Prints the costs of a sweep (search for positions), for traffic to Rx only, and to Rx and back.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn sweep() {
    const THREE: Mission = mission(3);
    const BOTH_WAYS: Mission = Mission::new(MissionConfig {
        reverse: 1.0,
        ..*THREE.config()
    });
    let cost = measured(THREE);
    hprintln!("begin_sweep {}", cost.begin);
    hprintln!("sweep_bytes {}", cost.longest);
    hprintln!("sweep {}", cost.through);
    hprintln!("sweep_at_tail {}", cost.at_tail);
    hprintln!("verdict {}", cost.back);
    hprintln!("verdict_at_head {}", cost.next);
    hprintln!("settled {}", u32::from(cost.settled));
    let cost = measured(BOTH_WAYS);
    hprintln!("begin_sweep_both_ways {}", cost.begin);
    hprintln!("sweep_both_ways_bytes {}", cost.longest);
    hprintln!("sweep_both_ways {}", cost.through);
    hprintln!("sweep_both_ways_at_tail {}", cost.at_tail);
    hprintln!("verdict_both_ways {}", cost.back);
    hprintln!("settled_both_ways {}", u32::from(cost.settled));
}

/// Measures a sweep (search for positions) along three relays, and its verdict on the way back.
#[inline(never)]
fn measured(mission: Mission) -> SweepCost {
    let settings = Settings {
        predict: false,
        ..Settings::default()
    };
    let mut head = relay(1, settings, mission);
    let mut middle = relay(2, settings, mission);
    let mut tail = relay(3, settings, mission);
    let (mut now, mut begin) = (Instant::ZERO, 0);
    while head.phase() == Phase::Planning {
        now = head.poll_timeout().unwrap_or(now);
        begin = begin.max(instructions(|| head.handle_timeout(now)));
    }
    let (mut through, mut at_tail, mut back, mut next) = (0, 0, 0, 0);
    let mut longest = 0;
    while head.phase() == Phase::Waiting {
        let Some((frame, len)) = next_frame(&mut head, now) else {
            break;
        };
        longest = longest.max(len);
        let bytes = frame.get(..len).unwrap_or_default();
        let mut again = middle.clone();
        through = through.max(instructions(|| {
            middle.handle_bytes(now, Port::Upstream, bytes);
            let mut out = [0; MAX_FRAME];
            black_box(middle.poll_transmit(now, &mut out));
            black_box(&out);
        }));
        // The clone handles the same frame; only the call above is measured.
        again.handle_bytes(now, Port::Upstream, bytes);
        let Some((frame, len)) = next_frame(&mut again, now) else {
            break;
        };
        let bytes = frame.get(..len).unwrap_or_default();
        let mut answer = [0; MAX_FRAME];
        let mut answered = None;
        at_tail = at_tail.max(instructions(|| {
            tail.handle_bytes(now, Port::Upstream, bytes);
            answered = tail.poll_transmit(now, &mut answer);
        }));
        let Some(transmit) = answered else { break };
        let bytes = answer.get(..transmit.len).unwrap_or_default();
        let mut onward = [0; MAX_FRAME];
        let mut passed = None;
        back = back.max(instructions(|| {
            middle.handle_bytes(now, Port::Downstream, bytes);
            passed = middle.poll_transmit(now, &mut onward);
        }));
        let Some(transmit) = passed else { break };
        let bytes = onward.get(..transmit.len).unwrap_or_default();
        next = next.max(instructions(|| {
            head.handle_bytes(now, Port::Downstream, bytes);
        }));
        if head.phase() == Phase::Answered {
            now = head.poll_timeout().unwrap_or(now);
            begin = begin.max(instructions(|| head.handle_timeout(now)));
        }
    }
    SweepCost {
        begin,
        through,
        at_tail,
        back,
        next,
        longest,
        settled: head.phase() == Phase::Holding,
    }
}

/// Measures the instructions to deframe and check the first sweep message in a chain of eight relays.
///
/// A sweep message tries several target SIRs along the chain.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn deframe() {
    let settings = Settings {
        predict: false,
        ..Settings::default()
    };
    let mut head = relay(1, settings, MISSION);
    let mut now = Instant::ZERO;
    while head.phase() == Phase::Planning {
        now = head.poll_timeout().unwrap_or(now);
        head.handle_timeout(now);
    }
    let Some((frame, len)) = next_frame(&mut head, now) else {
        return;
    };
    let bytes = black_box(frame.get(..len).unwrap_or_default());
    let mut deframer = Deframer::new();
    let cost = instructions(|| {
        let mut sound = false;
        for &byte in bytes {
            if let Some(Ok(plain)) = deframer.push(byte) {
                sound = frame::open(plain).is_ok();
            }
        }
        sound
    });
    hprintln!("frame {}", cost);
}

/// Measures the instructions for relay 1 of 100 to predict the target SIR.
///
/// Relay 1 does this in several calls before its first message. Prints the most expensive call, and the number of
/// calls.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn predict() {
    const HUNDRED: Mission = mission(100);
    let mut head = relay(1, Settings::default(), HUNDRED);
    let (mut most, mut portions) = (0, 0);
    while head.phase() == Phase::Planning {
        let now = head.poll_timeout().unwrap_or(Instant::ZERO);
        most = most.max(instructions(|| head.handle_timeout(now)));
        portions += 1;
    }
    hprintln!("predict {}", most);
    hprintln!("predict_portions {}", portions);
}
