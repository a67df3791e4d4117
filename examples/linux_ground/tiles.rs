//! Map pictures of the page, from a PMTiles archive.

use std::fs::File;
use std::future::{Future, ready};
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::Path;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use pmtiles::{
    AsyncBackend, AsyncPmTilesReader, BackendResponse, PmtError, PmtResult, TileCoord, TileType,
};
use uav_relay_screen::Tiles;

/// Maximum size of a map picture or of a directory of the archive, bytes.
const MOST: usize = 4 * 1024 * 1024;

/// Archive file, which is read but not mapped into memory.
///
/// A memory map would end this program if another program truncated the file.
struct Archive(File);

impl Archive {
    fn bytes(&self, offset: u64, length: usize, is_exact: bool) -> io::Result<Vec<u8>> {
        if length > MOST {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let mut bytes = vec![0; length];
        let mut len = 0;
        while let Some(room) = bytes.get_mut(len..).filter(|room| !room.is_empty()) {
            match self.0.read_at(room, offset + len as u64) {
                Ok(0) if is_exact => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(0) => break,
                Ok(count) => len += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        bytes.truncate(len);
        Ok(bytes)
    }

    fn response(
        &self,
        offset: u64,
        length: usize,
        is_exact: bool,
    ) -> impl Future<Output = PmtResult<BackendResponse>> + Send + use<> {
        let bytes = self.bytes(offset, length, is_exact);
        ready(match bytes {
            Ok(bytes) => Ok(BackendResponse::new(bytes.into())),
            Err(error) => Err(PmtError::Reading(error)),
        })
    }
}

impl AsyncBackend for Archive {
    fn read_exact(
        &self,
        offset: u64,
        length: usize,
    ) -> impl Future<Output = PmtResult<BackendResponse>> + Send {
        self.response(offset, length, true)
    }

    fn read(
        &self,
        offset: u64,
        length: usize,
    ) -> impl Future<Output = PmtResult<BackendResponse>> + Send {
        self.response(offset, length, false)
    }
}

/// Returns the result of a future that is ready at once; `None` if the future would have to wait.
fn at_once<T>(future: impl Future<Output = PmtResult<T>>) -> PmtResult<Option<T>> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result.map(Some),
        Poll::Pending => Ok(None),
    }
}

/// Opens a PMTiles archive of pictures.
///
/// # Errors
/// One line that names the option, the file and the fault.
pub(crate) fn open(file: &Path) -> Result<Tiles, String> {
    let wrong = |why: String| format!("--tiles {}: {why}", file.display());
    let archive = File::open(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    let opened = at_once(AsyncPmTilesReader::try_from_source(Archive(archive)));
    let not_tiles = |error| {
        wrong(format!(
            "is not a PMTiles archive of version 3 ({error}); `pmtiles convert` writes one from an MBTiles file"
        ))
    };
    let reader = opened
        .map_err(not_tiles)?
        .ok_or_else(|| wrong("cannot be read".to_owned()))?;
    let header = reader.get_header();
    let media = match header.tile_type {
        it @ (TileType::Png | TileType::Jpeg | TileType::Webp) => it.content_type(),
        other => {
            return Err(wrong(format!(
                "has tiles of the type {}: must be pictures (PNG, JPEG or WebP)",
                other.content_type()
            )));
        }
    };
    let zooms = [header.min_zoom, header.max_zoom];
    let metadata = at_once(reader.get_metadata()).ok().flatten();
    let metadata = metadata.and_then(|it| serde_json::from_str::<serde_json::Value>(&it).ok());
    let attribution = metadata.and_then(|it| Some(plain(it.get("attribution")?.as_str()?)));
    Ok(Tiles {
        zooms,
        attribution: attribution.unwrap_or_default(),
        read: Box::new(move |zoom, x, y| {
            let tile = reader.get_tile_decompressed(TileCoord::new(zoom, x, y).ok()?);
            let picture = at_once(tile).ok().flatten().flatten()?;
            Some((media, picture.into()))
        }),
    })
}

/// Returns a text without its HTML tags.
fn plain(html: &str) -> String {
    let mut parts = html.split('<');
    let first = parts.next().unwrap_or_default().to_owned();
    let rest = parts.map(|part| part.split_once('>').map_or("", |(_, text)| text));
    let text = rest.fold(first, |all, part| all + part);
    text.replace("&copy;", "©").replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by it")]

    use std::fs::{File, read, write};

    use pmtiles::{PmTilesWriter, TileCoord, TileType};

    use super::open;

    #[test]
    fn pictures_are_read_from_a_file_and_faults_of_the_file_are_named() {
        let folder = std::env::temp_dir().join(format!("tiles-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [good, vectors, text, short] =
            ["good", "vectors", "text", "short"].map(|name| folder.join(name));
        let written = |file, kind| {
            let writer = PmTilesWriter::new(kind).min_zoom(10).max_zoom(16);
            let metadata =
                r#"{"attribution": "<a href=\"https://example.org\">&copy; Somebody</a>"}"#;
            let mut writer = writer
                .metadata(metadata)
                .create(File::create(file).unwrap())
                .unwrap();
            // So many that they need leaf directories.
            for number in 0..40_000_u32 {
                let coord = TileCoord::new(16, number % 200, number / 200).unwrap();
                writer.add_tile(coord, &number.to_le_bytes()).unwrap();
            }
            writer.finalize().unwrap();
        };
        written(&good, TileType::Png);
        written(&vectors, TileType::Mvt);
        write(&text, "not an archive").unwrap();
        let tiles = open(&good).unwrap();
        // A connection of the page has a stack of 1 MiB.
        let little = std::thread::Builder::new().stack_size(256 * 1024);
        let looks_up = move || {
            for number in [0, 199, 200, 31_234, 39_999_u32] {
                let tile = (tiles.read)(16, number % 200, number / 200);
                assert_eq!(tile, Some(("image/png", number.to_le_bytes().to_vec())));
            }
            tiles
        };
        let tiles = little.spawn(looks_up).unwrap().join().unwrap();
        assert_eq!((tiles.zooms, &*tiles.attribution), ([10, 16], "© Somebody"));
        assert_eq!((tiles.read)(16, 200, 0), None);
        assert_eq!((tiles.read)(15, 0, 0), None);
        for (file, why) in [
            (
                &vectors,
                "has tiles of the type application/vnd.mapbox-vector-tile: must be pictures",
            ),
            (&text, "is not a PMTiles archive of version 3"),
            (&short, "cannot be read: "),
        ] {
            let error = open(file).unwrap_err();
            let named = format!("--tiles {}: {why}", file.display());
            assert!(
                error.starts_with(&named) && !error.contains('\n'),
                "{error}"
            );
        }
        // A file that is cut off while it is open has no more tiles.
        let all = read(&good).unwrap();
        write(&short, &all).unwrap();
        let tiles = open(&short).unwrap();
        File::options()
            .write(true)
            .open(&short)
            .unwrap()
            .set_len(1_000)
            .unwrap();
        assert_eq!((tiles.read)(16, 199, 199), None);
        // No byte of the file can end the program.
        for at in (0..all.len()).step_by(all.len() / 200) {
            let mut broken = all.clone();
            *broken.get_mut(at).unwrap() ^= 0xFF;
            write(&text, &broken).unwrap();
            if let Ok(tiles) = open(&text) {
                for number in [0, 31_234, 39_999_u32] {
                    _ = (tiles.read)(16, number % 200, number / 200);
                }
            }
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
