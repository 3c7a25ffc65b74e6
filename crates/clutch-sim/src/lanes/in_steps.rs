//! The memory of Dormand and Prince's steps: of shafts in lanes, and of a motion between two of its steps.

use super::alike::{Alike, Begin};
use crate::drive::Drive;
use crate::engine::dormand_prince::Course;
use crate::engine::{DormandPrince, Engine, Event, EventKind, Input, Model, Shaft, Volts};
use crate::lane::Lane;
use crate::rig::Rig;
use crate::ripple::Ripple;

/// Shafts that Dormand and Prince's steps move.
pub(super) struct InSteps<V: Lane> {
    pub(super) ripple: Option<Ripple<V>>,
    /// Time constants of the actuators' lag, s.
    pub(super) time_constant: V,
    /// Voltage at the pads, V.
    pub(super) pad: V,
    /// Lane by lane.
    pub(super) alone: Vec<Alone>,
}

/// A shaft as one that moves alone.
pub(super) struct Alone {
    pub(super) model: Model,
    pub(super) drive: Drive,
    pub(super) engine: DormandPrince,
}

/// A motion between two of its steps.
pub(super) struct OnTheWay {
    /// Place of its vector.
    pub(super) shafts: usize,
    pub(super) lane: usize,
    pub(super) course: Course,
    pub(super) sign: f64,
    pub(super) rounding: f64,
    /// Torque of the drive, and as the period begins with that of the actuator, N m.
    pub(super) drive: f64,
    pub(super) torque: f64,
    /// Voltage at the pad at the sample, and on its way there, V.
    pub(super) volts: [f64; 2],
    pub(super) time_constant: f64,
    pub(super) inverse_inertia: f64,
    /// It has been stuck until now.
    pub(super) breaks_away: bool,
}

impl OnTheWay {
    /// Its break-away.
    pub(super) fn begins(&self, time: f64, position: f64) -> Event {
        Event { time, kind: EventKind::BreakAway, position, torque: self.torque }
    }
}

impl<V: Lane> InSteps<V> {
    /// The shafts of rigs as they begin, one for each lane.
    pub(super) fn of(rigs: &[Begin<'_>]) -> Self {
        let alone: Vec<Alone> = rigs.iter().map(|(moving, _)| Alone::of(moving.rig())).collect();
        let discs: Option<Vec<&Ripple>> = alone.iter().map(|a| a.model.ripple.as_ref()).collect();
        let lag = |i: usize| rigs[i].0.rig().params.actuator_time_constant.unwrap_or(1.0);
        InSteps {
            ripple: discs.and_then(|discs| Ripple::in_lanes(&discs)),
            time_constant: V::of(lag),
            pad: V::of(|i| rigs[i].1),
            alone,
        }
    }

    /// A lane begins anew, with a rig of the same scenario.
    pub(super) fn begin_anew(&mut self, lane: usize, (moving, volts): Begin<'_>) {
        self.pad.put(lane, volts);
        self.alone[lane] = Alone::of(moving.rig());
        if let Some(ripple) = &mut self.ripple {
            ripple.take(|i| self.alone[i].model.ripple.as_ref());
        }
    }
}

impl Alone {
    fn of(rig: &Rig) -> Self {
        let Rig { model, drive, .. } = rig;
        Alone { model: model.clone(), drive: drive.clone(), engine: DormandPrince::default() }
    }

    /// Its engine moves it through the interval that begins at `time`, s.
    pub(super) fn moves(
        &mut self,
        time: f64,
        alike: &Alike,
        ([from, to], time_constant): ([f64; 2], f64),
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
        begun: Option<(Course, f64)>,
    ) -> bool {
        let volts = if alike.lags { Volts::Lag { from, to, time_constant } } else { Volts::Held(to) };
        let Alone { model, drive, engine } = self;
        let input = Input { time, duration: alike.period, origin: 0.0, volts, drive, noise: 0.0 };
        match begun {
            Some(_) => engine.follow(model, &input, shaft, events, begun),
            None => engine.advance(model, &input, shaft, events),
        }
        .is_ok()
    }
}
