//! A shaft of a fleet: its beginning, its law, and its motion where lanes have no place for it.

use crate::engine::{EngineError, EngineKind, EventKind, Motion};
use crate::friction_map::MapGrid;
use crate::moving_rig::MovingRig;
use crate::run::{RunError, RunSpec};
use crate::scenario::{ScalarKind, Scenario};
use clutch_core::law::LawState;
use clutch_core::{Counts, Dac, FixedCounts, ParamError, Real, Servo, ServoState, Target, off_map};
use std::sync::Arc;

/// The answer of a law to a sample.
#[derive(Clone, Copy, Default)]
pub(super) struct Answer {
    /// Error as the law saw it, rad, and its rate, rad/s.
    pub(super) error: f64,
    pub(super) error_rate: f64,
    /// Voltage as the converter would give it, V.
    pub(super) volts: f64,
}

/// A law beside a shaft, in whichever scalar.
trait Answers: Send + Sync {
    /// Counts of the encoder, as fractions where it is ideal.
    fn answer(&mut self, counts: f64, target: &Target<f64>) -> Answer;
    /// A copy in the same state.
    fn copy(&self) -> Box<dyn Answers>;
}

/// A law in a scalar.
#[derive(Clone)]
struct Beside<T: Real> {
    servo: Servo<T>,
    state: ServoState<T, LawState<T>>,
    map: Option<Arc<MapGrid>>,
    whole_counts: bool,
    /// The converter; none if it rounds nothing.
    dac: Option<Dac<f64>>,
}

impl<T: Real> Answers for Beside<T> {
    fn answer(&mut self, counts: f64, target: &Target<f64>) -> Answer {
        let (target, map) = (target.cast(), self.map.as_ref().and_then(|grid| grid.map()));
        let place = |position| map.map_or_else(|| off_map(position), |map| map.at(position));
        let out = if self.whole_counts {
            self.servo.tick_on(&mut self.state, Counts(counts as i64 as i32), &target, place)
        } else {
            self.servo.tick_at(&mut self.state, FixedCounts::from_real(counts), &target, place)
        };
        let volts = self.dac.map_or_else(|| out.command.voltage.to_f64(), |dac| dac.volts(out.code));
        Answer { error: out.tick.error.to_f64(), error_rate: out.tick.error_rate.to_f64(), volts }
    }

    fn copy(&self) -> Box<dyn Answers> {
        Box::new(self.clone())
    }
}

/// A shaft as it begins.
pub(crate) struct Begun {
    pub(crate) moving: MovingRig,
    /// Voltage at the pad, V.
    pub(crate) volts: f64,
    pub(super) engine: EngineKind,
    /// Position of shaft and path.
    start: FixedCounts,
    law: Box<dyn Answers>,
}

impl Begun {
    /// A shaft of a scenario, with a seed of its own.
    ///
    /// # Errors
    /// A seed out of range, an engine that cannot take the rig.
    pub(super) fn new(scenario: &Scenario, seed: u64) -> Result<Self, RunError> {
        let mut spec = scenario.spec();
        spec.run.seed = seed;
        match scenario.scalar() {
            ScalarKind::F32 => Self::in_scalar::<f32>(scenario, &spec),
            ScalarKind::F64 => Self::in_scalar::<f64>(scenario, &spec),
        }
    }

    fn in_scalar<T: Real>(scenario: &Scenario, spec: &RunSpec<'_>) -> Result<Self, RunError> {
        let servo = Servo::<T>::new(&spec.servo()?.cast()).map_err(|e| e.cast())?;
        let prepared = spec.prepare::<T>()?;
        let rig = prepared.moving.rig();
        let law = Beside {
            state: prepared.servo_state(&servo),
            servo,
            map: scenario.map_grid().cloned(),
            whole_counts: rig.params.encoder.quantised,
            dac: rig.params.dac.quantised.then_some(rig.dac),
        };
        Ok(Begun {
            volts: prepared.volts,
            engine: prepared.engine,
            start: spec.run.start_position(),
            law: Box::new(law),
            moving: prepared.moving,
        })
    }

    /// A target of the path, of which `from_0` is the one that it would have from 0.
    pub(crate) fn target(&self, from_0: &Target<f64>) -> Target<f64> {
        Target { position: from_0.position.plus(self.start), ..*from_0 }
    }
}

/// The path of a scenario as it would be from 0, target by target, put into `targets`.
pub(super) fn path_from_0(scenario: &Scenario, targets: &mut Vec<Target<f64>>) -> Result<(), ParamError> {
    let spec = scenario.spec();
    let from_0 = |target: Target<f64>| Target {
        position: FixedCounts(target.position.0.wrapping_sub(spec.run.start_position().0)),
        ..target
    };
    let ticks = 0..scenario.ticks();
    match scenario.scalar() {
        ScalarKind::F32 => {
            let path = spec.path::<f32>()?;
            targets.extend(ticks.map(|k| from_0(path.at(k).cast())));
        }
        ScalarKind::F64 => {
            let path = spec.path::<f64>()?;
            targets.extend(ticks.map(|k| from_0(path.at(k))));
        }
    }
    Ok(())
}

/// A shaft that moves alone.
pub(super) struct Alone {
    moving: MovingRig,
    period: f64,
    ticks: u64,
    pub(super) sticks: u64,
}

impl Alone {
    pub(super) fn of(begun: &Begun, period: f64) -> Self {
        let mut moving = begun.moving.clone();
        moving.begin_period();
        Alone { moving, period, ticks: 0, sticks: 0 }
    }

    /// A period under a voltage that the converter gives, V.
    pub(super) fn step(&mut self, volts: f64) -> Result<(), EngineError> {
        self.moving.command(volts);
        let seen = self.moving.advance(self.period)?;
        self.sticks += seen.iter().filter(|e| e.kind == EventKind::Stick).count() as u64;
        self.ticks += 1;
        self.moving.set_time(self.ticks as f64 * self.period);
        self.moving.begin_period();
        Ok(())
    }

    /// Position, rad, velocity, rad/s, counts, and 1 at rest.
    pub(super) fn told(&self) -> [f64; 4] {
        let shaft = self.moving.shaft();
        let at_rest = f64::from(u8::from(shaft.motion == Motion::Stuck));
        [shaft.position, shaft.velocity, self.counts(), at_rest]
    }

    /// Counts of the encoder, as fractions where it is ideal.
    fn counts(&self) -> f64 {
        if self.moving.rig().params.encoder.quantised {
            f64::from(self.moving.counts().0)
        } else {
            self.moving.fine_counts().minus(FixedCounts(0))
        }
    }
}

/// A shaft of a fleet.
pub(super) struct Shaft {
    pub(super) begun: Begun,
    /// It begins anew with the next period, so.
    pub(super) next: Option<Begun>,
    law: Box<dyn Answers>,
    pub(super) ticks: usize,
    /// Voltage commanded last, V.
    pub(super) volts: f64,
    /// Voltages commanded since it began, V, while it moves in lanes.
    past: Vec<f64>,
    /// Its motion, where it moves alone.
    pub(super) alone: Option<Alone>,
    /// A motion that no engine can follow: it stays where it is.
    pub(super) broken: Option<EngineError>,
    /// The last answer of its law, where that answers alone.
    pub(super) answer: Answer,
}

impl Shaft {
    pub(super) fn of(begun: Begun) -> Self {
        Shaft {
            law: begun.law.copy(),
            volts: begun.volts,
            begun,
            next: None,
            ticks: 0,
            past: Vec::new(),
            alone: None,
            broken: None,
            answer: Answer::default(),
        }
    }

    /// A period passes, in lanes or alone.
    pub(super) fn step(&mut self, volts: f64) {
        if self.broken.is_some() {
            return;
        }
        match &mut self.alone {
            None => self.past.push(volts),
            Some(alone) => {
                if let Err(e) = alone.step(volts) {
                    self.broken = Some(e);
                    return;
                }
            }
        }
        (self.ticks, self.volts) = (self.ticks + 1, volts);
    }

    /// Lanes have lost it: what it did there it does again alone, with its law if that was in lanes, too.
    pub(super) fn goes_alone(&mut self, period: f64, targets: &[Target<f64>], with_law: bool) {
        self.alone = Some(Alone::of(&self.begun, period));
        (self.ticks, self.volts) = (0, self.begun.volts);
        for volts in std::mem::take(&mut self.past) {
            if with_law {
                self.sees(targets);
            }
            self.step(volts);
        }
    }

    /// The target of its path now; behind the end the last one.
    pub(super) fn target(&self, targets: &[Target<f64>]) -> Target<f64> {
        let from_0 = targets.get(self.ticks).or(targets.last());
        self.begun.target(from_0.unwrap_or(&Target::default()))
    }

    /// Its law sees the sample of a shaft that moves alone.
    fn sees(&mut self, targets: &[Target<f64>]) {
        if let Some(counts) = self.alone.as_ref().map(Alone::counts) {
            self.answers(counts, &self.target(targets));
        }
    }

    /// Its law sees counts and target.
    pub(super) fn answers(&mut self, counts: f64, target: &Target<f64>) {
        if self.broken.is_none() {
            self.answer = self.law.answer(counts, target);
        }
    }
}
