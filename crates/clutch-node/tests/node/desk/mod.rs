//! A host, a board in the controller role, and encoder and converter, on one desk.
//!
//! ```text
//!  HostNode ◄──► BoardController ◄──► BoardNode
//!                     └ what it reads from there a ControllerNode reads too: the twin
//! ```
//!
//! Frames are passed by hand and times are computed.
#![allow(unreachable_pub, reason = "a module of one program")]

use clutch_core::law::{LawParams, LawTerms, OutputParams, PdParams};
use clutch_core::reference::{Chirp, JerkLimited, MinimumJerk, Reference, ReferenceParams, Sine, Trapezoid};
use clutch_core::supervisor::State;
use clutch_core::{
    Bounds, Counts, DacCode, FixedCounts, Micros, PlantParams, SafeState, Servo, ServoParams, Supervisor,
    SupervisorParams, Target, Tolerances,
};
use clutch_node::{
    BoardController, BoardControllerParams, BoardNode, BoardParams, ControllerNode, ControllerParams,
    HostNode, Lines, Notice, Outbox, ResetCause,
};
use clutch_settings::{RunParams, RunTimes, Setting, Settings};
use clutch_wire::{Decoder, Message, encode};
use core::mem::take;

pub type Heard = Notice<f32, LawTerms<f32>>;

pub const CONFIG: u64 = 0x0123_4567_89ab_cdef;
pub const BOARD: BoardParams = BoardParams {
    board: 42,
    boot: 9,
    counts_per_rev: 20_000,
    dac_bits: 12,
    dac_lowest_mv: -10_000,
    dac_highest_mv: 10_000,
    period_min_us: 500,
    period_max_us: 10_000,
    watchdog_max_us: 30_000,
    boot_code: 2867,
    started_by: ResetCause::Power,
    brown_out_low: false,
};
pub const BOARD_CONTROLLER: BoardControllerParams =
    BoardControllerParams { board: 77, boot: 3, clock_hz: 25_000_000 };
pub const MS: u64 = 1_000_000;
/// The host pings so often, and believes in the board for so long.
pub const ALIVE_NS: u64 = 20 * MS;
pub const BOARD_SILENCE_NS: u64 = 200 * MS;

/// A path of each kind that a few numbers make and that moves.
pub const PATHS: [ReferenceParams<'static, f32>; 5] = [
    ReferenceParams::Trapezoid(Trapezoid { distance: 0.2, speed: 0.5, acceleration: 5.0 }),
    ReferenceParams::JerkLimited(JerkLimited { distance: 0.2, speed: 0.5, acceleration: 5.0, jerk: 90.0 }),
    ReferenceParams::MinimumJerk(MinimumJerk { distance: 0.2, duration: 0.75 }),
    ReferenceParams::Sine(Sine { rate: 0.3, amplitude: 0.01, frequency: 3.0, phase: -0.25 }),
    ReferenceParams::Chirp(Chirp {
        rate: 0.3,
        amplitude: 0.01,
        from: 1.0,
        to: 9.0,
        duration: 0.5,
        phase: 0.125,
    }),
];

/// A run as a host plans it.
#[derive(Clone, Copy)]
pub struct Plan {
    pub run: u16,
    pub servo: ServoParams<f32>,
    pub limits: SupervisorParams<f32>,
    pub bounds: Bounds<f32>,
    pub reference: ReferenceParams<'static, f32>,
    pub start: FixedCounts,
    pub watchdog: Micros,
    pub silence: Micros,
    pub host_silence: Micros,
    pub ticks: u64,
}

/// Bounds of a shaft that may do nearly anything: a desk's has no physics.
fn any_shaft() -> Bounds<f32> {
    let paper = Bounds::around(&PlantParams::default(), &Tolerances::default()).unwrap();
    Bounds { drive_torque: clutch_core::Interval { low: 0.0005, high: 10.0 }, ..paper }
}

impl Plan {
    /// Three counts each millisecond, without an end.
    pub fn new() -> Plan {
        Plan {
            run: 5,
            servo: paper(LawParams::Pd(PdParams::default())),
            limits: SupervisorParams::new(SafeState::hold(5.0)),
            bounds: any_shaft(),
            reference: ReferenceParams::ramp(54.0_f32.to_radians()),
            start: FixedCounts(0),
            watchdog: Micros(3000),
            silence: Micros(3000),
            host_silence: Micros(0),
            ticks: u64::MAX,
        }
    }

    pub fn run_params(&self) -> RunParams<'_> {
        RunParams {
            servo: &self.servo,
            supervisor: &self.limits,
            bounds: &self.bounds,
            reference: &self.reference,
            start: self.start,
            times: RunTimes {
                watchdog: self.watchdog,
                valid: Micros(2000),
                silence: self.silence,
                host_silence: self.host_silence,
            },
            ticks: self.ticks,
        }
    }

    pub fn settings(&self) -> Settings {
        Settings::new(&self.run_params()).unwrap()
    }

    /// Every setting as it goes over the wire.
    pub fn pairs(&self) -> Vec<(u16, u64)> {
        let mut pairs = Vec::new();
        self.settings().each(|key, value| pairs.push((key, value)));
        pairs
    }

    pub fn supervisor(&self) -> Supervisor<f32> {
        Supervisor::new(&self.limits, &self.servo, &self.bounds).unwrap()
    }

    pub fn control(&self) -> ControllerNode<f32> {
        let params = ControllerParams {
            run: self.run,
            config: CONFIG,
            boot: BOARD.boot,
            watchdog: self.watchdog,
            valid: Micros(2000),
            silence: self.silence,
        };
        ControllerNode::new(params, Servo::new(&self.servo).unwrap(), self.supervisor())
    }

    pub fn host(&self) -> HostNode {
        let configure = self.control().configuration();
        HostNode::new(Servo::new(&self.servo).unwrap(), configure, ALIVE_NS, BOARD_SILENCE_NS)
    }

    /// The planned path from the count on which it begins.
    pub fn path(&self) -> impl Fn(u64) -> Target<f32> + use<> {
        let servo = &self.servo;
        let path = Reference::new(&self.reference, self.start, servo.encoder, servo.period).unwrap();
        let first = path.at(0).position.0 >> FixedCounts::FRACTION_BITS << FixedCounts::FRACTION_BITS;
        move |tick| {
            let target = path.at(tick);
            Target { position: FixedCounts(target.position.0 - first), ..target }
        }
    }
}

/// The paper's, with a start that remembers what the converter had.
pub fn paper(law: LawParams<f32>) -> ServoParams<f32> {
    let paper = ServoParams::paper(law);
    ServoParams { output: OutputParams { bumpless_time: 0.05, ..paper.output }, ..paper }
}

/// The key of a setting.
pub fn key(name: &str) -> u16 {
    Setting::all().find(|s| s.name.to_string() == name).unwrap_or_else(|| panic!("{name}")).key
}

pub fn drain(out: &mut Outbox) -> Vec<u8> {
    let bytes = out.as_bytes().to_vec();
    out.clear();
    bytes
}

/// The frames in bytes, all of which are whole.
pub fn frames(bytes: &[u8]) -> Vec<Message> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|b| decoder.push(*b)).map(Result::unwrap).collect()
}

/// Two notices are the same in every field and bit, but for the bits of what is not a number.
pub fn words(notices: &[Heard]) -> Vec<String> {
    notices.iter().map(|n| format!("{n:?}")).collect()
}

pub struct Desk {
    pub plan: Plan,
    pub host: HostNode,
    pub board_controller: BoardController,
    pub board: BoardNode,
    /// Reads the frames of who speaks to the board, and of the board for the twin.
    pub line: Decoder,
    pub twin: ControllerNode<f32>,
    twin_line: Decoder,
    pub now_ns: u64,
    /// Time by which the host's clock is ahead of the board's, ns.
    pub host_later_ns: u64,
    pub to_board: Outbox,
    pub lines: Lines,
    pub up: Outbox,
    /// True if the host looks at the clock.
    pub host_alive: bool,
    /// The bytes that the host has been sent.
    pub sent: Vec<u8>,
    /// The notices that the host and the twin make of it.
    pub notices: Vec<Heard>,
    pub expected: Vec<Heard>,
    /// Counts that the shaft goes in a period.
    pub speed: i32,
    periods: i32,
    shaft: i32,
}

impl Desk {
    pub fn new(plan: Plan) -> Desk {
        let mut desk = Desk {
            plan,
            host: plan.host(),
            board_controller: BoardController::new(BOARD_CONTROLLER),
            board: BoardNode::new(&BOARD).unwrap(),
            line: Decoder::new(),
            twin: plan.control(),
            twin_line: Decoder::new(),
            now_ns: 1000 * MS,
            host_later_ns: 0,
            to_board: Outbox::default(),
            lines: Lines::default(),
            up: Outbox::default(),
            host_alive: true,
            sent: Vec::new(),
            notices: Vec::new(),
            expected: Vec::new(),
            speed: 3,
            periods: 0,
            shaft: 700,
        };
        desk.twin.configure(DacCode(BOARD.boot_code), &mut Outbox::default());
        desk
    }

    pub fn now_us(&self) -> u32 {
        (self.now_ns / 1000) as u32
    }

    /// Frames to and fro until nobody has more to say; what the host heard.
    pub fn settle(&mut self) -> Vec<Message> {
        let mut heard = Vec::new();
        for _ in 0..10 {
            let up = drain(&mut self.up);
            let down = drain(&mut self.to_board);
            if up.is_empty() && down.is_empty() && self.lines.daq.is_empty() && self.lines.host.is_empty() {
                return heard;
            }
            let Lines { host, daq, from_daq } = &mut self.lines;
            self.board_controller.host(self.now_ns, &down, host, daq);
            if !up.is_empty() {
                self.board_controller.daq(self.now_ns, from_daq, &up, host, daq);
                let (path, line, expected) = (self.plan.path(), &mut self.twin_line, &mut self.expected);
                let mut out = Outbox::default();
                self.twin.receive(self.now_ns, line, &up, &path, &mut out, &mut |n| expected.push(n));
            }
            let daq = drain(&mut self.lines.daq);
            let now_us = self.now_us();
            self.board.receive(now_us, &mut self.line, &daq, &mut self.up);
            let host = drain(&mut self.lines.host);
            heard.extend(frames(&host));
            self.sent.extend_from_slice(&host);
            let notices = &mut self.notices;
            self.host.receive(self.now_ns + self.host_later_ns, &host, &self.plan.path(), &mut |n| {
                notices.push(n)
            });
        }
        panic!("they never come to an end: {heard:?}");
    }

    /// A frame from the host, whether the host's own state machine would send it or not.
    pub fn says(&mut self, message: Message) -> Vec<Message> {
        self.to_board.append(encode(&message).as_bytes());
        self.settle()
    }

    pub fn asks(&mut self, f: impl FnOnce(&mut HostNode, &mut Outbox)) -> Vec<Message> {
        f(&mut self.host, &mut self.to_board);
        self.settle()
    }

    pub fn uploads(&mut self, pairs: &[(u16, u64)]) {
        for (key, value) in pairs {
            let heard = self.asks(|host, out| host.set(*key, *value, out));
            let taken = clutch_wire::Taken { run: self.plan.run, key: *key, value: *value };
            assert_eq!(heard, [Message::Taken(taken)]);
        }
    }

    /// With the settings and the board's answer to Configure.
    pub fn configures(&mut self) {
        self.uploads(&self.plan.pairs());
        let heard = self.asks(|host, out| host.configure(out));
        assert!(matches!(heard[..], [Message::Configured(_)]), "{heard:?}");
        assert_eq!((self.board_controller.state(), self.host.standing().state), (State::Ready, State::Ready));
    }

    pub fn arms(&mut self) {
        let heard = self.asks(|host, out| host.arm(out));
        assert!(matches!(heard[..], [Message::Armed(_)]), "{heard:?}");
        assert_eq!((self.board_controller.state(), self.host.standing().state), (State::Armed, State::Armed));
    }

    pub fn ready(plan: Plan) -> Desk {
        let mut desk = Desk::new(plan);
        let heard = desk.asks(|host, out| host.discover(7, out));
        assert_eq!(heard.len(), 2, "the controller and its board: {heard:?}");
        desk.configures();
        desk
    }

    pub fn running(plan: Plan) -> Desk {
        let mut desk = Desk::ready(plan);
        desk.follows(3);
        desk.arms();
        desk.follows(5);
        assert_eq!(
            (desk.board_controller.state(), desk.host.standing().state),
            (State::Running, State::Running)
        );
        desk
    }

    /// A sample of a shaft that goes at its speed, not quite evenly.
    pub fn samples(&mut self) {
        self.faulty(false, false);
    }

    pub fn faulty(&mut self, encoder: bool, converter: bool) {
        self.now_ns += MS;
        self.periods += 1;
        self.shaft += self.speed;
        let uneven = if self.speed == 0 { 0 } else { [0, 1, 0, -1][self.periods as usize % 4] };
        let counts = Counts(self.shaft + uneven);
        self.board.sample(self.now_us(), counts, encoder, converter, &mut self.up);
    }

    /// Both ends look at the clock.
    pub fn polls(&mut self) -> Vec<Message> {
        let Lines { host, daq, .. } = &mut self.lines;
        self.board_controller.poll(self.now_ns, host, daq);
        if self.host_alive {
            let notices = &mut self.notices;
            self.host.poll(self.now_ns + self.host_later_ns, &mut self.to_board, &mut |n| notices.push(n));
        }
        self.settle()
    }

    /// So many periods in which all goes well.
    pub fn follows(&mut self, periods: u32) {
        for _ in 0..periods {
            self.samples();
            self.settle();
            self.polls();
        }
    }

    /// Time without a sample.
    pub fn passes(&mut self, ns: u64) -> Vec<Message> {
        self.now_ns += ns;
        self.polls()
    }

    /// Another run with the same boards.
    pub fn next(&mut self, plan: Plan) {
        let met = self.host.controller().copied();
        (self.plan, self.host, self.twin) = (plan, plan.host(), plan.control());
        // The host's next node knows of the same board.
        met.iter().for_each(|met| self.host.meet(met));
        self.twin.configure(plan.supervisor().safe_codes().hold, &mut Outbox::default());
        (self.notices, self.expected, self.sent) = (Vec::new(), Vec::new(), Vec::new());
    }

    /// The samples of which the host and the twin heard since the last look; of those before consent the
    /// host does not hear.
    pub fn cycles(&mut self) -> (Vec<Heard>, Vec<Heard>) {
        let told = |n: &Heard| matches!(n, Notice::Cycle(c) if c.cycle.state != State::Ready);
        let cycles = |notices: &mut Vec<Heard>| take(notices).into_iter().filter(told).collect();
        assert!(!self.notices.iter().any(|n| matches!(n, Notice::Cycle(_)) && !told(n)));
        (cycles(&mut self.notices), cycles(&mut self.expected))
    }

    /// The cause of the end of control, as often as the host was told.
    pub fn ends(&self) -> Vec<clutch_core::supervisor::Cause> {
        self.notices
            .iter()
            .filter_map(|n| if let Notice::Ended(ending) = n { Some(ending.cause) } else { None })
            .collect()
    }
}
