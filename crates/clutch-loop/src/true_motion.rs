//! Figures of the shaft's true motion under control, as a simulation has them.

use clutch_core::{FixedCounts, Micros};
use clutch_sim::engine::{Event, Motion, Shaft};
use clutch_sim::metrics::{MetricsBuilder, MetricsSample};
use clutch_sim::{Metrics, MovingRig};

/// The shaft at a sample, and the time by the rig's clock, s, which began before the run's.
#[derive(Clone, Copy)]
pub(crate) struct At {
    pub(crate) shaft: Shaft,
    pub(crate) rig_time: f64,
}

impl At {
    /// The shaft of a rig, now.
    pub(crate) fn now(rig: &MovingRig) -> At {
        At { shaft: *rig.shaft(), rig_time: rig.time() }
    }
}

/// The figures, gathered period by period.
pub(crate) struct TrueMotion {
    figures: MetricsBuilder,
    period: f64,
    radians_per_count: f64,
}

impl TrueMotion {
    pub(crate) fn new(period: Micros, radians_per_count: f64, settle: f64) -> Self {
        let period = period.seconds();
        TrueMotion { figures: MetricsBuilder::new(period, settle), period, radians_per_count }
    }

    /// An angle, rad.
    pub(crate) fn angle(&self, position: FixedCounts) -> f64 {
        position.minus::<f64>(FixedCounts(0)) * self.radians_per_count
    }

    /// The period that began at a tick is over: the shaft's place when it began, the path's target then, the voltage in it,
    /// and what happened in it, by the rig's clock.
    pub(crate) fn period(
        &mut self,
        tick: u64,
        began: &At,
        target: FixedCounts,
        voltage: f64,
        events: &[Event],
    ) {
        let time = tick as f64 * self.period;
        let At { shaft, rig_time } = began;
        let error = self.angle(target) - shaft.position;
        self.figures.sample(time, MetricsSample { error, velocity: shaft.velocity, voltage });
        let of_run = |e: &Event| Event { time: e.time - rig_time + time, ..*e };
        let events: Vec<Event> = events.iter().map(of_run).collect();
        self.figures.period(time, shaft.motion == Motion::Stuck, &events);
    }

    pub(crate) fn finish(&self) -> Metrics {
        self.figures.finish()
    }
}
