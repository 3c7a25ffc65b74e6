//! Position, velocity, friction and its ripple along the way, from edges and volts: a Kalman filter, and its smoother.
//!
//! In counts and periods, with `G` = T/J, friction `h + r` in 1/V as a share of the drive's torque per volt:
//!
//! ```text
//! a = G [1 − (h + r) u] − c ω,    ω' = ω + a Δt,    Δ = ω Δt + a Δt²/2
//! s' = s − Δ (k² r + 2 ζ k s),    r' = r + Δ s'             ripple: a damped wave along the way
//! ```

use nalgebra::{SMatrix, SVector};

/// Position, velocity, mean friction, ripple, its slope.
pub type FilterState = SVector<f64, 5>;
/// Their covariance.
pub type Spread = SMatrix<f64, 5, 5>;

/// Numbers that stay.
#[derive(Clone, Copy, Debug)]
pub struct Shaft {
    /// `G`, counts per period²; of a motor `K/J`, counts per period² and volt.
    pub pull: f64,
    /// `true` if a voltage drives, and friction is in volts: `a = G [u − (h + r)] − c ω`.
    pub motor: bool,
    /// `c`, per period.
    pub damping: f64,
    /// `k`, rad per count.
    pub wave: f64,
    /// `ζ`.
    pub wave_damping: f64,
    /// Root mean square of the ripple, 1/V.
    pub ripple: f64,
    /// Variance that the velocity gains in a period, (counts per period)².
    pub walk: f64,
}

/// Standard deviations beyond which a measurement is far from what is believed.
const FAR: f64 = 5.0;

/// The belief at a time.
#[derive(Clone, Copy, Debug)]
pub struct Belief {
    /// Means.
    pub mean: FilterState,
    /// Covariance.
    pub spread: Spread,
}

/// A measured edge.
#[derive(Clone, Copy, Debug)]
pub struct Surprise {
    /// Innovation², over its variance.
    pub square: f64,
    /// Logarithm of its density.
    pub density: f64,
}

impl Belief {
    /// A shaft at a position with a velocity, where the ripple may be anything.
    #[must_use]
    pub fn new(shaft: &Shaft, position: f64, velocity: (f64, f64), friction: (f64, f64)) -> Belief {
        let mean = FilterState::new(position, velocity.0, friction.0, 0.0, 0.0);
        let slope = shaft.wave * shaft.ripple;
        let deviations = FilterState::new(0.3, velocity.1, friction.1, shaft.ripple, slope);
        Belief { mean, spread: Spread::from_diagonal(&deviations.component_mul(&deviations)) }
    }

    /// A time `dt` (in periods) under a voltage; the matrix of small departures.
    pub fn advance(&mut self, shaft: &Shaft, volts: f64, dt: f64) -> Spread {
        let [position, velocity, mean, ripple, slope] = self.mean.into();
        let (drive, load) =
            if shaft.motor { (shaft.pull * volts, shaft.pull) } else { (shaft.pull, shaft.pull * volts) };
        let a = drive - load * (mean + ripple) - shaft.damping * velocity;
        let way = velocity * dt + 0.5 * a * dt * dt;
        let (k2, decay) = (shaft.wave * shaft.wave, 2.0 * shaft.wave_damping * shaft.wave);
        // The wave turns by the way that is believed, of which no covariance is kept: through slopes that are believed with the
        // way it would be taken for a measurement of them. A ride goes one way.
        let turned = way.max(0.0);
        let next = slope - turned * (k2 * ripple + decay * slope);
        self.mean = FilterState::new(position + way, velocity + a * dt, mean, ripple + turned * next, next);
        let by_friction = -0.5 * load * dt * dt;
        let mut f = Spread::identity();
        f[(0, 1)] = dt - 0.5 * shaft.damping * dt * dt;
        f[(0, 2)] = by_friction;
        f[(0, 3)] = by_friction;
        f[(1, 1)] = 1.0 - shaft.damping * dt;
        f[(1, 2)] = -load * dt;
        f[(1, 3)] = -load * dt;
        f[(4, 3)] = -turned * k2;
        f[(4, 4)] = 1.0 - turned * decay;
        f[(3, 3)] = 1.0 + turned * f[(4, 3)];
        f[(3, 4)] = turned * f[(4, 4)];
        self.spread = carried(&f, &self.spread);
        self.spread[(1, 1)] += shaft.walk * dt;
        // With it the wave's variance stays what it is.
        self.spread[(4, 4)] += 2.0 * decay * k2 * shaft.ripple * shaft.ripple * turned;
        f
    }

    /// The shaft is at a position, with a variance. One far from what is believed widens the belief first, so that it is
    /// found again.
    pub fn correct(&mut self, position: f64, variance: f64) -> Surprise {
        let y = position - self.mean[0];
        let square = y * y / (self.spread[(0, 0)] + variance);
        if square > FAR * FAR {
            self.spread[(0, 0)] += y * y;
            self.spread[(1, 1)] += 0.25 * y * y;
        }
        let s = self.spread[(0, 0)] + variance;
        let gain = self.spread.column(0) / s;
        self.mean += gain * y;
        self.spread -= gain * gain.transpose() * s;
        Surprise { square, density: -0.5 * (y * y / s + libm::log(core::f64::consts::TAU * s)) }
    }

    /// An edge was crossed in the last period: it lies at most the period's way back. `least`: the way that a shaft makes at
    /// least, counts.
    pub fn cross(&mut self, counts: f64, least: f64) -> Surprise {
        let span = self.mean[1].max(least).clamp(0.02, 1.0);
        self.correct(counts + 0.5 * span, span * span / 12.0)
    }
}

/// `f P fᵀ` of the `f` that [`Belief::advance`] gives, without its zeros: in the order of the whole product, whose figures it
/// has. A likelihood is millions of these.
fn carried(f: &Spread, spread: &Spread) -> Spread {
    /// `f x`, of a column `x`.
    fn times(f: &Spread, x: [f64; 5]) -> [f64; 5] {
        [
            x[0] + f[(0, 1)] * x[1] + f[(0, 2)] * x[2] + f[(0, 3)] * x[3],
            f[(1, 1)] * x[1] + f[(1, 2)] * x[2] + f[(1, 3)] * x[3],
            x[2],
            f[(3, 3)] * x[3] + f[(3, 4)] * x[4],
            f[(4, 3)] * x[3] + f[(4, 4)] * x[4],
        ]
    }
    let columns: [[f64; 5]; 5] = spread.data.0.map(|column| times(f, column));
    // Rows of f P: each times fᵀ is f times it.
    let mut out = Spread::zeros();
    for i in 0..5 {
        let row = times(f, columns.map(|column| column[i]));
        (0..5).for_each(|j| out[(i, j)] = row[j]);
    }
    out
}

/// A period: the belief at its end from the samples up to that, the one that was predicted, and the matrix of small
/// departures over the period.
pub type Passed = (Belief, Belief, Spread);

/// The beliefs at all samples, each from the samples before and behind it (Rauch, Tung and Striebel 1965).
#[must_use]
pub fn smooth(passed: &[Passed]) -> Vec<Belief> {
    let mut out: Vec<Belief> = passed.iter().map(|(belief, _, _)| *belief).collect();
    for i in (0..out.len().saturating_sub(1)).rev() {
        let (_, predicted, f) = &passed[i + 1];
        let Some(cholesky) = predicted.spread.cholesky() else { continue };
        // P F' P₋⁻¹, from the solution of P₋ X = F P.
        let gain = cholesky.solve(&(f * out[i].spread)).transpose();
        let (later, now) = (out[i + 1], out[i]);
        out[i].mean = now.mean + gain * (later.mean - predicted.mean);
        out[i].spread = now.spread + gain * (later.spread - predicted.spread) * gain.transpose();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covariance_is_carried_as_by_the_whole_product() {
        for motor in [false, true] {
            let shaft = Shaft {
                pull: 0.03,
                motor,
                damping: 1e-3,
                wave: 0.02,
                wave_damping: 0.1,
                ripple: 0.05,
                walk: 1e-6,
            };
            let mut belief = Belief::new(&shaft, 0.0, (0.1, 0.02), (0.4, 0.1));
            for k in 0..500 {
                let before = belief.spread;
                let volts = 1.5 + libm::sin(0.1 * f64::from(k));
                let f = belief.advance(&shaft, volts, 1.0);
                assert_eq!(carried(&f, &before), f * before * f.transpose(), "period {k}");
                if k % 7 == 0 {
                    belief.cross(0.1 * f64::from(k), 0.02);
                }
            }
        }
    }
}
