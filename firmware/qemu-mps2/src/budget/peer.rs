//! The laws in C (`benches/peer_c`), over the same inputs as ours.

use crate::inputs::{Random, ticks};
use crate::laws::{OF_EACH, PERIOD, output};
use crate::meter::{Tally, instructions, line};
use clutch_core::law::{
    ControlLaw, Ctc, CtcParams, Listed, Pd, PdParams, Pid, PidParams, Smc, SmcParams, SmcSign, SmcSignParams,
};
use clutch_core::{Actuator, PlantParams, StribeckParams};

/// `peer_tick`
#[repr(C)]
struct PeerTick([f32; 4]);

/// `peer_output`: lowest, highest, on_invalid, decay.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct PeerOutput(pub [f32; 4]);

/// `peer_pd_law`, `peer_ctc_law`, `peer_smc_law`, `peer_pid_law`: gains, then the output.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct PeerLaw<const N: usize> {
    pub gains: [f32; N],
    pub output: PeerOutput,
}

/// The memory of a law: the offset of a bumpless start, then of PID `peer_pid_memory`.
pub type Memory<const M: usize> = [f32; M];

type Step<const N: usize, const M: usize> =
    unsafe extern "C" fn(*const PeerLaw<N>, *mut Memory<M>, *const PeerTick) -> f32;

unsafe extern "C" {
    fn peer_pd(law: *const PeerLaw<2>, memory: *mut Memory<1>, tick: *const PeerTick) -> f32;
    fn peer_ctc(law: *const PeerLaw<10>, memory: *mut Memory<1>, tick: *const PeerTick) -> f32;
    fn peer_smc(law: *const PeerLaw<4>, memory: *mut Memory<1>, tick: *const PeerTick) -> f32;
    fn peer_smc_sign(law: *const PeerLaw<4>, memory: *mut Memory<1>, tick: *const PeerTick) -> f32;
    fn peer_pid(law: *const PeerLaw<9>, memory: *mut Memory<3>, tick: *const PeerTick) -> f32;
}

/// Counts the C version, and the number of ordinary inputs for which its answer is more than a
/// millivolt from ours: it may fuse a product and a sum.
fn law<const N: usize, const M: usize, L: ControlLaw<f32>>(
    name: &'static str,
    step: Step<N, M>,
    gains: [f32; N],
    ours: &L,
) {
    let o = output();
    let law = PeerLaw { gains, output: PeerOutput([o.lowest, o.highest, o.on_invalid, 0.98]) };
    let mut tally = Tally::new(name);
    let mut random = Random::new(1);
    let (mut memory, mut differs) = ([0.0; M], 0);
    ticks(&mut Random::new(2), OF_EACH, |t, ordinary| {
        if random.below(8) == 0 {
            memory = [0.0; M];
            if let Some(offset) = memory.first_mut() {
                *offset = random.around(10.0);
            }
        }
        let tick = PeerTick([t.error, t.error_rate, t.target_velocity, t.target_acceleration]);
        let arguments = [&raw const law as usize, &raw mut memory as usize, &raw const tick as usize];
        // SAFETY: the arguments are those of the function.
        tally.add(unsafe { instructions(step as usize, arguments) });
        let mut state = L::State::default();
        let mut none = [0.0; M];
        // SAFETY: the arguments are those of the function.
        let theirs = unsafe { step(&law, &mut none, &tick) };
        let apart = ours.update(&mut state, &t).voltage - theirs;
        if ordinary && !(-0.001..=0.001).contains(&apart) {
            differs += 1;
        }
    });
    tally.print();
    line("differs", differs);
}

/// Those of Table 2.
pub fn pd_gains() -> [f32; 2] {
    let p = PdParams::<f32>::default();
    [p.kp, p.kd]
}

/// As [`pd_gains`], and the model.
pub fn ctc_gains() -> Option<[f32; 10]> {
    let plant = PlantParams::<f32>::default();
    let (p, f) = (CtcParams::<f32>::default(), StribeckParams::<f32>::default());
    Some([
        p.outer_gain,
        p.kp,
        p.kd,
        plant.inertia,
        plant.drive_torque,
        plant.viscous_damping,
        Actuator::new(&plant.actuator).ok()?.brake_gain(),
        f.mu_static,
        f.mu_dynamic,
        1.0 / f.stribeck_velocity,
    ])
}

/// As [`pd_gains`].
pub fn smc_gains() -> [f32; 4] {
    let p = SmcParams::<f32>::default();
    [p.kp, p.kd, p.slope, 1.0 / p.boundary]
}

/// Of PID.
pub fn pid_gains(p: &PidParams<f32>) -> [f32; 9] {
    let period = PERIOD.seconds::<f32>();
    [
        p.kp,
        p.ki * period,
        p.kd,
        period / (p.derivative_time + period),
        period / p.tracking_time,
        p.bias,
        p.coulomb,
        p.velocity,
        p.acceleration,
    ]
}

/// Measures and prints.
pub fn measure() -> Option<()> {
    let (plant, output) = (PlantParams::<f32>::default(), output());
    let p = PdParams::<f32>::default();
    law("peer_pd", peer_pd, pd_gains(), &Pd::new(&p, &output, PERIOD).ok()?);
    let p = CtcParams::<f32>::default();
    law("peer_ctc", peer_ctc, ctc_gains()?, &Ctc::new(&p, &plant, &output, PERIOD).ok()?);
    let p = SmcParams::<f32>::default();
    law("peer_smc", peer_smc, smc_gains(), &Smc::new(&p, &output, PERIOD).ok()?);
    let p = SmcSignParams::<f32>::default();
    law("peer_smc_sign", peer_smc_sign, smc_gains(), &SmcSign::new(&p, &output, PERIOD).ok()?);
    // With all that the law has, as ours is counted.
    let p: PidParams<f32> = Pid::busiest();
    law("peer_pid", peer_pid, pid_gains(&p), &Pid::new(&p, &output, PERIOD).ok()?);
    Some(())
}
