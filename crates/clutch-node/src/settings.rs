//! A run's settings on their way to a board that closes the loop itself.
//!
//! A board reads no TOML. The host checks the scenario, takes out of it what the controller needs,
//! and sends it number by number; the board builds the same servo, supervisor and path from the same
//! numbers with the same constructors. A real number travels as the bits of an `f32`.

use clutch_core::law::{CtcParams, LawParams, OutputParams, PdParams, SmcParams, SmcSignParams};
use clutch_core::reference::{
    Chirp, Interpolation, JerkLimited, Knot, MinimumJerk, Reference, ReferenceParams, Sine, Table, Trapezoid,
};
use clutch_core::{
    Bounds, DacParams, Encoder, FixedCounts, Interval, Micros, ParamError, PlantParams, SafeState, Servo,
    ServoParams, SmoothedDerivativeParams, StribeckParams, Supervisor, SupervisorParams, Target,
    VelocityParams,
};

/// Points that a path given as a table may have on a board: 4 kB.
pub const MAX_KNOTS: usize = 256;

/// Key of the first number of the points; each has two: time (µs), position (2⁻¹⁶ counts).
const FIRST_KNOT: u16 = 0x1000;

/// A setting as the table describes it.
#[derive(Clone, Copy, Debug)]
pub struct SettingInfo {
    /// Its key on the wire.
    pub key: u16,
    /// Its name: with the unit, where it is not plain SI.
    pub name: &'static str,
    /// Its type: `f32`, `u32`, `u64` or `i64`.
    pub ty: &'static str,
    /// What it says.
    pub doc: &'static str,
}

/// A number that fits a frame.
trait Number: Copy {
    fn to_bits(self) -> u64;
    fn from_bits(bits: u64) -> Option<Self>;
}

impl Number for f32 {
    fn to_bits(self) -> u64 {
        u64::from(self.to_bits())
    }
    fn from_bits(bits: u64) -> Option<f32> {
        u32::try_from(bits).ok().map(f32::from_bits)
    }
}

impl Number for u32 {
    fn to_bits(self) -> u64 {
        u64::from(self)
    }
    fn from_bits(bits: u64) -> Option<u32> {
        u32::try_from(bits).ok()
    }
}

impl Number for u64 {
    fn to_bits(self) -> u64 {
        self
    }
    fn from_bits(bits: u64) -> Option<u64> {
        Some(bits)
    }
}

impl Number for i64 {
    fn to_bits(self) -> u64 {
        self.cast_unsigned()
    }
    fn from_bits(bits: u64) -> Option<i64> {
        Some(bits.cast_signed())
    }
}

macro_rules! settings {
    ($($(#[doc = $doc:literal])+ $name:ident: $ty:ident,)+) => {
        /// Every number that a run on a board needs, but for the points of a table.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Numbers {
            $($(#[doc = $doc])+ pub $name: $ty,)+
        }

        #[allow(non_camel_case_types, reason = "named after the fields")]
        #[derive(Clone, Copy)]
        #[repr(u16)]
        enum Key { $($name,)+ }

        /// The settings in the order of their keys.
        pub const SETTINGS: &[SettingInfo] = &[$(SettingInfo {
            key: Key::$name as u16,
            name: stringify!($name),
            ty: stringify!($ty),
            doc: concat!($($doc),+),
        },)+];

        impl Numbers {
            /// Takes a value; whether there is such a setting and the value is one of its type.
            fn set(&mut self, key: u16, bits: u64) -> bool {
                $(if key == Key::$name as u16 {
                    let Some(value) = <$ty as Number>::from_bits(bits) else { return false };
                    self.$name = value;
                    return true;
                })+
                false
            }

            fn each(&self, mut f: impl FnMut(u16, u64)) {
                $(f(Key::$name as u16, Number::to_bits(self.$name));)+
            }
        }
    };
}

settings! {
    /// Sampling period, µs.
    period_us: u32,
    /// Encoder counts per revolution.
    counts_per_rev: u32,
    /// Bits of the converter.
    dac_bits: u32,
    /// Voltage of code 0, V.
    dac_lowest: f32,
    /// Voltage one step above the highest code, V.
    dac_highest: f32,
    /// `K_Kal` in (5).
    smoothing: f32,
    /// `J` of the model, kg m².
    inertia: f32,
    /// `T_u` of the model, N m.
    drive_torque: f32,
    /// `C_d` of the model, N m s/rad.
    viscous_damping: f32,
    /// `K_COF` of the model, N m/V.
    brake_gain: f32,
    /// `μ_s` of the model.
    mu_static: f32,
    /// `μ_d` of the model.
    mu_dynamic: f32,
    /// Stribeck velocity of the model, rad/s.
    stribeck_velocity: f32,
    /// Stribeck exponent of the model.
    stribeck_exponent: f32,
    /// Which law: 0 PD (4), 1 CTC (11), 2 SMC (31), 3 SMC with the sign (29).
    law: u32,
    /// First gain: `K_p`; of CTC `K`.
    gain_0: f32,
    /// Second gain: `K_d`; of CTC `K_p`.
    gain_1: f32,
    /// Third gain: `f` of SMC; of CTC `K_d`.
    gain_2: f32,
    /// Fourth gain: `ε` of SMC.
    gain_3: f32,
    /// Lowest output, V.
    output_lowest: f32,
    /// Highest output, V.
    output_highest: f32,
    /// Output when the demand is not a number, V.
    output_on_invalid: f32,
    /// Time constant of a bumpless start, s.
    bumpless_time: f32,
    /// Safe state: 0 hold, 1 ramp, 2 release, 3 hold then release.
    safe: u32,
    /// Holding voltage of the safe state, V.
    safe_volts: f32,
    /// Of a ramp its rate, V/s; of hold then release how long it holds, s.
    safe_number: f32,
    /// Speed that a path may ask for, rad/s.
    speed_limit: f32,
    /// Largest departure of a count from dead reckoning, rad.
    jump: f32,
    /// Such departures within 128 periods that end control.
    jumps: u32,
    /// Samples in a row after which the law answers again.
    good_samples: u32,
    /// Largest error at rest, rad.
    following_error: f32,
    /// What is added to it for each rad/s, s.
    following_time: f32,
    /// Longest time at a limit of the output, s.
    saturation_time: f32,
    /// Counts that a shaft must have moved before standing still is a fault.
    stand_still: f32,
    /// By how much friction may exceed its bounds in that check.
    friction_margin: f32,
    /// Lost samples within 128 periods that end control.
    lost: u32,
    /// Late samples or answers within 128 periods that end control.
    late: u32,
    /// Repeated or reordered samples within 128 periods that end control.
    disorder: u32,
    /// Periods without a sample that end control.
    silence_cycles: u32,
    /// An answer later than this is late, µs.
    deadline_us: u32,
    /// Late answers within 128 periods that end control.
    overruns: u32,
    /// Bounds on the inertia: low, kg m².
    inertia_low: f32,
    /// High, kg m².
    inertia_high: f32,
    /// Bounds on the driving torque: low, N m.
    drive_torque_low: f32,
    /// High, N m.
    drive_torque_high: f32,
    /// Bounds on the viscous damping: low, N m s/rad.
    viscous_damping_low: f32,
    /// High, N m s/rad.
    viscous_damping_high: f32,
    /// Bounds on the brake gain: low, N m/V.
    brake_gain_low: f32,
    /// High, N m/V.
    brake_gain_high: f32,
    /// Bounds on static friction: low.
    mu_static_low: f32,
    /// High.
    mu_static_high: f32,
    /// Bounds on dynamic friction: low.
    mu_dynamic_low: f32,
    /// High.
    mu_dynamic_high: f32,
    /// The watchdog of encoder and converter, µs.
    watchdog_us: u32,
    /// How long after its sample a code is valid, µs.
    valid_us: u32,
    /// Time without a sample after which the silence check runs, µs.
    silence_us: u32,
    /// Time without a frame of the host after which the run ends in the safe state, µs; 0 goes on.
    host_silence_us: u32,
    /// Ticks of the run, after which it ends in the safe state.
    ticks: u64,
    /// Which path: 0 hold, 1 ramp, 2 trapezoid, 3 jerk-limited, 4 minimum jerk, 5 sine, 6 chirp, 7 table with
    /// straight lines, 8 table with cubics.
    path: u32,
    /// The path's numbers in the order of the scenario's keys, SI.
    path_0: f32,
    /// The second.
    path_1: f32,
    /// The third.
    path_2: f32,
    /// The fourth.
    path_3: f32,
    /// The fifth.
    path_4: f32,
    /// The sixth.
    path_5: f32,
    /// Where within a count the path begins, 2⁻¹⁶ counts.
    start: i64,
    /// Points of the table.
    knots: u32,
}

/// Hash of the table of settings (FNV-1a, 64 bit, over `name:type` and a line feed each): two ends
/// with the same hash mean the same by each key.
pub const SETTINGS_HASH: u64 = {
    const fn fnv(mut hash: u64, mut text: &[u8]) -> u64 {
        while let [byte, rest @ ..] = text {
            hash = (hash ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
            text = rest;
        }
        hash
    }
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut table = SETTINGS;
    while let [setting, rest @ ..] = table {
        hash = fnv(hash, setting.name.as_bytes());
        hash = fnv(hash, b":");
        hash = fnv(hash, setting.ty.as_bytes());
        hash = fnv(hash, b"\n");
        table = rest;
    }
    hash
};

/// What a board cannot run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsupported {
    /// The velocity comes from an observer; boards have the smoothed derivative (5).
    Observer,
    /// A path of a kind that this build does not know.
    Path,
    /// A table of so many points; [`MAX_KNOTS`] is the most.
    Knots(usize),
}

impl core::fmt::Display for Unsupported {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Unsupported::Observer => f.write_str(
                "velocity.observer: a board that closes the loop has velocity.smoothed_derivative only",
            ),
            Unsupported::Path => f.write_str("reference: a board does not know this kind of path"),
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

/// What settings are made of, on the host.
#[derive(Clone, Copy, Debug)]
pub struct RunParams<'a> {
    /// The servo.
    pub servo: &'a ServoParams<f32>,
    /// The supervisor.
    pub supervisor: &'a SupervisorParams<f32>,
    /// What is known of the plant.
    pub bounds: &'a Bounds<f32>,
    /// The path.
    pub reference: &'a ReferenceParams<'a, f32>,
    /// Where within a count the path begins.
    pub start: FixedCounts,
    /// The watchdog of encoder and converter.
    pub watchdog: Micros,
    /// How long after its sample a code is valid.
    pub valid: Micros,
    /// Time without a sample after which the silence check runs.
    pub silence: Micros,
    /// Time without a frame of the host after which the run ends; 0 goes on.
    pub host_silence: Micros,
    /// Ticks of the run.
    pub ticks: u64,
}

/// A run's settings: the numbers and the points of a table.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The numbers.
    pub numbers: Numbers,
    knots: [Knot; MAX_KNOTS],
    /// Which numbers have been set, a bit each.
    seen: u128,
    /// How many numbers of points have been set in their order, two each.
    seen_knots: u32,
}

const _: () = assert!(SETTINGS.len() < 128, "a bit for each");

impl Default for Settings {
    fn default() -> Self {
        const NONE: Knot = Knot { time_us: 0, position: FixedCounts(0) };
        Settings { numbers: Numbers::default(), knots: [NONE; MAX_KNOTS], seen: 0, seen_knots: 0 }
    }
}

/// What settings build.
#[derive(Clone, Copy, Debug)]
pub struct Built {
    /// The servo.
    pub servo: Servo<f32>,
    /// The supervisor.
    pub supervisor: Supervisor<f32>,
    /// The path.
    pub path: Path,
}

/// A path, without the points of a table.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    kind: Kind,
    encoder: Encoder,
    period: Micros,
    start: FixedCounts,
    /// Whole counts at the start: a path is given from there on.
    first: FixedCounts,
}

#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
enum Kind {
    Formula(Reference<'static, f32>),
    Table(Interpolation),
}

/// Why settings make no run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// A setting that was not set: its key.
    Missing(u16),
    /// A kind (law, safe state, path) that is not known: its key.
    Unknown(u16),
    /// A number out of range.
    Param(ParamError<f32>),
}

impl From<ParamError<f32>> for Misfit {
    fn from(e: ParamError<f32>) -> Self {
        Misfit::Param(e)
    }
}

impl Settings {
    /// The settings of a run.
    ///
    /// # Errors
    /// An observer, a path of an unknown kind, a table of more than [`MAX_KNOTS`] points.
    pub fn new(run: &RunParams<'_>) -> Result<Settings, Unsupported> {
        let (s, v, b) = (run.servo, run.supervisor, run.bounds);
        let VelocityParams::SmoothedDerivative(SmoothedDerivativeParams { smoothing }) = s.velocity else {
            return Err(Unsupported::Observer);
        };
        let (law, [gain_0, gain_1, gain_2, gain_3]) = match s.law {
            LawParams::Pd(p) => (0, [p.kp, p.kd, 0.0, 0.0]),
            LawParams::Ctc(p) => (1, [p.outer_gain, p.kp, p.kd, 0.0]),
            LawParams::Smc(p) => (2, [p.kp, p.kd, p.slope, p.boundary]),
            LawParams::SmcSign(p) => (3, [p.kp, p.kd, p.slope, 0.0]),
        };
        let (safe, safe_volts, safe_number) = match v.on_fault {
            SafeState::Hold { volts } => (0, volts, 0.0),
            SafeState::Ramp { volts_per_s, volts } => (1, volts, volts_per_s),
            SafeState::Release => (2, 0.0, 0.0),
            SafeState::HoldThenRelease { volts, after } => (3, volts, after),
        };
        let mut settings = Settings::default();
        let mut points: &[Knot] = &[];
        let (path, [path_0, path_1, path_2, path_3, path_4, path_5]) = match *run.reference {
            ReferenceParams::Hold => (0, [0.0; 6]),
            ReferenceParams::Ramp(rate) => (1, [rate, 0.0, 0.0, 0.0, 0.0, 0.0]),
            ReferenceParams::Trapezoid(p) => (2, [p.distance, p.speed, p.acceleration, 0.0, 0.0, 0.0]),
            ReferenceParams::JerkLimited(p) => (3, [p.distance, p.speed, p.acceleration, p.jerk, 0.0, 0.0]),
            ReferenceParams::MinimumJerk(p) => (4, [p.distance, p.duration, 0.0, 0.0, 0.0, 0.0]),
            ReferenceParams::Sine(p) => (5, [p.rate, p.amplitude, p.frequency, p.phase, 0.0, 0.0]),
            ReferenceParams::Chirp(p) => (6, [p.rate, p.amplitude, p.from, p.to, p.duration, p.phase]),
            ReferenceParams::Table(Table { knots, interpolation }) => {
                points = knots;
                (if interpolation == Interpolation::Linear { 7 } else { 8 }, [0.0; 6])
            }
            _ => return Err(Unsupported::Path),
        };
        match settings.knots.get_mut(..points.len()) {
            Some(room) => room.copy_from_slice(points),
            None => return Err(Unsupported::Knots(points.len())),
        }
        settings.numbers = Numbers {
            period_us: s.period.0,
            counts_per_rev: s.encoder.counts_per_rev(),
            dac_bits: s.dac.bits.into(),
            dac_lowest: s.dac.lowest,
            dac_highest: s.dac.highest,
            smoothing,
            inertia: s.model.inertia,
            drive_torque: s.model.drive_torque,
            viscous_damping: s.model.viscous_damping,
            brake_gain: s.model.brake_gain,
            mu_static: s.model.friction.mu_static,
            mu_dynamic: s.model.friction.mu_dynamic,
            stribeck_velocity: s.model.friction.stribeck_velocity,
            stribeck_exponent: s.model.friction.stribeck_exponent,
            law,
            gain_0,
            gain_1,
            gain_2,
            gain_3,
            output_lowest: s.output.lowest,
            output_highest: s.output.highest,
            output_on_invalid: s.output.on_invalid,
            bumpless_time: s.output.bumpless_time,
            safe,
            safe_volts,
            safe_number,
            speed_limit: v.speed_limit,
            jump: v.jump,
            jumps: v.jumps,
            good_samples: v.good_samples,
            following_error: v.following_error,
            following_time: v.following_time,
            saturation_time: v.saturation_time,
            stand_still: v.stand_still,
            friction_margin: v.friction_margin,
            lost: v.lost,
            late: v.late,
            disorder: v.disorder,
            silence_cycles: v.silence_cycles,
            deadline_us: v.deadline.0,
            overruns: v.overruns,
            inertia_low: b.inertia.low,
            inertia_high: b.inertia.high,
            drive_torque_low: b.drive_torque.low,
            drive_torque_high: b.drive_torque.high,
            viscous_damping_low: b.viscous_damping.low,
            viscous_damping_high: b.viscous_damping.high,
            brake_gain_low: b.brake_gain.low,
            brake_gain_high: b.brake_gain.high,
            mu_static_low: b.mu_static.low,
            mu_static_high: b.mu_static.high,
            mu_dynamic_low: b.mu_dynamic.low,
            mu_dynamic_high: b.mu_dynamic.high,
            watchdog_us: run.watchdog.0,
            valid_us: run.valid.0,
            silence_us: run.silence.0,
            host_silence_us: run.host_silence.0,
            ticks: run.ticks,
            path,
            path_0,
            path_1,
            path_2,
            path_3,
            path_4,
            path_5,
            start: run.start.0,
            knots: points.len() as u32,
        };
        settings.seen = (1 << SETTINGS.len()) - 1;
        settings.seen_knots = settings.numbers.knots.wrapping_mul(2);
        Ok(settings)
    }

    /// Every setting as its key and its value on the wire, the points of a table last.
    pub fn each(&self, mut f: impl FnMut(u16, u64)) {
        self.numbers.each(&mut f);
        let mut key = FIRST_KNOT;
        for knot in self.points() {
            f(key, knot.time_us);
            f(key.wrapping_add(1), knot.position.0.cast_unsigned());
            key = key.wrapping_add(2);
        }
    }

    /// Whether there is a setting of this key.
    #[must_use]
    pub fn knows(key: u16) -> bool {
        let knot = key.checked_sub(FIRST_KNOT).is_some_and(|n| usize::from(n / 2) < MAX_KNOTS);
        knot || usize::from(key) < SETTINGS.len()
    }

    /// Takes a setting; whether there is such a one and the value fits its type.
    pub fn set(&mut self, key: u16, value: u64) -> bool {
        if let Some(number) = key.checked_sub(FIRST_KNOT) {
            let Some(knot) = self.knots.get_mut(usize::from(number / 2)) else { return false };
            if number % 2 == 0 {
                knot.time_us = value;
            } else {
                knot.position = FixedCounts(value.cast_signed());
            }
            // They come in order; one that is left out stays missing.
            if u32::from(number) == self.seen_knots {
                self.seen_knots = self.seen_knots.wrapping_add(1);
            }
            return true;
        }
        if !self.numbers.set(key, value) {
            return false;
        }
        self.seen |= 1_u128.wrapping_shl(u32::from(key));
        true
    }

    /// The points of the table.
    #[must_use]
    pub fn points(&self) -> &[Knot] {
        self.knots.get(..self.numbers.knots as usize).unwrap_or(&[])
    }

    /// Servo, supervisor and path.
    ///
    /// # Errors
    /// A setting that is missing, a kind that is not known, a number that a constructor refuses.
    pub fn build(&self) -> Result<Built, Misfit> {
        let missing = (!self.seen).trailing_zeros();
        if missing < SETTINGS.len() as u32 {
            return Err(Misfit::Missing(missing as u16));
        }
        let n = &self.numbers;
        if self.seen_knots / 2 < n.knots {
            return Err(Misfit::Missing(FIRST_KNOT.wrapping_add(self.seen_knots as u16)));
        }
        let servo = ServoParams {
            period: Micros(n.period_us),
            encoder: Encoder::new(n.counts_per_rev)?,
            dac: DacParams {
                bits: u8::try_from(n.dac_bits).unwrap_or(u8::MAX),
                lowest: n.dac_lowest,
                highest: n.dac_highest,
            },
            velocity: VelocityParams::SmoothedDerivative(SmoothedDerivativeParams { smoothing: n.smoothing }),
            model: PlantParams {
                inertia: n.inertia,
                drive_torque: n.drive_torque,
                viscous_damping: n.viscous_damping,
                brake_gain: n.brake_gain,
                friction: StribeckParams {
                    mu_static: n.mu_static,
                    mu_dynamic: n.mu_dynamic,
                    stribeck_velocity: n.stribeck_velocity,
                    stribeck_exponent: n.stribeck_exponent,
                },
            },
            law: match n.law {
                0 => LawParams::Pd(PdParams { kp: n.gain_0, kd: n.gain_1 }),
                1 => LawParams::Ctc(CtcParams { outer_gain: n.gain_0, kp: n.gain_1, kd: n.gain_2 }),
                2 => LawParams::Smc(SmcParams {
                    kp: n.gain_0,
                    kd: n.gain_1,
                    slope: n.gain_2,
                    boundary: n.gain_3,
                }),
                3 => LawParams::SmcSign(SmcSignParams { kp: n.gain_0, kd: n.gain_1, slope: n.gain_2 }),
                _ => return Err(Misfit::Unknown(Key::law as u16)),
            },
            output: OutputParams {
                lowest: n.output_lowest,
                highest: n.output_highest,
                on_invalid: n.output_on_invalid,
                bumpless_time: n.bumpless_time,
            },
        };
        let limits = SupervisorParams {
            on_fault: match n.safe {
                0 => SafeState::Hold { volts: n.safe_volts },
                1 => SafeState::Ramp { volts_per_s: n.safe_number, volts: n.safe_volts },
                2 => SafeState::Release,
                3 => SafeState::HoldThenRelease { volts: n.safe_volts, after: n.safe_number },
                _ => return Err(Misfit::Unknown(Key::safe as u16)),
            },
            speed_limit: n.speed_limit,
            jump: n.jump,
            jumps: n.jumps,
            good_samples: n.good_samples,
            following_error: n.following_error,
            following_time: n.following_time,
            saturation_time: n.saturation_time,
            stand_still: n.stand_still,
            friction_margin: n.friction_margin,
            lost: n.lost,
            late: n.late,
            disorder: n.disorder,
            silence_cycles: n.silence_cycles,
            deadline: Micros(n.deadline_us),
            overruns: n.overruns,
        };
        let between = |low, high| Interval { low, high };
        let bounds = Bounds {
            inertia: between(n.inertia_low, n.inertia_high),
            drive_torque: between(n.drive_torque_low, n.drive_torque_high),
            viscous_damping: between(n.viscous_damping_low, n.viscous_damping_high),
            brake_gain: between(n.brake_gain_low, n.brake_gain_high),
            mu_static: between(n.mu_static_low, n.mu_static_high),
            mu_dynamic: between(n.mu_dynamic_low, n.mu_dynamic_high),
        };
        let path = self.path(servo.encoder, servo.period)?;
        Ok(Built { servo: Servo::new(&servo)?, supervisor: Supervisor::new(&limits, &servo, &bounds)?, path })
    }

    fn path(&self, encoder: Encoder, period: Micros) -> Result<Path, Misfit> {
        let n = &self.numbers;
        let start = FixedCounts(n.start);
        let (a, b, c, d) = (n.path_0, n.path_1, n.path_2, n.path_3);
        let table = |interpolation| {
            let table = ReferenceParams::<f32>::Table(Table { knots: self.points(), interpolation });
            Reference::new(&table, start, encoder, period).map(|_| Kind::Table(interpolation))
        };
        let formula = match n.path {
            0 => ReferenceParams::Hold,
            1 => ReferenceParams::Ramp(a),
            2 => ReferenceParams::Trapezoid(Trapezoid { distance: a, speed: b, acceleration: c }),
            3 => {
                ReferenceParams::JerkLimited(JerkLimited { distance: a, speed: b, acceleration: c, jerk: d })
            }
            4 => ReferenceParams::MinimumJerk(MinimumJerk { distance: a, duration: b }),
            5 => ReferenceParams::Sine(Sine { rate: a, amplitude: b, frequency: c, phase: d }),
            6 => ReferenceParams::Chirp(Chirp {
                rate: a,
                amplitude: b,
                from: c,
                to: d,
                duration: n.path_4,
                phase: n.path_5,
            }),
            7 | 8 => ReferenceParams::Hold,
            _ => return Err(Misfit::Unknown(Key::path as u16)),
        };
        let kind = match n.path {
            7 => table(Interpolation::Linear)?,
            8 => table(Interpolation::Cubic)?,
            _ => Kind::Formula(Reference::new(&formula, start, encoder, period)?),
        };
        let path = Path { kind, encoder, period, start, first: FixedCounts(0) };
        let first = path.target(self.points(), 0).position.0 >> FixedCounts::FRACTION_BITS;
        Ok(Path { first: FixedCounts::from_counts(first), ..path })
    }
}

impl Path {
    /// Where the shaft shall be at a tick, from the count on which the run begins.
    #[must_use]
    pub fn target(&self, knots: &[Knot], tick: u64) -> Target<f32> {
        let target = match &self.kind {
            Kind::Formula(reference) => reference.at(tick),
            Kind::Table(interpolation) => {
                let table = Table { knots, interpolation: *interpolation };
                let target = table.at(tick, self.encoder, self.period);
                Target { position: target.position.plus(self.start), ..target }
            }
        };
        Target { position: FixedCounts(target.position.0.wrapping_sub(self.first.0)), ..target }
    }
}
