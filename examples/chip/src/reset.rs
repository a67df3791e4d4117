//! The cause of the last reset.

use crate::registers::{Register, Registers};

/// Bit RMVF of RCC_CSR: clears the recorded causes of a reset.
const FORGET: u32 = 1 << 24;

/// Cause of the last reset of the microcontroller.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Reset {
    /// The power was switched on.
    Power,
    /// The supply voltage was too low.
    Brownout,
    /// The reset pin was pulled by a button or a debug probe.
    Pin,
    /// The program or a debug probe requested the reset.
    Software,
    /// The watchdog was not fed: the relay's loop hung, or its clock stopped.
    Watchdog,
    /// The cause is unknown, as in an emulator.
    #[default]
    Unknown,
}

impl Reset {
    /// Returns the cause of the last reset, and clears it on the chip. Constant work.
    pub fn take(chip: &mut impl Registers) -> Self {
        let status = chip.read(Register::ResetStatus);
        chip.modify(Register::ResetStatus, 0, FORGET);
        Self::of(status)
    }

    /// Returns the most specific cause in `status`, a value of RCC_CSR. Several bits can be set: every reset also sets
    /// the bit of the reset pin, and a power-up also sets the bit of the brownout.
    fn of(status: u32) -> Self {
        let is = |bit: u32| status >> bit & 1 != 0;
        match status {
            // The bits of the independent and of the window watchdog.
            _ if is(29) || is(30) => Self::Watchdog,
            _ if is(28) => Self::Software,
            _ if is(27) => Self::Power,
            _ if is(25) => Self::Brownout,
            _ if is(31) || is(26) => Self::Pin,
            _ => Self::Unknown,
        }
    }

    /// Returns the reset cause in words, for the log.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Power => "power-on reset",
            Self::Brownout => "the supply voltage was too low",
            Self::Pin => "the reset pin",
            Self::Software => "the program or the debug probe",
            Self::Watchdog => "the watchdog was not fed",
            Self::Unknown => "unknown",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Reset;
    use crate::mock::MockRegisters;
    use crate::registers::{Register, Registers as _};

    /// Checks the reset cause for values of RCC_CSR from the reference manuals, and that reading clears it.
    #[test]
    fn the_reset_cause_is_read_once() {
        for (status, cause) in [
            (0x0E00_0000, Reset::Power),
            (0x0600_0000, Reset::Brownout),
            (0x0400_0000, Reset::Pin),
            (0x1400_0000, Reset::Software),
            (0x2400_0000, Reset::Watchdog),
            (0x4400_0000, Reset::Watchdog),
            (0x0000_0000, Reset::Unknown),
        ] {
            let mut block = MockRegisters::default();
            block.write(Register::ResetStatus, status);
            assert_eq!(Reset::take(&mut block), cause, "{status:#010x}");
            assert_eq!(block.read(Register::ResetStatus) >> 24 & 1, 1, "RMVF");
        }
    }
}
