//! Ranges of an offer, number by number, and the encoding of an operator's upload.

use host_tests::fixtures::paper;
use uav_relay::channel::AirGround;
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::{Message, MessageError};
use uav_relay::{Band, Channel, Interference, Interferer, Mission, MissionConfig, Profile, Upload};

use super::offer::{
    ALTITUDE, BYTES, DISTANCE, ETA, INTERFERER, KEPT, LEAST, LEFT, MOST, MU_LOS, MU_NLOS, NOISE,
    Offer, POWER, RELAYS, RIGHT, SEPARATION, SITES, TOLERANCE, TX_POWER, X, Y, offer,
};

/// Returns true if a body is accepted; otherwise it must be out of range.
fn taken(body: &[u8]) -> bool {
    match Message::decode(body) {
        Ok(message) => {
            assert!(matches!(message, Message::Offer { .. }));
            assert_eq!(body.len(), BYTES);
            true
        }
        Err(error) => {
            assert_eq!(error, MessageError::Value);
            false
        }
    }
}

fn with(offer: &Offer, at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut body = offer.body();
    body[at..at + bytes.len()].copy_from_slice(bytes);
    body
}

/// Returns an offer for one relay, which always has room, with any altitude.
fn roomy() -> Offer {
    Offer {
        relays: 1,
        least_m: 0.1,
        most_m: 1e5,
        ..offer()
    }
}

#[test]
fn every_f32_of_an_offer_is_taken_up_to_its_bounds_and_no_farther() {
    let one = Offer {
        least_m: 20.0,
        most_m: 20.0,
        ..offer()
    };
    for (offer, at, least, most, what) in [
        (roomy(), DISTANCE, 1.0, 1e6, "D"),
        (roomy(), SEPARATION, 0.0, 1e5, "separation"),
        (offer(), TX_POWER, 1e-6, 1e6, "power of Tx"),
        (roomy(), ALTITUDE, 0.1, 1e5, "altitude"),
        (offer(), ALTITUDE, 20.0, 300.0, "altitude in the band"),
        (one, ALTITUDE, 20.0, 20.0, "altitude in a band of one"),
        (offer(), POWER, 1e-6, 1e6, "common power"),
        (offer(), INTERFERER, 1e-6, 1e9, "power of the interferer"),
        (offer(), X, -1e7, 1e7, "X"),
        (offer(), Y, -1e7, 1e7, "Y"),
        (offer(), TOLERANCE, 1e-6, 0.1, "tolerance"),
        (offer(), LEAST, 0.1, 20.0, "lowest altitude"),
        (offer(), MOST, 20.0, 1e5, "highest altitude"),
        (offer(), LEFT, -1e5, 0.0, "room to the left"),
        (offer(), RIGHT, 0.0, 1e5, "room to the right"),
        (offer(), NOISE, 0.0, 1.0, "noise"),
    ] {
        for good in [least, most, f32::midpoint(least, most)] {
            let body = with(&offer, at, &f32::to_le_bytes(good));
            assert!(taken(&body), "{what} {good}");
        }
        for bad in [
            f32::next_down(least),
            f32::next_up(most),
            f32::NAN,
            -f32::NAN,
            f32::from_bits(0x7F80_0001),
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MIN,
        ] {
            let body = with(&offer, at, &bad.to_le_bytes());
            assert!(!taken(&body), "{what} {bad}");
        }
    }
    for at in [SEPARATION, X, Y, LEFT, RIGHT, NOISE] {
        assert!(taken(&with(&offer(), at, &(-0.0_f32).to_le_bytes())));
    }
}

#[test]
fn the_losses_of_an_offer_are_in_order_and_in_range() {
    let losses = |mu_los: f64, mu_nlos: f64, eta: f64| {
        let offer = Offer {
            mu_los,
            mu_nlos,
            eta,
            ..offer()
        };
        taken(&offer.body())
    };
    for (least, most) in [(1e-3, 1e30)] {
        for good in [least, 1.0, most] {
            assert!(losses(good, good, good), "{good}");
        }
        for bad in [f64::next_down(least), f64::next_up(most), 0.0, -1.0] {
            assert!(!losses(bad, bad, bad), "{bad}");
        }
    }
    for mu_los in [1e-3, 7000.0, 1e30] {
        let most = 1e20 * mu_los;
        assert!(losses(mu_los, most, mu_los) && losses(mu_los, most, most));
        assert!(!losses(mu_los, most.next_up(), mu_los), "{mu_los}");
        assert!(!losses(mu_los, mu_los.next_down(), mu_los), "{mu_los}");
        assert!(!losses(mu_los, most, mu_los.next_down()), "{mu_los}");
        assert!(!losses(mu_los, most, most.next_up()), "{mu_los}");
    }
    for at in [MU_LOS, MU_NLOS, ETA] {
        for bad in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(
                !taken(&with(&offer(), at, &bad.to_le_bytes())),
                "{at} {bad}"
            );
        }
    }
}

#[test]
fn sites_are_taken_wherever_they_are_on_earth() {
    for (at, most) in [(0, 900_000_000), (1, 1_800_000_000_i32)] {
        for at in [SITES + 4 * at, SITES + 12 + 4 * at] {
            for good in [-most, most, 1] {
                assert!(taken(&with(&offer(), at, &good.to_le_bytes())), "{good}");
            }
            for bad in [-most - 1, most + 1, i32::MIN, i32::MAX] {
                assert!(!taken(&with(&offer(), at, &bad.to_le_bytes())), "{bad}");
            }
        }
    }
    for at in [SITES + 8, SITES + 20] {
        for good in [i32::MIN, i32::MAX] {
            assert!(taken(&with(&offer(), at, &good.to_le_bytes())), "{good}");
        }
    }
}

#[test]
fn any_version_but_0_is_taken_and_up_to_a_thousand_relays() {
    let close = Offer {
        min_separation_m: 0.0,
        ..offer()
    };
    for number in 0..=u16::MAX {
        let bytes = number.to_le_bytes();
        assert_eq!(taken(&with(&close, 1, &bytes)), number > 0, "{number}");
        assert!(taken(&with(&close, 3, &bytes)), "{number}");
        let relays = taken(&with(&close, RELAYS, &bytes));
        assert_eq!(relays, (1..=1000).contains(&number), "{number}");
    }
}

/// Checks separations from slightly below to slightly above the limit, in f32 steps.
#[test]
fn relays_are_offered_no_longer_a_chain_than_there_is_room_for() {
    let mut seen = [0; 2];
    for relays in [2, 3, 8, 9, 100, 333, 1000] {
        for distance_m in [1.0_f32, 35.7, 1000.0, 99_999.0] {
            let steps = f32::from(relays - 1);
            let widest = distance_m / steps - distance_m / 2_097_152.0;
            let mut min_separation_m = (0..40).fold(widest, |at, _| at.next_down());
            for _ in 0..80 {
                let offer = Offer {
                    relays,
                    distance_m,
                    min_separation_m,
                    ..offer()
                };
                let fits = taken(&offer.body());
                assert_eq!(fits, offer.in_range(), "{offer:?}");
                seen[usize::from(fits)] += 1;
                min_separation_m = min_separation_m.next_up();
            }
        }
    }
    println!("{seen:?}");
    assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
}

/// Returns a mission in which every number differs.
fn other(channel: Channel) -> MissionConfig {
    MissionConfig {
        relays: 8,
        distance_m: 1100.0,
        min_separation_m: 5.0,
        tx_power_w: 70.0,
        common: Profile {
            altitude_m: 30.0,
            power_w: 2.0,
        },
        channel,
        band: Band {
            least_m: 25.0,
            most_m: 250.0,
        },
        lateral: Band {
            least_m: -35.0,
            most_m: 45.0,
        },
        interference: Interference::Source(Interferer {
            power_w: 60.0,
            x_m: 700.0,
            y_m: -300.0,
        }),
        noise_w: 1e-12,
        tolerance: 2e-4,
    }
}

#[test]
fn an_upload_is_written_as_its_mission_has_it_and_read_back() {
    let base = Mission::try_new(paper(8)).unwrap();
    // With equal losses the weighted sum may be rounded, and is encoded between them.
    let equal = (0..=100).map(|step| (1.5, AirGround::Weighted(f64::from(step) / 100.0)));
    let others = [
        (3.0, AirGround::Los),
        (3.0, AirGround::Nlos),
        (3.0, AirGround::Weighted(0.3)),
    ];
    for (loss, air_ground) in others.into_iter().chain(equal) {
        let given = other(Channel::new(2e9, 1.5, loss, air_ground).unwrap());
        let upload = Upload::new(&base, 7, given).unwrap();
        let config = *upload.config();
        let channel = config.channel;
        let (low, high) = (channel.mu_los(), channel.mu_nlos());
        assert_eq!(
            channel.eta().to_bits(),
            given.channel.eta().clamp(low, high).to_bits()
        );
        assert_eq!(config, MissionConfig { channel, ..given });
        let offer = Offer {
            version: 7,
            base: digest(&base),
            relays: 8,
            distance_m: 1100.0,
            min_separation_m: 5.0,
            tx_power_w: 70.0,
            altitude_m: 30.0,
            power_w: 2.0,
            interferer_w: 60.0,
            x_m: 700.0,
            y_m: -300.0,
            tolerance: 2e-4,
            mu_los: channel.mu_los(),
            mu_nlos: channel.mu_nlos(),
            eta: channel.eta(),
            least_m: 25.0,
            most_m: 250.0,
            left_m: -35.0,
            right_m: 45.0,
            noise_w: 1e-12,
            sites: [0; 6],
            answer: 77,
        };
        let mut bytes = [0; KEPT];
        assert_eq!(upload.encode(&mut bytes), Some(KEPT));
        assert_eq!(bytes[..], offer.kept());
        assert_eq!(Upload::decode(&bytes), Some(upload));
        let answer = 77;
        assert_eq!(offer.message(), Message::Offer { upload, answer });
        let mission = Mission::try_new(config).unwrap();
        assert_eq!(digest(&mission), offer.digest());
    }
}

#[test]
fn what_is_kept_of_an_upload_is_an_offer_and_nothing_else() {
    let body = offer().kept();
    assert!(Upload::decode(&body).is_some());
    assert_eq!(Upload::decode(&offer().body()), None, "as it is sent");
    for len in 0..KEPT {
        assert_eq!(Upload::decode(&body[..len]), None, "{len}");
    }
    assert_eq!(Upload::decode(&[&body[..], &[0]].concat()), None);
    assert_eq!(Upload::decode(&[3, 0, 0, 1]), None, "another message");
    let upload = Upload::decode(&body).unwrap();
    assert_eq!(upload.encode(&mut [0; KEPT - 1]), None);
}
