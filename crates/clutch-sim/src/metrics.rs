//! Figures of merit of a run: one definition of each, for simulation, hardware and logs.
//!
//! A figure is a row of a table below and a line of [`MetricsBuilder::finish`]. From the row come its place in the
//! summaries and JSON of the command, in Python's `Metrics`, among the columns of a sweep, on the axes of plots and
//! in docs/scenario.md.
//!
//! All figures are taken after the settling time. `e = θ_d − θ` with the true position where it
//! is known (simulation), else the measured one.

use crate::engine::{Event, EventKind};
use crate::lane::Lane;
use clutch_core::Arithmetic;
use serde::Serialize;

/// Declaration of a figure: all that is known of it without a run.
#[derive(Debug)]
pub struct Figure<M: 'static> {
    /// Name, ending with the unit: a column of a sweep, an attribute in Python.
    pub name: &'static str,
    /// The field of JSON.
    pub field: &'static str,
    /// In words, for people.
    pub label: &'static str,
    /// Unit of the value; 1 for a plain number.
    pub unit: &'static str,
    /// Unit in which people are shown it.
    pub shown_unit: &'static str,
    /// From the one to the other.
    pub factor: f64,
    /// One sentence, without the unit.
    pub meaning: &'static str,
    /// True if a run may have none.
    pub optional: bool,
    value: fn(&M) -> Option<f64>,
}

impl<M> Figure<M> {
    /// The value in [`Figure::unit`]; none where the run has none.
    #[must_use]
    pub fn of(&self, m: &M) -> Option<f64> {
        (self.value)(m)
    }

    /// The value in the unit that people are shown.
    #[must_use]
    pub fn shown(&self, m: &M) -> Option<f64> {
        self.of(m).map(|x| x * self.factor)
    }
}

/// Type that a figure's field may have.
trait Value {
    const OPTIONAL: bool;
}

impl Value for f64 {
    const OPTIONAL: bool = false;
}

impl Value for Option<f64> {
    const OPTIONAL: bool = true;
}

const SAME: f64 = 1.0;
const DEGREES: f64 = 1.0_f64.to_degrees();
const PERCENT: f64 = 100.0;
const MILLI: f64 = 1e3;

/// A struct of figures, and for each of them its [`Figure`].
macro_rules! figures {
    ($(#[$about:meta])* pub struct $name:ident, columns $prefix:literal {
        $(
            #[doc = $meaning:literal]
            $row:ident $field:ident: $type:ty, $label:literal, $unit:literal shown as $shown:literal $factor:ident;
        )+
    }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
        pub struct $name {
            $(
                #[doc = $meaning]
                #[doc = concat!("\n\nUnit: ", $unit)]
                pub $field: $type,
            )+
        }

        impl $name {
            $(
                #[doc = concat!("[`", stringify!($name), "::", stringify!($field), "`].")]
                pub const $row: Figure<$name> = Figure {
                    name: concat!($prefix, stringify!($field)),
                    field: stringify!($field),
                    label: $label,
                    unit: $unit,
                    shown_unit: $shown,
                    factor: $factor,
                    meaning: $meaning.trim_ascii_start(),
                    optional: <$type as Value>::OPTIONAL,
                    value: |m| m.$field.into(),
                };
            )+

            /// Every figure, in the order of the fields.
            pub const FIGURES: &[Figure<$name>] = &[$($name::$row),+];
        }
    };
}

figures! {
    /// The figures of a run; SI and radians.
    pub struct Metrics, columns "" {
        /// Time over which the figures were taken.
        MEASURED measured_s: f64, "time measured", "s" shown as "s" SAME;
        /// Largest magnitude of the error `e = θ_d − θ`.
        MAX_ERROR max_error_rad: f64, "max |error|", "rad" shown as "°" DEGREES;
        /// Root mean square of the error.
        RMS_ERROR rms_error_rad: f64, "RMS error", "rad" shown as "°" DEGREES;
        /// Mean of the error.
        MEAN_ERROR mean_error_rad: f64, "mean error (target − position)", "rad" shown as "°" DEGREES;
        /// Integral of the error's magnitude.
        IAE iae_rad_s: f64, "integral of |error|", "rad s" shown as "° s" DEGREES;
        /// Stick-slip cycles: entries into the stuck state.
        STICK_SLIP stick_slip_cycles_per_s: f64, "stick-slip", "cycles/s" shown as "cycles/s" SAME;
        /// Share of the time that the shaft was stuck.
        STICK_TIME stick_time_fraction: f64, "time stuck", "1" shown as "%" PERCENT;
        /// Longest time in one stick, by the true motion; 0 without a stick.
        LONGEST_STICK longest_stick_s: Option<f64>, "longest stick", "s" shown as "ms" MILLI;
        /// Stair height: largest movement between one stick and the next, 0 with fewer than two.
        STAIR_HEIGHT stair_height_rad: f64, "stair height", "rad" shown as "°" DEGREES;
        /// Mean magnitude of the torque of drive and motor at which the shaft broke away.
        BREAK_AWAY break_away_torque_nm: Option<f64>, "torque at break-away", "N m" shown as "mN m" MILLI;
        /// Total variation of the voltage, per time.
        VARIATION control_variation_v_s: f64, "voltage variation", "V/s" shown as "V/s" SAME;
        /// Root mean square of the sampled jerk, the second difference of the velocity over T².
        JERK jerk_rms_rad_s3: f64, "jerk RMS", "rad/s³" shown as "rad/s³" SAME;
    }
}

figures! {
    /// Stick-slip as a loop on hardware knows it: the encoder's silences, and the bounds that counts and voltage leave.
    pub struct Detected, columns "detected_" {
        /// Stick-slip cycles as the encoder's silences show them; one in each count, or shorter, shows none.
        STICK_SLIP stick_slip_cycles_per_s: f64, "stick-slip seen by the encoder", "cycles/s" shown as "cycles/s" SAME;
        /// Share of the time that the shaft was stuck, as the encoder shows it.
        STICK_TIME stick_time_fraction: f64, "time stuck seen by the encoder", "1" shown as "%" PERCENT;
        /// Stairs: silences in which the shaft fell a count or more behind even motion.
        STAIRS stairs_per_s: f64, "stairs of a count seen by the encoder", "1/s" shown as "1/s" SAME;
        /// Least stick-slip cycles with which counts and voltage agree.
        LEAST least_cycles_per_s: Option<f64>, "least stick-slip by counts and voltage", "cycles/s" shown as "cycles/s" SAME;
        /// Most stick-slip cycles with which counts and voltage agree.
        MOST most_cycles_per_s: Option<f64>, "most stick-slip by counts and voltage", "cycles/s" shown as "cycles/s" SAME;
        /// Stick-slip cycles, if least and most are within 20 % and two cycles.
        TOLD told_cycles_per_s: Option<f64>, "stick-slip by counts and voltage", "cycles/s" shown as "cycles/s" SAME;
    }
}

/// The figures that a run has of which only figures are kept, by the names of their columns: all but the bounds that counts
/// and voltage leave, which would cost a fast run half as much again.
pub fn figure_columns(m: &Metrics, d: &Detected) -> impl Iterator<Item = (&'static str, Option<f64>)> {
    let bounds = [Detected::LEAST.name, Detected::MOST.name, Detected::TOLD.name];
    columns(m, d).filter(move |(name, _)| !bounds.contains(name))
}

/// All figures of a run by the names of their columns.
pub fn columns(m: &Metrics, d: &Detected) -> impl Iterator<Item = (&'static str, Option<f64>)> {
    let of_motion = Metrics::FIGURES.iter().map(|f| (f.name, f.of(m)));
    of_motion.chain(Detected::FIGURES.iter().map(|f| (f.name, f.of(d))))
}

/// One sample for the figures.
#[derive(Clone, Copy, Debug)]
pub struct MetricsSample {
    /// `e`, rad.
    pub error: f64,
    /// `θ̇`, rad/s.
    pub velocity: f64,
    /// Brake voltage, V.
    pub voltage: f64,
}

/// The figures of samples, of a run or of several that are sampled at the same times.
#[derive(Clone, Debug)]
pub(crate) struct Sampled<V> {
    period: f64,
    settle: f64,
    samples: u64,
    max: V,
    sum: V,
    square: V,
    absolute: V,
    variation: V,
    voltage: V,
    velocities: [V; 2],
    /// Of second differences of the velocity.
    second_square: V,
}

impl<V: Arithmetic> Sampled<V> {
    pub(crate) fn new(period: f64, settle: f64) -> Self {
        let zero = V::ZERO;
        Sampled {
            period,
            settle,
            samples: 0,
            max: zero,
            sum: zero,
            square: zero,
            absolute: zero,
            variation: zero,
            voltage: zero,
            velocities: [zero; 2],
            second_square: zero,
        }
    }

    /// A sample at time `t`, s: error (rad), velocity (rad/s) and voltage (V).
    #[inline(always)]
    pub(crate) fn sample(&mut self, t: f64, error: V, velocity: V, voltage: V) {
        if t < self.settle {
            return;
        }
        let magnitude = error.abs();
        self.max = V::select(self.max.less(magnitude), magnitude, self.max);
        self.sum = self.sum + error;
        self.square = self.square + error * error;
        self.absolute = self.absolute + magnitude;
        if self.samples >= 1 {
            self.variation = self.variation + (voltage - self.voltage).abs();
        }
        self.voltage = voltage;
        if self.samples >= 2 {
            let second = velocity - V::splat(2.0) * self.velocities[1] + self.velocities[0];
            self.second_square = self.second_square + second * second;
        }
        self.velocities = [self.velocities[1], velocity];
        self.samples += 1;
    }
}

impl<V: Lane> Sampled<V> {
    /// The figures of one lane.
    pub(crate) fn lane(&self, i: usize) -> Sampled<f64> {
        Sampled {
            period: self.period,
            settle: self.settle,
            samples: self.samples,
            max: self.max.lane(i),
            sum: self.sum.lane(i),
            square: self.square.lane(i),
            absolute: self.absolute.lane(i),
            variation: self.variation.lane(i),
            voltage: self.voltage.lane(i),
            velocities: self.velocities.map(|v| v.lane(i)),
            second_square: self.second_square.lane(i),
        }
    }
}

/// The figures of sticks.
#[derive(Clone, Debug)]
pub(crate) struct Sticks {
    period: f64,
    settle: f64,
    sticks: u64,
    stuck_time: f64,
    /// Time in the stick that lasts, and the longest so far.
    this_stick: f64,
    longest_stick: f64,
    last_stick: Option<f64>,
    stair: f64,
    break_aways: u64,
    break_away_sum: f64,
}

impl Sticks {
    pub(crate) fn new(period: f64, settle: f64) -> Self {
        Sticks {
            period,
            settle,
            sticks: 0,
            stuck_time: 0.0,
            this_stick: 0.0,
            longest_stick: 0.0,
            last_stick: None,
            stair: 0.0,
            break_aways: 0,
            break_away_sum: 0.0,
        }
    }

    /// The number of sticks.
    pub(crate) fn count(&self) -> u64 {
        self.sticks
    }

    /// An event between samples.
    fn event(&mut self, e: &Event) {
        if e.time < self.settle {
            return;
        }
        match e.kind {
            EventKind::Stick => {
                self.sticks += 1;
                if let Some(last) = self.last_stick {
                    self.stair = self.stair.max((e.position - last).abs());
                }
                self.last_stick = Some(e.position);
            }
            EventKind::BreakAway => {
                self.break_aways += 1;
                self.break_away_sum += e.torque.abs();
            }
        }
    }

    fn stuck_for(&mut self, time: f64) {
        self.stuck_time += time;
        self.this_stick += time;
        self.longest_stick = self.longest_stick.max(self.this_stick);
    }

    /// The period that began at `begin` (s), with the shaft stuck or not, and what happened in it.
    pub(crate) fn period(&mut self, begin: f64, mut stuck: bool, events: &[Event]) {
        let counts = begin >= self.settle;
        let mut since = begin;
        for e in events {
            if stuck && e.kind == EventKind::BreakAway && counts {
                self.stuck_for(e.time - since);
            }
            stuck = e.kind == EventKind::Stick;
            if !stuck {
                self.this_stick = 0.0;
            }
            since = e.time;
        }
        if stuck && counts {
            self.stuck_for(begin + self.period - since);
        }
        events.iter().for_each(|e| self.event(e));
    }
}

/// Gathers a run's figures sample by sample, in constant memory.
#[derive(Clone, Debug)]
pub struct MetricsBuilder {
    samples: Sampled<f64>,
    sticks: Sticks,
}

impl MetricsBuilder {
    /// For samples every `period` seconds, of which those before `settle` do not count.
    #[must_use]
    pub fn new(period: f64, settle: f64) -> Self {
        Self::of(Sampled::new(period, settle), Sticks::new(period, settle))
    }

    /// A builder that goes on from figures gathered apart.
    pub(crate) fn of(samples: Sampled<f64>, sticks: Sticks) -> Self {
        MetricsBuilder { samples, sticks }
    }

    /// A sample at time `t`, s.
    pub fn sample(&mut self, t: f64, s: MetricsSample) {
        self.samples.sample(t, s.error, s.velocity, s.voltage);
    }

    /// The period that began at `begin` (s), with the shaft stuck or not, and what happened in it.
    pub fn period(&mut self, begin: f64, stuck: bool, events: &[Event]) {
        self.sticks.period(begin, stuck, events);
    }

    /// The figures so far.
    #[must_use]
    pub fn finish(&self) -> Metrics {
        let (s, of) = (&self.samples, &self.sticks);
        let n = s.samples.max(1) as f64;
        let time = (n * s.period).max(s.period);
        Metrics {
            measured_s: s.samples as f64 * s.period,
            max_error_rad: s.max,
            rms_error_rad: libm::sqrt(s.square / n),
            mean_error_rad: s.sum / n,
            iae_rad_s: s.absolute * s.period,
            stick_slip_cycles_per_s: of.sticks as f64 / time,
            // A sum of periods may round to more than all of them.
            stick_time_fraction: (of.stuck_time / time).min(1.0),
            longest_stick_s: Some(of.longest_stick.min(time)),
            stair_height_rad: of.stair,
            break_away_torque_nm: (of.break_aways > 0).then(|| of.break_away_sum / of.break_aways as f64),
            control_variation_v_s: s.variation / time,
            jerk_rms_rad_s3: libm::sqrt(s.second_square / (n - 2.0).max(1.0)) / (s.period * s.period),
        }
    }
}
