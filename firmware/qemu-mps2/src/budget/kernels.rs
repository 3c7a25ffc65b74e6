//! The functions that have a budget, each by itself and under its name: the calls of firmware that
//! uses the crates.

use clutch_core::law::{ControlLaw, Ctc, Law, Pd, Pid, Smc};
use clutch_core::{Counts, DacCode, Servo, ServoState, Target};
use clutch_node::{BoardController, Hardware, Lines, OneChip};
use clutch_wire::{Actuate, Decoder, Frame, MAX_FRAME, Message, encode};
use cortex_m::peripheral::SYST;

/// Bytes of one frame, as they come over the line: one delimiter, at their end.
#[derive(Clone, Copy)]
pub struct Bytes {
    bytes: [u8; MAX_FRAME],
    length: usize,
}

impl Bytes {
    /// Makes the bytes of a message.
    pub fn of(message: &Message) -> Bytes {
        let mut bytes = [0; MAX_FRAME];
        let frame = encode(message);
        bytes.iter_mut().zip(frame.as_bytes()).for_each(|(to, from)| *to = *from);
        Bytes { bytes, length: frame.as_bytes().len() }
    }

    /// The same with one byte flipped, but not into another delimiter.
    pub fn corrupted(mut self, place: usize, flip: u8) -> Bytes {
        let body = self.bytes.get_mut(..self.length.saturating_sub(1)).unwrap_or_default();
        if let Some(byte) = body.get_mut(place) {
            *byte = if *byte == flip { flip } else { *byte ^ flip };
        }
        self
    }

    fn as_slice(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

/// A call and a return, to see that the meter counts right.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn nothing() {}

macro_rules! steps {
    ($($module:ident $law:ident;)+) => {$(
        pub mod $module {
            use clutch_core::law::{$law, ControlLaw, Tick};

            /// A period of the law: an errors' pair in, volts out.
            #[inline(never)]
            #[unsafe(export_name = concat!("step_", stringify!($module)))]
            pub extern "C" fn step(
                law: &$law<f32>,
                state: &mut <$law<f32> as ControlLaw<f32>>::State,
                tick: &Tick<f32>,
            ) -> f32 {
                law.update(state, tick).voltage
            }
        }
    )+};
}
clutch_core::each_law!(steps);

/// A servo, its state, and its target.
pub struct Axis<C: ControlLaw<f32> = Law<f32>> {
    pub servo: Servo<f32, C>,
    pub state: ServoState<f32, C::State>,
    pub target: Target<f32>,
}

/// Counts in, the converter's code out.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn servo_tick(axis: &mut Axis, counts: i32) -> u16 {
    axis.servo.tick(&mut axis.state, Counts(counts), &axis.target).code.0
}

macro_rules! servos {
    ($($function:ident $law:ident;)+) => {$(
        /// The same around one law, which is chosen when the image is built.
        #[inline(never)]
        #[unsafe(no_mangle)]
        pub extern "C" fn $function(axis: &mut Axis<$law<f32>>, counts: i32) -> u16 {
            axis.servo.tick(&mut axis.state, Counts(counts), &axis.target).code.0
        }
    )+};
}
servos! {
    servo_pd Pd;
    servo_ctc Ctc;
    servo_smc Smc;
    servo_pid Pid;
}

/// The bytes of one frame in, its message out.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn decode_sample(decoder: &mut Decoder, bytes: &Bytes, message: &mut Option<Message>) {
    for byte in bytes.as_slice() {
        if let Some(end) = decoder.push(*byte) {
            if let Ok(whole) = end {
                *message = Some(whole);
            }
            return;
        }
    }
}

/// A code in, the bytes of its frame out.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn encode_actuate(answer: &Actuate, frame: &mut Option<Frame>) {
    *frame = Some(encode(&Message::Actuate(*answer)));
}

/// A frame of encoder and converter in, those for them and for the host out: a period of the controller.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn whole_tick(session: &mut Session, bytes: &Bytes) {
    session.lines.host.clear();
    session.lines.daq.clear();
    let Session { node, lines: Lines { host, daq, from_daq }, now_ns } = session;
    node.daq(*now_ns, from_daq, bytes.as_slice(), host, daq);
}

/// A controller and its lines.
pub struct Session {
    pub node: BoardController,
    pub lines: Lines,
    pub now_ns: u64,
}

/// A chip that is controller and board, and its pins: a period is `clutch_node::tick`.
pub struct Chip {
    pub node: OneChip,
    pub pins: Pins,
}

/// Encoder, converter and line of a chip, in memory.
pub struct Pins {
    pub now_us: u64,
    pub counts: i32,
    pub encoder_fault: bool,
    pub converter_fault: bool,
    pub line: [u8; 512],
    /// Bytes of the line that are used.
    pub used: usize,
    /// The timer as the period began, and as its code was out, not counting the same code once more; it counts downwards.
    pub begun: u32,
    pub out: u32,
    /// The code that was put out in this period; none yet.
    pub told: Option<u16>,
}

/// The converter is written: the end of the path from a sample to its code.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn converter_written(pins: &mut Pins, code: u16) {
    if pins.told != Some(code) {
        pins.told = Some(code);
        // SAFETY: a register that may be read at any time.
        pins.out = unsafe { (*SYST::PTR).cvr.read() };
    }
}

impl Hardware for Pins {
    fn now_us(&self) -> u64 {
        self.now_us
    }
    fn counts(&mut self) -> Counts {
        // SAFETY: as above.
        self.begun = unsafe { (*SYST::PTR).cvr.read() };
        self.told = None;
        Counts(self.counts)
    }
    fn encoder_fault(&self) -> bool {
        self.encoder_fault
    }
    fn converter_fault(&self) -> bool {
        self.converter_fault
    }
    fn put_out(&mut self, code: DacCode) {
        converter_written(self, code.0);
    }
    fn feed_watchdog(&mut self) {}
    fn send(&mut self, frames: &[u8]) -> bool {
        match self.line.get_mut(..frames.len()) {
            Some(line) => line.copy_from_slice(frames),
            None => return false,
        }
        self.used = frames.len();
        true
    }
    fn cycles(&self) -> u32 {
        self.out
    }
}

/// A whole period of a chip.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn chip_period(chip: &mut Chip) {
    clutch_node::tick(&mut chip.node, &mut chip.pins);
}
