//! The oracle: what a shaft may do, and what has to be found in which time, from the draw alone.
//!
//! It shares nothing with the supervisor: the rig's physics are a few lines of its own, and the times are the promises of
//! `docs/safety.md`.

use super::grammar::{Draw, HealthyRun, LED_OVER, PathKind, RigName, Safe, Trouble, What, follows};
use super::laws;
use crate::faults::{Direction, FaultKind, Forgery, Lie, StuckAt};
use crate::virtual_time::VirtualReport;
use clutch_core::supervisor::Cause;
use clutch_wire::BoardState;

/// A sampling period, s.
const PERIOD: f64 = 0.001;

/// The fate of control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fate {
    /// The safe output is in force so long (s) after the trouble first showed.
    Ends(f64),
    /// Control goes on.
    GoesOn,
    /// Either: too little for the one, too much for the other.
    Either,
}

/// The promise for a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// The fate of control.
    pub fate: Fate,
    /// Causes that may be named where it ends; any, if there is none.
    pub causes: &'static [Cause],
    /// The longest time for which the brake may be open unseen, s; none where nobody can close it.
    pub blind: Option<f64>,
    /// True if encoder, converter and load are sound, so that the following error is what it seems.
    pub truthful: bool,
}

/// Error at rest that ends control in a run, °.
#[must_use]
pub fn following_deg(s: &HealthyRun) -> f64 {
    laws::of(s.law).following_deg
}

/// Samples that may be lost in a row where the law leaves its brake about where it is right: on a ramp, without delay.
fn steady(s: &HealthyRun) -> Option<u32> {
    let ramp = matches!(s.path, PathKind::Ramp(_));
    let here = ramp && s.rig == RigName::Paper && s.delay == 0 && !s.observer;
    laws::of(s.law).steady.filter(|_| here)
}

/// Periods in which frames may be lost without an end; both ways they are another period's. A law that is steady bears more.
fn borne(s: &HealthyRun, way: Direction) -> u32 {
    let patient = (s.cycles - 2).min(steady(s).unwrap_or(3));
    match way {
        Direction::Up => patient,
        // The controller does not hear of codes that are lost: more than one show by the shaft, and that may be too much.
        Direction::Down => 1_u32.min(patient),
        Direction::Both => u32::from(patient > 1),
    }
}

/// Largest step of the voltage over samples that are lost in a row, V, where it is promised: with the shaft about its path,
/// and an observer that was led over them, sliding mode has little to correct. One that was not takes the way of several
/// periods for that of one.
fn kick(draw: &Draw) -> Option<f64> {
    let s = &draw.healthy;
    let [Trouble { what: What::Fault(FaultKind::Drop, Direction::Up), periods: Some(lost), often, at }] =
        draw.troubles[..]
    else {
        return None;
    };
    let led = s.rig == RigName::Paper && s.law == laws::LED && s.observer && s.delay == 0;
    let ramp = matches!(s.path, PathKind::Ramp(_));
    // The start is over.
    (led && ramp && often >= 1.0 && at > 0.2 && lost <= LED_OVER).then_some(4.0)
}

/// A trouble of an encoder that is found by the way of the shaft: time for which it may be open.
fn by_the_way(s: &HealthyRun) -> f64 {
    let bounds = if s.wide || s.rig == RigName::Bench { 2.0 } else { 1.0 };
    (0.012 + 0.001 * f64::from(s.delay)) * bounds
}

impl Promise {
    /// The outcome that one trouble in a healthy run may have.
    #[must_use]
    pub fn of(s: &HealthyRun, t: &Trouble) -> Promise {
        let watchdog = f64::from(s.cycles) * PERIOD;
        let base = Promise {
            fate: Fate::Either,
            causes: &[],
            blind: Some(watchdog + PERIOD * f64::from(1 + s.delay)),
            truthful: true,
        };
        let ends =
            |within: f64, causes: &'static [Cause]| Promise { fate: Fate::Ends(within), causes, ..base };
        let goes_on = Promise { fate: Fate::GoesOn, ..base };
        match t.what {
            What::Fault(kind, way) if kind.silences() && kind != FaultKind::Reset => {
                // The board's consent to its own arming is a frame, too; what its samples say is not.
                let consent = !matches!(kind, FaultKind::Lie(Lie::Idle | Lie::Encoder | Lie::Converter));
                if t.at == 0.0 && way != Direction::Down && consent {
                    base
                } else {
                    line(s, t, kind, way, &base)
                }
            }
            What::Fault(FaultKind::Reset, _) => ends(watchdog + 1.5 * PERIOD, &[Cause::Silence]),
            What::Fault(kind, _) => hardware(s, t, kind, &base),
            What::Load(factor) if factor < 1.5 => {
                Promise { blind: None, truthful: false, ..ends(0.6, &[Cause::Saturation]) }
            }
            What::Load(_) => Promise { blind: None, truthful: false, ..ends(0.3, &[Cause::FollowingError]) },
            What::Slow(answer) if answer < 0.0005 => goes_on,
            What::Slow(_) => ends(0.045, &[Cause::Deadline]),
            What::ControllerDies => ends(watchdog + s.latency_ns as f64 / 1e9 + 1e-5, &[]),
            What::LawNotFinite if !follows(s.law) => base,
            What::LawNotFinite => ends(3.0 * PERIOD, &[Cause::NotFinite]),
            // The error is that of the broken path.
            What::TargetNotFinite | What::TargetHuge => {
                Promise { truthful: false, ..ends(3.0 * PERIOD, &[Cause::Target]) }
            }
            // Three periods until the line carries again, one until the next sample, and the way of that and of the stop.
            What::StopLost if s.cycles >= 8 => {
                Promise { truthful: false, ..ends(5.0 * PERIOD, &[Cause::Target]) }
            }
            What::StopLost => Promise { truthful: false, ..base },
            // The board ends control by itself; the first sample that comes shows why.
            What::Overflow(lost) if lost >= s.cycles => ends(watchdog + PERIOD, &[Cause::Silence]),
            What::Overflow(_) => base,
        }
    }
}

/// Frames that are lost, late, twice, altered or forged.
fn line(s: &HealthyRun, t: &Trouble, kind: FaultKind, way: Direction, base: &Promise) -> Promise {
    let watchdog = f64::from(s.cycles) * PERIOD;
    let ends = |within: f64, causes: &'static [Cause]| Promise { fate: Fate::Ends(within), causes, ..*base };
    let goes_on = Promise { fate: Fate::GoesOn, ..*base };
    let (stays, always) = (t.periods.is_none(), t.often >= 1.0);
    let at_most = |n: u32| t.periods.is_some_and(|p| p <= n);
    let at_least = |n: u32| t.periods.is_none_or(|p| p >= n);
    let up = way != Direction::Down;
    match kind {
        FaultKind::Drop | FaultKind::Corrupt | FaultKind::Silence | FaultKind::Lie(Lie::OtherRun) => {
            // A frame whose end is hit takes the next one with it.
            let also = u32::from(kind == FaultKind::Corrupt);
            if t.periods.is_some_and(|n| n + also <= borne(s, way))
                || t.often < 0.1 && s.cycles >= 8 && way == Direction::Up
            {
                goes_on
            } else if always && at_least(s.cycles + 1) {
                // A shaft does not do what codes ask that never come.
                let causes: &[Cause] = if up { &[Cause::Silence, Cause::Board] } else { &[] };
                ends(watchdog + 0.6 * PERIOD, causes)
            } else if stays && up && t.often > 0.1 {
                // After many that were lost the next one may be too far away.
                ends(0.5, &[Cause::Silence, Cause::Board, Cause::Lost, Cause::Jump])
            } else {
                *base
            }
        }
        FaultKind::Lie(Lie::Idle | Lie::Encoder | Lie::Converter) => ends(1.5 * PERIOD, &[Cause::Board]),
        FaultKind::Duplicate if !up => goes_on,
        FaultKind::Duplicate if at_most(1) => goes_on,
        FaultKind::Duplicate if stays && t.often > 0.1 || always && at_least(3) => {
            ends(if always { 4.0 * PERIOD } else { 0.15 }, &[Cause::Duplicated])
        }
        FaultKind::Forged(Forgery::OtherRun(_) | Forgery::AboveTop | Forgery::OffTable) => goes_on,
        FaultKind::Forged(Forgery::Echo(_)) if !up => goes_on,
        FaultKind::Forged(Forgery::Echo(_)) if always && stays => {
            ends(6.0 * PERIOD, &[Cause::Duplicated, Cause::Reordered])
        }
        FaultKind::Reorder if up && always && stays => {
            ends(8.0 * PERIOD, &[Cause::Reordered, Cause::Board, Cause::Late])
        }
        FaultKind::Delay(by) | FaultKind::Jitter(by) if by < 0.0005 => goes_on,
        FaultKind::Delay(by) if always && stays && by > watchdog + PERIOD => {
            ends(watchdog + 0.6 * PERIOD, &[Cause::Silence, Cause::Board, Cause::Late])
        }
        // Codes for samples whose time the board no longer knows are all too old.
        FaultKind::Delay(by) if always && stays && by > 8.0 * PERIOD => ends(watchdog + 0.6 * PERIOD, &[]),
        // A sample that comes with the next one is late; that one is in time, or is late itself.
        FaultKind::Delay(by)
            if by > PERIOD
                && by < 0.002
                && way == Direction::Up
                && stays
                && s.delay == 0
                && t.at > 0.0
                && (0.1..0.5).contains(&t.often) =>
        {
            ends(0.5, &[Cause::Late, Cause::Board])
        }
        // With a period of delay of its own the rig's codes are now and then not late often enough.
        FaultKind::Delay(by)
            if by < 0.002 && !up && stays && s.delay == 0 && (0.1..0.5).contains(&t.often) =>
        {
            ends(0.5, &[Cause::Late, Cause::Board])
        }
        FaultKind::Jitter(by) if always && stays && by > 2.0 * watchdog => {
            ends(0.03, &[Cause::Silence, Cause::Board, Cause::Late])
        }
        _ => *base,
    }
}

/// Encoder, converter and clock of the board.
fn hardware(s: &HealthyRun, t: &Trouble, kind: FaultKind, base: &Promise) -> Promise {
    let ends = |within: f64, causes: &'static [Cause]| Promise { fate: Fate::Ends(within), causes, ..*base };
    let (stays, always) = (t.periods.is_none() && t.often >= 1.0, t.often >= 1.0);
    let law = laws::of(s.law);
    // A shaft that a brake controls, and that moves.
    let waits = law.waits && (s.path.top_deg_s() < 10.0 || t.at == 0.0);
    let moves = s.rig != RigName::Motor && follows(s.law) && !waits;
    // A path from rest asks for so little at first.
    let from_rest = t.at == 0.0 && (law.starts_late || matches!(s.path, PathKind::MinimumJerk(_)));
    let hidden = from_rest || s.path.slowest_deg_s() < law.lets_go_above_deg_s;
    let exact = s.rig == RigName::Paper && !s.wide && s.delay == 0 && !law.far_off;
    let open = by_the_way(s) + law.silence_s;
    let way = Promise { blind: (!hidden).then_some(open), truthful: false, ..*base };
    let blind = Promise { blind: None, truthful: false, ..*base };
    let found = |causes| Promise { fate: Fate::Ends(law.found_s), causes, ..way };
    match kind {
        // The board sees it, and does not ask.
        FaultKind::EncoderLoss => ends(0.1 * PERIOD, &[Cause::Board]),
        FaultKind::EncoderFreeze if stays && moves => found(&[Cause::StandStill, Cause::TooSlow]),
        FaultKind::EncoderChannel(_) if stays && moves => {
            found(&[Cause::Channel, Cause::StandStill, Cause::TooSlow, Cause::Reversed])
        }
        FaultKind::EncoderScale(by) if by < 0.0 && stays && moves => {
            found(&[Cause::Reversed, Cause::Channel, Cause::StandStill, Cause::TooSlow, Cause::Jump])
        }
        // From the first sample on it is another zero, and nothing else.
        FaultKind::EncoderJump(_) if t.at == 0.0 => blind,
        FaultKind::EncoderJump(by) if by.abs() >= 20 => jump(s, t, &way),
        FaultKind::EncoderFreeze | FaultKind::EncoderChannel(_) | FaultKind::EncoderJump(_) => way,
        FaultKind::EncoderScale(_) => blind,
        // A lever never mends.
        FaultKind::Lever => nothing_presses(s, t, &blind),
        FaultKind::Contact(share) if stays && share <= 0.0 => nothing_presses(s, t, &blind),
        FaultKind::Contact(_) => Promise { truthful: true, ..blind },
        FaultKind::DacStuck(StuckAt::Volts(v)) if stays && s.rig != RigName::Motor && v < 0.01 => {
            nothing_presses(s, t, &blind)
        }
        FaultKind::DacStuck(StuckAt::Volts(v)) if stays && moves && v > 9.0 => {
            Promise { fate: Fate::Ends(0.5), ..blind }
        }
        FaultKind::DacStuck(_) | FaultKind::DacScale(_) => Promise { truthful: always, ..blind },
        FaultKind::Clock(by) => clock(s, t, by, 1.0, &blind),
        // Half the way in a period: no shaft of exact bounds is so slow, long before the clocks are apart by enough.
        FaultKind::Prescaler(by)
            if by < 1.0 && exact && moves && t.at > 0.0 && s.path.slowest_deg_s() >= 15.0 =>
        {
            let causes = &[Cause::TooSlow, Cause::StandStill, Cause::TooFast, Cause::Clock];
            // After twice 20 ms it is the clock, at the latest.
            Promise { fate: Fate::Ends(0.04 + PERIOD), causes, ..blind }
        }
        FaultKind::Prescaler(by) | FaultKind::Crystal(by) => clock(s, t, by, by, &blind),
        _ => *base,
    }
}

/// Time in which counts show a brake that is told to press with 3 V or more, and does not, s.
///
/// With a grip of a sixth less than the bounds' 3 V slow the shaft by 3.2 rad/s² at least, and it gains 27.7: 0.098 counts/ms². That is
/// as much as the counts leave open – 1.4 of position, and as much over 16 periods of velocity – after 6.3 ms. Then the
/// last code may not have been in force yet, a sample has to come, and the answer to go.
const SEEN: f64 = 0.0063 + 3.0 * PERIOD;

/// The longest time for which sliding mode with the sign function leaves a brake open, s: until a shaft that its own bursts
/// have made slow falls as fast as its path, and has caught up (docs/safety.md).
///
/// The filter of the rate lags by 4 periods, so that each burst of 9.995 V goes on until the shaft is 17.5 °/s slower than its path, or
/// at rest, and 0.05° behind it; in a fall the rate that the law sees is by those 4 periods behind.
fn catches_up(s: &HealthyRun) -> f64 {
    const SLOWER_DEG_S: f64 = 17.5;
    const BEHIND_DEG: f64 = 0.05;
    const SLOPE: f64 = 70.0;
    const LAG: f64 = 4.0 * PERIOD;
    let lost = SLOWER_DEG_S.min(s.path.top_deg_s()).to_radians();
    let falls = 0.0471 / 0.0017 - s.path.steepest_deg_s2().to_radians();
    // f (e₀ + w t − a t²/2) + w − a (t − lag) = 0.
    let (square, linear) = (SLOPE * falls / 2.0, falls - SLOPE * lost);
    let constant = SLOPE * BEHIND_DEG.to_radians() + lost + falls * LAG;
    // And a count each for position and rate.
    (linear.mul_add(linear, 4.0 * square * constant).sqrt() - linear) / (2.0 * square) + 2.0 * PERIOD
}

/// A brake that does not press, whatever it is told to.
fn nothing_presses(s: &HealthyRun, t: &Trouble, blind: &Promise) -> Promise {
    // A path that begins with a jump asks for an open brake, until a shaft that falls is as fast.
    let start = if t.at == 0.0 { 0.02 + s.path.top_deg_s() / 1587.0 } else { 0.0 };
    // An open brake that nobody has told to press shows nothing: it has to be told, and then to be seen. The sign function
    // leaves it open for longer than others.
    let others = 2.0 * by_the_way(s) + PERIOD;
    let within =
        if laws::of(s.law).switches { others.max(catches_up(s) + SEEN + PERIOD) } else { others } + start;
    Promise { fate: Fate::Ends(within), causes: &[Cause::TooFast], ..*blind }
}

/// Counts that are off by more than a shaft can be.
fn jump(s: &HealthyRun, t: &Trouble, way: &Promise) -> Promise {
    let ends = |within: f64| Promise { fate: Fate::Ends(within), causes: &[Cause::Jump], ..*way };
    let refused = t.periods.unwrap_or(u32::MAX);
    if refused <= 2 && refused + s.good_samples < s.cycles {
        Promise { fate: Fate::GoesOn, ..*way }
    } else if t.often >= 1.0 && refused > 3 {
        ends(3.0 * PERIOD)
    } else if t.periods.is_none() && t.often > 0.1 {
        Promise { causes: &[], ..ends(0.3) }
    } else {
        *way
    }
}

/// A clock that is fast or slow by a factor, its periods so many times as long: 5 % of the time so far and a slack, which is
/// four times the patience with a silent line.
fn clock(s: &HealthyRun, t: &Trouble, factor: f64, longer: f64, blind: &Promise) -> Promise {
    let share = (factor - 1.0).abs() - 0.05;
    let slack = (4.0 * PERIOD * f64::from(s.cycles)).max(0.03);
    let within = (0.05 * (t.at + 0.1) + slack) / share * longer.max(1.0);
    Promise { fate: Fate::Ends(1.2 * within + 0.01), ..*blind }
}

/// The way of a shaft beyond its path, °: open for a time, then in the safe state; none where that stops nothing.
///
/// A few lines of Euler's method, with a brake that grips a tenth less and a weight that pulls a tenth more than the rig's.
#[must_use]
pub fn beyond_deg(s: &HealthyRun, blind: f64) -> Option<f64> {
    const STEP: f64 = 1e-4;
    let (grip, pull) = match s.rig {
        RigName::Paper => (0.14 * 0.15, 0.0471),
        RigName::Bench => (0.14 * 0.104 * 0.7, 0.0493),
        RigName::Motor => return None,
    };
    let (grip, pull, inertia) = (0.9 * grip, 1.1 * pull, 0.0017);
    let ahead = f64::from(1 + s.delay) * PERIOD;
    let (mut speed, mut way) = (s.path.top_deg_s().to_radians() + 0.1, 0.0);
    let path = s.path.top_deg_s().to_radians();
    let mut time = 0.0;
    while time < blind {
        speed += pull / inertia * STEP;
        way += (speed - path).max(0.0) * STEP;
        time += STEP;
    }
    let mut since = 0.0;
    while speed > 0.0 {
        let volts = match s.safe {
            _ if since < ahead => 0.0,
            Safe::Hold(v) | Safe::HoldThenRelease(v, _) => v,
            Safe::Ramp(rate, v) => v.min(rate * (since - ahead)),
            Safe::Release => return None,
        };
        speed += (pull - grip * volts) / inertia * STEP;
        way += speed.max(0.0) * STEP;
        since += STEP;
        if since > 0.2 {
            return None;
        }
    }
    Some(way.to_degrees())
}

/// Healthy error of a run, °: what its law and its path leave.
fn healthy_deg(s: &HealthyRun) -> f64 {
    let uneven = if s.rig == RigName::Bench { 0.3 } else { 0.0 };
    laws::of(s.law).healthy_deg + uneven + 0.012 * s.path.top_deg_s()
}

/// Checks that a report keeps the promises of its draw; says what is wrong if not.
#[must_use]
pub fn judge(draw: &Draw, o: &VirtualReport) -> Option<String> {
    let s = &draw.healthy;
    // A dead controller is seen by the board's clock alone: where that stands still, only a watchdog in hardware acts.
    let has = |what: fn(&What) -> bool| draw.troubles.iter().any(|t| what(&t.what));
    if has(|what| *what == What::ControllerDies)
        && has(|what| matches!(what, What::Fault(FaultKind::Clock(by), _) if *by <= 0.0))
    {
        return None;
    }
    let promises: Vec<Promise> = draw.troubles.iter().map(|t| Promise::of(s, t)).collect();
    output(draw, o).or_else(|| fate(draw, &promises, o)).or_else(|| degrees(s, &promises, o))
}

/// The output: within its limits, and in the end that of the safe state.
fn output(draw: &Draw, o: &VirtualReport) -> Option<String> {
    let s = &draw.healthy;
    let (low, high) = if s.rig == RigName::Motor { (-10.0, 10.0) } else { (0.0, 10.0) };
    if o.answers > 0 && (o.volts.0 < low - 1e-9 || o.volts.1 > high) {
        return Some(format!("commanded {} to {} V, outside of {low} to {high} V", o.volts.0, o.volts.1));
    }
    if let (Some(safe), Some(again)) = (o.safe, o.relapsed) {
        let after = (again - safe) * 1e3;
        return Some(format!("the board follows codes again {after:.3} ms after its safe output"));
    }
    if o.highest_code > 4095 {
        return Some(format!("the converter was given the code {}", o.highest_code));
    }
    let ended = matches!(o.board, Some(BoardState::Faulted | BoardState::Stopped));
    let volts = |code: u16| f64::from(code) * 20.0 / 4096.0 - 10.0;
    let (first, last) = match s.safe {
        Safe::Hold(v) => (Some(v), Some(v)),
        Safe::Release => (Some(0.0), Some(0.0)),
        Safe::HoldThenRelease(v, _) => (Some(v), None),
        Safe::Ramp(..) => (None, None),
    };
    let wrong = |code, v: Option<f64>| v.is_some_and(|v| (v - volts(code)).abs() > 0.006);
    let (at_once, in_the_end) = (volts(o.safe_code), volts(o.last_code));
    (ended && (wrong(o.safe_code, first) || wrong(o.last_code, last)))
        .then(|| format!("{at_once} V at once and {in_the_end} V in the end instead of {:?}", s.safe))
}

/// The end of control in words.
fn ended_by(cause: Option<Cause>) -> String {
    cause.map_or_else(|| "never ended".to_owned(), |cause| format!("ended by {cause:?}"))
}

/// The fate of control, and its cause.
fn fate(draw: &Draw, promises: &[Promise], o: &VirtualReport) -> Option<String> {
    let (s, alone) = (&draw.healthy, promises.len() <= 1);
    if promises.iter().all(|p| p.fate == Fate::GoesOn) && alone {
        if let Some(cause) = o.cause {
            return Some(format!("ended by {cause:?} although it can be borne"));
        }
        if o.board != Some(BoardState::Running) {
            return Some(format!("the board is in {:?}", o.board));
        }
    }
    // A sample that is refused is not answered, nor are those of its proof; the next one is.
    if let [trouble] = &draw.troubles[..]
        && let What::Fault(FaultKind::EncoderJump(by), _) = trouble.what
        && by.abs() >= 20
        && trouble.periods == Some(1)
        && trouble.at > 0.0
        && s.cycles >= 8
        && o.unanswered != u64::from(s.good_samples)
    {
        return Some(format!("{} samples unanswered instead of {}", o.unanswered, s.good_samples));
    }
    if let Some(most) = kick(draw)
        && o.kick > most
    {
        return Some(format!("the voltage jumps by {:.2} V over lost samples instead of {most} V", o.kick));
    }
    for (trouble, promise) in draw.troubles.iter().zip(promises) {
        let Fate::Ends(within) = promise.fate else { continue };
        // Beside another it has to be there at once.
        // A clock that is longer moves all that comes after it.
        if !alone && (trouble.often < 1.0 || draw.troubles.iter().any(Trouble::needs_time)) {
            continue;
        }
        // The refusals of a board stand between its samples, and change places with them.
        let swapped = matches!(trouble.what, What::Fault(FaultKind::Reorder, _));
        if !alone && swapped {
            continue;
        }
        // A shaft that a broken converter moves, seen by a broken encoder, may be any.
        let others = promises.iter().filter(|p| !p.truthful || p.blind.is_none()).count();
        if !alone && !promise.truthful && others > 1 {
            continue;
        }
        let begun = if alone && hits(trouble) { o.hit } else { Some(trouble.at) };
        // It was never there.
        let Some(begun) = begun else { continue };
        // Old samples that are played back keep a line from being silent.
        let played_back = |t: &Trouble| matches!(t.what, What::Fault(FaultKind::Forged(Forgery::Echo(_)), _));
        if !alone && trouble.what != What::ControllerDies && draw.troubles.iter().any(played_back) {
            continue;
        }
        // Beside another, a whole period until it is there, and what a line that is broken as well takes to be found.
        let line = draw.troubles.iter().any(|t| match t.what {
            What::Fault(kind, _) => kind.silences(),
            What::Slow(_) | What::ControllerDies => true,
            _ => false,
        });
        let patient = if line { f64::from(s.cycles) } else { 0.0 };
        let within = if alone { within } else { within + (2.0 + patient) * PERIOD };
        let Some(safe) = o.safe else {
            return Some(format!("the safe output was never in force; {}", ended_by(o.cause)));
        };
        // A microsecond for the clock's grain.
        if safe - begun > within + 1e-6 {
            let took = (safe - begun) * 1e3;
            return Some(format!(
                "safe output after {took:.3} ms instead of {:.3} ms; {}",
                within * 1e3,
                ended_by(o.cause)
            ));
        }
        let named = o.cause.is_none_or(|c| promise.causes.is_empty() || promise.causes.contains(&c));
        if alone && !named {
            let expected: Vec<String> = promise.causes.iter().map(|cause| format!("{cause:?}")).collect();
            return Some(format!("{}, expected {}", ended_by(o.cause), expected.join(" or ")));
        }
        if alone && o.cause.is_none() && !promise.causes.is_empty() && !promise.causes.contains(&Cause::Board)
        {
            return Some("ended by the board alone".to_owned());
        }
    }
    None
}

/// True if line or board report when it first showed.
fn hits(t: &Trouble) -> bool {
    matches!(t.what, What::Fault(..))
}

/// The way of the shaft.
fn degrees(s: &HealthyRun, promises: &[Promise], o: &VirtualReport) -> Option<String> {
    if s.rig == RigName::Motor || promises.iter().any(|p| p.blind.is_none() && !p.truthful) {
        return None;
    }
    let healthy = healthy_deg(s);
    let largest = o.largest_error.to_degrees();
    if promises.iter().all(|p| p.truthful) {
        let goes_on = promises.iter().all(|p| p.fate == Fate::GoesOn);
        let allowed =
            if goes_on { healthy + 0.3 } else { following_deg(s) + 0.03 * s.path.top_deg_s() + 0.3 };
        if largest > allowed {
            return Some(format!("error {largest:.3}° instead of {allowed:.3}°"));
        }
    }
    let blind = promises.iter().map(|p| p.blind).try_fold(0.0, |sum, b| Some(sum + b?))?;
    let allowed = beyond_deg(s, blind)? + healthy;
    let beyond = o.overrun.to_degrees();
    (o.safe.is_some() && beyond > allowed)
        .then(|| format!("{beyond:.3}° beyond the path instead of {allowed:.3}°"))
}
