//! Motions that begin in a vector and end in the layer, or with an event. They go on piece by piece, those whose next piece is
//! of one kind together, as many at once as there are lanes; what follows a stop goes one by one.

use super::alike::Alike;
use super::shafts::{Moves, Shafts};
use crate::engine::exact_flow::{Flow, PIECE_LIMIT, Piece, Pushed, State};
use crate::engine::{Event, EventKind, Motion, Shaft};
use crate::lane::{Lane, each};

/// A period of the shafts in the lanes of one vector.
#[derive(Clone, Copy)]
pub(super) struct Period<V: Lane> {
    pub(super) pushed: Pushed<V>,
    pub(super) sign: V,
    /// Velocity of a speed of 1, rad/s.
    pub(super) way: V,
    /// Lanes that have been stuck until now.
    pub(super) breaks_away: u64,
}

/// Motions on their way through a period, column by column.
struct Queue {
    many: usize,
    /// Their vectors' places and their lanes.
    places: Vec<(usize, usize)>,
    /// Time, speed, `φ`, way, and `q`, as [`State`] has them; `φ` and `q` where they are known.
    columns: [Vec<f64>; 5],
}

impl Queue {
    /// Room for so many.
    fn of(many: usize) -> Self {
        Queue { many: 0, places: vec![(0, 0); many], columns: std::array::from_fn(|_| vec![0.0; many]) }
    }

    fn put(&mut self, place: (usize, usize), at: &State<f64>, slip: f64) {
        let State { time, speed, rate, way } = *at;
        self.places[self.many] = place;
        for (column, x) in self.columns.iter_mut().zip([time, speed, rate, way, slip]) {
            column[self.many] = x;
        }
        self.many += 1;
    }

    /// Some of them, from this one on, in the lanes of a vector; in lanes that are left over the last.
    #[inline(always)]
    fn gather<V: Lane>(&self, first: usize, flows: &[Flow<f64>]) -> (Flow<V>, State<V>, V) {
        let last = self.many - 1;
        let [time, speed, rate, way, slip] = &self.columns;
        let column = |column: &[f64]| match column.get(first..first + V::WIDTH) {
            Some(all) if first + V::WIDTH <= self.many => V::of(|i| all[i]),
            _ => V::of(|i| column[(first + i).min(last)]),
        };
        let flow = |get: fn(&Flow<f64>) -> f64| {
            V::of(|i| {
                let (shafts, lane) = self.places[(first + i).min(last)];
                get(&flows[shafts * V::WIDTH + lane])
            })
        };
        let flow = Flow {
            drive: flow(|f| f.drive),
            excess: flow(|f| f.excess),
            unit: flow(|f| f.unit),
            drag: flow(|f| f.drag),
            stribeck: flow(|f| f.stribeck),
            edge: flow(|f| f.edge),
        };
        let at = State { time: column(time), speed: column(speed), rate: column(rate), way: column(way) };
        (flow, at, column(slip))
    }
}

/// The motions that wait, by the kind of piece that is next.
pub(super) struct Layer<V: Lane> {
    /// Vector by vector.
    periods: Vec<Period<V>>,
    /// Lane by lane of each vector: a motion reads all of one.
    flows: Vec<Flow<f64>>,
    /// Perhaps an easy one.
    easy: Queue,
    /// As `easy`, in the next round.
    next: Queue,
    /// A quadrature, if its error is small enough.
    inside: Queue,
    /// A series.
    steep: Queue,
}

impl<V: Lane> Layer<V> {
    /// Room for the motions of so many vectors.
    pub(super) fn of(vectors: usize) -> Self {
        let zero = V::ZERO;
        let flow = Flow { drive: 0.0, excess: 0.0, unit: 0.0, drag: 0.0, stribeck: 0.0, edge: 0.0 };
        let pushed = Pushed { torque: zero, normal: zero, holds: zero };
        let period = Period { pushed, sign: zero, way: zero, breaks_away: 0 };
        let queue = || Queue::of(vectors * V::WIDTH);
        Layer {
            periods: vec![period; vectors],
            flows: vec![flow; vectors * V::WIDTH],
            easy: queue(),
            next: queue(),
            inside: queue(),
            steep: queue(),
        }
    }

    /// None waits.
    pub(super) fn is_empty(&self) -> bool {
        self.easy.many + self.inside.many == 0
    }

    /// Motions of a vector wait: some have a state after their first piece; those whose next piece is no easy one have `q`
    /// and `φ`.
    #[inline(always)]
    pub(super) fn wait(
        &mut self,
        n: usize,
        (period, flow): (Period<V>, &Flow<V>),
        (some, inside): (u64, u64),
        (state, slip, rate): (&State<V>, V, V),
    ) {
        self.periods[n] = period;
        each(some, |lane| self.flows[n * V::WIDTH + lane] = flow.lane(lane));
        let known = State { rate, ..*state };
        each(some & inside, |lane| self.inside.put((n, lane), &known.lane(lane), slip.lane(lane)));
        each(some & !inside, |lane| self.easy.put((n, lane), &state.lane(lane), 0.0));
    }

    /// The period that began at `time` ends for all that wait.
    #[inline(always)]
    pub(super) fn end(&mut self, all: &mut [Shafts<V>], time: f64, alike: &Alike, events: &mut Vec<Event>) {
        let whole = V::splat(alike.period);
        let Layer { periods, flows, easy, next, inside, steep } = self;
        let mut after = After { all, flows, time, alike, events };
        for _ in 0..PIECE_LIMIT {
            if easy.many + inside.many == 0 {
                return;
            }
            for first in (0..easy.many).step_by(V::WIDTH) {
                let (flow, at, _) = easy.gather(first, after.flows);
                let (piece, slip, rate) = flow.easy(&at, whole - at.time);
                let known = State { rate, ..at };
                let on = |i: usize| (known.lane(i), slip.lane(i));
                after.take(&piece, (whole, V::none()), (easy, first), periods, next, (inside, on));
            }
            for first in (0..inside.many).step_by(V::WIDTH) {
                let (flow, at, slip) = inside.gather(first, after.flows);
                let (piece, room) = flow.inside(&at, (slip, at.rate), whole - at.time);
                let on = |i: usize| (at.lane(i), slip.lane(i));
                after.take(&piece, (whole, !room), (inside, first), periods, next, (steep, on));
            }
            for first in (0..steep.many).step_by(V::WIDTH) {
                let (flow, at, slip) = steep.gather(first, after.flows);
                let piece = flow.steep(&at, (slip, at.rate), whole - at.time);
                let on = |i: usize| (at.lane(i), slip.lane(i));
                after.take(&piece, (whole, V::none()), (steep, first), periods, next, (inside, on));
            }
            (easy.many, inside.many, steep.many) = (0, 0, 0);
            std::mem::swap(easy, next);
        }
        // Alone they say so.
        for queue in [easy, inside] {
            let places = &queue.places[..std::mem::take(&mut queue.many)];
            places.iter().for_each(|(shafts, lane)| after.all[*shafts].lost |= 1 << lane);
        }
    }
}

/// The needs of motions that end.
struct After<'a, V: Lane> {
    all: &'a mut [Shafts<V>],
    flows: &'a [Flow<f64>],
    time: f64,
    alike: &'a Alike,
    events: &'a mut Vec<Event>,
}

impl<V: Lane> After<'_, V> {
    /// Motions of a queue, from `first` on, have made a piece: they end, or wait for the next round. Those that have not are put into another
    /// queue, with the state and `q` that `on` gives, but for those that have to go alone.
    #[inline(always)]
    fn take(
        &mut self,
        piece: &Piece<V>,
        (whole, alone): (V, V::Mask),
        (queue, first): (&Queue, usize),
        periods: &[Period<V>],
        next: &mut Queue,
        (other, on): (&mut Queue, impl Fn(usize) -> (State<f64>, f64)),
    ) {
        let Piece { done, stops, state } = piece;
        let finite = *done & state.speed.is_finite() & state.way.is_finite();
        let goes_on = finite & !*stops;
        let ends = V::bits(goes_on & whole.less_or_equal(state.time));
        let (goes_on, on_to) = (V::bits(goes_on) & !ends, V::bits(!*done & !alone));
        let stops = V::bits(finite & *stops);
        for (i, place) in queue.places[first..queue.many].iter().take(V::WIDTH).enumerate() {
            let is = |bits: u64| bits >> i & 1 == 1;
            let (period, shafts) = (&periods[place.0], &mut self.all[place.0]);
            if is(ends) {
                shafts.ends(place.1, period, (state.speed.lane(i), state.way.lane(i)), self.time);
            } else if is(goes_on) {
                next.put(*place, &state.lane(i), 0.0);
            } else if is(on_to) {
                let (state, slip) = on(i);
                other.put(*place, &state, slip);
            } else {
                let state = if is(V::bits(finite)) { state.lane(i) } else { on(i).0 };
                let flow = self.flows[place.0 * V::WIDTH + place.1];
                let begun = (flow, state, is(stops));
                shafts.alone(place.1, period, begun, (self.time, self.alike), self.events);
            }
        }
    }
}

impl<V: Lane> Shafts<V> {
    /// A motion that has come to the end of the period, with a speed and over a way in Stribeck velocities.
    #[inline(always)]
    fn ends(&mut self, lane: usize, period: &Period<V>, (speed, way): (f64, f64), time: f64) {
        let scale = period.way.lane(lane);
        let position = self.position.lane(lane);
        if period.breaks_away >> lane & 1 == 1 {
            let torque = period.pushed.torque.lane(lane);
            let begins = Event { time, kind: EventKind::BreakAway, position, torque };
            self.sticks[lane].period(time, true, &[begins]);
            self.sign.put(lane, period.sign.lane(lane));
        }
        self.position.put(lane, position + scale * way);
        self.velocity.put(lane, scale * speed);
    }

    /// A motion that stops where it is, or that no vector takes.
    #[inline(never)]
    fn alone(
        &mut self,
        lane: usize,
        period: &Period<V>,
        begun: (Flow<f64>, State<f64>, bool),
        (time, alike): (f64, &Alike),
        events: &mut Vec<Event>,
    ) {
        let stuck = period.breaks_away >> lane & 1 == 1;
        let mut shaft = Shaft::new(self.position.lane(lane), self.velocity.lane(lane));
        shaft.motion = if stuck { Motion::Stuck } else { Motion::along(period.sign.lane(lane)) };
        events.clear();
        let moved = match &self.moves {
            Moves::Exactly { alone, .. } => {
                let pushed = period.pushed.lane(lane);
                alone[lane].advance(&pushed, (time, alike.period), &mut shaft, events, Some(begun)).is_ok()
            }
            Moves::InSteps(_) => false,
        };
        self.ended(lane, moved.then_some(&shaft), time, stuck, events);
    }
}
