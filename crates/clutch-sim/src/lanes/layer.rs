//! Motions that begin in a vector and end in the layer, or with an event. They go on piece by piece, those whose next piece is
//! of one kind together, as many at once as there are lanes; what follows a stop goes one by one.

use super::alike::Alike;
use super::shafts::{Moves, Shafts};
use crate::engine::exact_flow::{Flow, PIECE_LIMIT, Piece, Pushed, State};
use crate::engine::{Event, EventKind, Motion, Shaft};
use crate::lane::{Lane, MOST_LANES, each};

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

/// Motions of the lanes of one vector: a row for each number, with a place for each lane.
#[derive(Clone, Copy, Default)]
struct Rows {
    /// As [`Flow`] has them: drive, excess, drag, Stribeck's term, edge.
    flow: [[f64; MOST_LANES]; 5],
    /// As [`State`] has them: time, speed, `φ`, way.
    state: [[f64; MOST_LANES]; 4],
}

impl Rows {
    /// The constants of a motion.
    fn flow(&self, lane: usize) -> Flow<f64> {
        let [drive, excess, drag, stribeck, edge] = &self.flow;
        Flow {
            drive: drive[lane],
            excess: excess[lane],
            drag: drag[lane],
            stribeck: stribeck[lane],
            edge: edge[lane],
        }
    }

    /// A motion goes on from a state.
    #[inline(always)]
    fn put(&mut self, lane: usize, state: &State<f64>) {
        let [time, speed, rate, way] = &mut self.state;
        (time[lane], speed[lane], rate[lane], way[lane]) = (state.time, state.speed, state.rate, state.way);
    }
}

/// A motion that waits: its vector, and its lane there.
#[derive(Clone, Copy)]
struct Place {
    n: u32,
    lane: u32,
}

impl Place {
    #[inline(always)]
    fn lane(self) -> usize {
        self.lane as usize % MOST_LANES
    }
}

/// Some motions, at most as many as a vector has lanes; in those that are left over the last.
#[inline(always)]
fn gather<V: Lane>(rows: &[Rows], some: &[Place]) -> (Flow<V>, State<V>) {
    let mut of = [(&rows[0], 0); MOST_LANES];
    for (i, of) in of.iter_mut().enumerate().take(V::WIDTH) {
        let place = some[i.min(some.len() - 1)];
        *of = (&rows[place.n as usize], place.lane());
    }
    let flow = |row: usize| V::of(|i| of[i].0.flow[row][of[i].1]);
    let state = |row: usize| V::of(|i| of[i].0.state[row][of[i].1]);
    let flow = Flow { drive: flow(0), excess: flow(1), drag: flow(2), stribeck: flow(3), edge: flow(4) };
    (flow, State { time: state(0), speed: state(1), rate: state(2), way: state(3) })
}

/// The motions that wait, by the kind of piece that is next.
pub(super) struct Layer<V: Lane> {
    /// Vector by vector.
    periods: Vec<Period<V>>,
    rows: Vec<Rows>,
    /// Perhaps an easy one.
    easy: Vec<Place>,
    /// A quadrature, if its error is small enough.
    inside: Vec<Place>,
    /// As `inside`, in the next round.
    next: Vec<Place>,
}

impl<V: Lane> Layer<V> {
    /// Room for the motions of so many vectors.
    pub(super) fn of(vectors: usize) -> Self {
        let zero = V::ZERO;
        let pushed = Pushed { torque: zero, normal: zero, holds: zero };
        let period = Period { pushed, sign: zero, way: zero, breaks_away: 0 };
        let queue = || Vec::with_capacity(vectors * V::WIDTH);
        Layer {
            periods: vec![period; vectors],
            rows: vec![Rows::default(); vectors],
            easy: queue(),
            inside: queue(),
            next: queue(),
        }
    }

    /// None waits.
    pub(super) fn is_empty(&self) -> bool {
        self.easy.is_empty() && self.inside.is_empty()
    }

    /// Some motions of a vector wait, at these speeds.
    #[inline(always)]
    pub(super) fn wait(&mut self, n: usize, (period, flow): (Period<V>, &Flow<V>), some: u64, speed: V) {
        self.periods[n] = period;
        let rows = &mut self.rows[n];
        let Flow { drive, excess, drag, stribeck, edge } = *flow;
        for (row, x) in rows.flow.iter_mut().zip([drive, excess, drag, stribeck, edge]) {
            x.store(&mut row[..V::WIDTH]);
        }
        let State { time, speed, rate, way } = State::at(speed);
        for (row, x) in rows.state.iter_mut().zip([time, speed, rate, way]) {
            x.store(&mut row[..V::WIDTH]);
        }
        let place = |lane: usize| Place { n: n as u32, lane: lane as u32 };
        let slow = V::bits(flow.is_slow(speed));
        each(some & slow, |lane| self.inside.push(place(lane)));
        each(some & !slow, |lane| self.easy.push(place(lane)));
    }

    /// The period that began at `time` ends for all that wait.
    #[inline(always)]
    pub(super) fn end(&mut self, all: &mut [Shafts<V>], time: f64, alike: &Alike, events: &mut Vec<Event>) {
        let whole = V::splat(alike.period);
        let Layer { periods, rows, easy, inside, next } = self;
        let mut after = After { all, periods, time, alike, events };
        for _ in 0..PIECE_LIMIT {
            if easy.is_empty() && inside.is_empty() {
                return;
            }
            // What is easy the next time, behind these.
            let (first, mut begin) = (easy.len(), 0);
            while begin < first {
                let some: [Place; MOST_LANES] = places(&easy[begin..first]);
                let some = &some[..(first - begin).min(V::WIDTH)];
                let (flow, at) = gather::<V>(rows, some);
                let piece = flow.easy(&at, whole - at.time);
                let (goes_on, others) = after.take(&piece, whole, some, rows);
                // What has come down from the edge is next to the layer; what has come down to the edge is above it.
                let down = V::bits(!piece.state.speed.less(flow.edge));
                each(goes_on & down, |i| easy.push(some[i]));
                each(others | (goes_on & !down), |i| inside.push(some[i]));
                begin += V::WIDTH;
            }
            easy.drain(..first);
            for some in inside.chunks(V::WIDTH) {
                let (flow, at) = gather::<V>(rows, some);
                let rates = flow.rates(&at);
                let piece = flow.inside(&at, rates, whole - at.time);
                let (goes_on, others) = after.take(&piece, whole, some, rows);
                let slow = V::bits(flow.is_slow(piece.state.speed));
                each(goes_on & slow, |i| next.push(some[i]));
                each(goes_on & !slow, |i| easy.push(some[i]));
                // As a series, and as it goes on from there.
                each(others, |i| after.alone(some[i], rows, (at.lane(i), false)));
            }
            inside.clear();
            std::mem::swap(inside, next);
        }
        // Alone they say so.
        for Place { n, lane } in easy.drain(..).chain(inside.drain(..)) {
            after.all[n as usize].lost |= 1 << lane;
        }
    }
}

/// The first of some places.
#[inline(always)]
fn places(some: &[Place]) -> [Place; MOST_LANES] {
    let mut first = [some[0]; MOST_LANES];
    for (to, place) in first.iter_mut().zip(some) {
        *to = *place;
    }
    first
}

/// The needs of motions that end.
struct After<'a, V: Lane> {
    all: &'a mut [Shafts<V>],
    periods: &'a [Period<V>],
    time: f64,
    alike: &'a Alike,
    events: &'a mut Vec<Event>,
}

impl<V: Lane> After<'_, V> {
    /// Some motions have made a piece, and end if they have come to the end, or stopped. The bits of those that go on, and of those
    /// that have made none.
    #[inline(always)]
    fn take(&mut self, piece: &Piece<V>, whole: V, some: &[Place], rows: &mut [Rows]) -> (u64, u64) {
        let Piece { done, stops, state } = piece;
        let own = !u64::MAX.unbounded_shl(some.len() as u32);
        let goes = *done & !*stops & state.speed.is_finite() & state.way.is_finite();
        let ends = V::bits(goes & whole.less_or_equal(state.time)) & own;
        each(ends, |i| {
            let Place { n, .. } = some[i];
            let (speed, way) = (state.speed.lane(i), state.way.lane(i));
            self.all[n as usize].ends(some[i].lane(), &self.periods[n as usize], (speed, way), self.time);
        });
        let (goes, done) = (V::bits(goes) & own, V::bits(*done) & own);
        each(goes & !ends, |i| rows[some[i].n as usize].put(some[i].lane(), &state.lane(i)));
        let stops = V::bits(*stops);
        each(done & !goes, |i| self.alone(some[i], rows, (state.lane(i), stops >> i & 1 == 1)));
        (goes & !ends, own & !done)
    }

    /// A motion goes on alone from a state, or stops in it.
    fn alone(&mut self, at: Place, rows: &[Rows], (state, stops): (State<f64>, bool)) {
        let n = at.n as usize;
        let begun = (rows[n].flow(at.lane()), state, stops);
        self.all[n].alone(at.lane(), &self.periods[n], begun, (self.time, self.alike), self.events);
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
