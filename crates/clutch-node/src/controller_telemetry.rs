//! A cycle of the controller as a frame for the host, and back.

use crate::notice::CycleNotice;
use clutch_core::law::{Command, ControlLaw, LawTerms, Limit, MAX_TERMS, Terms, Tick};
use clutch_core::supervisor::{Arrival, Cause, Cycle, State};
use clutch_core::{DacCode, Micros, Servo, ServoOutput, Target};
use clutch_wire::{
    List, Sample, TELEMETRY_ANSWERED, TELEMETRY_ASKED, TELEMETRY_LIMIT, TELEMETRY_SUPERSEDED,
    TELEMETRY_TARGETED, Telemetry,
};

const LIMIT_SHIFT: u32 = TELEMETRY_LIMIT.trailing_zeros();
const _: () =
    assert!(Limit::ALL.len() - 1 <= (TELEMETRY_LIMIT >> LIMIT_SHIFT) as usize, "bits for each limit");

/// Two states in a byte: before and after.
pub(crate) fn states(from: State, to: State) -> u8 {
    (to as u8) << 4 | from as u8
}

/// Before and after; none for numbers that are no states.
pub(crate) fn both_states(states: u8) -> Option<(State, State)> {
    Some((State::from_u8(states & 0x0f)?, State::from_u8(states >> 4)?))
}

/// The telemetry that goes to the host.
pub(crate) fn frame(run: u16, number: u16, n: &CycleNotice<f32, LawTerms<f32>>) -> Telemetry {
    let (c, out) = (&n.cycle, n.cycle.output.unwrap_or_default());
    let flag = |on: bool, bit: u8| if on { bit } else { 0 };
    Telemetry {
        run,
        number,
        tick: c.tick as u32,
        sequence: n.sample.sequence,
        time_us: n.sample.time_us,
        counts: n.sample.counts,
        status: n.sample.status,
        flags: flag(n.superseded, TELEMETRY_SUPERSEDED)
            | flag(c.answer.is_some(), TELEMETRY_ANSWERED)
            | flag(c.output.is_some(), TELEMETRY_ASKED)
            | flag(c.target != Target::default(), TELEMETRY_TARGETED)
            | (out.command.limit as u8) << LIMIT_SHIFT,
        arrival: c.arrival as u8,
        states: states(c.from, c.state),
        cause: c.cause as u8,
        value: c.value.to_bits(),
        lateness_us: n.lateness.0,
        error: out.tick.error.to_bits(),
        error_rate: out.tick.error_rate.to_bits(),
        demand: out.command.voltage.to_bits(),
        code: c.code.0,
        cycles: n.cycles,
        // Nothing of a law that was not asked.
        terms: n.cycle.output.map_or(List::default(), |out| {
            List::new(out.command.terms.values().iter().map(|term| term.to_bits()))
        }),
    }
}

/// The notice that the host makes of it; `servo` is the board's, `target` the path's. None for numbers that mean
/// nothing: a state, an arrival or a cause that is none, terms of another law.
pub(crate) fn notice(
    m: &Telemetry,
    servo: &Servo<f32>,
    tick: u64,
    target: Target<f32>,
) -> Option<CycleNotice<f32, LawTerms<f32>>> {
    let (from, state) = both_states(m.states)?;
    let real = f32::from_bits;
    let (dac, asked) = (servo.dac(), m.flags & TELEMETRY_ASKED != 0);
    let (mut terms, names) = ([0.0; MAX_TERMS], servo.law().term_names());
    terms.iter_mut().zip(m.terms.numbers()).for_each(|(term, bits)| *term = real(*bits));
    if asked && m.terms.numbers().len() != names.len() {
        return None;
    }
    // The law's demand; the frame's code is the converter's, which may be another.
    let given = dac.code(real(m.demand));
    let target = if m.flags & TELEMETRY_TARGETED != 0 { target } else { Target::default() };
    let command = Command {
        voltage: real(m.demand),
        limit: Limit::from_u8((m.flags & TELEMETRY_LIMIT) >> LIMIT_SHIFT)?,
        terms: servo.law().terms_of(terms.get(..names.len())?),
    };
    let output = asked.then(|| ServoOutput {
        code: given,
        tick: Tick {
            error: real(m.error),
            error_rate: real(m.error_rate),
            target_velocity: target.velocity,
            target_acceleration: target.acceleration,
        },
        command,
    });
    Some(CycleNotice {
        sample: Sample {
            run: m.run,
            sequence: m.sequence,
            time_us: m.time_us,
            counts: m.counts,
            status: m.status,
        },
        superseded: m.flags & TELEMETRY_SUPERSEDED != 0,
        lateness: Micros(m.lateness_us),
        cycles: m.cycles,
        cycle: Cycle {
            tick,
            arrival: Arrival::from_u8(m.arrival)?,
            from,
            state,
            cause: Cause::from_u8(m.cause)?,
            value: real(m.value),
            answer: (m.flags & TELEMETRY_ANSWERED != 0).then_some(DacCode(m.code)),
            code: DacCode(m.code),
            target,
            output,
        },
    })
}
