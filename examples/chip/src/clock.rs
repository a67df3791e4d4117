//! Clock tree: PLL from the crystal, else PLL from the HSI, else the HSI alone.
//!
//! | order of attempts | core | APB1 | APB2 |
//! | --- | --- | --- | --- |
//! | PLL from the crystal, over-drive (STM32F446 alone) | 180 MHz | 45 MHz | 90 MHz |
//! | PLL from the crystal | 168 MHz | 42 MHz | 84 MHz |
//! | PLL from the HSI, over-drive (STM32F446 alone) | 180 MHz | 45 MHz | 90 MHz |
//! | PLL from the HSI | 168 MHz | 42 MHz | 84 MHz |
//! | HSI | 16 MHz | 16 MHz | 16 MHz |
//!
//! Every wait is bounded. A failed attempt is undone before the next one. The input of the PLL is 2 MHz, as RM0090
//! 6.3.2 recommends. Above 150 MHz at 2.7 to 3.6 V the flash needs five wait states (RM0090 table 10, RM0390 table
//! 5).

use crate::crystal::{self, Crystal, HSI_HZ};
use crate::registers::{Register, Registers};

/// Clock hardware of a board: crystal and over-drive.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ClockHardware {
    /// Crystal or external clock of the board, if the board has one.
    pub crystal: Option<Crystal>,
    /// True for a chip with the over-drive that 180 MHz needs: the STM32F446.
    pub over_drive: bool,
}

/// Board with an STM32F405 and a crystal of 8 MHz. With a crystal of a different frequency, or none, the board runs
/// from the HSI.
pub const STM32F405: ClockHardware = ClockHardware {
    crystal: Some(Crystal {
        hz: 8_000_000,
        bypass: false,
    }),
    over_drive: false,
};

/// Board NUCLEO-F446RE: its ST-LINK supplies 8 MHz at the pin OSC_IN.
pub const NUCLEO_F446RE: ClockHardware = ClockHardware {
    crystal: Some(Crystal {
        hz: 8_000_000,
        bypass: true,
    }),
    over_drive: true,
};

/// Source of the PLL's input.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Source {
    /// Crystal oscillator as the input of the PLL.
    Crystal,
    /// Internal oscillator (HSI) as the input of the PLL.
    Internal,
}

/// Clock frequencies of the chip after [`start`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Clocks {
    /// Frequency of the core and of its timer `SysTick`, Hz.
    pub core_hz: u32,
    /// Frequency of the peripheral bus APB1, which clocks USART2, USART3, UART4 and others, Hz.
    pub apb1_hz: u32,
    /// Frequency of the peripheral bus APB2, which clocks USART1 and USART6, Hz.
    pub apb2_hz: u32,
    /// Input of the PLL; `None` if the core runs from the internal oscillator (HSI) without the PLL.
    pub pll: Option<Source>,
}

impl Clocks {
    /// Clock frequencies without the PLL: core and buses run from the internal oscillator (HSI).
    pub const HSI: Self = Self {
        core_hz: HSI_HZ,
        apb1_hz: HSI_HZ,
        apb2_hz: HSI_HZ,
        pll: None,
    };

    const fn of(speed: Pll, source: Source) -> Self {
        let core_hz = speed.plln * PLL_INPUT_HZ / 2;
        Self {
            core_hz,
            apb1_hz: core_hz / 4,
            apb2_hz: core_hz / 2,
            pll: Some(source),
        }
    }
}

/// Frequency of the PLL's input, Hz. The frequency of the PLL's source is divided to this value.
pub const PLL_INPUT_HZ: u32 = 2_000_000;

/// PLL settings for one frequency of the core.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Pll {
    over_drive: bool,
    /// Multiplier of the PLL (PLLN): the core's frequency in MHz.
    plln: u32,
    /// Divisor (PLLQ) that gives the PLL's USB output at most 48 MHz. USB is not used.
    pllq: u32,
}

const FASTEST: Pll = Pll {
    over_drive: true,
    plln: 180,
    pllq: 8,
};
const FAST: Pll = Pll {
    over_drive: false,
    plln: 168,
    pllq: 7,
};

/// Bit HSION of the register RCC_CR: internal oscillator on.
const HSI_ON: u32 = 1;
/// Bit HSIRDY of the register RCC_CR: internal oscillator ready.
const HSI_READY: u32 = 1 << 1;
/// Bit PLLON of the register RCC_CR: PLL on.
const PLL_ON: u32 = 1 << 24;
/// Bit PLLRDY of the register RCC_CR: PLL ready.
const PLL_READY: u32 = 1 << 25;

/// Mask of the PLL settings in RCC_PLLCFGR.
const PLL_FIELDS: u32 = 0x3F | 0x1FF << 6 | 0b11 << 16 | PLL_FROM_CRYSTAL | 0xF << 24;
/// Bit PLLSRC of RCC_PLLCFGR: the crystal oscillator is the PLL's input.
const PLL_FROM_CRYSTAL: u32 = 1 << 22;

/// Mask of the field SW of RCC_CFGR: selection of the system clock.
const SWITCH: u32 = 0b11;
/// Value of the field SW of RCC_CFGR: PLL.
const SWITCH_PLL: u32 = 0b10;
/// Mask of the field SWS of RCC_CFGR: system clock in use.
const SWITCHED: u32 = 0b11 << 2;
/// Value of the field SWS of RCC_CFGR: PLL.
const SWITCHED_PLL: u32 = 0b10 << 2;
/// Mask of the prescalers in RCC_CFGR.
const PRESCALERS: u32 = 0xF << 4 | 0b111 << 10 | 0b111 << 13;
/// Prescalers in RCC_CFGR: APB1 at a quarter of the core's clock, APB2 at half.
const APB_BY_4_AND_2: u32 = 0b101 << 10 | 0b100 << 13;

/// Bit PWREN of RCC_APB1ENR: clock of the power controller.
const POWER_ON: u32 = 1 << 28;

/// Voltage scale 1 in PWR_CR of the STM32F405, where the scale has one bit.
const SCALE_1: u32 = 1 << 14;
/// Voltage scale 1 in PWR_CR of the STM32F446, where the scale has two bits.
const SCALE_1_OF_TWO_BITS: u32 = 0b11 << 14;
/// Bit of PWR_CSR that is set once the voltage scale is reached.
const SCALE_READY: u32 = 1 << 14;
/// Over-drive bit: enable in PWR_CR, ready in PWR_CSR.
const OVER_DRIVE: u32 = 1 << 16;
/// Over-drive switch bit: switch in PWR_CR, in use in PWR_CSR.
const OVER_DRIVE_SWITCH: u32 = 1 << 17;

/// Mask of the flash wait states in the register FLASH_ACR.
const LATENCY: u32 = 0xF;
/// Number of flash wait states at full speed.
const WAIT_STATES: u32 = 5;
/// Bit of FLASH_ACR that enables the flash prefetch.
const PREFETCH: u32 = 1 << 8;
/// Bits of FLASH_ACR that enable the instruction cache and the data cache.
const CACHES: u32 = 0b11 << 9;

/// Chip ID of an STM32F405 of revision A, whose flash prefetch is defective (ES0182).
const NO_PREFETCH: u32 = 0x1000_0413;

/// Maximum number of register reads while a PLL, a voltage or a clock switch settles.
///
/// The reads take about 10 ms at 16 MHz. The data sheets give at most 0.3 ms for settling.
const POLLS: u32 = 20_000;

/// Sets up the clocks of a board, and returns the frequencies reached. Takes at most 0.2 s.
///
/// Call it once after a reset, with interrupts off.
pub fn start(chip: &mut impl Registers, hardware: &ClockHardware) -> Clocks {
    if !back_to_hsi(chip) {
        // The HSI is never ready in an emulator without a clock tree.
        return Clocks::HSI;
    }
    cache(chip, 0);
    let crystal = hardware.crystal.filter(|of| crystal::start(chip, *of));
    let from_crystal = crystal.map(|of| (Source::Crystal, of.hz / PLL_INPUT_HZ));
    let from_hsi = Some((Source::Internal, HSI_HZ / PLL_INPUT_HZ));
    for (source, divisor) in [from_crystal, from_hsi].into_iter().flatten() {
        for speed in [FASTEST, FAST] {
            if (speed.over_drive && !hardware.over_drive) || !off(chip) {
                continue;
            }
            let scale = if hardware.over_drive {
                SCALE_1_OF_TWO_BITS
            } else {
                SCALE_1
            };
            if pll(chip, source, divisor, speed, scale) && switch(chip) {
                return Clocks::of(speed, source);
            }
            let _ = back_to_hsi(chip) && off(chip);
        }
    }
    if crystal.is_some() {
        crystal::stop(chip);
    }
    cache(chip, 0);
    Clocks::HSI
}

/// Returns the frequencies that [`start`] reaches, and switches back to the HSI.
///
/// Some HALs set up the clocks themselves, and wait for them without a limit. The result tells such a HAL which clocks
/// work.
pub fn probe(chip: &mut impl Registers, hardware: &ClockHardware) -> Clocks {
    let clocks = start(chip, hardware);
    if clocks.pll.is_some() && back_to_hsi(chip) {
        cache(chip, 0);
        let _ = off(chip);
    }
    clocks
}

/// Sets the flash's wait states and enables its caches; returns true on success.
fn cache(chip: &mut impl Registers, wait_states: u32) -> bool {
    let prefetch = if chip.read(Register::ChipId) & 0xFFFF_0FFF == NO_PREFETCH {
        0
    } else {
        PREFETCH
    };
    chip.modify(
        Register::FlashAccess,
        LATENCY,
        wait_states | prefetch | CACHES,
    );
    chip.wait(Register::FlashAccess, LATENCY, wait_states, POLLS)
}

/// Enables the flash caches, which a HAL may have left off. The wait states do not change.
pub fn cache_flash(chip: &mut impl Registers) {
    let wait_states = chip.read(Register::FlashAccess) & LATENCY;
    cache(chip, wait_states);
}

/// Switches the core to the undivided HSI; returns false on failure.
fn back_to_hsi(chip: &mut impl Registers) -> bool {
    chip.modify(Register::ClockControl, 0, HSI_ON);
    if !chip.wait(Register::ClockControl, HSI_READY, HSI_READY, POLLS) {
        return false;
    }
    chip.modify(Register::ClockConfig, SWITCH, 0);
    let switched = chip.wait(Register::ClockConfig, SWITCHED, 0, POLLS);
    if switched {
        chip.modify(Register::ClockConfig, PRESCALERS, 0);
    }
    switched
}

/// Turns over-drive and PLL off; returns false if the PLL stays on.
fn off(chip: &mut impl Registers) -> bool {
    chip.modify(Register::Apb1Enable, 0, POWER_ON);
    if chip.read(Register::PowerControl) & (OVER_DRIVE | OVER_DRIVE_SWITCH) != 0 {
        chip.modify(Register::PowerControl, OVER_DRIVE_SWITCH, 0);
        let _ = chip.wait(Register::PowerStatus, OVER_DRIVE_SWITCH, 0, POLLS);
        chip.modify(Register::PowerControl, OVER_DRIVE, 0);
    }
    chip.modify(Register::ClockControl, PLL_ON, 0);
    chip.wait(Register::ClockControl, PLL_READY, 0, POLLS)
}

/// Starts the PLL, which must be off; returns false on failure.
///
/// `divisor` is the source's frequency divided by 2 MHz. `scale` is the voltage scale in PWR_CR.
fn pll(chip: &mut impl Registers, source: Source, divisor: u32, speed: Pll, scale: u32) -> bool {
    chip.modify(Register::PowerControl, scale, scale);
    let from = match source {
        Source::Crystal => PLL_FROM_CRYSTAL,
        Source::Internal => 0,
    };
    let fields = divisor | speed.plln << 6 | from | speed.pllq << 24;
    chip.modify(Register::PllConfig, PLL_FIELDS, fields);
    chip.modify(Register::ClockControl, 0, PLL_ON);
    if !chip.wait(Register::ClockControl, PLL_READY, PLL_READY, POLLS)
        || !chip.wait(Register::PowerStatus, SCALE_READY, SCALE_READY, POLLS)
    {
        return false;
    }
    !speed.over_drive
        || [OVER_DRIVE, OVER_DRIVE_SWITCH].into_iter().all(|bit| {
            chip.modify(Register::PowerControl, 0, bit);
            chip.wait(Register::PowerStatus, bit, bit, POLLS)
        })
}

/// Switches the core to the running PLL; returns false on failure.
fn switch(chip: &mut impl Registers) -> bool {
    if !cache(chip, WAIT_STATES) {
        return false;
    }
    chip.modify(Register::ClockConfig, PRESCALERS, APB_BY_4_AND_2);
    chip.modify(Register::ClockConfig, SWITCH, SWITCH_PLL);
    chip.wait(Register::ClockConfig, SWITCHED, SWITCHED_PLL, POLLS)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::{ClockHardware, Clocks, NUCLEO_F446RE, STM32F405, Source, probe, start};
    use crate::mock::{Faults, MockRegisters};

    fn all_faults() -> impl Iterator<Item = Faults> {
        (0..1_u32 << Faults::BITS)
            .flat_map(|bits| [8, 12, 16, 25].map(|mhz| Faults::of(bits, mhz * 1_000_000)))
    }

    /// Returns the frequencies that [`start`] should reach with `faults`.
    fn expected(hardware: &ClockHardware, faults: Faults) -> Clocks {
        let is_crystal =
            !faults.crystal_dead && !faults.timer_dead && faults.crystal_hz == 8_000_000;
        let mut sources = Vec::new();
        if is_crystal && !faults.pll_dead_from_crystal {
            sources.push(Source::Crystal);
        }
        if !faults.pll_dead_from_hsi {
            sources.push(Source::Internal);
        }
        let blocked =
            faults.hsi_hidden || faults.voltage_dead || faults.flash_stuck || faults.switch_stuck;
        let Some(source) = sources.first().copied().filter(|_| !blocked) else {
            return Clocks::HSI;
        };
        let over_drive =
            hardware.over_drive && !faults.over_drive_dead && !faults.over_drive_switch_dead;
        let mhz = if over_drive { 180 } else { 168 };
        Clocks {
            core_hz: mhz * 1_000_000,
            apb1_hz: mhz * 250_000,
            apb2_hz: mhz * 500_000,
            pll: Some(source),
        }
    }

    /// Checks the clocks for every combination of faults. The mock panics at every forbidden write.
    #[test]
    fn the_clocks_are_correct_under_all_combinations_of_faults() {
        let none = ClockHardware {
            crystal: None,
            ..STM32F405
        };
        let mut count = 0;
        let mut reached = std::collections::BTreeMap::new();
        for hardware in [STM32F405, NUCLEO_F446RE] {
            for faults in all_faults() {
                let mut chip = MockRegisters::with(faults, hardware.over_drive);
                let clocks = start(&mut chip, &hardware);
                assert_eq!(clocks, expected(&hardware, faults), "{faults:?}");
                let [core, apb1, apb2] = chip.clocks();
                let reported = [clocks.core_hz, clocks.apb1_hz, clocks.apb2_hz];
                assert_eq!(reported, [core, apb1, apb2], "{faults:?}");
                assert!(chip.reads < 700_000, "{} reads, {faults:?}", chip.reads);
                count += 1;
                *reached
                    .entry((clocks.core_hz / 1_000_000, clocks.pll.map(|pll| pll as u8)))
                    .or_insert(0) += 1;
            }
        }
        std::println!("{count} combinations: {reached:?}");
        let mut chip = MockRegisters::with(Faults::default(), false);
        assert_eq!(start(&mut chip, &none).pll, Some(Source::Internal));
    }

    #[test]
    fn a_probe_leaves_the_hsi() {
        for hardware in [STM32F405, NUCLEO_F446RE] {
            for faults in all_faults() {
                let mut chip = MockRegisters::with(faults, hardware.over_drive);
                assert_eq!(
                    probe(&mut chip, &hardware),
                    expected(&hardware, faults),
                    "{faults:?}"
                );
                assert_eq!(chip.clocks(), [16_000_000; 3], "{faults:?}");
                assert!(chip.is_pll_off() || faults.hsi_hidden, "{faults:?}");
            }
        }
    }

    /// Checks that the baud rate is within 0.2 % of 115 200 bit/s at every possible clock.
    #[test]
    fn the_baud_rate_is_that_of_the_clock_reached() {
        for hz in [16, 42, 45, 84, 90].map(|mhz| mhz * 1_000_000) {
            let requested = crate::baud::compensated_baud(115_200, hz);
            // The divisor is computed as stm32f4xx-hal 0.23 does, from the clock after a reset.
            let divisor = (16_000_000 + requested / 2) / requested;
            let baud = f64::from(hz) / f64::from(divisor);
            assert!((baud / 115_200.0 - 1.0).abs() < 2e-3, "{hz}: {baud}");
        }
    }
}
