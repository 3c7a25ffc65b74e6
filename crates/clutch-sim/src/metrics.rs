//! How well a run went: one definition of each figure, for simulation, hardware and logs.
//!
//! All figures are taken after the settling time. `e = θ_d − θ` with the true position where it
//! is known (simulation), else the measured one.

use crate::engine::{Event, EventKind};
use serde::Serialize;

/// The figures of a run; SI and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// Time over which the figures were taken, s.
    pub measured_s: f64,
    /// Largest `|e|`, rad.
    pub max_error_rad: f64,
    /// Root mean square of `e`, rad.
    pub rms_error_rad: f64,
    /// Mean of `e`, rad.
    pub mean_error_rad: f64,
    /// Integral of `|e|`, rad s.
    pub iae_rad_s: f64,
    /// Stick-slip cycles (entries into the stuck state) per second.
    pub stick_slip_cycles_per_s: f64,
    /// Share of the time that the shaft was stuck.
    pub stick_time_fraction: f64,
    /// Stair height: largest movement between one stick and the next, rad; 0 with fewer than two.
    pub stair_height_rad: f64,
    /// Mean of the driving torque at which the shaft broke away, N m; none if it never did.
    pub break_away_torque_nm: Option<f64>,
    /// Total variation of the voltage, per second, V/s.
    pub control_variation_v_s: f64,
    /// Root mean square of the second difference of the sampled velocity over T², rad/s³.
    pub jerk_rms_rad_s3: f64,
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

/// Gathers a run's figures sample by sample, in constant memory.
#[derive(Clone, Debug)]
pub struct MetricsBuilder {
    period: f64,
    settle: f64,
    samples: u64,
    max: f64,
    sum: f64,
    square: f64,
    absolute: f64,
    variation: f64,
    voltage: Option<f64>,
    velocities: [f64; 2],
    jerk_square: f64,
    sticks: u64,
    stuck_time: f64,
    last_stick: Option<f64>,
    stair: f64,
    break_aways: u64,
    break_away_sum: f64,
}

impl MetricsBuilder {
    /// For samples every `period` seconds, of which those before `settle` do not count.
    #[must_use]
    pub fn new(period: f64, settle: f64) -> Self {
        MetricsBuilder {
            period,
            settle,
            samples: 0,
            max: 0.0,
            sum: 0.0,
            square: 0.0,
            absolute: 0.0,
            variation: 0.0,
            voltage: None,
            velocities: [0.0; 2],
            jerk_square: 0.0,
            sticks: 0,
            stuck_time: 0.0,
            last_stick: None,
            stair: 0.0,
            break_aways: 0,
            break_away_sum: 0.0,
        }
    }

    /// A sample at time `t`, s.
    pub fn sample(&mut self, t: f64, s: MetricsSample) {
        if t < self.settle {
            return;
        }
        let magnitude = s.error.abs();
        self.max = self.max.max(magnitude);
        self.sum += s.error;
        self.square += s.error * s.error;
        self.absolute += magnitude;
        if let Some(last) = self.voltage {
            self.variation += (s.voltage - last).abs();
        }
        self.voltage = Some(s.voltage);
        if self.samples >= 2 {
            let second = s.velocity - 2.0 * self.velocities[1] + self.velocities[0];
            let jerk = second / (self.period * self.period);
            self.jerk_square += jerk * jerk;
        }
        self.velocities = [self.velocities[1], s.velocity];
        self.samples += 1;
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
                self.break_away_sum += e.torque;
            }
        }
    }

    /// The period that began at `begin` (s), with the shaft stuck or not, and what happened in it.
    pub fn period(&mut self, begin: f64, mut stuck: bool, events: &[Event]) {
        let (mut since, mut sum) = (begin, 0.0);
        for e in events {
            if stuck && e.kind == EventKind::BreakAway {
                sum += e.time - since;
            }
            stuck = e.kind == EventKind::Stick;
            since = e.time;
        }
        if stuck {
            sum += begin + self.period - since;
        }
        if begin >= self.settle {
            self.stuck_time += sum;
        }
        events.iter().for_each(|e| self.event(e));
    }

    /// The figures so far.
    #[must_use]
    pub fn finish(&self) -> Metrics {
        let n = self.samples.max(1) as f64;
        let time = (n * self.period).max(self.period);
        Metrics {
            measured_s: self.samples as f64 * self.period,
            max_error_rad: self.max,
            rms_error_rad: libm::sqrt(self.square / n),
            mean_error_rad: self.sum / n,
            iae_rad_s: self.absolute * self.period,
            stick_slip_cycles_per_s: self.sticks as f64 / time,
            stick_time_fraction: self.stuck_time / time,
            stair_height_rad: self.stair,
            break_away_torque_nm: (self.break_aways > 0)
                .then(|| self.break_away_sum / self.break_aways as f64),
            control_variation_v_s: self.variation / time,
            jerk_rms_rad_s3: libm::sqrt(self.jerk_square / (n - 2.0).max(1.0)),
        }
    }
}
