//! Sliding-mode control, with the sign function and with the saturation boundary layer.
//!
//! ```text
//! σ = f e + ė                                                     (13)
//! u = −{K_p sgn(σ)   + K_d sgn(σ ė) ė}                            (29)
//! u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}                          (31)
//! ```
//!
//! `ε` divides `σ` (rad/s) and `σ ė` (rad²/s²) alike; the paper gives it no unit.

use super::output::{Output, OutputParams, OutputState};
use super::{Command, Controller, Terms, Tick};
use crate::error::{cast, require};
use crate::{Micros, ParamError, Real};

/// Gains of (31); `Default` = Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct SmcParams<T = f64> {
    /// `K_p` in (31), V.
    pub kp: T,
    /// `K_d` in (31), V s/rad.
    pub kd: T,
    /// `f` in (13): slope of the sliding surface, 1/s.
    #[doc(alias = "f")]
    #[doc(alias = "lambda")]
    pub slope: T,
    /// `ε` in (30): thickness of the boundary layer, rad/s.
    #[doc(alias = "epsilon")]
    pub boundary: T,
}

cast!(SmcParams { kp, kd, slope, boundary });
cast!(SmcSignParams { kp, kd, slope });

impl<T: Real> Default for SmcParams<T> {
    fn default() -> Self {
        SmcParams {
            kp: T::from_i32(3),
            kd: T::from_i32(400),
            slope: T::from_i32(70),
            boundary: T::from_f64(0.1),
        }
    }
}

/// Gains of (29); `Default` = Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct SmcSignParams<T = f64> {
    /// `K_p` in (29), V.
    pub kp: T,
    /// `K_d` in (29), V s/rad.
    pub kd: T,
    /// `f` in (13): slope of the sliding surface, 1/s.
    pub slope: T,
}

impl<T: Real> Default for SmcSignParams<T> {
    fn default() -> Self {
        let SmcParams { kp, kd, slope, .. } = SmcParams::default();
        SmcSignParams { kp, kd, slope }
    }
}

/// How the law switches across the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Switching<T> {
    Sign,
    Saturation { inverse_boundary: T },
}

/// The law (29) or (31), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smc<T> {
    kp: T,
    kd: T,
    slope: T,
    switching: Switching<T>,
    output: Output<T>,
}

/// Intermediate terms of (29) and (31).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SmcTerms<T> {
    /// `σ` in (13), rad/s.
    pub surface: T,
    /// `−K_p sat(σ/ε)`, V.
    pub switching: T,
    /// `−K_d sat(σ ė/ε) ė`, V.
    pub damping: T,
}

impl<T: Real> Terms<T> for SmcTerms<T> {
    fn columns(&self) -> [(&'static str, T); 3] {
        [("surface_rad_s", self.surface), ("switching_v", self.switching), ("damping_v", self.damping)]
    }
}

impl<T: Real> Smc<T> {
    /// The law (31), with the boundary layer.
    ///
    /// # Errors
    /// `kp` or `kd` negative, `slope` or `boundary` not positive, any of them not finite; a bad
    /// output stage or period.
    pub fn new(p: &SmcParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        let inverse_boundary = T::ONE / p.boundary;
        require(
            "boundary",
            p.boundary,
            p.boundary > T::ZERO && inverse_boundary.is_finite(),
            "a finite number above 0 rad/s",
        )?;
        let gains = SmcSignParams { kp: p.kp, kd: p.kd, slope: p.slope };
        let law = Smc::with_sign(&gains, output, period)?;
        Ok(Smc { switching: Switching::Saturation { inverse_boundary }, ..law })
    }

    /// The law (29), with the sign function: it chatters.
    ///
    /// # Errors
    /// As [`Smc::new`], without the boundary.
    pub fn with_sign(
        p: &SmcSignParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        require("kp", p.kp, p.kp >= T::ZERO, "a finite number of at least 0 V")?;
        require("kd", p.kd, p.kd >= T::ZERO, "a finite number of at least 0 V s/rad")?;
        require("slope", p.slope, p.slope > T::ZERO, "a finite number above 0 1/s")?;
        let output = Output::new(output, period)?;
        Ok(Smc { kp: p.kp, kd: p.kd, slope: p.slope, switching: Switching::Sign, output })
    }

    /// `K_p`, V.
    #[must_use]
    pub fn kp(&self) -> T {
        self.kp
    }

    /// `K_d`, V s/rad.
    #[must_use]
    pub fn kd(&self) -> T {
        self.kd
    }

    /// `f`, 1/s.
    #[must_use]
    pub fn slope(&self) -> T {
        self.slope
    }

    /// `ε`, rad/s; 0 for the sign function.
    #[must_use]
    pub fn boundary(&self) -> T {
        match self.switching {
            Switching::Sign => T::ZERO,
            Switching::Saturation { inverse_boundary } => T::ONE / inverse_boundary,
        }
    }

    /// The output stage.
    #[must_use]
    pub fn output(&self) -> &Output<T> {
        &self.output
    }

    #[inline]
    fn terms(&self, tick: &Tick<T>) -> (T, SmcTerms<T>) {
        let surface = self.slope * tick.error + tick.error_rate;
        let across = surface * tick.error_rate;
        let (switch, damp) = match self.switching {
            Switching::Sign => (surface.sgn(), across.sgn()),
            Switching::Saturation { inverse_boundary } => {
                ((surface * inverse_boundary).sat(), (across * inverse_boundary).sat())
            }
        };
        let terms = SmcTerms {
            surface,
            switching: -(self.kp * switch),
            damping: -(self.kd * damp * tick.error_rate),
        };
        (terms.switching + terms.damping, terms)
    }
}

impl<T: Real> Controller<T> for Smc<T> {
    type State = OutputState<T>;
    type Terms = SmcTerms<T>;

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.terms(tick).0, applied)
    }

    #[inline]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        let (demand, terms) = self.terms(tick);
        let (voltage, limit) = self.output.apply(state, demand);
        Command { voltage, limit, terms }
    }
}
