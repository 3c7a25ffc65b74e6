//! A Kalman observer of the shaft: position, velocity, and the torque that nobody measures.
//!
//! ```text
//! θ̇ = ω,   J ω̇ = d + T(v_a) − C_d ω − T_f,   |T_f| ≤ μ_d N(v_a),   ḋ = q_d · white noise
//! ```
//!
//! `T` and `N` are the [`Actuator`]'s; `d` is the drive torque of (1) and whatever the model of friction gets wrong: both
//! enter at one place. The encoder rounds down, so the angle measured lies half a count above the
//! counts, with the variance q²/12 of a uniform error.
//!
//! The brake acts against the *predicted* velocity: within a tick it can bring it to zero and
//! no further. With the sign of the last estimate instead, a model at rest would chatter by
//! `2 μ_d K_COF v_a T/J`, 3 °/s in the paper's clutch. Friction is `μ_d` at every speed; while
//! the shaft sticks, `d` takes what `μ_s` holds beyond it.
//!
//! Measured error of the velocity, RMS (20 000 counts per revolution, 1 ms, friction as the
//! model has it; the test module repeats it):
//!
//! | motion | `q_d` 0.03 | `q_d` 0.1 (default) | `q_d` 0.3 | (5) with 0.2 |
//! |---|---|---|---|---|
//! | 2 °/s | 0.42 | 0.92 | 1.97 | 1.11 °/s |
//! | 20 °/s | 0.43 | 0.93 | 1.88 | 1.12 °/s |
//! | 20 ± 10 °/s at 10 Hz | 1.60 | 1.00 | 1.34 | 2.22 °/s |
//! | 20 ± 10 °/s at 20 Hz | 6.19 | 2.80 | 1.79 | 3.66 °/s |
//!
//! At a constant speed any slower observer looks better; the default is the one of the three
//! that wins in every row against (5). A tick takes 25 ns on an x86-64 host, (5) takes 2.4 ns.

use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{Actuator, Arithmetic, Encoder, FixedCounts, Micros, ParamError, Plant, Real};
use nalgebra::{Matrix3, Vector3};

crate::params! {
    /// A stationary Kalman filter for position, velocity and the torque that nobody measures. It predicts with the
    /// model.
    pub struct ObserverParams<T>: Default {
        /// Rate at which the disturbance torque wanders: by this much (standard deviation) in one second, and with
        /// the root of the time. Larger follows friction faster and lets more of the encoder's steps through.
        disturbance_walk: T = 0.1, "disturbance_walk_nm_rt_s" "q_d" NM_RT_S, Range::above(0.0);
    }
    relations(p) {
        /// Gains come out.
        STABLE: disturbance_walk, "a number in N m/√s for which, with model.inertia_kg_m2 and sampling.period_us, stable gains exist in sampling.scalar";
    }
}

crate::params! {
    /// Stationary gains on the innovation, the measured angle less the predicted one.
    #[derive(Default)]
    pub struct ObserverGains<T> {
        /// To the position.
        position: T, "position" "" NONE, Range::above(0.0);
        /// To the velocity.
        velocity: T, "velocity_1_s" "" PER_S, Range::above(0.0);
        /// To the disturbance torque.
        disturbance: T, "disturbance_nm_rad" "" NM_RAD, Range::above(0.0);
    }
    relations(p) {
        /// The error dies away.
        STABLE: disturbance, "a gain with which, and with position and velocity_1_s, the error dies away: a smaller one, N m/rad";
    }
}

/// The observer's belief after a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate<T> {
    /// Angle above the lower edge of the measured count, rad; mostly within one count.
    pub position_offset: T,
    /// `θ̇`, rad/s.
    pub velocity: T,
    /// `d`: drive torque and the error of the friction model, N m.
    pub disturbance_torque: T,
}

/// The observer, with its gains.
///
/// ```
/// use clutch_core::{Encoder, FixedCounts, Micros, Observer, ObserverParams, Plant, PlantParams};
/// let plant = Plant::<f64>::new(&PlantParams { viscous_damping: 0.0, ..Default::default() })?;
/// let observer = Observer::new(&ObserverParams::default(), &plant, Encoder::PAPER, Micros(1000))?;
/// // 20 °/s under the brake that balances the weight.
/// let (rate, volts) = (20.0_f64.to_radians(), plant.holding_voltage_sliding());
/// let mut state = observer.start(FixedCounts::from_counts(0), 0.0);
/// let mut velocity = 0.0;
/// for tick in 1..500 {
///     let counts = (rate * 1e-3 * tick as f64 * 20_000.0 / core::f64::consts::TAU) as i64;
///     velocity = observer.update(&mut state, FixedCounts::from_counts(counts), volts).velocity;
/// }
/// assert!((velocity - rate).abs() < 0.02);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[doc(alias = "kalman")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer<T> {
    model: Model<T>,
    gains: ObserverGains<T>,
    actuator: Actuator<T>,
    /// Velocity that friction takes away in a tick for each N m of normal force as torque per unit of μ, rad/s/(N m).
    slowing: T,
    drive_torque: T,
    radians_per_count: T,
    half_count: T,
}

/// Memory of the observer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObserverState<T> {
    /// The last measurement. The estimate is relative to it: in `f32` an angle from the
    /// encoder's zero would lose its counts after 839 turns.
    last: FixedCounts,
    estimate: Estimate<T>,
}

/// One period of the model under a constant torque `u`, exact:
///
/// ```text
/// θ' = θ + φ12 ω + φ13 u
/// ω' =     φ22 ω + φ23 u
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
struct Model<T> {
    /// s
    phi12: T,
    /// s²/(kg m²)
    phi13: T,
    /// 1 − φ22, computed without the cancellation.
    loss: T,
    /// s/(kg m²)
    phi23: T,
    /// φ13/φ23: travel lost for the velocity lost to a constant torque, s.
    slowing_travel: T,
}

impl<T: Real> Model<T> {
    fn new(inertia: T, damping: T, period: T) -> Self {
        let x = damping * period / inertia;
        let (g1, g2) = decay_integrals(x);
        let phi12 = period * g1;
        Model {
            phi12,
            phi13: period * period * g2 / inertia,
            loss: x * g1,
            phi23: phi12 / inertia,
            slowing_travel: period * g2 / g1,
        }
    }
}

/// `(1 − e⁻ˣ)/x` and `(x − 1 + e⁻ˣ)/x²` for x ≥ 0: the mean of `e⁻ˣˢ` over 0 ≤ s ≤ 1, and of
/// its integral.
fn decay_integrals<T: Real>(x: T) -> (T, T) {
    if x > T::ONE {
        let g1 = (T::ONE - (-x).exp()) / x;
        return (g1, (T::ONE - g1) / x);
    }
    // The formulas cancel for small x. Nested series; 1/20! is below the last bit of 1/2.
    let (mut g1, mut g2) = (T::ZERO, T::ZERO);
    let mut n = T::from_i32(21);
    for _ in 0..20 {
        g1 = T::ONE - x * g1 / n;
        g2 = T::ONE - x * g2 / (n + T::ONE);
        n -= T::ONE;
    }
    (g1, g2 / T::from_i32(2))
}

impl<T: Real> Observer<T> {
    /// Finds the stationary gains, in double precision: for a board it is cheaper to do this on
    /// the host and to use [`Observer::with_gains`].
    ///
    /// # Errors
    /// `disturbance_walk` not positive, not finite, or so small or large that no gains come
    /// out; `period` out of range.
    pub fn new(
        p: &ObserverParams<T>,
        plant: &Plant<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let walk = p.disturbance_walk;
        period.period::<T>()?;
        let out_of_range = ObserverParams::STABLE.error(walk);
        let plant_params = plant.params();
        let gains = design(
            walk.to_f64(),
            plant_params.inertia.to_f64(),
            plant_params.viscous_damping.to_f64(),
            encoder.radians_per_count(),
            period.seconds(),
        )
        .ok_or(out_of_range)?;
        Observer::with_gains(&gains.cast(), plant, encoder, period).map_err(|_| out_of_range)
    }

    /// An observer with gains found elsewhere, for the same plant, encoder and period.
    ///
    /// # Errors
    /// Fields `position`, `velocity`, `disturbance`: one that is not positive and finite, or (the
    /// last) with which the error would not die away; `period` out of range.
    pub fn with_gains(
        gains: &ObserverGains<T>,
        plant: &Plant<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        gains.check_rows()?;
        let p = plant.params();
        let model = Model::new(p.inertia, p.viscous_damping, period.period()?);
        ObserverGains::STABLE.require(gains.disturbance, error_dies_away(gains, &model))?;
        let radians_per_count = encoder.radians_per_count::<T>();
        Ok(Observer {
            model,
            gains: *gains,
            actuator: *plant.actuator(),
            slowing: model.phi23 * plant.friction().sliding(),
            drive_torque: p.drive_torque,
            radians_per_count,
            half_count: radians_per_count / T::from_i32(2),
        })
    }

    /// The gains.
    #[must_use]
    pub fn gains(&self) -> &ObserverGains<T> {
        &self.gains
    }

    /// The state for a shaft at `position` that moves at `velocity`, rad/s, driven by the
    /// plant's drive torque.
    #[must_use]
    pub fn start(&self, position: FixedCounts, velocity: T) -> ObserverState<T> {
        ObserverState {
            last: position,
            estimate: Estimate {
                position_offset: self.half_count,
                velocity: if velocity.is_finite() { velocity } else { T::ZERO },
                disturbance_torque: self.drive_torque,
            },
        }
    }

    /// One sample: the counts now and the volts on the brake since the last sample in, the
    /// estimate now out.
    ///
    /// After a jump of the counts the error dies away like any other. An estimate that
    /// overflows starts anew at rest; none is ever NaN.
    #[inline]
    pub fn update(&self, state: &mut ObserverState<T>, position: FixedCounts, volts: T) -> Estimate<T> {
        let Estimate { position_offset, velocity, disturbance_torque } = state.estimate;
        let m = &self.model;
        // Prediction: how fast without the brake, and how much of that the brake takes away.
        let driving = disturbance_torque + self.actuator.torque(volts);
        let free = velocity - m.loss * velocity + m.phi23 * driving;
        let most = self.actuator.friction(self.slowing, volts);
        let slowed = free.limit(-most, most);
        let travel = m.phi12 * velocity + m.phi13 * driving - m.slowing_travel * slowed;
        // Correction, relative to the new counts.
        let moved = position.minus::<T>(state.last) * self.radians_per_count;
        let predicted = position_offset + travel - moved;
        let innovation = self.half_count - predicted;
        let estimate = Estimate {
            position_offset: predicted + self.gains.position * innovation,
            velocity: free - slowed + self.gains.velocity * innovation,
            disturbance_torque: disturbance_torque + self.gains.disturbance * innovation,
        };
        let finite = estimate.position_offset.is_finite()
            && estimate.velocity.is_finite()
            && estimate.disturbance_torque.is_finite();
        *state =
            if finite { ObserverState { last: position, estimate } } else { self.start(position, T::ZERO) };
        state.estimate
    }
}

/// True if every root of the error's characteristic polynomial lies inside the unit circle.
///
/// The error of the prediction goes with `(I − K C) Φ`. With `z = 1 + w` its polynomial is
/// `w³ + b2 w² + b1 w + b0`, whose coefficients are sums of positive terms: nothing cancels,
/// not even in `f32` with roots near 1. Then `w = 2s/(1 − s)` and the criterion of Routh.
fn error_dies_away<T: Real>(k: &ObserverGains<T>, m: &Model<T>) -> bool {
    let n = T::from_i32;
    let reach = m.phi12 * m.phi23 + m.phi13 * m.loss;
    let b0 = k.disturbance * reach;
    let b1 = k.position * m.loss + k.velocity * m.phi12 + k.disturbance * (m.phi13 + reach);
    let b2 = m.loss + k.position + k.velocity * m.phi12 + k.disturbance * m.phi13;
    let s3 = n(8) - n(4) * b2 + n(2) * b1 - b0;
    let s2 = n(4) * b2 - n(4) * b1 + n(3) * b0;
    let s1 = n(2) * b1 - n(3) * b0;
    s3 > T::ZERO && s2 > T::ZERO && s1 > T::ZERO && b0 > T::ZERO && s2 * s1 > s3 * b0
}

/// The stationary Kalman gains.
///
/// In the units count, count per period and count · J / period² the problem has two numbers
/// left, the damping `x = C_d T/J` and the variance `ρ` that the torque gains in a period, and
/// the measurement has the variance 1/12. The Riccati difference equation
///
/// ```text
/// P' = Φ (P⁻¹ + Cᵀ 12 C)⁻¹ Φᵀ + Q
/// ```
///
/// is iterated from P = 0 by doubling (Chu, Fan, Lin and Wang 2004): after n rounds `h` is P
/// after 2ⁿ periods, so 64 rounds are enough for any observer worth having.
fn design(walk: f64, inertia: f64, damping: f64, count: f64, period: f64) -> Option<ObserverGains<f64>> {
    let x = damping * period / inertia;
    let (g1, g2) = decay_integrals(x);
    let torque_unit = count * inertia / (period * period);
    let rho = walk * walk * period / (torque_unit * torque_unit);
    // The state that a step of the torque, s before the end of the period, has made by then;
    // integrated over the period by Gauss and Legendre's three points, exact without damping.
    let mut q = Matrix3::zeros();
    let off_centre = Arithmetic::sqrt(0.15_f64);
    for (s, weight) in [(0.5 - off_centre, 5.0), (0.5, 8.0), (0.5 + off_centre, 5.0)] {
        let (g1, g2) = decay_integrals(x * s);
        let reached = Vector3::new(s * s * g2, s * g1, 1.0);
        q += reached * reached.transpose() * (rho * weight / 18.0);
    }
    let mut a = Matrix3::new(1.0, g1, g2, 0.0, 1.0 - x * g1, g1, 0.0, 0.0, 1.0).transpose();
    let mut g = Matrix3::zeros();
    g.m11 = 12.0;
    let mut h = q;
    let mut gain = Vector3::zeros();
    for _ in 0..64 {
        let w = (Matrix3::identity() + g * h).try_inverse()?;
        let (aw, hw) = (a * w, h * w);
        let next_g = g + aw * g * a.transpose();
        let next_h = h + a.transpose() * hw * a;
        a = aw * a;
        // Symmetric in exact arithmetic; kept so.
        g = (next_g + next_g.transpose()) * 0.5;
        h = (next_h + next_h.transpose()) * 0.5;
        let next_gain = Vector3::new(h.m11, h.m12, h.m13) * (1.0 / (h.m11 + 1.0 / 12.0));
        let change = next_gain - gain;
        gain = next_gain;
        let small = |change: f64, of: f64| change.abs() <= 1e-13 * of;
        if small(change.x, gain.x) && small(change.y, gain.y) && small(change.z, gain.z) {
            return Some(ObserverGains {
                position: gain.x,
                velocity: gain.y / period,
                disturbance: gain.z * (inertia / (period * period)),
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DerivativeState, PlantParams, SmoothedDerivative, SmoothedDerivativeParams};
    use proptest::prelude::*;
    use std::vec::Vec;

    const MS: Micros = Micros(1000);

    fn plant<T: Real>() -> Plant<T> {
        Plant::new(&PlantParams::default()).unwrap()
    }

    fn observer<T: Real>() -> Observer<T> {
        Observer::new(&ObserverParams::default(), &plant(), Encoder::PAPER, MS).unwrap()
    }

    /// Reading of the paper's encoder at an angle, rad.
    fn read(angle: f64) -> FixedCounts {
        FixedCounts::from_counts((angle * Encoder::PAPER.counts_per_radian::<f64>()).floor() as i64)
    }

    /// The volts under which the paper's shaft keeps its rate.
    fn balance(rate: f64) -> f64 {
        let plant = plant::<f64>();
        let p = plant.params();
        (p.drive_torque - p.viscous_damping * rate)
            / (plant.friction().sliding() * plant.actuator().brake_gain())
    }

    /// RMS errors of the velocity by the observer and by (5), °/s, over `rate + ripple
    /// sin(2π hz t)`, all in degrees, for 200 s after 2 s.
    fn rms(walk: f64, rate: f64, ripple: f64, hz: f64) -> (f64, f64) {
        let p = ObserverParams { disturbance_walk: walk };
        let o = Observer::new(&p, &plant::<f64>(), Encoder::PAPER, MS).unwrap();
        let f =
            SmoothedDerivative::<f64>::new(&SmoothedDerivativeParams::default(), Encoder::PAPER, MS).unwrap();
        let (rate, ripple) = (rate.to_radians(), ripple.to_radians());
        let (volts, omega) = (balance(rate), core::f64::consts::TAU * hz);
        let mut so = o.start(FixedCounts(0), rate);
        let mut sf = DerivativeState::at(FixedCounts(0));
        let (mut by_observer, mut by_difference) = (0.0, 0.0);
        for k in 1..=202_000 {
            let t = f64::from(k) * 1e-3;
            let counts = read(rate * t + ripple / omega * (1.0 - libm::cos(omega * t)));
            let truth = rate + ripple * libm::sin(omega * t);
            let (a, b) =
                (o.update(&mut so, counts, volts).velocity - truth, f.update(&mut sf, counts) - truth);
            if k > 2000 {
                by_observer += a * a;
                by_difference += b * b;
            }
        }
        ((by_observer / 2e5).sqrt().to_degrees(), (by_difference / 2e5).sqrt().to_degrees())
    }

    #[test]
    fn the_modules_table_of_velocity_errors_is_what_comes_out() {
        for (rate, ripple, hz, expected) in [
            (2.0, 0.0, 1.0, [0.42, 0.92, 1.97, 1.11]),
            (20.0, 0.0, 1.0, [0.43, 0.93, 1.88, 1.12]),
            (20.0, 10.0, 10.0, [1.60, 1.00, 1.34, 2.22]),
            (20.0, 10.0, 20.0, [6.19, 2.80, 1.79, 3.66]),
        ] {
            let (slow, _) = rms(0.03, rate, ripple, hz);
            let (default, difference) = rms(0.1, rate, ripple, hz);
            let (fast, _) = rms(0.3, rate, ripple, hz);
            for (got, expected) in [slow, default, fast, difference].into_iter().zip(expected) {
                assert!((got - expected).abs() < 0.01, "{rate} ± {ripple} °/s: {got}, not {expected}");
            }
        }
    }

    #[test]
    fn the_gains_solve_the_algebraic_riccati_equation() {
        // By scipy 1.17.1: Φ and Q from expm of Van Loan's 6×6 matrix, P from
        // solve_discrete_are in the units count, count/T, count J/T², K = P Cᵀ/(P11 + 1/12).
        let paper = (0.0017, 0.001, 20_000, 1000);
        for ((inertia, viscous_damping, counts, us), walk, expected) in [
            (paper, 0.003, [0.155934253056767, 13.2094317706172, 0.961059206274094]),
            (paper, 0.1, [0.421248763448458, 114.472316133913, 26.5269131989085]),
            (paper, 1.0, [0.69238330810237, 396.602464409928, 193.395203656786]),
            ((0.0017, 0.0, 20_000, 1000), 0.1, [0.421588861524535, 114.68711771362, 26.5191178998653]),
            ((0.02, 0.5, 4096, 4000), 0.7, [0.536705367055029, 50.9143680893019, 68.0498814379923]),
        ] {
            let plant =
                Plant::new(&PlantParams { inertia, viscous_damping, ..PlantParams::<f64>::default() })
                    .unwrap();
            let p = ObserverParams { disturbance_walk: walk };
            let o = Observer::new(&p, &plant, Encoder::new::<f64>(counts).unwrap(), Micros(us)).unwrap();
            let gains = [o.gains().position, o.gains().velocity, o.gains().disturbance];
            for (got, expected) in gains.into_iter().zip(expected) {
                // Three points for Q leave 2e-9 where the damping is as heavy as in the last case.
                assert!((got / expected - 1.0).abs() < 5e-9, "{walk}: {got}, not {expected}");
            }
        }
    }

    #[test]
    fn a_constant_velocity_is_found_from_a_start_at_rest() {
        let o = observer::<f64>();
        for degrees in [2.0_f64, 20.0, 100.0, -20.0] {
            let rate = degrees.to_radians();
            // Backwards, the brake would add to the weight: nothing but a hand at the pulley
            // keeps that rate, and the observer has to find its torque.
            let volts = balance(rate);
            let mut state = o.start(FixedCounts(0), 0.0);
            let (mut velocity, mut torque) = (0.0, 0.0);
            for k in 1..=2000 {
                let e = o.update(&mut state, read(rate * f64::from(k) * 1e-3), volts);
                if k > 1000 {
                    velocity += e.velocity / 1000.0;
                    torque += e.disturbance_torque / 1000.0;
                }
            }
            assert!((velocity - rate).abs() < 2e-4, "{degrees} °/s: {} °/s", velocity.to_degrees());
            let p = *plant::<f64>().params();
            let needed = p.viscous_damping * rate + plant::<f64>().friction_torque(rate, volts);
            assert!((torque - needed).abs() < 2e-4, "{degrees} °/s: {torque} N m, not {needed}");
        }
    }

    #[test]
    fn the_torque_of_a_free_fall_is_found() {
        // J ω̇ = d − C ω from rest: ω = d/C (1 − e^(−Ct/J)), exact. The weight is 30 % heavier
        // than the model's.
        let (o, p) = (observer::<f64>(), *plant::<f64>().params());
        let (d, c, decay) = (1.3 * p.drive_torque, p.viscous_damping, p.viscous_damping / p.inertia);
        let mut state = o.start(FixedCounts(0), 0.0);
        let mut mean = 0.0;
        for k in 1..=1000 {
            let t = f64::from(k) * 1e-3;
            let rise = -libm::expm1(-decay * t);
            let estimate = o.update(&mut state, read(d / c * (t - rise / decay)), 0.0);
            assert!(k < 200 || (estimate.velocity - d / c * rise).abs() < 0.08, "tick {k}");
            assert!(k < 200 || (estimate.disturbance_torque / d - 1.0).abs() < 0.3, "tick {k}");
            mean += if k > 500 { estimate.disturbance_torque / 500.0 } else { 0.0 };
        }
        assert!((mean / d - 1.0).abs() < 1e-3, "{mean} N m, not {d}");
    }

    #[test]
    fn the_model_of_a_stuck_shaft_rests() {
        let o = observer::<f64>();
        let volts = 1.2 * plant::<f64>().holding_voltage_sliding();
        let mut state = o.start(FixedCounts(0), 0.5);
        for k in 0..400 {
            let e = o.update(&mut state, FixedCounts(0), volts);
            assert!(k < 200 || (e.velocity.abs() < 1e-9 && e.position_offset > 0.0), "tick {k}: {e:?}");
        }
    }

    #[test]
    fn f32_agrees_with_f64_after_a_million_turns() {
        let (single, double) = (observer::<f32>(), observer::<f64>());
        let far = FixedCounts::from_counts(20_000_000_000);
        let volts = balance(0.35);
        let mut s32 = single.start(far, 0.0);
        let mut s64 = double.start(far, 0.0);
        for k in 0..5000 {
            let counts = read(0.35 * f64::from(k) * 1e-3 + 0.01 * libm::sin(f64::from(k) * 0.03)).plus(far);
            let a = single.update(&mut s32, counts, volts as f32);
            let b = double.update(&mut s64, counts, volts);
            assert!((f64::from(a.velocity) - b.velocity).abs() < 2e-5, "tick {k}: {a:?} {b:?}");
            assert!((f64::from(a.disturbance_torque) - b.disturbance_torque).abs() < 2e-6, "tick {k}");
            assert!((f64::from(a.position_offset) - b.position_offset).abs() < 2e-8, "tick {k}");
        }
    }

    fn recovers<T: Real>() {
        let o = observer::<T>();
        let rate = 0.35;
        let volts = T::from_f64(balance(rate));
        let mut state = o.start(FixedCounts(0), T::from_f64(rate));
        for k in 1..2000 {
            let mut counts = read(rate * f64::from(k) * 1e-3);
            if k == 500 {
                counts = FixedCounts(i64::MAX); // for one sample
            }
            if k > 1000 {
                counts = counts.plus(FixedCounts::from_counts(-(1 << 31))); // for good
            }
            let error = o.update(&mut state, counts, volts).velocity.to_f64() - rate;
            let settled = (800..1000).contains(&k) || k > 1300;
            assert!(!settled || error.abs() < 0.06, "tick {k}: off by {error} rad/s");
        }
    }

    #[test]
    fn a_wild_jump_in_the_counts_is_forgotten_in_300_ticks() {
        recovers::<f32>();
        recovers::<f64>();
    }

    #[test]
    fn an_estimate_that_overflows_starts_anew_at_rest() {
        let extreme = PlantParams {
            inertia: 1e-20_f32,
            drive_torque: 1e30,
            viscous_damping: 0.0,
            ..PlantParams::default()
        };
        let p = ObserverParams::default();
        let o = Observer::new(&p, &Plant::new(&extreme).unwrap(), Encoder::PAPER, MS).unwrap();
        let mut state = o.start(FixedCounts(0), 1.0);
        for k in 0..3 {
            // 1e30 N m on 1e-20 kg m² for 1 ms is beyond f32.
            let e = o.update(&mut state, FixedCounts::from_counts(k), 0.0);
            assert_eq!((e.velocity, e.disturbance_torque), (0.0, 1e30));
        }
    }

    #[test]
    fn a_voltage_that_presses_no_pad_brakes_nothing() {
        let o = observer::<f64>();
        let fall = |volts: f64| {
            let mut state = o.start(FixedCounts(0), 0.5);
            (1..50).map(|k| o.update(&mut state, FixedCounts::from_counts(k), volts)).last().unwrap()
        };
        assert_eq!(fall(-3.0), fall(0.0));
        assert_eq!(fall(f64::NAN), fall(0.0));
        assert_ne!(fall(3.0), fall(0.0));
    }

    #[test]
    fn each_bad_parameter_is_named() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-160] {
            let p = ObserverParams { disturbance_walk: bad };
            let e = Observer::new(&p, &plant(), Encoder::PAPER, MS).unwrap_err();
            assert_eq!(e.field(), "disturbance_walk");
        }
        let p = ObserverParams::default();
        assert_eq!(
            Observer::new(&p, &plant::<f64>(), Encoder::PAPER, Micros(0)).unwrap_err().field(),
            "period"
        );
        let good = *observer::<f64>().gains();
        let with = |g| Observer::with_gains(&g, &plant(), Encoder::PAPER, MS);
        assert_eq!(with(good), Ok(observer()));
        for (bad, field) in [
            (ObserverGains { position: f64::NAN, ..good }, "position"),
            (ObserverGains { velocity: -1.0, ..good }, "velocity"),
            (ObserverGains { disturbance: 0.0, ..good }, "disturbance"),
            (ObserverGains { disturbance: 100.0 * good.disturbance, ..good }, "disturbance"),
            (ObserverGains { position: 2.1, ..good }, "disturbance"),
        ] {
            assert_eq!(with(bad).unwrap_err().field(), field);
        }
    }

    /// True if the error grows over 2⁴⁰ periods, by squaring the matrix that carries it.
    fn grows(k: &ObserverGains<f64>, m: &Model<f64>) -> bool {
        let phi = Matrix3::new(1.0, m.phi12, m.phi13, 0.0, 1.0 - m.loss, m.phi23, 0.0, 0.0, 1.0);
        let k = Vector3::new(k.position, k.velocity, k.disturbance);
        let mut a = phi - k * phi.row(0);
        for _ in 0..40 {
            a = a * a;
            if a.amax() > 1e100 || a.amax() < 1e-100 {
                break;
            }
        }
        a.amax() > 1.0
    }

    proptest! {
        #[test]
        fn gains_are_taken_exactly_when_the_error_dies_away(
            position in 0.0_f64..2.5, velocity in 0.0_f64..4.0, disturbance in 0.0_f64..8.0, damping in 0.0_f64..5.0
        ) {
            let plant = Plant::new(&PlantParams { viscous_damping: damping, ..PlantParams::default() }).unwrap();
            let gains = ObserverGains { position, velocity: velocity * 1e3, disturbance: disturbance * 1.7e3 };
            let model = Model::new(0.0017, damping, 1e-3);
            let taken = Observer::with_gains(&gains, &plant, Encoder::PAPER, MS).is_ok();
            prop_assert_eq!(taken, position > 0.0 && velocity > 0.0 && disturbance > 0.0 && !grows(&gains, &model));
        }

        #[test]
        fn gains_come_out_over_sixteen_decades_of_the_walk(exponent in -8.0_f64..8.0, us in 50_u32..100_000) {
            let p = ObserverParams { disturbance_walk: libm::pow(10.0, exponent) };
            prop_assert!(Observer::new(&p, &plant::<f64>(), Encoder::PAPER, Micros(us)).is_ok());
            let p = ObserverParams { disturbance_walk: p.disturbance_walk as f32 };
            prop_assert!(Observer::new(&p, &plant::<f32>(), Encoder::PAPER, Micros(us)).is_ok());
        }

        #[test]
        fn any_parameters_give_an_observer_or_an_error(walk in any::<u64>(), j in any::<u64>(), c in any::<u64>()) {
            let p = PlantParams {
                inertia: f64::from_bits(j), viscous_damping: f64::from_bits(c), ..PlantParams::default()
            };
            let walk = ObserverParams { disturbance_walk: f64::from_bits(walk) };
            if let Ok(o) = Plant::new(&p).and_then(|p| Observer::new(&walk, &p, Encoder::PAPER, MS)) {
                let mut state = o.start(FixedCounts(0), 0.0);
                for k in 0..20 {
                    prop_assert!(!o.update(&mut state, FixedCounts::from_counts(k), 1.0).velocity.is_nan());
                }
            }
        }

        #[test]
        fn no_counts_and_no_volts_make_the_estimate_nan(
            samples in proptest::collection::vec((any::<i64>(), any::<u64>()), 1..60)
        ) {
            let (single, double) = (observer::<f32>(), observer::<f64>());
            let mut s32 = single.start(FixedCounts(0), f32::NAN);
            let mut s64 = double.start(FixedCounts(0), f64::INFINITY);
            let numbers = |e: Estimate<f64>| {
                Vec::from([e.position_offset, e.velocity, e.disturbance_torque]).iter().all(|x| x.is_finite())
            };
            for (counts, volts) in samples {
                let volts = f64::from_bits(volts);
                let a = single.update(&mut s32, FixedCounts(counts), volts as f32);
                prop_assert!(a.position_offset.is_finite() && a.velocity.is_finite());
                prop_assert!(a.disturbance_torque.is_finite());
                prop_assert!(numbers(double.update(&mut s64, FixedCounts(counts), volts)));
            }
        }
    }
}
