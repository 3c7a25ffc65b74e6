//! Sweeps: one scenario, many values of its keys, on all cores.
//!
//! Each row is a run of its own, with its own seed. Its result depends on nothing but the row: not on
//! the number of threads, nor on which other rows there are.

use crate::lane::vector::levels;
use crate::lanes;
use crate::progress::UNWATCHED;
use crate::run::{Keep, Run};
use crate::scenario::{ScalarKind, Scenario, Setter};
use crate::scenario_error::ScenarioError;
use fearless_simd::Level;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use toml::{Table, Value};

/// Rows that run side by side in one vector.
const LANES: usize = 8;
/// Most rows that a thread takes at once.
const BATCH: usize = 256;
/// Periods of runs by the exact flow that are worth a thread. A thread begins and ends for a tenth of a millisecond of
/// processor, and the fewer rows it has, the emptier are its lanes; these take some 1 to 8 ms.
const WORTH: u64 = 1 << 16;

/// A scenario and the keys that change from row to row.
#[derive(Clone, Debug)]
pub struct Sweep {
    origin: String,
    base: Arc<Table>,
    keys: Vec<String>,
    rows: Vec<Vec<Value>>,
    /// Instructions of its lanes; none if the rows go one by one.
    level: Option<Level>,
    /// Made of the scenario, or of the first row that is one; none if a key changes more than a value.
    shared: OnceLock<Option<Shared>>,
}

/// Instructions that this processor does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("instructions = \"{asked}\": expected one of this processor's: {}", .known.join(", "))]
pub struct NoInstructions {
    asked: String,
    known: Vec<&'static str>,
}

/// Everything that all rows have in common.
#[derive(Clone, Debug)]
struct Shared {
    /// A scenario of which every row is a variation.
    scenario: Scenario,
    /// The keys of the sweep in it.
    setters: Vec<Setter>,
}

/// A row that ran.
#[derive(Clone, Debug)]
pub struct Row {
    /// True if the gains are certified for the row's bounds.
    pub certified: bool,
    /// Figures, and the trace if it was to be kept.
    pub run: Run,
}

/// A sweep's rows and keys do not belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("row {row} has {values} values for {keys} keys")]
pub struct Misfit {
    /// The row, from 0.
    pub row: usize,
    /// Values in it.
    pub values: usize,
    /// Keys of the sweep.
    pub keys: usize,
}

impl Sweep {
    /// `rows` of values for the dotted `keys`, over `base`; errors of a row begin with `origin`.
    ///
    /// # Errors
    /// A row that has not one value for each key.
    pub fn new(origin: &str, base: Table, keys: Vec<String>, rows: Vec<Vec<Value>>) -> Result<Sweep, Misfit> {
        match rows.iter().position(|row| row.len() != keys.len()) {
            Some(row) => Err(Misfit { row, values: rows[row].len(), keys: keys.len() }),
            None => {
                let (origin, level) = (origin.into(), Some(Level::new()));
                Ok(Sweep { origin, base: Arc::new(base), keys, rows, level, shared: OnceLock::new() })
            }
        }
    }

    /// As [`Sweep::new`], over a scenario that is checked already: it is not read again.
    ///
    /// # Errors
    /// A row that has not one value for each key.
    pub fn of(
        origin: &str,
        scenario: &Scenario,
        keys: Vec<String>,
        rows: Vec<Vec<Value>>,
    ) -> Result<Sweep, Misfit> {
        let sweep = Sweep { base: scenario.tables(), ..Sweep::new(origin, Table::new(), keys, rows)? };
        // A key that this scenario does not have may be one of the rows'.
        if let Some(shared) = sweep.share(scenario.clone()) {
            let _ = sweep.shared.set(Some(shared));
        }
        Ok(sweep)
    }

    /// The sweep with lanes of these instructions, `sse2`, `sse4.2`, `avx2`, `avx512` or `neon`, and not of the widest that the
    /// processor has; with `alone`, one row after the other: for comparisons. The rows' bits are the same.
    ///
    /// # Errors
    /// This processor does not have them.
    pub fn in_lanes_of(mut self, instructions: &str) -> Result<Sweep, NoInstructions> {
        let one_by_one = std::iter::once(("alone", None));
        let known: Vec<_> =
            levels().into_iter().map(|(name, level)| (name, Some(level))).chain(one_by_one).collect();
        match known.iter().find(|(name, _)| *name == instructions) {
            Some((_, level)) => self.level = *level,
            None => {
                let known = known.into_iter().map(|(name, _)| name).collect();
                return Err(NoInstructions { asked: instructions.into(), known });
            }
        }
        Ok(self)
    }

    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// No rows at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A row's scenario.
    ///
    /// # Errors
    /// A mistake in it.
    ///
    /// # Panics
    /// There is no such row.
    pub fn scenario(&self, row: usize) -> Result<Scenario, ScenarioError> {
        if self.shared.get().is_none() {
            // The first row that is a scenario decides what the keys are, and makes what all rows share.
            let scenario = self.on_base(row)?;
            self.shared.get_or_init(|| self.share(scenario));
        }
        let Some(Some(shared)) = self.shared.get() else { return self.on_base(row) };
        // Of several mistakes in a row the same one is named, whichever row came first.
        shared.scenario.with(shared.setters.iter().zip(&self.rows[row])).or_else(|_| self.on_base(row))
    }

    fn on_base(&self, row: usize) -> Result<Scenario, ScenarioError> {
        let set: Vec<_> = self.keys.iter().cloned().zip(self.rows[row].iter().cloned()).collect();
        Scenario::from_table(&self.origin, Table::clone(&self.base), &set)
    }

    fn share(&self, scenario: Scenario) -> Option<Shared> {
        let setters = self.keys.iter().map(|key| scenario.setter(key)).collect::<Option<_>>()?;
        Some(Shared { scenario, setters })
    }

    /// Threads that are worth their beginning: fewer than these for few short runs.
    fn worth(&self, threads: usize, keep: Keep) -> usize {
        let Some(Some(Shared { scenario, setters })) = self.shared.get() else { return threads };
        let known = keep == Keep::Figures && setters.iter().all(Setter::keeps_length);
        if !known || !scenario.flows_exactly() {
            return threads;
        }
        let periods = scenario.ticks().saturating_mul(self.rows.len() as u64);
        threads.min(usize::try_from(periods.div_ceil(WORTH)).unwrap_or(usize::MAX))
    }

    /// Runs all rows on so many threads, or fewer. `done` is called from these, with each finished row,
    /// in no order. Once `stop` is set, runs under way end within milliseconds and are not reported.
    pub fn run(
        &self,
        threads: usize,
        keep: Keep,
        stop: &AtomicBool,
        done: &(dyn Fn(usize, Result<Row, ScenarioError>) + Sync),
    ) {
        if self.shared.get().is_none() && !self.rows.is_empty() {
            // Before there are threads, each of which would read the tables of its first row.
            let _ = self.scenario(0);
        }
        let threads = self.worth(threads, keep);
        let next = AtomicUsize::new(0);
        let deal = Deal::of(self.rows.len(), threads, keep);
        let work = || {
            while !stop.load(Ordering::Relaxed) {
                let batch = next.fetch_add(1, Ordering::Relaxed);
                if batch >= deal.batches {
                    break;
                }
                self.some(deal.batch(batch), keep, stop, done);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads.min(self.rows.len()) {
                // The system may refuse more threads: those that there are do the work.
                if std::thread::Builder::new().spawn_scoped(scope, work).is_err() {
                    break;
                }
            }
            work();
        });
    }

    /// Some rows: those that can in lanes, the others one by one.
    fn some(
        &self,
        rows: impl Iterator<Item = usize>,
        keep: Keep,
        stop: &AtomicBool,
        done: &(dyn Fn(usize, Result<Row, ScenarioError>) + Sync),
    ) {
        let stopped = || stop.load(Ordering::Relaxed);
        let mut planned = Vec::with_capacity(BATCH);
        for i in rows {
            if stopped() {
                return;
            }
            match self.scenario(i) {
                Ok(scenario) => planned.push((i, scenario.certified(), scenario)),
                Err(e) => done(i, Err(e)),
            }
        }
        let mut told = vec![false; planned.len()];
        if let (Keep::Figures, Some(level)) = (keep, self.level) {
            let doubles = planned.iter().enumerate().filter(|(_, row)| row.2.scalar() == ScalarKind::F64);
            let specs = doubles.map(|(place, row)| (place, row.2.spec()));
            let goes_on = lanes::run_all(level, specs, &stopped, &mut |place, engine, metrics, detected| {
                let (i, certified, _) = &planned[place];
                told[place] = true;
                done(*i, Ok(Row { certified: *certified, run: Run::of_figures(engine, metrics, detected) }));
            });
            if !goes_on {
                return;
            }
        }
        for ((i, certified, scenario), _) in planned.iter().zip(told).filter(|(_, told)| !told) {
            let progress = |p| if stopped() { ControlFlow::Break(()) } else { UNWATCHED(p) };
            let run = scenario.run(keep, &progress);
            if stopped() {
                return;
            }
            done(*i, run.map(|run| Row { certified: *certified, run }));
        }
    }
}

/// Rows as threads take them.
struct Deal {
    rows: usize,
    /// Rows that stay together.
    hand: usize,
    batches: usize,
}

impl Deal {
    /// Rows one by one where samples are kept. Else as many in a batch as fill lanes: few rows are as many batches as there
    /// are threads, dealt out by the handful, so that none gets the slow end of a table.
    fn of(rows: usize, threads: usize, keep: Keep) -> Self {
        let threads = threads.max(1);
        let (hand, batches) = match keep {
            Keep::Trace => (1, rows),
            Keep::Figures if rows <= threads.saturating_mul(BATCH) => {
                let hand = rows.div_ceil(threads).clamp(1, LANES);
                (hand, threads.min(rows.div_ceil(hand)))
            }
            Keep::Figures => (BATCH, rows.div_ceil(BATCH)),
        };
        Deal { rows, hand, batches }
    }

    /// The rows of a batch.
    fn batch(&self, batch: usize) -> impl Iterator<Item = usize> {
        let hands = (batch * self.hand..self.rows).step_by(self.hand * self.batches);
        hands.flat_map(|first| first..(first + self.hand).min(self.rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::BUILT_IN;
    use std::sync::Mutex;

    fn sweep(rows: &[f64]) -> Sweep {
        let pd = BUILT_IN.iter().find(|b| b.name == "pd_2").unwrap();
        let keys = vec!["law.pd.kp_v_rad".to_owned(), "run.duration_s".to_owned()];
        let rows = rows.iter().map(|kp| vec![Value::Float(*kp), Value::Float(1.5)]).collect();
        Sweep::new("pd_2", pd.toml.parse().unwrap(), keys, rows).unwrap()
    }

    fn outcomes(s: &Sweep, threads: usize) -> Vec<Result<crate::Metrics, ScenarioError>> {
        let found = Mutex::new(vec![None; s.len()]);
        s.run(threads, Keep::Figures, &AtomicBool::new(false), &|i, r| {
            found.lock().unwrap()[i] = Some(r.map(|r| r.run.metrics));
        });
        found.into_inner().unwrap().into_iter().map(Option::unwrap).collect()
    }

    #[test]
    fn a_row_is_what_its_scenario_gives_alone_on_any_number_of_threads() {
        let s = sweep(&[50.0, 80.0, 110.0, 140.0, 170.0]);
        let alone: Vec<_> = (0..s.len())
            .map(|i| Ok(s.scenario(i).unwrap().run(Keep::Trace, UNWATCHED).unwrap().metrics))
            .collect();
        for threads in [1, 2, 7] {
            assert_eq!(outcomes(&s, threads), alone, "{threads} threads");
        }
    }

    #[test]
    fn rows_over_a_checked_scenario_are_what_they_are_over_its_tables() {
        let pd = Scenario::built_in("pd_2").unwrap().unwrap();
        // The last key the scenario does not have: the first row that is one decides what it is.
        for key in ["law.pd.kp_v_rad", "rig.base", "run.duration_s", "rig.actuator_time_constant_s"] {
            let values = match key {
                "rig.base" => ["ideal", "none", "bench"].map(|base| Value::String(base.into())),
                _ => [0.05, -1.0, 2.0].map(Value::Float),
            };
            let rows: Vec<_> = values.map(|value| vec![value]).to_vec();
            let over = Sweep::of("x", &pd, vec![key.to_owned()], rows.clone()).unwrap();
            let read = Sweep::new("x", pd.table().clone(), vec![key.to_owned()], rows).unwrap();
            let found = outcomes(&over, 2);
            assert_eq!(found, outcomes(&read, 2), "{key}");
            assert!(found.iter().any(Result::is_ok) && found[1].is_err(), "{key}: {found:?}");
        }
    }

    #[test]
    fn few_short_runs_share_a_thread_and_long_ones_or_those_of_unknown_length_do_not() {
        let pd = Scenario::built_in("pd_2").unwrap().unwrap();
        let with = |seconds: f64, key: &str, rows: i64| {
            let scenario = pd.changed(&[("run.duration_s".into(), Value::Float(seconds))]).unwrap();
            let rows = (1..=rows).map(|i| vec![Value::Integer(i)]).collect();
            Sweep::of("x", &scenario, vec![key.to_owned()], rows).unwrap()
        };
        for (seconds, rows, expected) in
            [(2.0, 1, 1), (2.0, 32, 1), (2.0, 33, 2), (20.0, 32, 8), (200.0, 2, 7)]
        {
            let s = with(seconds, "run.seed", rows);
            assert_eq!(s.worth(8, Keep::Figures), expected, "{rows} runs of {seconds} s");
            assert_eq!(s.worth(8, Keep::Trace), 8);
        }
        assert_eq!(with(2.0, "run.duration_s", 2).worth(8, Keep::Figures), 8);
        let bench = Scenario::built_in("bench_pd_2").unwrap().unwrap();
        let seeds = Sweep::of("x", &bench, vec!["run.seed".into()], vec![vec![Value::Integer(1)]]).unwrap();
        assert_eq!(seeds.worth(8, Keep::Figures), 8);
    }

    #[test]
    fn a_row_that_a_scenario_refuses_is_told_and_the_others_run() {
        let found = outcomes(&sweep(&[50.0, -1.0, 80.0]), 2);
        assert!(found[0].is_ok() && found[2].is_ok());
        assert_eq!(found[1].as_ref().unwrap_err().key, "law.pd.kp_v_rad");
    }

    #[test]
    fn a_row_with_two_mistakes_is_refused_by_the_same_one_whichever_row_came_first() {
        let pd = BUILT_IN.iter().find(|b| b.name == "pd_2").unwrap();
        let both = |duration: f64, kp: f64| vec![Value::Float(duration), Value::Float(kp)];
        let rows = [both(1.5, 50.0), both(1.5, -1.0), both(-1.0, 50.0), both(-1.0, -1.0)];
        for keys in [["run.duration_s", "law.pd.kp_v_rad"], ["law.pd.kp_v_rad", "run.duration_s"]] {
            let own = |row: &Vec<Value>| {
                let mut row = row.clone();
                if keys[0] != "run.duration_s" {
                    row.reverse();
                }
                row
            };
            let alone = |first: usize| {
                let order = [&rows[first], &rows[3]].map(own).to_vec();
                let s = Sweep::new("x", pd.toml.parse().unwrap(), keys.map(str::to_owned).to_vec(), order)
                    .unwrap();
                let _ = s.scenario(0);
                s.scenario(1).unwrap_err().to_string()
            };
            assert_eq!(alone(0), alone(3), "{keys:?}");
            assert_eq!(alone(1), alone(2), "{keys:?}");
            assert_eq!(alone(0), alone(1), "{keys:?}");
        }
    }

    #[test]
    fn a_stopped_sweep_tells_no_unfinished_row() {
        let (s, stop, told) = (sweep(&[80.0; 50]), AtomicBool::new(false), AtomicUsize::new(0));
        s.run(2, Keep::Figures, &stop, &|_, r| {
            r.unwrap();
            told.fetch_add(1, Ordering::SeqCst);
            stop.store(true, Ordering::SeqCst);
        });
        assert!((1..=2).contains(&told.load(Ordering::SeqCst)));
    }

    #[test]
    fn each_row_is_in_one_batch_and_few_rows_are_dealt_out_evenly() {
        for rows in (0..40).chain([255, 256, 257, 511, 512, 513, 1025, 4096]) {
            for threads in [0, 1, 2, 3, 7, 64, usize::MAX] {
                for keep in [Keep::Figures, Keep::Trace] {
                    let deal = Deal::of(rows, threads, keep);
                    let batches: Vec<Vec<usize>> =
                        (0..deal.batches).map(|b| deal.batch(b).collect()).collect();
                    let mut all = batches.concat();
                    all.sort_unstable();
                    assert!(all.into_iter().eq(0..rows), "{rows} rows, {threads} threads, {keep:?}");
                    let sizes = batches.iter().map(Vec::len);
                    assert!(sizes.clone().all(|n| (1..=BATCH).contains(&n)));
                    if keep == Keep::Figures && rows <= threads.max(1).saturating_mul(BATCH) {
                        let (least, most) = (sizes.clone().min().unwrap_or(0), sizes.max().unwrap_or(0));
                        assert!(most - least <= LANES, "{rows} rows, {threads} threads: {least} to {most}");
                    }
                }
            }
        }
    }

    #[test]
    fn rows_that_do_not_fit_the_keys_are_refused() {
        let bad = Sweep::new("x", Table::new(), vec!["run.seed".into()], vec![vec![]]).unwrap_err();
        assert_eq!(bad, Misfit { row: 0, values: 0, keys: 1 });
    }

    #[test]
    fn rows_in_lanes_and_rows_alone_are_told_once_each_and_are_what_they_are_alone() {
        let pd = BUILT_IN.iter().find(|b| b.name == "pd_2").unwrap();
        let keys =
            ["law.pd.kp_v_rad", "rig.torque_noise_nm", "run.duration_s", "run.seed"].map(str::to_owned);
        // More than a block; each fifth has noise, and goes alone; some last longer; one is refused.
        let row = |i: i64| {
            let kp = if i == 400 { -1.0 } else { 3000.0 + 5.0 * i as f64 };
            let (noise, length) = (if i % 5 == 0 { 1e-3 } else { 0.0 }, if i % 7 == 0 { 1.2 } else { 1.1 });
            vec![Value::Float(kp), Value::Float(noise), Value::Float(length), Value::Integer(i + 1)]
        };
        let rows: Vec<_> = (0..700).map(row).collect();
        let s = Sweep::new("pd_2", pd.toml.parse().unwrap(), keys.to_vec(), rows).unwrap();
        let told = Mutex::new(vec![0; s.len()]);
        for threads in [1, 2, 3] {
            let found = outcomes(&s, threads);
            for i in (0..s.len()).step_by(23).chain([399, 400, 401, 699]) {
                let alone = s.scenario(i).and_then(|row| Ok(row.run(Keep::Figures, UNWATCHED)?.metrics));
                assert_eq!(found[i], alone, "row {i}, {threads} threads");
            }
            s.run(threads, Keep::Figures, &AtomicBool::new(false), &|i, _| told.lock().unwrap()[i] += 1);
        }
        assert!(told.into_inner().unwrap().iter().all(|n| *n == 3));
    }
}
