//! A run that is not smooth: what it does, and on which disc.

use crate::engine::{EventKind, Motion};
use crate::progress::{Progress, Report};
use crate::run::{ClosedLoop, REPORT_EVERY, RunError, RunSpec};
use crate::scenario::{ScalarKind, Scenario};
use crate::scenario_error::ScenarioError;
use clutch_core::{Real, Servo};
use serde::Serialize;

/// A shaft that departs from its path by this share of the measured way does not follow it.
const STRAYS: f64 = 0.5;
/// Nor does one that is as far off as this, rad: a shaft let go is so after a quarter of a second.
const FAR: f64 = 1.0;

/// The reasons why a run is not smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Failing {
    /// The shaft comes to rest.
    Sticks,
    /// It moves, but not with the path.
    Strays,
}

/// A run that is not smooth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// Rate of the ramp, °/s.
    pub rate_deg_s: f64,
    /// Seed of the disc.
    pub seed: u64,
    /// Time at which it showed, s.
    pub time_s: f64,
    /// Its behaviour.
    pub failing: Failing,
}

impl Scenario {
    /// The scenario, whose rate this is, on a disc: the first thing that is not smooth.
    pub(super) fn disc(
        &self,
        rate_deg_s: f64,
        seed: u64,
        report: Report<'_>,
    ) -> Result<Option<Failure>, ScenarioError> {
        self.ridden(self.spec(), (rate_deg_s, seed), report)
    }

    /// The same on a disc whose friction is the same all along.
    pub(super) fn even_disc(
        &self,
        rate_deg_s: f64,
        seed: u64,
        report: Report<'_>,
    ) -> Result<Option<Failure>, ScenarioError> {
        let mut spec = self.spec();
        (spec.rig.ripple, spec.rig.runout) = (None, None);
        self.ridden(spec, (rate_deg_s, seed), report)
    }

    fn ridden(
        &self,
        mut spec: RunSpec<'_>,
        (rate_deg_s, seed): (f64, u64),
        report: Report<'_>,
    ) -> Result<Option<Failure>, ScenarioError> {
        spec.run.seed = seed;
        let failure = match self.scalar() {
            ScalarKind::F32 => first_failure::<f32>(&spec, report),
            ScalarKind::F64 => first_failure::<f64>(&spec, report),
        };
        let failure = failure.map_err(|e| self.run_error(&e))?;
        Ok(failure.map(|(failing, time_s)| Failure { rate_deg_s, seed, time_s, failing }))
    }
}

/// Runs until something is not smooth: what, and when (s).
fn first_failure<T: Real>(
    spec: &RunSpec<'_>,
    report: Report<'_>,
) -> Result<Option<(Failing, f64)>, RunError> {
    let servo = Servo::<T>::new(&spec.servo()?.cast()).map_err(|e| e.cast())?;
    let mut run = ClosedLoop::begin(spec, &servo)?;
    let (p, ticks) = (&spec.run, spec.run.ticks(spec.period));
    let mut settled = None;
    for k in 0..ticks {
        if k % REPORT_EVERY == 0 && report(Progress { total: 0, finished: 0 }).is_break() {
            return Err(RunError::Stopped);
        }
        let sample = run.sample(k);
        let (time, error) = (sample.time, sample.target_position - sample.shaft.position);
        if time >= p.settle {
            let since = *settled.get_or_insert(error);
            let way = sample.target.velocity.to_f64() * (p.duration - p.settle);
            if sample.shaft.motion == Motion::Stuck {
                return Ok(Some((Failing::Sticks, time)));
            }
            if (error - since).abs() > STRAYS * way {
                return Ok(Some((Failing::Strays, time)));
            }
        }
        if error.abs() > FAR {
            return Ok(Some((Failing::Strays, time)));
        }
        let stick = run.advance()?.iter().find(|e| e.kind == EventKind::Stick && e.time >= p.settle);
        if let Some(stick) = stick {
            return Ok(Some((Failing::Sticks, stick.time)));
        }
    }
    Ok(None)
}
