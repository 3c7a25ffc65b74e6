//! Motion of shafts in lanes through one period, under voltages that whoever drives them gives.

use super::steps::{Gathered, InSteps, OnTheWay, step_by_step};
use crate::engine::exact_flow::{Bed, Flow, PIECE_LIMIT, Piece, Pushed, State};
use crate::engine::{EngineKind, Event, EventKind, Motion, Shaft};
use crate::lane::{Lane, each};
use crate::metrics::Sticks;
use crate::moving_rig::MovingRig;
use crate::rig::Rig;
use crate::ripple::{Ripple, Shape};
use clutch_core::{ActuatorKind, FrictionParams, Plant};
use std::collections::VecDeque;
use std::mem::{Discriminant, discriminant};

/// Facts of their motion that the shafts of a block have in common.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Alike {
    /// Sampling period, s.
    pub(super) period: f64,
    /// Periods from sample to voltage.
    delay: usize,
    pub(super) engine: EngineKind,
    /// Dormand–Prince: whether the actuator lags, and the shape of the friction along the disc.
    pub(super) lags: bool,
    shape: Option<Shape>,
    plant: (ActuatorKind, Discriminant<FrictionParams>),
}

impl Alike {
    /// For a rig that an engine moves, sampled each `period` seconds; none if it has to move alone.
    pub(super) fn of(rig: &Rig, engine: EngineKind, period: f64) -> Option<Self> {
        let p = &rig.params;
        let in_steps = engine == EngineKind::DormandPrince && rig.drive.is_constant();
        if p.torque_noise > 0.0 || (engine != EngineKind::ExactFlow && !in_steps) {
            return None;
        }
        Some(Alike {
            period,
            delay: p.delay_ticks as usize,
            engine,
            lags: p.actuator_time_constant.is_some(),
            shape: rig.model.ripple.as_ref().map(Ripple::shape),
            plant: (p.actuator.kind(), discriminant(&p.friction)),
        })
    }
}

/// A rig as it begins, and the voltage at its pad, V.
pub(super) type Begin<'a> = (&'a MovingRig, f64);

/// Engine that moves the shafts of a vector.
enum Moves<V: Lane> {
    Exactly {
        bed: Bed<V>,
        /// Lane by lane.
        alone: Vec<Bed<f64>>,
    },
    InSteps(InSteps<V>),
}

/// Shafts in the lanes of one vector.
pub(super) struct Shafts<V: Lane> {
    // Kept from period to period.
    pub(super) plant: Plant<V>,
    pub(super) drive: V,
    // Changed by each.
    moves: Moves<V>,
    pub(super) position: V,
    pub(super) velocity: V,
    /// Way in which the shaft moves: 1, −1, or 0 while it is stuck.
    pub(super) sign: V,
    /// Voltages on their way to the actuator.
    line: VecDeque<V>,
    pub(super) arriving: V,
    /// Lanes that lanes cannot do.
    pub(super) lost: u64,
    /// Lane by lane.
    pub(super) sticks: Vec<Sticks>,
}

/// A motion that begins in a vector and ends in the layer, or with an event.
struct Waiting {
    /// The vector's place.
    shafts: usize,
    lane: usize,
    pushed: Pushed<f64>,
    flow: Flow<f64>,
    state: State<f64>,
    sign: f64,
    /// Stribeck velocity, rad/s.
    velocity: f64,
    /// It has been stuck until now.
    breaks_away: bool,
}

/// Shafts of a block, and their motions on the way through a period.
pub(super) struct Motions<V: Lane> {
    alike: Alike,
    /// Vector by vector.
    pub(super) shafts: Vec<Shafts<V>>,
    waiting: Vec<Waiting>,
    steps: Vec<OnTheWay>,
    gathered: Option<Gathered<V>>,
    events: Vec<Event>,
}

impl<V: Lane> Motions<V> {
    /// Rigs as they begin, of which `alike` tells; none if they have no lanes together. `sticks` counts from here.
    pub(super) fn of(rigs: &[Begin<'_>], alike: &Alike, sticks: &Sticks) -> Option<Self> {
        let shafts = rigs.chunks(V::WIDTH).map(|some| Shafts::of(some, alike, sticks));
        let shafts = shafts.collect::<Option<Vec<_>>>()?;
        let gathered = Gathered::of(&shafts);
        let alike = *alike;
        Some(Motions { alike, shafts, waiting: Vec::new(), steps: Vec::new(), gathered, events: Vec::new() })
    }

    /// The period of a vector begins at `time`, s: its shafts move, but for motions that wait for [`Motions::end`].
    #[inline(always)]
    pub(super) fn begin(&mut self, n: usize, time: f64) {
        let Motions { alike, shafts, waiting, steps, .. } = self;
        // In a function of its own, with all that it calls: runs and fleets share it.
        V::apart(
            #[inline(always)]
            || shafts[n].advance(n, time, alike, waiting, steps),
        );
    }

    /// The period that all vectors have begun at `time` ends.
    #[inline(always)]
    pub(super) fn end(&mut self, time: f64) {
        let Motions { alike, shafts, waiting, steps, gathered, events } = self;
        if waiting.is_empty() && steps.is_empty() {
            return;
        }
        V::apart(
            #[inline(always)]
            || {
                through_the_layer(shafts, waiting, time, alike, events);
                if let Some(gathered) = gathered {
                    step_by_step(shafts, gathered, steps, time, alike, events);
                }
            },
        );
    }

    /// A lane of a vector begins anew, with a rig of the same scenario.
    pub(super) fn begin_anew(&mut self, n: usize, lane: usize, rig: Begin<'_>, sticks: &Sticks) {
        self.shafts[n].begin_anew(lane, rig, sticks);
        if let Some(gathered) = &mut self.gathered {
            gathered.begun_anew(&self.shafts[n], n, lane);
        }
    }
}

impl<V: Lane> Shafts<V> {
    /// At most as many rigs as there are lanes, as they begin.
    fn of(rigs: &[Begin<'_>], alike: &Alike, sticks: &Sticks) -> Option<Self> {
        // Lanes that are left over begin as the last one, and are lost from there.
        let at = |i: usize| rigs[i.min(rigs.len() - 1)];
        let rig = |i: usize| at(i).0.rig();
        let of = |get: &dyn Fn(Begin<'_>) -> f64| V::of(|i| get(at(i)));
        let volts = of(&|(_, volts)| volts);
        let moves = if alike.engine == EngineKind::ExactFlow {
            let alone: Vec<Bed<f64>> =
                (0..V::WIDTH).map(|i| Bed::of(&rig(i).model)).collect::<Option<_>>()?;
            Moves::Exactly { bed: Bed::in_lanes(&alone), alone }
        } else {
            Moves::InSteps(InSteps::of(&(0..V::WIDTH).map(at).collect::<Vec<_>>()))
        };
        Some(Shafts {
            plant: Plant::in_lanes(&|get| V::of(|i| get(&rig(i).model.plant)))?,
            drive: of(&|(moving, _)| moving.rig().drive.torque(0.0, 0.0) + 0.0),
            moves,
            position: of(&|(moving, _)| moving.shaft().position),
            velocity: of(&|(moving, _)| moving.shaft().velocity),
            sign: of(&|(moving, _)| moving.shaft().motion.sign()),
            line: vec![volts; alike.delay].into(),
            arriving: volts,
            lost: u64::MAX.unbounded_shl(rigs.len() as u32),
            sticks: vec![sticks.clone(); V::WIDTH],
        })
    }

    fn begin_anew(&mut self, lane: usize, (moving, volts): Begin<'_>, sticks: &Sticks) {
        let shaft = moving.shaft();
        self.position.put(lane, shaft.position);
        self.velocity.put(lane, shaft.velocity);
        self.sign.put(lane, shaft.motion.sign());
        self.line.iter_mut().for_each(|on_its_way| on_its_way.put(lane, volts));
        self.arriving.put(lane, volts);
        self.lost &= !(1 << lane);
        self.sticks[lane] = sticks.clone();
        if let Moves::InSteps(steps) = &mut self.moves {
            steps.begin_anew(lane, (moving, volts));
        }
    }

    /// The converters give these voltages from now on, V.
    #[inline(always)]
    pub(super) fn command(&mut self, volts: V) {
        self.arriving = match self.line.pop_front() {
            None => volts,
            // The voltage that was commanded as many ticks ago as the line is long.
            Some(arrives) => {
                self.line.push_back(volts);
                arrives
            }
        };
    }

    /// The period passes. Motions in the layer, those that begin or end, and those that go in steps wait.
    #[inline(always)]
    fn advance(
        &mut self,
        n: usize,
        time: f64,
        alike: &Alike,
        waiting: &mut Vec<Waiting>,
        steps: &mut Vec<OnTheWay>,
    ) {
        let Moves::Exactly { bed, .. } = &self.moves else {
            self.begin_steps(n, time, alike, steps);
            return;
        };
        let (volts, rest) = (self.arriving, V::splat(alike.period));
        let actuator = self.plant.actuator();
        let pushed = Pushed {
            torque: self.drive + actuator.torque(volts),
            normal: actuator.normal(volts),
            holds: self.plant.break_away_torque(volts),
        };
        let moves = self.sign.less(V::ZERO) | V::ZERO.less(self.sign);
        let breaks_away = !moves & pushed.holds.less(pushed.torque.abs());
        let stuck = !moves & !breaks_away;
        if V::any(stuck) {
            each(V::bits(stuck) & !self.lost, |i| self.sticks[i].period(time, true, &[]));
        }
        if !V::any(!stuck) {
            return;
        }
        let sign = V::select(breaks_away, pushed.torque.sgn(), self.sign);
        let flow = bed.flow(&pushed, sign, rest);
        let v_s = bed.velocity();
        let begin = State::at(sign * self.velocity / v_s);
        // Motions that no exponential here has room for.
        self.lost |= V::bits(!flow.edge.less(V::splat(700.0)) & !stuck);
        let Piece { done, stops, state } = flow.first(&begin, rest);
        // Its event is for what finds it.
        let (done, state) = (done & !stops, State::select(stops, &begin, &state));
        // To the end, and not to a stop.
        let whole = rest.less_or_equal(state.time) & V::ZERO.less(state.speed);
        let done = done & moves & whole & state.speed.is_finite() & state.way.is_finite();
        let way = sign * v_s;
        self.position = V::select(done, self.position + way * state.way, self.position);
        self.velocity = V::select(done, way * state.speed, self.velocity);
        let left = !stuck & !done;
        if V::any(left) {
            let (left, breaks_away) = (V::bits(left) & !self.lost, V::bits(breaks_away));
            each(left, |lane| {
                waiting.push(Waiting {
                    shafts: n,
                    lane,
                    pushed: pushed.lane(lane),
                    flow: flow.lane(lane),
                    state: state.lane(lane),
                    sign: sign.lane(lane),
                    velocity: v_s.lane(lane),
                    breaks_away: breaks_away >> lane & 1 == 1,
                });
            });
        }
    }
}

/// The motions that wait, piece by piece, as many at once as there are lanes; what follows a stop one by one.
#[inline(always)]
fn through_the_layer<V: Lane>(
    all: &mut [Shafts<V>],
    waiting: &mut Vec<Waiting>,
    time: f64,
    alike: &Alike,
    events: &mut Vec<Event>,
) {
    let whole = V::splat(alike.period);
    for _ in 0..PIECE_LIMIT {
        if waiting.is_empty() {
            return;
        }
        let mut left = 0;
        for first in (0..waiting.len()).step_by(V::WIDTH) {
            let some = first..(first + V::WIDTH).min(waiting.len());
            let last = some.end - 1;
            let of = |get: fn(&Waiting) -> f64| V::of(|i| get(&waiting[(first + i).min(last)]));
            let flow = Flow {
                drive: of(|w| w.flow.drive),
                excess: of(|w| w.flow.excess),
                drag: of(|w| w.flow.drag),
                stribeck: of(|w| w.flow.stribeck),
                edge: of(|w| w.flow.edge),
            };
            let at = State {
                time: of(|w| w.state.time),
                speed: of(|w| w.state.speed),
                rate: of(|w| w.state.rate),
                way: of(|w| w.state.way),
            };
            let Piece { done, stops, state } = flow.piece(&at, whole - at.time);
            let done = done & state.speed.is_finite() & state.way.is_finite();
            let ends = V::bits(done & !stops & whole.less_or_equal(state.time));
            let (done, stops) = (V::bits(done), V::bits(stops));
            for (i, at) in some.enumerate() {
                let shafts = &mut all[waiting[at].shafts];
                let is = |bits: u64| bits >> i & 1 == 1;
                if is(ends) {
                    shafts.ends(&waiting[at], (state.speed.lane(i), state.way.lane(i)), time);
                    continue;
                }
                if is(done) {
                    waiting[at].state = state.lane(i);
                }
                if is(done & !stops) {
                    waiting.swap(left, at);
                    left += 1;
                } else {
                    shafts.alone(&waiting[at], is(done & stops), time, alike, events);
                }
            }
        }
        waiting.truncate(left);
    }
    // Alone they say so.
    waiting.drain(..).for_each(|w| all[w.shafts].lost |= 1 << w.lane);
}

impl<V: Lane> Shafts<V> {
    /// A motion that has come to the end of the period, with a speed and over a way in Stribeck velocities.
    #[inline(always)]
    fn ends(&mut self, w: &Waiting, (speed, way): (f64, f64), time: f64) {
        let scale = w.sign * w.velocity;
        let position = self.position.lane(w.lane);
        if w.breaks_away {
            let begins = Event { time, kind: EventKind::BreakAway, position, torque: w.pushed.torque };
            self.sticks[w.lane].period(time, true, &[begins]);
            self.sign.put(w.lane, w.sign);
        }
        self.position.put(w.lane, position + scale * way);
        self.velocity.put(w.lane, scale * speed);
    }

    /// A motion that stops where it is, or that no vector takes.
    #[inline(never)]
    fn alone(&mut self, w: &Waiting, stops: bool, time: f64, alike: &Alike, events: &mut Vec<Event>) {
        let Waiting { lane, flow, state, .. } = *w;
        let stuck = w.breaks_away;
        let mut shaft = Shaft::new(self.position.lane(lane), self.velocity.lane(lane));
        shaft.motion = if stuck { Motion::Stuck } else { Motion::along(w.sign) };
        events.clear();
        let moved = match &self.moves {
            Moves::Exactly { alone, .. } => {
                let begun = Some((flow, state, stops));
                alone[lane].advance(&w.pushed, (time, alike.period), &mut shaft, events, begun).is_ok()
            }
            Moves::InSteps(_) => false,
        };
        self.ended(lane, moved.then_some(&shaft), time, stuck, events);
    }

    /// A lane has come to the end of the period alone, or has not; what happened in it.
    pub(super) fn ended(
        &mut self,
        lane: usize,
        shaft: Option<&Shaft>,
        time: f64,
        stuck: bool,
        events: &[Event],
    ) {
        let Some(shaft) = shaft else {
            self.lost |= 1 << lane;
            return;
        };
        self.sticks[lane].period(time, stuck, events);
        self.position.put(lane, shaft.position);
        self.velocity.put(lane, shaft.velocity);
        self.sign.put(lane, shaft.motion.sign());
    }

    /// Steps that move it, if it is moved in steps.
    #[inline(always)]
    pub(super) fn steps(&self) -> Option<&InSteps<V>> {
        match &self.moves {
            Moves::Exactly { .. } => None,
            Moves::InSteps(steps) => Some(steps),
        }
    }

    /// As [`Shafts::steps`].
    #[inline(always)]
    pub(super) fn steps_mut(&mut self) -> Option<&mut InSteps<V>> {
        match &mut self.moves {
            Moves::Exactly { .. } => None,
            Moves::InSteps(steps) => Some(steps),
        }
    }
}
