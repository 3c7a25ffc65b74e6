//! A run's settings on their way to a board that closes the loop itself.
//!
//! A board reads no TOML. The host checks the scenario, takes out of it what the controller needs,
//! and sends it number by number; the board builds the same servo, supervisor and path from the same
//! numbers with the same constructors. The settings follow from the declarations of the parameters ([`RunSettings`]):
//! a walk over them gives the keys, at both ends. A real number travels as the bits of an `f32`.
//!
//! All but the targets of a path runs once a run. An image therefore compiles this crate for size; what its users, compiled
//! for speed, call once is never inlined, or it would be theirs.

#![no_std]
#![forbid(unsafe_code)]

mod declared;
mod path;
mod points;
mod refused;
mod walk;

pub use declared::{Declared, Name, RunSettings, RunTimes, SETTINGS, SETTINGS_HASH, Setting};
pub use path::{Path, Prepared};
pub use points::MAX_KNOTS;
pub use refused::Refusing;

use clutch_core::params::{Choice, Params, Table as _};
use clutch_core::reference::{Knot, ReferenceParams, Table};
use clutch_core::{
    Bounds, Encoder, EncoderParams, FixedCounts, ParamError, SamplingParams, Servo, ServoParams, Supervisor,
    SupervisorParams, VelocityParams,
};
use points::FIRST_KNOT;
use walk::{Place, Visit, Walk};

/// A run that a board cannot take.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsupported {
    /// The velocity comes from this source; boards have the smoothed derivative (5).
    Velocity(&'static str),
    /// A table of so many points; [`MAX_KNOTS`] is the most.
    Knots(usize),
}

impl core::fmt::Display for Unsupported {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Unsupported::Velocity(source) => {
                write!(
                    f,
                    "velocity.{source}: expected velocity.smoothed_derivative, the only source of a board that closes the loop"
                )
            }
            Unsupported::Knots(n) => {
                write!(
                    f,
                    "reference.table has {n} points: expected at most {MAX_KNOTS}, which a board has room for"
                )
            }
        }
    }
}

impl core::error::Error for Unsupported {}

/// The parameters of a run, on the host.
#[derive(Clone, Copy, Debug)]
pub struct RunParams<'a> {
    /// The servo.
    pub servo: &'a ServoParams<f32>,
    /// The supervisor.
    pub supervisor: &'a SupervisorParams<f32>,
    /// Bounds on the plant.
    pub bounds: &'a Bounds<f32>,
    /// The path.
    pub reference: &'a ReferenceParams<'a, f32>,
    /// Position at which the path begins; only its place within a count matters.
    pub start: FixedCounts,
    /// Waiting times.
    pub times: RunTimes,
    /// Ticks of the run.
    pub ticks: u64,
}

/// A run's settings as they go over the wire: a number for each, and the points of a table.
#[derive(Clone, Debug)]
pub struct Settings {
    values: [u64; SETTINGS],
    /// Those that have been set, a bit each.
    set: [u32; SETTINGS.div_ceil(32)],
    knots: [Knot; MAX_KNOTS],
    /// Numbers of points that have been set in their order, two each.
    set_knots: u16,
}

impl Settings {
    /// None set.
    #[inline] // in place: a copy of it would be on the stack of who keeps it
    #[must_use]
    pub const fn empty() -> Self {
        const NONE: Knot = Knot { time_us: 0, position: FixedCounts(0) };
        Settings {
            values: [0; SETTINGS],
            set: [0; SETTINGS.div_ceil(32)],
            knots: [NONE; MAX_KNOTS],
            set_knots: 0,
        }
    }
}

impl Default for Settings {
    #[inline]
    fn default() -> Self {
        Settings::empty()
    }
}

/// A run built from settings.
#[derive(Clone, Copy, Debug)]
pub struct Built {
    /// The servo.
    pub servo: Servo<f32>,
    /// The supervisor.
    pub supervisor: Supervisor<f32>,
    /// The path.
    pub path: Path,
    /// Waiting times.
    pub times: RunTimes,
    /// Ticks of the run.
    pub ticks: u64,
}

/// The reason why settings make no run.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// A setting that was not set: its key.
    Missing(u16),
    /// A choice or a word that is not known, or a number that the parameter's type does not hold: its key.
    Unknown(u16),
    /// A number out of range.
    Unfit {
        /// The key of its setting; `u16::MAX` if it is no setting.
        key: u16,
        /// The number, from 1, of the relation with other parameters that does not hold; 0 for the number's own range.
        relation: u8,
        /// Its value, SI.
        value: f32,
    },
}

impl Settings {
    /// The settings of a run.
    ///
    /// # Errors
    /// Another source of the velocity than (5), a table of more than [`MAX_KNOTS`] points.
    pub fn new(run: &RunParams<'_>) -> Result<Settings, Unsupported> {
        let (servo, supervisor) = (run.servo, run.supervisor);
        #[allow(irrefutable_let_patterns, reason = "boards compile without the others")]
        let VelocityParams::SmoothedDerivative(velocity) = servo.velocity else {
            return Err(Unsupported::Velocity(Choice::<f32>::name(&servo.velocity)));
        };
        let knots =
            if let ReferenceParams::Table(Table { knots, .. }) = run.reference { knots } else { &[][..] };
        let mut settings = Settings::default();
        match settings.knots.get_mut(..knots.len()) {
            Some(room) => room.copy_from_slice(knots),
            None => return Err(Unsupported::Knots(knots.len())),
        }
        settings.set_knots = (knots.len() as u16).wrapping_mul(2);
        let mut run = RunSettings {
            ticks: run.ticks,
            start: run.start.0 as u32 & 0xffff,
            times: run.times,
            sampling: SamplingParams { period: servo.period },
            encoder: EncoderParams { counts_per_rev: servo.encoder.counts_per_rev() },
            dac: servo.dac,
            velocity,
            model: servo.model,
            law: servo.law,
            output: servo.output,
            shell: servo.shell,
            on_fault: supervisor.on_fault,
            limits: supervisor.limits,
            speed: supervisor.speed,
            bounds: *run.bounds,
            reference: *run.reference,
        };
        run.edit(&mut Walk::new(Writer(&mut settings), knots.len() as u64));
        Ok(settings)
    }

    /// Every setting as its key and its value on the wire, the points of a table last.
    pub fn each(&self, mut f: impl FnMut(u16, u64)) {
        for key in 0..SETTINGS as u16 {
            if let Some(value) = self.get(key) {
                f(key, value);
            }
        }
        let mut key = FIRST_KNOT;
        for knot in self.knots.iter().take(usize::from(self.set_knots / 2)) {
            f(key, knot.time_us);
            f(key.wrapping_add(1), knot.position.0.cast_unsigned());
            key = key.wrapping_add(2);
        }
    }

    /// True if there is a setting of this key.
    #[must_use]
    pub fn knows(key: u16) -> bool {
        let knot = key.checked_sub(FIRST_KNOT).is_some_and(|n| usize::from(n / 2) < MAX_KNOTS);
        knot || usize::from(key) < SETTINGS
    }

    /// Takes a setting; true if there is such a one. The build of a run shows whether it fits.
    #[inline(never)]
    pub fn set(&mut self, key: u16, value: u64) -> bool {
        if let Some(number) = key.checked_sub(FIRST_KNOT) {
            let Some(knot) = self.knots.get_mut(usize::from(number / 2)) else { return false };
            if number % 2 == 0 {
                knot.time_us = value;
            } else {
                knot.position = FixedCounts(value.cast_signed());
            }
            // They come in order; one that is left out stays missing.
            if number == self.set_knots {
                self.set_knots = self.set_knots.wrapping_add(1);
            }
            return true;
        }
        let (word, bit) = place(key);
        let (Some(place), Some(set)) = (self.values.get_mut(usize::from(key)), self.set.get_mut(word)) else {
            return false;
        };
        *place = value;
        *set |= bit;
        true
    }

    /// The value of a setting, as it goes over the wire; none if it has not been set.
    #[must_use]
    pub fn get(&self, key: u16) -> Option<u64> {
        let (word, bit) = place(key);
        let set = self.set.get(word).is_some_and(|set| set & bit != 0);
        self.values.get(usize::from(key)).copied().filter(|_| set)
    }

    /// Room for the points of a table; [`Path::target`] knows their number.
    #[must_use]
    pub fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// Servo, supervisor and path.
    ///
    /// # Errors
    /// As [`Built::new`].
    #[inline(never)]
    pub fn build(&self) -> Result<Built, Misfit> {
        let whole = usize::from(self.set_knots / 2);
        let lacks = FIRST_KNOT.wrapping_add(self.set_knots);
        Built::from_numbers(|key| self.get(key), self.knots.get(..whole).unwrap_or(&[]), lacks)
    }
}

impl Built {
    /// Servo, supervisor and path from numbers wherever they lie: `number` gives a setting's value as it goes over the wire, none if it
    /// has none; `knots` are the points of a path that is a table.
    ///
    /// # Errors
    /// A setting or a point that is missing, a choice that is not known, a number that a constructor refuses.
    pub fn new<F: Fn(u16) -> Option<u64>>(number: F, knots: &[Knot]) -> Result<Built, Misfit> {
        let lacks = FIRST_KNOT.wrapping_add((knots.len() as u16).wrapping_mul(2));
        Built::from_numbers(number, knots, lacks)
    }

    /// The same; `lacks` is the key of the first number of a point that is not there.
    fn from_numbers<F: Fn(u16) -> Option<u64>>(
        number: F,
        knots: &[Knot],
        lacks: u16,
    ) -> Result<Built, Misfit> {
        let mut run = <RunSettings<'static> as Params<f32>>::blank();
        let mut reader = Reader::new(&number);
        let points = reader.walk(&mut run, 0).min(MAX_KNOTS as u64);
        // The parameters now hold the values that were sent, or they cannot hold them.
        reader.read = true;
        reader.walk(&mut run, points);
        if let Some(misfit) = reader.misfit {
            return Err(misfit);
        }
        let Some(knots) = knots.get(..points as usize) else {
            return Err(Misfit::Missing(lacks));
        };
        Built::from(&run, knots).map_err(|error| {
            reader.error = Some(error);
            reader.walk(&mut run, points);
            let ParamError { relation, value, .. } = error;
            Misfit::Unfit { key: reader.key.unwrap_or(u16::MAX), relation, value }
        })
    }

    fn from(run: &RunSettings<'static>, knots: &[Knot]) -> Result<Built, ParamError<f32>> {
        run.check_rows()?;
        let servo = ServoParams {
            period: run.sampling.period,
            encoder: Encoder::new(run.encoder.counts_per_rev)?,
            dac: run.dac,
            velocity: VelocityParams::SmoothedDerivative(run.velocity),
            model: run.model,
            law: run.law,
            output: run.output,
            shell: run.shell,
        };
        let limits = SupervisorParams { on_fault: run.on_fault, speed: run.speed, limits: run.limits };
        Ok(Built {
            path: Path::new(
                &run.reference,
                knots,
                FixedCounts(run.start.into()),
                servo.encoder,
                servo.period,
            )?,
            servo: Servo::new(&servo)?,
            supervisor: Supervisor::new(&limits, &servo, &run.bounds)?,
            times: run.times,
            ticks: run.ticks,
        })
    }
}

/// The word and the bit of a setting among those that have been set.
fn place(key: u16) -> (usize, u32) {
    (usize::from(key / 32), 1_u32.wrapping_shl(u32::from(key)))
}

/// Takes a run's parameters as settings.
struct Writer<'a>(&'a mut Settings);

impl Visit for Writer<'_> {
    fn visit(&mut self, place: Place, held: u64) -> u64 {
        self.0.set(place.key, held);
        held
    }
}

/// Gives settings to a run's parameters.
struct Reader<'a, F> {
    number: &'a F,
    /// The parameters have been read before.
    read: bool,
    /// The next one is a real number.
    real: bool,
    misfit: Option<Misfit>,
    /// The error whose key is looked for.
    error: Option<ParamError<f32>>,
    key: Option<u16>,
    /// The key's value is the error's, too: some tables stand in several places.
    exact: bool,
}

impl<'a, F: Fn(u16) -> Option<u64>> Reader<'a, F> {
    fn new(number: &'a F) -> Self {
        Reader { number, read: false, real: false, misfit: None, error: None, key: None, exact: false }
    }

    /// Walks over them; the number of points of a table.
    #[inline(never)]
    fn walk(&mut self, run: &mut RunSettings<'static>, points: u64) -> u64 {
        let mut walk = Walk::new(self, points);
        run.edit(&mut walk);
        walk.points
    }
}

impl<F: Fn(u16) -> Option<u64>> Visit for &mut Reader<'_, F> {
    fn real(&mut self) {
        self.real = true;
    }

    #[inline]
    fn visit(&mut self, place: Place, held: u64) -> u64 {
        let (key, real) = (place.key, core::mem::take(&mut self.real));
        let Some(sent) = (self.number)(key) else {
            self.misfit.get_or_insert(Misfit::Missing(key));
            return held;
        };
        if self.read && sent != held {
            self.misfit.get_or_insert(Misfit::Unknown(key));
        }
        // No range holds such a number, and not each is asked for its range before others are compared with it.
        let value = f32::from_bits(sent as u32);
        if real && !value.is_finite() {
            self.misfit.get_or_insert(Misfit::Unfit { key, relation: 0, value });
        }
        if let Some(error) = &self.error
            && (error.table.id(), error.row) == (place.table, place.row)
        {
            let exact = u64::from(error.value.to_bits()) == sent;
            if self.key.is_none() || (exact && !self.exact) {
                (self.key, self.exact) = (Some(key), exact);
            }
        }
        sent
    }
}
