//! Control laws for a brake: [`Pd`] (4), [`Ctc`] (11), [`Smc`] (29) and (31).
//!
//! Three tiers: parameters in the paper's units with public fields (`Default` = Table 2) →
//! `new`, the only step that can fail → the law, with its state apart. `self` never changes in
//! a tick, so one law serves many runs, and a clone of the state is a snapshot.
//!
//! Sign convention everywhere: `e = θ_d − θ`; `e > 0` means the shaft lags and the brake has to
//! let go. A positive voltage presses the pad.

mod ctc;
mod output;
mod pd;
mod smc;

pub use ctc::{Ctc, CtcParams, CtcTerms};
pub use output::{Limit, Output, OutputParams, OutputState};
pub use pd::{Pd, PdParams, PdTerms};
pub use smc::{Smc, SmcParams, SmcSignParams, SmcTerms};

use crate::{Micros, ParamError, PlantParams, Real};

/// What a law is given each period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tick<T> {
    /// `e = θ_d − θ`, rad.
    pub error: T,
    /// `ė`, from (5) or an observer, rad/s.
    pub error_rate: T,
    /// `θ̇_d`, rad/s.
    pub target_velocity: T,
    /// `θ̈_d`, rad/s².
    pub target_acceleration: T,
}

impl<T: Real> Tick<T> {
    /// `θ̇ = θ̇_d − ė`: the measured velocity, rad/s.
    #[inline]
    #[must_use]
    pub fn velocity(&self) -> T {
        self.target_velocity - self.error_rate
    }
}

/// What a law answers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command<T, Terms> {
    /// Brake voltage within the limits, V.
    pub voltage: T,
    /// Whether a limit or an invalid demand decided it.
    pub limit: Limit,
    /// Every intermediate term, for the log; never fed back.
    pub terms: Terms,
}

/// The intermediate terms of a law, as a log shows them.
pub trait Terms<T>: Copy + Default {
    /// Names with units, and values; the same names on every tick of one law.
    fn columns(&self) -> [(&'static str, T); 3];
}

/// A control law sampled at a fixed period.
pub trait Controller<T> {
    /// What the law remembers. `Default` = at rest; a clone is a snapshot.
    type State: Clone + Default;
    /// Its intermediate terms.
    type Terms: Terms<T>;

    /// The state for a start at `tick` while the brake is at `applied` volts.
    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State;

    /// One period: the measurement in, the voltage out.
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms>;
}

/// Which law, and its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum LawParams<T = f64> {
    /// Proportional–derivative (4).
    Pd(PdParams<T>),
    /// Computed torque (11).
    Ctc(CtcParams<T>),
    /// Sliding mode with the boundary layer (31).
    Smc(SmcParams<T>),
    /// Sliding mode with the sign function (29).
    SmcSign(SmcSignParams<T>),
}

impl<T: Real> LawParams<T> {
    /// The same in another scalar, each number rounded to the nearest.
    #[must_use]
    pub fn cast<U: Real>(&self) -> LawParams<U> {
        match self {
            LawParams::Pd(p) => LawParams::Pd(p.cast()),
            LawParams::Ctc(p) => LawParams::Ctc(p.cast()),
            LawParams::Smc(p) => LawParams::Smc(p.cast()),
            LawParams::SmcSign(p) => LawParams::SmcSign(p.cast()),
        }
    }
}

/// The closed set of laws: what a configuration file, the wire and a log can name.
///
/// ```
/// use clutch_core::{Micros, law::{Controller, Law, LawParams, SmcParams, Tick}};
/// let params = LawParams::Smc(SmcParams::default());
/// let law = Law::<f64>::new(&params, &Default::default(), &Default::default(), Micros(1000))?;
/// let mut state = Default::default();
/// // The shaft is 0.1° ahead: the surface is beyond the layer, the brake gets K_p = 3 V.
/// let tick = Tick { error: -0.1_f64.to_radians(), ..Tick::default() };
/// assert_eq!(law.update(&mut state, &tick).voltage, 3.0);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law<T> {
    /// Proportional–derivative (4).
    Pd(Pd<T>),
    /// Computed torque (11).
    Ctc(Ctc<T>),
    /// Sliding mode (29) or (31).
    Smc(Smc<T>),
}

/// The terms of whichever law ran.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LawTerms<T> {
    /// Of (4).
    Pd(PdTerms<T>),
    /// Of (11).
    Ctc(CtcTerms<T>),
    /// Of (29) and (31).
    Smc(SmcTerms<T>),
}

impl<T: Real> Default for LawTerms<T> {
    fn default() -> Self {
        LawTerms::Pd(PdTerms::default())
    }
}

impl<T: Real> Terms<T> for LawTerms<T> {
    fn columns(&self) -> [(&'static str, T); 3] {
        match self {
            LawTerms::Pd(t) => t.columns(),
            LawTerms::Ctc(t) => t.columns(),
            LawTerms::Smc(t) => t.columns(),
        }
    }
}

impl<T: Real> Law<T> {
    /// Checks gains, believed plant (which only [`Ctc`] needs) and output stage.
    ///
    /// # Errors
    /// As the chosen law's constructor.
    pub fn new(
        p: &LawParams<T>,
        model: &PlantParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        Ok(match p {
            LawParams::Pd(p) => Law::Pd(Pd::new(p, output, period)?),
            LawParams::Ctc(p) => Law::Ctc(Ctc::new(p, model, output, period)?),
            LawParams::Smc(p) => Law::Smc(Smc::new(p, output, period)?),
            LawParams::SmcSign(p) => Law::Smc(Smc::with_sign(p, output, period)?),
        })
    }

    /// The output stage.
    #[must_use]
    pub fn output(&self) -> &Output<T> {
        match self {
            Law::Pd(l) => l.output(),
            Law::Ctc(l) => l.output(),
            Law::Smc(l) => l.output(),
        }
    }
}

impl<T: Real> Controller<T> for Law<T> {
    type State = OutputState<T>;
    type Terms = LawTerms<T>;

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        match self {
            Law::Pd(l) => l.start(tick, applied),
            Law::Ctc(l) => l.start(tick, applied),
            Law::Smc(l) => l.start(tick, applied),
        }
    }

    #[inline]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        match self {
            Law::Pd(l) => named(l.update(state, tick), LawTerms::Pd),
            Law::Ctc(l) => named(l.update(state, tick), LawTerms::Ctc),
            Law::Smc(l) => named(l.update(state, tick), LawTerms::Smc),
        }
    }
}

#[inline]
fn named<T, A, B>(c: Command<T, A>, f: impl FnOnce(A) -> B) -> Command<T, B> {
    Command { voltage: c.voltage, limit: c.limit, terms: f(c.terms) }
}
