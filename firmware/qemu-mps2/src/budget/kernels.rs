//! The functions that have a budget, each by itself and under its name: the calls of firmware that
//! uses the crates.

use clutch_core::law::LawState;
use clutch_core::{Counts, Servo, ServoState, Target};
use clutch_node::{BoardController, Outboxes};
use clutch_wire::{Actuate, Decoder, Frame, MAX_FRAME, Message, encode};

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
pub struct Axis {
    pub servo: Servo<f32>,
    pub state: ServoState<f32, LawState<f32>>,
    pub target: Target<f32>,
}

/// Counts in, the converter's code out.
#[inline(never)]
#[unsafe(no_mangle)]
pub extern "C" fn servo_tick(axis: &mut Axis, counts: i32) -> u16 {
    axis.servo.tick(&mut axis.state, Counts(counts), &axis.target).code.0
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
    session.outboxes.host.clear();
    session.outboxes.daq.clear();
    session.node.daq(session.now_ns, bytes.as_slice(), &mut session.outboxes);
}

/// A controller and its lines.
pub struct Session {
    pub node: BoardController,
    pub outboxes: Outboxes,
    pub now_ns: u64,
}
