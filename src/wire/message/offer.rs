//! Encoding of an [`Upload`], in an offer and for storage.

use serde::{Deserialize, Serialize};

use super::parts::{MessageError, PassId, Word, read, tag, write};
use crate::channel::Channel;
use crate::geodetic::{SITES_LENGTH, Sites};
use crate::mission::{Band, Interference, Interferer, MissionConfig, Profile};
use crate::wire::upload::Upload;

/// Encoding of an uploaded mission in an offer message. The offer answers a hello message, and repeats the
/// `offer_number` of that hello.
impl Upload {
    /// Length of an offer's body, bytes.
    pub(super) const OFFER: usize = Self::LENGTH + size_of::<Word>();

    pub(super) fn encode_offer(&self, answer: u16, buffer: &mut [u8]) -> Option<usize> {
        let body = (tag::OFFER, OfferBody::of(self), Word::new(answer));
        write(&body, buffer)
    }

    pub(super) fn decode_offer(body: &[u8]) -> Result<(Self, u16), MessageError> {
        let (body, answer): (OfferBody, Word) = read(body)?;
        let upload = body.checked().ok_or(MessageError::Value)?;
        Ok((upload, answer.number()))
    }
}

/// Encoding of an uploaded mission for storage: an offer message without its `offer_number`.
impl Upload {
    /// Length of an encoded upload, bytes: the message tag and the fixed-size fields of the wire format.
    pub const LENGTH: usize = size_of::<u8>() + size_of::<OfferBody>();

    /// Encodes the uploaded mission for storage into `buffer`; `None` if it does not fit. Returns the length,
    /// [`Upload::LENGTH`] bytes.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        write(&(tag::OFFER, OfferBody::of(self)), buffer)
    }

    /// Decodes a stored uploaded mission; `None` if `bytes` are not exactly one valid upload.
    ///
    /// The caller protects the stored bytes by a check sequence.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (&tag::OFFER, body) = bytes.split_first()? else {
            return None;
        };
        read::<OfferBody>(body).ok()?.checked()
    }
}

/// Uploaded mission on the wire. The struct is packed: its size in memory is the length on the wire, see
/// [`Upload::LENGTH`].
#[derive(Clone, Copy, Serialize, Deserialize)]
#[repr(C, packed)]
struct OfferBody {
    /// Version of the uploaded mission, and digest of the mission that the relays loaded before flight. The upload
    /// replaces the loaded mission.
    pass: PassId,
    relays: Word,
    numbers: [f32; 9],
    factors: [f64; 3],
    bands: [f32; 4],
    noise_w: f32,
    /// Two values for data toward Tx: the mission's `reverse`, and the transmit power of Rx, W. Hops toward Tx need
    /// `reverse` times the SIR that hops toward Rx need.
    back: [f32; 2],
    /// SNR gap of fitted time slots, each as long as its hop needs; 0 for equal slots.
    fitted_gap: f32,
    /// Positions of Tx and Rx, encoded by [`Sites::to_bytes`]; all 0 if the upload has none.
    sites: SitesBody,
}

type SitesBody = [u8; SITES_LENGTH];

const NO_SITES: SitesBody = [0; SITES_LENGTH];

impl OfferBody {
    fn of(upload: &Upload) -> Self {
        let c = upload.config();
        let (power_w, x_m, y_m) = match c.interference {
            Interference::Source(at) => (at.power_w, at.x_m, at.y_m),
            Interference::Field(_) | Interference::Unknown => (0.0, 0.0, 0.0),
        };
        Self {
            pass: PassId::new(upload.version(), upload.base()),
            relays: Word::new(c.relays),
            numbers: [
                c.distance_m,
                c.min_separation_m,
                c.tx_power_w,
                c.common.altitude_m,
                c.common.power_w,
                power_w,
                x_m,
                y_m,
                c.tolerance,
            ],
            factors: [c.channel.mu_los(), c.channel.mu_nlos(), c.channel.eta()],
            bands: [
                c.band.least_m,
                c.band.most_m,
                c.lateral.least_m,
                c.lateral.most_m,
            ],
            noise_w: c.noise_w,
            back: [c.reverse, c.rx_power_w],
            fitted_gap: c.fitted_gap,
            sites: upload.sites().map_or(NO_SITES, Sites::to_bytes),
        }
    }

    fn checked(self) -> Option<Upload> {
        let [mu_los, mu_nlos, eta] = self.factors;
        let [least_m, most_m, left_m, right_m] = self.bands;
        let [reverse, rx_power_w] = self.back;
        let [
            distance_m,
            min_separation_m,
            tx_power_w,
            altitude_m,
            power_w,
            from_w,
            x_m,
            y_m,
            tolerance,
        ] = self.numbers;
        let config = MissionConfig {
            relays: { self.relays }.number(),
            distance_m,
            min_separation_m,
            tx_power_w,
            common: Profile {
                altitude_m,
                power_w,
            },
            band: Band { least_m, most_m },
            lateral: Band {
                least_m: left_m,
                most_m: right_m,
            },
            channel: Channel::from_factors(mu_los, mu_nlos, eta)?,
            interference: if [from_w, x_m, y_m].map(f32::to_bits) == [0; 3] {
                Interference::Unknown
            } else {
                Interference::Source(Interferer {
                    power_w: from_w,
                    x_m,
                    y_m,
                })
            },
            noise_w: self.noise_w,
            reverse,
            rx_power_w,
            fitted_gap: self.fitted_gap,
            tolerance,
        };
        let pass = self.pass;
        let sites = Some(self.sites).filter(|bytes| *bytes != NO_SITES);
        let sites = sites.map(Sites::from_bytes);
        if sites.is_some_and(|sites| !sites.are_valid()) {
            return None;
        }
        Upload::checked(pass.number(), pass.digest(), config, sites).ok()
    }
}
