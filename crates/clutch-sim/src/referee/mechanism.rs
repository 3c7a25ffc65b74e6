//! A linear mechanism with rows of friction, as the cases describe it.

use super::signal::Signal;
use crate::system::System;
use clutch_core::Friction;
use nalgebra::{SMatrix, SVector};

/// A row of friction.
#[derive(Clone, Debug)]
pub struct Row {
    /// `J_i`: what of each joint's velocity is its slip rate.
    pub joints: Vec<f64>,
    /// Velocity of what it rubs on, rad/s or m/s.
    pub base_velocity: f64,
    /// Normal force, as torque (force) per unit of μ.
    pub normal: Signal,
    /// Its friction.
    pub friction: Friction<f64>,
    /// Name of that model, and its parameters by their keys.
    pub told: (String, toml::Table),
}

/// `M v̇ = load(t) − K q − D v − Σ J_iᵀ T_i`.
#[derive(Clone, Debug)]
pub struct Mechanism {
    /// `M`.
    pub(super) inertia: Vec<Vec<f64>>,
    /// `K`; it need not be symmetric, so that a law can be written as one.
    pub(super) stiffness: Vec<Vec<f64>>,
    /// `D`.
    pub(super) damping: Vec<Vec<f64>>,
    /// Positions at the start.
    pub(super) position: Vec<f64>,
    /// Velocities at the start.
    pub(super) velocity: Vec<f64>,
    /// Load of each joint over time.
    pub(super) load: Vec<Signal>,
    /// Rows of friction.
    pub(super) rows: Vec<Row>,
}

impl Mechanism {
    /// Number of joints.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.inertia.len()
    }

    /// The inertia is one.
    pub(super) fn has_inertia(&self) -> bool {
        let m = square::<4>(&self.inertia, 1.0);
        m == m.transpose() && m.cholesky().is_some()
    }

    /// All its signals.
    pub(super) fn signals(&self) -> impl Iterator<Item = &Signal> {
        self.load.iter().chain(self.rows.iter().map(|row| &row.normal))
    }
}

/// A matrix, filled up with `diagonal` on its diagonal and 0.
fn square<const N: usize>(m: &[Vec<f64>], diagonal: f64) -> SMatrix<f64, N, N> {
    let empty = |i: usize, j: usize| if i == j { diagonal } else { 0.0 };
    SMatrix::from_fn(|i, j| m.get(i).map_or(empty(i, j), |row| row.get(j).copied().unwrap_or(0.0)))
}

/// A mechanism as a [`System`] of `N` joints and `B` rows: it may have fewer, and the rest stands still and rubs on nothing.
pub(super) struct Padded<'a, const N: usize, const B: usize> {
    mechanism: &'a Mechanism,
    inertia: SMatrix<f64, N, N>,
    stiffness: SMatrix<f64, N, N>,
    damping: SMatrix<f64, N, N>,
    rows: SMatrix<f64, B, N>,
    base: SVector<f64, B>,
    longest: f64,
    /// The most that loads and normal forces bend.
    bends: (SVector<f64, N>, SVector<f64, B>),
}

impl<'a, const N: usize, const B: usize> Padded<'a, N, B> {
    pub(super) fn new(mechanism: &'a Mechanism) -> Self {
        let at = |i: usize| mechanism.rows.get(i);
        // A tenth of the fastest sine; a constant load needs no limit.
        let fastest = mechanism.signals().fold(0.0_f64, |most, s| most.max(s.fastest()));
        let springs = mechanism.stiffness.iter().flatten().any(|k| *k != 0.0);
        let quiet = mechanism.signals().all(|s| s.constant().is_some()) && !springs;
        Padded {
            mechanism,
            inertia: square(&mechanism.inertia, 1.0),
            stiffness: square(&mechanism.stiffness, 0.0),
            damping: square(&mechanism.damping, 0.0),
            rows: SMatrix::from_fn(|i, j| at(i).and_then(|row| row.joints.get(j)).copied().unwrap_or(0.0)),
            base: SVector::from_fn(|i, _| at(i).map_or(0.0, |row| row.base_velocity)),
            longest: if quiet { f64::INFINITY } else { (0.1 / fastest).min(0.1) },
            bends: (
                SVector::from_fn(|i, _| mechanism.load.get(i).map_or(0.0, Signal::curvature)),
                SVector::from_fn(|i, _| at(i).map_or(0.0, |row| row.normal.curvature())),
            ),
        }
    }
}

impl<const N: usize, const B: usize> System<N, B> for Padded<'_, N, B> {
    fn inertia(&self, _: &SVector<f64, N>) -> SMatrix<f64, N, N> {
        self.inertia
    }

    fn applied(&self, t: f64, q: &SVector<f64, N>, v: &SVector<f64, N>) -> SVector<f64, N> {
        let load = SVector::<f64, N>::from_fn(|i, _| self.mechanism.load.get(i).map_or(0.0, |s| s.at(t)));
        load - self.stiffness * q - self.damping * v
    }

    fn rows(&self, _: &SVector<f64, N>) -> SMatrix<f64, B, N> {
        self.rows
    }

    fn base(&self, _: f64) -> SVector<f64, B> {
        self.base
    }

    fn normal(&self, t: f64) -> SVector<f64, B> {
        SVector::from_fn(|i, _| self.mechanism.rows.get(i).map_or(0.0, |row| row.normal.at(t)))
    }

    fn friction(&self, row: usize) -> &Friction<f64> {
        // Rows that it has not rub on nothing.
        &self.mechanism.rows[row.min(self.mechanism.rows.len() - 1)].friction
    }

    fn curvature(&self, _: f64, _: f64) -> Option<(SVector<f64, N>, SVector<f64, B>)> {
        Some(self.bends)
    }

    fn longest_step(&self) -> f64 {
        self.longest
    }

    fn corner(&self, t: f64) -> Option<f64> {
        self.mechanism.signals().filter_map(|s| s.corner(t)).min_by(f64::total_cmp)
    }
}
