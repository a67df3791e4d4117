//! A plan on earth: sites, relays, hops and interferers, for a map or a globe.
//!
//! | file | one idea |
//! | --- | --- |
//! | `feature` | what there is to show, and where |
//! | [`geojson`] | as GeoJSON (RFC 7946) |
//! | [`kml`] | as KML 2.2 |

mod feature;
pub mod geojson;
pub mod kml;

pub use feature::{Feature, Map, Number};
