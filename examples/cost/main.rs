//! Cost of a relay's calls on a Cortex-M4F, in instructions and bytes of stack. Run by `cargo cost` in QEMU.
//!
//! With `-icount shift=7` QEMU advances 128 ns with every instruction. SysTick counts at 168 MHz on this machine, so
//! the counter measures instructions. They are exact and the same in every run, but they are not cycles. Results are
//! printed by semihosting, which traps on a board without a debugger: do not flash this image.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", feature = "async"))]
mod asynch;
#[cfg(target_os = "none")]
mod auth;
#[cfg(target_os = "none")]
mod counter;
#[cfg(all(target_os = "none", feature = "async"))]
mod flight;
#[cfg(target_os = "none")]
mod local_search;
#[cfg(target_os = "none")]
mod methods;
#[cfg(target_os = "none")]
mod missions;
#[cfg(target_os = "none")]
mod solver;
#[cfg(target_os = "none")]
mod stack;
#[cfg(target_os = "none")]
mod sweeps;
#[cfg(target_os = "none")]
mod upload;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program runs on the target only. Use `cargo cost`.");
}

#[cfg(target_os = "none")]
mod image {
    use cortex_m_semihosting::{debug, hprintln};
    use panic_halt as _;
    use stm32f4xx_hal as _;
    use uav_relay::Relay;

    use super::{auth, counter, local_search, methods, solver, stack, sweeps, upload};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let Some(mut peripherals) = cortex_m::Peripherals::take() {
            peripherals
                .SYST
                .set_clock_source(cortex_m::peripheral::syst::SystClkSource::Core);
            peripherals.SYST.set_reload(counter::TOP);
            peripherals.SYST.clear_current();
            peripherals.SYST.enable_counter();
        }
        hprintln!("size_of_relay {}", size_of::<Relay>());
        sweeps::reach();
        sweeps::deframe();
        sweeps::sweep();
        sweeps::predict();
        local_search::local_search();
        methods::methods();
        solver::joint();
        stack::stack();
        auth::auth();
        upload::upload();
        #[cfg(feature = "async")]
        {
            super::asynch::runners();
            super::flight::flight();
        }
        hprintln!("done 1");
        debug::exit(debug::EXIT_SUCCESS);
        counter::stop()
    }
}
