//! The edge-timed filter: position, velocity and friction from the edges of an encoder, and from the silence between
//! them.
//!
//! At 2 °/s a count of the paper's encoder takes 9 ms. A difference of counts knows the velocity only as a mean over
//! several of them; but a crossed edge is a position that is known to a fraction of a count, at a time known to a
//! period, and a count that does not come says that the shaft has not got there. A Kalman filter that takes both, and
//! knows the voltage, finds velocity and friction within a count. It has five states: position, velocity, the mean
//! friction as a multiple of the model's (whose curve over the velocity stays, if it is Stribeck's with the exponent
//! 1), and its ripple along the disc as a damped wave of random phase with its slope ([`EdgeTimedParams`] has the
//! wave's numbers). Friction is smooth along the way, not in time: that is why it can be foreseen.
//!
//! An edge that was crossed in the last period lies at most the way of that period behind, with the variance of a
//! uniform distribution. Silence cuts the belief off at the edges of the count. A shaft without an edge for longer
//! than the path may take for `silence_counts`, and sooner if it was to gain on the path, is taken to rest: friction
//! learnt since the last edge is forgotten, as it is that of a shaft at rest, and the filter says so
//! ([`EdgeTimedState::starts`]), so that a law can let the brake go for some periods. If then no edge comes in 25 ms
//! (and twice the lag, and the delay), friction is above what the voltage would have carried; and if that has failed
//! twice, a brake is let go until an edge comes. A single count back of a shaft that only a brake holds is none: a
//! channel that is dead counts to and fro.

mod belief;
mod beside_map;

use crate::friction::{FrictionModel, Stribeck};
use crate::params::{Range, Table};
use crate::{Actuator, ActuatorKind, Encoder, FixedCounts, Micros, ParamError, Place, Plant, Real};
use belief::{Belief, Friction, Shaft, Surprise, at_pad};
pub(crate) use beside_map::{BesideMap, BesideMapState};

crate::params! {
    /// A Kalman filter that is corrected where an edge of the encoder is crossed, and by silence between edges. It
    /// knows the voltage and, from the model, drive torque over inertia; friction it learns.
    pub struct EdgeTimedParams<T>: Default {
        /// Periods from a voltage to its effect, beyond the one in which it is given: `rig.delay_ticks` as believed.
        delay: u32 = 0, "delay_ticks" "" TICKS, Range::within(0.0, 3.0);
        /// Time constant of the actuator, as believed; 0 for one without a lag.
        lag: T = 0.0, "lag_s" "τ" S, Range::at_least(0.0);
        /// Standard deviation of friction at the start, as a share of the model's.
        friction_doubt: T = 0.25, "friction_doubt" "" NONE, Range::above(0.0).up_to(10.0);
        /// Root mean square of the ripple along the disc, as a share of friction.
        ripple: T = 0.15, "ripple_share" "" NONE, Range::above(0.0).up_to(1.0);
        /// Waves of the ripple per turn.
        waves: T = 340.0, "ripple_waves_per_turn" "k" WAVES_PER_TURN, Range::above(0.0).up_to(1e6);
        /// Damping of the ripple's waves: small for a ripple of one wavelength.
        ripple_damping: T = 0.2, "ripple_damping" "ζ" NONE, Range::above(0.0).up_to(1.0);
        /// Wander of the velocity that no friction explains: by this much (standard deviation) in one second, and with
        /// the root of the time.
        walk: T = 0.015, "walk_rad_s_rt_s" "" RAD_S_RT_S, Range::above(0.0);
        /// Share of an acceleration that may be wrong, as drive torque and inertia are not known better.
        gain_doubt: T = 0.3, "gain_doubt" "" NONE, Range::at_least(0.0).up_to(2.0);
        /// Counts that the path may go on without an edge before the shaft is taken to rest.
        silence: T = 3.0, "silence_counts" "" COUNTS, Range::above(1.0).up_to(1000.0);
    }
    relations(p) {
        /// The waves are resolved.
        RESOLVED: waves, "a number below a twentieth of rig.encoder.counts_per_rev: an encoder sees no shorter wave";
        /// Periods count the lag.
        LAG_COUNTED: lag, "a time below 1000 times sampling.period_us";
    }
}

/// Counts that a wave of the ripple has to have, more than these.
const COUNTS_PER_WAVE: i32 = 20;

/// So many waves of the ripple per turn, or the most that an encoder of so many counts shows.
#[must_use]
pub fn waves_seen(waves: f64, counts_per_rev: u32) -> f64 {
    waves.min(0.99 * f64::from(counts_per_rev) / f64::from(COUNTS_PER_WAVE))
}

/// Standard deviation by which the end of a count is blurred where silence cuts the belief off, counts.
const BLUR: f64 = 0.15;
/// Time in which an edge has to come once the shaft was let go, s.
const PATIENCE: f64 = 0.025;
/// Longest time for which a shaft is let go at once, s: the paper's weight reaches 400 °/s in it.
const LONGEST_RELEASE: f64 = 0.25;
/// Twice the way of a fall in which an edge has to come, counts: one, and half of it for a drive that is weaker.
const FALL: f64 = 3.0;
/// Most of the velocity that a falling friction adds to an error of the velocity in a period.
const FASTEST_FALL: f64 = 0.3;
/// Friction of a shaft that stays at rest, as a multiple of what the voltage carried.
const ABOVE: f64 = 1.134;

/// The filter, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeTimed<T> {
    shaft: Shaft<T>,
    actuator: Actuator<T>,
    /// The model's friction: its curve over the velocity, where it is Stribeck's with the exponent 1; its sliding
    /// level, and one over that.
    curve: Option<Stribeck<T>>,
    mu: T,
    per_mu: T,
    drive_torque: T,
    /// Acceleration of a torque, counts per period² and N m.
    per_torque: T,
    brake: Option<Brake<T>>,
    counts_per_radian: T,
    radians_per_count: T,
    /// Counts per period of 1 rad/s, and one over it.
    per_rad_per_s: T,
    rad_per_s: T,
    delay: u32,
    /// Share of a step of the voltage that a lagging actuator has not made after a period; 0 without a lag.
    lagging: T,
    /// Periods of the lag.
    lag_periods: T,
    silence: T,
    patience: T,
    /// Most periods for which a shaft is let go at once.
    longest_release: T,
    doubt: T,
    ripple: T,
    wave: T,
    /// Variance by which the end of a count is blurred where silence cuts the belief off, counts².
    blur: T,
}

/// Effect of a brake on the shaft, counts per period²: the pull of the drive, and the load of the pad per volt and
/// without one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Brake<T> {
    pull: T,
    gain: T,
    preload: T,
}

/// Motion, as far as the filter knows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)] // a board copies a state without bytes of its own by words
enum Phase {
    /// At rest, or never seen to move.
    #[default]
    Resting,
    /// Let go from rest; no edge has come yet.
    Starting,
    /// Edges come.
    Sliding,
}

/// Memory of the filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeTimedState<T> {
    belief: Belief<T>,
    /// Friction as believed at the last edge.
    at_edge: Friction<T>,
    /// Whole counts of the last sample; of a brake's shaft, before a single count back.
    counts: i64,
    /// Position above them, for a sensor finer than a count.
    fraction: T,
    /// Voltages on their way, the newest first, V.
    line: [T; 3],
    /// Voltage at the pad, V.
    pad: T,
    /// Periods since the last edge, or since the shaft was let go.
    silent: T,
    /// Counts that it was to gain on the path since.
    gains: T,
    /// Periods for which the shaft has still to be let go.
    release: T,
    /// Rests, of which each four edges make up for one.
    rests: T,
    phase: Phase,
    /// Starts in a row that brought no edge.
    unmoved: T,
    /// The edge of the last period; no variance where there was none, or the shaft did not slide.
    surprise: Surprise<T>,
}

impl<T: Real> EdgeTimedState<T> {
    /// `true` if the shaft is taken to rest.
    #[must_use]
    pub fn rests(&self) -> bool {
        self.phase == Phase::Resting
    }

    /// `true` until the first edge after a rest: friction is that of a place where it is not known.
    #[must_use]
    pub fn starts(&self) -> bool {
        self.phase != Phase::Sliding
    }

    /// `true` in a period in which the shaft has to be let go.
    #[must_use]
    pub fn lets_go(&self) -> bool {
        self.release > T::ZERO
    }

    /// `true` for some edges after a rest.
    pub(crate) fn has_rested(&self) -> bool {
        self.rests > T::ZERO
    }

    /// Friction, as a multiple of the model's, and its variance.
    pub(crate) fn friction(&self) -> (T, T) {
        (self.belief.friction.level(), self.belief.friction.variance())
    }

    /// Distance of the last period's edge from where it was foreseen; no variance without one that a sliding shaft crossed.
    pub(crate) fn surprise(&self) -> Surprise<T> {
        self.surprise
    }

    /// Velocity, counts per period.
    #[must_use]
    pub fn velocity(&self) -> T {
        self.belief.motion.velocity
    }

    /// Position of the sensor above the lower edge of its count, counts: 0 for an encoder, and −1 where that has come
    /// back by a count, as no shaft with a brake does.
    #[must_use]
    pub fn fraction(&self) -> T {
        self.fraction
    }
}

/// The shaft at the time at which a voltage given now takes effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ahead<T> {
    /// Position above the lower edge of the last count, counts.
    pub position: T,
    /// Velocity, counts per period.
    pub velocity: T,
    /// Friction, as a multiple of the model's.
    pub friction: T,
    /// Its variance.
    pub variance: T,
    /// Voltage at the pad, V.
    pub pad: T,
}

/// Friction so many counts above the edge, over its mean: of a map, if there is one.
#[inline]
pub(crate) fn friction_at<T: Real>(place: Option<&Place<T>>, counts: T) -> T {
    place.map_or(T::ONE, |place| place.friction(counts))
}

impl<T: Real> EdgeTimed<T> {
    /// Checks the parameters. Drive torque, inertia, damping and actuator are those of `plant`, its friction the first
    /// guess.
    ///
    /// # Errors
    /// The first parameter out of range; waves that the encoder does not resolve; `period` out of range.
    #[inline(never)]
    pub fn new(
        p: &EdgeTimedParams<T>,
        plant: &Plant<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let seconds = period.period::<T>()?;
        let twentieth = T::from_u64(u64::from(encoder.counts_per_rev())) / T::from_i32(COUNTS_PER_WAVE);
        EdgeTimedParams::RESOLVED.require(p.waves, p.waves < twentieth)?;
        EdgeTimedParams::LAG_COUNTED.require(p.lag, p.lag < T::from_i32(1000) * seconds)?;
        let model = plant.params();
        let radians_per_count = encoder.radians_per_count::<T>();
        let wave = p.waves * radians_per_count;
        let decay = (p.ripple_damping + p.ripple_damping) * wave;
        let walk = p.walk * seconds.sqrt() * seconds / radians_per_count;
        let (actuator, mu) = (*plant.actuator(), plant.friction().sliding());
        let per_torque = seconds * seconds / (model.inertia * radians_per_count);
        let pressed = mu * per_torque;
        let brake = Brake {
            pull: model.drive_torque * per_torque,
            gain: pressed * actuator.brake_gain(),
            preload: pressed * actuator.preload(),
        };
        Ok(EdgeTimed {
            shaft: Shaft {
                damping: model.viscous_damping * seconds / model.inertia,
                stiffness: wave * wave,
                decay,
                walk: walk * walk,
                gain_doubt: p.gain_doubt,
                // With it the wave's variance stays what it is.
                roughness: (decay + decay) * (wave * wave) * (p.ripple * p.ripple),
            },
            actuator,
            curve: plant.friction().curve().filter(Stribeck::is_quick),
            drive_torque: model.drive_torque,
            per_torque,
            brake: (actuator.kind() == ActuatorKind::Brake).then_some(brake),
            mu,
            per_mu: T::ONE / mu,
            counts_per_radian: encoder.counts_per_radian(),
            radians_per_count,
            per_rad_per_s: seconds / radians_per_count,
            rad_per_s: radians_per_count / seconds,
            delay: p.delay,
            lagging: if p.lag > T::ZERO { (-(seconds / p.lag)).exp() } else { T::ZERO },
            lag_periods: p.lag / seconds,
            silence: p.silence,
            longest_release: T::from_f64(LONGEST_RELEASE) / seconds,
            patience: T::from_f64(PATIENCE) / seconds
                + (p.lag + p.lag) / seconds
                + T::from_u64(u64::from(p.delay)),
            doubt: p.friction_doubt,
            ripple: p.ripple,
            wave,
            blur: T::splat(BLUR * BLUR),
        })
    }

    /// Counts per period of a velocity in rad/s.
    #[inline]
    #[must_use]
    pub fn per_period(&self, velocity: T) -> T {
        velocity * self.per_rad_per_s
    }

    /// The velocity in rad/s of one in counts per period.
    #[inline]
    #[must_use]
    pub fn rad_per_s(&self, velocity: T) -> T {
        velocity * self.rad_per_s
    }

    /// Counts per radian.
    #[must_use]
    pub fn counts_per_radian(&self) -> T {
        self.counts_per_radian
    }

    /// One count, rad.
    #[must_use]
    pub fn radians_per_count(&self) -> T {
        self.radians_per_count
    }

    /// The model's sliding friction, of which friction is given as a multiple.
    #[must_use]
    pub fn mu(&self) -> T {
        self.mu
    }

    /// The state for a shaft at `position`, with `applied` volts on the actuator since long. Nobody knows whether it
    /// rests or moves with the path, at `target_velocity`, rad/s.
    #[must_use]
    pub fn start(&self, position: FixedCounts, applied: T, target_velocity: T) -> EdgeTimedState<T> {
        let mut state = EdgeTimedState::default();
        self.start_in(&mut state, position, applied, target_velocity);
        state
    }

    /// As [`EdgeTimed::start`], in its place: no second state is on the stack of a board, and none is copied.
    #[inline(never)]
    pub(crate) fn start_in(
        &self,
        state: &mut EdgeTimedState<T>,
        position: FixedCounts,
        applied: T,
        target_velocity: T,
    ) {
        *state = EdgeTimedState::default();
        let belief = &mut state.belief;
        belief.rest();
        let pace = self.per_period(target_velocity);
        // A target that is not a number, or beyond measure, is none that it moves with.
        belief.ww = if pace.abs() < T::splat(1e6) { pace * pace } else { T::ZERO };
        let friction = &mut belief.friction;
        friction.mean = T::ONE;
        friction.hh = self.doubt * self.doubt;
        friction.rr = self.ripple * self.ripple;
        friction.ss = friction.rr * self.wave * self.wave;
        state.at_edge = *friction;
        state.counts = position.0 >> FixedCounts::FRACTION_BITS;
        state.line = [applied; 3];
        state.pad = applied;
        self.place(state, position);
    }

    /// Lets a resting shaft go: for as many periods as the drive takes to bring it to the path's velocity, rad/s, and
    /// an actuator to give way, a quarter of a second at most. A law then releases the actuator while
    /// [`EdgeTimedState::lets_go`].
    ///
    /// A brake lets go until an edge comes, after two starts in a row that brought none: no shaft falls for longer than a
    /// count, so that a fall of which nothing comes is a broken encoder, which a supervisor then sees.
    #[inline(never)] // seldom, and of two filters
    pub fn let_go(&self, state: &mut EdgeTimedState<T>, target_velocity: T) {
        let pull = self.forces(T::ZERO).0.abs().max(T::splat(1e-6));
        let needed = if state.unmoved >= T::splat(2.0) && self.actuator.kind() == ActuatorKind::Brake {
            (T::splat(FALL) / pull).sqrt() + T::ONE
        } else {
            self.per_period(target_velocity).abs() / pull
        };
        let periods = needed.min(self.longest_release) + T::splat(0.7) * self.lag_periods;
        // To the nearest whole number; one at least.
        state.release = (periods + T::splat(0.5)).floor().max(T::ONE);
        (state.silent, state.gains) = (T::ZERO, T::ZERO);
        state.phase = Phase::Starting;
    }

    /// The shaft when a voltage given now takes effect.
    #[must_use]
    #[inline(never)]
    pub fn ahead(&self, state: &EdgeTimedState<T>) -> Ahead<T> {
        self.ahead_on(state, None)
    }

    /// As [`EdgeTimed::ahead`], where friction is known beside its mean.
    #[inline(never)]
    pub(crate) fn ahead_on(&self, state: &EdgeTimedState<T>, place: Option<&Place<T>>) -> Ahead<T> {
        let friction = &state.belief.friction;
        let (mut motion, mut ripple) = (state.belief.motion, friction.ripple);
        let back = Self::back(state);
        let mut pad = state.pad;
        // The voltages on their way, the oldest first.
        let line = state.line.get(..self.delay as usize).unwrap_or(&state.line);
        for arrived in line.iter().rev() {
            let (volts, end) = self.at_pad(pad, *arrived);
            pad = end;
            let (pull, load) = self.forces(volts);
            let load = load * friction_at(place, motion.position + back) * self.shape(motion.velocity);
            let (way, ..) = motion.glide(&self.shaft, pull, load, at_pad(friction.mean, ripple));
            ripple += way * friction.slope;
        }
        // In the middle of the period.
        let way = T::splat(0.5) * motion.velocity;
        ripple += way * friction.slope;
        let here = friction_at(place, motion.position + way + back);
        Ahead {
            position: motion.position,
            velocity: motion.velocity,
            friction: at_pad(friction.mean, ripple) * here,
            variance: friction.variance() * (here * here),
            pad,
        }
    }

    /// The voltage to give so that one of `volts` is at the pad at the end of the period in which it takes effect.
    #[inline]
    #[must_use]
    pub fn through_lag(&self, volts: T, pad: T) -> T {
        if self.lagging > T::ZERO { pad + (volts - pad) / (T::ONE - self.lagging) } else { volts }
    }

    /// Periods from a voltage to its effect, beyond the one in which it is given.
    #[must_use]
    pub fn delay(&self) -> T {
        T::from_u64(u64::from(self.delay))
    }

    /// Periods of the actuator's lag.
    pub(crate) fn lag(&self) -> T {
        self.lag_periods
    }

    /// Periods in which an edge has to come after a start.
    #[must_use]
    pub fn patience(&self) -> T {
        self.patience
    }

    fn place(&self, state: &mut EdgeTimedState<T>, position: FixedCounts) -> T {
        let read = position.0 >> FixedCounts::FRACTION_BITS;
        // A brake that only resists turns no shaft round: a single count back is the edge's own, or a broken channel's.
        let back = !self.actuator.kind().two_sided() && read == state.counts.wrapping_sub(1);
        let counts = if back { state.counts } else { read };
        let moved = counts.wrapping_sub(state.counts);
        state.counts = counts;
        // Both fit: a board converts 32 bits in one instruction.
        let fraction = position.0.wrapping_sub(FixedCounts::from_counts(counts).0);
        state.fraction =
            T::from_i32(fraction as i32) * (T::ONE / T::from_i32(1 << FixedCounts::FRACTION_BITS));
        T::from_i32(i32::try_from(moved).unwrap_or(if moved < 0 { i32::MIN } else { i32::MAX }))
    }

    /// Count from the edge that positions begin at down to the one of the last sample: 1 of a count back that is none.
    fn back(state: &EdgeTimedState<T>) -> T {
        if state.fraction < T::ZERO { T::ONE } else { T::ZERO }
    }

    /// Pull of drive and motor, and load of the pad, at a voltage there, counts per period².
    #[inline]
    pub(crate) fn forces(&self, volts: T) -> (T, T) {
        match &self.brake {
            // The same numbers, of which most stay.
            Some(brake) => (brake.pull, brake.gain * volts.max(T::ZERO) + brake.preload),
            None => self.forces_of_motor(volts),
        }
    }

    #[inline(never)]
    fn forces_of_motor(&self, volts: T) -> (T, T) {
        let pull = (self.drive_torque + self.actuator.torque(volts)) * self.per_torque;
        (pull, self.actuator.friction(self.mu * self.per_torque, volts))
    }

    /// Friction at a velocity, counts per period, as a multiple of that of a fast shaft, where the model's curve is
    /// Stribeck's with the exponent 1; else 1.
    #[inline]
    #[must_use]
    pub fn shape(&self, velocity: T) -> T {
        match &self.curve {
            Some(curve) if !curve.quick_has_vanished(self.rad_per_s(velocity)) => {
                self.falling_shape(curve, velocity)
            }
            Some(_) => self.mu * self.per_mu,
            None => T::ONE,
        }
    }

    #[inline(never)] // asked for in several places: a board needs the code once
    fn falling_shape(&self, curve: &Stribeck<T>, velocity: T) -> T {
        curve.quick_level(self.rad_per_s(velocity)) * self.per_mu
    }

    /// The shape, and what it loses per count per period: a shaft that gains speed loses friction. One that is
    /// believed to have stopped loses none.
    fn shape_and_fall(&self, velocity: T) -> (T, T) {
        let shape = self.shape(velocity);
        // The curve falls no more where it has ended.
        let ended = |curve: &Stribeck<T>| curve.quick_has_vanished(self.rad_per_s(velocity));
        if velocity == T::ZERO || self.curve.as_ref().is_none_or(ended) {
            return (shape, T::ZERO);
        }
        let step = T::splat(0.01);
        (shape, (shape - self.shape(velocity.abs() + step)) / step)
    }

    /// The pad a period later, when `arrived` has come out of the line: its mean voltage and its last.
    fn at_pad(&self, pad: T, arrived: T) -> (T, T) {
        let end = arrived + (pad - arrived) * self.lagging;
        let mean = if self.lagging > T::ZERO { T::splat(0.5) * (pad + end) } else { arrived };
        (mean, end)
    }

    /// The word of a sample by itself: the counts since the last, and the mean voltage at the pad.
    fn hear(&self, state: &mut EdgeTimedState<T>, position: FixedCounts, applied: T) -> (T, T) {
        let moved = self.place(state, position);
        let [newest, middle, oldest] = state.line;
        state.line = [applied, newest, middle];
        let arrived = match self.delay {
            0 => applied,
            1 => newest,
            2 => middle,
            _ => oldest,
        };
        let (volts, end) = self.at_pad(state.pad, arrived);
        state.pad = end;
        (moved, volts)
    }

    /// One sample of a shaft that goes in steps, of which the filter knows nothing: the counts since the last.
    pub(crate) fn stand_aside(&self, state: &mut EdgeTimedState<T>, position: FixedCounts, applied: T) -> T {
        self.hear(state, position, applied).0
    }

    /// The shaft rests at a known position above the lower edge of its count, with a friction that steps have shown; from
    /// here the filter goes on.
    pub(crate) fn take_over(&self, state: &mut EdgeTimedState<T>, position: T, friction: T) {
        let belief = &mut state.belief;
        belief.rest();
        let share = belief.friction.hh / (belief.friction.hh + T::splat(0.2 * 0.2));
        belief.friction.mean += share * (friction - belief.friction.mean);
        belief.friction.hh = belief.friction.hh * (T::ONE - share);
        (belief.friction.hr, belief.friction.hs) = (T::ZERO, T::ZERO);
        belief.motion.position = position;
        state.rests = state.rests.max(T::ONE);
        // Known to the way of a step or two.
        belief.tt = T::splat(0.02);
        belief.friction.know(belief.friction.mean, self.ripple * belief.friction.mean);
        state.at_edge = state.belief.friction;
        (state.silent, state.gains) = (T::ZERO, T::ZERO);
        state.release = T::ZERO;
        state.phase = Phase::Resting;
    }

    /// The state of a filter that knows friction along the disc but for its mean, where `other` knows nothing of the disc: what is
    /// here friction is there the mean times the map's, with its variance and what goes with it.
    #[inline(never)] // of a name, for a board has no map
    pub(crate) fn known_from(&self, other: &EdgeTimedState<T>, place: &Place<T>) -> EdgeTimedState<T> {
        let mut state = *other;
        let per = T::ONE / place.friction(other.belief.motion.position);
        let mean = other.belief.friction.level() * per;
        for known in [&mut state.belief.friction, &mut state.at_edge] {
            *known = Friction { mean, hh: known.variance() * (per * per), ..Friction::default() };
            known.know(mean, self.ripple * mean);
            known.ss = known.rr * self.wave * self.wave;
        }
        let belief = &mut state.belief;
        (belief.th, belief.tr, belief.ts) = ((belief.th + belief.tr) * per, T::ZERO, T::ZERO);
        (belief.wh, belief.wr, belief.ws) = ((belief.wh + belief.wr) * per, T::ZERO, T::ZERO);
        state
    }

    /// One sample: the position now, the voltage that the converter gave since the last sample, and the path's
    /// velocity, rad/s.
    #[inline]
    pub fn update(
        &self,
        state: &mut EdgeTimedState<T>,
        position: FixedCounts,
        applied: T,
        target_velocity: T,
    ) {
        self.update_on(state, position, applied, (target_velocity, T::ZERO), None);
    }

    /// As [`EdgeTimed::update`], where friction is known beside its mean: around the count of this sample. `gains`: counts
    /// that the shaft was to gain on the path in the period, 0 or more, which shorten the silence that is taken for a rest.
    #[inline(never)]
    pub(crate) fn update_on(
        &self,
        state: &mut EdgeTimedState<T>,
        position: FixedCounts,
        applied: T,
        (target_velocity, gains): (T, T),
        place: Option<&Place<T>>,
    ) {
        let (moved, volts) = self.hear(state, position, applied);
        state.surprise = Surprise::default();
        let (pull, load) = self.forces(volts);
        // In the middle of the period that has passed, above the edge of this sample's count.
        let belief = &state.belief;
        let here = belief.motion.position + T::splat(0.5) * belief.motion.velocity - moved;
        let load = load * friction_at(place, here + Self::back(state));
        let way = match state.phase {
            Phase::Resting => T::ZERO,
            Phase::Starting | Phase::Sliding => {
                let (shape, fall) = self.shape_and_fall(state.belief.motion.velocity);
                let fall = (load * fall).min(T::splat(FASTEST_FALL));
                let moves = state.phase == Phase::Sliding;
                state.belief.advance(&self.shaft, pull, (load * shape, fall), moves)
            }
        };
        if moved != T::ZERO {
            self.crossed(state, moved, way);
        } else {
            state.silent += T::ONE;
            state.gains += gains;
            // It says nothing about where a shaft rests.
            if state.phase != Phase::Resting {
                let backward = state.belief.motion.velocity < T::ZERO;
                let (end, side) = if backward { (T::ZERO, -T::ONE) } else { (T::ONE, T::ONE) };
                state.belief.keep_within(end, side, self.blur);
            }
        }
        // A brake that only resists turns no shaft round.
        if !self.actuator.kind().two_sided() {
            state.belief.motion.velocity = state.belief.motion.velocity.max(T::ZERO);
        }
        self.look_for_rest(state, self.per_period(target_velocity), place);
        if !state.belief.is_finite() {
            self.start_in(state, position, applied, target_velocity);
        }
    }

    /// An edge was crossed in the period that has passed, at most its way ago.
    fn crossed(&self, state: &mut EdgeTimedState<T>, moved: T, way: T) {
        let belief = &mut state.belief;
        belief.motion.position -= moved;
        let span = if state.phase == Phase::Resting {
            // It moves after all, nobody knows how fast, nor how far beyond the edge.
            belief.ww += moved * moved;
            T::ONE
        } else {
            way.abs().limit(T::splat(0.02), T::ONE)
        };
        let inside = T::splat(0.5) * span;
        let measured = if moved > T::ZERO { inside } else { T::ONE - inside };
        let surprise = belief.correct(measured, span * span / T::from_i32(12));
        if state.phase == Phase::Sliding {
            state.surprise = surprise;
        }
        state.at_edge = belief.friction;
        (state.silent, state.gains) = (T::ZERO, T::ZERO);
        state.release = T::ZERO;
        state.rests = (state.rests - T::splat(0.25)).max(T::ZERO);
        state.phase = Phase::Sliding;
        state.unmoved = T::ZERO;
    }

    /// `true` if a shaft would have crossed an edge by now: one that follows the path, or, where that rests, one that
    /// has not yet stopped.
    fn too_long(&self, state: &EdgeTimedState<T>, pace: T) -> bool {
        if pace.abs() > T::ZERO {
            state.silent * pace.abs() + state.gains > self.silence
        } else {
            state.silent > self.patience
        }
    }

    /// A shaft that is silent for too long rests. `pace`: the path's velocity, counts per period.
    fn look_for_rest(&self, state: &mut EdgeTimedState<T>, pace: T, place: Option<&Place<T>>) {
        match state.phase {
            Phase::Resting => {}
            Phase::Sliding if self.too_long(state, pace) => {
                // All learnt since the last edge is the friction of a shaft at rest.
                state.belief.friction = state.at_edge;
                state.belief.rest();
                // The more so, the less the last ones have helped.
                state.rests += T::ONE;
                let more = T::splat(0.1) * state.belief.friction.mean * state.rests;
                state.belief.friction.hh += more * more;
                state.phase = Phase::Resting;
            }
            Phase::Sliding => {}
            Phase::Starting if state.release > T::ZERO && pace.abs() > T::ZERO => {
                state.release -= T::ONE;
                (state.silent, state.gains) = (T::ZERO, T::ZERO);
            }
            // A path that has come to rest leaves nothing to be let go for.
            Phase::Starting if state.release > T::ZERO => state.release = T::ZERO,
            Phase::Starting if state.silent > self.patience => {
                // The voltage has stopped it before the next edge: it would have carried no more friction than this.
                let (pull, load) = self.forces(state.pad);
                let load = load * friction_at(place, state.belief.motion.position + Self::back(state));
                let carried = T::splat(ABOVE) * pull.abs() / load.max(T::splat(1e-6));
                let friction = state.belief.friction.level().max(carried.min(T::splat(10.0)));
                state.belief.rest();
                state.belief.friction.know(friction, T::splat(0.15) * state.belief.friction.mean);
                state.phase = Phase::Resting;
                state.unmoved += T::ONE;
            }
            Phase::Starting => {}
        }
    }
}

#[cfg(test)]
mod tests;
