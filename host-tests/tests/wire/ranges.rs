//! Room for the relays of an offer, and the encoding of an operator's upload.

use host_tests::fixtures::paper;
use uav_relay::channel::AirGround;
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::{Message, MessageError};
use uav_relay::{Band, Channel, Interference, Interferer, Mission, MissionConfig, Profile, Upload};

use super::codec::Said;
use super::offer::{BYTES, KEPT, Offer, offer};

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
                assert_eq!(fits, Said::read(&offer.body()).is_ok(), "{offer:?}");
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
            offer_number: 77,
        };
        let mut bytes = [0; KEPT];
        assert_eq!(upload.encode(&mut bytes), Some(KEPT));
        assert_eq!(bytes[..], offer.kept());
        assert_eq!(Upload::decode(&bytes), Some(upload));
        let answer = 77;
        assert_eq!(
            offer.message(),
            Message::Offer {
                upload,
                offer_number: answer
            }
        );
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
