//! Check of the crystal's frequency against the HSI. A wrong crystal would make the PLL overclock the core.
//!
//! TIM11 captures every eighth edge of HSE / 31, which RM0090 and RM0390 provide as its input (TIM11_OR).

use crate::registers::{Register, Registers};

/// Crystal or external clock of a board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Crystal {
    /// Frequency of the crystal or external clock, Hz: a multiple of 2 MHz.
    pub hz: u32,
    /// True for an external clock at the pin OSC_IN, false for a crystal.
    pub bypass: bool,
}

/// Frequency of the chip's internal oscillator (HSI), Hz: within 8 % over all temperatures.
pub const HSI_HZ: u32 = 16_000_000;

/// Bit HSEON of the register RCC_CR: crystal oscillator on.
const HSE_ON: u32 = 1 << 16;
/// Bit HSERDY of the register RCC_CR: crystal oscillator ready.
const HSE_READY: u32 = 1 << 17;
/// Bit HSEBYP of the register RCC_CR: external clock in place of a crystal.
const HSE_BYPASS: u32 = 1 << 18;

/// Maximum number of reads of RCC_CR while a crystal starts, about 100 ms at 16 MHz. A crystal usually takes 2 ms.
const START_POLLS: u32 = 200_000;

/// Divisor of the crystal's clock for the measurement: field RTCPRE of RCC_CFGR.
const DIVISOR: u32 = 31;
const DIVIDED: u32 = DIVISOR << 16;

const EDGES: u32 = 8;

/// Bit TIM11EN of RCC_APB2ENR: clock of timer 11.
const TIMER_ON: u32 = 1 << 18;

/// Maximum number of status reads of the timer per capture.
const EDGE_POLLS: u32 = 1_000;

/// Starts the crystal. Returns true if its frequency is right within 10 %; otherwise turns it off again.
///
/// The core must run from the HSI. Takes at most 100 ms.
pub fn start(chip: &mut impl Registers, crystal: Crystal) -> bool {
    chip.modify(Register::ClockControl, HSE_ON, 0);
    let bypass = if crystal.bypass { HSE_BYPASS } else { 0 };
    chip.modify(Register::ClockControl, HSE_BYPASS, bypass);
    chip.modify(Register::ClockControl, 0, HSE_ON);
    let ready = chip.wait(Register::ClockControl, HSE_READY, HSE_READY, START_POLLS);
    let expected = EDGES * DIVISOR * (HSI_HZ / 1_000_000) / (crystal.hz / 1_000_000).max(1);
    let close = |period: u32| period.abs_diff(expected) <= expected / 10;
    let good = ready && period(chip).is_some_and(close);
    if !good {
        stop(chip);
    }
    good
}

/// Turns the crystal off.
pub fn stop(chip: &mut impl Registers) {
    chip.modify(Register::ClockControl, HSE_ON, 0);
}

/// Returns the period of the divided crystal clock, in HSI periods; `None` if it has no edges.
fn period(chip: &mut impl Registers) -> Option<u32> {
    chip.modify(Register::ClockConfig, 0x1F << 16, DIVIDED);
    chip.modify(Register::Apb2Enable, 0, TIMER_ON);
    chip.write(Register::Timer11Option, 0b10);
    chip.write(Register::Timer11Reload, 0xFFFF);
    chip.write(Register::Timer11Mode, 0b1101);
    chip.write(Register::Timer11Enable, 1);
    chip.write(Register::Timer11Control, 1);
    let mut captured = || {
        let come = chip.wait(Register::Timer11Status, 0b10, 0b10, EDGE_POLLS);
        // Reading the capture clears the flag.
        come.then(|| chip.read(Register::Timer11Capture))
    };
    // The first capture may have happened during the set-up of the timer.
    let [_, from, to] = [captured(), captured(), captured()];
    chip.write(Register::Timer11Control, 0);
    chip.write(Register::Timer11Enable, 0);
    chip.write(Register::Timer11Option, 0);
    chip.modify(Register::Apb2Enable, TIMER_ON, 0);
    chip.modify(Register::ClockConfig, 0x1F << 16, 0);
    Some(to?.wrapping_sub(from?) & 0xFFFF)
}
