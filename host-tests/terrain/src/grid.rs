//! Elevation grids: files, and the height of the ground at a latitude and longitude.
//!
//! | file | accepted |
//! | --- | --- |
//! | `*.hgt` | SRTM tile of 1° with 1201, 3601 or 7201 heights per row, named by its south-west corner, such as `N47E008.hgt` |
//! | GeoTIFF | one band; latitude and longitude (EPSG 4326 or 4258) or UTM (EPSG 326zz, 327zz or 258zz), north up; heights in metres |
//!
//! All files are parts of one grid: they have the same coordinate system, equal cells, and aligned cells. Between four
//! grid points the height is interpolated bilinearly. The four points may be in different files. Files may overlap if
//! their heights differ by at most 1 m; the first file then counts.
//!
//! The vertical datum is not converted: all heights count as heights above the mean sea level.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

/// Range of valid heights of the ground, m. Any other value in an elevation file means that the height is unknown.
const HEIGHTS: std::ops::RangeInclusive<f64> = -500.0..=9000.0;

/// Largest relative difference between the cell sizes of two files of one grid.
const SAME_CELL: f64 = 1e-6;

/// Largest offset between the grid points of two files, as a fraction of a cell.
const ALIGNED: f64 = 0.02;

/// Largest difference of height between two overlapping files, m.
const SAME_M: f64 = 1.0;

/// EPSG codes of vertical coordinate systems in feet.
const IN_FEET: [u16; 15] = [
    5614, 5702, 5754, 6130, 6131, 6132, 6358, 6359, 6360, 8050, 8051, 8052, 8053, 8228, 8897,
];

/// Metres per degree of latitude, for the size of cells and for error texts.
const PER_DEGREE_M: f64 = 111_320.0;

/// Tag of GDAL's metadata: an XML text with scale, offset and unit of the values.
const GDAL_METADATA: u16 = 42112;

/// Coordinate system of a grid.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum System {
    /// Longitude and latitude, degrees.
    Geographic,
    /// Easting and northing, m, in a zone of the Universal Transverse Mercator projection.
    Utm {
        /// Number of the UTM zone, 1 to 60.
        zone: u8,
        /// True in the southern hemisphere, where northings begin at 10 000 km.
        south: bool,
    },
}

impl System {
    /// Returns the coordinate system with this EPSG code; `None` if the code is not supported.
    fn of_epsg(code: u16) -> Option<Self> {
        let utm = |zone: u16, south| {
            let zone = u8::try_from(zone)
                .ok()
                .filter(|zone| (1..=60).contains(zone))?;
            Some(Self::Utm { zone, south })
        };
        match code {
            // ETRS89 differs from WGS84 by less than a metre.
            4326 | 4258 => Some(Self::Geographic),
            25828..=25838 => utm(code - 25800, false),
            32601..=32660 => utm(code - 32600, false),
            32701..=32760 => utm(code - 32700, true),
            _ => None,
        }
    }

    /// Returns the coordinates of a point in this system: east, then north.
    fn coordinates(self, lat_deg: f64, lon_deg: f64) -> [f64; 2] {
        let Self::Utm { zone, south } = self else {
            return [lon_deg, lat_deg];
        };
        let (north, east, _) = utm::to_utm_wgs84(lat_deg, lon_deg, zone);
        // The crate `utm` adds 10 000 km at the equator and south of it.
        let equator = if lat_deg > 0.0 { 0.0 } else { 1e7 };
        [east, north - equator + if south { 1e7 } else { 0.0 }]
    }
}

impl std::fmt::Display for System {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Geographic => f.write_str("latitude and longitude"),
            Self::Utm { zone, south } => {
                write!(f, "UTM zone {zone}{}", if *south { 'S' } else { 'N' })
            }
        }
    }
}

/// Part of the elevation grid that one file contains.
struct Tile {
    file: String,
    system: System,
    /// Size of a cell, east and south, in the units of the coordinate system.
    cell: [f64; 2],
    /// Coordinates, east then north, of the tile's north-west grid point.
    corner: [f64; 2],
    /// Column and row of the tile's north-west grid point in the grid of all files.
    at: [i64; 2],
    columns: usize,
    rows: usize,
    /// Heights, m, row by row from north to south.
    heights: Vec<f32>,
    nodata: Option<f32>,
}

/// Height at one grid point, or the reason why it is unknown.
enum Node<'a> {
    Height(f64),
    /// The height is unknown: the file has an invalid value at this point. The fields are the tile and the value.
    Hole(&'a Tile, f32),
    Outside,
}

/// Elevation model: the heights of one or several files.
#[expect(missing_debug_implementations, reason = "millions of heights")]
pub struct Terrain {
    tiles: Vec<Tile>,
    system: System,
    cell: [f64; 2],
    corner: [f64; 2],
}

impl Terrain {
    /// Reads the elevation model in `files`, at least one.
    ///
    /// # Errors
    /// A text that names the file and the problem: an unreadable or unsupported file, or files that belong to different
    /// grids.
    pub fn load(files: &[impl AsRef<Path>]) -> Result<Self, String> {
        let tiles = files.iter().map(|file| Tile::load(file.as_ref()));
        let mut tiles = tiles.collect::<Result<Vec<_>, _>>()?;
        let first = tiles.first().ok_or("no elevation file is given")?;
        let (name, system) = (first.file.clone(), first.system);
        let (cell, corner) = (first.cell, first.corner);
        for tile in &mut tiles {
            tile.at = tile.place_in(system, cell, corner).map_err(|which| {
                format!(
                    "{}: {which} differs from that of {name} ({system}, cells of {} x {}): all elevation files must be parts of one grid; resample one of them",
                    tile.file, cell[0], cell[1]
                )
            })?;
        }
        for (at, tile) in tiles.iter().enumerate() {
            for other in tiles.iter().skip(at + 1) {
                tile.agrees_with(other)?;
            }
        }
        Ok(Self {
            tiles,
            system,
            cell,
            corner,
        })
    }

    /// Returns the length of a cell's shorter side at this latitude, m.
    pub fn cell_m(&self, lat_deg: f64) -> f64 {
        let [east, south] = self.cell;
        match self.system {
            System::Geographic => {
                PER_DEGREE_M * south.min(east * lat_deg.to_radians().cos().max(0.01))
            }
            System::Utm { .. } => east.min(south),
        }
    }

    /// Returns the height of the ground at a point, m above the mean sea level.
    ///
    /// # Errors
    /// A text that names the point and the file: no file covers the point, or the file has a hole there.
    pub fn height_m(&self, lat_deg: f64, lon_deg: f64) -> Result<f64, String> {
        let at = self.cells(lat_deg, lon_deg);
        interpolated(at, |node| self.node_m(node, lat_deg, lon_deg))
    }

    /// Returns the column and the row of a point in the elevation grid.
    ///
    /// They are whole numbers at a grid point, and fractions between grid points.
    pub fn cells(&self, lat_deg: f64, lon_deg: f64) -> [f64; 2] {
        let [east, north] = self.system.coordinates(lat_deg, lon_deg);
        [
            (east - self.corner[0]) / self.cell[0],
            (self.corner[1] - north) / self.cell[1],
        ]
    }

    /// Returns the height at a column and row of [`cells`](Self::cells), m; `None` for an unknown height.
    pub fn height_at(&self, cells: [f64; 2]) -> Option<f64> {
        let known = |node| {
            let mut nodes = self.tiles.iter().map(|tile| tile.node(node));
            nodes.find_map(|node| match node {
                Node::Height(height) => Some(height),
                Node::Hole(..) | Node::Outside => None,
            })
        };
        interpolated(cells, |node| known(node).ok_or(())).ok()
    }

    fn node_m(&self, at: [i64; 2], lat_deg: f64, lon_deg: f64) -> Result<f64, String> {
        let mut hole = None;
        for tile in &self.tiles {
            match tile.node(at) {
                Node::Height(height) => return Ok(height),
                Node::Hole(tile, value) => hole = hole.or(Some((tile, value))),
                Node::Outside => {}
            }
        }
        let place = format!("latitude {lat_deg:.6}, longitude {lon_deg:.6}");
        Err(match hole {
            Some((tile, value)) => format!(
                "{}: has no height at {place}: its value there is {value}; fill the hole, or add a file that covers it",
                tile.file
            ),
            None => self.not_covered(&place, lat_deg, lon_deg),
        })
    }

    fn not_covered(&self, place: &str, lat_deg: f64, lon_deg: f64) -> String {
        let extents = self.tiles.iter().map(Tile::extent).collect::<Vec<_>>();
        let swapped = self.system.coordinates(lon_deg.clamp(-80.0, 84.0), lat_deg);
        let swapped = if self.tiles.iter().any(|tile| tile.contains(swapped)) {
            "; latitude and longitude look swapped"
        } else {
            ""
        };
        let [east, north] = self.system.coordinates(lat_deg, lon_deg);
        let in_system = match self.system {
            System::Geographic => String::new(),
            utm @ System::Utm { .. } => {
                format!(" (easting {east:.0}, northing {north:.0} in {utm})")
            }
        };
        format!(
            "{place}{in_system} is not covered by the elevation files: {}{swapped}",
            extents.join(", ")
        )
    }
}

/// Returns the height at a fractional column and row, by bilinear interpolation.
///
/// `height` returns the height at a grid point.
fn interpolated<E>(
    [column, row]: [f64; 2],
    height: impl Fn([i64; 2]) -> Result<f64, E>,
) -> Result<f64, E> {
    // A point that coincides with a grid point, except for rounding, needs no other grid points.
    let split = |at: f64| {
        let whole = (at + 1e-6).floor();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the cast saturates, and no tile is there"
        )]
        let first = whole as i64;
        let share = (at - whole).max(0.0);
        (first, if share < 1e-6 { 0.0 } else { share })
    };
    let ((column, right), (row, down)) = (split(column), split(row));
    let mut sum = 0.0;
    for (row, weight_down) in [(row, 1.0 - down), (row + 1, down)] {
        for (column, weight) in [(column, 1.0 - right), (column + 1, right)] {
            let weight = weight * weight_down;
            if weight > 0.0 {
                sum += weight * height([column, row])?;
            }
        }
    }
    Ok(sum)
}

impl Tile {
    fn load(path: &Path) -> Result<Self, String> {
        let name = path.display().to_string();
        let is_srtm = path
            .extension()
            .is_some_and(|end| end.eq_ignore_ascii_case("hgt"));
        let read = if is_srtm { srtm(path) } else { geotiff(path) };
        read.map_err(|problem| format!("{name}: {problem}"))
    }

    /// Returns the column and row of this tile's north-west grid point in the grid of another tile.
    ///
    /// `system`, `cell` and `corner` describe the other tile. The error names the property in which the two grids
    /// differ.
    fn place_in(
        &self,
        system: System,
        cell: [f64; 2],
        corner: [f64; 2],
    ) -> Result<[i64; 2], String> {
        if self.system != system {
            return Err(format!("its coordinate system, {},", self.system));
        }
        let is_same = |own: f64, cell: f64| (own / cell - 1.0).abs() <= SAME_CELL;
        if !(is_same(self.cell[0], cell[0]) && is_same(self.cell[1], cell[1])) {
            return Err(format!(
                "its cell size, {} x {},",
                self.cell[0], self.cell[1]
            ));
        }
        let column = (self.corner[0] - corner[0]) / cell[0];
        let row = (corner[1] - self.corner[1]) / cell[1];
        if (column - column.round()).abs() > ALIGNED || (row - row.round()).abs() > ALIGNED {
            return Err(format!(
                "its origin, {} {}, is not at a grid point of the other file; this grid",
                self.corner[0], self.corner[1]
            ));
        }
        #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
        let at = [column.round() as i64, row.round() as i64];
        Ok(at)
    }

    /// Checks that the heights of this tile and of an overlapping tile agree.
    ///
    /// # Errors
    /// A text about the greatest difference, with both files, the place and both heights.
    fn agrees_with(&self, other: &Self) -> Result<(), String> {
        let range = |axis: usize, counts: [usize; 2]| {
            let from = [self, other].map(|tile| tile.at.get(axis).copied().unwrap_or_default());
            let end = from.into_iter().zip(counts);
            let end = end.map(|(from, count)| from.saturating_add_unsigned(count as u64));
            from[0].max(from[1])..end.min().unwrap_or_default()
        };
        let columns = range(0, [self.columns, other.columns]);
        let mut worst = None;
        let mut most_m = SAME_M;
        for row in range(1, [self.rows, other.rows]) {
            for column in columns.clone() {
                let at = [column, row];
                if let (Node::Height(own), Node::Height(others)) = (self.node(at), other.node(at))
                    && (own - others).abs() > most_m
                {
                    most_m = (own - others).abs();
                    worst = Some((at, own, others));
                }
            }
        }
        let Some(([column, row], own_m, others_m)) = worst else {
            return Ok(());
        };
        let x = self.corner[0] + self.cell[0] * (column - self.at[0]) as f64;
        let y = self.corner[1] - self.cell[1] * (row - self.at[1]) as f64;
        let place = match self.system {
            System::Geographic => format!("latitude {y:.6}, longitude {x:.6}"),
            utm @ System::Utm { .. } => format!("easting {x:.0}, northing {y:.0} in {utm}"),
        };
        Err(format!(
            "{} and {} contradict each other: at {place} their heights are {own_m:.1} m and {others_m:.1} m; allowed: a difference of at most {SAME_M} m where files overlap: leave one of them out, or cut it",
            self.file, other.file
        ))
    }

    fn node(&self, [column, row]: [i64; 2]) -> Node<'_> {
        let inside = |at: i64, from: i64, count: usize| {
            usize::try_from(at.saturating_sub(from))
                .ok()
                .filter(|at| *at < count)
        };
        let column = inside(column, self.at[0], self.columns);
        let row = inside(row, self.at[1], self.rows);
        let value = column
            .zip(row)
            .and_then(|(column, row)| self.heights.get(row * self.columns + column));
        let Some(&value) = value else {
            return Node::Outside;
        };
        let is_nodata = self
            .nodata
            .is_some_and(|nodata| nodata.total_cmp(&value).is_eq());
        let height = f64::from(value);
        if is_nodata || !HEIGHTS.contains(&height) {
            return Node::Hole(self, value);
        }
        Node::Height(height)
    }

    /// Returns the coordinates of the tile's north-west and south-east grid points.
    fn corners(&self) -> [[f64; 2]; 2] {
        let [west, north] = self.corner;
        let east = west + self.cell[0] * (self.columns - 1) as f64;
        let south = north - self.cell[1] * (self.rows - 1) as f64;
        [[west, north], [east, south]]
    }

    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let [[west, north], [east, south]] = self.corners();
        (west..=east).contains(&x) && (south..=north).contains(&y)
    }

    fn extent(&self) -> String {
        let [[west, north], [east, south]] = self.corners();
        match self.system {
            System::Geographic => format!(
                "{} has latitudes {south:.4} to {north:.4} and longitudes {west:.4} to {east:.4}",
                self.file
            ),
            System::Utm { .. } => format!(
                "{} has eastings {west:.0} to {east:.0} and northings {south:.0} to {north:.0}",
                self.file
            ),
        }
    }
}

/// Reads an SRTM tile. The file name states the tile's position.
fn srtm(path: &Path) -> Result<Tile, String> {
    let name = path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let corner = srtm_corner(&name).ok_or(
        "its name must begin with the latitude and longitude of its south-west corner, such as N47E008.hgt",
    )?;
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let side = [1201_usize, 3601, 7201]
        .into_iter()
        .find(|side| side * side * 2 == bytes.len());
    let side = side.ok_or_else(|| {
        format!(
            "has {} bytes; allowed: 2 bytes for each of 1201 x 1201, 3601 x 3601 or 7201 x 7201 heights",
            bytes.len()
        )
    })?;
    let heights = bytes.chunks_exact(2).map(|pair| match pair {
        [high, low] => f32::from(i16::from_be_bytes([*high, *low])),
        _ => f32::NAN,
    });
    let cell = 1.0 / (side - 1) as f64;
    Ok(Tile {
        file: path.display().to_string(),
        system: System::Geographic,
        cell: [cell, cell],
        corner: [corner[0], corner[1] + 1.0],
        at: [0, 0],
        columns: side,
        rows: side,
        heights: heights.collect(),
        nodata: Some(-32_768.0),
    })
}

/// Returns longitude and latitude of a tile's south-west corner, degrees, from a name such as N47E008.
fn srtm_corner(name: &str) -> Option<[f64; 2]> {
    let signed = |sign: &str, digits: &str, signs: [&str; 2], most: f64| {
        let degrees = f64::from(digits.parse::<u8>().ok()?);
        let side = signs
            .iter()
            .position(|known| sign.eq_ignore_ascii_case(known))?;
        (degrees <= most).then_some(if side == 0 { degrees } else { -degrees })
    };
    let lat = signed(name.get(..1)?, name.get(1..3)?, ["N", "S"], 90.0)?;
    let lon = signed(name.get(3..4)?, name.get(4..7)?, ["E", "W"], 180.0)?;
    Some([lon, lat])
}

fn geotiff(path: &Path) -> Result<Tile, String> {
    let said = |error: tiff::TiffError| error.to_string();
    let file = File::open(path).map_err(|error| error.to_string())?;
    let mut decoder = Decoder::new(BufReader::new(file)).map_err(said)?;
    let [columns, rows] = {
        let (columns, rows) = decoder.dimensions().map_err(said)?;
        [columns, rows].map(|side| usize::try_from(side).unwrap_or(usize::MAX))
    };
    let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag);
    let keys = keys.map_err(|_| "has no GeoTIFF keys, so its coordinate system is unknown")?;
    let key = |id: u16| {
        // The value is in the GeoTIFF directory itself.
        let mut entries = keys.chunks_exact(4).skip(1);
        entries.find_map(|entry| match entry {
            [key, 0, 1, value] if *key == id => Some(*value),
            _ => None,
        })
    };
    let (geographic, projected) = (key(2048), key(3072));
    let system = projected.or(geographic).and_then(System::of_epsg).ok_or_else(|| {
        let code = projected.or(geographic).map_or("none".to_owned(), |code| code.to_string());
        format!("has the EPSG code {code}; allowed: 4326 or 4258 (latitude and longitude), or UTM (32601 to 32660, 32701 to 32760, 25828 to 25838)")
    })?;
    if let Some(unit) = key(4099).filter(|unit| *unit != 9001) {
        return Err(format!(
            "has heights in the unit {unit} (key 4099); allowed: 9001, metres"
        ));
    }
    match key(4096) {
        Some(code) if IN_FEET.contains(&code) => {
            return Err(format!(
                "has heights in feet: its vertical coordinate system is EPSG {code} (key 4096); allowed: heights in metres above the mean sea level"
            ));
        }
        // These codes are those of GeoTIFF 1.0.
        Some(code @ (4979 | 5001..=5033)) => {
            return Err(format!(
                "has heights above the ellipsoid: its vertical coordinate system has the code {code} (key 4096); allowed: heights in metres above the mean sea level"
            ));
        }
        _ => {}
    }
    let metadata = decoder.get_tag_ascii_string(Tag::Unknown(GDAL_METADATA));
    for role in ["scale", "offset", "unittype"] {
        let value = metadata
            .as_ref()
            .ok()
            .and_then(|text| metadatum(text, role));
        if let Some(value) = value.filter(|value| !is_metres(value)) {
            return Err(format!(
                "has heights with the {role} {value} (tag {GDAL_METADATA}); allowed: heights in metres, without scale or offset"
            ));
        }
    }
    if decoder.get_tag_u32(Tag::PhotometricInterpretation).ok() == Some(0) {
        return Err("has inverted values (PhotometricInterpretation 0); allowed: 1".to_owned());
    }
    let scale = decoder
        .get_tag_f64_vec(Tag::ModelPixelScaleTag)
        .unwrap_or_default();
    let tie = decoder
        .get_tag_f64_vec(Tag::ModelTiepointTag)
        .unwrap_or_default();
    let (&[width, height, ..], &[column, row, _, x, y, _]) = (scale.as_slice(), tie.as_slice())
    else {
        return Err(
            "must be georeferenced by ModelPixelScale and one ModelTiepoint: rotated grids are not supported".to_owned(),
        );
    };
    let is_size = |side: f64| side > 0.0 && side.is_finite();
    if columns < 2
        || rows < 2
        || !is_size(width)
        || !is_size(height)
        || !(x.is_finite() && y.is_finite())
    {
        return Err(format!(
            "has {columns} x {rows} heights with cells of {width} x {height}; allowed: 2 x 2 or more, with cells above 0"
        ));
    }
    // By default a tie point is a corner of a cell, and the height belongs to the middle of the cell.
    let middle = if key(1025) == Some(2) { 0.0 } else { 0.5 };
    let nodata = decoder.get_tag_ascii_string(Tag::GdalNodata).ok();
    let nodata = nodata.and_then(|text| text.trim_matches(['\0', ' ']).parse::<f32>().ok());
    let heights = numbers(decoder.read_image().map_err(said)?)?;
    if heights.len() != columns * rows {
        return Err(format!(
            "has {} values for {columns} x {rows} heights; allowed: one value for each height (one band)",
            heights.len()
        ));
    }
    Ok(Tile {
        file: path.display().to_string(),
        system,
        cell: [width, height],
        corner: [x + (middle - column) * width, y - (middle - row) * height],
        at: [0, 0],
        columns,
        rows,
        heights,
        nodata,
    })
}

/// Returns the value of GDAL's metadata item with the role `role`; `None` if there is none.
fn metadatum<'a>(text: &'a str, role: &str) -> Option<&'a str> {
    let mut after = ['"', '\'']
        .into_iter()
        .filter_map(|quote| text.split_once(&format!("role={quote}{role}{quote}")));
    let (_, value) = after.next()?.1.split_once('>')?;
    Some(value.split_once('<')?.0.trim())
}

/// Returns true if `value` is the scale 1, the offset 0 or the unit metre.
///
/// A file with this scale, offset and unit has heights in metres.
fn is_metres(value: &str) -> bool {
    let is_number = [1.0, 0.0].map(Ok).contains(&value.parse::<f64>());
    is_number || ["m", "metre", "meter"].contains(&value.to_lowercase().as_str())
}

/// Converts the decoded values of a GeoTIFF image to heights.
#[expect(clippy::cast_possible_truncation, reason = "heights are far smaller")]
fn numbers(values: DecodingResult) -> Result<Vec<f32>, String> {
    Ok(match values {
        DecodingResult::U8(values) => values.into_iter().map(f32::from).collect(),
        DecodingResult::I8(values) => values.into_iter().map(f32::from).collect(),
        DecodingResult::U16(values) => values.into_iter().map(f32::from).collect(),
        DecodingResult::I16(values) => values.into_iter().map(f32::from).collect(),
        DecodingResult::U32(values) => values.into_iter().map(|value| value as f32).collect(),
        DecodingResult::I32(values) => values.into_iter().map(|value| value as f32).collect(),
        DecodingResult::F32(values) => values,
        DecodingResult::F64(values) => values.into_iter().map(|value| value as f32).collect(),
        _ => return Err("has 64 bit integers or 16 bit floats; allowed: 8 to 32 bit integers, 32 or 64 bit floats".to_owned()),
    })
}
