//! The motion that an engine made of a case.

use super::case::{Case, CaseError};
use super::model::CaseModel;

/// A row that began to hold or to slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryEvent {
    /// Time, s.
    pub time: f64,
    /// The row, from 0.
    pub row: usize,
    /// It holds from then on.
    pub holds: bool,
}

/// A motion, sampled evenly from t = 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Time between two samples, s.
    pub sample: f64,
    /// Positions, a list for each joint, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Velocities, a list for each joint, rad/s or m/s.
    pub velocity: Vec<Vec<f64>>,
    /// Torques of friction, a list for each row, N m or N; none for an engine that does not say.
    pub torque: Option<Vec<Vec<f64>>>,
    /// Rows that began to hold or to slip; none for an engine that has no such thing.
    pub events: Option<Vec<TrajectoryEvent>>,
    /// Figures of a run of a scenario, by name.
    pub metrics: Vec<(String, f64)>,
}

impl Trajectory {
    /// Checks a trajectory of another make against the case it was made for.
    ///
    /// # Errors
    /// The list that has not the length of the case, or has a value that is no number.
    pub fn check(&self, case: &Case) -> Result<(), CaseError> {
        let CaseModel::Mechanism(mechanism) = &case.model else { return Ok(()) };
        let count = case.samples() + 1;
        let lists = |name: &str, lists: &[Vec<f64>], expected: usize| {
            if lists.len() != expected {
                return Err(format!("trajectory.{name}: {} lists; expected {expected}", lists.len()));
            }
            for (i, list) in lists.iter().enumerate() {
                if list.len() != count {
                    return Err(format!("trajectory.{name}[{i}]: {} samples; expected {count}", list.len()));
                }
                if let Some(k) = list.iter().position(|x| !x.is_finite()) {
                    return Err(format!(
                        "trajectory.{name}[{i}][{k}] = {}: expected a finite number",
                        list[k]
                    ));
                }
            }
            Ok(())
        };
        let all = lists("position", &self.position, mechanism.joints())
            .and_then(|()| lists("velocity", &self.velocity, mechanism.joints()))
            .and_then(|()| self.torque.as_ref().map_or(Ok(()), |t| lists("torque", t, mechanism.rows.len())));
        all.map_err(|message| CaseError::new(&case.id, message))?;
        let mut last = 0.0;
        for (i, e) in self.events.iter().flatten().enumerate() {
            let wrong =
                |what: String| Err(CaseError::new(&case.id, format!("trajectory.events[{i}]: {what}")));
            if e.row >= mechanism.rows.len() {
                return wrong(format!("row {}: expected one from 0 to {}", e.row, mechanism.rows.len() - 1));
            }
            if !(last..=case.duration * (1.0 + 1e-9)).contains(&e.time) {
                return wrong(format!(
                    "time {} s: expected one from {last} to {} s, in order",
                    e.time, case.duration
                ));
            }
            last = e.time;
        }
        Ok(())
    }

    /// Rows that hold and slip, as the engine says or, if it has no such thing, as slip rates above and below `still` say.
    pub(super) fn events_of(&self, case: &Case, row: usize) -> Vec<(f64, bool)> {
        let CaseModel::Mechanism(mechanism) = &case.model else { return Vec::new() };
        let r = &mechanism.rows[row];
        let slip = |k: usize| {
            let along = r.joints.iter().zip(&self.velocity).map(|(j, v)| j * v[k]).sum::<f64>();
            (along - r.base_velocity).abs()
        };
        if let Some(events) = &self.events {
            // A row that turns round goes on slipping, and one that slips at the start has not begun to.
            let mut own: Vec<_> = events.iter().filter(|e| e.row == row).map(|e| (e.time, e.holds)).collect();
            if slip(0) > 0.0 && own.first().is_some_and(|e| !e.1) {
                own.remove(0);
            }
            own.dedup_by_key(|e| e.1);
            return own;
        }
        let Some(still) = case.still else { return Vec::new() };
        let mut holds = slip(0) < still;
        let mut events = Vec::new();
        for k in 1..self.velocity.first().map_or(0, Vec::len) {
            if (slip(k) < still) != holds {
                holds = !holds;
                events.push((k as f64 * self.sample, holds));
            }
        }
        events
    }
}
