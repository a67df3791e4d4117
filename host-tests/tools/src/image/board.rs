//! The boards that images are made for.

use std::path::{Path, PathBuf};

use uav_relay_block::ADDRESS;

use super::uf2::Family;

/// A board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Board {
    /// As `--board` has it.
    pub name: &'static str,
    /// What cargo builds for.
    pub target: &'static str,
    /// Where its package is, from the checkout's root.
    manifest: &'static str,
    package: &'static str,
    /// Whether its images are examples of that, and no binaries.
    examples: bool,
    /// With a UART to each neighbour, and with a radio.
    images: [&'static str; 2],
    /// Where its configuration block begins.
    pub block: u32,
    /// Which UF2 files its boot ROM takes, if any.
    pub uf2: Option<Family>,
}

/// All boards.
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
    /// The board of that name.
    pub fn named(name: &str) -> Option<Self> {
        BOARDS.into_iter().find(|board| board.name == name)
    }

    /// What cargo is to be told, and where the ELF is then, both from the checkout's root.
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

    /// What the files of an image are called, without their extension.
    pub fn stem(&self, radio: bool) -> String {
        format!("{}-{}", self.name, if radio { "radio" } else { "wires" })
    }
}
