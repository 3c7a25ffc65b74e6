//! A guard below the stack, on any core with memory protection of Arm's v6-M or v7-M.

/// Lets a stack that grows towards the statics end in the fault handler, and not in numbers that are wrong: the lowest
/// 16 KiB that it may reach can be neither read nor written. So much, because one function's frame may step over less.
pub fn guard_stack() {
    const GUARD_LOG2: u32 = 14;
    unsafe extern "C" {
        /// The end of the statics, from the linker.
        static mut __sheap: u32;
    }
    let base = (&raw const __sheap as u32).next_multiple_of(1 << GUARD_LOG2);
    // SAFETY: nothing else uses the memory protection; its registers are written before the region is on, and what is
    // protected is nobody's memory.
    unsafe {
        let mpu = &*cortex_m::peripheral::MPU::PTR;
        mpu.rnr.write(0);
        mpu.rbar.write(base);
        // Execute never, no access, its size, on.
        mpu.rasr.write(1 << 28 | (GUARD_LOG2 - 1) << 1 | 1);
        // The default map for everything else; off in a fault handler, which must be able to run.
        mpu.ctrl.write(1 << 2 | 1);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
