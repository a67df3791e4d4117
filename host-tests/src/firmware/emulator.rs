//! One emulated drone: a QEMU process that dies with its owner, and a socket for each of its serial ports.
//!
//! The machine `netduinoplus2` is an STM32F405. What it does not have: a clock tree (`SysTick` counts at 168 MHz, so a
//! firmware that believes in 16 MHz lives 10.5 times as fast), and baud rates (bytes arrive as fast as they are read).

use std::io;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use uav_relay_tools::provision::config;

use super::{MISSING, QEMU};

/// How much faster than the wall clock the drone's own clock runs, unless it is slowed down.
pub const SPEED: f64 = 168.0 / 16.0;

/// How long QEMU may take to connect its serial ports.
const PATIENCE: Duration = Duration::from_secs(30);

/// How fast a drone lives.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Life {
    /// [`SPEED`] times as fast as everybody else.
    #[default]
    Fast,
    /// In real time.
    Real,
}

impl Life {
    /// How much faster than the wall clock the drone's own clock runs.
    pub const fn speed(self) -> f64 {
        match self {
            Self::Fast => SPEED,
            Self::Real => 1.0,
        }
    }
}

/// A serial port of the chip, by its place in QEMU's list.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Uart {
    /// USART1: the autopilot.
    Usart1,
    /// USART2: upstream, or the radio.
    Usart2,
    /// USART3: downstream.
    Usart3,
    /// UART4: the log.
    Uart4,
}

/// As QEMU lists them.
const UARTS: [Uart; 4] = [Uart::Usart1, Uart::Usart2, Uart::Usart3, Uart::Uart4];

/// Bytes in the flash, and the address of the first.
pub type Kept = (u32, Vec<u8>);

/// A drone that is switched on.
#[derive(Debug)]
pub struct Emulator {
    process: Child,
    folder: PathBuf,
}

/// The serial ports of a drone, in the order of [`Uart`].
pub type Sockets = [UnixStream; 4];

impl Emulator {
    /// Switches a drone on with `image`, `block` at the place of its configuration, and what else stands in its flash: `kept`, each from
    /// that address on. `folder` is made, and is its own.
    ///
    /// It lives as `life` says.
    ///
    /// # Errors
    /// [`MISSING`] if there is no QEMU; otherwise whatever went wrong, QEMU's own words included.
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

    /// What QEMU has to complain about.
    pub fn complaint(&self) -> String {
        std::fs::read_to_string(self.folder.join("qemu.txt")).unwrap_or_default()
    }

    /// Whether it still runs.
    pub fn is_running(&mut self) -> bool {
        matches!(self.process.try_wait(), Ok(None))
    }

    /// Switches it off, in the middle of whatever it does.
    pub fn kill(&mut self) {
        // It may have ended by itself, and then there is nothing to kill.
        _ = self.process.kill();
        _ = self.process.wait();
    }
}

/// The option that loads `file` into the flash.
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
