//! Linear systems of several inertias with rows of friction, drawn at random.

use crate::draw::Draw;
use clutch_core::friction::FrictionParams;
use clutch_core::{Friction, FrictionModel};
use clutch_sim::system::System;
use nalgebra::{SMatrix, SVector};

/// `M v̇ = load(t) − K q − D v − Jᵀ T`.
pub(crate) struct Linear<const N: usize, const B: usize> {
    pub(crate) inertia: SMatrix<f64, N, N>,
    pub(crate) stiffness: SMatrix<f64, N, N>,
    pub(crate) damping: SMatrix<f64, N, N>,
    /// Mean, amplitude, angular frequency.
    pub(crate) load: [(f64, f64, f64); N],
    pub(crate) rows: SMatrix<f64, B, N>,
    pub(crate) base: SVector<f64, B>,
    pub(crate) normal: SVector<f64, B>,
    pub(crate) friction: [Friction<f64>; B],
}

impl<const N: usize, const B: usize> Linear<N, B> {
    /// A system whose motions take some tenths of a second.
    pub(crate) fn draw(draw: &mut Draw, friction: fn(&mut Draw) -> FrictionParams) -> Self {
        let positive = |draw: &mut Draw| {
            let r = SMatrix::<f64, N, N>::from_fn(|_, _| draw.between(-1.0, 1.0));
            r * r.transpose() + SMatrix::<f64, N, N>::identity() * 0.3
        };
        let (inertia, stiffness, damping) = (positive(draw), positive(draw), positive(draw));
        Linear {
            inertia: inertia * draw.log(0.1, 1.0),
            stiffness: stiffness * draw.log(0.1, 100.0),
            damping: damping * draw.log(0.01, 1.0),
            load: std::array::from_fn(|_| {
                (draw.between(-1.0, 1.0), draw.between(0.0, 2.0), draw.log(1.0, 30.0))
            }),
            rows: SMatrix::from_fn(|_, _| draw.between(-1.0, 1.0)),
            base: SVector::from_fn(|_, _| if draw.one_in(3) { draw.between(-0.5, 0.5) } else { 0.0 }),
            normal: SVector::from_fn(|_, _| draw.log(0.1, 5.0)),
            friction: std::array::from_fn(|_| Friction::build(&friction(draw)).unwrap()),
        }
    }

    /// The same without what drives it: no load, nothing that rubs moves.
    pub(crate) fn alone(self) -> Self {
        Linear { load: [(0.0, 0.0, 0.0); N], base: SVector::zeros(), ..self }
    }

    /// Energy of motion and of springs, J.
    pub(crate) fn energy(&self, q: &SVector<f64, N>, v: &SVector<f64, N>) -> f64 {
        0.5 * (v.dot(&(self.inertia * v)) + q.dot(&(self.stiffness * q)))
    }
}

impl<const N: usize, const B: usize> System<N, B> for Linear<N, B> {
    fn inertia(&self, _: &SVector<f64, N>) -> SMatrix<f64, N, N> {
        self.inertia
    }
    fn applied(&self, t: f64, q: &SVector<f64, N>, v: &SVector<f64, N>) -> SVector<f64, N> {
        let load = SVector::from_fn(|i, _| {
            let (mean, amplitude, w) = self.load[i];
            mean + amplitude * (w * t).sin()
        });
        load - self.stiffness * q - self.damping * v
    }
    fn rows(&self, _: &SVector<f64, N>) -> SMatrix<f64, B, N> {
        self.rows
    }
    fn base(&self, _: f64) -> SVector<f64, B> {
        self.base
    }
    fn normal(&self, _: f64) -> SVector<f64, B> {
        self.normal
    }
    fn friction(&self, row: usize) -> &Friction<f64> {
        &self.friction[row]
    }
}
