//! Offers whose relays do or do not fit on the line, and the encoding of an operator's upload.

use host_tests::fixtures::paper;
use host_tests::make;
use serde_json::json;
use uav_relay::channel::AirGround;
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::{Message, MessageError};
use uav_relay::{Channel, Interference, Mission, MissionConfig, Upload};

use uav_relay_decode::write;

use super::meaning;
use super::message::{FORMAT, WireMessage};
use super::offer::{BYTES, KEPT, kept, mission_id, upload};

/// Returns true if this crate accepts an offer with the given body. If it is not accepted, the reason must be a value out of range.
fn is_accepted(body: &[u8]) -> bool {
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

/// Checks that an offer is refused if its relays do not fit on the line with its minimum separation. The test tries f32
/// separations around the limit.
#[test]
fn an_offer_needs_space_for_its_relays() {
    let mut seen = [0; 2];
    for relays in [2_u16, 3, 8, 9, 100, 333, 1000] {
        for distance_m in [1.0_f32, 35.7, 1000.0, 99_999.0] {
            let steps = f32::from(relays - 1);
            let widest = distance_m / steps - distance_m / 2_097_152.0;
            let mut min_separation_m = (0..40).fold(widest, |at, _| at.next_down());
            for _ in 0..80 {
                let mut fields = json!(upload(2, 0x5A3C).fields());
                fields["relays"] = relays.into();
                fields["distance_m"] = distance_m.into();
                fields["min_separation_m"] = min_separation_m.into();
                let body = write::write(&FORMAT, "Offer", &fields).unwrap();
                let fits = is_accepted(&body);
                assert_eq!(fits, WireMessage::verdict(&body).is_ok(), "{fields}");
                seen[usize::from(fits)] += 1;
                min_separation_m = min_separation_m.next_up();
            }
        }
    }
    println!("{seen:?}");
    assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
}

/// Returns a mission of eight relays with `channel`. All other parameters differ from the paper's mission.
fn other(channel: Channel) -> MissionConfig {
    MissionConfig {
        relays: 8,
        distance_m: 1100.0,
        min_separation_m: 5.0,
        tx_power_w: 70.0,
        common: make::profile(30.0, 2.0),
        channel,
        band: make::band(25.0, 250.0),
        lateral: make::band(-35.0, 45.0),
        interference: Interference::Source(make::interferer(60.0, 700.0, -300.0)),
        noise_w: 1e-12,
        reverse: 0.25,
        rx_power_w: 5.0,
        fitted_gap: 2.5,
        tolerance: 2e-4,
    }
}

#[test]
fn an_upload_is_encoded_and_decoded_with_every_number() {
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
        let offer = crate::offer::upload(7, digest(&base)).with(json!({
            "distance_m": 1100.0, "min_separation_m": 5.0, "tx_power_w": 70.0, "altitude_m": 30.0, "power_w": 2.0,
            "interferer_power_w": 60.0, "interferer_x_m": 700.0, "interferer_y_m": -300.0, "tolerance": 2e-4,
            "mu_los": channel.mu_los(), "mu_nlos": channel.mu_nlos(), "eta": channel.eta(),
            "altitude_min_m": 25.0, "altitude_max_m": 250.0, "lateral_min_m": -35.0, "lateral_max_m": 45.0,
            "noise_w": 1e-12, "reverse": 0.25, "rx_power_w": 5.0, "fitted_gap": 2.5, "offer_number": 77,
        }));
        let mut bytes = [0; KEPT];
        assert_eq!(upload.encode(&mut bytes), Some(KEPT));
        assert_eq!(bytes[..], kept(&offer));
        assert_eq!(Upload::decode(&bytes), Some(upload));
        let answer = 77;
        assert_eq!(
            meaning::message(&offer),
            Message::Offer {
                upload,
                offer_number: answer
            }
        );
        let mission = Mission::try_new(config).unwrap();
        assert_eq!(digest(&mission), mission_id(&offer).0);
    }
}

#[test]
fn only_the_stored_part_of_an_offer_is_an_upload() {
    let offer = upload(2, 0x5A3C);
    let body = kept(&offer);
    assert!(Upload::decode(&body).is_some());
    assert_eq!(Upload::decode(offer.body()), None, "as it is sent");
    for len in 0..KEPT {
        assert_eq!(Upload::decode(&body[..len]), None, "{len}");
    }
    assert_eq!(Upload::decode(&[&body[..], &[0]].concat()), None);
    assert_eq!(Upload::decode(&[3, 0, 0, 1]), None, "another message");
    let upload = Upload::decode(&body).unwrap();
    assert_eq!(upload.encode(&mut [0; KEPT - 1]), None);
}
