//! The safe state: what the brake does when control has ended.
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
//! What runs is [`SafeCodes`], whole numbers only, so that controller and board go the same way.

use crate::error::require;
use crate::{Dac, DacCode, Micros, ParamError, Real};

/// Which safe state, and its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum SafeState<T = f64> {
    /// Holds the shaft with a voltage.
    Hold {
        /// Brake voltage, V.
        volts: T,
    },
    /// Brakes with a rising (or falling) voltage, then holds.
    Ramp {
        /// Rate, V/s.
        volts_per_s: T,
        /// Brake voltage at the end, V.
        volts: T,
    },
    /// Lets go.
    Release,
    /// Holds for a time, then lets go.
    HoldThenRelease {
        /// Brake voltage, V.
        volts: T,
        /// How long it holds, s.
        after: T,
    },
}

impl<T: Real> SafeState<T> {
    /// The same in another scalar, each number rounded to the nearest.
    #[must_use]
    pub fn cast<U: Real>(&self) -> SafeState<U> {
        let to = |x: T| U::from_f64(x.to_f64());
        match *self {
            SafeState::Hold { volts } => SafeState::Hold { volts: to(volts) },
            SafeState::Ramp { volts_per_s, volts } => {
                SafeState::Ramp { volts_per_s: to(volts_per_s), volts: to(volts) }
            }
            SafeState::Release => SafeState::Release,
            SafeState::HoldThenRelease { volts, after } => {
                SafeState::HoldThenRelease { volts: to(volts), after: to(after) }
            }
        }
    }

    /// The voltage that it holds with, V; none if it only lets go.
    #[must_use]
    pub fn holding_voltage(&self) -> Option<T> {
        match *self {
            SafeState::Hold { volts }
            | SafeState::Ramp { volts, .. }
            | SafeState::HoldThenRelease { volts, .. } => Some(volts),
            SafeState::Release => None,
        }
    }
}

/// How the codes of a safe state follow each other.
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
    /// How they follow each other.
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
    /// Checks a safe state against a converter and a sampling period.
    ///
    /// # Errors
    /// `volts` not above 0 or beyond the converter's range; `volts_per_s` or `after` not above
    /// 0, or so small or so large that a period or a code does not resolve it.
    pub fn new<T: Real>(state: &SafeState<T>, dac: &Dac<T>, period: Micros) -> Result<Self, ParamError<T>> {
        let seconds = period.period::<T>()?;
        let hold = |volts: T| {
            let top = dac.volts(DacCode(u16::MAX));
            let expected = "a voltage above 0 V that the converter reaches, V";
            require("volts", volts, volts > T::ZERO && volts <= top + dac.step(), expected)?;
            Ok(dac.code(volts))
        };
        let codes = SafeCodes { release: dac.code(T::ZERO), ..SafeCodes::default() };
        Ok(match *state {
            SafeState::Hold { volts } => SafeCodes { kind: SafeKind::Hold, hold: hold(volts)?, ..codes },
            SafeState::Ramp { volts_per_s, volts } => {
                let step = volts_per_s * seconds / dac.step() * T::from_i32(1 << 16);
                let fits = step >= T::ONE && step < T::from_f64(4e9);
                let expected = "a rate above 0 V/s that is a step of 2⁻¹⁶ to 60 000 codes per period";
                require("volts_per_s", volts_per_s, fits, expected)?;
                let ramp_step = step.floor().to_i64() as u32;
                SafeCodes { kind: SafeKind::Ramp, hold: hold(volts)?, ramp_step, ..codes }
            }
            SafeState::Release => SafeCodes { kind: SafeKind::Release, hold: codes.release, ..codes },
            SafeState::HoldThenRelease { volts, after } => {
                let periods = after / seconds + T::from_f64(0.5);
                let fits = periods >= T::ONE && periods < T::from_f64(4e9);
                require("after", after, fits, "a time of 1 to 4e9 periods, s")?;
                let hold_periods = periods.floor().to_i64() as u32;
                SafeCodes { kind: SafeKind::HoldThenRelease, hold: hold(volts)?, hold_periods, ..codes }
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
    pub fn begin(present: DacCode) -> SafeRun {
        SafeRun { level: u32::from(present.0) << 16, periods: 0 }
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

    /// Whether the brake has been let go.
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
        SafeCodes::new(&state, &Dac::new(&DacParams::default()).unwrap(), Micros(1000))
    }

    fn first(state: SafeState, present: u16, n: usize) -> std::vec::Vec<u16> {
        let codes = codes(state).unwrap();
        let mut run = SafeRun::begin(DacCode(present));
        (0..n).map(|_| run.next(&codes).0).collect()
    }

    #[test]
    fn hold_is_there_in_the_first_period() {
        assert_eq!(first(SafeState::Hold { volts: 5.0 }, 2048, 2), [3072, 3072]);
    }

    #[test]
    fn release_is_zero_volts_and_not_code_zero() {
        assert_eq!(first(SafeState::Release, 4000, 2), [2048, 2048]);
    }

    #[test]
    fn a_ramp_comes_from_either_side_and_ends_at_its_voltage() {
        // 1000 V/s are 1 V or 204.8 codes a period.
        let ramp = SafeState::Ramp { volts_per_s: 1000.0, volts: 2.0 };
        assert_eq!(first(ramp, 2048, 3), [2252, 2457, 2458]);
        assert_eq!(first(ramp, 2800, 3), [2595, 2458, 2458]);
    }

    #[test]
    fn holding_ends_after_its_time() {
        let state = SafeState::HoldThenRelease { volts: 5.0, after: 0.002 };
        assert_eq!(first(state, 2048, 4), [3072, 3072, 2048, 2048]);
    }

    #[test]
    fn bad_numbers_are_named() {
        for (bad, field) in [
            (SafeState::Hold { volts: 0.0 }, "volts"),
            (SafeState::Hold { volts: 10.5 }, "volts"),
            (SafeState::Hold { volts: f64::NAN }, "volts"),
            (SafeState::Ramp { volts_per_s: 0.0, volts: 5.0 }, "volts_per_s"),
            (SafeState::Ramp { volts_per_s: 1e12, volts: 5.0 }, "volts_per_s"),
            (SafeState::HoldThenRelease { volts: 5.0, after: 0.0 }, "after"),
        ] {
            assert_eq!(codes(bad).unwrap_err().field, field, "{bad:?}");
        }
    }
}
