//! The motion of a system from event to event.

use super::System;
use super::letting_go::{Instant, Search, Stretch, Value, slowest};
use super::modes::hold;
use super::span::Span;
use super::state::{Equations, INSTANT, Mode, SystemError, SystemState};
use crate::engine::pair::{A, C, E};
use clutch_core::friction::FrictionModel;
use nalgebra::SVector;

/// Error allowed per step, in rad and rad/s, and as a share of both.
const TOLERANCE: f64 = 1e-11;
/// Steps and events of one call before the motion is given up.
const LIMIT: u32 = 50_000_000;
/// Slip rate below which a row counts as at rest after an event, as a share of the fastest, and rad/s.
const AT_REST: f64 = 1e-9;
/// A row that began to hold or to slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemEvent {
    /// Time, s.
    pub time: f64,
    /// The row.
    pub row: usize,
    /// Its motion from then on.
    pub mode: Mode,
}

/// A system in motion.
#[derive(Clone, Debug)]
pub struct Motion<'a, S, const N: usize, const B: usize> {
    system: &'a S,
    state: SystemState<N>,
    modes: [Mode; B],
    /// Step that the last stretch ended with, s.
    step: f64,
    /// Rates at the state, and what its rows hold.
    known: Option<(Rates<N>, Instant<N, B>)>,
    /// Nothing moves, and nothing can until a row lets go.
    at_rest: bool,
    /// Steps and events of one call.
    limit: u32,
}

/// Velocity and acceleration.
type Rates<const N: usize> = [SVector<f64, N>; 2];

/// A step: its end, its error over the tolerance, rates and equations at the end.
pub(super) struct Step<const N: usize, const B: usize> {
    to: SystemState<N>,
    error: f64,
    rates: Rates<N>,
    pub(super) equations: Equations<N, B>,
    /// Loads and bounds after 0.3 and 0.8 of the step, where the stages are of second order; none of what rests.
    pub(super) between: Option<[Value<N, B>; 2]>,
}

impl<'a, S: System<N, B>, const N: usize, const B: usize> Motion<'a, S, N, B> {
    /// A system at a state; rows without a slip rate hold if friction holds them.
    ///
    /// # Errors
    /// A friction with bristles; an inertia that is none.
    pub fn new(system: &'a S, state: SystemState<N>) -> Result<Self, SystemError> {
        if let Some(row) = (0..B).find(|row| system.friction(*row).bristles().is_some()) {
            return Err(SystemError::Bristles(row));
        }
        let mut motion = Motion {
            system,
            state,
            modes: [Mode::Stuck; B],
            step: 1e-6,
            known: None,
            at_rest: false,
            limit: LIMIT,
        };
        motion.choose([false; B])?;
        Ok(motion)
    }

    /// The same, given up after so many steps and events in one call of [`advance`](Self::advance): where that many are
    /// needed, something is out of all proportion. Without it, it is given up after 50 million, a minute or so.
    #[must_use]
    pub fn with_limit(self, steps: u32) -> Self {
        Motion { limit: steps, ..self }
    }

    /// The state that it is in.
    #[must_use]
    pub fn state(&self) -> &SystemState<N> {
        &self.state
    }

    /// Motion of each row.
    #[must_use]
    pub fn modes(&self) -> &[Mode; B] {
        &self.modes
    }

    /// Friction of the rows, N m: of those that hold, what the least constraint asks.
    ///
    /// # Errors
    /// An inertia that is none.
    pub fn friction(&self) -> Result<SVector<f64, B>, SystemError> {
        let e = self.equations(&self.state)?;
        let a = e.rows * e.inverse * e.rows.transpose();
        let held = hold(&a, &(e.rows * e.free), &e.bound, &self.stuck()).torque;
        Ok(held + self.rubs(&e.slip, &self.system.normal(self.state.time).map(|n| n.max(0.0))))
    }

    /// Friction of the rows that slip.
    fn rubs(&self, slip: &SVector<f64, B>, normal: &SVector<f64, B>) -> SVector<f64, B> {
        SVector::from_fn(|i, _| {
            let sign = self.modes[i].sign();
            sign * self.system.friction(i).level((sign * slip[i]).max(0.0)) * normal[i]
        })
    }

    fn equations(&self, state: &SystemState<N>) -> Result<Equations<N, B>, SystemError> {
        let SystemState { time, position, velocity } = state;
        let inertia = self.system.inertia(position);
        let inverse = inertia.cholesky().ok_or(SystemError::Inertia(*time))?.inverse();
        let rows = self.system.rows(position);
        let slip = rows * velocity - self.system.base(*time);
        let normal = self.system.normal(*time);
        let presses = normal.map(|n| n.max(0.0));
        let bound = SVector::<f64, B>::from_fn(|i, _| self.system.friction(i).at_rest() * presses[i]);
        let rubs = self.rubs(&slip, &presses);
        let free = inverse * (self.system.applied(*time, position, velocity) - rows.transpose() * rubs);
        if !free.iter().all(|a| a.is_finite()) {
            return Err(SystemError::NotFinite(*time));
        }
        Ok(Equations { inverse, rows, free, normal, bound, slip })
    }

    pub(super) fn stuck(&self) -> [bool; B] {
        self.modes.map(|mode| mode == Mode::Stuck)
    }

    fn rate(&self, state: &SystemState<N>, e: &Equations<N, B>) -> Rates<N> {
        if !self.stuck().contains(&true) {
            return [state.velocity, e.free];
        }
        let span = Span::of_stuck(&e.inverse, &e.rows, &self.stuck());
        [state.velocity, span.project(&e.inverse, &e.free, &SVector::zeros())]
    }

    /// Chooses the modes of all rows at rest; `crossed` are those whose rate has just changed its sign.
    fn choose(&mut self, crossed: [bool; B]) -> Result<[Mode; B], SystemError> {
        let before = self.modes;
        let e = self.equations(&self.state)?;
        let fastest = e.slip.amax();
        let mut rests: [bool; B] = std::array::from_fn(|i| {
            before[i] == Mode::Stuck && e.slip[i].abs() <= AT_REST * fastest.max(1.0)
                || crossed[i]
                || e.slip[i].abs() <= f64::MIN_POSITIVE
        });
        // Rows in the span of those at rest are at rest, too.
        let base = self.system.base(self.state.time);
        let span = Span::of_stuck(&e.inverse, &e.rows, &rests);
        self.state.velocity = span.project(&e.inverse, &self.state.velocity, &base);
        let slip = e.rows * self.state.velocity - base;
        for i in 0..B {
            rests[i] |= slip[i].abs() <= AT_REST * AT_REST * fastest.max(1.0);
            if rests[i] {
                self.modes[i] = Mode::Stuck;
            } else {
                self.modes[i] = if slip[i] > 0.0 { Mode::Forward } else { Mode::Backward };
            }
        }
        // Rows that let go get the friction of motion; each lets go once.
        let mut at = Instant::of(0.0, self.equations(&self.state)?, &self.stuck());
        for _ in 0..=B {
            if !at.gone {
                break;
            }
            let (stuck, left) = (self.stuck(), at.held.acceleration);
            for i in (0..B).filter(|i| stuck[*i] && left[*i].abs() > at.still) {
                self.modes[i] = if left[i] > 0.0 { Mode::Forward } else { Mode::Backward };
            }
            at = Instant::of(0.0, self.equations(&self.state)?, &self.stuck());
        }
        let e = &at.equations;
        let span = Span::of_stuck(&e.inverse, &e.rows, &self.stuck());
        self.at_rest = span.count() == N && self.state.velocity.iter().all(|v| *v == 0.0);
        self.known = Some((self.rate(&self.state, e), at));
        Ok(before)
    }

    /// A step of the pair; of what rests, only its end.
    pub(super) fn step(&self, h: f64) -> Result<Step<N, B>, SystemError> {
        let from = &self.state;
        if self.at_rest {
            let to = SystemState { time: from.time + h, ..*from };
            let equations = self.equations(&to)?;
            return Ok(Step { to, error: 0.0, rates: [SVector::zeros(); 2], equations, between: None });
        }
        let first = match &self.known {
            Some((rates, _)) => *rates,
            None => self.rate(from, &self.equations(from)?),
        };
        let mut end = None;
        let mut between = [None; 2];
        let mut k = [first; 7];
        let mut to = *from;
        for i in 0..6 {
            to = SystemState { time: from.time + C[i] * h, ..*from };
            for (a, k) in A[i].iter().zip(&k).take(i + 1) {
                to.position += k[0] * (h * a);
                to.velocity += k[1] * (h * a);
            }
            let e = self.equations(&to)?;
            k[i + 1] = self.rate(&to, &e);
            if i == 1 || i == 2 {
                between[i - 1] = Some(Value::of(C[i], &e));
            }
            end = Some(e);
        }
        let left_out =
            |n: usize| E.iter().zip(&k).fold(SVector::<f64, N>::zeros(), |sum, (e, k)| sum + k[n] * (h * e));
        let over = |wrong: SVector<f64, N>, x: &SVector<f64, N>| {
            wrong
                .iter()
                .zip(x)
                // A number that is none is worse than all.
                .fold(0.0_f64, |most, (e, x)| {
                    let share = e.abs() / (TOLERANCE * (1.0 + x.abs()));
                    if share.is_nan() || most.is_nan() { f64::NAN } else { most.max(share) }
                })
        };
        let (of_way, of_speed) = (over(left_out(0), &to.position), over(left_out(1), &to.velocity));
        // `max` would pass over a number that is none.
        let error = if of_way.is_nan() || of_way > of_speed { of_way } else { of_speed };
        let equations = end.map_or_else(|| self.equations(&to), Ok)?;
        let [early, late] = between;
        let between = early.zip(late).map(|(early, late)| [early, late]);
        Ok(Step { to, error, rates: k[6], equations, between })
    }

    /// Follows the motion to a time, s, and adds what happened to `events`.
    ///
    /// # Errors
    /// A motion that cannot be followed; the state is then where it was last sure.
    pub fn advance(&mut self, to: f64, events: &mut Vec<SystemEvent>) -> Result<(), SystemError> {
        let begin = self.state.time;
        for _ in 0..self.limit {
            let now = self.state.time;
            if now >= to {
                return Ok(());
            }
            // A jump at the end of the call is in it.
            let corner = self.system.corner(now).filter(|corner| *corner <= to);
            let end = corner.unwrap_or(to);
            let most = self.step.min(self.system.longest_step());
            let last = now + most >= end;
            let h = if last { end - now } else { most };
            if now + h == now {
                return Err(SystemError::TooManySteps(now));
            }
            let mut step = self.step(h)?;
            let error = step.error;
            if !(error.is_finite() && step.to.velocity.iter().all(|v| v.is_finite())) {
                return Err(SystemError::NotFinite(begin));
            }
            let grown = h * (0.9 * libm::pow(error.max(1e-10), -0.2)).clamp(0.2, 5.0);
            if error > 1.0 {
                self.step = grown.min(0.9 * h);
                continue;
            }
            if !last || grown > self.step {
                self.step = grown;
            }
            if last {
                step.to.time = end;
            }
            let jumps = last && corner == Some(end);
            let (event, at) = self.event(h, &step, jumps)?;
            if let Some(event) = event {
                step = self.step(event)?;
            }
            let slipped = self.modes.map(Mode::sign);
            self.state = step.to;
            if event.is_some() || jumps {
                let crossed = std::array::from_fn(|i| slipped[i] * step.equations.slip[i] < 0.0);
                let before = self.choose(crossed)?;
                for row in (0..B).filter(|row| before[*row] != self.modes[*row]) {
                    events.push(SystemEvent { time: self.state.time, row, mode: self.modes[row] });
                }
                self.step = 1e-6;
            } else {
                self.known = Some((step.rates, Instant { at: 0.0, ..at }));
                let stuck = self.stuck();
                if stuck.contains(&true) {
                    let (base, e) = (self.system.base(self.state.time), &at.equations);
                    let span = Span::of_stuck(&e.inverse, &e.rows, &stuck);
                    self.state.velocity = span.project(&e.inverse, &self.state.velocity, &base);
                }
            }
        }
        Err(SystemError::TooManySteps(begin))
    }

    /// The shortest time within a step of `h` after which a row that slipped has come to rest, or one that is stuck is no longer
    /// held, if there is one; and the end of the step.
    fn event(
        &self,
        h: f64,
        step: &Step<N, B>,
        jumps: bool,
    ) -> Result<(Option<f64>, Instant<N, B>), SystemError> {
        let stuck = self.stuck();
        let begin = match &self.known {
            Some((_, at)) => *at,
            None => Instant::of(0.0, self.equations(&self.state)?, &stuck),
        };
        // A jump at the end is not within the step.
        let end = if jumps {
            self.equations(&SystemState { time: step.to.time.next_down(), ..step.to })?
        } else {
            step.equations
        };
        let mut end = Instant::of(h, end, &stuck);
        let stops = self.stops(h, &begin.equations, &step.rates, &end.equations)?;
        let sticks = stuck.contains(&true);
        let equations_after = |time: f64| Ok(self.step(time)?.equations);
        let stretch = Stretch {
            system: self.system,
            from: self.state.time,
            length: h,
            modes: self.modes,
            between: step.between,
            equations_after: &equations_after,
        };
        let search = sticks.then(|| Search::new(stretch, (&begin, &end))).transpose()?;
        if let Some((before, _)) = stops {
            if before > 0.0 && sticks {
                end = Instant::of(before, self.step(before)?.equations, &stuck);
            } else {
                end = begin;
            }
        }
        let lets_go = search.map(|mut search| search.first(&begin, &end, 0)).transpose()?.flatten();
        Ok((lets_go.or(stops.map(|(_, after)| after)), end))
    }

    /// The time after which a row that slips has come to rest in a step of `h`, and one before it by [`INSTANT`] at most.
    fn stops(
        &self,
        h: f64,
        begin: &Equations<N, B>,
        rates: &Rates<N>,
        end: &Equations<N, B>,
    ) -> Result<Option<(f64, f64)>, SystemError> {
        let margin = self.margin(&end.slip);
        if margin < 0.0 {
            return self.locate((h, margin)).map(Some);
        }
        let Some((first, _)) = &self.known else { return Ok(None) };
        // A row that stops and slips on within the step.
        let (gained, gains) = (begin.rows * first[1], end.rows * rates[1]);
        let mut beyond: Option<(f64, f64)> = None;
        for i in (0..B).filter(|i| self.modes[*i] != Mode::Stuck) {
            let sign = self.modes[i].sign();
            let rate = (sign * begin.slip[i], sign * end.slip[i]);
            let Some(at) = slowest(h, rate, (sign * gained[i], sign * gains[i])) else { continue };
            let margin = self.margin(&self.step(at)?.equations.slip);
            if margin < 0.0 && beyond.is_none_or(|(earliest, _)| at < earliest) {
                beyond = Some((at, margin));
            }
        }
        beyond.map(|beyond| self.locate(beyond)).transpose()
    }

    /// Distance of rows that slip from a rate of 0, rad/s; below 0 once one of them has passed it.
    fn margin(&self, slip: &SVector<f64, B>) -> f64 {
        let noise = 1e-14 * slip.amax();
        let rows = (0..B).filter(|i| self.modes[*i] != Mode::Stuck);
        rows.fold(f64::INFINITY, |least, i| least.min(self.modes[i].sign() * slip[i] + noise))
    }

    /// The bracket of the time at which a row that slips comes to rest, before a time at which it has, with its margin.
    ///
    /// By false position (Illinois) on the rates of rows that slip.
    fn locate(&self, beyond: (f64, f64)) -> Result<(f64, f64), SystemError> {
        let from = self.system.base(self.state.time);
        let slip = self.system.rows(&self.state.position) * self.state.velocity - from;
        let (mut before, mut after) = ((0.0, self.margin(&slip)), beyond);
        let mut moved_before = None;
        while after.0 - before.0 > INSTANT {
            let share = before.1 / (before.1 - after.1);
            let false_position = before.1 > 0.0 && before.1.is_finite() && after.1 < 0.0;
            let width = after.0 - before.0;
            let guess = if false_position {
                // Not nearer to an end than half of what is asked: there it is from the other side that the bracket closes.
                (before.0 + share * width).clamp(before.0 + 0.5 * INSTANT, after.0 - 0.5 * INSTANT)
            } else {
                before.0 + 0.5 * width
            };
            if guess <= before.0 || guess >= after.0 {
                break;
            }
            let end = (guess, self.margin(&self.step(guess)?.equations.slip));
            let passed = end.1 < 0.0;
            // The end that stays put for a second time weighs half.
            let again = if moved_before == Some(!passed) { 0.5 } else { 1.0 };
            if passed {
                after = end;
                before.1 *= again;
            } else {
                before = end;
                after.1 *= again;
            }
            moved_before = Some(!passed);
        }
        Ok((before.0, after.0))
    }
}
