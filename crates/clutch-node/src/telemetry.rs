//! A cycle of the controller as a frame for the host, and back.

use crate::notice::CycleNotice;
use clutch_core::law::{Command, CtcTerms, LawTerms, Limit, PdTerms, SmcTerms, Tick};
use clutch_core::supervisor::{Arrival, Cause, Cycle, State};
use clutch_core::{Dac, DacCode, Micros, ServoOutput, Target};
use clutch_wire::{
    Sample, TELEMETRY_ANSWERED, TELEMETRY_ASKED, TELEMETRY_LIMIT, TELEMETRY_SUPERSEDED, TELEMETRY_TARGETED,
    Telemetry,
};

const LIMIT_SHIFT: u32 = TELEMETRY_LIMIT.trailing_zeros();

/// Two states in a byte: before and after.
pub(crate) fn states(from: State, to: State) -> u8 {
    (to as u8) << 4 | from as u8
}

/// Before and after; none for numbers that are no states.
pub(crate) fn both_states(states: u8) -> Option<(State, State)> {
    Some((State::from_u8(states & 0x0f)?, State::from_u8(states >> 4)?))
}

/// What goes to the host.
pub(crate) fn frame(run: u16, number: u16, n: &CycleNotice<f32, LawTerms<f32>>) -> Telemetry {
    let (c, out) = (&n.cycle, n.cycle.output.unwrap_or_default());
    let flag = |on: bool, bit: u8| if on { bit } else { 0 };
    let limit = match out.command.limit {
        Limit::None => 0,
        Limit::Lowest => 1,
        Limit::Highest => 2,
        Limit::Invalid => 3,
    };
    let terms = match out.command.terms {
        LawTerms::Pd(t) => [t.proportional, t.derivative, 0.0],
        LawTerms::Ctc(t) => [t.accel_demand, t.friction_torque, t.mu],
        LawTerms::Smc(t) => [t.surface, t.switching, t.damping],
    };
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
            | limit << LIMIT_SHIFT,
        arrival: c.arrival as u8,
        states: states(c.from, c.state),
        cause: c.cause as u8,
        value: c.value.to_bits(),
        lateness_us: n.lateness.0,
        error: out.tick.error.to_bits(),
        error_rate: out.tick.error_rate.to_bits(),
        term_0: terms[0].to_bits(),
        term_1: terms[1].to_bits(),
        term_2: terms[2].to_bits(),
        demand: out.command.voltage.to_bits(),
        code: c.code.0,
        cycles: n.cycles,
    }
}

/// What the host makes of it; `kind` says which law it is, `path` gives the target. None for
/// numbers that mean nothing.
pub(crate) fn notice(
    m: &Telemetry,
    kind: &LawTerms<f32>,
    dac: &Dac<f32>,
    tick: u64,
    target: Target<f32>,
) -> Option<CycleNotice<f32, LawTerms<f32>>> {
    let (from, state) = both_states(m.states)?;
    let real = f32::from_bits;
    let [a, b, c] = [real(m.term_0), real(m.term_1), real(m.term_2)];
    // What the law asked for; the frame's code is what the converter has, which may be another.
    let given = dac.code(real(m.demand));
    let target = if m.flags & TELEMETRY_TARGETED != 0 { target } else { Target::default() };
    let output = (m.flags & TELEMETRY_ASKED != 0).then(|| ServoOutput {
        code: given,
        voltage: dac.volts(given),
        tick: Tick {
            error: real(m.error),
            error_rate: real(m.error_rate),
            target_velocity: target.velocity,
            target_acceleration: target.acceleration,
        },
        command: Command {
            voltage: real(m.demand),
            limit: match (m.flags & TELEMETRY_LIMIT) >> LIMIT_SHIFT {
                0 => Limit::None,
                1 => Limit::Lowest,
                2 => Limit::Highest,
                _ => Limit::Invalid,
            },
            terms: match kind {
                LawTerms::Pd(_) => LawTerms::Pd(PdTerms { proportional: a, derivative: b }),
                LawTerms::Ctc(_) => LawTerms::Ctc(CtcTerms { accel_demand: a, friction_torque: b, mu: c }),
                LawTerms::Smc(_) => LawTerms::Smc(SmcTerms { surface: a, switching: b, damping: c }),
            },
        },
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
