//! Flash images: converts the ELF that cargo builds to files for flashing a board.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ihex::Record;
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader as _, ProgramHeader as _};
use uav_relay_block::ADDRESS;

/// Board that `cargo image` supports.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Board {
    /// Name of the board, as given by `--board`.
    pub name: &'static str,
    /// Rust target triple of the board's microcontroller.
    pub target: &'static str,
    manifest: &'static str,
    package: &'static str,
    /// True if the images are examples of `package`; false if they are binaries of it.
    examples: bool,
    /// Names of the board's two images: one UART to each neighbour, or one UART to a shared radio.
    images: [&'static str; 2],
    /// Flash address at which the board's firmware reads the configuration block.
    pub block: u32,
    /// UF2 family that the board's boot ROM accepts; `None` if it reads no UF2 files.
    pub uf2: Option<Family>,
}

/// Boards that `cargo image` supports.
pub const BOARDS: [Board; 4] = [
    Board {
        name: "stm32f405",
        target: "thumbv7em-none-eabihf",
        manifest: "Cargo.toml",
        package: "uav-relay",
        examples: true,
        images: ["stm32f405", "stm32f405_radio"],
        block: ADDRESS,
        uf2: None,
    },
    Board {
        name: "stm32f405-embassy",
        target: "thumbv7em-none-eabihf",
        manifest: "examples/embassy/Cargo.toml",
        package: "relay-stm32f405",
        examples: false,
        images: ["wires", "radio"],
        block: ADDRESS,
        uf2: None,
    },
    Board {
        name: "nucleo-f446re",
        target: "thumbv7em-none-eabihf",
        manifest: "examples/embassy/Cargo.toml",
        package: "relay-nucleo-f446re",
        examples: false,
        images: ["wires", "radio"],
        block: 0x0806_0000,
        uf2: None,
    },
    Board {
        name: "pico2",
        target: "thumbv8m.main-none-eabihf",
        manifest: "examples/embassy/Cargo.toml",
        package: "relay-pico2",
        examples: false,
        images: ["wires", "radio"],
        block: 0x103F_F000,
        uf2: Some(Family::RP2350),
    },
];

impl Board {
    /// Returns the board called `name`; `None` if there is no such board.
    pub fn named(name: &str) -> Option<Self> {
        BOARDS.into_iter().find(|board| board.name == name)
    }

    /// Returns cargo's arguments for building the board's image, and the path of the ELF.
    ///
    /// With `radio` it is the image for a shared radio, else the image for a UART to each neighbour. All paths are
    /// relative to the root of the checkout.
    pub fn build(&self, radio: bool) -> (Vec<String>, PathBuf) {
        let [wires, radios] = self.images;
        let image = if radio { radios } else { wires };
        let kind = if self.examples { "--example" } else { "--bin" };
        let folder = if self.examples {
            "target"
        } else {
            "target/embassy"
        };
        let words = [
            "build",
            "--locked",
            "--manifest-path",
            self.manifest,
            "--package",
            self.package,
            "--profile",
            "firmware",
            "--target",
            self.target,
            "--target-dir",
            folder,
            kind,
            image,
        ];
        let mut elf = Path::new(folder).join(self.target).join("firmware");
        if self.examples {
            elf.push("examples");
        }
        (words.map(str::to_owned).into(), elf.join(image))
    }

    /// Returns the file name of the board's image without extension.
    ///
    /// With `radio` it is the image for a shared radio, else the image for a UART to each neighbour.
    pub fn stem(&self, radio: bool) -> String {
        format!("{}-{}", self.name, if radio { "radio" } else { "wires" })
    }
}

/// Largest distance between the first bytes of two parts of an image, bytes.
///
/// No supported flash is larger.
pub const LARGEST: u32 = 16 * 1024 * 1024;

/// Value of a byte in erased flash.
pub const BLANK: u8 = 0xFF;

/// Part of an image: contiguous bytes, and the flash address of the first byte.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Piece {
    /// Flash address of the first byte.
    pub address: u32,
    /// Contents of this part of the image, from `address` on.
    pub bytes: Vec<u8>,
}

/// Returns the parts of an ELF file that are loaded into flash, by physical (load) address.
///
/// # Errors
/// A text that states why the file is not a loadable ELF.
pub fn pieces(elf: &[u8]) -> Result<Vec<Piece>, String> {
    let wrong = |error: object::Error| format!("not a 32-bit ELF file: {error}");
    let header = FileHeader32::<LittleEndian>::parse(elf).map_err(wrong)?;
    let endian: LittleEndian = header.endian().map_err(wrong)?;
    let mut pieces = Vec::new();
    for segment in header.program_headers(endian, elf).map_err(wrong)? {
        let bytes = segment
            .data(endian, elf)
            .map_err(|()| "the ELF file is incomplete: its end is missing")?;
        if segment.p_type(endian) == PT_LOAD && !bytes.is_empty() {
            pieces.push(Piece {
                address: segment.p_paddr(endian),
                bytes: bytes.to_vec(),
            });
        }
    }
    pieces.sort_by_key(|piece| piece.address);
    if pieces.is_empty() {
        return Err("the ELF file has no loadable segments".into());
    }
    Ok(pieces)
}

/// Joins the parts of an image into one, with erased bytes in the gaps.
///
/// # Errors
/// Two parts overlap, or a part begins more than [`LARGEST`] bytes after the first part.
pub fn flat(pieces: &[Piece]) -> Result<Piece, String> {
    let first = pieces
        .first()
        .ok_or("an image without loadable segments")?
        .address;
    let mut bytes = Vec::new();
    for piece in pieces {
        let at = piece.address.checked_sub(first).filter(|at| *at <= LARGEST);
        let at = at.ok_or_else(|| {
            format!(
                "address {:#010x} is more than {LARGEST} bytes after the first one, {first:#010x}",
                piece.address
            )
        })?;
        let at = at as usize;
        if at < bytes.len() {
            return Err(format!(
                "two segments of the image overlap at {:#010x}",
                piece.address
            ));
        }
        bytes.resize(at, BLANK);
        bytes.extend(&piece.bytes);
    }
    Ok(Piece {
        address: first,
        bytes,
    })
}

const RECORD: u8 = 16;

/// Returns the image as the text of an Intel HEX file, with 32-bit addresses. The error is a text for the user.
pub fn hex(pieces: &[Piece]) -> Result<String, String> {
    let mut records = Vec::new();
    let mut above = None;
    for piece in pieces {
        let mut rest = piece.bytes.as_slice();
        let mut address = piece.address;
        while !rest.is_empty() {
            let [a, b, c, d] = address.to_be_bytes();
            let (high, offset) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            if above != Some(high) {
                above = Some(high);
                records.push(Record::ExtendedLinearAddress(high));
            }
            // A record must not cross a 64 KiB boundary.
            let room = 0x1_0000 - usize::from(offset);
            let len = usize::from(RECORD).min(room).min(rest.len());
            let (value, behind) = rest.split_at(len);
            records.push(Record::Data {
                offset,
                value: value.to_vec(),
            });
            address = address.wrapping_add(u32::try_from(len).unwrap_or_default());
            rest = behind;
        }
    }
    records.push(Record::EndOfFile);
    ihex::create_object_file_representation(&records)
        .map(|hex_file| hex_file + "\n")
        .map_err(|error| error.to_string())
}

// UF2: the file format of USB mass-storage boot loaders. Each block of 512 bytes carries its own flash address.
//
// | byte of a block | type | content |
// | --- | --- | --- |
// | 0 | 2 u32 | [`MAGIC`] |
// | 8 | u32 | flags: 0x2000, a family ID is present |
// | 12 | u32 | address of the first byte, a multiple of [`PAGE`] |
// | 16 | u32 | payload size: [`PAGE`] |
// | 20 | u32 | block number, from 0 |
// | 24 | u32 | number of blocks |
// | 28 | u32 | [`Family`] |
// | 32 | 476 bytes | a page, and zeros |
// | 508 | u32 | [`END`] |
//
// All numbers are little-endian.

/// First two words of each 512-byte block of a UF2 file.
pub const MAGIC: [u32; 2] = [0x0A32_4655, 0x9E5D_5157];

/// Last word of each 512-byte block of a UF2 file.
pub const END: u32 = 0x0AB1_6F30;

/// Number of image bytes in each block of a UF2 file.
pub const PAGE: u32 = 256;

const FAMILY_STATED: u32 = 0x2000;

/// Family number in a UF2 file. Only chips of this family accept the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Family(pub u32);

impl Family {
    /// Family of the RP2350 with Arm cores in secure state.
    pub const RP2350: Self = Self(0xE48B_FF59);
}

/// Returns the image as a UF2 file. A page is the content of one block, 256 bytes. Bytes of a page that are not in the
/// image have the value of erased flash.
///
/// # Errors
/// The image has more pages than the format can count.
pub fn uf2(pieces: &[Piece], family: Family) -> Result<Vec<u8>, String> {
    let mut pages = BTreeMap::new();
    for piece in pieces {
        for (address, byte) in (piece.address..).zip(&piece.bytes) {
            let page: &mut Vec<u8> = pages
                .entry(address - address % PAGE)
                .or_insert_with(|| vec![BLANK; PAGE as usize]);
            if let Some(place) = page.get_mut((address % PAGE) as usize) {
                *place = *byte;
            }
        }
    }
    let count = u32::try_from(pages.len())
        .map_err(|_| "the image has more pages than a UF2 file can hold")?;
    let mut file = Vec::new();
    for (number, (address, page)) in (0..).zip(&pages) {
        let [first, second] = MAGIC;
        for word in [
            first,
            second,
            FAMILY_STATED,
            *address,
            PAGE,
            number,
            count,
            family.0,
        ] {
            file.extend(word.to_le_bytes());
        }
        file.extend(page);
        file.extend([0; 476 - PAGE as usize]);
        file.extend(END.to_le_bytes());
    }
    Ok(file)
}
