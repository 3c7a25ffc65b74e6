//! Proof by linking: no function of clutch-core, clutch-wire and clutch-node can panic.
//!
//! The panic handler calls a symbol that does not exist. If the optimiser leaves one path to a
//! panic, the link fails; if the image links, there is none, and no sum in them overflows
//! either. All input is opaque, and a value that a constructor has checked is made opaque again
//! before it is used, so a tick is proven for any bits in its coefficients.
//!
//! ```text
//! cargo build --release --manifest-path tests/no_panic/Cargo.toml --target thumbv7em-none-eabihf
//! ```
//!
//! links; with `--features control`, which adds a panic, it must not. The image is never run. It
//! links at the levels 2, 3 and s, also for thumbv6m and riscv32imac; at z nalgebra's products,
//! no longer inlined, keep two checks of their lengths.
//!
//! To find a surviving path, link anyway and look for the callers of `core::panicking`:
//!
//! ```text
//! cargo rustc … -- -C link-arg=--defsym=__panic_path_survived=0
//! llvm-objdump -d -l --demangle <image>
//! ```
//!
//! Not covered: `Display` and `Debug`, because `core` formats floats with code that can panic.
//! They belong in a host's error message, not in a tick.
#![no_std]
#![no_main]

use clutch_core::certificate::{Demand, certify, paper_conditions};
use clutch_core::law::{
    Beside, Command, ControlLaw, Ctc, Dob, Glide, Hold, Law, LawParams, LawTerms, Listed, Output,
    OutputParams, Pd, Pid, Shell, ShellParams, Smc, SmcIntegral, SmcSign, SuperTwisting, Terms, Tick,
    Voltage,
};
use clutch_core::params::{self, Choice, Editor, Params};
use clutch_core::reference::{
    Chirp, Interpolation, JerkLimited, Knot, MinimumJerk, OneKind, Ramp, Reference, ReferenceParams, Sine,
    Table, Trapezoid,
};
use clutch_core::supervisor::{Arrival, BoardMode, Cause, Checks, Sample, State, SupervisorState};
use clutch_core::{
    Actuator, ActuatorKind, ActuatorParams, Bounds, BrakeGeometry, Counts, Dac, DacCode, DacParams,
    DerivativeState, Encoder, FixedCounts, Friction, FrictionMap, FrictionModel, FrictionParams, Interval,
    Micros, Observer, ObserverGains, ObserverParams, Plant, PlantParams, Real, SafeCodes, SafeKind, SafeRun,
    SafeState, Servo, ServoParams, SmoothedDerivative, SmoothedDerivativeParams, StickSlip, StickSlipParams,
    StickSlipState, Stribeck, StribeckParams, Supervisor, SupervisorParams, Target, Tolerances,
    VelocityParams, VelocitySource, check_path, off_map, sin_cos_turns,
};
use clutch_node::controller_lockstep::Exchange;
use clutch_node::{
    Alone, AloneRun, BoardController, BoardControllerParams, BoardNode, BoardParams, ControllerNode,
    ControllerParams, DaqBoard, Hardware, HostNode, Lines, OneChip, Outbox, Role, WideCounter, present_code,
    receive, tick,
};
use clutch_settings::{Path, RunParams, Settings};
use clutch_wire::{BoardState, Configure, Decoder, Hello, ResetCause, StopReason, encode};
use core::hint::black_box;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn __panic_path_survived() -> !;
    }
    // SAFETY: never linked, so never called.
    unsafe { __panic_path_survived() }
}

/// A value that the optimiser must not know.
static mut INPUT: u64 = 0;

fn word() -> u64 {
    // SAFETY: nothing writes, and there is one thread.
    unsafe { core::ptr::read_volatile(&raw const INPUT) }
}

/// Any number, also one that is not a number.
fn real<T: Real>() -> T {
    T::from_f64(f64::from_bits(word()))
}

fn fixed() -> FixedCounts {
    FixedCounts(word() as i64)
}

fn micros() -> Micros {
    Micros(word() as u32)
}

/// Any values of all that is declared, and any choice.
struct Any;

impl<T: Real> Editor<T> for Any {
    fn real<P: params::Table<T>>(&mut self, _: usize, value: &mut T) {
        *value = real();
    }
    fn whole<P: params::Table<T>>(&mut self, _: usize, value: &mut u64) {
        *value = word();
    }
    fn switch<P: params::Table<T>>(&mut self, _: usize, value: &mut bool) {
        *value = flag();
    }
    fn word<P: params::Table<T>>(&mut self, _: usize, value: &mut usize) {
        *value = word() as usize;
    }
    fn present<P: params::Table<T>>(&mut self, _: usize, _: bool) -> bool {
        flag()
    }
    fn enter<P: params::Table<T>>(&mut self, _: usize, _: bool) -> bool {
        flag()
    }
    fn choose<C: Choice<T>>(&mut self, _: usize) -> usize {
        word() as usize
    }
}

/// Parameters of which nothing is known.
fn any<T: Real, P: Params<T>>() -> P {
    let mut params = opaque(P::blank());
    params.edit(&mut Any);
    let params = opaque(params);
    sink(made(params.check()));
    params
}

/// The same value, about which the optimiser no longer knows anything.
fn opaque<X>(x: X) -> X {
    black_box(x)
}

/// Takes a result, so that it has to be computed.
fn sink<X>(x: X) {
    black_box(&x);
}

/// Takes either outcome of a constructor; gives its result back, opaque.
fn made<X, E>(result: Result<X, E>) -> Option<X> {
    match opaque(result) {
        Ok(x) => Some(x),
        Err(e) => {
            sink(e);
            None
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    all::<f32, f64>();
    all::<f64, f32>();
    wire();
    board();
    controller_role();
    #[cfg(feature = "control")]
    control();
    loop {
        core::hint::spin_loop();
    }
}

/// A list of everything; a new module gets its function here.
///
/// `U` is the other scalar, for the casts.
fn all<T: Real, U: Real>() {
    scalar::<T>();
    codes::<T>();
    friction::<T>();
    actuator::<T>();
    plant::<T>();
    velocity::<T>();
    observer::<T>();
    laws::<T>();
    references::<T>();
    servo::<T>();
    casts::<T, U>();
    certificate::<T>();
    feasibility::<T>();
    stick_slip::<T>();
    safe_state::<T, U>();
    supervisor::<T, U>();
    control_node::<T>();
}

/// The negative control.
#[cfg(feature = "control")]
fn control() {
    let table = opaque([1_u8, 2, 3]);
    sink(table[word() as usize]);
}

fn scalar<T: Real>() {
    let (x, y) = (real::<T>(), real::<T>());
    sink([x.abs(), x.exp(), x.powf(y), x.sqrt(), x.floor(), x.max(y), x.min(y), x.sgn(), x.sat()]);
    sink([x.limit(y, real()), x + y, x - y, x * y, x / y, -x]);
    sink((x.is_finite(), x.to_f64(), x.to_i64(), x.to_u16(), x.sin_cos_octant()));
    sink([T::from_i32(word() as i32), T::from_i64(word() as i64), T::from_u64(word())]);
    sink(sin_cos_turns::<T>(word()));
}

fn encoder<T: Real>() -> Encoder {
    made(Encoder::new::<T>(word() as u32)).unwrap_or(Encoder::PAPER)
}

fn codes<T: Real>() {
    sink(Counts(word() as i32).since(Counts(word() as i32)));
    sink(FixedCounts::from_counts(word() as i64).plus(fixed()));
    sink(FixedCounts::from_real(real::<T>()).minus::<T>(fixed()));
    sink(micros().seconds::<T>());
    sink(made(micros().period::<T>()));
    let e = encoder::<T>();
    sink((e.counts_per_rev(), e.radians_per_count::<T>(), e.counts_per_radian::<T>()));
    if let Some(dac) = made(Dac::new(&any::<T, DacParams<T>>())) {
        sink((dac.code(real()), dac.volts(DacCode(word() as u16)), dac.step()));
    }
}

fn friction<T: Real>() {
    sink(made(Stribeck::new(&any::<T, StribeckParams<T>>())));
    if let Some(f) = made(Friction::build(&any::<T, FrictionParams<T>>())) {
        sink([f.level(real()), f.coefficient(real()), f.at_rest(), f.sliding()]);
        sink((f.curve(), f.envelope(), f.exponential(), made(f.check_divisor())));
    }
}

fn actuator<T: Real>() {
    let p = any::<T, ActuatorParams<T>>();
    let geometry = any::<T, BrakeGeometry<T>>();
    sink((made(geometry.brake_gain()), p.kind().two_sided(), ActuatorParams::brake(real::<T>())));
    if let Some(a) = made(Actuator::new(&p)) {
        sink((a.kind().drives_above_0(), a.params(), made(a.check_share(real()))));
        sink([a.brake_gain(), a.motor_gain(), a.preload(), a.load_share()]);
        sink([
            a.torque(real()),
            a.normal(real()),
            a.friction(real(), real()),
            a.volts_for(real(), real(), real()),
        ]);
    }
}

fn plant<T: Real>() {
    if let Some(p) = made(Plant::new(&any::<T, PlantParams<T>>())) {
        sink((*p.params(), *p.friction(), *p.actuator()));
        sink([
            p.friction_torque(real(), real()),
            p.break_away_torque(real()),
            p.acceleration(real(), real()),
        ]);
        sink([p.holding_voltage_static(), p.holding_voltage_sliding()]);
    }
}

fn target<T: Real>() -> Target<T> {
    Target { position: fixed(), velocity: real(), acceleration: real() }
}

fn velocity<T: Real>() {
    let p = any::<T, SmoothedDerivativeParams<T>>();
    if let Some(d) = made(SmoothedDerivative::new(&p, encoder::<T>(), micros())) {
        let mut state = opaque(DerivativeState::at(fixed()));
        sink(d.update(&mut state, fixed()));
        sink(state);
    }
    let Some(plant) = made(Plant::new(&any::<T, PlantParams<T>>())) else { return };
    if let Some(v) =
        made(VelocitySource::new(&any::<T, VelocityParams<T>>(), &plant, encoder::<T>(), micros()))
    {
        let mut state = opaque(v.start(fixed(), &target(), real()));
        sink(v.update(&mut state, fixed(), &target(), real(), real::<T>));
        sink(state);
    }
}

fn observer<T: Real>() {
    let Some(plant) = made(Plant::new(&any::<T, PlantParams<T>>())) else { return };
    let p = any::<T, ObserverParams<T>>();
    sink(made(Observer::new(&p, &plant, encoder::<T>(), micros())));
    let gains = ObserverGains { position: real(), velocity: real(), disturbance: real() };
    if let Some(o) = made(Observer::with_gains(&gains, &plant, encoder::<T>(), micros())) {
        let mut state = opaque(o.start(fixed(), real()));
        sink(o.update(&mut state, fixed(), real()));
        sink((state, *o.gains()));
    }
}

/// Start and update of any law.
fn runs<T: Real, C: ControlLaw<T>>(law: Option<C>) {
    let Some(law) = law else { return };
    let tick =
        Tick { error: real::<T>(), error_rate: real(), target_velocity: real(), target_acceleration: real() };
    sink(tick.velocity());
    let mut state = opaque(law.start(&tick, real()));
    let Command { voltage, limit, terms } = law.update(&mut state, &tick);
    black_box(terms.values());
    sink((voltage, limit, law.term_names().len()));
    sink(state);
}

fn laws<T: Real>() {
    sink(LawTerms::<T>::default());
    let (model, out) = (any::<T, PlantParams<T>>(), any::<T, OutputParams<T>>());
    if let Some(o) = made(Output::new(&out, micros())) {
        let mut state = opaque(o.start(real(), real()));
        sink((o.lowest(), o.highest(), o.apply(&mut state, real())));
        sink(state);
    }
    let beside = Beside { model: &model, output: &out, encoder: opaque(Encoder::PAPER), period: micros() };
    let law = made(Law::new(&any::<T, LawParams<T>>(), &beside));
    sink(law.as_ref().map(|l| *l.output()));
    runs(law);
    sink(law.as_ref().map(|l| l.terms_of(&opaque([real(); 9]))));
    // Each law also alone: a board may hold only one.
    runs(made(Pd::new(&any(), &out, micros())));
    runs(made(Ctc::new(&any(), &model, &out, micros())));
    runs(made(Smc::new(&any(), &out, micros())));
    runs(made(SmcSign::new(&any(), &out, micros())));
    runs(made(Pid::new(&any(), &out, micros())));
    runs(made(SuperTwisting::new(&any(), &out, micros())));
    runs(made(SmcIntegral::new(&any(), &out, micros())));
    runs(made(Dob::new(&any(), &beside)));
    runs(made(Glide::new(&any(), &beside)));
}

fn reference_params<T: Real>(knots: &[Knot]) -> ReferenceParams<'_, T> {
    match any() {
        ReferenceParams::Table(Table { interpolation, .. }) => {
            ReferenceParams::Table(Table { knots, interpolation })
        }
        other => other,
    }
}

fn references<T: Real>() {
    let knot = || Knot { time_us: word(), position: fixed() };
    let knots = opaque([knot(), knot(), knot(), knot()]);
    let knots = opaque(knots.get(..word() as usize).unwrap_or(&knots));
    if let Some(r) = made(Reference::<T>::new(&reference_params(knots), fixed(), encoder::<T>(), micros())) {
        sink(r.at(word()));
    }
}

fn bounds<T: Real>() -> Option<Bounds<T>> {
    made(Bounds::around(&any::<T, PlantParams<T>>(), &any()))
}

fn certificate<T: Real>() {
    sink(Demand::<T>::default());
    let Some(b) = bounds::<T>() else { return };
    sink([b.weakest_brake(), b.strongest_brake(), b.left_over(real())]);
    sink([
        b.torque(flag(), real()),
        b.authority(flag(), real(), real()),
        b.authority_at_rest(real(), real()),
    ]);
    let demand = Demand {
        velocity: real::<T>(),
        acceleration: real(),
        reach_rate: real(),
        start_error_rate: real(),
        velocity_jump: real(),
    };
    sink(paper_conditions(&b, &demand, real(), real()));
    let (model, output) = (any::<T, PlantParams<T>>(), any::<T, OutputParams<T>>());
    let beside =
        Beside { encoder: opaque(Encoder::PAPER), period: micros(), ..Beside::paper(&model, &output) };
    let Some(law) = made(Law::new(&any::<T, LawParams<T>>(), &beside)) else {
        return;
    };
    let Some(shell) = made(Shell::new(&any::<T, ShellParams<T>>(), &any::<T, OutputParams<T>>(), kind()))
    else {
        return;
    };
    if let Some(c) = made(certify(&law, &shell, &b, &demand)) {
        sink((c.certified(), c.reaching_time(real())));
    }
}

fn feasibility<T: Real>() {
    let (Some(b), Some(out)) = (bounds::<T>(), made(Output::new(&any::<T, OutputParams<T>>(), micros())))
    else {
        return;
    };
    let knots = opaque([Knot { time_us: word(), position: fixed() }; 3]);
    let Some(path) = made(Reference::new(&reference_params(&knots), fixed(), encoder::<T>(), micros()))
    else {
        return;
    };
    if let Some(e) = made(check_path(&path, word(), micros(), real(), &b, &out)) {
        sink(e.largest_acceleration());
    }
}

fn stick_slip<T: Real>() {
    let p = any::<T, StickSlipParams<T>>();
    if let Some(d) = made(StickSlip::new(&p, encoder::<T>(), micros())) {
        let mut state = opaque(StickSlipState::default());
        sink(d.update(&mut state, Counts(word() as i32), real()));
        sink((state.stuck(), state.cycles(), state.stuck_ticks(), state.ticks(), state.stair()));
        sink(state);
    }
}

fn servo<T: Real>() {
    sink(ServoParams::<T>::paper(any::<T, _>()));
    let p = servo_params::<T>();
    turns(made(Servo::new(&p)));
    if let Some(pd) = made(Pd::new(&any(), &p.output, p.period)) {
        turns(made(Servo::with_law(&p, pd)));
    }
}

fn turns<T: Real, C: ControlLaw<T>>(servo: Option<Servo<T, C>>) {
    let Some(servo) = servo else { return };
    sink((servo.encoder(), *servo.dac(), servo.period()));
    black_box(servo.law());
    let mut state = opaque(servo.start(Counts(word() as i32), &target(), real()));
    sink(servo.tick(&mut state, Counts(word() as i32), &target()));
    sink(servo.start_at(fixed(), &target(), real()));
    sink(servo.tick_at(&mut state, fixed(), &target(), off_map));
    let factors = [word() as u16; 8];
    if let Ok(map) = FrictionMap::new(fixed().0, word() as u32, opaque(&factors)) {
        sink(servo.tick_on(&mut state, Counts(word() as i32), &target(), |position| map.at(position)));
    }
    let (next, steps) = (target(), (word() as u32, word() as u32));
    servo.bridge(&mut state, (Counts(word() as i32), &next), &target(), steps);
    sink(state);
}

fn casts<T: Real, U: Real>() {
    sink(target::<T>().cast::<U>());
    sink(ObserverGains::<T> { position: real(), velocity: real(), disturbance: real() }.cast::<U>());
    let p = ServoParams::<T> {
        dac: any::<T, _>(),
        velocity: any::<T, _>(),
        model: any::<T, _>(),
        output: any::<T, _>(),
        shell: any::<T, _>(),
        ..ServoParams::paper(any::<T, _>())
    };
    sink(p.cast::<U>());
    sink(any::<T, StickSlipParams<T>>().cast::<U>());
    sink(any::<T, Tolerances<T>>().cast::<U>());
    sink(any::<T, Interval<T>>().cast::<U>());
    sink(any::<T, ReferenceParams<'_, T>>().cast::<U>());
    sink(bounds::<T>().map(|b| b.cast::<U>()));
}

fn flag() -> bool {
    word() != 0
}

fn kind() -> ActuatorKind {
    ActuatorKind::ALL.get(word() as usize).copied().unwrap_or_default()
}

fn safe_state<T: Real, U: Real>() {
    let state = any::<T, SafeState<T>>();
    sink((state.cast::<U>(), state.holding_voltage()));
    let Some(dac) = made(Dac::new(&any::<T, DacParams<T>>())) else { return };
    sink(made(SafeCodes::new(&state, &dac, micros(), kind())));
    // Any numbers, also such as no constructor gives: a board takes them from the wire.
    let codes = SafeCodes {
        kind: match word() {
            0 => SafeKind::Hold,
            1 => SafeKind::Ramp,
            2 => SafeKind::Release,
            _ => SafeKind::HoldThenRelease,
        },
        hold: DacCode(word() as u16),
        release: DacCode(word() as u16),
        ramp_step: word() as u32,
        hold_periods: word() as u32,
    };
    let mut run = opaque(SafeRun::begin(DacCode(word() as u16)));
    sink((run.next(&codes), run.released(&codes)));
    sink(run);
}

fn servo_params<T: Real>() -> ServoParams<T> {
    ServoParams {
        period: micros(),
        encoder: encoder::<T>(),
        dac: any::<T, _>(),
        velocity: any::<T, _>(),
        model: any::<T, _>(),
        law: any::<T, _>(),
        output: any::<T, _>(),
        shell: any::<T, _>(),
    }
}

fn supervisor_params<T: Real>() -> SupervisorParams<T> {
    sink(SupervisorParams::new(any::<T, SafeState<T>>()));
    SupervisorParams { on_fault: any(), speed: any(), limits: any() }
}

fn checked_supervisor<T: Real>() -> Option<(Servo<T>, Supervisor<T>)> {
    let (servo, limits) = (servo_params::<T>(), supervisor_params::<T>());
    let supervisor = made(Supervisor::new(&limits, &servo, &bounds()?))?;
    Some((made(Servo::new(&servo))?, supervisor))
}

fn supervisor<T: Real, U: Real>() {
    sink(supervisor_params::<T>().cast::<U>());
    let Some((servo, v)) = checked_supervisor::<T>() else { return };
    sink(v.with_checks(Checks::ALL.without(Cause::Jump)));
    black_box(v.safe_codes());
    let mut state = SupervisorState::default();
    v.connect(&mut state);
    sink(v.arm(&mut state, DacCode(word() as u16)));
    // After any input: no field is known any more.
    let mut state = opaque(state);
    let sample = Sample {
        sequence: word() as u16,
        time: micros(),
        counts: Counts(word() as i32),
        board: match word() {
            0 => BoardMode::Ready,
            1 => BoardMode::Driving,
            _ => BoardMode::Safe,
        },
        encoder_fault: flag(),
        converter_fault: flag(),
        command_late: flag(),
        superseded: flag(),
        lateness: micros(),
    };
    let cycle = v.sample(&servo, &mut state, &sample, |_| target());
    sink((cycle, cycle.arrival.is_fresh()));
    v.silence(&mut state, word() as u32);
    v.board_fault(&mut state, real());
    v.stop(&mut state, Cause::Done);
    v.disconnect(&mut state);
    v.acknowledge(&mut state);
    sink((state.state(), state.cause(), state.value(), state.code(), state.tick()));
    sink((state.lost(), state.rejected(), state.deadline_misses()));
}

/// A number of bytes that only the run knows.
fn bytes(store: &[u8; 64]) -> &[u8] {
    store.get(..word() as usize).unwrap_or(store)
}

fn any_bytes() -> [u8; 64] {
    let mut bytes = [0; 64];
    bytes.iter_mut().for_each(|b| *b = word() as u8);
    opaque(bytes)
}

fn wire() {
    let mut decoder = opaque(Decoder::new());
    for byte in bytes(&any_bytes()) {
        let heard = decoder.push(*byte);
        // The encoder takes any message that the decoder gives: any kind, any fields.
        if let Some(Ok(message)) = opaque(heard) {
            black_box(encode(&message).as_bytes());
        }
    }
    sink(decoder);
}

fn drain(out: &mut Outbox) {
    black_box(out.as_bytes());
    sink(out.dropped());
    out.clear();
}

fn board() {
    let params = BoardParams {
        board: word() as u32,
        boot: word() as u32,
        counts_per_rev: word() as u32,
        dac_bits: word() as u8,
        dac_lowest_mv: word() as i32,
        dac_highest_mv: word() as i32,
        period_min_us: word() as u32,
        period_max_us: word() as u32,
        watchdog_max_us: word() as u32,
        boot_code: word() as u16,
        started_by: ResetCause::from_u8(word() as u8).unwrap_or(ResetCause::Unknown),
        brown_out_low: word() == 1,
    };
    runner(&params);
    let Some(mut node) = made(BoardNode::new(&params)) else { return };
    let (mut line, mut out) = (opaque(Decoder::new()), opaque(Outbox::default()));
    loop {
        node.receive(word() as u32, &mut line, bytes(&any_bytes()), &mut out);
        (node, line) = (opaque(node), opaque(line));
        node.sample(word() as u32, Counts(word() as i32), flag(), flag(), &mut out);
        node = opaque(node);
        node.poll(word() as u32, &mut out);
        sink((node.code(), node.state() == BoardState::Running, node.period_us(), node.watchdog_at()));
        sink(node.unanswered());
        drain(&mut out);
        if flag() {
            return;
        }
    }
}

/// A board's hardware of which nothing is known.
struct Unknown(WideCounter);

impl Hardware for Unknown {
    fn now_us(&self) -> u64 {
        word()
    }
    fn counts(&mut self) -> Counts {
        self.0.read(word() as u16)
    }
    fn encoder_fault(&self) -> bool {
        flag()
    }
    fn converter_fault(&self) -> bool {
        flag()
    }
    fn put_out(&mut self, code: DacCode) {
        sink(code);
    }
    fn feed_watchdog(&mut self) {}
    fn send(&mut self, frames: &[u8]) -> bool {
        black_box(frames);
        flag()
    }
    fn cycles(&self) -> u32 {
        word() as u32
    }
}

fn runner(params: &BoardParams) {
    alone(params);
    if let Some(role) = made(DaqBoard::new(params)) {
        periods(role);
    }
    if let Some(mut chip) = made(OneChip::new(board_controller_params(), params)) {
        // The functions that the runner does not call.
        chip.poll(word(), &mut |code| sink(code));
        sink((chip.state() == BoardState::Running, chip.code()));
        periods(opaque(chip));
    }
}

fn periods(mut role: impl Role) {
    let mut hardware = Unknown(WideCounter::new(word() as u16));
    loop {
        tick(&mut role, &mut hardware);
        role = opaque(role);
        receive(&mut role, &mut hardware, bytes(&any_bytes()));
        role = opaque(role);
        if flag() {
            return;
        }
    }
}

/// A controller without a host, with each law on a ramp and each kind of path under one law.
fn alone(params: &BoardParams) {
    alone_with::<Pd<f32>, Ramp<f32>>(params, any());
    alone_with::<Ctc<f32>, Ramp<f32>>(params, any());
    alone_with::<Smc<f32>, Ramp<f32>>(params, any());
    alone_with::<SmcSign<f32>, Ramp<f32>>(params, any());
    alone_with::<Pid<f32>, Ramp<f32>>(params, any());
    alone_with::<SuperTwisting<f32>, Ramp<f32>>(params, any());
    alone_with::<SmcIntegral<f32>, Ramp<f32>>(params, any());
    alone_with::<Dob<f32>, Ramp<f32>>(params, any());
    alone_with::<Glide<f32>, Ramp<f32>>(params, any());
    alone_with::<Voltage<f32>, Ramp<f32>>(params, any());
    alone_with::<Hold<f32>, Ramp<f32>>(params, any());
    alone_with::<Pd<f32>, Trapezoid<f32>>(params, any());
    alone_with::<Pd<f32>, JerkLimited<f32>>(params, any());
    alone_with::<Pd<f32>, MinimumJerk<f32>>(params, any());
    alone_with::<Pd<f32>, Sine<f32>>(params, any());
    alone_with::<Pd<f32>, Chirp<f32>>(params, any());
    let knots: &'static [Knot] = opaque(&[Knot { time_us: 3, position: FixedCounts(7) }]);
    let interpolation = if flag() { Interpolation::Linear } else { Interpolation::Cubic };
    alone_with::<Pd<f32>, _>(params, Table { knots, interpolation });
}

fn alone_with<L, P>(params: &BoardParams, path: P)
where
    L: Listed<f32>,
    L::Params: Params<f32>,
    P: OneKind<f32>,
{
    let run = AloneRun::<L, P> {
        servo: servo_params(),
        law: any(),
        supervisor: supervisor_params(),
        bounds: any(),
        path,
        start: fixed(),
        ticks: word(),
        watchdog: micros(),
    };
    let Some(mut alone) = made(Alone::new(&run, params)) else { return };
    let mut hardware = Unknown(WideCounter::new(word() as u16));
    loop {
        alone.tick(&mut hardware, flag());
        sink((alone.lamp(), alone.origin(), alone.period_us(), alone.state().state()));
        alone = opaque(alone);
        if flag() {
            return;
        }
    }
}

fn control_node<T: Real>() {
    let Some((servo, supervisor)) = checked_supervisor::<T>() else { return };
    let params = ControllerParams {
        run: word() as u16,
        config: word(),
        boot: word() as u32,
        watchdog: micros(),
        valid: micros(),
        silence: micros(),
    };
    let mut node = opaque(ControllerNode::new(params, servo, supervisor));
    let (mut line, mut out) = (opaque(Decoder::new()), opaque(Outbox::default()));
    let path = |_| target();
    loop {
        node.discover(word() as u32, &mut out);
        node.configure(DacCode(word() as u16), &mut out);
        node.arm(&mut out);
        node.ping(word() as u32, &mut out);
        node.receive(word(), &mut line, bytes(&any_bytes()), &path, &mut out, &mut |notice| sink(notice));
        (node, line) = (opaque(node), opaque(line));
        node.answered(micros());
        node.poll(word(), &mut out, &mut |notice| sink(notice));
        sink((node.poll_at(), node.origin(), *node.counts(), node.state().state()));
        sink(node.servo().period());
        drain(&mut out);
        match word() {
            0 => node.stop(StopReason::Done, &mut out),
            1 => node.stop(StopReason::Operator, &mut out),
            2 => node.disconnect(),
            3 => return,
            _ => {}
        }
        node = opaque(node);
    }
}

fn board_controller_params() -> BoardControllerParams {
    BoardControllerParams { board: word() as u32, boot: word() as u32, clock_hz: word() as u32 }
}

/// The controller role: the board's end, the host's end, and the frames between them.
fn controller_role() {
    numbers();
    sent();
    board_controller();
    exchange();
}

fn numbers() {
    sink((State::from_u8(word() as u8), Cause::from_u8(word() as u8), Arrival::from_u8(word() as u8)));
    let hello = Hello {
        nonce: word() as u32,
        version: word() as u8,
        schema: word(),
        board: word() as u32,
        boot: word() as u32,
        counts_per_rev: word() as u32,
        dac_bits: word() as u8,
        dac_lowest_mv: word() as i32,
        dac_highest_mv: word() as i32,
        period_min_us: word() as u32,
        period_max_us: word() as u32,
        watchdog_max_us: word() as u32,
        boot_code: word() as u16,
        started_by: word() as u8,
        warnings: word() as u8,
        state: word() as u8,
        run: word() as u16,
        config: word(),
    };
    sink(present_code(&hello, DacCode(word() as u16)));
}

/// Settings as a host makes them, on their way, and as a board builds from them.
fn sent() {
    let knots = opaque([Knot { time_us: word(), position: fixed() }; 400]);
    let knots = knots.get(..word() as usize).unwrap_or(&knots);
    let table = Table { knots, interpolation: Interpolation::Cubic };
    sink(table.at::<f32>(word(), encoder::<f32>(), micros()));
    let Some(bounds) = bounds::<f32>() else { return };
    let run = RunParams {
        servo: &servo_params(),
        supervisor: &supervisor_params(),
        bounds: &bounds,
        reference: &reference_params(knots),
        start: fixed(),
        times: any::<f32, _>(),
        ticks: word(),
    };
    if let Some(settings) = made(Settings::new(&run)) {
        settings.each(|key, value| sink((key, value)));
    }
    let mut settings = opaque(Settings::default());
    sink((settings.set(word() as u16, word()), Settings::knows(word() as u16)));
    let settings = opaque(settings);
    settings.each(|key, value| sink((key, value)));
    if let Some(built) = made(settings.build()) {
        sink(built.path.target(settings.knots(), word()));
        host_node(&built.path, settings.knots());
    }
}

fn board_controller() {
    let mut node = opaque(BoardController::new(board_controller_params()));
    let mut lines = opaque(Lines::default());
    loop {
        let Lines { host, daq, from_daq } = &mut lines;
        node.host(word(), bytes(&any_bytes()), host, daq);
        node = opaque(node);
        node.daq(word(), from_daq, bytes(&any_bytes()), host, daq);
        node = opaque(node);
        node.poll(word(), host, daq);
        node.spent(word() as u32);
        node.answered(micros());
        sink((node.state(), node.driving(), node.poll_at(), node.last_word()));
        drain(host);
        drain(daq);
        lines = opaque(lines);
        if flag() {
            return;
        }
    }
}

fn host_node(path: &Path, knots: &[Knot]) {
    let Some(servo) = made(Servo::new(&servo_params())) else { return };
    let configure = Configure {
        run: word() as u16,
        config: word(),
        period_us: word() as u32,
        watchdog_us: word() as u32,
        safe_kind: word() as u8,
        hold_code: word() as u16,
        release_code: word() as u16,
        ramp_step: word() as u32,
        hold_periods: word() as u32,
    };
    let mut node = opaque(HostNode::new(servo, configure, word(), word()));
    let mut out = opaque(Outbox::default());
    let path = |tick| path.target(knots, tick);
    loop {
        node.discover(word() as u32, &mut out);
        node.set(word() as u16, word(), &mut out);
        node.configure(&mut out);
        node.arm(&mut out);
        node.ping(word() as u32, &mut out);
        node.receive(word(), bytes(&any_bytes()), &path, &mut |notice| sink(notice));
        node = opaque(node);
        node.poll(word(), &mut out, &mut |notice| sink(notice));
        sink((node.poll_at(), node.origin(), *node.counts(), *node.standing(), node.controller().copied()));
        sink(node.servo().period());
        drain(&mut out);
        match word() {
            0 => node.stop(StopReason::Done, &mut out),
            1 => node.stop(StopReason::Operator, &mut out),
            2 => node.disconnect(),
            3 => return,
            _ => {}
        }
        node = opaque(node);
    }
}

fn exchange() {
    let (host, daq) = (any_bytes(), any_bytes());
    let exchange =
        Exchange { time_ns: word(), lateness_us: word() as u32, host: bytes(&host), daq: bytes(&daq) };
    let mut buffer = any_bytes();
    sink(exchange.write(&mut buffer));
    let buffer = opaque(buffer);
    sink((Exchange::length(bytes(&buffer)), Exchange::read(bytes(&buffer))));
}
