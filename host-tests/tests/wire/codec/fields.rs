//! Names of the tables for values that the tests keep together.

/// Defines a module for `#[serde(flatten, with = ...)]`: a value as several fields of a message.
macro_rules! fields {
    ($module:ident: $type:ty, [$($shape:tt)*], $($name:ident: $of:ty),*) => {
        pub(crate) mod $module {
            use super::*;

            #[derive(Serialize, Deserialize)]
            struct Fields {
                $($name: $of),*
            }

            pub(crate) fn serialize<S: Serializer>(value: &$type, to: S) -> Result<S::Ok, S::Error> {
                let $($shape)* = *value;
                Fields { $($name),* }.serialize(to)
            }

            pub(crate) fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<$type, D::Error> {
                let Fields { $($name),* } = Fields::deserialize(from)?;
                Ok($($shape)*)
            }
        }
    };
}

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::SizedView;

fields!(
    latest_mission: (u16, u16),
    [(latest_mission, latest_mission_version)],
    latest_mission: u16,
    latest_mission_version: u16
);
fields!(mission: (u16, u16), [(mission, version)], mission: u16, version: u16);
fields!(
    agreed: SizedView,
    [SizedView { id: agreed_view, relays: agreed_relays }],
    agreed_view: u32,
    agreed_relays: u16
);
fields!(
    base: SizedView,
    [SizedView { id: base_view, relays: base_relays }],
    base_view: u32,
    base_relays: u16
);
fields!(
    places: [f32; 5],
    [[x_m, target_m, y_m, altitude_m, apart_m]],
    x_m: f32,
    target_m: f32,
    y_m: f32,
    altitude_m: f32,
    apart_m: f32
);
fields!(
    source: [f32; 4],
    [[source_power_w, source_x_m, source_y_m, source_at_rx_w]],
    source_power_w: f32,
    source_x_m: f32,
    source_y_m: f32,
    source_at_rx_w: f32
);
fields!(
    receiver: [f32; 2],
    [[rx_power_w, rx_measurements]],
    rx_power_w: f32,
    rx_measurements: f32
);
fields!(
    sites: [i32; 6],
    [[tx_lat_e7, tx_lon_e7, tx_amsl_mm, rx_lat_e7, rx_lon_e7, rx_amsl_mm]],
    tx_lat_e7: i32,
    tx_lon_e7: i32,
    tx_amsl_mm: i32,
    rx_lat_e7: i32,
    rx_lon_e7: i32,
    rx_amsl_mm: i32
);

/// Sums of a Sense: the products of the terms, those with v, and four more.
pub(crate) mod sums {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Fields {
        sum_ab: [f32; 10],
        sum_av: [f32; 4],
        sum_vv: f32,
        places: f32,
        measurements: f32,
        age_s: f32,
    }

    pub(crate) fn serialize<S: Serializer>(sums: &[f32; 18], to: S) -> Result<S::Ok, S::Error> {
        let (ab, rest) = sums.split_at(10);
        Fields {
            sum_ab: ab.try_into().unwrap(),
            sum_av: rest[..4].try_into().unwrap(),
            sum_vv: rest[4],
            places: rest[5],
            measurements: rest[6],
            age_s: rest[7],
        }
        .serialize(to)
    }

    pub(crate) fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<[f32; 18], D::Error> {
        let sums = Fields::deserialize(from)?;
        let last = [sums.sum_vv, sums.places, sums.measurements, sums.age_s];
        let all = [&sums.sum_ab[..], &sums.sum_av, &last].concat();
        Ok(all.try_into().unwrap())
    }
}
