//! The motion of a system whose rows have bristles: smooth, stiff, without modes.
//!
//! ```text
//! q̇ = v,   M v̇ = Q(t, q, v) − Σ J_iᵀ μ(z_i, ż_i) N_i,   ż_i = ż(z_i, w_i)
//! ```

use super::System;
use super::state::{SystemError, SystemState};
use crate::engine::rosenbrock::{self, Linear};
use clutch_core::friction::{Bend, Bristles, FrictionModel};
use nalgebra::SVector;

/// Error allowed per step as a share of speed and deflection.
const RELATIVE: f64 = 1e-8;
/// Error allowed per step besides, as a share of the velocity and the deflection that belong to break-away.
const ABSOLUTE: f64 = 1e-9;
/// Steps of one stretch before it is given up.
const LIMIT: u32 = 50_000_000;

/// A system with bristles in motion; `D` is `2 N + B`.
#[derive(Clone, Debug)]
pub struct BristledMotion<'a, S, const N: usize, const B: usize, const D: usize> {
    system: &'a S,
    bristles: [Bristles<f64>; B],
    time: f64,
    /// Positions, velocities, deflections.
    state: [f64; D],
    /// Step that the last stretch ended with, s.
    step: f64,
}

impl<'a, S: System<N, B>, const N: usize, const B: usize, const D: usize> BristledMotion<'a, S, N, B, D>
where
    [f64; D]: Linear,
{
    /// A system at a state, its bristles not bent.
    ///
    /// # Errors
    /// A friction without bristles; an inertia that is none.
    pub fn new(system: &'a S, state: SystemState<N>) -> Result<Self, SystemError> {
        const { assert!(D == 2 * N + B, "D is 2 N + B") };
        let bristles: Vec<_> = (0..B).filter_map(|row| system.friction(row).bristles()).collect();
        let Ok(bristles) = <[Bristles<f64>; B]>::try_from(bristles) else {
            let without = (0..B).find(|row| system.friction(*row).bristles().is_none());
            return Err(SystemError::NoBristles(without.unwrap_or_default()));
        };
        if let Some(row) = bristles.iter().position(|b| b.count() > 1) {
            return Err(SystemError::Elements(row));
        }
        if system.inertia(&state.position).cholesky().is_none() {
            return Err(SystemError::Inertia(state.time));
        }
        let begin = core::array::from_fn(|i| {
            if i < N {
                state.position[i]
            } else if i < 2 * N {
                state.velocity[i - N]
            } else {
                0.0
            }
        });
        Ok(BristledMotion { system, bristles, time: state.time, state: begin, step: 1e-6 })
    }

    fn split(state: &[f64; D]) -> (SVector<f64, N>, SVector<f64, N>) {
        (SVector::from_fn(|i, _| state[i]), SVector::from_fn(|i, _| state[N + i]))
    }

    /// The state that it is in.
    #[must_use]
    pub fn state(&self) -> SystemState<N> {
        let (position, velocity) = Self::split(&self.state);
        SystemState { time: self.time, position, velocity }
    }

    /// Friction of the rows, N m.
    #[must_use]
    pub fn friction(&self) -> SVector<f64, B> {
        self.rows_at(self.time, &self.state).0
    }

    /// Friction of the rows, and the rates of their bristles.
    fn rows_at(&self, t: f64, state: &[f64; D]) -> (SVector<f64, B>, SVector<f64, B>) {
        let (q, v) = Self::split(state);
        let slip = self.system.rows(&q) * v - self.system.base(t);
        let normal = self.system.normal(t);
        let first = |x: f64| core::array::from_fn(|element| if element == 0 { x } else { 0.0 });
        let one = |i: usize| Bend { each: first(state[2 * N + i]), ..Bend::none() };
        let bends = SVector::from_fn(|i, _| self.bristles[i].rate(&one(i), slip[i])[0]);
        let rubs = SVector::from_fn(|i, _| {
            self.bristles[i].coefficient(&one(i), &first(bends[i])) * normal[i].max(0.0)
        });
        (rubs, bends)
    }

    fn rate(&self, t: f64, state: &[f64; D]) -> [f64; D] {
        let (q, v) = Self::split(state);
        let (rubs, bends) = self.rows_at(t, state);
        let torque = self.system.applied(t, &q, &v) - self.system.rows(&q).transpose() * rubs;
        let turns = self.system.inertia(&q).cholesky().map(|c| c.solve(&torque));
        let turns = turns.unwrap_or_else(|| SVector::repeat(f64::NAN));
        core::array::from_fn(|i| {
            if i < N {
                v[i]
            } else if i < 2 * N {
                turns[i - N]
            } else {
                bends[i - 2 * N]
            }
        })
    }

    /// Positions, velocities and deflections that belong to break-away; 1 for a joint on which nothing rubs.
    fn scale(&self) -> [f64; D] {
        let (q, _) = Self::split(&self.state);
        let (rows, inertia) = (self.system.rows(&q), self.system.inertia(&q));
        let normal = self.system.normal(self.time);
        let bent = |row: usize| self.bristles[row].deflection();
        let way = |joint: usize| {
            (0..B)
                .filter(|row| rows[(*row, joint)] != 0.0)
                .map(|row| bent(row) / rows[(row, joint)].abs())
                .fold(1.0, f64::min)
        };
        let speed = |joint: usize| {
            (0..B)
                .filter(|row| rows[(*row, joint)] != 0.0)
                .map(|row| {
                    let stiffness = self.bristles[row].stiffness() * normal[row].max(0.0);
                    bent(row) * libm::sqrt((stiffness / inertia[(joint, joint)]).max(1e-12))
                })
                .fold(1.0, f64::min)
        };
        core::array::from_fn(|i| {
            if i < N {
                way(i)
            } else if i < 2 * N {
                speed(i - N)
            } else {
                bent(i - 2 * N)
            }
        })
    }

    /// Follows the motion to a time, s.
    ///
    /// # Errors
    /// A motion that cannot be followed; the state is then where it was last sure.
    pub fn advance(&mut self, to: f64) -> Result<(), SystemError> {
        let scale = self.scale();
        for _ in 0..LIMIT {
            if self.time >= to {
                return Ok(());
            }
            let end = self.system.corner(self.time).filter(|corner| *corner < to).unwrap_or(to);
            let most = self.step.min(self.system.longest_step());
            let last = self.time + most >= end;
            let h = if last { end - self.time } else { most };
            if self.time + h == self.time {
                return Err(SystemError::TooManySteps(self.time));
            }
            let away = core::array::from_fn(|i| if (N..2 * N).contains(&i) { self.state[i] } else { 1.0 });
            let rate = |t: f64, state: &[f64; D]| self.rate(t, state);
            let tried = rosenbrock::step(&rate, (self.time, &self.state, h), &scale, &away);
            let error = tried.map_or(f64::NAN, |(reached, wrong)| {
                let allowed = |i: usize| {
                    let most = self.state[i].abs().max(reached[i].abs());
                    let speed =
                        |i: usize| ABSOLUTE * scale[i] + RELATIVE * self.state[i].abs().max(reached[i].abs());
                    if i < N {
                        h * speed(N + i) + ABSOLUTE * scale[i]
                    } else {
                        ABSOLUTE * scale[i] + RELATIVE * most
                    }
                };
                (0..D).fold(0.0, |worst: f64, i| {
                    let share = wrong[i].abs() / allowed(i);
                    // A number that is none is worse than all.
                    if share.is_finite() { worst.max(share) } else { f64::NAN }
                })
            });
            let (Some((reached, _)), true) = (tried, error.is_finite()) else {
                if h < 1e-15 {
                    return Err(SystemError::NotFinite(self.time));
                }
                self.step = 0.1 * h;
                continue;
            };
            let grown = h * (0.9 * libm::pow(error.max(1e-8), -0.25)).clamp(0.2, 4.0);
            if error > 1.0 {
                self.step = grown.min(0.9 * h);
                continue;
            }
            if !last || grown > self.step {
                self.step = grown;
            }
            self.time = if last { end } else { self.time + h };
            self.state = reached;
        }
        Err(SystemError::TooManySteps(self.time))
    }
}
