//! Whether a path is one that a brake can follow.
//!
//! A brake only takes torque away. With the bounds of [`Bounds`] and a voltage between
//! `u_min` and `u_max`, a shaft that is driven forwards follows `θ_d` only while
//!
//! ```text
//! θ̇_d ≥ 0                                                       it cannot drive back
//! θ̈_d ≤ [T_min − C_max θ̇_d − (μK)_max u_min] / J_max             the drive must suffice
//! [T_max − C_min θ̇_d − J θ̈_d] / (μK)_min ≤ u_max                 the brake must suffice
//! ```
//!
//! each at its worst corner. A jump of the velocity is followed late, never at once; it is
//! reported and not refused, since the paper's own path begins with one.

use crate::bounds::Bounds;
use crate::law::Output;
use crate::reference::Reference;
use crate::{Micros, Real};
use core::fmt;

/// Velocity below which a path counts as standing still: rounding of the path, rad/s.
const STANDSTILL: f64 = 1e-6;

/// What a path asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Envelope<T> {
    /// Highest velocity, rad/s: `v_d` of (23g).
    pub velocity: T,
    /// Highest acceleration, rad/s².
    pub acceleration: T,
    /// Highest deceleration, rad/s².
    pub deceleration: T,
    /// Highest acceleration that the drive grants at that moment, rad/s².
    pub available_acceleration: T,
    /// Highest voltage that the path needs at the worst corner, V.
    pub highest_voltage: T,
    /// Lowest voltage that holds the resting shaft at the worst corner, V.
    pub holding_voltage: T,
    /// Largest jump of the velocity from tick to tick beyond what the drive can follow, rad/s.
    pub velocity_jump: T,
}

impl<T: Real> Envelope<T> {
    /// Largest `|θ̈_d|`, rad/s²: `a_d` of (23g).
    #[must_use]
    pub fn largest_acceleration(&self) -> T {
        self.acceleration.max(self.deceleration)
    }
}

/// Why a brake cannot follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// The path runs backwards: velocity, rad/s.
    Reverse,
    /// The drive does not suffice: acceleration, rad/s².
    Acceleration,
    /// The brake does not suffice: voltage, V.
    Voltage,
    /// The path is not a number: its value.
    NotFinite,
}

/// Where and why a brake cannot follow a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Infeasible<T> {
    /// The first tick at which it cannot.
    pub tick: u64,
    /// Its time, s.
    pub time: T,
    /// What is in the way.
    pub obstacle: Obstacle,
    /// What the path asks for, in the unit of the obstacle.
    pub asked: T,
    /// What can be had.
    pub available: T,
}

impl<T: Real> fmt::Display for Infeasible<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Infeasible { tick, time, asked, available, .. } = self;
        write!(f, "a brake cannot follow the path from t = {time} s (tick {tick}) on: ")?;
        match self.obstacle {
            Obstacle::Reverse => {
                write!(f, "it runs backwards at {asked} rad/s, and a brake drives nothing")
            }
            Obstacle::Acceleration => {
                write!(f, "it accelerates at {asked} rad/s², and the drive grants {available} rad/s²")
            }
            Obstacle::Voltage => {
                write!(f, "it needs {asked} V of braking, and the output ends at {available} V")
            }
            Obstacle::NotFinite => write!(f, "its velocity or acceleration is not a number there"),
        }
    }
}

impl<T: Real> core::error::Error for Infeasible<T> {}

/// Follows a path for `ticks` ticks and says what it asks of drive and brake.
///
/// `start_velocity` is the shaft's at tick 0, rad/s.
///
/// # Errors
/// Where and why a brake cannot follow it.
pub fn check_path<T: Real>(
    path: &Reference<'_, T>,
    ticks: u64,
    period: Micros,
    start_velocity: T,
    bounds: &Bounds<T>,
    output: &Output<T>,
) -> Result<Envelope<T>, Infeasible<T>> {
    let period: T = period.seconds();
    let still = T::from_f64(STANDSTILL);
    let weakest = bounds.weakest_brake();
    let residual = bounds.strongest_brake() * output.lowest();
    let mut envelope = Envelope {
        holding_voltage: bounds.drive_torque.high / (bounds.mu_static.low * bounds.brake_gain.low),
        ..Envelope::default()
    };
    let (mut last_velocity, mut last_acceleration) = (start_velocity, T::ZERO);
    for tick in 0..ticks {
        let target = path.at(tick);
        let (v, a) = (target.velocity, target.acceleration);
        let time = T::from_u64(tick) * period;
        let refuse = |obstacle, asked, available| Infeasible { tick, time, obstacle, asked, available };
        if !(v.is_finite() && a.is_finite()) {
            return Err(refuse(Obstacle::NotFinite, if v.is_finite() { a } else { v }, T::ZERO));
        }
        if v < -still {
            return Err(refuse(Obstacle::Reverse, v, T::ZERO));
        }
        let drive = bounds.drive_torque.low - bounds.viscous_damping.high * v - residual;
        let granted = drive / bounds.inertia.high;
        if a > granted {
            return Err(refuse(Obstacle::Acceleration, a, granted));
        }
        let inertia = if a < T::ZERO { bounds.inertia.high } else { bounds.inertia.low };
        let carried = bounds.drive_torque.high - bounds.viscous_damping.low * v - inertia * a;
        let resting = v <= still && a.abs() <= still;
        let volts = if resting { envelope.holding_voltage } else { carried / weakest };
        if volts > output.highest() {
            return Err(refuse(Obstacle::Voltage, volts, output.highest()));
        }
        if a >= envelope.acceleration {
            envelope.acceleration = a;
            envelope.available_acceleration = granted;
        }
        envelope.deceleration = envelope.deceleration.max(-a);
        envelope.velocity = envelope.velocity.max(v);
        envelope.highest_voltage = envelope.highest_voltage.max(volts);
        // What remains of the step in velocity after the fastest change that drive and brake
        // allow, or after the path's own acceleration if that is more.
        let step = (v - last_velocity).abs();
        let followed = granted.max(a.abs()).max(last_acceleration.abs()) * period;
        envelope.velocity_jump = envelope.velocity_jump.max(step - followed);
        (last_velocity, last_acceleration) = (v, a);
    }
    Ok(envelope)
}
