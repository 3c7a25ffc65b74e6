//! Motion of shafts in lanes through one period, under voltages that whoever drives them gives.

use super::alike::{Alike, Begin};
use super::in_steps::OnTheWay;
use super::shafts::{Moves, Shafts};
use super::steps::{Gathered, step_by_step};
use crate::engine::exact_flow::{Flow, PIECE_LIMIT, Piece, Pushed, State};
use crate::engine::{Event, EventKind, Motion, Shaft};
use crate::lane::{Lane, each};
use crate::metrics::Sticks;

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
}
