//! Properties for a model checker: each holds for every value that [`any`] can give, whatever its bits. `cargo xtask prove`
//! translates them to C by way of WebAssembly and hands them to CBMC: docs/proof.md.
//!
//! A `prove_…` must hold. Its `refute_…` is the same with a claim that is a little too bold, or a guard that is gone: it must
//! fail, or the proof has not looked.
//!
//! States are made of any bits, also such that no run leads to: what holds for them holds after any run, however long.
#![cfg(target_arch = "wasm32")]
#![no_std]

use clutch_core::law::{
    ControlLaw, LawParams, Output, OutputParams, OutputState, Pd, PdParams, Smc, SmcParams,
};
use clutch_core::supervisor::{Cause, State};
use clutch_core::{
    Arithmetic, Counts, Dac, DacCode, DacParams, FixedCounts, Micros, SafeCodes, SafeKind, SafeRun, Servo,
    ServoParams, ServoState, SmoothedDerivativeParams, Supervisor, SupervisorState, Target, VelocityParams,
};
use clutch_node::WideCounter;
use core::mem::{MaybeUninit, size_of};

mod env {
    unsafe extern "C" {
        /// 32 bits of any value.
        pub(crate) safe fn any_u32() -> u32;
        /// From here on, only what holds counts.
        pub(crate) safe fn assume(holds: bool);
    }
}

use env::{any_u32, assume};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}

/// The property.
#[inline(always)]
fn claim(holds: bool) {
    if !holds {
        core::arch::wasm32::unreachable()
    }
}

fn any_f32() -> f32 {
    f32::from_bits(any_u32())
}

/// A value of any bits.
#[inline(always)]
fn any<T: Copy>() -> T {
    let mut value = MaybeUninit::<T>::uninit();
    let words = value.as_mut_ptr().cast::<u32>();
    const { assert!(size_of::<T>().is_multiple_of(4)) };
    for i in 0..size_of::<T>() / 4 {
        // SAFETY: within the value.
        unsafe { words.add(i).write_unaligned(any_u32()) };
    }
    // SAFETY: there are enums in some that have fewer values than bits. To the machine code that the checker looks at, they
    // are numbers of no arm, and it has to hold for them, too.
    unsafe { value.assume_init() }
}

fn any_target() -> Target<f32> {
    let position = FixedCounts((u64::from(any_u32()) << 32 | u64::from(any_u32())) as i64);
    Target { position, velocity: any_f32(), acceleration: any_f32() }
}

/// The number of counts between two readings is that of the shaft's way, for every pair of readings less than half the
/// counter's range apart, across its wrap or not.
#[unsafe(no_mangle)]
extern "C" fn prove_counts_across_the_wrap() {
    counts_across_the_wrap(1 << 31);
}

/// One count more, and the way could be the other one.
#[unsafe(no_mangle)]
extern "C" fn refute_counts_across_the_wrap() {
    counts_across_the_wrap((1 << 31) + 1);
}

fn counts_across_the_wrap(below: i64) {
    let (before, way) = (any_u32() as i32, i64::from(any_u32() as i32) + i64::from(any_u32() as i32));
    assume(way.abs() < below);
    let after = (i64::from(before) + way) as i32;
    claim(i64::from(Counts(after).since(Counts(before))) == way);
}

/// A timer of 16 bits counts on as one of 32, after any readings before, for every way of less than half its range.
#[unsafe(no_mangle)]
extern "C" fn prove_wide_counter() {
    wide_counter(1 << 15);
}

/// Half the range itself could be either way.
#[unsafe(no_mangle)]
extern "C" fn refute_wide_counter() {
    wide_counter((1 << 15) + 1);
}

fn wide_counter(below: i32) {
    let mut counter: WideCounter = any();
    let (raw, way) = (any_u32() as u16, any_u32() as i32);
    assume(way > -below && way < below);
    let before = counter.read(raw);
    let after = counter.read(raw.wrapping_add(way as u16));
    claim(after.0 == before.0.wrapping_add(way));
}

/// Any float gives a code that the converter has, and the nearest one to every voltage of its range: 12 bit over ±10 V.
#[unsafe(no_mangle)]
extern "C" fn prove_converter() {
    converter(0.501);
}

/// No code is nearer than half a step to all of them.
#[unsafe(no_mangle)]
extern "C" fn refute_converter() {
    converter(0.499);
}

fn converter(steps: f32) {
    let Ok(dac) = Dac::<f32>::new(&DacParams { bits: 12, lowest: -10.0, highest: 10.0 }) else { return };
    let volts = any_f32();
    let code = dac.code(volts);
    claim(code.0 < 4096);
    let top = dac.volts(DacCode(4095));
    if volts >= -10.0 && volts <= top {
        claim((dac.volts(code) - volts).abs() <= steps * dac.step());
    } else if volts > top {
        claim(code.0 == 4095);
    } else {
        claim(code.0 == 0); // below, and what is not a number
    }
}

/// The saturation of a boundary layer lies within ±1, keeps order and is odd, for every pair of floats.
#[unsafe(no_mangle)]
extern "C" fn prove_saturation() {
    let (a, b) = (any_f32(), any_f32());
    claim(a.sat() >= -1.0 && a.sat() <= 1.0);
    let implies = |a: bool, b: bool| claim(!a || b);
    implies(a <= b, a.sat() <= b.sat());
    claim((-a).sat() == -a.sat());
    implies(a.abs() < 1.0, a.sat() == a);
}

/// It does not keep floats apart.
#[unsafe(no_mangle)]
extern "C" fn refute_saturation() {
    let (a, b) = (any_f32(), any_f32());
    if a < b {
        claim(a.sat() < b.sat());
    }
}

/// The output stage gives a voltage within its limits: for all limits that it takes, any memory of a bumpless start, any
/// demand.
#[unsafe(no_mangle)]
extern "C" fn prove_output_stage() {
    output_stage(|stage, memory, demand| stage.apply(memory, demand).0);
}

/// Without the branch for what is not a number.
#[unsafe(no_mangle)]
extern "C" fn refute_output_stage() {
    output_stage(|stage, _, demand| {
        if demand < stage.lowest() {
            stage.lowest()
        } else if demand > stage.highest() {
            stage.highest()
        } else {
            demand
        }
    });
}

fn output_stage(apply: impl Fn(&Output<f32>, &mut OutputState<f32>, f32) -> f32) {
    let (lowest, highest, on_invalid) = (any_f32(), any_f32(), any_f32());
    let p = OutputParams { lowest, highest, on_invalid, bumpless_time: 0.0 };
    let Ok(stage) = Output::new(&p, Micros(1000)) else { return };
    let volts = apply(&stage, &mut any(), any_f32());
    claim(volts >= lowest && volts <= highest);
}

/// The output stage of the laws below: 0.5 V to 9 V.
const LIMITS: OutputParams<f32> =
    OutputParams { lowest: 0.5, highest: 9.0, on_invalid: 7.0, bumpless_time: 0.0 };

/// One period of a servo around a law, from any memory, of any counts and any target: law and converter stay within limits.
#[inline(always)]
fn servo<C: ControlLaw<f32>>(law: Result<C, clutch_core::ParamError<f32>>, highest: f32)
where
    C::State: Copy,
{
    let Ok(law) = law else { return };
    let p = ServoParams {
        velocity: VelocityParams::SmoothedDerivative(SmoothedDerivativeParams { smoothing: 0.2 }),
        output: LIMITS,
        ..ServoParams::paper(LawParams::Pd(PdParams::default()))
    };
    let Ok(servo) = Servo::with_law(&p, law) else { return };
    let mut state: ServoState<f32, C::State> = any();
    let out = servo.tick(&mut state, Counts(any_u32() as i32), &any_target());
    claim(out.command.voltage >= 0.5 && out.command.voltage <= highest);
    // 0.5 V and 9 V in codes.
    claim(out.code.0 >= 2150 && out.code.0 <= 3891);
}

/// PD of any gains within limits, from any memory, of any counts and any target.
#[unsafe(no_mangle)]
extern "C" fn prove_pd_within_limits() {
    servo(Pd::new(&PdParams { kp: any_f32(), kd: any_f32() }, &LIMITS, Micros(1000)), 9.0);
}

/// The highest voltage is reached.
#[unsafe(no_mangle)]
extern "C" fn refute_pd_within_limits() {
    servo(Pd::new(&PdParams { kp: any_f32(), kd: any_f32() }, &LIMITS, Micros(1000)), 8.99);
}

/// Sliding mode with a boundary layer, of any gains, likewise.
#[unsafe(no_mangle)]
extern "C" fn prove_smc_within_limits() {
    let p = SmcParams { kp: any_f32(), kd: any_f32(), slope: any_f32(), boundary: 0.1 };
    servo(Smc::new(&p, &LIMITS, Micros(1000)), 9.0);
}

/// The highest voltage is reached.
#[unsafe(no_mangle)]
extern "C" fn refute_smc_within_limits() {
    let p = SmcParams { kp: any_f32(), kd: any_f32(), slope: any_f32(), boundary: 0.1 };
    servo(Smc::new(&p, &LIMITS, Micros(1000)), 8.99);
}

/// A safe state on its way: from any level, a ramp never turns back and never passes its end; what holds goes on holding;
/// what is to hold first holds in its first period, and once it has let go it stays so.
#[unsafe(no_mangle)]
extern "C" fn prove_safe_state() {
    safe_state(0);
}

/// One period earlier.
#[unsafe(no_mangle)]
extern "C" fn refute_safe_state() {
    safe_state(1);
}

fn safe_state(early: u32) {
    let codes = SafeCodes {
        kind: match any_u32() & 3 {
            0 => SafeKind::Hold,
            1 => SafeKind::Ramp,
            2 => SafeKind::Release,
            _ => SafeKind::HoldThenRelease,
        },
        hold: DacCode(any_u32() as u16),
        release: DacCode(any_u32() as u16),
        ramp_step: any_u32(),
        hold_periods: any_u32(),
    };
    let present = DacCode(any_u32() as u16);
    let mut run = SafeRun::begin(present);
    let first = run.next(&codes);
    let mut later: SafeRun = any();
    let before = later.next(&codes);
    let released = later.released(&codes);
    let after = later.next(&codes);
    match codes.kind {
        SafeKind::Hold => claim(first == codes.hold && after == codes.hold && !released),
        SafeKind::Release => claim(first == codes.release && after == codes.release),
        SafeKind::Ramp => {
            let between = |a: DacCode, x: DacCode| (a <= x && x <= codes.hold) || (codes.hold <= x && x <= a);
            claim(!released && between(present, first) && between(before, after));
        }
        SafeKind::HoldThenRelease => {
            claim(after == if released { codes.release } else { codes.hold });
            // Once let go it stays so, and of two periods the first is at most `hold_periods`.
            claim(before != codes.release || before == codes.hold || released);
            claim(first == codes.hold || codes.hold_periods == early);
        }
    }
}

/// A fault is latched: whatever the supervisor has been built from, whatever has been before, no silence, stop, fault of
/// board or clock, connection or consent to a run leads out of `Faulted`, or changes its cause. Samples: `exhaustive.rs`.
#[unsafe(no_mangle)]
extern "C" fn prove_faults_are_latched() {
    faults_are_latched(false);
}

/// An acknowledgement leads out of it.
#[unsafe(no_mangle)]
extern "C" fn refute_faults_are_latched() {
    faults_are_latched(true);
}

fn faults_are_latched(acknowledged: bool) {
    let supervisor: Supervisor<f32> = any();
    let mut s: SupervisorState<f32, OutputState<f32>> = any();
    assume(s.state() == State::Faulted);
    let cause = s.cause() as u8;
    if acknowledged {
        supervisor.acknowledge(&mut s);
    }
    match any_u32() % 7 {
        0 => supervisor.silence(&mut s, any_u32()),
        1 => supervisor.stop(&mut s, Cause::Operator),
        2 => supervisor.board_fault(&mut s, any_f32()),
        3 => supervisor.off_pace(&mut s, any_u32() as i32),
        4 => supervisor.connect(&mut s),
        5 => supervisor.disconnect(&mut s),
        _ => claim(!supervisor.arm(&mut s, DacCode(any_u32() as u16))),
    }
    claim(s.state() == State::Faulted && s.cause() as u8 == cause);
}
