//! The servo around PD, CTC, SMC and PID: each chosen when the image is built, and among all laws as a host may choose it.

use crate::inputs::{CORNERS, Random};
use crate::kernels::{Axis, servo_ctc, servo_pd, servo_pid, servo_smc, servo_tick};
use crate::laws::{OF_EACH, PERIOD, output};
use crate::meter::{Tally, instructions};
use clutch_core::law::{
    ControlLaw, Ctc, CtcParams, Law, LawParams, OutputParams, Pd, PdParams, Pid, PidParams, Smc, SmcParams,
};
use clutch_core::{Counts, FixedCounts, PlantParams, Servo, ServoParams, Target};

/// Calls from which on a target may be anywhere, and not a number.
const FAR: u32 = 1900;

/// A bumpless start has no offset: who compares has the same state from the first period.
fn plain() -> OutputParams<f32> {
    OutputParams { bumpless_time: 0.0, ..output() }
}

/// The paper's servo.
pub fn params(law: LawParams<f32>) -> ServoParams<f32> {
    ServoParams { output: plain(), ..ServoParams::paper(law) }
}

/// A shaft that keeps within eight counts of its path, with an error that changes by up to a third of a count in a
/// period; then targets that are anywhere. True: near.
pub fn inputs(mut each: impl FnMut(i32, Target<f32>, bool)) {
    let mut random = Random::new(6);
    let (mut counts, mut error) = (0_i32, 0.0_f32);
    for call in 0..2 * OF_EACH {
        counts = counts.wrapping_add(random.below(3) as i32);
        error = (error + random.around(0.33)).clamp(-8.0, 8.0);
        let near = call < FAR;
        let parts = FixedCounts::from_counts(i64::from(counts)).plus(FixedCounts::from_real(error));
        let any = FixedCounts((u64::from(random.next()) << 32 | u64::from(random.next())) as i64);
        let corner = CORNERS.get(call as usize % CORNERS.len()).copied().unwrap_or(0.0);
        let slow = if call % 2 == 0 { 0.35 } else { random.around(0.02) };
        let target = Target {
            position: if near { parts } else { any },
            velocity: if near { slow } else { corner },
            acceleration: random.around(10.0),
        };
        each(counts, target, near);
    }
}

/// Around its own law.
pub fn pd() -> Option<Servo<f32, Pd<f32>>> {
    let p = PdParams::default();
    Servo::with_law(&params(p.into()), Pd::new(&p, &plain(), PERIOD).ok()?).ok()
}

/// As [`pd`].
pub fn ctc() -> Option<Servo<f32, Ctc<f32>>> {
    let p = CtcParams::default();
    Servo::with_law(&params(p.into()), Ctc::new(&p, &PlantParams::default(), &plain(), PERIOD).ok()?).ok()
}

/// As [`pd`].
pub fn smc() -> Option<Servo<f32, Smc<f32>>> {
    let p = SmcParams::default();
    Servo::with_law(&params(p.into()), Smc::new(&p, &plain(), PERIOD).ok()?).ok()
}

/// As [`pd`].
pub fn pid() -> Option<Servo<f32, Pid<f32>>> {
    let p = PidParams::default();
    Servo::with_law(&params(p.into()), Pid::new(&p, &plain(), PERIOD).ok()?).ok()
}

/// The axis at rest on its path.
pub fn axis<C: ControlLaw<f32>>(servo: Servo<f32, C>) -> Axis<C> {
    let target = Target::default();
    let state = servo.start(Counts(0), &target, 0.0);
    Axis { servo, state, target }
}

fn count<C: ControlLaw<f32>>(
    name: &'static str,
    servo: Servo<f32, C>,
    step: extern "C" fn(&mut Axis<C>, i32) -> u16,
) {
    let (mut tally, mut axis) = (Tally::new(name), axis(servo));
    inputs(|counts, target, _| {
        axis.target = target;
        // SAFETY: the arguments are those of the function.
        tally.add(unsafe { instructions(step as usize, [&raw mut axis as usize, counts as usize, 0]) });
    });
    tally.print();
}

/// Measures and prints.
pub fn measure() -> Option<()> {
    count("servo_pd", pd()?, servo_pd);
    count("servo_ctc", ctc()?, servo_ctc);
    count("servo_smc", smc()?, servo_smc);
    count("servo_pid", pid()?, servo_pid);
    let any = |law: LawParams<f32>| Servo::<f32, Law<f32>>::new(&params(law)).ok();
    count("servo_tick_pd", any(PdParams::default().into())?, servo_tick);
    count("servo_tick_ctc", any(CtcParams::default().into())?, servo_tick);
    count("servo_tick_smc", any(SmcParams::default().into())?, servo_tick);
    count("servo_tick_pid", any(PidParams::default().into())?, servo_tick);
    Some(())
}
