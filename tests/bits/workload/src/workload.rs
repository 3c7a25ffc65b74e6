//! A run, tick by tick.

use crate::record::{RECORD, hashed, record};
use clutch_core::law::{ControlLaw, LawState};
use clutch_core::{
    Counts, FixedCounts, ParamError, Servo, ServoState, StickSlip, StickSlipParams, StickSlipState, Target,
};
use clutch_settings::{Misfit, Path, Settings};

/// A servo, its path and the stick-slip detector, in `f32`.
pub struct Workload<'a> {
    settings: &'a Settings,
    servo: Servo<f32>,
    path: Path,
    detector: StickSlip<f32>,
    state: ServoState<f32, LawState<f32>>,
    sticks: StickSlipState<f32>,
    origin: FixedCounts,
    tick: u64,
}

impl<'a> Workload<'a> {
    /// A run that begins at `counts` with `volts` on the brake; its path begins on the count `origin`.
    ///
    /// # Errors
    /// Settings that make no run.
    pub fn new(
        settings: &'a Settings,
        origin: FixedCounts,
        counts: Counts,
        volts: f32,
    ) -> Result<Self, Misfit> {
        let built = settings.build()?;
        let servo = built.servo;
        let detector = StickSlip::new(&StickSlipParams::default(), servo.encoder(), servo.period());
        // Its parameters are no settings.
        let unfit =
            |e: ParamError<f32>| Misfit::Unfit { key: u16::MAX, relation: e.relation, value: e.value };
        let detector = detector.map_err(unfit)?;
        let mut workload = Workload {
            settings,
            servo,
            path: built.path,
            detector,
            state: ServoState::default(),
            sticks: StickSlipState::default(),
            origin,
            tick: 0,
        };
        workload.state = servo.start(counts, &workload.target(), volts);
        Ok(workload)
    }

    fn target(&self) -> Target<f32> {
        let target = self.path.target(self.settings.knots(), self.tick);
        Target { position: target.position.plus(self.origin), ..target }
    }

    /// Bytes of a record that the hash of the run covers.
    #[must_use]
    pub fn hashed(&self) -> usize {
        hashed(self.servo.law().term_names().len())
    }

    /// One period: counts in, every output out.
    pub fn tick(&mut self, counts: Counts) -> [u8; RECORD] {
        let target = self.target();
        let output = self.servo.tick(&mut self.state, counts, &target);
        self.detector.update(&mut self.sticks, counts, target.velocity);
        self.tick = self.tick.wrapping_add(1);
        record(&target, &output, self.servo.dac().volts(output.code), &self.sticks)
    }
}
