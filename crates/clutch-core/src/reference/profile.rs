//! Paths made of polynomial pieces: ramp, trapezoid, jerk-limited, minimum jerk.

use super::scale::{Scale, advance};
use super::target::Target;
use crate::params::{Range, Table};
use crate::{FixedCounts, ParamError, Planned, Real};

crate::params! {
    /// Constant rate from the first tick: the paper's path.
    pub struct Ramp<T> {
        /// Rate, to which the velocity jumps at the start; with a brake above 0.
        rate: T, "rate_deg_s" "" DEG_S, Range::ANY;
    }
    relations(p) {
        /// Counts hold the rate.
        RATE: rate, "a finite rate below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s";
    }
}

crate::params! {
    /// Rest to rest with a trapezoidal velocity; a triangle where the distance is too short.
    pub struct Trapezoid<T> {
        /// Distance. Either sign; with a brake above 0.
        distance: T, "distance_deg" "" DEG, Range::ANY;
        /// Highest speed.
        speed: T, "speed_deg_s" "" DEG_S, Range::above(0.0);
        /// Acceleration and deceleration.
        acceleration: T, "acceleration_deg_s2" "" DEG_S2, Range::above(0.0);
    }
    relations(p) {
        /// Counts hold the distance.
        DISTANCE: distance, "a finite distance below 1e12 counts of rig.encoder.counts_per_rev, °";
        /// Counts hold the speed.
        SPEED: speed, "a finite speed below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s";
        /// The speed ends the path.
        SPEED_ENDS: speed, "a speed high enough to be through with distance_deg within 1e15 periods, °/s";
        /// The acceleration ends the path.
        ACCELERATION_ENDS: acceleration, "an acceleration high enough to be through with distance_deg within 1e15 periods, °/s²";
    }
}

crate::params! {
    /// Rest to rest with bounded jerk: seven pieces, fewer where a bound is not reached.
    pub struct JerkLimited<T> {
        /// Distance. Either sign; with a brake above 0.
        distance: T, "distance_deg" "" DEG, Range::ANY;
        /// Highest speed.
        speed: T, "speed_deg_s" "" DEG_S, Range::above(0.0);
        /// Highest acceleration and deceleration.
        acceleration: T, "acceleration_deg_s2" "" DEG_S2, Range::above(0.0);
        /// Highest jerk.
        jerk: T, "jerk_deg_s3" "" DEG_S3, Range::above(0.0);
    }
    relations(p) {
        /// Counts hold the distance.
        DISTANCE: distance, "a finite distance below 1e12 counts of rig.encoder.counts_per_rev, °";
        /// Counts hold the speed.
        SPEED: speed, "a finite speed below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s";
        /// The speed ends the path.
        SPEED_ENDS: speed, "a speed high enough to be through with distance_deg within 1e15 periods, °/s";
        /// The acceleration ends the path.
        ACCELERATION_ENDS: acceleration, "an acceleration high enough to be through with distance_deg within 1e15 periods, °/s²";
        /// The jerk ends the path.
        JERK_ENDS: jerk, "a jerk high enough to be through with distance_deg within 1e15 periods, °/s³";
    }
}

crate::params! {
    /// Rest to rest along `10 s³ − 15 s⁴ + 6 s⁵`, `s = t/duration` (Flash and Hogan 1985).
    pub struct MinimumJerk<T> {
        /// Distance. Either sign; with a brake above 0.
        distance: T, "distance_deg" "" DEG, Range::ANY;
        /// Time of the path.
        duration: T, "duration_s" "" S, Range::above(0.0).up_to(1e6);
    }
    relations(p) {
        /// Counts hold the distance.
        DISTANCE: distance, "a finite distance below 1e12 counts of rig.encoder.counts_per_rev, °";
        /// Ticks resolve the time.
        DURATION: duration, "a time of at least sampling.period_us, s";
        /// Counts hold the speed.
        STEEP: duration, "a time in which the highest speed stays below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, s";
    }
}

/// One piece: from its first tick until the next piece's.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece<T> {
    first_tick: u64,
    /// Position at the first tick.
    base: FixedCounts,
    /// The linear part, 2⁻⁴⁰ counts per tick.
    rate: i64,
    /// The same in rad/s.
    velocity: T,
    /// Coefficients of τ², τ³, τ⁴, τ⁵ in rad.
    c: [T; 4],
}

impl<T: Real> Piece<T> {
    fn resting(first_tick: u64, base: FixedCounts) -> Self {
        Piece { first_tick, base, rate: 0, velocity: T::ZERO, c: [T::ZERO; 4] }
    }

    /// Position `ticks` whole ticks and `rest` seconds after the first tick.
    fn position(&self, ticks: u64, rest: T, scale: &Scale<T>) -> FixedCounts {
        let tau = scale.seconds(ticks) + rest;
        let [c2, c3, c4, c5] = self.c;
        let curved = tau * tau * (c2 + tau * (c3 + tau * (c4 + tau * c5)));
        self.base.plus(advance(self.rate, ticks)).plus(scale.distance(curved + self.velocity * rest))
    }

    fn velocity(&self, tau: T) -> T {
        let [c2, c3, c4, c5] = self.c;
        let n = T::from_i32;
        self.velocity + tau * (n(2) * c2 + tau * (n(3) * c3 + tau * (n(4) * c4 + tau * n(5) * c5)))
    }

    fn acceleration(&self, tau: T) -> T {
        let [c2, c3, c4, c5] = self.c;
        let n = T::from_i32;
        n(2) * c2 + tau * (n(6) * c3 + tau * (n(12) * c4 + tau * n(20) * c5))
    }
}

/// Seven pieces of a jerk-limited move and the rest after it.
const PIECES: usize = 8;

/// A path of polynomial pieces that begins at position 0; unused ones repeat the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile<T> {
    pieces: [Piece<T>; PIECES],
    scale: Scale<T>,
}

impl<T: Real> Profile<T> {
    pub(super) fn ramp(p: &Ramp<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        Ok(Profile::at_rate(Ramp::RATE.require(p.rate, scale.holds_rate(p.rate))?, scale))
    }

    pub(super) fn at_rate(rate: T, scale: Scale<T>) -> Self {
        let first = Piece { rate: scale.rate(rate), velocity: rate, ..Piece::resting(0, FixedCounts(0)) };
        Profile { pieces: [first; PIECES], scale }
    }

    pub(super) fn trapezoid(p: &Trapezoid<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        Trapezoid::DISTANCE.require(p.distance, scale.holds_distance(p.distance))?;
        Trapezoid::SPEED.require(p.speed, scale.holds_rate(p.speed))?;
        let (speed, a, length) = (p.speed, p.acceleration, p.distance.abs());
        Trapezoid::SPEED_ENDS.require(speed, scale.counts_time(length / speed))?;
        Trapezoid::ACCELERATION_ENDS.require(a, scale.counts_time((length / a).sqrt()))?;
        let speed = speed.min((length * a).sqrt());
        let rise = speed / a;
        let cruise = if speed > T::ZERO { (length / speed - rise).max(T::ZERO) } else { T::ZERO };
        let a = a * p.distance.sgn();
        Ok(Builder::new(scale)
            .add(rise, a, T::ZERO)
            .add(cruise, T::ZERO, T::ZERO)
            .add(rise, -a, T::ZERO)
            .stop(p.distance))
    }

    pub(super) fn jerk_limited(p: &JerkLimited<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        JerkLimited::DISTANCE.require(p.distance, scale.holds_distance(p.distance))?;
        JerkLimited::SPEED.require(p.speed, scale.holds_rate(p.speed))?;
        let (speed, a, j) = (p.speed, p.acceleration, p.jerk);
        let (length, two) = (p.distance.abs(), T::from_i32(2));
        // The time of half the move if nothing but the jerk were bounded.
        let by_jerk = (length / (two * j)).powf(T::ONE / T::from_i32(3));
        JerkLimited::SPEED_ENDS.require(speed, scale.counts_time(length / speed))?;
        JerkLimited::ACCELERATION_ENDS.require(a, scale.counts_time((length / a).sqrt()))?;
        JerkLimited::JERK_ENDS.require(j, scale.counts_time(by_jerk))?;
        // The peak speed for which rise and fall alone make up the distance.
        let highest = if j * by_jerk <= a {
            j * by_jerk * by_jerk
        } else {
            let ramp = a / j;
            a / two * ((ramp * ramp + T::from_i32(4) * length / a).sqrt() - ramp)
        };
        let v = speed.min(highest);
        // Time to build up the acceleration, and to reach speed v.
        let reaches_a = v * j > a * a;
        let ramp = if reaches_a { a / j } else { (v / j).sqrt() };
        let rise = if reaches_a { ramp + v / a } else { two * ramp };
        let flat = (rise - two * ramp).max(T::ZERO);
        let cruise = if v > T::ZERO { (length / v - rise).max(T::ZERO) } else { T::ZERO };
        let sign = p.distance.sgn();
        let (peak, j) = (j * ramp * sign, j * sign);
        Ok(Builder::new(scale)
            .add(ramp, T::ZERO, j)
            .add(flat, peak, T::ZERO)
            .add(ramp, peak, -j)
            .add(cruise, T::ZERO, T::ZERO)
            .add(ramp, T::ZERO, -j)
            .add(flat, -peak, T::ZERO)
            .add(ramp, -peak, j)
            .stop(p.distance))
    }

    pub(super) fn minimum_jerk(p: &MinimumJerk<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?; // the fifth power of the longest time fits f32
        MinimumJerk::DISTANCE.require(p.distance, scale.holds_distance(p.distance))?;
        let d = MinimumJerk::DURATION.require(p.duration, p.duration >= scale.period)?;
        // The steepest point of the polynomial is 15/8 of the mean rate.
        MinimumJerk::STEEP.require(d, scale.holds_rate(T::from_f64(1.875) * p.distance / d))?;
        let c3 = T::from_i32(10) * p.distance / (d * d * d);
        let c4 = T::from_i32(-15) * p.distance / (d * d * d * d);
        let c5 = T::from_i32(6) * p.distance / (d * d * d * d * d);
        let mut builder = Builder::new(scale);
        builder.push(Piece { c: [T::ZERO, c3, c4, c5], ..Piece::resting(0, FixedCounts(0)) });
        (builder.ticks, builder.rest) = builder.split(d);
        Ok(builder.stop(p.distance))
    }

    pub(super) fn at(&self, tick: u64) -> Target<T> {
        // The last of the pieces that have begun; pieces shorter than a tick are passed over.
        let Some(piece) = self.pieces.iter().rev().find(|p| p.first_tick <= tick) else {
            return Target::default();
        };
        let ticks = tick.wrapping_sub(piece.first_tick);
        let tau = self.scale.seconds(ticks);
        Target {
            position: piece.position(ticks, T::ZERO, &self.scale),
            velocity: piece.velocity(tau),
            acceleration: piece.acceleration(tau),
        }
    }
}

impl<T: Real> Planned<T> for Profile<T> {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        self.at(tick)
    }
}

/// Adds piece after piece, carrying position and velocity across their borders.
///
/// Time is whole ticks and a rest, so that a long path in `f32` loses nothing at its borders.
struct Builder<T> {
    profile: Profile<T>,
    used: usize,
    /// Whole ticks before the end of the last piece.
    ticks: u64,
    /// From there to the end, s: at least 0, below a period.
    rest: T,
    /// Position and velocity at the end.
    position: FixedCounts,
    velocity: T,
}

impl<T: Real> Builder<T> {
    fn new(scale: Scale<T>) -> Self {
        let profile = Profile { pieces: [Piece::resting(0, FixedCounts(0)); PIECES], scale };
        Builder { profile, used: 0, ticks: 0, rest: T::ZERO, position: FixedCounts(0), velocity: T::ZERO }
    }

    /// The first tick at or after the end of the last piece, and how far away it is, s.
    fn next_tick(&self) -> (u64, T) {
        if self.rest > T::ZERO {
            (self.ticks.saturating_add(1), (self.profile.scale.period - self.rest).max(T::ZERO))
        } else {
            (self.ticks, T::ZERO)
        }
    }

    /// A time in whole ticks and a rest.
    fn split(&self, duration: T) -> (u64, T) {
        let period = self.profile.scale.period;
        let whole = (duration / period).floor().max(T::ZERO);
        (whole.to_i64() as u64, (duration - whole * period).max(T::ZERO).min(period))
    }

    /// A piece of constant jerk; one that takes no time is left out.
    fn add(mut self, duration: T, acceleration: T, jerk: T) -> Self {
        let c3 = jerk / T::from_i32(6);
        let c2 = acceleration / T::from_i32(2);
        let (two, three) = (T::from_i32(2), T::from_i32(3));
        let moved = |v: T, t: T| t * (v + t * (c2 + t * c3));
        let faster = |t: T| t * (two * c2 + t * three * c3);
        let scale = self.profile.scale;
        let (first_tick, late) = self.next_tick();
        if duration > late {
            // The same polynomial, seen from its first tick.
            let velocity = self.velocity + faster(late);
            let piece = self.push(Piece {
                first_tick,
                base: self.position.plus(scale.distance(moved(self.velocity, late))),
                rate: scale.rate(velocity),
                velocity,
                c: [c2 + three * c3 * late, c3, T::ZERO, T::ZERO],
            });
            let span = duration - late;
            let (ticks, rest) = self.split(span);
            self.ticks = first_tick.saturating_add(ticks);
            self.rest = rest;
            self.position = piece.position(ticks, rest, &scale);
            self.velocity = piece.velocity(span);
        } else if duration > T::ZERO {
            // Over before a tick sees it. It must not be extrapolated to that tick: a piece may
            // be this short because its acceleration or jerk is beyond measure.
            self.position = self.position.plus(scale.distance(moved(self.velocity, duration)));
            self.velocity += faster(duration);
            self.rest += duration;
        }
        self
    }

    fn push(&mut self, piece: Piece<T>) -> Piece<T> {
        if let Some(slot) = self.profile.pieces.get_mut(self.used) {
            *slot = piece;
            self.used = self.used.saturating_add(1);
        }
        piece
    }

    /// At rest from here on, exactly at the distance asked for.
    fn stop(mut self, distance: T) -> Profile<T> {
        let piece = Piece::resting(self.next_tick().0, self.profile.scale.distance(distance));
        while self.used < PIECES {
            self.push(piece);
        }
        self.profile
    }
}
