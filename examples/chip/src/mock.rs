//! Mock of the registers in RAM, for tests. It behaves like the chip, and panics at accesses that the reference manuals
//! forbid.

extern crate std;

use std::collections::BTreeMap;
use std::vec::Vec;

use crate::registers::{Register, Registers};

/// Faults that the mock chip simulates, and the frequency of its crystal.
#[expect(clippy::struct_excessive_bools, reason = "each fails by itself")]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Faults {
    /// True if all registers read 0, as in QEMU. The HSI then never seems ready.
    pub(crate) hsi_hidden: bool,
    pub(crate) crystal_dead: bool,
    pub(crate) timer_dead: bool,
    pub(crate) pll_dead_from_crystal: bool,
    pub(crate) pll_dead_from_hsi: bool,
    pub(crate) voltage_dead: bool,
    pub(crate) over_drive_dead: bool,
    pub(crate) over_drive_switch_dead: bool,
    pub(crate) flash_stuck: bool,
    pub(crate) switch_stuck: bool,
    pub(crate) crystal_hz: u32,
}

impl Default for Faults {
    fn default() -> Self {
        Self::of(0, 8_000_000)
    }
}

impl Faults {
    pub(crate) const BITS: u32 = 10;

    pub(crate) fn of(bits: u32, crystal_hz: u32) -> Self {
        let is = |bit: u32| bits >> bit & 1 != 0;
        Self {
            hsi_hidden: is(0),
            crystal_dead: is(1),
            timer_dead: is(2),
            pll_dead_from_crystal: is(3),
            pll_dead_from_hsi: is(4),
            voltage_dead: is(5),
            over_drive_dead: is(6),
            over_drive_switch_dead: is(7),
            flash_stuck: is(8),
            switch_stuck: is(9),
            crystal_hz,
        }
    }
}

#[derive(Default)]
pub(crate) struct MockRegisters {
    values: BTreeMap<Register, u32>,
    pub(crate) written: Vec<(Register, u32)>,
    pub(crate) reads: u32,
    faults: Faults,
    over_drive: bool,
    captured: u32,
}

impl MockRegisters {
    /// Creates the mock registers in their state after a reset. `over_drive` is true for an STM32F446.
    pub(crate) fn with(faults: Faults, over_drive: bool) -> Self {
        let mut registers = Self {
            faults,
            over_drive,
            ..Self::default()
        };
        if !faults.hsi_hidden {
            let voltage = if over_drive { 0xC000 } else { 0x4000 };
            for (register, value) in [
                (Register::ClockControl, 0x83),
                (Register::PllConfig, 0x2400_3010),
                (Register::PowerControl, voltage),
            ] {
                registers.values.insert(register, value);
            }
        }
        registers
    }

    fn value(&self, register: Register) -> u32 {
        self.values.get(&register).copied().unwrap_or(0)
    }

    fn is_pll_on(&self) -> bool {
        self.value(Register::ClockControl) >> 24 & 1 != 0
    }

    pub(crate) fn is_pll_off(&self) -> bool {
        !self.is_pll_on()
    }

    fn is_crystal_ready(&self) -> bool {
        self.value(Register::ClockControl) >> 16 & 1 != 0 && !self.faults.crystal_dead
    }

    fn is_from_crystal(&self) -> bool {
        self.value(Register::PllConfig) >> 22 & 1 != 0
    }

    fn is_pll_ready(&self) -> bool {
        let dead = if self.is_from_crystal() {
            self.faults.pll_dead_from_crystal || !self.is_crystal_ready()
        } else {
            self.faults.pll_dead_from_hsi
        };
        self.is_pll_on() && !dead
    }

    /// Returns the PLL's output, Hz, checked against the ranges of the data sheets.
    fn pll_hz(&self) -> u32 {
        let config = self.value(Register::PllConfig);
        let source = if self.is_from_crystal() {
            self.faults.crystal_hz
        } else {
            16_000_000
        };
        let input = source / (config & 0x3F);
        assert!((950_000..=2_100_000).contains(&input), "{input} Hz");
        let vco = input * (config >> 6 & 0x1FF);
        assert!((100_000_000..=432_000_000).contains(&vco), "{vco} Hz");
        assert!(vco / (config >> 24 & 0xF) <= 48_000_000);
        assert_eq!(
            config >> 28 & 0b111,
            2,
            "bits 28 to 30 of PLLCFGR (PLLR or reserved) must keep their reset value"
        );
        vco / (2 + 2 * (config >> 16 & 0b11))
    }

    fn is_on_pll(&self) -> bool {
        self.value(Register::ClockConfig) & 0b11 == 0b10 && !self.faults.switch_stuck
    }

    /// Returns the frequencies of the core, APB1 and APB2, Hz.
    pub(crate) fn clocks(&self) -> [u32; 3] {
        let config = self.value(Register::ClockConfig);
        let core = if self.is_on_pll() {
            self.pll_hz()
        } else {
            16_000_000
        };
        assert_eq!(config >> 4 & 0xF, 0);
        let divided = |bits: u32| match bits & 0b111 {
            by @ 0b100.. => core >> (by - 3),
            _ => core,
        };
        [core, divided(config >> 10), divided(config >> 13)]
    }

    fn is_over_driven(&self) -> bool {
        self.value(Register::PowerControl) >> 16 & 0b11 == 0b11
            && !self.faults.over_drive_dead
            && !self.faults.over_drive_switch_dead
    }

    /// Panics if the core's frequency exceeds the limits of flash, voltage or buses.
    fn check(&self) {
        if self.faults.hsi_hidden || !self.is_on_pll() {
            return;
        }
        assert!(
            self.is_pll_ready(),
            "the CPU core has no clock: the PLL drives it, but does not run"
        );
        let [core, apb1, apb2] = self.clocks();
        let wait_states = self.value(Register::FlashAccess) & 0xF;
        assert!(
            core <= (wait_states + 1) * 30_000_000,
            "{core} Hz, {wait_states}"
        );
        assert!(!self.faults.flash_stuck && !self.faults.voltage_dead);
        let most = if self.is_over_driven() { 180 } else { 168 } * 1_000_000;
        assert!(
            core <= most && apb1 <= most / 4 && apb2 <= most / 2,
            "{core} {apb1} {apb2}"
        );
        let scale = if self.over_drive { 0b11 } else { 0b01 };
        assert_eq!(self.value(Register::PowerControl) >> 14 & 0b11, scale);
    }
}

impl Registers for MockRegisters {
    fn read(&mut self, register: Register) -> u32 {
        self.reads += 1;
        let faults = self.faults;
        if faults.hsi_hidden {
            return 0;
        }
        let value = self.value(register);
        let bit = |at: u32, set: bool| u32::from(set) << at;
        match register {
            Register::ClockControl => {
                let value = value & !(1 << 1 | 1 << 17 | 1 << 25);
                value
                    | bit(1, value & 1 != 0)
                    | bit(17, self.is_crystal_ready())
                    | bit(25, self.is_pll_ready())
            }
            Register::ClockConfig => value & !0b1100 | bit(3, self.is_on_pll()),
            Register::PowerStatus => {
                let control = self.value(Register::PowerControl);
                bit(14, self.is_pll_ready() && !faults.voltage_dead)
                    | bit(16, control >> 16 & 1 != 0 && !faults.over_drive_dead)
                    | bit(17, control >> 17 & 1 != 0 && !faults.over_drive_switch_dead)
            }
            Register::FlashAccess if faults.flash_stuck => value & !0xF,
            Register::Timer11Status => {
                let runs = self.value(Register::Timer11Control) == 1
                    && self.value(Register::Timer11Enable) == 1
                    && self.value(Register::Timer11Mode) == 0b1101
                    && self.value(Register::Timer11Option) == 0b10
                    && self.value(Register::ClockConfig) >> 16 & 0x1F == 31
                    && self.value(Register::Apb2Enable) >> 18 & 1 != 0;
                // An edge arrives at every third read.
                bit(
                    1,
                    runs && !faults.timer_dead && self.reads.is_multiple_of(3),
                )
            }
            Register::Timer11Capture => {
                self.captured += 8 * 31 * 16 / (faults.crystal_hz / 1_000_000);
                self.captured & 0xFFFF
            }
            Register::ChipId => {
                if self.over_drive {
                    0x1000_6421
                } else {
                    0x1001_6413
                }
            }
            _ => value,
        }
    }

    /// Reads the register once, because more reads would return the same value. Only the timer's status is read
    /// repeatedly.
    fn wait(&mut self, register: Register, mask: u32, value: u32, polls: u32) -> bool {
        if register == Register::Timer11Status {
            return (0..polls).any(|_| self.read(register) & mask == value);
        }
        let done = self.read(register) & mask == value;
        self.reads += if done { 0 } else { polls - 1 };
        done
    }

    fn write(&mut self, register: Register, value: u32) {
        self.written.push((register, value));
        let before = self.values.insert(register, value).unwrap_or(0);
        if self.faults.hsi_hidden {
            return;
        }
        let changed = before ^ value;
        match register {
            Register::PllConfig => assert!(!self.is_pll_on(), "set while the PLL is on"),
            Register::PowerControl => {
                assert!(
                    self.value(Register::Apb1Enable) >> 28 & 1 != 0,
                    "PWR has no clock"
                );
                assert!(changed & 0xC000 == 0 || !self.is_pll_on());
                let raised = changed & value;
                assert!(
                    raised & 0x3_0000 == 0 || self.over_drive,
                    "this chip has no over-drive"
                );
                assert!(
                    raised >> 17 & 1 == 0 || value >> 16 & 1 != 0,
                    "ODEN (over-drive enable) must be set before ODSWEN (over-drive switching)"
                );
                assert!(
                    !(changed & 0x3_0000 != 0 && self.is_on_pll()),
                    "the over-drive was changed while the PLL is the clock"
                );
            }
            Register::ClockControl => {
                assert!(value & 1 != 0, "the HSI is needed");
                assert!(
                    changed >> 18 & 1 == 0 || before >> 16 & 1 == 0,
                    "HSEBYP, HSE on"
                );
            }
            _ => {}
        }
        self.check();
    }
}
