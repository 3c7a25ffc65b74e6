//! A block of runs in lockstep: chunks of as many as a vector has lanes.

use super::elementary::Powers;
use super::group::{Candidate, Common};
use super::silence::Silence;
use super::steps::{Gathered, InSteps, OnTheWay, step_by_step};
use super::vector::InLanes;
use crate::detected::STAIR;
use crate::engine::exact_flow::{Bed, Flow, PIECE_LIMIT, Piece, Pushed, State};
use crate::engine::{EngineKind, Event, EventKind, Motion, Shaft};
use crate::lane::{Lane, each};
use crate::metrics::{Detected, Metrics, MetricsBuilder, Sampled, Sticks};
use crate::run::REPORT_EVERY;
use clutch_core::law::{self, ControlLaw, Law, Seen, Tick};
use clutch_core::reference::Reference;
use clutch_core::{FixedCounts, Plant, SmoothedDerivative, StickSlipParams, Target};

/// Counts of an encoder beyond which a run goes alone: what wraps, wraps there.
const FARTHEST: f64 = (1 << 30) as f64;
/// A count in the fixed point of positions.
const FIXED: f64 = (1 << FixedCounts::FRACTION_BITS) as f64;

macro_rules! laws {
    ($(lanes $law:ident;)+) => {
        /// A law of several runs, and its memory.
        #[derive(Clone)]
        enum LawInLanes<V: Lane> {
            $($law(law::$law<V>, <law::$law<V> as ControlLaw<V>>::State),)+
        }

        impl<V: Lane> LawInLanes<V> {
            /// The laws of the runs as one; none if they are not of one kind, or of a kind that has no lanes.
            fn of(laws: &[&Law<f64>]) -> Option<Self> {
                match laws.first()? {
                    $(Law::$law(_) => {
                        let own = |law: &&Law<f64>| if let Law::$law(law) = law { Some(*law) } else { None };
                        let own: Vec<law::$law<f64>> = laws.iter().map(own).collect::<Option<_>>()?;
                        let law: Option<law::$law<V>> =
                            law::$law::in_lanes(&|get| V::of(|i| get(&own[i]))).into();
                        Some(LawInLanes::$law(law?, Default::default()))
                    })+
                    _ => None,
                }
            }

            /// Begins at a tick, with so many volts on the actuator.
            fn start(&mut self, tick: &Tick<V>, applied: V) {
                match self {
                    $(LawInLanes::$law(law, state) => *state = law.start(tick, applied),)+
                }
            }

            /// A period, with so many volts on the actuator since the last one.
            #[inline(always)]
            fn update(&mut self, tick: &Tick<V>, applied: V) -> V {
                let seen = Seen { applied, ..Seen::default() };
                match self {
                    $(LawInLanes::$law(law, state) => V::apart(
                        #[inline(always)]
                        || {
                            law.sees(state, &seen);
                            law.update(state, tick).voltage
                        },
                    ),)+
                }
            }
        }

        /// The laws that run in lanes.
        pub(super) fn has_lanes(law: &Law<f64>) -> bool {
            matches!(law, $(Law::$law(_))|+)
        }
    };
}
clutch_core::each_law_in_lanes!(laws);

/// The paths of a chunk's runs.
enum Paths<'a> {
    /// One, but for where it begins.
    Same(Box<Reference<'a, f64>>),
    Each(Vec<Reference<'a, f64>>),
}

/// The target of each lane; its position in fixed point.
struct Targets<V> {
    position: V,
    velocity: V,
    acceleration: V,
}

/// Engine that moves the shafts of a chunk.
enum Moves<'a, V: Lane> {
    Exactly {
        bed: Bed<V>,
        /// Lane by lane.
        alone: Vec<Bed<f64>>,
    },
    InSteps(InSteps<'a, V>),
}

/// Runs in the lanes of one vector.
pub(super) struct Chunk<'a, V: Lane> {
    // Kept for the whole run.
    paths: Paths<'a>,
    /// Beginning of each path, in fixed point.
    start: V,
    counts_per_radian: V,
    radians_per_count: V,
    /// Lowest voltage of the converter, its step, codes per volt, and its highest code.
    dac: [V; 4],
    filter: SmoothedDerivative<V>,
    pub(super) plant: Plant<V>,
    pub(super) drive: V,
    // Changed by each tick.
    moves: Moves<'a, V>,
    law: LawInLanes<V>,
    /// Error of the last sample in fixed point, and its rate by (5).
    error: V,
    rate: V,
    counts: V,
    pub(super) position: V,
    pub(super) velocity: V,
    /// Way in which the shaft moves: 1, −1, or 0 while it is stuck.
    pub(super) sign: V,
    /// Voltage since the last sample, as the law is told.
    applied: V,
    /// Voltages on their way to the actuator.
    line: Vec<V>,
    pub(super) arriving: V,
    // Results.
    sampled: Sampled<V>,
    silences: Silence<V>,
    stairs: Silence<V>,
    /// Lanes that lanes cannot do.
    pub(super) lost: u64,
    /// Lane by lane.
    pub(super) sticks: Vec<Sticks>,
}

/// A motion that begins in a chunk and ends in the layer, or with an event.
struct Waiting {
    chunk: usize,
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

/// Figures of a run; none if it left what lanes can do.
pub(super) type Figures = Option<(Metrics, Detected)>;

/// A block, not yet in lanes.
pub(super) struct Block<'b, 'a> {
    pub(super) rows: &'b [&'a Candidate<'a>],
    pub(super) common: Common,
    /// True once it has to stop; asked now and then.
    pub(super) stop: &'b dyn Fn() -> bool,
}

impl InLanes for Block<'_, '_> {
    type Output = Option<Vec<Figures>>;

    #[inline(always)]
    fn run<V: Powers>(self) -> Self::Output {
        let Block { rows, common, stop } = self;
        let Some(mut chunks) =
            rows.chunks(V::WIDTH).map(|rows| Chunk::<V>::of(rows, &common)).collect::<Option<Vec<_>>>()
        else {
            return Some(rows.iter().map(|_| None).collect());
        };
        let (mut waiting, mut steps, mut events) = (Vec::new(), Vec::new(), Vec::new());
        let mut gathered = Gathered::of(&chunks);
        let asks = (REPORT_EVERY / rows.len() as u64).max(1);
        for k in 0..common.ticks {
            if k % asks == 0 {
                if stop() {
                    return None;
                }
                if chunks.iter().all(|chunk| chunk.lost == !0) {
                    break;
                }
            }
            let time = k as f64 * common.period;
            for (n, chunk) in chunks.iter_mut().enumerate() {
                chunk.sample(k, time, &common);
                chunk.advance(n, time, &common, &mut waiting, &mut steps);
            }
            through_the_layer(&mut chunks, &mut waiting, time, &common, &mut events);
            if let Some(gathered) = &mut gathered {
                step_by_step(&mut chunks, gathered, &mut steps, time, &common, &mut events);
            }
        }
        let of = |(i, _): (usize, &&Candidate<'_>)| chunks[i / V::WIDTH].figures(i % V::WIDTH, &common);
        Some(rows.iter().enumerate().map(of).collect())
    }
}

impl<'a, V: Lane> Chunk<'a, V> {
    /// The runs as they begin; none if they have no lanes together.
    fn of(rows: &[&'a Candidate<'a>], common: &Common) -> Option<Self> {
        // Lanes that are left over begin as the last run, and are lost from there.
        let row = |i: usize| rows[i.min(rows.len() - 1)];
        let of = |get: &dyn Fn(&Candidate<'a>) -> f64| V::of(|i| get(row(i)));
        let all = || (0..V::WIDTH).map(row);
        let first = row(0);
        let paths = if rows.iter().all(|r| r.path == first.path) {
            Paths::Same(first.path.into())
        } else {
            Paths::Each(all().map(|r| r.path).collect())
        };
        let counts_per_radian = of(&|r| r.rig().encoder.counts_per_radian());
        let radians_per_count = of(&|r| r.rig().encoder.radians_per_count());
        let dac = |get: &dyn Fn(&clutch_core::Dac<f64>) -> f64| of(&|r| get(r.servo.dac()));
        let volts = of(&|r| r.prepared.volts);
        let moves = if common.engine == EngineKind::ExactFlow {
            let alone: Vec<Bed<f64>> = all().map(|r| Bed::of(&r.rig().model)).collect::<Option<_>>()?;
            Moves::Exactly { bed: Bed::in_lanes(&alone), alone }
        } else {
            Moves::InSteps(InSteps::of(&all().collect::<Vec<_>>()))
        };
        let mut chunk = Chunk {
            paths,
            start: of(&|r| r.start.0 as f64),
            counts_per_radian,
            radians_per_count,
            dac: [
                dac(&|d| d.volts(clutch_core::DacCode(0))),
                dac(&|d| d.step()),
                dac(&|d| d.per_volt()),
                dac(&|d| f64::from(d.top().0)),
            ],
            filter: SmoothedDerivative::in_lanes(&|get| V::of(|i| get(&row(i).filter))),
            plant: Plant::in_lanes(&|get| V::of(|i| get(&row(i).rig().model.plant)))?,
            moves,
            drive: of(&|r| r.rig().drive.torque(0.0, 0.0) + 0.0),
            law: LawInLanes::of(&all().map(|r| r.servo.law()).collect::<Vec<_>>())?,
            error: V::ZERO,
            rate: V::ZERO,
            counts: V::ZERO,
            position: of(&|r| r.prepared.moving.shaft().position),
            velocity: of(&|r| r.prepared.moving.shaft().velocity),
            sign: of(&|r| r.prepared.moving.shaft().motion.sign()),
            applied: volts,
            line: vec![volts; common.delay],
            arriving: volts,
            sampled: Sampled::new(common.period, common.settle),
            silences: Silence::new(&StickSlipParams::default(), counts_per_radian * V::splat(common.period)),
            stairs: Silence::new(&STAIR, counts_per_radian * V::splat(common.period)),
            lost: u64::MAX.unbounded_shl(rows.len() as u32),
            sticks: vec![Sticks::new(common.period, common.settle); V::WIDTH],
        };
        let targets = chunk.targets(0);
        let (_, seen) = chunk.seen(common);
        chunk.error = targets.position - seen;
        let tick = chunk.tick(&targets, V::ZERO);
        chunk.law.start(&tick, volts);
        Some(chunk)
    }

    /// The targets at a tick.
    #[inline(always)]
    fn targets(&self, k: u64) -> Targets<V> {
        match &self.paths {
            Paths::Same(path) => {
                let target = path.at(k);
                Targets {
                    position: V::splat(target.position.0 as f64) + self.start,
                    velocity: V::splat(target.velocity),
                    acceleration: V::splat(target.acceleration),
                }
            }
            Paths::Each(paths) => {
                let mut all = [Target::default(); 8];
                for (target, path) in all.iter_mut().zip(paths) {
                    *target = path.at(k);
                }
                Targets {
                    position: V::of(|i| all[i].position.0 as f64) + self.start,
                    velocity: V::of(|i| all[i].velocity),
                    acceleration: V::of(|i| all[i].acceleration),
                }
            }
        }
    }

    /// Counts of the encoder, and the position that the servo sees, in fixed point.
    #[inline(always)]
    fn seen(&self, common: &Common) -> (V, V) {
        let fine = self.position * self.counts_per_radian;
        let counts = fine.floor();
        let fixed = V::splat(FIXED);
        (counts, if common.whole_counts { counts * fixed } else { (fine * fixed).floor() })
    }

    #[inline(always)]
    fn tick(&self, targets: &Targets<V>, error_rate: V) -> Tick<V> {
        Tick {
            error: self.error * V::splat(1.0 / FIXED) * self.radians_per_count,
            error_rate,
            target_velocity: targets.velocity,
            target_acceleration: targets.acceleration,
        }
    }

    /// Tick `k` begins: sensor, law, converter, figures.
    #[inline(always)]
    fn sample(&mut self, k: u64, time: f64, common: &Common) {
        let targets = self.targets(k);
        let (counts, seen) = self.seen(common);
        // Neither beyond the range nor NaN.
        let near =
            counts.abs().less(V::splat(FARTHEST)) & targets.position.abs().less(V::splat(FARTHEST * FIXED));
        self.lost |= V::bits(!near);
        let error = targets.position - seen;
        let difference = (error - self.error) * V::splat(1.0 / FIXED);
        self.error = error;
        self.rate = self.filter.smooth(self.rate, difference);
        let tick = self.tick(&targets, self.rate);
        let demand = self.law.update(&tick, self.applied);
        let [lowest, step, per_volt, top] = self.dac;
        let code = ((demand - lowest) * per_volt + V::splat(0.5)).floor();
        // A law is told of the converter's voltage, though a rig's may round nothing.
        self.applied = lowest + step * code.max(V::ZERO).min(top);
        let commanded = if common.whole_codes { self.applied } else { demand };
        let target = targets.position * V::splat(1.0 / FIXED) * self.radians_per_count;
        self.sampled.sample(time, target - self.position, self.velocity, commanded);
        let rests = if k == 0 { V::none() } else { V::same(counts, self.counts) };
        self.counts = counts;
        let settled = time >= common.settle;
        self.silences.update(!rests, targets.velocity, settled);
        self.stairs.update(!rests, targets.velocity, settled);
        if common.delay == 0 {
            self.arriving = commanded;
        } else {
            // The voltage that was commanded so many ticks ago.
            let slot = &mut self.line[(k % common.delay as u64) as usize];
            self.arriving = *slot;
            *slot = commanded;
        }
    }

    /// The period passes. Motions in the layer, those that begin or end, and those that go in steps wait.
    #[inline(always)]
    fn advance(
        &mut self,
        n: usize,
        time: f64,
        common: &Common,
        waiting: &mut Vec<Waiting>,
        steps: &mut Vec<OnTheWay<'a>>,
    ) {
        let Moves::Exactly { bed, .. } = &self.moves else {
            self.begin_steps(n, time, common, steps);
            return;
        };
        let (volts, rest) = (self.arriving, V::splat(common.period));
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
                    chunk: n,
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

    /// Figures of a lane.
    fn figures(&self, i: usize, common: &Common) -> Figures {
        if self.lost >> i & 1 == 1 {
            return None;
        }
        let sticks = self.sticks[i].clone();
        let metrics = MetricsBuilder::of(self.sampled.lane(i), sticks).finish();
        let time = metrics.measured_s.max(common.period);
        let (cycles, stuck_ticks) = self.silences.since_settled(i);
        let detected = Detected {
            stick_slip_cycles_per_s: cycles / time,
            stick_time_fraction: stuck_ticks * common.period / time,
            stairs_per_s: self.stairs.since_settled(i).0 / time,
            ..Detected::default()
        };
        Some((metrics, detected))
    }
}

/// The motions that wait, piece by piece, as many at once as there are lanes; what follows a stop one by one.
#[inline(always)]
fn through_the_layer<V: Lane>(
    chunks: &mut [Chunk<'_, V>],
    waiting: &mut Vec<Waiting>,
    time: f64,
    common: &Common,
    events: &mut Vec<Event>,
) {
    let whole = V::splat(common.period);
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
                let chunk = &mut chunks[waiting[at].chunk];
                let is = |bits: u64| bits >> i & 1 == 1;
                if is(ends) {
                    chunk.ends(&waiting[at], (state.speed.lane(i), state.way.lane(i)), time);
                    continue;
                }
                if is(done) {
                    waiting[at].state = state.lane(i);
                }
                if is(done & !stops) {
                    waiting.swap(left, at);
                    left += 1;
                } else {
                    chunk.alone(&waiting[at], is(done & stops), time, common, events);
                }
            }
        }
        waiting.truncate(left);
    }
    // Alone they say so.
    waiting.drain(..).for_each(|w| chunks[w.chunk].lost |= 1 << w.lane);
}

impl<'a, V: Lane> Chunk<'a, V> {
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
    fn alone(&mut self, w: &Waiting, stops: bool, time: f64, common: &Common, events: &mut Vec<Event>) {
        let Waiting { lane, flow, state, .. } = *w;
        let stuck = w.breaks_away;
        let mut shaft = Shaft::new(self.position.lane(lane), self.velocity.lane(lane));
        shaft.motion = if stuck { Motion::Stuck } else { Motion::along(w.sign) };
        events.clear();
        let moved = match &self.moves {
            Moves::Exactly { alone, .. } => {
                let begun = Some((flow, state, stops));
                alone[lane].advance(&w.pushed, (time, common.period), &mut shaft, events, begun).is_ok()
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
    pub(super) fn steps(&self) -> Option<&InSteps<'a, V>> {
        match &self.moves {
            Moves::Exactly { .. } => None,
            Moves::InSteps(steps) => Some(steps),
        }
    }

    /// As [`Chunk::steps`].
    #[inline(always)]
    pub(super) fn steps_mut(&mut self) -> Option<&mut InSteps<'a, V>> {
        match &mut self.moves {
            Moves::Exactly { .. } => None,
            Moves::InSteps(steps) => Some(steps),
        }
    }
}
