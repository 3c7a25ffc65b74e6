//! Rig and law, stepped.

use crate::variables::{self as is, Part};
use clutch_core::law::{LawState, LawTerms};
use clutch_core::{Counts, Dac, FixedCounts, OnDisc, Planned, Real, Servo, ServoOutput, ServoState, Target};
use clutch_sim::engine::Motion;
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{MovingRig, Scenario};
use std::sync::Arc;

/// A simulator's time, a sum of many steps, may differ from ours by so many periods.
const SAME: f64 = 1e-3;
/// A rest of a step that is none, in periods: what rounding leaves.
const NOTHING: f64 = 1e-9;

/// A unit that has begun; a clone goes its own way.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one lives in each instance")]
pub(crate) enum Unit {
    Rig(RigUnit),
    Single(LawUnit<f32>),
    Double(LawUnit<f64>),
}

impl Unit {
    pub(crate) fn new(part: Part, scenario: Scenario) -> Result<Unit, String> {
        let scenario = Arc::new(scenario);
        match (part, scenario.scalar()) {
            (Part::Rig, _) => RigUnit::new(&scenario).map(Unit::Rig),
            (Part::Law, ScalarKind::F32) => LawUnit::new(&scenario).map(Unit::Single),
            (Part::Law, ScalarKind::F64) => LawUnit::new(&scenario).map(Unit::Double),
        }
    }

    /// From `now` on by `step`, s.
    pub(crate) fn step(&mut self, now: f64, step: f64) -> Result<(), String> {
        match self {
            Unit::Rig(rig) => rig.step(now, step),
            Unit::Single(law) => law.step(now, step),
            Unit::Double(law) => law.step(now, step),
        }
    }

    pub(crate) fn real(&self, reference: u32) -> f64 {
        match (self, reference) {
            (Unit::Rig(rig), is::VOLTAGE) => rig.volts,
            (Unit::Rig(rig), is::POSITION) => rig.moving.shaft().position,
            (Unit::Rig(rig), is::VELOCITY) => rig.moving.shaft().velocity,
            (Unit::Single(law), _) => law.real(reference),
            (Unit::Double(law), _) => law.real(reference),
            _ => f64::NAN,
        }
    }

    pub(crate) fn whole(&self, reference: u32) -> i32 {
        match (self, reference) {
            (Unit::Rig(rig), _) => rig.moving.counts().0,
            (Unit::Single(law), is::COUNTS) => law.counts,
            (Unit::Double(law), is::COUNTS) => law.counts,
            (Unit::Single(law), _) => law.last.code.0.into(),
            (Unit::Double(law), _) => law.last.code.0.into(),
        }
    }

    pub(crate) fn stuck(&self) -> bool {
        matches!(self, Unit::Rig(rig) if rig.moving.shaft().motion == Motion::Stuck)
    }

    /// The rig's input.
    pub(crate) fn set_real(&mut self, value: f64) -> Result<(), String> {
        if !value.is_finite() {
            return Err(format!("voltage_v = {value}: expected a finite voltage, V"));
        }
        if let Unit::Rig(rig) = self {
            rig.volts = value;
        }
        Ok(())
    }

    /// The law's input.
    pub(crate) fn set_whole(&mut self, value: i32) {
        match self {
            Unit::Rig(_) => {}
            Unit::Single(law) => law.counts = value,
            Unit::Double(law) => law.counts = value,
        }
    }
}

/// The rig in motion.
#[derive(Clone)]
pub(crate) struct RigUnit {
    moving: MovingRig,
    /// Sampling period, s: at the begin of each the converter takes the voltage.
    period: f64,
    /// Periods that are over.
    periods: u64,
    /// Time since the last of them, s.
    within: f64,
    rounds: bool,
    volts: f64,
}

impl RigUnit {
    fn new(scenario: &Scenario) -> Result<RigUnit, String> {
        let spec = scenario.spec();
        let begun = match scenario.scalar() {
            ScalarKind::F32 => spec.prepare::<f32>().map(|p| (p.moving, p.volts)),
            ScalarKind::F64 => spec.prepare::<f64>().map(|p| (p.moving, p.volts)),
        };
        let (mut moving, volts) = begun.map_err(|e| scenario.run_error(&e).to_string())?;
        moving.begin_period();
        let (period, rounds) = (spec.period.seconds(), spec.rig.dac.quantised);
        Ok(RigUnit { moving, period, periods: 0, within: 0.0, rounds, volts })
    }

    fn step(&mut self, now: f64, step: f64) -> Result<(), String> {
        let here = self.periods as f64 * self.period + self.within;
        if (now - here).abs() > SAME * self.period {
            return Err(format!("a step from {now} s: expected one from {here} s, where the last one ended"));
        }
        let end = here + step;
        while end - (self.periods as f64 * self.period + self.within) > NOTHING * self.period {
            if self.within == 0.0 {
                let dac: Dac<f64> = self.moving.rig().dac;
                let volts = if self.rounds { dac.volts(dac.code(self.volts)) } else { self.volts };
                self.moving.command(volts);
            }
            let begin = self.periods as f64 * self.period;
            let whole = end - begin > (1.0 - NOTHING) * self.period;
            let to = if whole { self.period } else { end - begin };
            self.moving.advance(to - self.within).map_err(|e| e.to_string())?;
            if whole {
                self.periods += 1;
                self.within = 0.0;
                self.moving.set_time(self.periods as f64 * self.period);
                self.moving.begin_period();
            } else {
                self.within = to;
            }
        }
        Ok(())
    }
}

/// The servo along its path.
#[derive(Clone)]
pub(crate) struct LawUnit<T: Real> {
    scenario: Arc<Scenario>,
    servo: Servo<T>,
    state: ServoState<T, LawState<T>>,
    period: f64,
    tick: u64,
    counts: i32,
    /// The voltage that goes out, V.
    volts: f64,
    rounds: bool,
    target: Target<T>,
    last: ServoOutput<T, LawTerms<T>>,
}

impl<T: Real> LawUnit<T> {
    fn new(scenario: &Arc<Scenario>) -> Result<Self, String> {
        let spec = scenario.spec();
        if !spec.rig.encoder.quantised {
            return Err(
                "rig.encoder.quantised = false: expected true, the unit's input is whole counts".to_owned()
            );
        }
        let params = spec.servo().map_err(|e| e.to_string())?.cast::<T>();
        let servo = Servo::<T>::new(&params).map_err(|e| e.to_string())?;
        let prepared = spec.prepare::<T>().map_err(|e| scenario.run_error(&e).to_string())?;
        Ok(LawUnit {
            state: prepared.servo_state(&servo),
            counts: prepared.moving.counts().0,
            volts: prepared.volts,
            target: prepared.reference.at(0),
            servo,
            period: spec.period.seconds(),
            tick: 0,
            rounds: spec.rig.dac.quantised,
            last: ServoOutput::default(),
            scenario: Arc::clone(scenario),
        })
    }

    fn step(&mut self, now: f64, step: f64) -> Result<(), String> {
        let here = self.tick as f64 * self.period;
        if (now - here).abs() > SAME * self.period {
            return Err(format!("a step from {now} s: expected one from {here} s, where the last one ended"));
        }
        if (step - self.period).abs() > SAME * self.period {
            return Err(format!("a step of {step} s: expected {} s, the sampling period", self.period));
        }
        // Planned anew: it borrows the scenario, and what is kept here is to be cloned.
        let spec = self.scenario.spec();
        let path = spec.path::<T>().map_err(|e| e.to_string())?;
        let planned = OnDisc { path: |tick| path.at(tick), map: spec.friction_map };
        self.target = planned.target(self.tick);
        let map = |position| Planned::<T>::place(&&planned, position);
        self.last = self.servo.tick_on(&mut self.state, Counts(self.counts), &self.target, map);
        let (code, demand) = (self.last.code, self.last.command.voltage.to_f64());
        self.volts = if self.rounds {
            Dac::<f64>::new(&spec.rig.dac.converter).map_err(|e| e.to_string())?.volts(code)
        } else {
            demand
        };
        self.tick += 1;
        Ok(())
    }

    fn real(&self, reference: u32) -> f64 {
        match reference {
            is::VOLTAGE => self.volts,
            is::TARGET_POSITION => {
                self.target.position.minus::<f64>(FixedCounts(0))
                    * self.servo.encoder().radians_per_count::<f64>()
            }
            is::TARGET_VELOCITY => self.target.velocity.to_f64(),
            is::ERROR => self.last.tick.error.to_f64(),
            _ => f64::NAN,
        }
    }
}
