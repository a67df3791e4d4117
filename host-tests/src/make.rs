//! Constructors of small values that many tests need. The arguments are in the order of the fields.

use std::ops::RangeInclusive;

use uav_relay::wire::frame::Header;
use uav_relay::{
    Adjust, Auth, Band, Geodetic, Identity, Interferer, Key, Local, Placement, Profile,
};
use uav_relay_oracle::random::{Chain, Style};
use uav_relay_oracle::reference;
use uav_relay_scenario::{RelayOverride, Source};

/// Network number of the relays in these tests.
pub const NETWORK: u16 = 7;

pub const fn adjust(rounds: u16, explore_m: f32, local: Local) -> Adjust {
    Adjust {
        rounds,
        explore_m,
        local,
    }
}

pub const fn auth(key: [u8; 32], epoch: u32) -> Auth {
    let key = Key::new(key);
    Auth { key, epoch }
}

pub const fn band(least_m: f32, most_m: f32) -> Band {
    Band { least_m, most_m }
}

pub const fn geodetic(lat_e7: i32, lon_e7: i32, amsl_mm: i32) -> Geodetic {
    Geodetic {
        lat_e7,
        lon_e7,
        amsl_mm,
    }
}

/// Returns the header of an unsigned frame in the network [`NETWORK`].
pub const fn header(sender: u16, destination: u16, counter: u32) -> Header {
    Header {
        network: NETWORK,
        sender,
        destination,
        counter,
    }
}

/// Returns the identity of relay `index` in the network [`NETWORK`].
pub const fn identity(index: u16) -> Identity {
    let network = NETWORK;
    Identity { network, index }
}

pub const fn interferer(power_w: f32, x_m: f32, y_m: f32) -> Interferer {
    Interferer { power_w, x_m, y_m }
}

pub const fn placement(x_m: f32, y_m: f32, altitude_m: f32) -> Placement {
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}

pub const fn profile(altitude_m: f32, power_w: f32) -> Profile {
    Profile {
        altitude_m,
        power_w,
    }
}

/// Returns the own altitude and power of a relay in a scenario file.
pub const fn relay_override(altitude_m: Option<f64>, power_w: Option<f64>) -> RelayOverride {
    RelayOverride {
        altitude_m,
        power_w,
    }
}

/// Returns a relay of the f64 reference model.
pub const fn reference_relay(altitude_m: f64, power_w: f64) -> reference::Relay {
    reference::Relay {
        altitude_m,
        power_w,
    }
}

/// Returns an interferer of a scenario file.
pub const fn source(power_w: f64, x_m: f64, y_m: f64) -> Source {
    Source { power_w, x_m, y_m }
}

/// Returns the style of random chains of the f64 reference model.
pub const fn style(relays: RangeInclusive<u32>, chain: Chain) -> Style {
    Style { relays, chain }
}
