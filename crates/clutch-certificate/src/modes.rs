//! Modes of a tick: a piece of the law, a case of the shaft, and counts that went by; all that can happen.
//!
//! A mode is a set of inequalities that hold in it, and what the next state can be at most along any direction. Variables are
//! `(e, s, z, p₁ … p_d, I, w)`: the error, its rate, the filter's memory, voltages on the way, the integral of a law that
//! remembers one, and last the encoder: in the exact form the last measured error `m₋`, in the noise form the rounding `φ` of
//! this tick.

use crate::coordinates::{E, P, S, Z};
use crate::pieces::{Line, Piece};
use crate::setup::{Case, Form, ModeId};
use crate::simplex::Constraints;
use crate::units::{TARGET_STEP, Units};

/// `weights·y + constant`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Affine<const N: usize> {
    pub(crate) weights: [f64; N],
    pub(crate) constant: f64,
}

impl<const N: usize> Affine<N> {
    fn constant(constant: f64) -> Self {
        Affine { weights: [0.0; N], constant }
    }

    fn of(i: usize, weight: f64) -> Self {
        let mut a = Affine::constant(0.0);
        a.weights[i] = weight;
        a
    }

    fn add(&mut self, other: &Affine<N>, factor: f64) {
        for (x, y) in self.weights.iter_mut().zip(&other.weights) {
            *x += factor * y;
        }
        self.constant += factor * other.constant;
    }

    fn plus(mut self, other: &Affine<N>, factor: f64) -> Self {
        self.add(other, factor);
        self
    }
}

/// A mode.
#[derive(Clone, Debug)]
pub(crate) struct Mode<const N: usize> {
    pub(crate) id: ModeId,
    /// Inequalities that hold in it.
    pub(crate) within: Constraints<N>,
    /// The measured error, and how far it may be off.
    measured: Affine<N>,
    measured_off: f64,
    /// The law's answer is between these.
    answer: [Affine<N>; 2],
    /// The voltage on the brake is between these.
    applied: [Affine<N>; 2],
    /// The next integral is between these, of a law that remembers one.
    memory: [Affine<N>; 2],
}

/// Modes of a cell, in either form of the encoder's rounding; the exact form takes up to `most_counts` counts per tick.
pub(crate) fn modes<const N: usize>(
    u: &Units,
    pieces: &[Piece],
    form: Form,
    most_counts: u32,
) -> Vec<Mode<N>> {
    let mut out = Vec::new();
    let counts = if form == Form::Exact { most_counts } else { 0 };
    for piece in pieces {
        for case in [Case::Slides, Case::LetGo, Case::TouchesAndLeaves, Case::TouchesAndStays] {
            out.extend(
                (0..=counts)
                    .filter_map(|j| mode(u, piece, form, ModeId { piece: piece.id, case, counts: j })),
            );
        }
    }
    out
}

fn mode<const N: usize>(u: &Units, piece: &Piece, form: Form, id: ModeId) -> Option<Mode<N>> {
    let w = N - 1;
    let (measured, measured_off) = match form {
        Form::Noise => (Affine::of(E, 1.0).plus(&Affine::of(w, 1.0), 1.0), 0.0),
        Form::Exact => {
            let gone = Affine::constant(u.path - f64::from(id.counts));
            (Affine::of(w, 1.0).plus(&gone, 1.0), TARGET_STEP)
        }
    };
    let line = |l: &Line, sign: f64| {
        let mut a = Affine::of(Z, l.z).plus(&measured, l.m);
        a.constant += l.constant + sign * l.m.abs() * measured_off;
        if let Some(i) = u.memory() {
            a.weights[i] += l.memory;
        }
        a
    };
    let answer = [line(&piece.volts[0], -1.0), line(&piece.volts[1], 1.0)];
    let memory = [line(&piece.next[0], -1.0), line(&piece.next[1], 1.0)];
    let applied = if u.delay == 0 { answer } else { [Affine::of(P, 1.0); 2] };
    let mut within = Constraints::new();
    let mut at_most = |a: &Affine<N>, limit: f64| within.push(&a.weights, limit - a.constant);

    // In every mode the shaft never runs backwards, the encoder rounds down, and so the filter's rate is at most the path's.
    at_most(&Affine::of(S, 1.0), u.path);
    let rounding = measured.plus(&Affine::of(E, 1.0), -1.0);
    at_most(&rounding, 1.0 + measured_off);
    at_most(&Affine::constant(0.0).plus(&rounding, -1.0), measured_off);
    let rate = measured.plus(&Affine::of(Z, 1.0), -1.0);
    at_most(&Affine::constant(0.0).plus(&rate, u.kappa), u.path + (1.0 + u.kappa) * TARGET_STEP);

    for l in &piece.within {
        at_most(&line(l, -1.0), 0.0);
    }
    // A fixed voltage decides by itself.
    let fixed = applied.iter().all(|a| a.weights.iter().all(|x| *x == 0.0));
    let mut volts = |from: Option<f64>, to: Option<f64>| {
        let [low, high] = &applied;
        if let Some(from) = from {
            if fixed && high.constant < from {
                return false;
            }
            at_most(&Affine::constant(0.0).plus(high, -1.0), -from);
        }
        if let Some(to) = to {
            if fixed && low.constant > to {
                return false;
            }
            at_most(low, to);
        }
        true
    };
    let possible = match id.case {
        Case::Slides => true,
        Case::LetGo => volts(None, Some(u.lets_go)),
        Case::TouchesAndLeaves => volts(Some(u.lets_go), Some(u.stays)),
        Case::TouchesAndStays => volts(Some(u.lets_go.max(u.stays)), None),
    };
    // The speed before the tick, ω_d − s.
    match id.case {
        Case::Slides => at_most(&Affine::of(S, 1.0), u.path - u.slow),
        Case::LetGo => at_most(&Affine::of(S, -1.0), u.slow - u.path),
        Case::TouchesAndLeaves | Case::TouchesAndStays => {
            let slack = u.drive[0].min(u.brake[1] * u.lets_go);
            let slowed = Affine::of(S, -1.0).plus(&applied[1], -u.brake[1]);
            at_most(&slowed, u.slow - slack - u.path);
        }
    }
    possible.then_some(Mode { id, within, measured, measured_off, answer, applied, memory })
}

impl<const N: usize> Mode<N> {
    /// The most that `c·x` can be after the tick, before anything is known of the state.
    pub(crate) fn next(&self, u: &Units, c: &[f64; N]) -> Affine<N> {
        let (ce, cs) = (c[E], c[S]);
        let mut out = Affine::constant(ce.abs() * TARGET_STEP);
        let volts = |out: &mut Affine<N>, factor: f64, between: &[Affine<N>; 2]| {
            out.add(&between[usize::from(factor >= 0.0)], factor);
        };
        out.weights[E] += ce;
        match self.id.case {
            Case::Slides | Case::LetGo => {
                let slides = self.id.case == Case::Slides;
                let (b, g) = if slides { (u.brake, u.drive) } else { (u.brake_any, u.drive_any) };
                // ∫ (c_s + c_e (1 − τ)) ṡ dτ over the tick, ṡ between b₁ v − g₂ and b₂ v − g₁.
                let (pro, contra) = parts(cs + ce, cs);
                out.weights[S] += ce + cs;
                out.constant += contra * g[1] - pro * g[0];
                volts(&mut out, pro * b[1] - contra * b[0], &self.applied);
            }
            Case::TouchesAndLeaves | Case::TouchesAndStays => {
                out.constant += (cs + ce) * u.path;
                let leaves = self.id.case == Case::TouchesAndLeaves;
                let mut up = 0.0;
                if cs < 0.0 {
                    out.constant -= cs * u.slow;
                    up -= cs;
                }
                if ce < 0.0 {
                    // The way is at most ω + ω₁ + up/2, with ω = ω_d − s.
                    out.constant -= ce * (u.path + u.slow);
                    out.weights[S] += ce;
                    up -= 0.5 * ce;
                }
                if leaves {
                    out.constant += up * u.drive_any[1];
                    volts(&mut out, -up * u.brake_leaving, &self.applied);
                }
            }
        }
        let mut measured = u.kappa * c[Z];
        out.weights[Z] += (1.0 - u.kappa) * c[Z];
        if self.measured_off > 0.0 {
            measured += c[N - 1];
        }
        out.add(&self.measured, measured);
        out.constant += measured.abs() * self.measured_off;
        if let Some(i) = u.memory() {
            volts(&mut out, c[i], &self.memory);
        }
        for k in 0..u.delay {
            if k + 1 < u.delay {
                out.weights[P + k + 1] += c[P + k];
            } else {
                volts(&mut out, c[P + k], &self.answer);
            }
        }
        out
    }
}

/// Integrals of the positive and of the negative part of a line from `a` at 0 to `b` at 1.
fn parts(a: f64, b: f64) -> (f64, f64) {
    if a >= 0.0 && b >= 0.0 {
        return (0.5 * (a + b), 0.0);
    }
    if a <= 0.0 && b <= 0.0 {
        return (0.0, -0.5 * (a + b));
    }
    let (high, low) = (a.max(b), -a.min(b));
    let sum = 2.0 * (high + low);
    (high * high / sum, low * low / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pieces::tests::{answer, remembered, with_an_integral};
    use crate::pieces::{pieces, strips};
    use crate::setup::{Ends, Gains, Motor, Setup};
    use crate::tests::uniform;

    /// A tick of a shaft whose friction and drive vary as they may, in 4000 steps: way and speed, in counts and ticks.
    fn tick(
        s: &Setup,
        mu: (f64, f64),
        start: f64,
        volts: f64,
        next: &mut dyn FnMut(f64, f64) -> f64,
    ) -> (f64, f64) {
        let steps = 4000;
        let (speed, per) = {
            let count = core::f64::consts::TAU / f64::from(s.counts_per_rev);
            (count / s.period_s, s.period_s * s.period_s / count / s.inertia[0])
        };
        let (mut way, mut omega) = (0.0, start);
        // Both change once, at any instant.
        let changes = next(0.0, f64::from(steps)) as i32;
        let mut push = [next(-1.0, 1.0), next(-1.0, 1.0)].map(|x| s.torque_noise * x);
        let mut factor = [next(-1.0, 1.0), next(-1.0, 1.0)].map(|x| 1.0 + s.ripple * x);
        for step in 0..steps {
            if step == changes {
                push.swap(0, 1);
                factor.swap(0, 1);
            }
            let level = mu.1 + (mu.0 - mu.1) * (-(omega * speed) / s.stribeck[0]).exp();
            // The torque that presses, and the one that drives.
            let (pressed, driven) = match &s.motor {
                Some(motor) => (motor.preload, motor.gain[0] * (s.counted_from() - volts)),
                None => (s.brake_gain[0] * volts.max(0.0), 0.0),
            };
            let brake = factor[0] * pressed;
            let drive = s.drive_torque[0] + push[0] + driven;
            let torque = if omega == 0.0 {
                (drive - mu.0 * brake).max(0.0)
            } else {
                drive - level * brake - s.viscous_damping[0] * omega * speed
            };
            let dt = 1.0 / f64::from(steps);
            way += omega * dt;
            omega = (omega + torque * per * dt).max(0.0);
        }
        (way, omega)
    }

    #[test]
    fn a_simulated_tick_goes_no_further_than_its_mode_allows() {
        let laws = [
            Gains::Linear { kp: 5000.0, kd: 50.0, forward: 0.0 },
            Gains::Layer { kp: 5.0, kd: 50.0, slope: 70.0, boundary: 0.2 },
            Gains::Shell { slope: 100.0, boundary: 0.1 },
        ];
        let mut next = uniform(11);
        let mut seen = [0; 4];
        for (law, form) in laws.into_iter().flat_map(|law| [(law, Form::Noise), (law, Form::Exact)]) {
            ticks::<4>(&brake(law), form, &mut next, &mut seen);
        }
        assert!(seen.iter().all(|n| *n > 20), "{seen:?}");
        let mut seen = [0; 4];
        for form in [Form::Noise, Form::Exact] {
            ticks::<5>(&brake(with_an_integral(0.05, 0.0)), form, &mut next, &mut seen);
            ticks::<5>(&brake(with_an_integral(0.005, 1.5)), form, &mut next, &mut seen);
        }
        assert!(seen.iter().all(|n| *n > 5), "{seen:?}");
    }

    #[test]
    fn a_simulated_tick_of_a_motor_axis_goes_no_further_than_its_mode_allows() {
        let mut next = uniform(12);
        let mut seen = [0; 4];
        let laws =
            [Gains::Linear { kp: 500.0, kd: 8.0, forward: 0.6 }, Gains::Shell { slope: 50.0, boundary: 0.2 }];
        for (law, form) in laws.into_iter().flat_map(|law| [(law, Form::Noise), (law, Form::Exact)]) {
            for corner in 0..4 {
                ticks::<4>(&motor(law, corner), form, &mut next, &mut seen);
            }
        }
        assert!(seen.iter().all(|n| *n > 20), "{seen:?}");
    }

    fn brake(law: Gains) -> Setup {
        Setup {
            sliding: [0.13, 0.17],
            at_rest: [0.17, 0.25],
            ripple: 0.05,
            torque_noise: 0.002,
            ..Setup::paper(law)
        }
    }

    /// An axis whose simulated shaft, which has the first of each two ends, is at a corner of inertia and torque per volt.
    fn motor(law: Gains, corner: u32) -> Setup {
        let ends = |low: f64, high: f64, turned: bool| if turned { [high, low] } else { [low, high] };
        Setup {
            drive_torque: [0.001; 2],
            brake_gain: [0.0; 2],
            inertia: ends(0.0016, 0.0018, corner % 2 == 1),
            motor: Some(Motor { gain: ends(0.048, 0.052, corner / 2 == 1), preload: 0.25 }),
            volts: [-0.3, 4.0],
            start_volts: [0.5, 1.0],
            stribeck: [0.003, 1.0],
            ..brake(law)
        }
    }

    /// The box whose shaft a setup simulates, its ends in order.
    fn ordered(setup: &Setup) -> Setup {
        let ends = |[a, b]: Ends| [a.min(b), a.max(b)];
        let motor = setup.motor.map(|m| Motor { gain: ends(m.gain), ..m });
        Setup { inertia: ends(setup.inertia), motor, ..setup.clone() }
    }

    /// Ticks of a law from random states, each held against every mode that allows it; counts the shaft's cases.
    fn ticks<const N: usize>(
        setup: &Setup,
        form: Form,
        next: &mut dyn FnMut(f64, f64) -> f64,
        seen: &mut [i32; 4],
    ) {
        let slow = setup.slow_exponents()[0];
        let u = Units::new(&ordered(setup), setup.sliding, slow, 3.0);
        let law = u.law;
        let modes: Vec<Mode<N>> = modes(&u, &pieces(&u, &strips(&law, u.volts)), form, 6);
        for _ in 0..400 {
            let omega = if next(0.0, 1.0) < 0.3 { next(0.0, 0.03) } else { next(0.0, 1.0) };
            let (e, rounding) = (next(-8.0, 4.0), next(0.0, 1.0));
            let m = e + rounding;
            // A filter that has seen no rate above the path's.
            let z = m - next(-1.5, u.path) / u.kappa;
            let mu_d = next(0.13, 0.17);
            let mu_s = next(0.17, 0.25);
            let integral = if law.remembers() { next(-1.0, 10.5) } else { 0.0 };
            let volts = answer(&u, m, z, integral) + next(-1.0, 1.0) * 0.5 * setup.converter_step;
            let (way, after) = tick(setup, (mu_s, mu_d), omega, volts, next);
            let gone = next(0.0, 3.0).floor();
            let last = if form == Form::Exact { m - u.path + gone } else { rounding };
            let state = |first: [f64; 3], integral: f64, last: f64| -> [f64; N] {
                std::array::from_fn(|i| match i {
                    0..3 => first[i],
                    i if i == N - 1 => last,
                    _ => integral,
                })
            };
            let y = state([e, u.path - omega, z], integral, last);
            let first = [e + u.path - way, u.path - after, z + u.kappa * (m - z)];
            let x = state(first, remembered(&u, m, z, integral), m);
            let fits = |mode: &&Mode<N>| {
                (form == Form::Noise || f64::from(mode.id.counts) == gone)
                    && (0..mode.within.len()).all(|j| {
                        let at: f64 = mode.within.row(j).iter().zip(y).map(|(a, y)| a * y).sum();
                        at <= mode.within.rhs[j] + 1e-9
                    })
            };
            let fitting: Vec<&Mode<N>> = modes.iter().filter(fits).collect();
            assert!(!fitting.is_empty(), "{law:?} {form:?} {y:?}");
            for _ in 0..20 {
                let mut c: [f64; N] = std::array::from_fn(|_| next(-1.0, 1.0));
                if form == Form::Noise {
                    c[N - 1] = 0.0;
                }
                let reached: f64 = c.iter().zip(x).map(|(c, x)| c * x).sum();
                let most = fitting
                    .iter()
                    .map(|mode| {
                        let bound = mode.next(&u, &c);
                        bound.constant + bound.weights.iter().zip(y).map(|(w, y)| w * y).sum::<f64>()
                    })
                    .fold(f64::NEG_INFINITY, f64::max);
                assert!(reached <= most + 5e-4, "{law:?} {form:?} {y:?}: {reached} above {most}");
            }
            for mode in fitting {
                seen[mode.id.case as usize] += 1;
            }
        }
    }
}
