//! May a scenario run on a board?

use crate::from_scenario;
use clutch_core::ActuatorKind;
use clutch_core::reference::ReferenceParams;
use clutch_sim::scenario::{CertificateError, Plan, Proven, Sampled};
use clutch_sim::{Scenario, ScenarioError, Start, number};
use std::path::{Path, PathBuf};

/// A scenario may not run on a board, or not with these gains.
#[derive(Debug, thiserror::Error)]
pub enum ClearanceError {
    /// The scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The gains are not certified, and were not asked for all the same.
    #[error("{scenario}: {lack}, so nothing was started.")]
    NotCertified {
        /// The scenario's name.
        scenario: String,
        /// The missing part.
        lack: Lack,
    },
    /// The sampled loop's certificate is none of this scenario's.
    #[error(
        "{0}\nNothing was started; `clutch certify SCENARIO --sampled --save FILE.json` makes a certificate"
    )]
    Certificate(#[from] CertificateError),
    /// The certificate is one of a run that begins in motion.
    #[error(
        "run.start = \"on_path\": expected \"rest\" with a certificate, as a shaft on a board begins at rest; save one of that \
         start with --set run.start=rest"
    )]
    CertifiedInMotion,
    /// A log is never written over: it may be the only record of a run.
    #[error("{}: exists already; name a new file for the log", path.display())]
    LogExists {
        /// The file.
        path: PathBuf,
    },
}

/// The part that keeps gains from a board.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Lack {
    /// No certificate in continuous time, and none of the sampled loop was given.
    #[error("the gains are not certified, in continuous time, for these bounds and this path")]
    Certificate,
    /// A bound of the sampled loop, of which nobody knows whether it is linearly stable.
    #[error(
        "the gains are not certified, in continuous time, for these bounds and this path, and whether the sampled loop is \
         linearly stable is not known"
    )]
    Stability,
    /// The sampled loop is linearly unstable.
    #[error("the sampled loop is linearly unstable, with a spectral radius up to {0:.3}")]
    Unstable(f64),
}

/// A scenario that may run on a board.
#[derive(Clone, Debug)]
pub struct Cleared {
    /// Path and gains against the bounds.
    pub plan: Plan,
    /// Verdicts on the sampled loop.
    pub sampled: Sampled,
    /// The bound of its error, if a certificate was given.
    pub proven: Option<Proven>,
}

impl Cleared {
    /// The verdict on the error of the sampled loop with its scope, for log and summary.
    #[must_use]
    pub fn bound_line(&self) -> String {
        self.sampled.bound_if_any(self.proven.as_ref())
    }

    /// The verdicts, each by its name in a log.
    #[must_use]
    pub fn verdicts(&self) -> [(String, String); 4] {
        self.sampled.verdicts(self.plan.certificate.certified(), self.proven.as_ref())
    }

    /// Remarks on limits of the supervisor that a sound shaft will meet with this law and path.
    #[must_use]
    pub fn limits_met(&self, scenario: &Scenario) -> Vec<String> {
        let plan = &self.plan;
        let (spec, mut remarks) = (scenario.spec(), Vec::new());
        let Ok(limits) = scenario.safety().map(|safety| &safety.limits.supervisor) else { return remarks };
        let switches = plan.certificate.certified() && plan.certificate.layer <= 0.0;
        if switches && limits.saturation_time < spec.run.duration {
            remarks.push(format!(
                "note: this law is at a limit of its output in every period, which ends a run after {} s: set \
                 safety.limits.saturation_time_s to the duration of the run",
                number(limits.saturation_time)
            ));
        }
        // A ramp is at its rate at once; a shaft at rest falls behind it until it is as fast.
        let (rate, pull) = (plan.envelope.velocity, plan.bounds.drive_torque.low / plan.bounds.inertia.high);
        let at_once = matches!(spec.reference, ReferenceParams::Ramp(_)) && spec.run.start == Start::Rest;
        let behind = 0.5 * rate * rate / pull;
        let allowed = limits.following_error + limits.following_time * rate;
        if at_once && plan.bounds.actuator == ActuatorKind::Brake && pull > 0.0 && behind > allowed {
            remarks.push(format!(
                "note: from rest the drive takes {} s to the ramp's rate, in which the shaft falls {:.2}° behind: more than the \
                 {:.2}° of safety.limits.following_error_deg and following_time_s, which end the run",
                number(rate / pull),
                behind.to_degrees(),
                allowed.to_degrees()
            ));
        }
        remarks
    }
}

/// A scenario that may run on a board, as it will.
#[derive(Clone, Debug)]
pub struct Admitted {
    scenario: Scenario,
    cleared: Cleared,
    /// It was not in single precision.
    changed: bool,
}

impl Admitted {
    /// A scenario as it is.
    ///
    /// # Errors
    /// As [`check`].
    pub fn new(scenario: Scenario, uncertified: bool, log: Option<&Path>) -> Result<Self, ClearanceError> {
        let cleared = check(&scenario, None, uncertified, log)?;
        Ok(Admitted { scenario, cleared, changed: false })
    }

    /// A scenario in single precision, in which boards calculate.
    ///
    /// # Errors
    /// As [`check`].
    pub fn in_single_precision(
        scenario: Scenario,
        uncertified: bool,
        log: Option<&Path>,
    ) -> Result<Self, ClearanceError> {
        let single = from_scenario::in_single_precision(&scenario)?;
        let changed = single.is_some();
        Ok(Admitted { changed, ..Admitted::new(single.unwrap_or(scenario), uncertified, log)? })
    }

    /// The scenario.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Verdicts on it.
    #[must_use]
    pub fn cleared(&self) -> &Cleared {
        &self.cleared
    }

    /// The change made in it for the board's sake.
    #[must_use]
    pub fn note(&self) -> Option<&'static str> {
        self.changed.then_some(from_scenario::SINGLE_PRECISION)
    }
}

impl Lack {
    /// The reason that keeps a scenario from a board; none if nothing does.
    fn of(plan: &Plan, sampled: &Sampled, proven: bool) -> Option<Self> {
        if let Some(radius) = sampled.radius().filter(|_| sampled.runs_away()) {
            return Some(Lack::Unstable(radius));
        }
        match plan.certificate.certified() {
            true => None,
            false if !proven => Some(Lack::Certificate),
            false => (!sampled.bound_suffices()).then_some(Lack::Stability),
        }
    }
}

/// Checks a scenario for a run on a board: there is a safe state, a brake can follow the path, a certificate that is given
/// holds and is the scenario's, the gains are certified, by it or in continuous time, and the sampled loop is not known to be
/// linearly unstable, or uncertified ones were asked for, and the log is a new file.
///
/// # Errors
/// The first of these that does not hold.
pub fn check(
    scenario: &Scenario,
    certificate: Option<&Path>,
    uncertified: bool,
    log: Option<&Path>,
) -> Result<Cleared, ClearanceError> {
    scenario.safety()?;
    let plan = scenario.plan()?;
    let sampled = scenario.sampled(&plan.bounds);
    let proven = certificate.map(|path| sampled.proven_by(path)).transpose()?;
    if proven.is_some() && scenario.spec().run.start != Start::Rest {
        return Err(ClearanceError::CertifiedInMotion);
    }
    if let Some(lack) = Lack::of(&plan, &sampled, proven.is_some()).filter(|_| !uncertified) {
        return Err(ClearanceError::NotCertified { scenario: scenario.name().to_owned(), lack });
    }
    match log {
        Some(path) if path.exists() => Err(ClearanceError::LogExists { path: path.to_owned() }),
        _ => Ok(Cleared { plan, sampled, proven }),
    }
}
