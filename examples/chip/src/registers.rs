//! Registers by their names in RM0090 and RM0390, and their access on the chip.

/// Register of the STM32F405 and the STM32F446; its value is its address.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[repr(u32)]
pub enum Register {
    /// IWDG_KR: key of the watchdog.
    WatchdogKey = 0x4000_3000,
    /// IWDG_PR: prescaler of the watchdog.
    WatchdogPrescaler = 0x4000_3004,
    /// IWDG_RLR: reload value of the watchdog.
    WatchdogReload = 0x4000_3008,
    /// IWDG_SR: pending updates of the watchdog's prescaler and reload value.
    WatchdogStatus = 0x4000_300C,
    /// PWR_CR: voltage scale and over-drive.
    PowerControl = 0x4000_7000,
    /// PWR_CSR: states of voltage scale and over-drive.
    PowerStatus = 0x4000_7004,
    /// TIM11_CR1: control of timer 11.
    Timer11Control = 0x4001_4800,
    /// TIM11_SR: status of timer 11.
    Timer11Status = 0x4001_4810,
    /// TIM11_CCMR1: selection of the input that timer 11 captures.
    Timer11Mode = 0x4001_4818,
    /// TIM11_CCER: capture enable of timer 11.
    Timer11Enable = 0x4001_4820,
    /// TIM11_ARR: the largest count of timer 11.
    Timer11Reload = 0x4001_482C,
    /// TIM11_CCR1: the count of timer 11 at the last edge of its input.
    Timer11Capture = 0x4001_4834,
    /// TIM11_OR: source of timer 11's input.
    Timer11Option = 0x4001_4850,
    /// RCC_CR: oscillators and PLL, on and ready.
    ClockControl = 0x4002_3800,
    /// RCC_PLLCFGR: settings of the PLL.
    PllConfig = 0x4002_3804,
    /// RCC_CFGR: system clock and prescalers.
    ClockConfig = 0x4002_3808,
    /// RCC_APB1ENR: clock enables of the peripherals on the bus APB1.
    Apb1Enable = 0x4002_3840,
    /// RCC_APB2ENR: clock enables of the peripherals on the bus APB2.
    Apb2Enable = 0x4002_3844,
    /// RCC_CSR: the cause of the last reset.
    ResetStatus = 0x4002_3874,
    /// FLASH_ACR: wait states and caches.
    FlashAccess = 0x4002_3C00,
    /// DBGMCU_IDCODE: chip and revision.
    ChipId = 0xE004_2000,
    /// DBGMCU_APB1_FZ: peripherals stopped while a debugger halts the core.
    DebugFreeze = 0xE004_2008,
}

/// Access to the chip's registers, real or simulated.
pub trait Registers {
    /// Returns the value of the hardware register `register`.
    fn read(&mut self, register: Register) -> u32;

    /// Writes `value` to the hardware register `register`.
    fn write(&mut self, register: Register, value: u32);

    /// Clears the bits of `clear` in `register`, then sets the bits of `set`.
    fn modify(&mut self, register: Register, clear: u32, set: u32) {
        let value = self.read(register);
        self.write(register, value & !clear | set);
    }

    /// Reads `register` at most `polls` times; returns true once the bits of `mask` are `value`.
    fn wait(&mut self, register: Register, mask: u32, value: u32, polls: u32) -> bool {
        (0..polls).any(|_| self.read(register) & mask == value)
    }
}

/// Registers of the real chip.
#[cfg(target_arch = "arm")]
#[derive(Clone, Copy, Debug)]
pub struct Chip;

#[cfg(target_arch = "arm")]
impl Registers for Chip {
    fn read(&mut self, register: Register) -> u32 {
        // SAFETY: an aligned register of every STM32F405 and STM32F446. Reading it has no side effect that matters to
        // memory.
        unsafe { core::ptr::read_volatile(register as u32 as *const u32) }
    }

    fn write(&mut self, register: Register, value: u32) {
        // SAFETY: as above. None of these registers moves memory or lets a peripheral write to it. There is no other
        // writer: this crate's functions run before interrupts are enabled, except for the watchdog's key, which is a
        // single write.
        unsafe { core::ptr::write_volatile(register as u32 as *mut u32, value) }
    }
}
