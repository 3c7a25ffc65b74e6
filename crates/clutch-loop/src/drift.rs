//! Drift: mean friction over load, as counts and voltages show it, against the bounds that a certificate assumes.
//!
//! A shaft that slides balances: over a time the pulls of drive and motor, less friction and damping, are what it has gained
//! in momentum. So the voltage that holds it shows its friction, as a multiple of the model's, while drive, motor and
//! inertia are the model's:
//!
//! ```text
//! h = (± ∫(T_u + T(u)) dt − C_d |Δθ| ∓ J Δω) / ∫ μ(ω) N(u) dt
//! ```
//!
//! It is one number. With a brake, friction or gain up by a tenth and load down by a tenth give the same counts at the same
//! voltages: the number is friction over load. A time between two edges, a slice, gives one `h`; slices differ, as friction
//! is uneven along the disc, and sixteen of them give a mean with a standard error. The bounds of `h` follow
//! from the same sums, at their corners.
//!
//! A shaft that may have stuck within a gap between two edges ([`clutch_sim::meter`]) leaves an interval. Friction at rest
//! carries up to `μ_s N`, so that `h` may be lower than the balance; and a shaft that broke away had `h μ_s N ≤ T_u + T`, so
//! that it is at most what the lowest load of the pad in the gap let go. A shaft that stands says nothing.

use crate::build_error::BuildError;
use clutch_core::friction::FrictionModel;
use clutch_core::{ActuatorKind, Bounds, Counts, Encoder, Plant};
use clutch_log::{CommandRecord, CommandSource, SampleRecord};
use clutch_sim::detected::Detector;
use clutch_sim::meter::Gap;
use clutch_sim::{Scenario, number};
use serde_json::{Value, json};

/// Slices of a mean.
const SLICES: usize = 16;
/// Windows, each of slices that are so many of the one before: they report less soon, and smaller drifts.
const LEVELS: usize = 4;
const LONGER: u64 = 4;
/// A slice takes at least this time, s, this way, rad, and so many counts.
const SHORTEST: f64 = 0.1;
const LEAST_WAY: f64 = 0.5 / 180.0 * std::f64::consts::PI;
const LEAST_COUNTS: f64 = 8.0;
/// Periods before and after a sample, of which its velocity is the mean.
const AROUND: usize = 10;
/// Counts by which the path may go further than the shaft within a gap; beyond, the shaft stood.
const BEHIND: f64 = 3.0;
/// The longest gap of a shaft that moves, s.
const LONGEST_GAP: f64 = 2.0;
/// Samples in a row that may be lost: the board kept its voltage.
const MOST_LOST: u64 = 5;
/// Standard errors of a mean that it may be off.
const STANDARD_ERRORS: f64 = 4.0;
/// Share by which it may be off beside: delay and rounding.
const RESOLUTION: f64 = 0.02;
/// Friction over damping, below which it is no friction that determines the motion.
const LEAST_FRICTION: f64 = 0.1;
/// Share by which it is low with a ripple of 15 %, as the meter believes it: what is seen is the mean of the inverse.
const INVERSE: f64 = 0.15 * 0.15;

/// Friction over load of a window, as multiples of the model's, and what the bounds leave of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The mean, of a shaft that slid all the way.
    pub friction: f64,
    /// No less.
    pub least: f64,
    /// No more; infinite where the shaft may have stuck and was let go.
    pub most: f64,
    /// Least within the bounds.
    pub low: f64,
    /// Greatest within the bounds.
    pub high: f64,
}

impl Seen {
    /// True if no plant within the bounds moves so.
    #[must_use]
    pub fn outside(&self) -> bool {
        self.least > self.high || self.most < self.low
    }

    /// The figures between which friction is known to be, in words.
    fn interval(&self) -> String {
        let least = number(self.least);
        if self.most.is_finite() {
            format!("{least} to {}", number(self.most))
        } else {
            format!("at least {least}")
        }
    }

    /// As far within the bounds as a mean is known: bounds may be a single point.
    fn inside(&self) -> bool {
        self.friction >= self.low * (1.0 - RESOLUTION - INVERSE)
            && self.friction <= self.high * (1.0 + RESOLUTION)
    }

    /// True if friction is above the bounds, where it is outside.
    fn above(&self) -> bool {
        self.least > self.high
    }
}

/// The bounds were left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alarm {
    /// Tick at which that was known.
    pub tick: u64,
    /// The figures.
    pub seen: Seen,
}

/// The drift of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftReport {
    /// Kind of the actuator: of a brake it is friction over load, of a motor friction alone.
    pub actuator: ActuatorKind,
    /// Period, s.
    pub period: f64,
    /// Windows that were judged.
    pub windows: u64,
    /// Those that could not exclude a friction below the bounds, as the shaft may have stuck and was let go.
    pub one_sided: u64,
    /// The last window.
    pub last: Option<Seen>,
    /// Least and greatest mean of the run.
    pub range: (f64, f64),
    /// Times at which the bounds were left.
    pub alarms: u64,
    /// The first of them.
    pub first: Option<Alarm>,
    /// False if the model has no friction that could be determined.
    pub has_friction: bool,
}

/// Name of the quantity that drifts, with an actuator.
#[must_use]
pub fn label(actuator: ActuatorKind) -> &'static str {
    match actuator {
        ActuatorKind::Brake => "friction over load",
        ActuatorKind::Motor | ActuatorKind::Both => "friction, with drive and motor as in the model",
    }
}

impl DriftReport {
    /// Name of the quantity.
    #[must_use]
    pub fn label(&self) -> &'static str {
        label(self.actuator)
    }

    /// The figures in words, or why there are none.
    #[must_use]
    pub fn words(&self) -> String {
        match &self.last {
            Some(last) => format!(
                "{} of the model's ({}), means of {} to {} in the run; bounds {} {}, {}left{}",
                number(last.friction),
                last.interval(),
                number(self.range.0),
                number(self.range.1),
                number(last.low),
                if last.high.is_finite() {
                    format!("to {}", number(last.high))
                } else {
                    "and more".to_owned()
                },
                if self.alarms > 0 { "" } else { "not " },
                if self.one_sided == self.windows { "; sticks hide what is below" } else { "" }
            ),
            None if self.has_friction => {
                "not determined: too little motion without a stand, or hardly a friction beside the damping"
                    .to_owned()
            }
            None => "not determined: the model has no friction".to_owned(),
        }
    }

    /// An alarm in words.
    #[must_use]
    pub fn alarm_words(&self, alarm: &Alarm) -> String {
        let seen = &alarm.seen;
        let (way, bound) = if seen.above() { ("above", seen.high) } else { ("below", seen.low) };
        format!(
            "DRIFT at {} s: {} is {} of the model's ({}), {way} the bound of {}",
            number(alarm.tick as f64 * self.period),
            self.label(),
            number(seen.friction),
            seen.interval(),
            number(bound)
        )
    }

    /// The first alarm in words, and how many there were, if there was one.
    #[must_use]
    pub fn alarm_line(&self) -> Option<String> {
        let first = self.alarm_words(self.first.as_ref()?);
        Some(if self.alarms > 1 { format!("{first}; {} times in all", self.alarms) } else { first })
    }

    /// As JSON; what is unbounded is null.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let seen = |s: &Seen| {
            json!({
                "friction": s.friction, "least": s.least, "most": s.most.is_finite().then_some(s.most),
                "low": s.low, "high": s.high.is_finite().then_some(s.high),
            })
        };
        json!({
            "quantity": self.label(),
            "windows": self.windows,
            "one_sided": self.one_sided,
            "last": self.last.as_ref().map(seen),
            "lowest": self.last.map(|_| self.range.0),
            "highest": self.last.map(|_| self.range.1),
            "alarms": self.alarms,
            "first_alarm_s": self.first.map(|a| a.tick as f64 * self.period),
            "first_alarm": self.first.as_ref().map(|a| seen(&a.seen)),
            "words": self.words(),
        })
    }
}

/// Torques and forces since the last edge.
#[derive(Clone, Copy, Debug, Default)]
struct Acted {
    periods: f64,
    /// Way of the path, counts.
    path: f64,
    /// Sums of torque of the motor, of normal force that the voltage presses, and of that which comes with the torque.
    motor: f64,
    pressed: f64,
    shared: f64,
    /// Greatest normal force.
    hardest: f64,
    /// Greatest friction that was let go, forwards and backwards, as a multiple of the model's.
    lets_go: [f64; 2],
}

/// Sums over gaps, N m and periods.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    periods: f64,
    /// Counts, along the motion.
    way: f64,
    /// Drive and motor along the motion, less damping and gain of momentum: with the model's numbers, at least and at most
    /// within the bounds.
    given: f64,
    given_low: f64,
    given_high: f64,
    /// Damping of the model.
    damping: f64,
    /// Friction of the model; that of the weakest and strongest plant within the bounds.
    friction: f64,
    weak: f64,
    strong: f64,
    /// Friction of gaps that may hold a stick: the model's, what it has more at rest, and the most that was let go.
    unsure: f64,
    more_at_rest: f64,
    released: f64,
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        self.periods += other.periods;
        self.way += other.way;
        self.given += other.given;
        self.given_low += other.given_low;
        self.given_high += other.given_high;
        self.damping += other.damping;
        self.friction += other.friction;
        self.weak += other.weak;
        self.strong += other.strong;
        self.unsure += other.unsure;
        self.more_at_rest += other.more_at_rest;
        self.released += other.released;
    }
}

/// Slices of which a mean is taken, and of so many of them each slice of a longer window.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    slices: [Sums; SLICES],
    taken: u64,
    whole: Sums,
    /// The bounds were left, above them or below, and the mean is not yet within them again.
    out: Option<bool>,
}

impl Window {
    /// Takes a slice; a longer one if it completes that.
    fn take(&mut self, slice: Sums) -> Option<Sums> {
        self.slices[(self.taken % SLICES as u64) as usize] = slice;
        self.taken += 1;
        self.whole.add(&slice);
        self.taken.is_multiple_of(LONGER).then(|| std::mem::take(&mut self.whole))
    }

    /// The mean, and what the bounds leave; none until there are enough slices, or if hardly a pad has pressed. `rounding`: how far
    /// the gain of momentum may be off, N m and periods.
    fn mean(&self, rounding: f64) -> Option<Seen> {
        let mut sums = Sums::default();
        self.slices.iter().for_each(|slice| sums.add(slice));
        if self.taken < SLICES as u64 || sums.friction <= LEAST_FRICTION * sums.damping {
            return None;
        }
        let friction = sums.given / sums.friction;
        let n = SLICES as f64;
        let spread: f64 = self.slices.iter().map(|s| (s.given - friction * s.friction).powi(2)).sum();
        let error = (spread * n / (n - 1.0)).sqrt() / sums.friction;
        let off = STANDARD_ERRORS * error + RESOLUTION * friction.abs() + rounding / sums.friction;
        let sliding = sums.friction - sums.unsure;
        let let_go = (friction * sliding + sums.released) / sums.friction;
        let (weak, strong) = (sums.weak / sums.friction, sums.strong / sums.friction);
        Some(Seen {
            friction,
            least: sums.given / (sums.friction + sums.more_at_rest) - off,
            most: friction.max(let_go) + off + INVERSE * friction.abs(),
            low: if sums.given > 0.0 {
                weak * (sums.given / sums.given_high)
            } else {
                weak - (sums.given_high - sums.given) / sums.friction
            },
            high: if sums.given_low > 0.0 { strong * (sums.given / sums.given_low) } else { f64::INFINITY },
        })
    }
}

/// An edge at which a slice ended, and the next began; its velocity is known some periods later.
#[derive(Clone, Copy, Debug)]
struct Mark {
    /// Periods until then.
    left: usize,
    slice: Option<Sums>,
}

/// Watches a run, sample by sample. It allocates nothing but for a log.
#[derive(Clone, Debug)]
pub struct Drift {
    plant: Plant<f64>,
    bounds: Bounds<f64>,
    /// Mean friction within the bounds, as shares of the model's.
    shares: [f64; 2],
    period: f64,
    counts_per_radian: f64,
    /// Momentum of a count per period, N m and periods, per unit of inertia.
    per_inertia: f64,
    last: Option<(u64, Counts)>,
    position: i64,
    /// Positions of the last periods, the newest first.
    past: [i64; 2 * AROUND + 1],
    volts: f64,
    path_velocity: f64,
    acted: Acted,
    /// Direction of the motion; 0 before the first edge.
    way: i32,
    slice: Sums,
    mark: Option<Mark>,
    /// Velocity at the beginning of the slice, counts per period.
    from: Option<f64>,
    windows: [Window; LEVELS],
    report: DriftReport,
}

impl Drift {
    /// For a scenario's model, encoder and period, and the bounds of its plan.
    ///
    /// # Errors
    /// A parameter of the scenario out of range.
    pub fn new(scenario: &Scenario, bounds: &Bounds<f64>) -> Result<Self, BuildError> {
        let spec = scenario.spec();
        let plant = Plant::new(&spec.model)?;
        let encoder = Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev)?;
        let period = spec.period.period::<f64>()?;
        let actuator = plant.actuator();
        let presses = actuator.brake_gain() > 0.0 || actuator.preload() > 0.0 || actuator.load_share() > 0.0;
        let report = DriftReport {
            actuator: actuator.kind(),
            period,
            windows: 0,
            one_sided: 0,
            last: None,
            range: (f64::INFINITY, f64::NEG_INFINITY),
            alarms: 0,
            first: None,
            has_friction: presses && plant.friction().sliding() > 0.0,
        };
        Ok(Drift {
            plant,
            bounds: *bounds,
            shares: scenario.mean_friction_shares(),
            period,
            counts_per_radian: encoder.counts_per_radian(),
            per_inertia: encoder.radians_per_count::<f64>() / (period * period),
            last: None,
            position: 0,
            past: [0; 2 * AROUND + 1],
            volts: 0.0,
            path_velocity: 0.0,
            acted: Acted::default(),
            way: 0,
            slice: Sums::default(),
            mark: None,
            from: None,
            windows: [Window::default(); LEVELS],
            report,
        })
    }

    /// Sample number `tick`: its counts, the gap that it ended, if one was judged, the velocity of the path (rad/s), and
    /// the voltage that was given in answer to it, V. An alarm if with it the bounds are seen to be left.
    fn sample(
        &mut self,
        tick: u64,
        counts: Counts,
        gap: Option<&Gap>,
        path_velocity: f64,
        volts: f64,
    ) -> Option<Alarm> {
        let Some((last_tick, last_counts)) = self.last.replace((tick, counts)) else {
            (self.volts, self.path_velocity) = (volts, path_velocity);
            return None;
        };
        let periods = tick.saturating_sub(last_tick);
        if periods == 0 || periods > MOST_LOST + 1 {
            self.stand();
            (self.volts, self.path_velocity) = (volts, path_velocity);
            return None;
        }
        let moved = counts.since(last_counts);
        let mut alarm = None;
        for left in (0..periods).rev() {
            self.act();
            // The way during lost samples is not known: the last has it all.
            self.position += if left == 0 { i64::from(moved) } else { 0 };
            self.past.rotate_right(1);
            self.past[0] = self.position;
            alarm = self.look_at_mark(tick).or(alarm);
        }
        if moved != 0 {
            self.crossed(moved, gap);
        } else if self.acted.periods * self.period > LONGEST_GAP {
            self.stand();
        }
        (self.volts, self.path_velocity) = (volts, path_velocity);
        alarm
    }

    /// A sample of the log with its command, of which only those count that the law has given.
    pub fn record(
        &mut self,
        sample: &SampleRecord,
        command: &CommandRecord,
        gap: Option<&Gap>,
    ) -> Option<Alarm> {
        if command.source != CommandSource::Law as u8 {
            return None;
        }
        self.sample(sample.tick, Counts(sample.counts), gap, command.target_velocity, command.voltage)
    }

    /// A logged run, samples with their commands in order: its alarms.
    pub fn watch_log<'a>(
        &mut self,
        detector: &mut Detector,
        log: impl IntoIterator<Item = (&'a SampleRecord, &'a CommandRecord)>,
    ) -> Vec<Alarm> {
        let by_law = |(_, command): &(_, &CommandRecord)| command.source == CommandSource::Law as u8;
        log.into_iter()
            .filter(by_law)
            .filter_map(|(sample, command)| {
                let (counts, path) = (Counts(sample.counts), command.target_velocity);
                let gap = detector.sample(sample.tick, counts, path, command.voltage).gap;
                self.record(sample, command, gap.as_ref())
            })
            .collect()
    }

    /// The drift so far.
    #[must_use]
    pub fn report(&self) -> &DriftReport {
        &self.report
    }

    /// The voltage acts for a period.
    fn act(&mut self) {
        let (actuator, model) = (self.plant.actuator(), self.plant.params());
        let torque = actuator.torque(self.volts);
        let pressed = actuator.brake_gain() * self.volts.max(0.0);
        let shared = actuator.load_share() * torque.abs();
        let normal = pressed + shared + actuator.preload();
        let held = self.plant.friction().at_rest() * normal;
        let pull = model.drive_torque + torque;
        let acted = &mut self.acted;
        acted.periods += 1.0;
        acted.path += (self.path_velocity * self.period * self.counts_per_radian).abs();
        acted.motor += torque;
        acted.pressed += pressed;
        acted.shared += shared;
        acted.hardest = acted.hardest.max(normal);
        for (most, pull) in acted.lets_go.iter_mut().zip([pull, -pull]) {
            // A pad that does not press lets go of any friction.
            let lets_go = if held > 0.0 { pull / held } else { f64::INFINITY };
            *most = most.max(lets_go);
        }
    }

    /// An edge, or several, were crossed.
    fn crossed(&mut self, moved: i32, gap: Option<&Gap>) {
        let way = moved.signum();
        let acted = std::mem::take(&mut self.acted);
        let stood = acted.path > f64::from(moved.abs()) + BEHIND || acted.periods * self.period > LONGEST_GAP;
        let (Some(gap), true, false) = (gap, way == self.way, stood) else {
            // A slice begins here.
            self.stand();
            self.way = way;
            self.mark = Some(Mark { left: AROUND, slice: None });
            return;
        };
        let sums = self.sums(&acted, moved, gap.possible);
        self.slice.add(&sums);
        let slice = &self.slice;
        let long = slice.periods * self.period >= SHORTEST && slice.periods >= (4 * AROUND) as f64;
        let far = slice.way >= LEAST_COUNTS && slice.way / self.counts_per_radian >= LEAST_WAY;
        if long && far && self.mark.is_none() {
            self.mark = Some(Mark { left: AROUND, slice: Some(std::mem::take(&mut self.slice)) });
        }
    }

    /// The sums of a gap.
    fn sums(&self, acted: &Acted, moved: i32, possible: bool) -> Sums {
        let (actuator, friction, b) = (self.plant.actuator(), self.plant.friction(), &self.bounds);
        let sign = f64::from(moved.signum());
        let way = f64::from(moved.abs());
        let time = acted.periods;
        let speed = way / (time * self.period * self.counts_per_radian);
        let ends = |of: f64, share: f64, interval: &clutch_core::Interval<f64>| {
            let (a, b) = if of > 0.0 { (interval.low / of, interval.high / of) } else { (1.0, 1.0) };
            (share * a).min(share * b)..=(share * a).max(share * b)
        };
        let drive = {
            let (a, b) = (sign * b.drive_torque.low * time, sign * b.drive_torque.high * time);
            a.min(b)..=a.max(b)
        };
        let motor = ends(actuator.motor_gain(), sign * acted.motor, &b.motor_gain);
        let damped = speed * time;
        let model = self.plant.params();
        let mu = friction.level(speed);
        let preload = actuator.preload() * time;
        let of_model = mu * (acted.pressed + acted.shared + preload);
        let pressed = ends(actuator.brake_gain(), acted.pressed, &b.brake_gain);
        let shared = ends(actuator.motor_gain(), acted.shared, &b.motor_gain);
        let mut sums = Sums {
            periods: time,
            way,
            given: sign * (model.drive_torque * time + acted.motor) - model.viscous_damping * damped,
            given_low: drive.start() + motor.start() - b.viscous_damping.high * damped,
            given_high: drive.end() + motor.end() - b.viscous_damping.low * damped,
            damping: model.viscous_damping * damped,
            friction: of_model,
            weak: mu * self.shares[0] * (pressed.start() + shared.start() + preload),
            strong: mu * self.shares[1] * (pressed.end() + shared.end() + preload),
            ..Sums::default()
        };
        if possible {
            sums.unsure = of_model;
            // At rest it carries up to its level there; and what slides meets no more than the hardest grip.
            let most = (friction.at_rest() / mu * of_model).min(mu * acted.hardest * time);
            sums.more_at_rest = (most - of_model).max(0.0);
            // Without a grip all the way nothing stuck, and nothing was let go.
            let lets_go = acted.lets_go[usize::from(moved < 0)].max(0.0);
            sums.released = if of_model > 0.0 { of_model * lets_go } else { 0.0 };
        }
        sums
    }

    /// A period has passed since a slice ended.
    fn look_at_mark(&mut self, tick: u64) -> Option<Alarm> {
        let mark = self.mark.as_mut()?;
        mark.left -= 1;
        if mark.left > 0 {
            return None;
        }
        let slice = mark.slice;
        self.mark = None;
        let velocity = (self.past[0] - self.past[2 * AROUND]) as f64 / (2 * AROUND) as f64;
        let from = self.from.replace(velocity)?;
        let mut slice = slice?;
        let gained = f64::from(self.way) * (velocity - from) * self.per_inertia;
        let inertia = &self.bounds.inertia;
        let (a, b) = (inertia.low * gained, inertia.high * gained);
        slice.given -= self.plant.params().inertia * gained;
        slice.given_low -= a.max(b);
        slice.given_high -= a.min(b);
        self.judge(tick, slice)
    }

    /// A slice is complete: each window that it fills is judged.
    fn judge(&mut self, tick: u64, slice: Sums) -> Option<Alarm> {
        let (mut next, mut alarm) = (Some(slice), None);
        // A count at either end of the window, over the periods of which a velocity is the mean.
        let rounding = self.plant.params().inertia * self.per_inertia / AROUND as f64;
        for level in 0..LEVELS {
            let Some(slice) = next else { break };
            let window = &mut self.windows[level];
            next = window.take(slice);
            let Some(seen) = window.mean(rounding) else { continue };
            let report = &mut self.report;
            if level == 0 {
                report.windows += 1;
                report.one_sided += u64::from(!seen.most.is_finite());
                report.last = Some(seen);
                report.range = (report.range.0.min(seen.friction), report.range.1.max(seen.friction));
            }
            let side = seen.outside().then(|| seen.above());
            let told = self.windows.iter().any(|window| window.out.is_some() && window.out == side);
            let window = &mut self.windows[level];
            window.out = side.or(window.out.filter(|_| !seen.inside()));
            if side.is_some() && !told {
                let left = Alarm { tick, seen };
                report.alarms += 1;
                report.first.get_or_insert(left);
                alarm = Some(left);
            }
        }
        alarm
    }

    /// The shaft stood, turned round, or nobody knows: a slice begins with the next edge.
    fn stand(&mut self) {
        self.acted = Acted::default();
        self.slice = Sums::default();
        (self.mark, self.from, self.way) = (None, None, 0);
    }
}
