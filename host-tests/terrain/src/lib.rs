//! Terrain below a chain of relays: elevation grids, profiles of hops, and diffraction loss.
//!
//! | module | content |
//! | --- | --- |
//! | [`grid`] | [`grid::Terrain`]: GeoTIFF and SRTM files, and the height of the ground at a latitude and longitude |
//! | [`profile`] | [`profile::Ground`]: the terrain along the line from Tx to Rx; profile and clearance of a hop |
//! | [`diffraction`] | the diffraction loss of a profile by Recommendation ITU-R P.526-15 |
//! | [`report`] | report of the terrain below each hop and each relay of a chain |
//! | [`room`] | interval of x in which a relay may move while its hops stay clear |
//!
//! Heights are in metres above the mean sea level. Errors are lines of text that name the file, the place and the value.
//!
//! # Dependencies
//! `tiff` decodes GeoTIFF files: it is maintained by the image-rs organisation and has few dependencies. The tags that
//! GeoTIFF adds are read here, because `geotiff` has no coordinate systems and no nodata values, and `geotiff-reader`
//! needs ndarray and several more crates. `utm` converts to UTM coordinates. SRTM files have two bytes for each height.
//! They are read here, because `srtm_reader` returns only the nearest height, panics outside a tile, and prints to
//! standard error.

pub mod diffraction;
pub mod grid;
pub mod profile;
pub mod report;
pub mod room;
