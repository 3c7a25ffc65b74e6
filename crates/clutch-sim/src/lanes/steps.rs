//! Dormand and Prince's steps in lanes: what they cost most is friction along the disc, at six stages each.
//!
//! A step is done for as many motions as a vector has lanes, from any chunk of the block, and judged lane by lane, as
//! alone: each motion has its own steps, and ends when it ends.

use super::block::Chunk;
use super::group::{Candidate, Common};
use crate::drive::Drive;
use crate::engine::dormand_prince::{Course, Outcome, Push, Slip, Step, rounding};
use crate::engine::{DormandPrince, Engine, Event, EventKind, Input, Model, Motion, Shaft, Volts};
use crate::lane::{Lane, each};
use crate::ripple::Ripple;
use clutch_core::Plant;

/// Shafts that Dormand and Prince's steps move.
pub(super) struct InSteps<'a, V: Lane> {
    ripple: Option<Ripple<V>>,
    /// Time constants of the actuators' lag, s.
    time_constant: V,
    /// Voltage at the pads, V.
    pad: V,
    /// Lane by lane.
    alone: Vec<Alone<'a>>,
}

/// A shaft as one that moves alone.
struct Alone<'a> {
    model: &'a Model,
    drive: &'a Drive,
    engine: DormandPrince,
}

/// Drive of several shafts: a weight each, and a voltage that is held or lags.
#[derive(Clone, Copy)]
struct Steady<V> {
    drive: V,
    from: V,
    to: V,
    time_constant: V,
    lags: bool,
}

impl<V: Lane> Push<V> for Steady<V> {
    #[inline(always)]
    fn volts(&self, s: V) -> V {
        if self.lags {
            let x = -s / self.time_constant;
            let far = !x.abs().less(V::splat(700.0));
            let decayed = if V::any(far) { V::of(|i| libm::exp(x.lane(i))) } else { x.exp() };
            self.to + (self.from - self.to) * decayed
        } else {
            self.to
        }
    }
    #[inline(always)]
    fn drive(&self, _: V, _: V) -> V {
        self.drive
    }
}

/// A motion between two of its steps.
pub(super) struct OnTheWay<'a> {
    model: &'a Model,
    chunk: usize,
    lane: usize,
    course: Course,
    sign: f64,
    rounding: f64,
    /// Torque of the drive, and as the period begins with that of the actuator, N m.
    drive: f64,
    torque: f64,
    /// Voltage at the pad at the sample, and on its way there, V.
    volts: [f64; 2],
    time_constant: f64,
    inverse_inertia: f64,
    /// It has been stuck until now.
    breaks_away: bool,
}

impl OnTheWay<'_> {
    /// Its break-away.
    fn begins(&self, time: f64, position: f64) -> Event {
        Event { time, kind: EventKind::BreakAway, position, torque: self.torque }
    }
}

impl<'a, V: Lane> InSteps<'a, V> {
    /// The shafts as they begin.
    pub(super) fn of(rows: &[&'a Candidate<'a>]) -> Self {
        let discs: Option<Vec<&Ripple>> = rows.iter().map(|r| r.rig().model.ripple.as_ref()).collect();
        let lag = |r: &Candidate<'_>| r.rig().params.actuator_time_constant.unwrap_or(1.0);
        InSteps {
            ripple: discs.and_then(|discs| Ripple::in_lanes(&discs)),
            time_constant: V::of(|i| lag(rows[i])),
            pad: V::of(|i| rows[i].prepared.volts),
            alone: rows
                .iter()
                .map(|r| Alone {
                    model: &r.rig().model,
                    drive: &r.rig().drive,
                    engine: DormandPrince::default(),
                })
                .collect(),
        }
    }
}

impl<'a> Alone<'a> {
    /// The interval that begins at `time`, s.
    fn input(&self, time: f64, common: &Common, [from, to]: [f64; 2], time_constant: f64) -> Input<'a> {
        let volts = if common.lags { Volts::Lag { from, to, time_constant } } else { Volts::Held(to) };
        Input { time, duration: common.period, origin: 0.0, volts, drive: self.drive, noise: 0.0 }
    }
}

impl<'a, V: Lane> Chunk<'a, V> {
    /// The period begins: motions get their first step; a shaft that is stuck, and may stay so, does.
    #[inline(always)]
    pub(super) fn begin_steps(
        &mut self,
        n: usize,
        time: f64,
        common: &Common,
        steps: &mut Vec<OnTheWay<'a>>,
    ) {
        let (to, position, velocity, sign) = (self.arriving, self.position, self.velocity, self.sign);
        let (drive, lost) = (self.drive, self.lost);
        let plant = self.plant;
        let Some(own) = self.steps_mut() else { return };
        let push = Steady { drive, from: own.pad, to, time_constant: own.time_constant, lags: common.lags };
        let from = push.volts(V::ZERO);
        let torque = drive + plant.actuator().torque(from);
        let factor = match &own.ripple {
            Some(ripple) => ripple.at(position),
            None => V::ONE,
        };
        let holds = plant.break_away_torque(from) * factor;
        let moves = sign.less(V::ZERO) | V::ZERO.less(sign);
        let breaks_away = !moves & holds.less(torque.abs());
        // An actuator that lags may let go within the period, and one that turns round begins anew there.
        let turns = if common.lags { (own.pad * to).less(V::ZERO) } else { V::none() };
        let rests = !moves & !breaks_away;
        let stuck = rests & !turns;
        let sign = V::select(breaks_away, torque.sgn(), sign);
        let inverse_inertia = V::ONE / plant.params().inertia;
        let rounding = rounding(torque.abs() + holds, inverse_inertia);
        let slip = Slip { plant: &plant, ripple: None, push, sign, inverse_inertia, share: 1.0, rounding };
        let rate = slip.rate_at(V::ZERO, [position, velocity], factor);
        let alone = V::bits(turns | if common.lags { stuck } else { V::none() }) & !lost;
        let begins = V::bits(breaks_away);
        each(!V::bits(rests | turns) & !lost, |i| {
            let state = [position.lane(i), velocity.lane(i)];
            let course =
                own.alone[i].engine.course(0.0, common.period, state, [rate[0].lane(i), rate[1].lane(i)]);
            steps.push(OnTheWay {
                model: own.alone[i].model,
                chunk: n,
                lane: i,
                course,
                sign: sign.lane(i),
                rounding: rounding.lane(i),
                drive: drive.lane(i),
                torque: torque.lane(i),
                volts: [push.from.lane(i), to.lane(i)],
                time_constant: push.time_constant.lane(i),
                inverse_inertia: inverse_inertia.lane(i),
                breaks_away: begins >> i & 1 == 1,
            });
        });
        each(V::bits(stuck) & !alone & !lost, |i| self.sticks[i].period(time, true, &[]));
        self.whole_periods(alone, time, common, &push);
        let pad = push.volts(V::splat(common.period));
        if let Some(own) = self.steps_mut() {
            own.pad = pad;
        }
    }

    /// Periods that lanes do alone.
    #[inline(never)]
    fn whole_periods(&mut self, lanes: u64, time: f64, common: &Common, push: &Steady<V>) {
        let mut events = Vec::new();
        each(lanes, |i| {
            let motion = match self.sign.lane(i) {
                0.0 => Motion::Stuck,
                sign => Motion::along(sign),
            };
            let mut shaft = Shaft { motion, ..Shaft::new(self.position.lane(i), self.velocity.lane(i)) };
            let volts = [push.from.lane(i), push.to.lane(i)];
            events.clear();
            let Some(own) = self.steps_mut() else { return };
            let alone = &mut own.alone[i];
            let input = alone.input(time, common, volts, push.time_constant.lane(i));
            let moved = alone.engine.advance(alone.model, &input, &mut shaft, &mut events);
            let was = motion == Motion::Stuck;
            self.ended(i, moved.is_ok().then_some(&shaft), time, was, &events);
        });
    }

    /// A motion has come to its end.
    #[inline(always)]
    fn arrives(&mut self, m: &OnTheWay<'_>, time: f64) {
        if m.breaks_away {
            let begins = m.begins(time, self.position.lane(m.lane));
            self.sticks[m.lane].period(time, true, &[begins]);
            self.sign.put(m.lane, m.sign);
        }
        self.position.put(m.lane, m.course.state[0]);
        self.velocity.put(m.lane, m.course.state[1]);
    }

    /// A motion whose next step would stop: it goes on alone.
    #[inline(never)]
    fn stops(&mut self, m: &OnTheWay<'_>, time: f64, common: &Common, events: &mut Vec<Event>) {
        events.clear();
        if m.breaks_away {
            events.push(m.begins(time, self.position.lane(m.lane)));
        }
        let [position, velocity] = m.course.state;
        let mut shaft = Shaft { motion: Motion::along(m.sign), ..Shaft::new(position, velocity) };
        let Some(own) = self.steps_mut() else { return };
        let alone = &mut own.alone[m.lane];
        let input = alone.input(time, common, m.volts, m.time_constant);
        let begun = Some((m.course, m.rounding));
        let moved = alone.engine.follow(alone.model, &input, &mut shaft, events, begun);
        self.ended(m.lane, moved.is_ok().then_some(&shaft), time, m.breaks_away, events);
    }
}

/// Numbers of the motions of one vector: of each of them, or of all.
pub(super) struct Gathered<V: Lane> {
    plant: Plant<V>,
    ripple: Option<Ripple<V>>,
    /// Plants differ from run to run, and discs.
    differ: (bool, bool),
}

impl<V: Lane> Gathered<V> {
    /// For the runs of a block; none if they move otherwise.
    pub(super) fn of(chunks: &[Chunk<'_, V>]) -> Option<Self> {
        let first = chunks.first()?;
        let own = first.steps()?;
        let model = own.alone.first()?.model;
        let differ = |same: fn(&Model, &Model) -> bool| {
            let all = chunks.iter().filter_map(|chunk| chunk.steps()).flat_map(|own| &own.alone);
            all.into_iter().any(|alone| !same(alone.model, model))
        };
        Some(Gathered {
            plant: first.plant,
            ripple: own.ripple.clone(),
            differ: (differ(|a, b| a.plant == b.plant), differ(|a, b| a.ripple == b.ripple)),
        })
    }

    /// Takes what so many motions have of their own.
    #[inline(always)]
    fn take(&mut self, some: &[OnTheWay<'_>]) {
        let model = |i: usize| some[i.min(some.len() - 1)].model;
        if let Some(ripple) = &mut self.ripple
            && self.differ.1
        {
            ripple.take(|i| model(i).ripple.as_ref());
        }
        if self.differ.0 {
            let of = |get: &dyn Fn(&Plant<f64>) -> f64| V::of(|i| get(&model(i).plant));
            self.plant = Plant::in_lanes(&of).unwrap_or(self.plant);
        }
    }
}

/// The motions, step by step, as many at once as there are lanes.
#[inline(always)]
pub(super) fn step_by_step<V: Lane>(
    chunks: &mut [Chunk<'_, V>],
    all: &mut Gathered<V>,
    moving: &mut Vec<OnTheWay<'_>>,
    time: f64,
    common: &Common,
    events: &mut Vec<Event>,
) {
    while !moving.is_empty() {
        let mut left = 0;
        for first in (0..moving.len()).step_by(V::WIDTH) {
            let some = first..(first + V::WIDTH).min(moving.len());
            all.take(&moving[some.clone()]);
            let step = one_step(all, &moving[some.clone()], common);
            for (i, at) in some.enumerate() {
                let m = &mut moving[at];
                let chunk = &mut chunks[m.chunk];
                let step = Step {
                    to: [step.to[0].lane(i), step.to[1].lane(i)],
                    error: step.error.lane(i),
                    rate: [step.rate[0].lane(i), step.rate[1].lane(i)],
                };
                let Some(own) = chunk.steps_mut() else { continue };
                let engine = &mut own.alone[m.lane].engine;
                let before = m.course;
                match engine.judge(&mut m.course, &step, m.sign, (time, common.period)) {
                    Ok(Outcome::On) if m.course.s < common.period => {
                        moving.swap(left, at);
                        left += 1;
                    }
                    Ok(Outcome::On) => chunk.arrives(m, time),
                    Ok(Outcome::Stops) => {
                        // Its last step is done again by who goes on.
                        m.course = before;
                        chunk.stops(m, time, common, events);
                    }
                    Err(_) => chunk.lost |= 1 << m.lane,
                }
            }
        }
        moving.truncate(left);
    }
}

/// A step of so many motions.
#[inline(always)]
fn one_step<V: Lane>(all: &Gathered<V>, some: &[OnTheWay<'_>], common: &Common) -> Step<V> {
    let at = |i: usize| &some[i.min(some.len() - 1)];
    let of = |get: fn(&OnTheWay<'_>) -> f64| V::of(|i| get(at(i)));
    let lengths = V::of(|i| at(i).course.next(common.period).0);
    let slip = Slip {
        plant: &all.plant,
        ripple: all.ripple.as_ref(),
        push: Steady {
            drive: of(|m| m.drive),
            from: of(|m| m.volts[0]),
            to: of(|m| m.volts[1]),
            time_constant: of(|m| m.time_constant),
            lags: common.lags,
        },
        sign: of(|m| m.sign),
        inverse_inertia: of(|m| m.inverse_inertia),
        share: 1.0,
        rounding: of(|m| m.rounding),
    };
    V::apart(
        #[inline(always)]
        || {
            slip.step(
                of(|m| m.course.s),
                lengths,
                [of(|m| m.course.state[0]), of(|m| m.course.state[1])],
                [of(|m| m.course.rate[0]), of(|m| m.course.rate[1])],
            )
        },
    )
}
