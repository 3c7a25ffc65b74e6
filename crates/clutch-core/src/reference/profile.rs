//! Paths made of polynomial pieces: ramp, trapezoid, jerk-limited, minimum jerk.

use super::{Scale, Target, advance, within_a_turn_per_tick};
use crate::error::require;
use crate::{FixedCounts, ParamError, Real};

/// Rest to rest with a trapezoidal velocity; a triangle where the distance is too short.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Trapezoid<T = f64> {
    /// Distance, rad. Either sign; a brake follows only the sign of its drive.
    pub distance: T,
    /// Highest speed, rad/s.
    pub speed: T,
    /// Acceleration and deceleration, rad/s².
    pub acceleration: T,
}

/// Rest to rest with bounded jerk: seven pieces, fewer where a bound is not reached.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct JerkLimited<T = f64> {
    /// Distance, rad. Either sign; a brake follows only the sign of its drive.
    pub distance: T,
    /// Highest speed, rad/s.
    pub speed: T,
    /// Highest acceleration and deceleration, rad/s².
    pub acceleration: T,
    /// Highest jerk, rad/s³.
    pub jerk: T,
}

/// Rest to rest along `10 s³ − 15 s⁴ + 6 s⁵`, `s = t/duration` (Flash and Hogan 1985).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct MinimumJerk<T = f64> {
    /// Distance, rad. Either sign; a brake follows only the sign of its drive.
    pub distance: T,
    /// Time, s.
    pub duration: T,
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

/// A path of polynomial pieces that begins at position 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Profile<T> {
    pieces: [Piece<T>; PIECES],
    scale: Scale<T>,
}

impl<T: Real> Profile<T> {
    fn at_rest(scale: Scale<T>) -> Self {
        let rest = Piece {
            first_tick: u64::MAX, // never begins
            base: FixedCounts(0),
            rate: 0,
            velocity: T::ZERO,
            c: [T::ZERO; 4],
        };
        Profile { pieces: [rest; PIECES], scale }
    }

    pub(super) fn ramp(rate: T, scale: Scale<T>) -> Self {
        let mut profile = Profile::at_rest(scale);
        if let Some(first) = profile.pieces.first_mut() {
            *first = Piece { first_tick: 0, rate: scale.rate(rate), velocity: rate, ..*first };
        }
        profile
    }

    pub(super) fn trapezoid(p: &Trapezoid<T>, scale: Scale<T>) -> Result<Self, ParamError<T>> {
        require_distance(p.distance, scale)?;
        let speed = require_speed(p.speed, scale)?;
        let a = require(
            "acceleration",
            p.acceleration,
            p.acceleration > T::ZERO,
            "a finite number above 0 rad/s²",
        )?;
        let length = p.distance.abs();
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
        require_distance(p.distance, scale)?;
        let mut v = require_speed(p.speed, scale)?;
        let a = require(
            "acceleration",
            p.acceleration,
            p.acceleration > T::ZERO,
            "a finite number above 0 rad/s²",
        )?;
        let j = require("jerk", p.jerk, p.jerk > T::ZERO, "a finite number above 0 rad/s³")?;
        let (length, two) = (p.distance.abs(), T::from_i32(2));
        // Time to build up the acceleration, and to reach speed v.
        let times = |v: T| {
            let reaches_a = v * j > a * a;
            let ramp = if reaches_a { a / j } else { (v / j).sqrt() };
            (ramp, if reaches_a { ramp + v / a } else { two * ramp })
        };
        let (_, rise) = times(v);
        if length < v * rise {
            // Too short to reach v: the peak for which rise and fall make up the distance.
            let ramp = a / j;
            v = a / two * ((ramp * ramp + T::from_i32(4) * length / a).sqrt() - ramp);
            if v * j < a * a {
                let ramp = (length / (two * j)).powf(T::ONE / T::from_i32(3));
                v = j * ramp * ramp;
            }
        }
        let (ramp, rise) = times(v);
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
        require_distance(p.distance, scale)?;
        let d = require(
            "duration",
            p.duration,
            p.duration >= scale.period,
            "a finite time of at least one period, s",
        )?;
        // The steepest point of the polynomial is 15/8 of the mean rate.
        within_a_turn_per_tick("duration", T::from_f64(1.875) * p.distance / d, scale)
            .map_err(|e| ParamError { value: d, ..e })?;
        let c3 = T::from_i32(10) * p.distance / (d * d * d);
        let c4 = T::from_i32(-15) * p.distance / (d * d * d * d);
        let c5 = T::from_i32(6) * p.distance / (d * d * d * d * d);
        let mut builder = Builder::new(scale);
        builder.piece([T::ZERO, c3, c4, c5]);
        builder.time = d;
        Ok(builder.stop(p.distance))
    }

    pub(super) fn at(&self, tick: u64) -> Target<T> {
        // Of the pieces that have begun, the last; pieces shorter than a tick are passed over.
        let Some(piece) = self.pieces.iter().rev().find(|p| p.first_tick <= tick) else {
            return Target::default();
        };
        let ticks = tick - piece.first_tick;
        let tau = self.scale.seconds(ticks);
        Target {
            position: piece.position(ticks, T::ZERO, &self.scale),
            velocity: piece.velocity(tau),
            acceleration: piece.acceleration(tau),
        }
    }
}

/// Adds piece after piece, carrying position and velocity across their borders.
struct Builder<T> {
    profile: Profile<T>,
    used: usize,
    /// End of the last piece, s.
    time: T,
    /// Position and velocity there.
    position: FixedCounts,
    velocity: T,
}

impl<T: Real> Builder<T> {
    fn new(scale: Scale<T>) -> Self {
        let profile = Profile::at_rest(scale);
        Builder { profile, used: 0, time: T::ZERO, position: FixedCounts(0), velocity: T::ZERO }
    }

    /// A piece of constant jerk; one that takes no time is left out.
    fn add(mut self, duration: T, acceleration: T, jerk: T) -> Self {
        if duration > T::ZERO {
            let c3 = jerk / T::from_i32(6);
            let c2 = acceleration / T::from_i32(2);
            let (piece, late) = self.piece([c2, c3, T::ZERO, T::ZERO]);
            // Where this piece ends: whole ticks after its first, and a rest (negative where it
            // ends before its first tick).
            let span = duration - late;
            let ticks = (span / self.profile.scale.period).floor().max(T::ZERO);
            let rest = span - ticks * self.profile.scale.period;
            self.position = piece.position(ticks.to_i64() as u64, rest, &self.profile.scale);
            self.velocity = piece.velocity(span);
            self.time += duration;
        }
        self
    }

    /// Begins a piece now; gives it back, and how long before its first tick it began, s.
    fn piece(&mut self, c: [T; 4]) -> (Piece<T>, T) {
        let scale = self.profile.scale;
        let before = (self.time / scale.period).floor();
        let exact = before * scale.period >= self.time;
        let first = if exact { before } else { before + T::ONE };
        let late = first * scale.period - self.time;
        // The same polynomial, seen from its first tick. Only pieces of constant jerk begin
        // between ticks, so c4 and c5 need no shift.
        let [c2, c3, c4, c5] = c;
        let (two, three) = (T::from_i32(2), T::from_i32(3));
        let velocity = self.velocity + late * (two * c2 + late * three * c3);
        let moved = late * (self.velocity + late * (c2 + late * c3));
        let piece = Piece {
            first_tick: first.to_i64() as u64,
            base: self.position.plus(scale.distance(moved)),
            rate: scale.rate(velocity),
            velocity,
            c: [c2 + three * c3 * late, c3, c4, c5],
        };
        if let Some(slot) = self.profile.pieces.get_mut(self.used) {
            *slot = piece;
            self.used += 1;
        }
        (piece, late)
    }

    /// At rest from here on, exactly at the distance asked for.
    fn stop(mut self, distance: T) -> Profile<T> {
        self.position = self.profile.scale.distance(distance);
        self.velocity = T::ZERO;
        self.piece([T::ZERO; 4]);
        self.profile
    }
}

fn require_distance<T: Real>(distance: T, scale: Scale<T>) -> Result<T, ParamError<T>> {
    let counts = (distance * scale.counts_per_radian).abs();
    require("distance", distance, counts < T::from_f64(1e12), "a finite distance below 1e12 counts, rad")
}

fn require_speed<T: Real>(speed: T, scale: Scale<T>) -> Result<T, ParamError<T>> {
    require("speed", speed, speed > T::ZERO, "a finite number above 0 rad/s")?;
    within_a_turn_per_tick("speed", speed, scale)
}
