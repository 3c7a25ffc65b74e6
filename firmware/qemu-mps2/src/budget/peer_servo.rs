//! The servo in C (`benches/peer_c/servo.c`), over the same inputs as ours.

use crate::laws::output;
use crate::meter::{Tally, instructions, line};
use crate::peer::{Memory, PeerLaw, PeerOutput, ctc_gains, pd_gains, pid_gains, smc_gains};
use crate::servos::{axis, ctc, inputs, params, pd, pid, smc};
use clutch_core::law::{ControlLaw, LawParams, PidParams};
use clutch_core::{Counts, Dac, Servo, Target};

/// `peer_channel`
#[repr(C)]
#[derive(Clone, Copy)]
struct PeerChannel {
    factors: [f32; 5],
    top: u32,
}

/// `peer_memory`, with nothing of the past.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct PeerMemory {
    error: i32,
    rate: f32,
    offset: f32,
}

/// `peer_target`
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct PeerTarget {
    position: i32,
    velocity: f32,
    acceleration: f32,
}

/// `peer_pd_axis`, `peer_ctc_axis`, `peer_smc_axis`; `peer_pid_axis`, whose law has a memory.
#[repr(C)]
#[derive(Clone, Copy)]
struct PeerAxis<const N: usize, const M: usize = 0> {
    channel: PeerChannel,
    memory: PeerMemory,
    target: PeerTarget,
    law: PeerLaw<N>,
    of_law: Memory<M>,
}

type Step<const N: usize, const M: usize> = unsafe extern "C" fn(*mut PeerAxis<N, M>, i32) -> u16;

unsafe extern "C" {
    fn peer_servo_pd(axis: *mut PeerAxis<2>, counts: i32) -> u16;
    fn peer_servo_ctc(axis: *mut PeerAxis<10>, counts: i32) -> u16;
    fn peer_servo_smc(axis: *mut PeerAxis<4>, counts: i32) -> u16;
    fn peer_servo_pid(axis: *mut PeerAxis<9, 3>, counts: i32) -> u16;
}

/// Encoder, (5) and converter of our servo.
fn channel() -> Option<PeerChannel> {
    let p = params(LawParams::Pd(Default::default()));
    let (dac, part) = (Dac::new(&p.dac).ok()?, 1.0 / 65_536.0);
    let (radians, smoothing) = (p.encoder.radians_per_count::<f32>() * part, 0.2);
    let scale = smoothing * radians / p.period.seconds::<f32>();
    let factors = [radians, 1.0 - smoothing, scale, p.dac.lowest, dac.per_volt()];
    Some(PeerChannel { factors, top: dac.top().0.into() })
}

/// Counts the C version, and the number of near inputs for which its code is more than one from ours: it may fuse a
/// product and a sum.
fn servo<const N: usize, const M: usize, C: ControlLaw<f32>>(
    name: &'static str,
    step: Step<N, M>,
    gains: [f32; N],
    ours: Servo<f32, C>,
) -> Option<()> {
    let o = output();
    let law = PeerLaw { gains, output: PeerOutput([o.lowest, o.highest, o.on_invalid, 0.0]) };
    let begun = PeerAxis {
        channel: channel()?,
        memory: PeerMemory::default(),
        target: PeerTarget::default(),
        law,
        of_law: [0.0; M],
    };
    // The lower word of a position: right while the shaft is near.
    let aims = |t: &Target<f32>| PeerTarget {
        position: t.position.0 as i32,
        velocity: t.velocity,
        acceleration: t.acceleration,
    };
    let (mut tally, mut theirs) = (Tally::new(name), begun);
    inputs(|counts, target, _| {
        theirs.target = aims(&target);
        // SAFETY: the arguments are those of the function.
        tally.add(unsafe { instructions(step as usize, [&raw mut theirs as usize, counts as usize, 0]) });
    });
    let (mut ours, mut theirs, mut differs) = (axis(ours), begun, 0);
    inputs(|counts, target, near| {
        theirs.target = aims(&target);
        // SAFETY: the arguments are those of the function.
        let code = unsafe { step(&raw mut theirs, counts) };
        let out = ours.servo.tick(&mut ours.state, Counts(counts), &target);
        if near && out.code.0.abs_diff(code) > 1 {
            differs += 1;
        }
    });
    tally.print();
    line("differs", differs);
    Some(())
}

/// Measures and prints.
pub fn measure() -> Option<()> {
    servo("peer_servo_pd", peer_servo_pd, pd_gains(), pd()?)?;
    servo("peer_servo_ctc", peer_servo_ctc, ctc_gains()?, ctc()?)?;
    servo("peer_servo_smc", peer_servo_smc, smc_gains(), smc()?)?;
    servo("peer_servo_pid", peer_servo_pid, pid_gains(&PidParams::default()), pid()?)
}
