//! Linear stability of the sampled loop: a verdict of its own.
//!
//! While nothing saturates and nothing sticks, the loop is linear in the brake's gain: error, rate, filter and voltages on the way.
//! Its spectral radius says whether small deviations die out. A loop that is unstable may well have a bound, as a
//! saturated one, and a stable one may stick: neither follows from the other.

use crate::rows::back;
use crate::setup::{Setup, USUAL_END};
use crate::units::Units;

/// Spectral radius at one strength of the brake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stability {
    /// `μ_d K_COF/J`, of a motor `k_t/J`, rad/s² per volt.
    pub brake: f64,
    /// Spectral radius; below 1 small deviations die out.
    pub radius: f64,
}

/// More ticks of delay than any loop has.
const MOST_DELAY: u32 = 40;

/// Spectral radii with the weakest, a middle and the strongest brake of the box; none with more than 40 ticks of delay.
#[must_use]
pub fn stability(setup: &Setup) -> Option<[Stability; 3]> {
    if setup.delay_ticks > MOST_DELAY {
        return None;
    }
    let u = Units::new(setup, setup.sliding, USUAL_END, 0.0);
    // Ripple belongs to the box; Stribeck's excess does not, as nothing moves at those speeds for long.
    let [weak, strong] = match &setup.motor {
        Some(motor) => motor.gain,
        None => [
            setup.sliding[0] * (1.0 - setup.ripple) * setup.brake_gain[0],
            setup.sliding[1] * (1.0 + setup.ripple) * setup.brake_gain[1],
        ],
    };
    let (low, high) = (weak / setup.inertia[1], strong / setup.inertia[0]);
    let in_counts = setup.period_s * setup.period_s / u.count;
    let at = |brake| Stability { brake, radius: spectral_radius(&closed_loop(&u, brake * in_counts)) };
    Some([low, libm::sqrt(low * high), high].map(at))
}

/// The largest of them.
#[must_use]
pub fn largest(radii: &[Stability; 3]) -> f64 {
    // A radius that is no number is no stable loop.
    radii.iter().map(|s| if s.radius.is_nan() { f64::INFINITY } else { s.radius }).fold(0.0, f64::max)
}

fn closed_loop(u: &Units, b: f64) -> Vec<Vec<f64>> {
    let n = 3 + u.delay + usize::from(u.memory().is_some());
    let unit = |i: usize| (0..n).map(|k| f64::from(i == k)).collect::<Vec<_>>();
    (0..n).map(|i| back(u, b, (1.0, 1.0), &unit(i))).collect()
}

/// `lim ‖A^k‖^(1/k)` by squaring: `k = 2³⁰`.
fn spectral_radius(a: &[Vec<f64>]) -> f64 {
    let n = a.len();
    let (mut a, mut log, mut power) = (a.to_vec(), 0.0, 1.0);
    for _ in 0..30 {
        if !a.iter().flatten().all(|x| x.is_finite()) {
            return f64::INFINITY;
        }
        let norm = a.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
        if norm == 0.0 {
            return 0.0;
        }
        log += libm::log(norm) / power;
        for x in a.iter_mut().flatten() {
            *x /= norm;
        }
        a = (0..n).map(|i| (0..n).map(|j| (0..n).map(|k| a[i][k] * a[k][j]).sum()).collect()).collect();
        power *= 2.0;
    }
    libm::exp(log)
}
