//! Geographic output of a plan: sites, relays, hops and interferers for a map or globe.
//!
//! | file | content |
//! | --- | --- |
//! | `feature` | features and their coordinates |
//! | [`geojson`] | GeoJSON (RFC 7946) |
//! | [`kml`] | KML 2.2 |

mod feature;
pub mod geojson;
pub mod kml;

pub use feature::{Feature, Map, Number};
