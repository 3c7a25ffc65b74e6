//! The envelope: where the shaft can be, and how fast, under the volts that were sent.
//!
//! Any shaft of the bounds has, while it goes forwards, an acceleration of at least `(D₋ − F₊)/J` and at most
//! `(D₊ − F₋)/J`: drive and motor `D`, friction `F`, the inertia that is worse, over all volts that may have been in
//! force since the last sample. From a position and a velocity that no such shaft exceeds, the fastest of them makes the
//! next ones; the count of the sample cuts the position, and the way over a window of samples cuts the velocity:
//!
//! ```text
//! v' = v + a₊ T,                      x' = x + (v + v')/2 T          the fastest shaft
//! x ≤ (n + 1 + ε) q                                                 the count, an edge of which is off by ε
//! v ≤ (x − x₀ + ∫ (t − t₀) a₊ dt)/(t − t₀)                          the way since t₀: earlier it was no slower than a₊ allows
//! ```
//!
//! The slowest shaft is the fastest of the axis turned round. If the fastest is behind the slowest, in position or in
//! velocity, no shaft of the bounds can have given the counts. No count that comes back sets anything back. The proof is in
//! `docs/theory.md`.
//!
//! Positions are counts from the newest sample's, velocities counts per period.

use super::cause::Cause;
use super::params::LimitParams;
use crate::actuator::ActuatorKind;
use crate::law::OutputParams;
use crate::{Bounds, Dac, DacCode, Real};

/// Share of a count by which the window may blur the velocity before a younger one takes its place; a quarter, since the
/// blur grows with the square of the age and the younger is to be half as old.
const BLUR: f64 = 0.4;
/// Periods after which a younger window takes its place at the latest.
const LONGEST: f64 = 16.0;
/// Counts per period of a velocity that nobody knows yet, at least.
const FASTEST: f64 = 1000.0;
/// Codes that are kept; a power of two.
const SENT: usize = 16;

/// Accelerations within the bounds; in counts, periods and, where a side of it is meant, `[least, most]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Envelope<T> {
    dac: Dac<T>,
    kind: ActuatorKind,
    /// Drive with the highest inertia, counts per period².
    drive: [T; 2],
    /// The motor's, per volt.
    motor: [T; 2],
    /// Friction without a voltage, per volt of the brake, and per volt by the motor's load.
    rubs: [T; 2],
    brakes: [T; 2],
    loads: [T; 2],
    /// Highest inertia over the lowest.
    lighter: T,
    /// Most viscous drag, 1/period.
    drag: T,
    /// Counts by which an edge of the encoder may be off.
    edge: T,
    /// Codes of which any may be in force in a period: on a line that loses nothing, and on one that has lost samples.
    reach: [usize; 2],
    /// Volts that can be sent.
    output: [T; 2],
    /// Counts per period of a velocity that nobody knows yet.
    fastest: T,
    /// The shaft does not go backwards: a brake only resists, and its drive is forwards.
    one_way: bool,
}

impl<T: Real> Envelope<T> {
    /// `scale` is counts per radian times period²; `speed` are counts per period of the fastest path.
    pub(super) fn new(
        p: &LimitParams<T>,
        dac: Dac<T>,
        output: &OutputParams<T>,
        b: &Bounds<T>,
        scale: T,
        period: T,
        speed: T,
    ) -> Self {
        let scale = scale / b.inertia.high;
        let friction = [b.friction.low / p.grip_margin, b.friction.high * p.friction_margin];
        let motor = [b.motor_gain.low, b.motor_gain.high];
        let brake = [b.brake_gain.low, b.brake_gain.high];
        let times = |by: [T; 2]| {
            let ([a, b], [c, d]) = (friction, by);
            [a * c * scale, b * d * scale]
        };
        Envelope {
            dac,
            kind: b.actuator,
            drive: [b.drive_torque.low, b.drive_torque.high].map(|x| x * scale),
            motor: motor.map(|x| x * scale),
            rubs: times([b.preload; 2]),
            brakes: times(brake),
            loads: times(motor.map(|x| x * b.load_share)),
            lighter: b.inertia.high / b.inertia.low,
            drag: b.viscous_damping.high / b.inertia.low * period,
            edge: p.edge_counts,
            reach: {
                let delay = usize::try_from(p.delay_cycles).unwrap_or(usize::MAX);
                let patience = usize::try_from(p.silence_cycles).unwrap_or(usize::MAX);
                // The newest may come late in its period.
                let sound = delay.saturating_add(2);
                // A board that hears nothing keeps the last that it took, until its watchdog bites.
                [sound, delay.saturating_add(patience).saturating_add(1).min(SENT).max(sound)]
            },
            output: [output.lowest, output.highest],
            fastest: T::from_f64(FASTEST).max(speed + speed),
            one_way: !b.actuator.drives_above_0() && b.drive_torque.low > T::ZERO,
        }
    }

    /// The same where the state is to stay.
    #[inline(never)]
    pub(super) fn restart(&self, s: &mut EnvelopeState<T>, applied: DacCode) {
        *s = self.start(applied);
    }

    /// The envelope of a shaft of which nothing is known but a count, and the code `applied`.
    pub(super) fn start(&self, applied: DacCode) -> EnvelopeState<T> {
        let (fastest, edge) = (self.fastest, self.edge);
        let from = |position, other: T, velocity| {
            let window = Window { from: -other, age: T::ZERO, moment: T::ZERO };
            Side { position, velocity, way: T::ZERO, old: window, young: window }
        };
        let back = if self.one_way { T::ZERO } else { fastest };
        EnvelopeState {
            sides: [[from(T::ONE + edge, edge, fastest), from(edge, T::ONE + edge, back)]; 2],
            swapped: false,
            expected: None,
            came: (0, 0),
            sending: None,
            applied,
            sent: [applied; 2 * SENT],
            last: 0,
            turns: 0,
            still: 0,
            run: 0,
        }
    }

    /// Accelerations of the fastest shaft and, the axis turned round, of the slowest.
    fn rates(&self, [low, high]: [T; 2], speeds: [T; 2]) -> [Rates<T>; 2] {
        let [mut least, mut most] = self.drive;
        let pressing = |volts: T| if volts > T::ZERO { volts } else { T::ZERO };
        let [mut grip, mut hold] = self.rubs;
        grip += self.brakes[0] * pressing(low);
        hold += self.brakes[1] * pressing(high);
        let [weak, strong] = self.motor;
        match self.kind {
            ActuatorKind::Brake => {}
            ActuatorKind::Both => {
                least += weak * pressing(-high);
                most += strong * pressing(-low);
            }
            ActuatorKind::Motor => {
                least += if low > T::ZERO { weak } else { strong } * low;
                most += if high > T::ZERO { strong } else { weak } * high;
                grip += self.loads[0] * (pressing(low) + pressing(-high));
                hold += self.loads[1] * high.abs().max(low.abs());
            }
        }
        let rate = |torque: T| if torque > T::ZERO { torque * self.lighter } else { torque };
        let [fast, slow] = speeds.map(|v| self.drag * pressing(v));
        [
            Rates { onward: rate(most - grip), back: rate(most + hold) + slow },
            Rates { onward: rate(-least - grip), back: rate(hold - least) + fast },
        ]
    }

    /// Lowest and highest voltage that may have been in force since the sample before: of those that were sent, the last
    /// two, and more where an actuator is slow or a line that has lost samples may have lost codes.
    pub(super) fn in_force(&self, s: &EnvelopeState<T>, losses: bool) -> [T; 2] {
        let [sound, lossy] = self.reach;
        let reach = if losses { lossy } else { sound };
        if reach > SENT {
            // Older than those that are kept: any of the output, or what was there before the first.
            let applied = self.dac.volts(s.applied);
            return [self.output[0].min(applied), self.output[1].max(applied)];
        }
        let (newest, others) = s.newest(reach);
        let mut range = [newest; 2];
        for &code in others {
            range = [range[0].min(code), range[1].max(code)];
        }
        // A higher code is a higher voltage.
        range.map(|code| self.dac.volts(code))
    }

    /// Computes before a sample comes, so many periods after the last one that passed, what it will be judged by.
    #[inline]
    fn expect_after(&self, s: &mut EnvelopeState<T>, losses: bool, periods: u32) {
        s.catch_up();
        let (volts, time) = (self.in_force(s, losses), T::from_u64(u64::from(periods)));
        let [first, second] = &mut s.sides;
        let ([up, down], expected) = if s.swapped { (second, first) } else { (first, second) };
        let [rise, fall] = self.rates(volts, [up.velocity, down.velocity]);
        // A shaft at rest stays there, however hard a brake holds it.
        let steepest = if self.one_way { rise.onward.max(T::ZERO) } else { rise.back };
        *expected = [up.after(&rise, steepest, time), down.after(&fall, fall.back, time)];
        s.expected = Some(losses);
    }

    /// The same for the next period.
    pub(super) fn expect(&self, s: &mut EnvelopeState<T>, losses: bool) {
        self.expect_after(s, losses, 1);
    }

    // A function of its own in machine code: where each period is expected, its bound leaves it out.
    #[cold]
    #[inline(never)]
    fn unexpected(&self, s: &mut EnvelopeState<T>, losses: bool, periods: u32) {
        self.expect_after(s, losses, periods);
    }

    /// A sample that has passed the gate: `moved` counts in so many periods. Gives the motion that no shaft of the bounds can
    /// have made, and by how many counts. `losses`: the line has lost samples of late.
    pub(super) fn judge(
        &self,
        s: &mut EnvelopeState<T>,
        losses: bool,
        moved: i32,
        periods: u32,
    ) -> Option<(Cause, T)> {
        let counts = T::from_i32(moved);
        let one_way = self.one_way;
        if periods != 1 || s.expected != Some(losses) {
            self.unexpected(s, losses, periods);
        }
        s.expected = None;
        s.came = (moved, periods);
        s.swapped = !s.swapped;
        let [first, second] = &mut s.sides;
        let [up, down] = if s.swapped { second } else { first };
        up.arrive(counts);
        down.arrive(-counts);
        let ahead = up.position - down.position;
        up.position = up.position.min(T::ONE + self.edge);
        down.position = down.position.min(self.edge);
        let width = up.position + down.position;
        if width < T::ZERO {
            let behind = ahead > T::ONE;
            return Some((s.suspect(behind, one_way), -width));
        }
        let (was, from) = ([up.velocity, down.velocity], [-down.position, -up.position]);
        up.look_back(from[0], !one_way);
        down.look_back(from[1], true);
        let [fast, slow] = [up.velocity, down.velocity];
        if fast + slow < T::ZERO {
            let behind = was[0] - fast > was[1] - slow;
            return Some((s.suspect(behind, one_way), -(fast + slow)));
        }
        None
    }
}

/// Accelerations of a side, counts per period²: while it goes on, and while it comes back.
#[derive(Clone, Copy)]
struct Rates<T> {
    onward: T,
    back: T,
}

/// A window over which the way is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Window<T> {
    /// Least position of the shaft at its begin.
    from: T,
    /// Periods since.
    age: T,
    /// `∫ (t − t₀) a dt` since, counts.
    moment: T,
}

/// One side of the envelope: where the fastest shaft is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Side<T> {
    position: T,
    velocity: T,
    /// Its way since the last sample.
    way: T,
    old: Window<T>,
    young: Window<T>,
}

impl<T: Real> Side<T> {
    /// The same after some time, but for the counts.
    #[inline]
    fn after(&self, rates: &Rates<T>, steepest: T, time: T) -> Self {
        let half = T::from_f64(0.5);
        let before = self.velocity;
        let (after, mean) = if before > T::ZERO || (before == T::ZERO && rates.onward > T::ZERO) {
            let after = (before + rates.onward * time).max(T::ZERO);
            (after, half * (before + after))
        } else {
            let after = before + rates.back * time;
            if after > T::ZERO {
                // It turns, at an instant that nobody computes: as if at once.
                let after = after.min(rates.onward.max(T::ZERO) * time);
                (after, after)
            } else {
                (after, half * (before + after))
            }
        };
        let older = |window: &Window<T>| Window {
            from: window.from,
            age: window.age + time,
            moment: window.moment + steepest * time * (window.age + half * time),
        };
        let (old, young) = (older(&self.old), older(&self.young));
        Side { position: self.position, velocity: after, way: mean * time, old, young }
    }

    /// The counts come.
    fn arrive(&mut self, moved: T) {
        self.position += self.way - moved;
        self.old.from -= moved;
        self.young.from -= moved;
    }

    /// The way over the window; `from` is where the shaft is at least.
    fn look_back(&mut self, from: T, turns: bool) {
        let velocity = (self.position - self.old.from + self.old.moment) / self.old.age;
        let velocity = if turns { velocity } else { velocity.max(T::ZERO) };
        self.velocity = self.velocity.min(velocity);
        if self.young.moment > T::from_f64(BLUR) || self.young.age >= T::from_f64(LONGEST) {
            self.old = self.young;
            self.young = Window { from, age: T::ZERO, moment: T::ZERO };
        }
    }
}

/// Memory of the envelope.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct EnvelopeState<T> {
    /// The fastest shaft, and the slowest with the axis turned round; and what is expected of them.
    sides: [[Side<T>; 2]; 2],
    /// Expected are the first, and not the second.
    swapped: bool,
    /// True if it is expected after losses; none where nothing is expected.
    expected: Option<bool>,
    /// Counts of the newest sample, and the periods that it took; nothing in none once that is noted.
    came: (i32, u32),
    /// The code that answered it, until it is kept.
    sending: Option<DacCode>,
    /// The code before the first that was sent.
    applied: DacCode,
    /// Codes that were sent: a ring, and the same once more, so that those of any span are in a row.
    sent: [DacCode; 2 * SENT],
    /// Place of the newest in the first.
    last: usize,
    /// A bit for each of the last periods: the counts turned round in it.
    turns: u16,
    /// Periods without a count.
    still: u32,
    /// Counts since they last turned round.
    run: i32,
}

impl<T: Real> EnvelopeState<T> {
    /// A code is sent. It is kept later: what is on its way to the converter does not wait for that.
    #[inline]
    pub(super) fn sends(&mut self, code: DacCode) {
        self.sending = Some(code);
    }

    /// Remembers the newest sample and its answer.
    fn catch_up(&mut self) {
        let (moved, periods) = core::mem::take(&mut self.came);
        self.note(moved, periods);
        if let Some(code) = self.sending.take() {
            self.keep(code);
        }
    }

    fn keep(&mut self, code: DacCode) {
        self.last = self.last.wrapping_add(1) % SENT;
        let (ring, again) = self.sent.split_at_mut(SENT);
        for places in [ring, again] {
            if let Some(place) = places.get_mut(self.last) {
                *place = code;
            }
        }
    }

    /// The newest code of so many that were sent, and the others; before the first, the one that was there.
    fn newest(&self, count: usize) -> (DacCode, &[DacCode]) {
        let end = (self.last % SENT).wrapping_add(SENT);
        let others = self.sent.get(end.wrapping_add(1).wrapping_sub(count)..end);
        (self.sent.get(end).copied().unwrap_or(self.applied), others.unwrap_or(&[]))
    }

    /// Remembers the way of the counts, for the name of a suspect.
    fn note(&mut self, moved: i32, periods: u32) {
        self.turns = self.turns.checked_shl(periods).unwrap_or(0);
        if moved == 0 {
            self.still = self.still.saturating_add(periods);
            return;
        }
        self.still = 0;
        if self.run.signum().wrapping_mul(moved.signum()) < 0 {
            self.turns |= 1;
            self.run = 0;
        }
        self.run = self.run.saturating_add(moved);
    }

    /// The suspect, where the counts are behind the slowest shaft or ahead of the fastest.
    // A function of its own in machine code: it ends control, and the bound of a period that goes on leaves it out.
    #[cold]
    #[inline(never)]
    fn suspect(&mut self, behind: bool, one_way: bool) -> Cause {
        self.catch_up();
        let backwards = self.run < 0;
        if self.run.unsigned_abs() < 2 && self.turns != 0 {
            Cause::Channel
        } else if self.still >= 2 {
            Cause::StandStill
        } else if one_way && backwards {
            Cause::Reversed
        } else if behind != backwards {
            Cause::TooSlow
        } else {
            Cause::TooFast
        }
    }
}

#[cfg(test)]
mod tests;
