//! Dormand and Prince's steps in lanes: what they cost most is friction along the disc, at six stages each.
//!
//! A step is done for as many motions as a vector has lanes, from any vector of the block, and judged lane by lane, as
//! alone: each motion has its own steps, and ends when it ends.

use super::alike::Alike;
use super::in_steps::OnTheWay;
use super::shafts::Shafts;
use crate::engine::dormand_prince::{Outcome, Push, Slip, Step, rounding};
use crate::engine::{Event, Model, Motion, Shaft};
use crate::lane::{Lane, each};
use crate::ripple::Ripple;
use clutch_core::Plant;

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

impl<V: Lane> Shafts<V> {
    /// The period begins: motions get their first step; a shaft that is stuck, and may stay so, does.
    #[inline(always)]
    pub(super) fn begin_steps(&mut self, n: usize, time: f64, alike: &Alike, steps: &mut Vec<OnTheWay>) {
        let (to, position, velocity, sign) = (self.arriving, self.position, self.velocity, self.sign);
        let (drive, lost) = (self.drive, self.lost);
        let plant = self.plant;
        let Some(own) = self.steps_mut() else { return };
        let push = Steady { drive, from: own.pad, to, time_constant: own.time_constant, lags: alike.lags };
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
        let turns = if alike.lags { (own.pad * to).less(V::ZERO) } else { V::none() };
        let rests = !moves & !breaks_away;
        let stuck = rests & !turns;
        let sign = V::select(breaks_away, torque.sgn(), sign);
        let inverse_inertia = V::ONE / plant.params().inertia;
        let rounding = rounding(torque.abs() + holds, inverse_inertia);
        let slip = Slip { plant: &plant, ripple: None, push, sign, inverse_inertia, share: 1.0, rounding };
        let rate = slip.rate_at(V::ZERO, [position, velocity], factor);
        let alone = V::bits(turns | if alike.lags { stuck } else { V::none() }) & !lost;
        let begins = V::bits(breaks_away);
        each(!V::bits(rests | turns) & !lost, |i| {
            let state = [position.lane(i), velocity.lane(i)];
            let course =
                own.alone[i].engine.course(0.0, alike.period, state, [rate[0].lane(i), rate[1].lane(i)]);
            steps.push(OnTheWay {
                shafts: n,
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
        self.whole_periods(alone, time, alike, &push);
        let pad = push.volts(V::splat(alike.period));
        if let Some(own) = self.steps_mut() {
            own.pad = pad;
        }
    }

    /// Periods that lanes do alone.
    #[inline(never)]
    fn whole_periods(&mut self, lanes: u64, time: f64, alike: &Alike, push: &Steady<V>) {
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
            let volts = (volts, push.time_constant.lane(i));
            let moved = own.alone[i].moves(time, alike, volts, &mut shaft, &mut events, None);
            let was = motion == Motion::Stuck;
            self.ended(i, moved.then_some(&shaft), time, was, &events);
        });
    }

    /// A motion has come to its end.
    #[inline(always)]
    fn arrives(&mut self, m: &OnTheWay, time: f64) {
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
    fn stops(&mut self, m: &OnTheWay, time: f64, alike: &Alike, events: &mut Vec<Event>) {
        events.clear();
        if m.breaks_away {
            events.push(m.begins(time, self.position.lane(m.lane)));
        }
        let [position, velocity] = m.course.state;
        let mut shaft = Shaft { motion: Motion::along(m.sign), ..Shaft::new(position, velocity) };
        let Some(own) = self.steps_mut() else { return };
        let begun = Some((m.course, m.rounding));
        let volts = (m.volts, m.time_constant);
        let moved = own.alone[m.lane].moves(time, alike, volts, &mut shaft, events, begun);
        self.ended(m.lane, moved.then_some(&shaft), time, m.breaks_away, events);
    }
}

/// Numbers of the motions of one vector: of each of them, or of all.
pub(super) struct Gathered<V: Lane> {
    plant: Plant<V>,
    ripple: Option<Ripple<V>>,
    /// Models of the block's shafts, lane by lane of each vector.
    each: Vec<Model>,
    /// Plants have differed from one another, and discs.
    differ: (bool, bool),
}

impl<V: Lane> Gathered<V> {
    /// For the shafts of a block; none if they move otherwise.
    pub(super) fn of(all: &[Shafts<V>]) -> Option<Self> {
        let first = all.first()?;
        let own = first.steps()?;
        let lanes = all.iter().filter_map(Shafts::steps).flat_map(|own| &own.alone);
        let each: Vec<Model> = lanes.map(|alone| alone.model.clone()).collect();
        let differ = |same: fn(&Model, &Model) -> bool| each.iter().any(|model| !same(model, &each[0]));
        Some(Gathered {
            plant: first.plant,
            ripple: own.ripple.clone(),
            differ: (differ(|a, b| a.plant == b.plant), differ(|a, b| a.ripple == b.ripple)),
            each,
        })
    }

    /// A lane of a vector has begun anew.
    pub(super) fn begun_anew(&mut self, shafts: &Shafts<V>, n: usize, lane: usize) {
        let Some(own) = shafts.steps() else { return };
        let (anew, before) = (&own.alone[lane].model, &mut self.each[n * V::WIDTH + lane]);
        self.differ.0 |= anew.plant != before.plant;
        self.differ.1 |= anew.ripple != before.ripple;
        *before = anew.clone();
    }

    /// Plants and discs of so many motions: those of the vector that they fill, each in its lane, or taken one by one.
    #[inline(always)]
    fn take<'g>(
        &'g mut self,
        some: &[OnTheWay],
        all: &'g [Shafts<V>],
    ) -> (&'g Plant<V>, Option<&'g Ripple<V>>) {
        let first = &some[0];
        let filled = some.iter().enumerate().all(|(lane, m)| (m.shafts, m.lane) == (first.shafts, lane));
        if filled
            && some.len() == V::WIDTH
            && let Some(own) = all[first.shafts].steps()
        {
            return (&all[first.shafts].plant, own.ripple.as_ref());
        }
        let model = |i: usize| {
            let m = &some[i.min(some.len() - 1)];
            &self.each[m.shafts * V::WIDTH + m.lane]
        };
        if let Some(ripple) = &mut self.ripple
            && self.differ.1
        {
            ripple.take(|i| model(i).ripple.as_ref());
        }
        if self.differ.0 {
            let of = |get: &dyn Fn(&Plant<f64>) -> f64| V::of(|i| get(&model(i).plant));
            self.plant = Plant::in_lanes(&of).unwrap_or(self.plant);
        }
        (&self.plant, self.ripple.as_ref())
    }
}

/// The motions, step by step, as many at once as there are lanes.
#[inline(always)]
pub(super) fn step_by_step<V: Lane>(
    all: &mut [Shafts<V>],
    gathered: &mut Gathered<V>,
    moving: &mut Vec<OnTheWay>,
    time: f64,
    alike: &Alike,
    events: &mut Vec<Event>,
) {
    while !moving.is_empty() {
        let mut left = 0;
        for first in (0..moving.len()).step_by(V::WIDTH) {
            let some = first..(first + V::WIDTH).min(moving.len());
            let (plant, ripple) = gathered.take(&moving[some.clone()], all);
            let step = one_step(plant, ripple, &moving[some.clone()], alike);
            for (i, at) in some.enumerate() {
                let m = &mut moving[at];
                let shafts = &mut all[m.shafts];
                let step = Step {
                    to: [step.to[0].lane(i), step.to[1].lane(i)],
                    error: step.error.lane(i),
                    grows: step.grows.lane(i),
                    rate: [step.rate[0].lane(i), step.rate[1].lane(i)],
                };
                let Some(own) = shafts.steps_mut() else { continue };
                let engine = &mut own.alone[m.lane].engine;
                let before = m.course;
                match engine.judge(&mut m.course, &step, m.sign, (time, alike.period)) {
                    Ok(Outcome::On) if m.course.s < alike.period => {
                        // Most stay where they are.
                        if left < at {
                            moving.swap(left, at);
                        }
                        left += 1;
                    }
                    Ok(Outcome::On) => shafts.arrives(m, time),
                    Ok(Outcome::Stops) => {
                        // Its last step is done again by who goes on.
                        m.course = before;
                        shafts.stops(m, time, alike, events);
                    }
                    Err(_) => shafts.lost |= 1 << m.lane,
                }
            }
        }
        moving.truncate(left);
    }
}

/// A step of so many motions.
#[inline(always)]
fn one_step<V: Lane>(
    plant: &Plant<V>,
    ripple: Option<&Ripple<V>>,
    some: &[OnTheWay],
    alike: &Alike,
) -> Step<V> {
    let at = |i: usize| &some[i.min(some.len() - 1)];
    let of = |get: fn(&OnTheWay) -> f64| V::of(|i| get(at(i)));
    let lengths = V::of(|i| at(i).course.next(alike.period).0);
    let slip = Slip {
        plant,
        ripple,
        push: Steady {
            drive: of(|m| m.drive),
            from: of(|m| m.volts[0]),
            to: of(|m| m.volts[1]),
            time_constant: of(|m| m.time_constant),
            lags: alike.lags,
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
