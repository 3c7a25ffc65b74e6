//! Sine and chirp on a ramp. The phase is an integer in 2⁻⁶⁴ turns, so it never drifts.

use super::{Scale, Target, advance, representable_rate};
use crate::error::{cast, require};
use crate::{ParamError, Real, sin_cos_turns};

/// `rate · t + amplitude · [sin(2π f t + phase) − sin(phase)]`.
///
/// A brake follows it only while the velocity keeps its sign: `2π f · amplitude ≤ rate`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Sine<T = f64> {
    /// Rate of the ramp below, rad/s.
    pub rate: T,
    /// Amplitude, rad.
    pub amplitude: T,
    /// Frequency `f`, Hz; below half the sampling rate.
    pub frequency: T,
    /// Phase at the start, in turns; −0.25 starts at the rate of the ramp.
    pub phase: T,
}

cast!(Sine { rate, amplitude, frequency, phase });

/// A [`Sine`] whose frequency goes linearly from one value to another and stays there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Chirp<T = f64> {
    /// Rate of the ramp below, rad/s.
    pub rate: T,
    /// Amplitude, rad.
    pub amplitude: T,
    /// Frequency at the start, Hz; below half the sampling rate.
    pub from: T,
    /// Frequency at the end, Hz; below half the sampling rate.
    pub to: T,
    /// Time from one to the other, s.
    pub duration: T,
    /// Phase at the start, in turns; −0.25 starts at the rate of the ramp.
    pub phase: T,
}

cast!(Chirp { rate, amplitude, from, to, duration, phase });

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wave<T> {
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

impl<T: Real> Wave<T> {
    pub(super) fn sine(p: &Sine<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        let f = require_frequency("frequency", p.frequency, scale)?;
        Wave::new(p.rate, p.amplitude, p.phase, f, T::ZERO, 0, scale)
    }

    pub(super) fn chirp(p: &Chirp<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        let from = require_frequency("from", p.from, scale)?;
        let to = require_frequency("to", p.to, scale)?;
        // The nearest: 0.3 s are 300 ms, though 0.3/0.001 is a hair less.
        let ticks = (p.duration / scale.period + T::from_f64(0.5)).floor();
        require(
            "duration",
            p.duration,
            ticks >= T::ONE && ticks < T::from_f64(4e9),
            "a time of at least one period and at most 4e9 periods, s",
        )?;
        Wave::new(p.rate, p.amplitude, p.phase, from, (to - from) / ticks, ticks.to_i64() as u64, scale)
    }

    fn new(
        rate: T,
        amplitude: T,
        phase: T,
        from: T,
        rise: T,
        last_tick: u64,
        scale: Scale<T>,
    ) -> Result<Self, ParamError<T>> {
        representable_rate("rate", rate, scale)?;
        let counts = (amplitude * scale.counts_per_radian).abs();
        require(
            "amplitude",
            amplitude,
            counts < T::from_f64(1e12),
            "a finite amplitude below 1e12 counts, rad",
        )?;
        require("phase", phase, phase.abs() <= T::ONE, "−1 to 1 turns")?;
        // 2⁶⁴ as a product of what both scalars hold exactly.
        let turn = T::from_i64(1 << 32) * T::from_i64(1 << 32);
        let start_phase = ((phase - phase.floor()) * T::from_i64(1 << 62)).to_i64().wrapping_shl(2) as u64;
        Ok(Wave {
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
        })
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

fn require_frequency<T: Real>(field: &'static str, f: T, scale: Scale<T>) -> Result<T, ParamError<T>> {
    let below_nyquist = f * scale.period < T::from_f64(0.5);
    require(field, f, f >= T::ZERO && below_nyquist, "at least 0 and below half the sampling rate, Hz")
}
