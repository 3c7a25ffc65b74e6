//! The safe state: what brake or motor do when control has ended.
//!
//! | safe state | right when | converter |
//! |---|---|---|
//! | [`SafeState::Hold`] | a weight or spring drives the shaft | one voltage, at once |
//! | [`SafeState::Ramp`] | so, and a sudden stop would hurt | to that voltage at a rate |
//! | [`SafeState::Release`] | a hand drives it, and being held is the worse loss | lowest force, at once |
//! | [`SafeState::HoldThenRelease`] | a hand drives it towards something | holds, then lets go |
//!
//! There is no default, and "keep the last voltage" is not among them: the last voltage may be 0.
//! A brake that a motor presses lets go when its power fails, whatever is chosen here.
//!
//! With a motor, [`SafeState::Release`] takes its torque away: right where friction holds the load, or nothing does harm by
//! falling. To hold is to drive with one voltage, either sign or 0, with which friction stops the shaft and keeps it; there
//! is no position control in a safe state.
//!
//! The part that runs is [`SafeCodes`], whole numbers only, so that controller and board go the same way.

use crate::params::{Params, Range, Relation};
use crate::{ActuatorKind, Dac, DacCode, Micros, ParamError, Real};

crate::params! {
    /// Holds the shaft with a voltage, at once.
    pub struct SafeHold<T> {
        /// Voltage that stops and holds the shaft at the worst corner of the bounds.
        volts: T, "volts_v" "" V, Range::ANY;
    }
    relations(p) {
        /// The converter reaches the voltage.
        REACHED: volts, "a voltage that the converter reaches, from rig.dac.lowest_v to rig.dac.highest_v";
        /// A pad is pressed.
        PRESSES: volts, "a voltage above 0 with a brake (rig.actuator), which holds with nothing else";
    }
}

crate::params! {
    /// Brakes with a rising (or falling) voltage, then holds.
    pub struct SafeRamp<T> {
        /// Rate at which the voltage goes up or down from the present one.
        rate: T, "rate_v_s" "" V_S, Range::above(0.0);
        /// Voltage at the end, which stops and holds the shaft at the worst corner of the bounds.
        volts: T, "volts_v" "" V, Range::ANY;
    }
    relations(p) {
        /// A period's step is a number of codes.
        RESOLVED: rate, "a rate that is a step of 2⁻¹⁶ to 60 000 codes of rig.dac per sampling.period_us";
        /// The converter reaches the voltage.
        REACHED: volts, "a voltage that the converter reaches, from rig.dac.lowest_v to rig.dac.highest_v";
        /// A pad is pressed.
        PRESSES: volts, "a voltage above 0 with a brake (rig.actuator), which holds with nothing else";
    }
}

crate::params! {
    /// Holds the shaft with a voltage, at once, and after a time lets go.
    pub struct SafeHoldThenRelease<T> {
        /// Voltage that stops and holds the shaft at the worst corner of the bounds.
        volts: T, "volts_v" "" V, Range::ANY;
        /// Time of holding, after which it lets go.
        after: T, "after_s" "" S, Range::above(0.0);
    }
    relations(p) {
        /// The converter reaches the voltage.
        REACHED: volts, "a voltage that the converter reaches, from rig.dac.lowest_v to rig.dac.highest_v";
        /// A pad is pressed.
        PRESSES: volts, "a voltage above 0 with a brake (rig.actuator), which holds with nothing else";
        /// The time is a number of periods.
        COUNTED: after, "a time of 1 to 4e9 times sampling.period_us";
    }
}

crate::choice! {
    /// Safe state: what brake or motor do when control has ended.
    pub enum SafeState<T> {
        /// Holds the shaft with a voltage, at once.
        Hold(SafeHold<T>) = "hold",
        /// Brakes with a rising (or falling) voltage, then holds.
        Ramp(SafeRamp<T>) = "ramp",
        /// Lets go: 0 V, or the converter's lowest voltage above it.
        Release = "release",
        /// Holds the shaft with a voltage, at once, and after a time lets go.
        HoldThenRelease(SafeHoldThenRelease<T>) = "hold_then_release",
    }
}

impl<T: Real> SafeState<T> {
    /// Holds with `volts`, V.
    #[must_use]
    pub const fn hold(volts: T) -> Self {
        SafeState::Hold(SafeHold { volts })
    }

    /// Goes to `volts` at `rate`, V/s.
    #[must_use]
    pub const fn ramp(rate: T, volts: T) -> Self {
        SafeState::Ramp(SafeRamp { rate, volts })
    }

    /// Holds with `volts` for the time `after`, s, then lets go.
    #[must_use]
    pub const fn hold_then_release(volts: T, after: T) -> Self {
        SafeState::HoldThenRelease(SafeHoldThenRelease { volts, after })
    }

    /// The voltage that it holds with, V; none if it only lets go.
    #[must_use]
    pub fn holding_voltage(&self) -> Option<T> {
        match *self {
            SafeState::Hold(SafeHold { volts })
            | SafeState::Ramp(SafeRamp { volts, .. })
            | SafeState::HoldThenRelease(SafeHoldThenRelease { volts, .. }) => Some(volts),
            SafeState::Release => None,
        }
    }
}

/// The sequence of the codes of a safe state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SafeKind {
    /// `hold` at once.
    #[default]
    Hold,
    /// From the present code to `hold`, by `ramp_step` a period.
    Ramp,
    /// `release` at once.
    Release,
    /// `hold`, and after `hold_periods` `release`.
    HoldThenRelease,
}

/// A checked safe state in the converter's codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SafeCodes {
    /// Their sequence.
    pub kind: SafeKind,
    /// Code that holds.
    pub hold: DacCode,
    /// Code that lets go: 0 V, or the lowest voltage of the converter above it.
    pub release: DacCode,
    /// Step of the ramp, 2⁻¹⁶ codes per period.
    pub ramp_step: u32,
    /// Periods of holding before letting go.
    pub hold_periods: u32,
}

impl SafeCodes {
    /// Checks a safe state against a converter, a sampling period and an actuator.
    ///
    /// # Errors
    /// A voltage that the converter does not reach, or that is not above 0 where a brake is to hold; a rate or a time that
    /// is not above 0, or so small or so large that a period or a code does not resolve it.
    pub fn new<T: Real>(
        state: &SafeState<T>,
        dac: &Dac<T>,
        period: Micros,
        actuator: ActuatorKind,
    ) -> Result<Self, ParamError<T>> {
        let seconds = period.period::<T>()?;
        state.check()?;
        let hold = |volts: T, presses: Relation, reached: Relation| {
            presses.require(volts, actuator.drives_above_0() || volts > T::ZERO)?;
            let (bottom, top) = (dac.volts(DacCode(0)), dac.volts(DacCode(u16::MAX)));
            reached.require(volts, volts >= bottom && volts <= top + dac.step())?;
            Ok(dac.code(volts))
        };
        let codes = SafeCodes { release: dac.code(T::ZERO), ..SafeCodes::default() };
        Ok(match *state {
            SafeState::Hold(SafeHold { volts }) => SafeCodes {
                kind: SafeKind::Hold,
                hold: hold(volts, SafeHold::PRESSES, SafeHold::REACHED)?,
                ..codes
            },
            SafeState::Ramp(SafeRamp { rate, volts }) => {
                let step = rate * seconds / dac.step() * T::from_i32(1 << 16);
                SafeRamp::RESOLVED.require(rate, step >= T::ONE && step < T::from_f64(4e9))?;
                let ramp_step = step.floor().to_i64() as u32;
                let hold = hold(volts, SafeRamp::PRESSES, SafeRamp::REACHED)?;
                SafeCodes { kind: SafeKind::Ramp, hold, ramp_step, ..codes }
            }
            SafeState::Release => SafeCodes { kind: SafeKind::Release, hold: codes.release, ..codes },
            SafeState::HoldThenRelease(SafeHoldThenRelease { volts, after }) => {
                let periods = after / seconds + T::from_f64(0.5);
                let fits = periods >= T::ONE && periods < T::from_f64(4e9);
                SafeHoldThenRelease::COUNTED.require(after, fits)?;
                let hold_periods = periods.floor().to_i64() as u32;
                let hold = hold(volts, SafeHoldThenRelease::PRESSES, SafeHoldThenRelease::REACHED)?;
                SafeCodes { kind: SafeKind::HoldThenRelease, hold, hold_periods, ..codes }
            }
        })
    }
}

/// A safe state under way: one code a period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SafeRun {
    /// 2⁻¹⁶ codes.
    level: u32,
    periods: u32,
}

impl SafeRun {
    /// Begins at the code that the converter has now.
    #[must_use]
    pub const fn begin(present: DacCode) -> SafeRun {
        SafeRun { level: (present.0 as u32) << 16, periods: 0 }
    }

    /// The code for the next period; the first call already gives the safe state's own.
    pub fn next(&mut self, codes: &SafeCodes) -> DacCode {
        let hold = u32::from(codes.hold.0) << 16;
        let code = match codes.kind {
            SafeKind::Hold => codes.hold,
            SafeKind::Release => codes.release,
            SafeKind::HoldThenRelease if self.released(codes) => codes.release,
            SafeKind::HoldThenRelease => codes.hold,
            SafeKind::Ramp => {
                self.level = if self.level < hold {
                    self.level.saturating_add(codes.ramp_step).min(hold)
                } else {
                    self.level.saturating_sub(codes.ramp_step).max(hold)
                };
                DacCode((self.level >> 16) as u16)
            }
        };
        self.periods = self.periods.saturating_add(1);
        code
    }

    /// True if the brake has been let go.
    #[must_use]
    pub fn released(&self, codes: &SafeCodes) -> bool {
        match codes.kind {
            SafeKind::Hold | SafeKind::Ramp => false,
            SafeKind::Release => true,
            SafeKind::HoldThenRelease => self.periods >= codes.hold_periods,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DacParams;

    fn codes(state: SafeState) -> Result<SafeCodes, ParamError> {
        SafeCodes::new(&state, &Dac::new(&DacParams::default()).unwrap(), Micros(1000), ActuatorKind::Brake)
    }

    fn first(state: SafeState, present: u16, n: usize) -> std::vec::Vec<u16> {
        let codes = codes(state).unwrap();
        let mut run = SafeRun::begin(DacCode(present));
        (0..n).map(|_| run.next(&codes).0).collect()
    }

    #[test]
    fn hold_is_there_in_the_first_period() {
        assert_eq!(first(SafeState::hold(5.0), 2048, 2), [3072, 3072]);
    }

    #[test]
    fn release_is_zero_volts_and_not_code_zero() {
        assert_eq!(first(SafeState::Release, 4000, 2), [2048, 2048]);
    }

    #[test]
    fn a_ramp_comes_from_either_side_and_ends_at_its_voltage() {
        // 1000 V/s are 1 V or 204.8 codes a period.
        let ramp = SafeState::ramp(1000.0, 2.0);
        assert_eq!(first(ramp, 2048, 3), [2252, 2457, 2458]);
        assert_eq!(first(ramp, 2800, 3), [2595, 2458, 2458]);
    }

    #[test]
    fn holding_ends_after_its_time() {
        let state = SafeState::hold_then_release(5.0, 0.002);
        assert_eq!(first(state, 2048, 4), [3072, 3072, 2048, 2048]);
    }

    #[test]
    fn bad_numbers_are_named() {
        for (bad, field) in [
            (SafeState::hold(0.0), "volts"),
            (SafeState::hold(10.5), "volts"),
            (SafeState::hold(f64::NAN), "volts"),
            (SafeState::ramp(0.0, 5.0), "rate"),
            (SafeState::ramp(1e12, 5.0), "rate"),
            (SafeState::hold_then_release(5.0, 0.0), "after"),
            (SafeState::hold_then_release(5.0, 0.000_4), "after"),
        ] {
            assert_eq!(codes(bad).unwrap_err().field(), field, "{bad:?}");
        }
    }

    #[test]
    fn what_holds_has_a_voltage_and_what_lets_go_has_none() {
        for state in
            [SafeState::hold(5.0), SafeState::ramp(100.0, 5.0), SafeState::hold_then_release(5.0, 1.0)]
        {
            assert_eq!(state.holding_voltage(), Some(5.0));
        }
        assert_eq!(SafeState::<f64>::Release.holding_voltage(), None);
    }

    #[test]
    fn a_motor_may_hold_with_either_sign_and_within_its_converter_only() {
        let dac = Dac::new(&DacParams::default()).unwrap();
        let codes = |volts| SafeCodes::new(&SafeState::hold(volts), &dac, Micros(1000), ActuatorKind::Motor);
        assert_eq!(codes(-5.0).unwrap().hold, DacCode(1024));
        assert_eq!(codes(0.0).unwrap().hold, DacCode(2048));
        for beyond in [-10.01, 10.01] {
            assert_eq!(codes(beyond).unwrap_err().field(), "volts");
        }
    }

    #[test]
    fn a_ramp_has_steps_that_a_code_of_16_bits_and_16_more_can_tell() {
        // One code is 20 V/4096: the least step is 2⁻¹⁶ of it in a period.
        let least = 20.0 / 4096.0 / 65_536.0 / 1e-3;
        assert_eq!(codes(SafeState::ramp(1.001 * least, 5.0)).unwrap().ramp_step, 1);
        assert_eq!(codes(SafeState::ramp(0.999 * least, 5.0)).unwrap_err().field(), "rate");
        assert_eq!(codes(SafeState::hold_then_release(5.0, 5e6)).unwrap_err().field(), "after");
    }
}
