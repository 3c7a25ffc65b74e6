//! Faults on request: what, when, how often.

use clutch_sim::{expected, nearest};
use std::fmt;
use std::str::FromStr;

/// The way that frames go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the board to the controller.
    Up,
    /// From the controller to the board.
    Down,
    /// Both.
    Both,
}

impl Direction {
    fn covers(self, way: Direction) -> bool {
        self == Direction::Both || self == way
    }
}

/// The output at which a converter can be stuck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StuckAt {
    /// The output that it has when the fault begins.
    Last,
    /// At a voltage, V.
    Volts(f64),
}

/// A channel of a quadrature encoder; A is ahead of B by a quarter of a line where counts rise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The first.
    A,
    /// The second.
    B,
}

impl Channel {
    /// Its level at a count.
    fn high(self, count: i32) -> bool {
        match self {
            Channel::A => matches!(count.rem_euclid(4), 1 | 2),
            Channel::B => count.rem_euclid(4) >= 2,
        }
    }

    /// Counts of a decoder that knew the true ones up to `from`, when this channel stayed as it was.
    #[must_use]
    pub fn dead(self, from: i32, count: i32) -> i32 {
        // A edge of the other channel counts up or down by the level of this one.
        let (other, way) = match self {
            Channel::A => (Channel::B, if self.high(from) { 1 } else { -1 }),
            Channel::B => (Channel::A, if self.high(from) { -1 } else { 1 }),
        };
        from.wrapping_add(way * (i32::from(other.high(count)) - i32::from(other.high(from))))
    }
}

/// A report of a board that is not so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lie {
    /// Its samples say that it does not drive.
    Idle,
    /// Its samples say that the encoder is broken.
    Encoder,
    /// Its samples say that the converter is broken.
    Converter,
    /// Its samples bear the number of another run.
    OtherRun,
}

/// A frame that nobody at the two ends of the line has sent, beside each sample or code that passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forgery {
    /// The same once more in each of so many periods.
    Echo(u32),
    /// The next so many, of another run: codes that let go, samples from far away.
    OtherRun(u32),
    /// In front of it: a code that the converter has not.
    AboveTop,
    /// The next two, that let go or are from far away, in frames that the table does not have: of a kind that is no kind,
    /// and longer by a byte. The campaign's alone.
    OffTable,
}

/// The kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// Frames vanish.
    Drop,
    /// Frames come twice.
    Duplicate,
    /// Frames get one to eight wrong bits.
    Corrupt,
    /// Frames come later, s.
    Delay(f64),
    /// Frames come later by a random time up to this, s.
    Jitter(f64),
    /// Neighbouring frames change places.
    Reorder,
    /// Nothing comes through.
    Silence,
    /// Samples say what is not so.
    Lie(Lie),
    /// Frames come that nobody has sent.
    Forged(Forgery),
    /// The encoder's counts stay.
    EncoderFreeze,
    /// The encoder's counts are off by this.
    EncoderJump(i32),
    /// One channel of the encoder is dead: the counts go to and fro with the other.
    EncoderChannel(Channel),
    /// The encoder's counts since the onset are multiplied: another resolution, or, below 0, the wrong way.
    EncoderScale(f64),
    /// The encoder's cable is off: counts 0, and the board sees it.
    EncoderLoss,
    /// The converter does not follow.
    DacStuck(StuckAt),
    /// The converter's voltage is multiplied.
    DacScale(f64),
    /// The pad presses with this share of its force: oil, or at 0 no contact. It comes back with the end of the fault.
    Contact(f64),
    /// The lever is broken: the pad never presses again.
    Lever,
    /// The board's time passes this much faster than its periods.
    Clock(f64),
    /// The board's periods are longer by this factor, and its time shows it.
    Prescaler(f64),
    /// The board's whole clock is slower by this factor: periods, and the time that it reports.
    Crystal(f64),
    /// The board starts anew.
    Reset,
}

impl FaultKind {
    /// True if it is the line's (or the whole board's), so that a controller does not answer. A board
    /// whose clock waits for its controller would hide such a fault.
    #[must_use]
    pub fn silences(self) -> bool {
        self.of_the_line() || self == FaultKind::Reset
    }

    /// True if it hits frames, which go one way or the other.
    #[must_use]
    pub fn of_the_line(self) -> bool {
        match self {
            FaultKind::Drop
            | FaultKind::Duplicate
            | FaultKind::Corrupt
            | FaultKind::Delay(_)
            | FaultKind::Jitter(_)
            | FaultKind::Reorder
            | FaultKind::Silence
            | FaultKind::Lie(_)
            | FaultKind::Forged(_) => true,
            FaultKind::EncoderFreeze
            | FaultKind::EncoderJump(_)
            | FaultKind::EncoderChannel(_)
            | FaultKind::EncoderScale(_)
            | FaultKind::EncoderLoss
            | FaultKind::DacStuck(_)
            | FaultKind::DacScale(_)
            | FaultKind::Contact(_)
            | FaultKind::Lever
            | FaultKind::Clock(_)
            | FaultKind::Prescaler(_)
            | FaultKind::Crystal(_)
            | FaultKind::Reset => false,
        }
    }
}

/// A fault and when it is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// The kind of the fault.
    pub kind: FaultKind,
    /// Its start, s after the board was armed.
    pub at: f64,
    /// Its duration, s.
    pub lasting: f64,
    /// Probability with which each frame or period within that time is hit.
    pub probability: f64,
    /// The way of the frames that it concerns.
    pub direction: Direction,
}

impl Fault {
    /// A fault that begins at `at` (s after arming), stays and always hits, both ways.
    #[must_use]
    pub fn new(kind: FaultKind, at: f64) -> Self {
        Fault { kind, at, lasting: f64::INFINITY, probability: 1.0, direction: Direction::Both }
    }

    /// True if it is there `time` seconds after arming.
    #[must_use]
    pub fn active(&self, time: f64) -> bool {
        time >= self.at && time < self.at + self.lasting
    }

    /// True if it concerns frames that go `way`.
    #[must_use]
    pub fn covers(&self, way: Direction) -> bool {
        self.direction.covers(way)
    }
}

/// The reason why a fault could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "fault \"{text}\": {problem}\nexpected KIND:KEY=VALUE,…, as drop:p=0.05 or freeze:at=2 or delay:at=1,for=0.1,ms=5\n\
         kinds: {}\n\
         keys: at (s after arming), for (s), p (probability per frame or period), way (up = from the board, down = to it, both)",
    kinds()
)]
pub struct FaultError {
    text: String,
    problem: String,
}

/// A kind of fault as it is written: its name, the key that it needs with the key's values, and what it reads; none if
/// that key is missing.
struct Written(&'static str, &'static str, fn(&mut Given) -> Option<Result<FaultKind, String>>);

const KINDS: [Written; 24] = [
    Written("drop", "", |_| plain(FaultKind::Drop)),
    Written("duplicate", "", |_| plain(FaultKind::Duplicate)),
    Written("corrupt", "", |_| plain(FaultKind::Corrupt)),
    Written("reorder", "", |_| plain(FaultKind::Reorder)),
    Written("silence", "", |_| plain(FaultKind::Silence)),
    Written("lie", "says = idle, encoder, converter or run", |g| with(g.says.take(), FaultKind::Lie)),
    Written("echo", "periods", |g| with(g.periods.take(), |n| FaultKind::Forged(Forgery::Echo(n)))),
    Written("foreign", "periods", |g| with(g.periods.take(), |n| FaultKind::Forged(Forgery::OtherRun(n)))),
    Written("above-top", "", |_| plain(FaultKind::Forged(Forgery::AboveTop))),
    Written("delay", "ms", |g| with(g.ms.take(), FaultKind::Delay)),
    Written("jitter", "ms", |g| with(g.ms.take(), FaultKind::Jitter)),
    Written("freeze", "", |_| plain(FaultKind::EncoderFreeze)),
    Written("jump", "counts", |g| with(g.counts.take(), FaultKind::EncoderJump)),
    Written("channel", "dead = a or b", |g| with(g.dead.take(), FaultKind::EncoderChannel)),
    Written("scale", "factor", |g| with(g.factor.take(), FaultKind::EncoderScale)),
    Written("loss", "", |_| plain(FaultKind::EncoderLoss)),
    Written("dac-stuck", "volts = a number or last", |g| with(g.volts.take(), FaultKind::DacStuck)),
    Written("dac-scale", "factor", |g| with(g.factor.take(), FaultKind::DacScale)),
    Written("contact", "factor", |g| {
        g.factor_within(0.0, 1.0, ", the share of the pad's force that is left", FaultKind::Contact)
    }),
    Written("lever", "", |_| plain(FaultKind::Lever)),
    Written("clock", "factor", |g| with(g.factor.take(), FaultKind::Clock)),
    Written("prescaler", "factor", |g| g.factor_within(0.01, 1000.0, "", FaultKind::Prescaler)),
    Written("crystal", "factor", |g| g.factor_within(0.01, 1000.0, "", FaultKind::Crystal)),
    Written("reset", "", |_| plain(FaultKind::Reset)),
];

/// A kind that needs no key.
#[allow(clippy::unnecessary_wraps, reason = "as `with`: the shape that a row of KINDS reads")]
fn plain(kind: FaultKind) -> Option<Result<FaultKind, String>> {
    Some(Ok(kind))
}

/// A kind with the value that it needs.
fn with<T>(value: Option<T>, kind: fn(T) -> FaultKind) -> Option<Result<FaultKind, String>> {
    value.map(|value| Ok(kind(value)))
}

/// All kinds, each with what it needs.
fn kinds() -> String {
    let kinds = KINDS.map(|Written(name, needs, _)| match needs {
        "" => name.to_owned(),
        needs => format!("{name} ({needs})"),
    });
    kinds.join(", ")
}

/// Keys of faults, as they are written.
const KEYS: [&str; 11] =
    ["at", "for", "p", "way", "ms", "counts", "volts", "factor", "periods", "says", "dead"];

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (kind, keys) = text.split_once(':').unwrap_or((text, ""));
        read(kind, keys).map_err(|problem| FaultError { text: text.to_owned(), problem })
    }
}

/// The fault of a kind with keys and values; an error in words.
fn read(kind: &str, keys: &str) -> Result<Fault, String> {
    let mut given = Given::new();
    let mut seen = Vec::new();
    for pair in keys.split(',').filter(|p| !p.is_empty()) {
        let (key, value) = pair.split_once('=').ok_or_else(|| format!("\"{pair}\" has no ="))?;
        if seen.contains(&key) {
            return Err(format!("{key} is given twice"));
        }
        seen.push(key);
        given.put(key, value)?;
    }
    let kind_of_fault = given.kind(kind)?;
    if given.any_left() {
        return Err(format!("a key that {kind} does not have"));
    }
    if seen.contains(&"way") && !kind_of_fault.of_the_line() {
        return Err(format!("way: {kind} is in the board, and has none: faults of the line have"));
    }
    if !given.when {
        return Err("neither at nor p is given".to_owned());
    }
    Ok(Fault { kind: kind_of_fault, ..given.fault })
}

/// Values by their keys, of which a kind takes its own.
struct Given {
    /// The part that every kind has.
    fault: Fault,
    /// It is said when the fault comes.
    when: bool,
    ms: Option<f64>,
    counts: Option<i32>,
    volts: Option<StuckAt>,
    factor: Option<f64>,
    dead: Option<Channel>,
    says: Option<Lie>,
    periods: Option<u32>,
}

impl Given {
    fn new() -> Given {
        Given {
            fault: Fault::new(FaultKind::Drop, 0.0),
            when: false,
            ms: None,
            counts: None,
            volts: None,
            factor: None,
            dead: None,
            says: None,
            periods: None,
        }
    }

    /// Reads the value of a key.
    fn put(&mut self, key: &str, value: &str) -> Result<(), String> {
        let expected = |what: &str| format!("{key} = {value}: expected {what}");
        match key {
            "at" => (self.fault.at, self.when) = (at_least_0(key, value)?, true),
            "for" => self.fault.lasting = at_least_0(key, value)?,
            "p" => {
                let p = number(key, value)?;
                if !(0.0..=1.0).contains(&p) {
                    return Err(format!("p = {value} is not a probability: expected 0 to 1"));
                }
                (self.fault.probability, self.when) = (p, true);
            }
            "way" => {
                self.fault.direction = match value {
                    "up" => Direction::Up,
                    "down" => Direction::Down,
                    "both" => Direction::Both,
                    _ => return Err(expected("up, down or both")),
                }
            }
            "ms" => self.ms = Some(at_least_0(key, value)? / 1000.0),
            "counts" => {
                let n = value.parse::<i32>();
                self.counts = Some(n.map_err(|_| expected("a whole number of counts"))?);
            }
            "volts" if value == "last" => self.volts = Some(StuckAt::Last),
            "volts" => self.volts = Some(StuckAt::Volts(number(key, value)?)),
            "factor" => self.factor = Some(number(key, value)?),
            "periods" => {
                let n = value.parse::<u32>().ok().filter(|n| (1..=100).contains(n));
                self.periods = Some(n.ok_or_else(|| expected("1 to 100"))?);
            }
            "says" => {
                self.says = Some(match value {
                    "idle" => Lie::Idle,
                    "encoder" => Lie::Encoder,
                    "converter" => Lie::Converter,
                    "run" => Lie::OtherRun,
                    _ => return Err(expected("idle, encoder, converter or run")),
                });
            }
            "dead" => {
                self.dead = Some(match value {
                    "a" => Channel::A,
                    "b" => Channel::B,
                    _ => return Err(expected("a or b")),
                });
            }
            _ => return Err(unknown("key", key, &KEYS)),
        }
        Ok(())
    }

    /// The kind of that name, which takes the value that it needs.
    fn kind(&mut self, name: &str) -> Result<FaultKind, String> {
        let Some(Written(_, needs, read)) = KINDS.iter().find(|kind| kind.0 == name) else {
            return Err(unknown("kind", name, &KINDS.map(|kind| kind.0)));
        };
        let key = needs.split(' ').next().unwrap_or_default();
        read(self).ok_or_else(|| format!("{name} needs {key}"))?
    }

    /// The kind with its factor, which lies in a range; `about` says more of it in an error.
    fn factor_within(
        &mut self,
        least: f64,
        most: f64,
        about: &str,
        kind: fn(f64) -> FaultKind,
    ) -> Option<Result<FaultKind, String>> {
        let x = self.factor.take()?;
        Some(if (least..=most).contains(&x) {
            Ok(kind(x))
        } else {
            Err(format!("factor = {x}: expected {least} to {most}{about}"))
        })
    }

    /// A value is left that the kind has not taken.
    fn any_left(&self) -> bool {
        let Given { fault: _, when: _, ms, counts, volts, factor, dead, says, periods } = self;
        [
            ms.is_some(),
            counts.is_some(),
            volts.is_some(),
            factor.is_some(),
            dead.is_some(),
            says.is_some(),
            periods.is_some(),
        ]
        .contains(&true)
    }
}

/// A name that is none, and the probable meaning.
fn unknown(what: &str, word: &str, known: &[&str]) -> String {
    format!("unknown {what} {word}{}", expected(&nearest(word, known), known))
}

fn number(key: &str, value: &str) -> Result<f64, String> {
    let number = value.parse::<f64>().ok().filter(|x| x.is_finite());
    number.ok_or_else(|| format!("{key} = {value}: expected a number"))
}

fn at_least_0(key: &str, value: &str) -> Result<f64, String> {
    let x = number(key, value)?;
    if x >= 0.0 { Ok(x) } else { Err(format!("{key} = {value}: expected a number of at least 0")) }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FaultKind::Drop => write!(f, "drop"),
            FaultKind::Duplicate => write!(f, "duplicate"),
            FaultKind::Corrupt => write!(f, "corrupt"),
            FaultKind::Delay(s) => write!(f, "delay of {} ms", s * 1000.0),
            FaultKind::Jitter(s) => write!(f, "jitter up to {} ms", s * 1000.0),
            FaultKind::Reorder => write!(f, "reorder"),
            FaultKind::Silence => write!(f, "silence"),
            FaultKind::Lie(Lie::Idle) => write!(f, "board says that it does not drive"),
            FaultKind::Lie(Lie::Encoder) => write!(f, "board says that its encoder is broken"),
            FaultKind::Lie(Lie::Converter) => write!(f, "board says that its converter is broken"),
            FaultKind::Lie(Lie::OtherRun) => write!(f, "board says another run"),
            FaultKind::Forged(Forgery::Echo(n)) => write!(f, "echo for {n} periods"),
            FaultKind::Forged(Forgery::OtherRun(n)) => write!(f, "frames of another run, {n} each"),
            FaultKind::Forged(Forgery::AboveTop) => write!(f, "codes above the top"),
            FaultKind::Forged(Forgery::OffTable) => write!(f, "frames that the table does not have"),
            FaultKind::EncoderFreeze => write!(f, "encoder frozen"),
            FaultKind::EncoderJump(n) => write!(f, "encoder jump of {n} counts"),
            FaultKind::EncoderChannel(channel) => write!(f, "encoder's channel {channel:?} dead"),
            FaultKind::EncoderScale(factor) => write!(f, "encoder's counts times {factor}"),
            FaultKind::EncoderLoss => write!(f, "encoder lost"),
            FaultKind::DacStuck(StuckAt::Last) => write!(f, "DAC stuck where it is"),
            FaultKind::DacStuck(StuckAt::Volts(v)) => write!(f, "DAC stuck at {v} V"),
            FaultKind::DacScale(factor) => write!(f, "DAC times {factor}"),
            FaultKind::Contact(share) if *share <= 0.0 => write!(f, "contact lost"),
            FaultKind::Contact(share) => write!(f, "pad's force times {share}"),
            FaultKind::Lever => write!(f, "lever broken"),
            FaultKind::Clock(factor) => write!(f, "board's time times {factor}"),
            FaultKind::Prescaler(factor) => write!(f, "board's periods times {factor}"),
            FaultKind::Crystal(factor) => write!(f, "board's clock slower by {factor}"),
            FaultKind::Reset => write!(f, "board reset"),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        if self.probability < 1.0 {
            write!(f, ", p = {}", self.probability)?;
        }
        match self.direction {
            Direction::Up => write!(f, ", from the board")?,
            Direction::Down => write!(f, ", to the board")?,
            Direction::Both => {}
        }
        if self.lasting.is_finite() {
            write!(f, ", for {} s", self.lasting)?;
        }
        write!(f, ", from {} s", self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_and_told() {
        let fault: Fault = "delay:at=1,for=0.1,ms=5,p=0.5,way=up".parse().unwrap();
        assert_eq!(fault.kind, FaultKind::Delay(0.005));
        assert!(fault.active(1.05) && !fault.active(1.2) && !fault.active(0.9));
        assert!(fault.covers(Direction::Up) && !fault.covers(Direction::Down));
        assert_eq!(fault.to_string(), "delay of 5 ms, p = 0.5, from the board, for 0.1 s, from 1 s");
        let stuck: Fault = "dac-stuck:at=1,volts=last".parse().unwrap();
        assert_eq!(stuck.kind, FaultKind::DacStuck(StuckAt::Last));
        let e = "freeze:at=1,way=up".parse::<Fault>().unwrap_err();
        assert!(e.problem.starts_with("way: freeze is in the board, and has none"), "{e}");
    }

    #[test]
    fn what_is_proposed_is_known() {
        let problem = |text: &str| match text.parse::<Fault>() {
            Ok(_) => String::new(),
            Err(e) => e.problem,
        };
        for Written(kind, ..) in KINDS {
            assert!(!problem(kind).starts_with("unknown"), "{kind}: {}", problem(kind));
            let other = kind.to_uppercase();
            let asked = format!("unknown kind {other}: did you mean {kind}? Expected one of: drop, ");
            assert!(problem(&other).starts_with(&asked), "{}", problem(&other));
        }
        for key in KEYS {
            assert!(!problem(&format!("drop:{key}=1")).starts_with("unknown"), "{key}");
            let asked = format!("unknown key {}: did you mean {key}?", key.to_uppercase());
            assert!(problem(&format!("drop:{}=1", key.to_uppercase())).starts_with(&asked), "{key}");
        }
    }

    /// Against a decoder that sees every edge, as a counter does.
    #[test]
    fn a_decoder_with_a_dead_channel_counts_so() {
        let level = |channel: Channel, n: i32| i32::from(channel.high(n));
        for dead in [Channel::A, Channel::B] {
            for from in -5..5_i32 {
                let seen = |n: i32| match dead {
                    Channel::A => (level(Channel::A, from), level(Channel::B, n)),
                    Channel::B => (level(Channel::A, n), level(Channel::B, from)),
                };
                let mut counts = from;
                for n in from..from + 20 {
                    const GRAY: [(i32, i32); 4] = [(0, 0), (1, 0), (1, 1), (0, 1)];
                    let place = |pair| GRAY.iter().position(|p| *p == pair).unwrap() as i32;
                    counts += match (place(seen(n)) - place(seen((n - 1).max(from)))).rem_euclid(4) {
                        0 => 0,
                        1 => 1,
                        3 => -1,
                        _ => unreachable!("one channel never makes two steps"),
                    };
                    assert_eq!(dead.dead(from, n), counts, "{dead:?} dead from {from}, at {n}");
                }
            }
        }
    }

    #[test]
    fn a_bad_fault_says_what_is_wrong() {
        for (text, problem) in [
            ("", "unknown kind"),
            ("explode:at=1", "unknown kind explode"),
            ("drop", "neither at nor p"),
            ("drop:p=2", "p = 2 is not a probability"),
            ("drop:p=x", "p = x: expected a number"),
            ("drop:at=-1", "at = -1: expected a number of at least 0"),
            ("drop:at=1,ms=3", "a key that drop does not have"),
            ("delay:at=1", "delay needs ms"),
            ("jump:at=1,counts=1.5", "expected a whole number of counts"),
            ("channel:at=1,dead=c", "dead = c: expected a or b"),
            ("scale:at=1", "scale needs factor"),
            ("prescaler:at=1,factor=0", "factor = 0: expected 0.01 to 1000"),
            ("dac-scale:at=1,factor=1,dead=a", "a key that dac-scale does not have"),
            ("contact:at=1,factor=1.5", "factor = 1.5: expected 0 to 1"),
            ("contact:at=1", "contact needs factor"),
            ("lie:at=1", "lie needs says"),
            ("lie:at=1,says=nothing", "says = nothing: expected idle, encoder, converter or run"),
            ("echo:at=1,periods=0", "periods = 0: expected 1 to 100"),
            ("above-top:at=1,periods=2", "a key that above-top does not have"),
            ("drop:at", "has no ="),
            ("drop:at=1,where=up", "unknown key where"),
            ("drop:at=nan", "at = nan: expected a number"),
            ("drop:p=0.1,p=0.2", "p is given twice"),
        ] {
            let error = text.parse::<Fault>().unwrap_err().to_string();
            assert!(error.contains(problem), "{text}: {error}");
        }
    }
}
