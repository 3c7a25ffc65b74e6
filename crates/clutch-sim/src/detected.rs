//! Stick-slip as a loop on hardware knows it: from counts, voltages and the path.

use crate::meter::{Gap, Meter, Tally};
use crate::metrics::Detected;
use crate::number;
use crate::run_spec::{Keep, RunSpec};
use clutch_core::law::LawParams;
use clutch_core::{Counts, Encoder, ParamError, Plant, StickSlip, StickSlipParams, StickSlipState};

/// Way of the path in a silence that is a stair: in even motion it goes one count, in a stair at least one more.
pub(crate) const STAIR: StickSlipParams<f64> = StickSlipParams { gap: 2.0, ticks: 1 };
/// Width of the bounds within which a number of cycles is given: this share of the upper one, and so many cycles.
const TOLD_WITHIN: (f64, f64) = (0.2, 2.0);

/// The word of a run's counts and voltages on its stick-slip cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// So many a second, within 20 % and two cycles of the run.
    Told(f64),
    /// No fewer, and perhaps many more.
    AtLeast(f64),
    /// Perhaps none, perhaps many.
    CannotTell,
}

impl Detected {
    /// Its words.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        match self.told_cycles_per_s {
            Some(told) => Verdict::Told(told),
            None => match self.least_cycles_per_s {
                Some(least) if least > 0.0 => Verdict::AtLeast(least),
                _ => Verdict::CannotTell,
            },
        }
    }

    /// The same in words, without the unit.
    #[must_use]
    pub fn words(&self) -> String {
        let [least, most] = self.bounds().map(number);
        match self.verdict() {
            Verdict::Told(_) if least == most => least,
            Verdict::Told(_) => format!("{least} to {most}"),
            Verdict::AtLeast(_) => format!("at least {least}"),
            Verdict::CannotTell => "cannot tell".into(),
        }
    }

    /// The reason why there is no number, if there is none.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        self.told_cycles_per_s.is_none().then(|| {
            let [least, most] = self.bounds();
            if self.least_cycles_per_s.is_some() && self.most_cycles_per_s.is_none() {
                return format!(
                    "the law went in micro-steps, of which a count may hold several: the shaft has stuck in {} counts/s",
                    number(least)
                );
            }
            format!(
                "counts and voltage leave {} to {} cycles/s, sticks within one count as one: gaps between two edges last long enough for a stick \
                 unseen, and the voltage falls far enough in them; a finer encoder, or another rate, shows more",
                number(least),
                number(most)
            )
        })
    }

    /// The bounds, cycles/s; where they were not asked for, all that there may be.
    fn bounds(&self) -> [f64; 2] {
        [self.least_cycles_per_s.unwrap_or(0.0), self.most_cycles_per_s.unwrap_or(f64::INFINITY)]
    }
}

/// The result of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Noticed {
    /// A silence begins to count as a stick.
    pub begins: bool,
    /// The gap that the sample has ended, judged, if bounds are found.
    pub gap: Option<Gap>,
}

/// Watches a run, sample by sample. It allocates when it is made, and never later.
#[derive(Clone, Debug)]
pub struct Detector {
    silence: StickSlip<f64>,
    stairs: StickSlip<f64>,
    silent: StickSlipState<f64>,
    climbing: StickSlipState<f64>,
    meter: Option<Meter>,
    tally: Tally,
    period: f64,
    settle: f64,
    /// The first sample after settling.
    from: u64,
    /// Cycles, periods stuck and stairs before it.
    before: (u64, u64, u64),
    /// Periods before it of a silence that is not yet found to be a stick.
    unheard: u64,
    /// Velocity of the path below which the law goes in micro-steps, rad/s, and if it has since settling: a count holds
    /// several sticks then.
    steps_below: f64,
    stepped: bool,
}

impl Detector {
    /// For a run's encoder, period and settling time; it believes the run's model. Bounds by counts and voltage are found
    /// if samples are kept.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn new(spec: &RunSpec<'_>, keep: Keep) -> Result<Self, ParamError> {
        let encoder = Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev)?;
        let (period, settle) = (spec.period.period::<f64>()?, spec.run.settle);
        let meter = match keep {
            Keep::Trace => {
                let plant = Plant::new(&spec.model)?;
                Some(Meter::new(plant, (&spec.law, &spec.velocity), encoder, spec.period))
            }
            Keep::Figures => None,
        };
        Ok(Detector {
            silence: StickSlip::new(&StickSlipParams::default(), encoder, spec.period)?,
            stairs: StickSlip::new(&STAIR, encoder, spec.period)?,
            silent: StickSlipState::default(),
            climbing: StickSlipState::default(),
            meter,
            tally: Tally::default(),
            period,
            settle,
            from: libm::ceil(settle / period - 1e-9) as u64,
            before: (0, 0, 0),
            unheard: 0,
            steps_below: if let LawParams::Glide(law) = &spec.law { law.micro } else { 0.0 },
            stepped: false,
        })
    }

    /// Sample number `tick`: its counts, the velocity of the path (rad/s), and the voltage that was given in answer to it,
    /// V.
    pub fn sample(&mut self, tick: u64, counts: Counts, path_velocity: f64, volts: f64) -> Noticed {
        let begins = self.silence.update(&mut self.silent, counts, path_velocity);
        self.stairs.update(&mut self.climbing, counts, path_velocity);
        let gap = self.meter.as_mut().and_then(|meter| meter.sample(tick, counts, volts));
        if let Some(gap) = &gap {
            self.tally.take(gap, self.from);
        }
        let silent = u64::from(self.silent.silent_ticks());
        if (tick as f64) * self.period < self.settle {
            self.before = (self.silent.cycles(), self.silent.stuck_ticks(), self.climbing.cycles());
            self.unheard = if self.silent.stuck() { 0 } else { silent };
            return Noticed { begins, gap };
        }
        let fast = path_velocity.abs();
        self.stepped |= fast > 0.0 && fast < self.steps_below;
        if begins {
            // The silence before settling has been added with the rest.
            self.before.1 += std::mem::take(&mut self.unheard);
        } else if silent == 0 {
            self.unheard = 0;
        }
        Noticed { begins, gap }
    }

    /// The figures so far, over `measured_s` seconds after settling.
    #[must_use]
    pub fn finish(&self, measured_s: f64) -> Detected {
        let time = measured_s.max(self.period);
        let per_s = |n: u64| n as f64 / time;
        let seen = per_s(self.silent.cycles() - self.before.0);
        // A shaft that stands at the end may have stuck, and no edge has judged it.
        let unended = u64::from(self.silent.stuck());
        let (least, most) = (per_s(self.tally.least), per_s(self.tally.most + unended));
        let told = self.meter.is_some()
            && !self.stepped
            && most - least <= TOLD_WITHIN.0 * most + TOLD_WITHIN.1 / time;
        let of_meter = |bound: f64| self.meter.is_some().then_some(bound);
        Detected {
            stick_slip_cycles_per_s: seen,
            stick_time_fraction: (self.silent.stuck_ticks() - self.before.1) as f64 * self.period / time,
            stairs_per_s: per_s(self.climbing.cycles() - self.before.2),
            least_cycles_per_s: of_meter(least),
            most_cycles_per_s: of_meter(most).filter(|_| !self.stepped),
            told_cycles_per_s: told.then(|| seen.max(least).min(most)),
        }
    }

    /// Largest movement between one silence and the next, counts; 0 with fewer than two.
    #[must_use]
    pub fn stair(&self) -> u32 {
        self.silent.stair()
    }
}
