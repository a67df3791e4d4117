//! Elevation files written by the tests.

use std::path::PathBuf;

use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

/// GeoTIFF for a test: north-west grid point, cell size, EPSG code, numbers of cells and nodata value.
pub(crate) struct Raster {
    pub(crate) corner: [f64; 2],
    pub(crate) cell: [f64; 2],
    pub(crate) size: [u32; 2],
    pub(crate) epsg: u16,
    pub(crate) nodata: Option<f32>,
    /// True if the tie point is the position of a height; false if it is the corner of a cell.
    pub(crate) is_point: bool,
    /// GDAL's metadata, as XML.
    pub(crate) metadata: Option<&'static str>,
    /// EPSG code of the vertical coordinate system.
    pub(crate) vertical: Option<u16>,
}

impl Raster {
    /// Creates a GeoTIFF with longitude and latitude as coordinates.
    pub(crate) fn geographic(west: f64, north: f64, cell: f64, size: [u32; 2]) -> Self {
        Self {
            corner: [west, north],
            cell: [cell; 2],
            size,
            epsg: 4326,
            nodata: None,
            is_point: true,
            metadata: None,
            vertical: None,
        }
    }

    /// Writes the GeoTIFF. `height` returns the height at an easting and northing.
    pub(crate) fn write(&self, file: &PathBuf, height: impl Fn(f64, f64) -> f64) {
        let [columns, rows] = self.size;
        let mut values = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let east = self.corner[0] + f64::from(column) * self.cell[0];
                values.push(height(east, self.corner[1] - f64::from(row) * self.cell[1]) as f32);
            }
        }
        let mut encoder = TiffEncoder::new(std::fs::File::create(file).unwrap()).unwrap();
        let mut image = encoder
            .new_image::<colortype::Gray32Float>(columns, rows)
            .unwrap();
        let half = if self.is_point { 0.0 } else { 0.5 };
        let tie = [
            0.0,
            0.0,
            0.0,
            self.corner[0] - half * self.cell[0],
            self.corner[1] + half * self.cell[1],
            0.0,
        ];
        let code = if matches!(self.epsg, 4000..5000) {
            [2048, 0, 1, self.epsg]
        } else {
            [3072, 0, 1, self.epsg]
        };
        let raster = [1025, 0, 1, if self.is_point { 2 } else { 1 }];
        let mut keys = [[1, 1, 0, 2], raster, code].concat();
        if let Some(vertical) = self.vertical {
            keys.extend([4096, 0, 1, vertical]);
            keys[3] += 1;
        }
        let tags = image.encoder();
        tags.write_tag(
            Tag::ModelPixelScaleTag,
            [self.cell[0], self.cell[1], 0.0].as_slice(),
        )
        .unwrap();
        tags.write_tag(Tag::ModelTiepointTag, tie.as_slice())
            .unwrap();
        tags.write_tag(Tag::GeoKeyDirectoryTag, keys.as_slice())
            .unwrap();
        if let Some(nodata) = self.nodata {
            tags.write_tag(Tag::GdalNodata, nodata.to_string().as_str())
                .unwrap();
        }
        if let Some(metadata) = self.metadata {
            tags.write_tag(Tag::Unknown(42112), metadata).unwrap();
        }
        image.write_data(&values).unwrap();
    }
}

/// Writes an SRTM tile of 1201 x 1201 heights. `height` returns the height at a longitude and latitude.
pub(crate) fn hgt(file: &PathBuf, [west, south]: [f64; 2], height: impl Fn(f64, f64) -> f64) {
    let mut bytes = Vec::new();
    for row in 0..1201 {
        for column in 0..1201 {
            let value = height(
                west + f64::from(column) / 1200.0,
                south + 1.0 - f64::from(row) / 1200.0,
            );
            bytes.extend((value.round() as i16).to_be_bytes());
        }
    }
    std::fs::write(file, bytes).unwrap();
}
