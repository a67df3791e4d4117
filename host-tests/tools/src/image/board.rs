//! Supported boards: what cargo builds for each, and where its block goes.

use std::path::{Path, PathBuf};

use uav_relay_block::ADDRESS;

use super::uf2::Family;

/// A supported board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Board {
    /// Name, as accepted by `--board`.
    pub name: &'static str,
    /// Rust target triple.
    pub target: &'static str,
    manifest: &'static str,
    package: &'static str,
    /// True if the images are examples of the package, false if they are binaries.
    examples: bool,
    /// Image names: with a UART to each neighbour, and with a shared radio.
    images: [&'static str; 2],
    /// Flash address of the configuration block.
    pub block: u32,
    /// UF2 family that the boot ROM accepts, if any.
    pub uf2: Option<Family>,
}

/// The supported boards.
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
    /// Returns the board with that name.
    pub fn named(name: &str) -> Option<Self> {
        BOARDS.into_iter().find(|board| board.name == name)
    }

    /// Returns cargo's arguments and the path of the resulting ELF, both relative to the checkout's root.
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

    /// Returns the file name of an image, without extension.
    pub fn stem(&self, radio: bool) -> String {
        format!("{}-{}", self.name, if radio { "radio" } else { "wires" })
    }
}
