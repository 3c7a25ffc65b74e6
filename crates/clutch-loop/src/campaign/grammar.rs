//! The grammar of the campaign: a healthy run, and in it one trouble or two, drawn from a seed.
//!
//! A trouble is where × what × from when × how long × how often. The tables below say which there are.

use super::laws;
use crate::faults::{Channel, Direction, Fault, FaultKind, Forgery, Lie, StuckAt};
use clutch_core::law::LawParams;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

pub use super::healthy_run::{HealthyRun, PathKind, RigName, Safe};

/// Trouble's place and kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// A fault of line or board.
    Fault(FaultKind, Direction),
    /// The drive is stronger by this factor, and the output limited to little more than its old self needs.
    Load(f64),
    /// The controller takes so long for an answer, s.
    Slow(f64),
    /// The controller ends without a word.
    ControllerDies,
    /// The law's memory is corrupted: its demand is not a number.
    LawNotFinite,
    /// The path's velocity is not a number.
    TargetNotFinite,
    /// The path's position jumps by a finite but huge distance.
    TargetHuge,
    /// The same, and for four periods about it nothing comes through to the board: the first word that control has ended is
    /// lost.
    StopLost,
    /// The controller stalls, once, and so many samples are lost meanwhile; one waits for it when it is back.
    Overflow(u32),
}

/// A trouble and when it is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trouble {
    /// Place and kind.
    pub what: What,
    /// Its onset, s after arming.
    pub at: f64,
    /// Its length in periods; none if it stays.
    pub periods: Option<u32>,
    /// Probability with which each frame or period within that time is hit.
    pub often: f64,
}

impl Trouble {
    /// The fault of line or board that it is, if it is one, with periods of so many seconds.
    pub(super) fn fault(&self, period: f64) -> Option<Fault> {
        let What::Fault(kind, direction) = self.what else { return None };
        let lasting = self.periods.map_or(f64::INFINITY, |n| f64::from(n) * period);
        Some(Fault { kind, at: self.at, lasting, probability: self.often, direction })
    }

    /// True if it shows over a time only.
    pub(super) fn needs_time(&self) -> bool {
        needs_time(self.what)
    }

    /// The kind of it, for tables.
    #[must_use]
    pub fn kind(&self) -> String {
        let kind = match self.what {
            What::Fault(FaultKind::Delay(_), _) => "frames late".to_owned(),
            What::Fault(FaultKind::Jitter(_), _) => "jitter".to_owned(),
            What::Fault(FaultKind::Forged(Forgery::Echo(_)), _) => "echo".to_owned(),
            What::Fault(FaultKind::Forged(Forgery::OtherRun(_)), _) => {
                "frames of another run as well".to_owned()
            }
            What::Fault(FaultKind::EncoderJump(by), _) if by.abs() < 20 => {
                "encoder off by 3 to 9 counts".to_owned()
            }
            What::Fault(FaultKind::EncoderJump(_), _) => "encoder off by 20 counts or more".to_owned(),
            What::Fault(FaultKind::EncoderScale(by), _) if by > 1.0 => "counts more than they are".to_owned(),
            What::Fault(FaultKind::EncoderScale(by), _) if by > 0.0 => {
                "counts fewer than they are".to_owned()
            }
            What::Fault(FaultKind::EncoderScale(_), _) => "counts reversed".to_owned(),
            What::Fault(FaultKind::DacStuck(StuckAt::Volts(v)), _) if v != 0.0 && v != 9.99 => {
                "DAC stuck at any voltage".to_owned()
            }
            What::Fault(FaultKind::DacScale(by), _) if by > 1.0 => "DAC too high".to_owned(),
            What::Fault(FaultKind::DacScale(by), _) if by >= 0.0 => "DAC too low".to_owned(),
            What::Fault(FaultKind::DacScale(_), _) => "DAC the wrong way round".to_owned(),
            What::Fault(FaultKind::Contact(by), _) if by > 0.0 => "pad presses too little".to_owned(),
            What::Fault(FaultKind::Clock(_), _) => "board's time wrong".to_owned(),
            What::Fault(FaultKind::Prescaler(_), _) => "board's periods wrong".to_owned(),
            What::Fault(FaultKind::Crystal(_), _) => "board's whole clock wrong".to_owned(),
            What::Fault(kind, _) => kind.to_string(),
            What::Load(by) => format!("load times {by}, above what the output can brake"),
            What::Slow(s) => format!("each answer takes {} ms", s * 1e3),
            What::ControllerDies => "controller dies".to_owned(),
            What::LawNotFinite => "law's demand not a number".to_owned(),
            What::TargetNotFinite => "target not a number".to_owned(),
            What::TargetHuge => "target jumps by 2³⁰ counts".to_owned(),
            What::StopLost => "target jumps, and the first stop is lost".to_owned(),
            What::Overflow(_) => "controller stalls, and samples are lost meanwhile".to_owned(),
        };
        let stays = self.periods.is_none() && self.often >= 1.0;
        let kind = if stays { kind } else { format!("{kind}, now and then") };
        match self.what {
            What::Fault(_, Direction::Up) => format!("{kind}, from the board"),
            What::Fault(_, Direction::Down) => format!("{kind}, to the board"),
            _ => kind,
        }
    }
}

/// Parts of a draw that its minimal form may leave out, by the names that they have in the name of a run.
pub const PLAIN: [&str; 11] =
    ["later", "second", "first", "bench", "wide", "observer", "single", "delay", "latency", "cycles", "path"];

/// A run before it is run.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Everything but the troubles.
    pub healthy: HealthyRun,
    /// None, one or two.
    pub troubles: Vec<Trouble>,
}

impl Draw {
    /// The draw of a seed, without those parts of it that are named.
    #[must_use]
    pub fn new(seed: u64, without: &[&str]) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut healthy = healthy_run(&mut rng);
        let mut troubles = Vec::new();
        if rng.random_bool(0.95) {
            troubles.push(trouble(&mut rng, &healthy, any));
            if rng.random_bool(0.2) {
                troubles.push(trouble(&mut rng, &healthy, any));
            }
        }
        if !without.contains(&"later") {
            later(seed, &mut healthy, &mut troubles);
        }
        // A controller is slow in one way.
        if troubles.iter().all(|t| matches!(t.what, What::Slow(_) | What::ControllerDies)) {
            troubles.truncate(1);
        }
        for part in without {
            match *part {
                "second" => troubles.truncate(1),
                "first" if troubles.len() > 1 => drop(troubles.remove(0)),
                "bench" if healthy.rig == RigName::Bench => healthy.rig = RigName::Paper,
                "wide" => healthy.wide = false,
                "observer" => healthy.observer = false,
                "single" => healthy.single = false,
                "delay" if healthy.rig == RigName::Paper => healthy.delay = 0,
                "latency" => healthy.latency_ns = 50_000,
                "cycles" => healthy.cycles = 3,
                "path" => healthy.path = PathKind::Ramp(healthy.path.top_deg_s()),
                _ => {}
            }
        }
        // A load that the voltage's limit is to show: the law that goes there, and no other trouble.
        if let Some(load) = troubles.iter().find(|t| matches!(t.what, What::Load(_))).copied() {
            healthy.rig = RigName::Paper;
            healthy.law = laws::TO_ITS_LIMIT;
            healthy.path = PathKind::Ramp(20.0);
            healthy.safe = Safe::Hold(9.99);
            (healthy.wide, healthy.observer, healthy.delay) = (false, false, 0);
            troubles = vec![load];
        }
        Draw { healthy, troubles }
    }
}

fn pick<T: Copy>(rng: &mut Pcg64, from: &[T], otherwise: T) -> T {
    from.choose(rng).copied().unwrap_or(otherwise)
}

/// True of a law that follows a path.
pub(super) fn follows(law: &str) -> bool {
    LawParams::<f64>::named(law).is_some_and(|law| law.follows())
}

/// True of a law with a filter of its own, which asks no observer.
fn filters(law: &str) -> bool {
    LawParams::<f64>::named(law).is_some_and(|law| law.filter().is_some())
}

fn healthy_run(rng: &mut Pcg64) -> HealthyRun {
    let rig = [RigName::Paper, RigName::Paper, RigName::Paper, RigName::Bench, RigName::Motor];
    let rig = pick(rng, &rig, RigName::Paper);
    let law = pick(rng, laws::drawn(rig), laws::TO_ITS_LIMIT);
    let follows = follows(law);
    let speed = match rig {
        RigName::Motor => pick(rng, &[1.0, 2.0, 4.0], 2.0),
        _ if !follows => 0.2,
        _ => pick(rng, &[2.0, 5.0, 10.0, 20.0, 20.0, 28.0, 40.0], 20.0),
    };
    let path = match rng.random_range(0..4) {
        0 if follows => PathKind::MinimumJerk(speed),
        1 if follows => PathKind::Sine(speed),
        _ => PathKind::Ramp(speed),
    };
    let weakest = if rig == RigName::Bench { 6.7 } else { 4.5 };
    let volts = pick(rng, &[weakest, 6.7, 9.99], 9.99);
    let safe = match rng.random_range(0..8) {
        _ if rig == RigName::Motor => Safe::Release,
        0 => Safe::Ramp(pick(rng, &[200.0, 500.0, 2000.0], 500.0), volts),
        // A board lets go from power-up on, and to hold does not catch a shaft.
        1 if follows => Safe::Release,
        2 => Safe::HoldThenRelease(volts, rng.random_range(0.3..0.6)),
        _ => Safe::Hold(volts),
    };
    let delay = match rig {
        RigName::Bench => 1,
        RigName::Paper if laws::of(law).bears_delay => rng.random_range(0..=1),
        _ => 0,
    };
    HealthyRun {
        rig,
        law,
        path,
        wide: rng.random_bool(0.25),
        safe,
        observer: rig != RigName::Motor && !filters(law) && rng.random_bool(0.2),
        single: rng.random_bool(0.5),
        delay,
        latency_ns: rng.random_range(20_000..300_000),
        cycles: pick(rng, &[3, 3, 3, 8, 20], 3),
        good_samples: pick(rng, &[1, 1, 2], 1),
    }
}

/// Draws that came later than the others, from a stream of their own: a seed keeps what it drew before, and a run whose name
/// has `later` in it leaves these out.
fn later(seed: u64, healthy: &mut HealthyRun, troubles: &mut Vec<Trouble>) {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x006c_6174_6572);
    let rng = &mut rng;
    if follows(healthy.law) && rng.random_bool(0.25) {
        healthy.law = pick(rng, &laws::drawn_later(), healthy.law);
    }
    let brake = healthy.rig != RigName::Motor;
    match rng.random_range(0..16) {
        0 if brake && !troubles.is_empty() => troubles[0] = trouble(rng, healthy, pad),
        1 => gap(rng, healthy, troubles),
        2 => gap_in_an_observer(rng, healthy, troubles),
        _ => {}
    }
    single_checks(seed, healthy, troubles);
}

/// Troubles for checks that others hide mostly, from a stream of their own, too.
fn single_checks(seed: u64, healthy: &mut HealthyRun, troubles: &mut Vec<Trouble>) {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x0063_6865_636b);
    let rng = &mut rng;
    let fault = |kind, way| move |_: &mut Pcg64, _: &HealthyRun| What::Fault(kind, way);
    let stays = |t: Trouble| Trouble { periods: None, often: 1.0, ..t };
    *troubles = match rng.random_range(0..80) {
        // A code answers a sample that is further back than the board remembers: another stands in its place.
        0 => {
            healthy.cycles = 20;
            let way = pick(rng, &[Direction::Up, Direction::Down], Direction::Down);
            vec![stays(trouble(rng, healthy, fault(FaultKind::Delay(0.0092), way)))]
        }
        // Three samples in ten are overtaken by the next one.
        1 => {
            (healthy.cycles, healthy.delay) = (20, 0);
            if healthy.rig == RigName::Bench {
                healthy.rig = RigName::Paper;
            }
            let late = trouble(rng, healthy, fault(FaultKind::Delay(0.00195), Direction::Up));
            vec![Trouble { often: 0.3, at: late.at.max(0.15), ..stays(late) }]
        }
        // The board says that it does not drive as control is to begin, and once.
        2 => {
            let idle = trouble(rng, healthy, fault(FaultKind::Lie(Lie::Idle), Direction::Up));
            vec![Trouble { at: 0.0, periods: Some(1), often: 1.0, ..idle }]
        }
        // A code is under way as the board goes to its safe output by itself.
        3 => {
            let loss = stays(trouble(rng, healthy, fault(FaultKind::EncoderLoss, Direction::Both)));
            let loss = Trouble { at: loss.at.max(0.15), ..loss };
            let late = fault(FaultKind::Delay(pick(rng, &[0.0007, 0.0012], 0.0012)), Direction::Down);
            vec![Trouble { what: late(rng, healthy), at: loss.at - 0.004, ..loss }, loss]
        }
        4 => {
            let way = pick(rng, &[Direction::Up, Direction::Down, Direction::Both], Direction::Both);
            vec![trouble(rng, healthy, fault(FaultKind::Forged(Forgery::OffTable), way))]
        }
        5 => {
            healthy.cycles = 20;
            vec![trouble(rng, healthy, |_, _| What::StopLost)]
        }
        6 => {
            gap(rng, healthy, troubles);
            healthy.cycles = 3;
            let lost = rng.random_range(3..=laws::LONGEST_GAP);
            vec![trouble(rng, healthy, |_, _| What::Overflow(lost))]
        }
        _ => return,
    };
}

/// The pad and what presses it.
fn pad(rng: &mut Pcg64, _: &HealthyRun) -> What {
    let kind = match rng.random_range(0..3) {
        0 => FaultKind::Lever,
        1 => FaultKind::Contact(0.0),
        _ => FaultKind::Contact(pick(rng, &[0.1, 0.3, 0.6, 0.9], 0.3)),
    };
    What::Fault(kind, Direction::Both)
}

/// Samples that are lost in a row, as many as a patient board bears, and no other trouble.
fn gap(rng: &mut Pcg64, healthy: &mut HealthyRun, troubles: &mut Vec<Trouble>) {
    healthy.rig = RigName::Paper;
    healthy.law = pick(rng, &laws::STEADY, laws::LED);
    healthy.path = PathKind::Ramp(pick(rng, &[2.0, 5.0, 10.0, 20.0, 28.0], 20.0));
    if matches!(healthy.safe, Safe::Release) {
        healthy.safe = Safe::Hold(9.99);
    }
    (healthy.delay, healthy.observer, healthy.cycles) = (0, false, 20);
    let gap = Trouble {
        periods: Some(rng.random_range(2..=laws::LONGEST_GAP)),
        often: 1.0,
        ..trouble(rng, healthy, |_, _| What::Fault(FaultKind::Drop, Direction::Up))
    };
    // Before the first sample there is nothing to reckon from.
    *troubles = vec![Trouble { at: gap.at.max(0.15), ..gap }];
}

/// A few of them, where the velocity is an observer's: it has to be led over them.
fn gap_in_an_observer(rng: &mut Pcg64, healthy: &mut HealthyRun, troubles: &mut Vec<Trouble>) {
    gap(rng, healthy, troubles);
    (healthy.law, healthy.observer) = (laws::LED, true);
    healthy.path = PathKind::Ramp(pick(rng, &[28.0, 40.0], 28.0));
    for gap in troubles {
        gap.periods = Some(rng.random_range(2..=2 * LED_OVER));
    }
}

/// Samples over which an observer is led without a jump of the voltage; of more nothing is promised.
pub(super) const LED_OVER: u32 = 2;

/// Number of the places at which trouble may be.
const PLACES: usize = 6;

/// Trouble at any place.
fn any(rng: &mut Pcg64, healthy: &HealthyRun) -> What {
    match rng.random_range(0..PLACES) {
        0 | 1 => line(rng),
        2 => What::Fault(encoder(rng), Direction::Both),
        3 => What::Fault(converter(rng, healthy), Direction::Both),
        4 => What::Fault(board(rng), Direction::Both),
        _ => inside(rng),
    }
}

fn trouble(rng: &mut Pcg64, healthy: &HealthyRun, what: impl Fn(&mut Pcg64, &HealthyRun) -> What) -> Trouble {
    let (from, to) = match healthy.path {
        PathKind::MinimumJerk(_) => (0.5, 1.2),
        PathKind::Ramp(_) | PathKind::Sine(_) => (0.15, 0.5),
    };
    let mut at = rng.random_range(from..to);
    let what = what(rng, healthy);
    let faults = matches!(what, What::Fault(..));
    let stays = needs_time(what) || matches!(what, What::Fault(FaultKind::Lever, _));
    // Armed, and not running yet.
    if faults && rng.random_bool(0.1) {
        at = 0.0;
    }
    let periods = match rng.random_range(0..10) {
        _ if !faults || stays => None,
        0 | 1 => Some(1),
        2 => Some(rng.random_range(2..=8)),
        3 => Some(rng.random_range(9..=100)),
        _ => None,
    };
    let often = match rng.random_range(0..10) {
        _ if !faults || stays || periods == Some(1) => 1.0,
        0 => 0.02,
        1 => 0.3,
        2 => 0.9,
        _ => 1.0,
    };
    Trouble { what, at, periods, often }
}

/// True of what shows over a time only.
fn needs_time(what: What) -> bool {
    matches!(
        what,
        What::Fault(
            FaultKind::Clock(_) | FaultKind::Prescaler(_) | FaultKind::Crystal(_) | FaultKind::Reset,
            _
        )
    )
}

/// The line: one way or both.
fn line(rng: &mut Pcg64) -> What {
    let ways = [Direction::Up, Direction::Down, Direction::Both];
    let way = pick(rng, &ways, Direction::Both);
    let kind = match rng.random_range(0..12) {
        0 | 1 => FaultKind::Drop,
        2 => FaultKind::Duplicate,
        3 => FaultKind::Corrupt,
        4 => FaultKind::Delay(pick(rng, &[0.0003, 0.00195, 0.005], 0.005)),
        5 => FaultKind::Jitter(pick(rng, &[0.0003, 0.002, 0.008], 0.008)),
        6 => FaultKind::Reorder,
        7 => FaultKind::Silence,
        8 => FaultKind::Forged(Forgery::Echo(rng.random_range(1..=20))),
        9 => FaultKind::Forged(Forgery::OtherRun(rng.random_range(1..=20))),
        10 => return What::Fault(FaultKind::Forged(Forgery::AboveTop), Direction::Down),
        _ => {
            let lies = [Lie::Idle, Lie::Encoder, Lie::Converter, Lie::OtherRun];
            return What::Fault(FaultKind::Lie(pick(rng, &lies, Lie::Idle)), Direction::Up);
        }
    };
    What::Fault(kind, way)
}

fn encoder(rng: &mut Pcg64) -> FaultKind {
    match rng.random_range(0..8) {
        0 | 1 => FaultKind::EncoderFreeze,
        2 => FaultKind::EncoderJump(pick(rng, &[-500, -20, -3, 3, 9, 500, 100_000], 500)),
        3 => FaultKind::EncoderChannel(Channel::A),
        4 => FaultKind::EncoderChannel(Channel::B),
        5 => FaultKind::EncoderScale(pick(rng, &[0.5, 0.9, 1.2, 2.0, 10.0], 2.0)),
        6 => FaultKind::EncoderScale(-1.0),
        _ => FaultKind::EncoderLoss,
    }
}

fn converter(rng: &mut Pcg64, healthy: &HealthyRun) -> FaultKind {
    let low = if healthy.rig == RigName::Motor { -9.99 } else { 0.0 };
    match rng.random_range(0..6) {
        0 => FaultKind::DacStuck(StuckAt::Volts(0.0)),
        1 => FaultKind::DacStuck(StuckAt::Last),
        2 => FaultKind::DacStuck(StuckAt::Volts(9.99)),
        3 => FaultKind::DacStuck(StuckAt::Volts(rng.random_range(low..9.99))),
        4 => FaultKind::DacScale(-1.0),
        _ => FaultKind::DacScale(pick(rng, &[0.0, 0.5, 0.8, 1.5, 2.0], 0.5)),
    }
}

fn board(rng: &mut Pcg64) -> FaultKind {
    match rng.random_range(0..6) {
        0 => FaultKind::Clock(pick(rng, &[-1.0, 0.0, 0.5, 2.0, 12.0], 0.5)),
        1 => FaultKind::Prescaler(pick(rng, &[0.5, 1.2, 2.0, 12.0], 2.0)),
        2 => FaultKind::Crystal(pick(rng, &[0.5, 1.2, 2.0], 2.0)),
        _ => FaultKind::Reset,
    }
}

/// The controller itself, and its load.
fn inside(rng: &mut Pcg64) -> What {
    match rng.random_range(0..8) {
        0 => What::Load(1.347),
        1 => What::Load(2.0),
        2 => What::Slow(pick(rng, &[0.0002, 0.0007], 0.0007)),
        3 | 4 => What::ControllerDies,
        5 => What::LawNotFinite,
        6 => What::TargetNotFinite,
        _ => What::TargetHuge,
    }
}
