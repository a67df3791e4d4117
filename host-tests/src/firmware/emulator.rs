//! Emulated drone: a QEMU process that ends with its owner, and a socket for each of its serial ports.
//!
//! The machine `netduinoplus2` is an STM32F405. It has no clock tree: `SysTick` counts at 168 MHz, so a firmware that
//! assumes 16 MHz runs 10.5 times as fast. It has no baud rates: bytes arrive as fast as they are read.

use std::io;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use uav_relay_tools::provision::config;

use super::{MISSING, QEMU};

/// Speed of an emulated drone's clock relative to the wall clock, with [`Life::Fast`].
///
/// `SysTick` in QEMU counts at 168 MHz; the firmware assumes 16 MHz.
pub const SPEED: f64 = 168.0 / 16.0;

const PATIENCE: Duration = Duration::from_secs(30);

/// Speed of an emulated drone's clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Life {
    /// [`SPEED`] times as fast as the wall clock.
    #[default]
    Fast,
    /// Real time.
    Real,
}

impl Life {
    /// Returns the speed relative to the wall clock.
    pub const fn speed(self) -> f64 {
        match self {
            Self::Fast => SPEED,
            Self::Real => 1.0,
        }
    }
}

/// Serial port of the drone's microcontroller, in QEMU's order.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Uart {
    /// USART1: autopilot.
    Usart1,
    /// USART2: upstream neighbour, or radio.
    Usart2,
    /// USART3: downstream neighbour.
    Usart3,
    /// UART4: log.
    Uart4,
}

const UARTS: [Uart; 4] = [Uart::Usart1, Uart::Usart2, Uart::Usart3, Uart::Uart4];

/// Initial content of a part of the flash: address and bytes.
pub type Kept = (u32, Vec<u8>);

/// Running emulated drone: QEMU process, and folder with its files.
#[derive(Debug)]
pub struct Emulator {
    process: Child,
    folder: PathBuf,
}

/// Sockets of an emulated drone's serial ports, in the order of [`Uart`].
pub type Sockets = [UnixStream; 4];

impl Emulator {
    /// Starts a drone with the firmware `image`, its configuration `block`, and flash contents `kept`.
    ///
    /// `life` is the speed of its clock. Its files are in the new folder `name` in `folder`.
    ///
    /// # Errors
    /// [`MISSING`] if QEMU is not installed; otherwise the fault, with QEMU's messages.
    pub fn start(
        image: &Path,
        block: &[u8],
        kept: &[Kept],
        folder: &Path,
        name: &str,
        life: Life,
    ) -> Result<(Self, Sockets), String> {
        let failed = |error: io::Error| format!("{name}: {error}");
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).map_err(failed)?;
        let file = folder.join("block.bin");
        std::fs::write(&file, block).map_err(failed)?;
        let said = std::fs::File::create(folder.join("qemu.txt")).map_err(failed)?;
        let mut command = Command::new(QEMU);
        command
            .args(["-machine", "netduinoplus2", "-display", "none"])
            .args(["-monitor", "none"])
            .arg("-kernel")
            .arg(image)
            .args(loaded(&file, config::ADDRESS))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(said);
        if life == Life::Real {
            command.env("LD_PRELOAD", super::slow::library()?);
        }
        for (address, bytes) in kept {
            let file = folder.join(format!("{address:#x}.bin"));
            std::fs::write(&file, bytes).map_err(failed)?;
            command.args(loaded(&file, *address));
        }
        let mut listeners = Vec::new();
        for uart in UARTS {
            let path = folder.join(format!("{uart:?}"));
            let listener = UnixListener::bind(&path).map_err(failed)?;
            listener.set_nonblocking(true).map_err(failed)?;
            command
                .arg("-serial")
                .arg(format!("unix:{}", path.display()));
            listeners.push(listener);
        }
        let process = command.spawn().map_err(|error| {
            if error.kind() == io::ErrorKind::NotFound {
                MISSING.into()
            } else {
                failed(error)
            }
        })?;
        let mut drone = Self { process, folder };
        let mut sockets = Vec::new();
        for listener in &listeners {
            sockets.push(drone.accept(listener)?);
        }
        let sockets = sockets
            .try_into()
            .map_err(|_| format!("{name}: a serial port is missing"))?;
        Ok((drone, sockets))
    }

    fn accept(&mut self, listener: &UnixListener) -> Result<UnixStream, String> {
        let started = Instant::now();
        loop {
            match listener.accept() {
                Ok((socket, _)) => {
                    let ready = socket.set_nonblocking(false);
                    return ready.map(|()| socket).map_err(|error| error.to_string());
                }
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => {
                    return Err(error.to_string());
                }
                Err(_) => {}
            }
            let ended = self.process.try_wait().ok().flatten();
            if ended.is_some() || started.elapsed() > PATIENCE {
                return Err(format!("QEMU did not start: {}", self.complaint()));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Returns QEMU's error output.
    pub fn complaint(&self) -> String {
        std::fs::read_to_string(self.folder.join("qemu.txt")).unwrap_or_default()
    }

    /// Returns true while QEMU runs.
    pub fn is_running(&mut self) -> bool {
        matches!(self.process.try_wait(), Ok(None))
    }

    /// Kills the drone's QEMU process at once.
    pub fn kill(&mut self) {
        // If the process has already ended, that is no error.
        _ = self.process.kill();
        _ = self.process.wait();
    }
}

fn loaded(file: &Path, address: u32) -> [String; 2] {
    let file = file.display();
    [
        "-device".to_owned(),
        format!("loader,file={file},addr={address:#x},force-raw=on"),
    ]
}

impl Drop for Emulator {
    fn drop(&mut self) {
        self.kill();
    }
}
