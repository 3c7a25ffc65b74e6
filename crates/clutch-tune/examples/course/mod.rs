//! The course of a hidden rig: what tuning may know of it, the tuned law on it in the loop, and rigs that are done.

use crate::random_rig::Outcome;
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::station::ControllerStation;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions};
use clutch_node::ControllerNode;
use clutch_sim::rig::Rig;
use clutch_sim::scenario::{Table, Value};
use clutch_sim::{Metrics, Scenario};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{BufRead, BufReader, Write};

/// The loop's run on a hidden rig.
pub(crate) struct Driven {
    /// Figures by the true motion.
    pub(crate) metrics: Metrics,
    /// Largest error from the start on, rad.
    pub(crate) largest_error: f64,
    /// Cause of an early end.
    pub(crate) ended: Option<String>,
}

/// The input of tuning: the hidden rig's bounds and safe state, and of its rig encoder, converter and the keys that are known.
pub(crate) fn known(hidden: &Scenario, rig: Table) -> Outcome<Scenario> {
    let mut table = hidden.table().clone();
    let mut own = Table::from_iter([("base".to_owned(), Value::String("paper".to_owned()))]);
    let there = hidden.table().get("rig").and_then(Value::as_table);
    let of = |key: &str| Some((key.to_owned(), there?.get(key)?.clone()));
    own.extend(["encoder", "dac"].into_iter().filter_map(of));
    own.extend(rig);
    table.insert("rig".to_owned(), Value::Table(own));
    Ok(Scenario::from_table("rig", table, &[])?)
}

/// The tuned law on the hidden rig, for so long, of which the settling time does not count, s.
pub(crate) fn on_hidden(
    tuned: &Scenario,
    hidden: &Scenario,
    [seconds, settle]: [f64; 2],
) -> Outcome<Scenario> {
    let mut table = tuned.table().clone();
    if let Some(rig) = hidden.table().get("rig") {
        table.insert("rig".to_owned(), rig.clone());
    }
    let set = [
        ("run.duration_s".to_owned(), Value::Float(seconds)),
        ("run.settle_s".to_owned(), Value::Float(settle)),
        ("run.seed".to_owned(), Value::Integer(hidden.params().run.seed as i64)),
    ];
    Ok(Scenario::from_table("loop", table, &set)?)
}

/// The loop in virtual time, on the simulated board.
pub(crate) fn drive(scenario: &Scenario) -> Outcome<Driven> {
    let built = BuiltRun::<f64>::new(scenario, 1)?;
    let path = from_scenario::path::<f64>(scenario)?;
    let run = scenario.spec().run;
    let options = VirtualOptions {
        duration: run.duration + 1.0,
        ticks: built.ticks,
        settle: run.settle,
        ..VirtualOptions::default()
    };
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let report = VirtualLoop::new(scenario, options, ControllerStation::new(node, &path))?.run(&path)?;
    let ended = report.cause.map(|cause| format!("{cause:?}"));
    Ok(Driven { metrics: report.metrics, largest_error: report.largest_error, ended })
}

/// Largest departure of friction from its mean that the disc has, as a share.
pub(crate) fn largest_ripple(hidden: &Scenario) -> Outcome<f64> {
    let rig = Rig::new(&hidden.params().rig, hidden.params().run.seed)?;
    let ripple = rig.model.ripple.as_ref();
    let at = |k: u32| ripple.map_or(0.0, |r| (r.factor(f64::from(k) * 1e-5) - 1.0).abs());
    Ok((0..628_319).step_by(7).map(at).fold(0.0, f64::max))
}

/// Rigs that are done are kept beside this program, under a name of its bytes and of what is other than usual: started anew it goes
/// on, and a program that was built anew begins anew.
pub(crate) struct Kept<C> {
    file: File,
    done: Vec<(u64, C)>,
}

impl<C: Clone + Serialize + DeserializeOwned> Kept<C> {
    pub(crate) fn open(other: &str) -> Outcome<Kept<C>> {
        let program = std::env::current_exe()?;
        let mut bytes = DefaultHasher::new();
        bytes.write(&std::fs::read(&program)?);
        bytes.write(other.as_bytes());
        let path = program.with_extension(format!("{:016x}.jsonl", bytes.finish()));
        let file = File::options().create(true).append(true).read(true).open(&path)?;
        // A line that was cut off is done again.
        let lines = BufReader::new(&file).lines().collect::<Result<Vec<_>, _>>()?;
        let done = lines.iter().filter_map(|line| serde_json::from_str(line).ok()).collect();
        Ok(Kept { file, done })
    }

    pub(crate) fn course(&mut self, seed: u64, course: impl FnOnce(u64) -> Outcome<C>) -> Outcome<C> {
        if let Some((_, course)) = self.done.iter().find(|(s, _)| *s == seed) {
            return Ok(course.clone());
        }
        let course = course(seed)?;
        writeln!(self.file, "{}", serde_json::to_string(&(seed, &course))?)?;
        Ok(course)
    }
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Median and largest of some angles, in degrees.
pub(crate) fn degrees(values: impl Iterator<Item = f64>) -> String {
    let values: Vec<f64> = values.map(f64::to_degrees).collect();
    let most = values.iter().copied().fold(0.0, f64::max);
    if values.is_empty() { "–".to_owned() } else { format!("{:.3}°, {most:.3}°", median(values)) }
}
