//! Sine and chirp on a ramp. The phase is an integer in 2⁻⁶⁴ turns, so it never drifts.

use super::scale::{Scale, advance};
use super::target::Target;
use crate::params::{Range, Table};
use crate::{ParamError, Planned, Real, sin_cos_turns};

crate::params! {
    /// A sine on a ramp: `rate · t + amplitude · [sin(2π f t + phase) − sin(phase)]`.
    ///
    /// A brake follows it only while the velocity keeps its sign: `2π f · amplitude ≤ rate`.
    pub struct Sine<T> {
        /// Rate of the ramp below the sine.
        rate: T, "rate_deg_s" "" DEG_S, Range::ANY;
        /// Amplitude of the sine.
        amplitude: T, "amplitude_deg" "" DEG, Range::ANY;
        /// Frequency.
        frequency: T, "frequency_hz" "f" HZ, Range::at_least(0.0);
        /// Phase at the start; −0.25 starts at the rate of the ramp.
        phase: T = -0.25, "phase_turns" "" TURNS, Range::within(-1.0, 1.0);
    }
    relations(p) {
        /// Counts hold the rate.
        RATE: rate, "a finite rate below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s";
        /// Counts hold the amplitude.
        AMPLITUDE: amplitude, "a finite amplitude below 1e12 counts of rig.encoder.counts_per_rev, °";
        /// Samples see the frequency.
        NYQUIST: frequency, "a frequency below half the sampling rate, which sampling.period_us gives, Hz";
    }
}

crate::params! {
    /// A sine on a ramp, whose frequency goes linearly from one value to another and stays there.
    ///
    /// A brake follows it only while the velocity keeps its sign: `2π f · amplitude ≤ rate` for either frequency `f`.
    pub struct Chirp<T> {
        /// Rate of the ramp below the sine.
        rate: T, "rate_deg_s" "" DEG_S, Range::ANY;
        /// Amplitude of the sine.
        amplitude: T, "amplitude_deg" "" DEG, Range::ANY;
        /// Frequency at the start.
        from: T, "from_hz" "" HZ, Range::at_least(0.0);
        /// Frequency at the end.
        to: T, "to_hz" "" HZ, Range::at_least(0.0);
        /// Time from one to the other.
        duration: T, "duration_s" "" S, Range::above(0.0);
        /// Phase at the start; −0.25 starts at the rate of the ramp.
        phase: T = -0.25, "phase_turns" "" TURNS, Range::within(-1.0, 1.0);
    }
    relations(p) {
        /// Counts hold the rate.
        RATE: rate, "a finite rate below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s";
        /// Counts hold the amplitude.
        AMPLITUDE: amplitude, "a finite amplitude below 1e12 counts of rig.encoder.counts_per_rev, °";
        /// Samples see the first frequency.
        FROM_NYQUIST: from, "a frequency below half the sampling rate, which sampling.period_us gives, Hz";
        /// Samples see the last frequency.
        TO_NYQUIST: to, "a frequency below half the sampling rate, which sampling.period_us gives, Hz";
        /// Ticks count the time.
        COUNTED: duration, "a time of 1 to 4e9 times sampling.period_us";
    }
}

/// A checked path of a sine on a ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave<T> {
    rate: i64,
    velocity: T,
    amplitude: T,
    start_phase: u64,
    start_sine: T,
    /// Turns per tick at the start, 2⁻⁶⁴.
    step: u64,
    /// Half the rise of `step` per tick, 2⁻⁶⁴ turns.
    half_rise: i64,
    /// Tick from which the frequency stays.
    last_tick: u64,
    /// Hz at the start, and its rise in Hz per tick.
    from: T,
    rise: T,
    scale: Scale<T>,
}

impl<T: Real> Planned<T> for Wave<T> {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        self.at(tick)
    }
}

impl<T: Real> Wave<T> {
    pub(super) fn sine(p: &Sine<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        Sine::NYQUIST.require(p.frequency, scale.samples(p.frequency))?;
        Sine::RATE.require(p.rate, scale.holds_rate(p.rate))?;
        Sine::AMPLITUDE.require(p.amplitude, scale.holds_distance(p.amplitude))?;
        Ok(Wave::new(p.rate, p.amplitude, p.phase, p.frequency, T::ZERO, 0, scale))
    }

    pub(super) fn chirp(p: &Chirp<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let from = Chirp::FROM_NYQUIST.require(p.from, scale.samples(p.from))?;
        let to = Chirp::TO_NYQUIST.require(p.to, scale.samples(p.to))?;
        Chirp::RATE.require(p.rate, scale.holds_rate(p.rate))?;
        Chirp::AMPLITUDE.require(p.amplitude, scale.holds_distance(p.amplitude))?;
        // The nearest: 0.3 s are 300 ms, though 0.3/0.001 is a hair less.
        let ticks = (p.duration / scale.period + T::from_f64(0.5)).floor();
        Chirp::COUNTED.require(p.duration, ticks >= T::ONE && ticks < T::from_f64(4e9))?;
        let rise = (to - from) / ticks;
        Ok(Wave::new(p.rate, p.amplitude, p.phase, from, rise, ticks.to_i64() as u64, scale))
    }

    fn new(rate: T, amplitude: T, phase: T, from: T, rise: T, last_tick: u64, scale: Scale<T>) -> Self {
        // 2⁶⁴ as a product of what both scalars hold exactly.
        let turn = T::from_i64(1 << 32) * T::from_i64(1 << 32);
        let start_phase = ((phase - phase.floor()) * T::from_i64(1 << 62)).to_i64().wrapping_shl(2) as u64;
        Wave {
            rate: scale.rate(rate),
            velocity: rate,
            amplitude,
            start_phase,
            start_sine: sin_cos_turns::<T>(start_phase).0,
            step: (from * scale.period * turn).to_i64() as u64,
            half_rise: (rise * scale.period * turn / T::from_i32(2)).to_i64(),
            last_tick,
            from,
            rise,
            scale,
        }
    }

    pub(super) fn at(&self, tick: u64) -> Target<T> {
        let rising = tick.min(self.last_tick);
        let steady = tick - rising;
        // ∫ (step + 2 half_rise k) dk, then the constant frequency reached at the end.
        let reached = self.step.wrapping_add((self.half_rise as u64).wrapping_mul(2).wrapping_mul(rising));
        let phase = self
            .start_phase
            .wrapping_add(self.step.wrapping_mul(rising))
            .wrapping_add((self.half_rise as u64).wrapping_mul(rising).wrapping_mul(rising))
            .wrapping_add(reached.wrapping_mul(steady));
        let (sin, cos) = sin_cos_turns::<T>(phase);
        let two_pi = T::PI + T::PI;
        let omega = two_pi * (self.from + self.rise * T::from_u64(rising));
        let omega_rise = if tick < self.last_tick { two_pi * self.rise / self.scale.period } else { T::ZERO };
        Target {
            position: advance(self.rate, tick)
                .plus(self.scale.distance(self.amplitude * (sin - self.start_sine))),
            velocity: self.velocity + self.amplitude * omega * cos,
            acceleration: self.amplitude * (omega_rise * cos - omega * omega * sin),
        }
    }
}
