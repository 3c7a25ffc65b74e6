//! Rows that hold: Gauss's principle of least constraint, as a problem with bounds.
//!
//! For rows at rest, with `A = J M⁻¹ Jᵀ` and `b` their acceleration without friction, the torques that friction takes
//! minimise `½ λᵀAλ − bᵀλ` within `|λ_i| ≤ h_i`. The accelerations are unique where the torques are not: redundant rows make
//! `A` singular. Proximal steps (`ρ` = 1e-4 of the mean diagonal, `b ← b + ρ λ`) make each problem strictly convex; a
//! primal active set with steps to the bounds then ends after finitely many changes, and cannot cycle.

use nalgebra::{SMatrix, SVector};

/// Proximal steps at most.
const STEPS: u32 = 40;
/// Change of the torques at which a proximal step was the last, as a share of the bounds.
const CLOSE: f64 = 1e-13;

/// The torques that friction takes, and what is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held<const B: usize> {
    /// `λ`: torques of the rows; 0 for one that was not asked.
    pub torque: SVector<f64, B>,
    /// `b − Aλ`: accelerations of the rows under them.
    pub acceleration: SVector<f64, B>,
}

/// Torques of the rows of `asked` within `±bound` that leave the least accelerations; `a` = `J M⁻¹ Jᵀ`, `b` the rows'
/// accelerations without these torques.
#[must_use]
pub fn hold<const B: usize>(
    a: &SMatrix<f64, B, B>,
    b: &SVector<f64, B>,
    bound: &SVector<f64, B>,
    asked: &[bool; B],
) -> Held<B> {
    let count = asked.iter().filter(|asked| **asked).count().max(1) as f64;
    let trace: f64 = (0..B).filter(|i| asked[*i]).map(|i| a[(i, i)]).sum();
    let rho = 1e-4 * trace / count;
    let mut torque = SVector::<f64, B>::zeros();
    let largest = bound.iter().fold(0.0_f64, |most, h| most.max(*h));
    for _ in 0..STEPS {
        let before = torque;
        let shifted = a + SMatrix::<f64, B, B>::identity() * rho;
        torque = within(&shifted, &(b + before * rho), bound, asked, before);
        if (torque - before).amax() <= CLOSE * largest {
            break;
        }
    }
    Held { torque, acceleration: b - a * torque }
}

/// The minimum of `½ λᵀAλ − bᵀλ` within the bounds, of a positive definite `A`.
fn within<const B: usize>(
    a: &SMatrix<f64, B, B>,
    b: &SVector<f64, B>,
    bound: &SVector<f64, B>,
    asked: &[bool; B],
    begin: SVector<f64, B>,
) -> SVector<f64, B> {
    let mut x =
        SVector::<f64, B>::from_fn(|i, _| if asked[i] { begin[i].clamp(-bound[i], bound[i]) } else { 0.0 });
    // Rows that stay at their bound for now.
    let mut fixed: [bool; B] = std::array::from_fn(|i| !asked[i]);
    // Each round frees or fixes a row; a strictly convex problem visits no set twice.
    for _ in 0..4_usize.pow(B.min(8) as u32) + B {
        let step = to_minimum(a, &(b - a * x), &fixed);
        // As far as the nearest bound.
        let mut share = 1.0;
        let mut stops = None;
        for i in (0..B).filter(|i| !fixed[*i]) {
            let room = if step[i] > 0.0 { bound[i] - x[i] } else { -bound[i] - x[i] };
            if step[i] != 0.0 && room / step[i] < share {
                (share, stops) = (room / step[i], Some(i));
            }
        }
        x += step * share;
        if let Some(i) = stops {
            x[i] = bound[i].copysign(step[i]);
            fixed[i] = true;
            continue;
        }
        // At the minimum of the free rows: a row at its bound that pulls inwards is let go, the strongest first.
        let pull = b - a * x;
        let inwards = |i: usize| if x[i] > 0.0 { -pull[i] } else { pull[i] };
        let free = (0..B)
            .filter(|i| fixed[*i] && asked[*i] && bound[*i] > 0.0)
            .max_by(|i, j| inwards(*i).total_cmp(&inwards(*j)))
            .filter(|i| inwards(*i) > 1e-14 * b.amax());
        match free {
            Some(i) => fixed[i] = false,
            None => break,
        }
    }
    x
}

/// The step to the minimum over the rows that are not fixed, from where the gradient is `−pull`.
fn to_minimum<const B: usize>(
    a: &SMatrix<f64, B, B>,
    pull: &SVector<f64, B>,
    fixed: &[bool; B],
) -> SVector<f64, B> {
    // Rows and columns of what is fixed become those of the identity.
    let matrix = SMatrix::<f64, B, B>::from_fn(|i, j| {
        if fixed[i] || fixed[j] { f64::from(u8::from(i == j)) } else { a[(i, j)] }
    });
    let right = SVector::<f64, B>::from_fn(|i, _| if fixed[i] { 0.0 } else { pull[i] });
    matrix.cholesky().map_or_else(SVector::zeros, |c| c.solve(&right))
}
