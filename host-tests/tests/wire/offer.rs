//! Second codec for uploads: contents of an offer, its bytes and ranges.

use serde::{Deserialize, Serialize};
use uav_relay::wire::message::Message;
use uav_relay::{Band, Interference, Interferer, Profile, Sites, Upload};

use super::codec::{Said, fields};

/// Mission with its version, in order of transmission.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Offer {
    pub(crate) version: u16,
    /// Digest of the mission loaded before flight.
    pub(crate) base: u16,
    pub(crate) relays: u16,
    pub(crate) distance_m: f32,
    pub(crate) min_separation_m: f32,
    pub(crate) tx_power_w: f32,
    pub(crate) altitude_m: f32,
    pub(crate) power_w: f32,
    #[serde(rename = "interferer_power_w")]
    pub(crate) interferer_w: f32,
    #[serde(rename = "interferer_x_m")]
    pub(crate) x_m: f32,
    #[serde(rename = "interferer_y_m")]
    pub(crate) y_m: f32,
    pub(crate) tolerance: f32,
    pub(crate) mu_los: f64,
    pub(crate) mu_nlos: f64,
    pub(crate) eta: f64,
    #[serde(rename = "altitude_min_m")]
    pub(crate) least_m: f32,
    #[serde(rename = "altitude_max_m")]
    pub(crate) most_m: f32,
    /// Lateral room to the left, at most 0, and to the right, at least 0.
    #[serde(rename = "lateral_min_m")]
    pub(crate) left_m: f32,
    #[serde(rename = "lateral_max_m")]
    pub(crate) right_m: f32,
    /// Noise power at every receiver; 0 for none.
    pub(crate) noise_w: f32,
    /// Latitude, longitude and height of Tx, then of Rx; all 0 for none.
    #[serde(flatten, with = "fields::sites")]
    pub(crate) sites: [i32; 6],
    /// Number of the hello that it answers; 0 for none.
    pub(crate) offer_number: u16,
}

/// Offsets in the body: number of relays, noise, and sites.
const RELAYS: usize = 5;
const NOISE: usize = 83;
const SITES: usize = 87;

/// Length of the body, and of the part stored across a reboot.
pub(crate) const BYTES: usize = 113;
pub(crate) const KEPT: usize = 111;

impl Offer {
    pub(crate) fn body(&self) -> Vec<u8> {
        Said::Offer(*self).body()
    }

    /// Encodes the stored part, without the answered hello.
    pub(crate) fn kept(&self) -> Vec<u8> {
        let mut body = self.body();
        body.truncate(KEPT);
        body
    }

    fn is_unknown(&self) -> bool {
        [self.interferer_w, self.x_m, self.y_m].map(f32::to_bits) == [0; 3]
    }

    /// Returns the mission's digest: CRC-32C of the mission, and of that with the sites, if any.
    pub(crate) fn digest(&self) -> u16 {
        // Zero noise is left out.
        let end = if self.noise_w > 0.0 { SITES } else { NOISE };
        self.between(low_half(&self.body()[RELAYS..end]))
    }

    /// Combines a digest with the sites.
    pub(crate) fn between(&self, digest: u16) -> u16 {
        if self.sites == [0; 6] {
            return digest;
        }
        let body = self.kept();
        low_half(&[&digest.to_le_bytes()[..], &body[SITES..]].concat())
    }

    /// Converts to the crate's message. Checks each number in it, since only the crate can construct it.
    pub(crate) fn message(&self) -> Message {
        let upload = Upload::decode(&self.kept()).unwrap();
        let config = upload.config();
        assert_eq!((upload.version(), upload.base()), (self.version, self.base));
        let common = Profile {
            altitude_m: self.altitude_m,
            power_w: self.power_w,
        };
        let interferer = Interferer {
            power_w: self.interferer_w,
            x_m: self.x_m,
            y_m: self.y_m,
        };
        let band = Band {
            least_m: self.least_m,
            most_m: self.most_m,
        };
        let lateral = Band {
            least_m: self.left_m,
            most_m: self.right_m,
        };
        assert_eq!((config.relays, config.common), (self.relays, common));
        assert_eq!(config.distance_m, self.distance_m);
        assert_eq!(config.min_separation_m, self.min_separation_m);
        assert_eq!(config.tx_power_w, self.tx_power_w);
        let interference = if self.is_unknown() {
            Interference::Unknown
        } else {
            Interference::Source(interferer)
        };
        assert_eq!(config.interference, interference);
        assert_eq!(
            (config.tolerance, config.noise_w),
            (self.tolerance, self.noise_w)
        );
        let channel = config.channel;
        let factors = [channel.mu_los(), channel.mu_nlos(), channel.eta()];
        assert_eq!(factors, [self.mu_los, self.mu_nlos, self.eta]);
        assert_eq!((config.band, config.lateral), (band, lateral));
        let sites = upload.sites().map_or([0; 6], |Sites { tx, rx }| {
            [tx, rx]
                .map(|at| [at.lat_e7, at.lon_e7, at.amsl_mm])
                .as_flattened()
                .try_into()
                .unwrap()
        });
        assert_eq!(sites, self.sites);
        let mission_id = upload.id();
        assert_eq!(
            (mission_id.version, mission_id.digest),
            (self.version, self.digest())
        );
        Message::Offer {
            upload,
            offer_number: self.offer_number,
        }
    }
}

fn low_half(bytes: &[u8]) -> u16 {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(bytes);
    u16::try_from(crc & 0xFFFF).unwrap()
}

/// Returns an offer that eight relays can fly.
pub(crate) fn offer() -> Offer {
    Offer {
        version: 2,
        base: 0x5A3C,
        relays: 8,
        distance_m: 1000.0,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        altitude_m: 20.0,
        power_w: 1.0,
        interferer_w: 62.5,
        x_m: 600.0,
        y_m: -250.5,
        tolerance: 1e-4,
        mu_los: 7000.0,
        mu_nlos: 900_000.5,
        eta: 7000.25,
        least_m: 20.0,
        most_m: 300.0,
        left_m: -60.0,
        right_m: 40.5,
        noise_w: 0.0,
        sites: [0; 6],
        offer_number: 0,
    }
}
