//! Chains of one direction, compared with recorded bits.
//!
//! The recorded number was computed by the code before missions had a way back.

use host_tests::placing::{generator, places, solve};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, Style, in_noise};

/// Number of random scenarios whose results are hashed.
const SCENARIOS: u32 = 1_000;

/// FNV-1a hash of the target SIRs, numbers of sweeps and positions of all scenarios with one direction.
const RECORDED: u64 = 0x12dc_53fc_8c0c_d073;

fn add(hash: &mut u64, bits: u32) {
    for byte in bits.to_le_bytes() {
        *hash = (*hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
}

#[test]
fn places_of_one_direction_are_equal_to_the_bit() {
    let mut rng = generator(3301);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let (mut drawn, mut placed) = (0, 0);
    while drawn < SCENARIOS {
        let style = Style {
            relays: 1..=50,
            chain: Chain::Any,
        };
        let link = random::link(&mut rng, &style);
        let link = if drawn % 2 == 0 {
            link
        } else {
            in_noise(&mut rng, &link)
        };
        let Some((mission, own)) = of_link(&as_relays_know_it(&link), 1e-4) else {
            continue;
        };
        drawn += 1;
        let Some(agreed) = solve(&mission, &own) else {
            add(&mut hash, 0);
            continue;
        };
        placed += 1;
        add(&mut hash, agreed.target.to_bits());
        add(&mut hash, agreed.sweeps);
        for place in places(&mission, &own, agreed.target) {
            add(&mut hash, place.x_m.to_bits());
        }
    }
    println!("{placed} of {drawn} placed, hash {hash:#018x}");
    assert!(placed > 900, "{placed}");
    assert_eq!(hash, RECORDED, "{hash:#018x}");
}
