//! Shafts of one scenario, each under voltages that an agent of its own gives, period by period.
//!
//! Beside each shaft the scenario's law sees each sample, too, and says what it would answer. Shafts, and laws where they
//! can, run in the lanes of vectors; each has the bits that it has alone. A shaft that leaves what lanes can do does again
//! alone what it did there, and goes on so.

mod shaft;
#[cfg(test)]
mod tests;
mod told;

pub(crate) use shaft::Begun;
pub(crate) use told::{Quantity, Told};

use crate::engine::EngineError;
use crate::lane::MOST_LANES;
use crate::lanes::fleet::{Gathered, Together};
use crate::pool;
use crate::run::room;
use crate::scenario::Scenario;
use crate::scenario_error::ScenarioError;
use clutch_core::{FixedCounts, Target};
use fearless_simd::Level;
use rayon::prelude::*;
use shaft::{Alone, Shaft, path_from_0};
use std::sync::Arc;
use told::QUANTITIES;

/// Shafts below which lanes would stay empty: they are faster alone.
const FEWEST: usize = 3;
/// Shafts of a thread, at least: it takes microseconds to wake up, and so do their periods.
const TOGETHER: usize = 32;
/// Shafts of a block, at most: few enough for a core's own memory.
const BLOCK: usize = 256;

/// Shafts that are stepped together.
///
/// ```
/// use clutch_sim::{Fleet, Scenario, scenario::BUILT_IN};
/// let smc = BUILT_IN.iter().find(|built_in| built_in.name == "smc_2").expect("it is built in");
/// let mut fleet = Fleet::new(&Scenario::parse(smc.name, smc.toml, &[])?, &[1, 2, 3, 4])?;
/// let mut law = Vec::new();
/// fleet.tell(12, &mut law); // law_voltage_v
/// fleet.step(&law)?;
/// let mut time = Vec::new();
/// fleet.tell(0, &mut time); // time_s
/// assert_eq!(time, [1e-3; 4]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Fleet {
    scenario: Scenario,
    blocks: Vec<Block>,
    /// Shafts of each block but the last.
    together: usize,
}

impl Fleet {
    /// Names of the quantities that are reported of a shaft at a sample, with units: `sticks` so far, `stuck` is 1 at rest,
    /// `voltage_v` was commanded last, `law_voltage_v` is what the scenario's law answers.
    pub const QUANTITIES: [&'static str; 13] = QUANTITIES;

    /// A shaft for each seed, which it has for its `run.seed`.
    ///
    /// # Errors
    /// A seed out of range, an engine that cannot take the rig, no memory for the path.
    pub fn new(scenario: &Scenario, seeds: &[u64]) -> Result<Fleet, ScenarioError> {
        Self::by(Some(Level::new()), scenario, seeds)
    }

    /// The same by the instructions of a level, or alone.
    fn by(level: Option<Level>, scenario: &Scenario, seeds: &[u64]) -> Result<Fleet, ScenarioError> {
        let wrong = |e| scenario.run_error(&e);
        let mut targets = room(scenario.ticks()).map_err(wrong)?;
        path_from_0(scenario, &mut targets).map_err(|e| wrong(e.into()))?;
        let targets = Arc::new(targets);
        let begun = seeds.iter().map(|seed| Begun::new(scenario, *seed).map_err(wrong));
        let mut begun = begun.collect::<Result<Vec<_>, _>>()?.into_iter();
        let of_a_thread = seeds.len().div_ceil(pool::threads());
        let together = of_a_thread.next_multiple_of(MOST_LANES).clamp(TOGETHER, BLOCK);
        let mut blocks = Vec::new();
        while begun.len() > 0 {
            let some = begun.by_ref().take(together).collect();
            blocks.push(Block::of(level, scenario, some, &targets));
        }
        Ok(Fleet { scenario: scenario.clone(), blocks, together })
    }

    /// The number of shafts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|block| block.shafts.len()).sum()
    }

    /// No shafts at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// A shaft begins anew with the next step, which does not move it.
    ///
    /// # Errors
    /// As of [`Fleet::new`].
    ///
    /// # Panics
    /// There is no such shaft.
    pub fn reset(&mut self, shaft: usize, seed: u64) -> Result<(), ScenarioError> {
        let begun = Begun::new(&self.scenario, seed).map_err(|e| self.scenario.run_error(&e))?;
        self.blocks[shaft / self.together].shafts[shaft % self.together].next = Some(begun);
        Ok(())
    }

    /// A sampling period: each shaft moves under its voltage, V, which the converter rounds. On all processors.
    ///
    /// # Errors
    /// A motion that the engine cannot follow. Its shaft stays where it is, and each step reports it, until it is reset;
    /// the others go on.
    ///
    /// # Panics
    /// There is not one voltage for each shaft.
    pub fn step(&mut self, volts: &[f64]) -> Result<(), EngineError> {
        assert_eq!(volts.len(), self.len(), "a voltage for each shaft");
        match &mut self.blocks[..] {
            [block] => block.step(volts),
            blocks => {
                let together = self.together;
                pool::install(|| {
                    let each = blocks.par_iter_mut().zip(volts.par_chunks(together));
                    each.for_each(|(block, volts)| block.step(volts));
                });
            }
        }
        self.blocks.iter().find_map(|block| block.broken()).map_or(Ok(()), Err)
    }

    /// Appends the numbers that a quantity, by its place in [`Fleet::QUANTITIES`], has now: one for each shaft.
    ///
    /// # Panics
    /// There is no such quantity.
    pub fn tell(&self, quantity: usize, numbers: &mut Vec<f64>) {
        for Block { told, .. } in &self.blocks {
            numbers.extend_from_slice(&told.numbers[quantity * told.shafts..][..told.shafts]);
        }
    }
}

/// Shafts of one thread.
struct Block {
    /// Those that move in lanes; none if all move alone.
    lanes: Option<Box<dyn Together>>,
    /// Laws answer in lanes.
    laws: bool,
    shafts: Vec<Shaft>,
    period: f64,
    targets: Arc<Vec<Target<f64>>>,
    told: Told,
    /// Voltages of the converters, V, and the targets now.
    volts: Vec<f64>,
    aims: Vec<Target<f64>>,
}

impl Block {
    fn of(
        level: Option<Level>,
        scenario: &Scenario,
        begun: Vec<Begun>,
        targets: &Arc<Vec<Target<f64>>>,
    ) -> Self {
        let spec = scenario.spec();
        let period = spec.period.seconds();
        let gathered = if begun.len() < FEWEST { None } else { level }
            .and_then(|level| Gathered::of(&spec, scenario.scalar(), begun[0].engine, &begun)?.at(level));
        let (lanes, laws) = gathered.unzip();
        let mut block = Block {
            laws: laws.unwrap_or(false),
            told: Told::new(begun.len()),
            shafts: begun.into_iter().map(Shaft::of).collect(),
            period,
            targets: targets.clone(),
            volts: Vec::new(),
            aims: Vec::new(),
            lanes,
        };
        for i in 0..block.shafts.len() {
            block.begins(i);
        }
        block.look();
        block
    }

    /// A shaft is at its beginning.
    fn begins(&mut self, i: usize) {
        let shaft = &mut self.shafts[i];
        match &mut self.lanes {
            Some(lanes) => lanes.begin(i, &shaft.begun, &shaft.target(&self.targets)),
            None => shaft.alone = Some(Alone::of(&shaft.begun, self.period)),
        }
    }

    fn step(&mut self, volts: &[f64]) {
        self.volts.clear();
        self.volts.extend(volts.iter().zip(&self.shafts).map(|(volts, shaft)| {
            let rig = shaft.begun.moving.rig();
            if rig.params.dac.quantised { rig.dac.volts(rig.dac.code(*volts)) } else { *volts }
        }));
        if let Some(lanes) = &mut self.lanes {
            lanes.advance(&self.volts);
        }
        for i in 0..self.shafts.len() {
            let shaft = &mut self.shafts[i];
            if let Some(next) = shaft.next.take() {
                *shaft = Shaft::of(next);
                self.begins(i);
            } else {
                shaft.step(self.volts[i]);
            }
        }
        self.look();
    }

    /// Each shaft is at a sample, which its law sees.
    fn look(&mut self) {
        let Block { lanes, laws, shafts, period, targets, told, aims, .. } = self;
        aims.clear();
        aims.extend(shafts.iter().map(|shaft| shaft.target(targets)));
        if let Some(lanes) = lanes {
            lanes.look(aims, told);
        }
        for (i, shaft) in shafts.iter_mut().enumerate() {
            let lost = lanes.as_ref().is_some_and(|lanes| lanes.lost(i));
            if lost && shaft.alone.is_none() {
                shaft.goes_alone(*period, targets, *laws);
                aims[i] = shaft.target(targets);
            }
            let sticks = match (&shaft.alone, lanes.as_ref()) {
                (Some(alone), _) => {
                    let moved = [Quantity::Position, Quantity::Velocity, Quantity::Counts, Quantity::Stuck];
                    moved.iter().zip(alone.told()).for_each(|(of, number)| *told.at(*of, i) = number);
                    alone.sticks
                }
                (None, lanes) => lanes.map_or(0, |lanes| lanes.sticks(i)),
            };
            *told.at(Quantity::Time, i) = shaft.ticks as f64 * *period;
            *told.at(Quantity::Sticks, i) = sticks as f64;
            *told.at(Quantity::Voltage, i) = shaft.volts;
            *told.at(Quantity::TargetCounts, i) = aims[i].position.minus(FixedCounts(0));
            *told.at(Quantity::TargetVelocity, i) = aims[i].velocity;
            *told.at(Quantity::TargetAcceleration, i) = aims[i].acceleration;
            if !*laws || shaft.alone.is_some() {
                shaft.answers(*told.at(Quantity::Counts, i), &aims[i]);
                *told.at(Quantity::MeasuredError, i) = shaft.answer.error;
                *told.at(Quantity::ErrorRate, i) = shaft.answer.error_rate;
                *told.at(Quantity::LawVoltage, i) = shaft.answer.volts;
            }
        }
    }

    /// The motion that could not be followed, if there is one.
    fn broken(&self) -> Option<EngineError> {
        self.shafts.iter().find_map(|shaft| shaft.broken)
    }
}
