//! A shell around any law: far from the path the brake is full or off, whatever the law asks for.
//!
//! ```text
//! σ = f e + ė                                                     (13)
//! u = the highest voltage where σ ≤ −S, the lowest where σ ≥ S, the law's between
//! ```
//!
//! So the error has a bound that no law inside can break: `clutch certify --sampled` proves it.

use super::{Command, Limit, OutputParams, Surface, Tick};
use crate::params::{Range, Table};
use crate::{ActuatorKind, ParamError, Real};

crate::params! {
    /// A shell around the law, which gives the error a bound whatever the law is: with `σ = f e + ė` the brake is full where
    /// `σ ≤ −S` and off where `σ ≥ S`; with a motor either drives back. Off by default.
    pub struct ShellParams<T>: Default {
        /// Slope `f` of the shell's surface. The error stays within about `S/f` and a few counts.
        slope: T = 100.0, "slope_1_s" "f" PER_S, Range::above(0.0);
        /// Distance from the surface at which the shell acts; 0 switches the shell off.
        boundary: T = 0.0, "boundary_rad_s" "S" RAD_S, Range::at_least(0.0);
    }
}

/// A checked shell; none around the law by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shell<T>(Option<Edges<T>>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Edges<T> {
    slope: T,
    boundary: T,
    /// Voltage and its limit where the shaft is ahead, `σ ≤ −S`.
    ahead: (T, Limit),
    /// The same for a shaft that is behind, `σ ≥ S`.
    behind: (T, Limit),
}

impl<T: Real> Shell<T> {
    /// Checks the parameters; the shell gives the limits of the output, which are checked elsewhere.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(
        p: &ShellParams<T>,
        output: &OutputParams<T>,
        kind: ActuatorKind,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        if p.boundary <= T::ZERO {
            return Ok(Shell(None));
        }
        let (lowest, highest) = ((output.lowest, Limit::Lowest), (output.highest, Limit::Highest));
        let (ahead, behind) = if kind.drives_above_0() { (lowest, highest) } else { (highest, lowest) };
        Ok(Shell(Some(Edges { slope: p.slope, boundary: p.boundary, ahead, behind })))
    }

    /// A law's answer in, the shell's out. A demand that is no number is still reported as one.
    #[inline]
    #[must_use]
    pub fn around<Terms>(&self, command: Command<T, Terms>, tick: &Tick<T>) -> Command<T, Terms> {
        let Some(edges) = &self.0 else { return command };
        let surface = edges.slope * tick.error + tick.error_rate;
        let (voltage, limit) = if surface <= -edges.boundary {
            edges.ahead
        } else if surface >= edges.boundary {
            edges.behind
        } else {
            return command;
        };
        let limit = if command.limit == Limit::Invalid { Limit::Invalid } else { limit };
        Command { voltage, limit, ..command }
    }

    /// The surface outside of which the shell decides; none where it is off.
    #[must_use]
    pub(crate) fn surface(&self) -> Option<Surface<T>> {
        self.0.as_ref().map(|e| {
            let limits = (e.ahead.0.min(e.behind.0), e.ahead.0.max(e.behind.0));
            Surface { layer: e.boundary, ..Surface::affine(e.slope, limits, T::ONE) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Beside, ControlLaw, Law, LawParams, PdParams};
    use crate::{Counts, FixedCounts, PlantParams, Servo, ServoParams, Target};

    fn shell(boundary: f64, output: &OutputParams, kind: ActuatorKind) -> Shell<f64> {
        Shell::new(&ShellParams { slope: 100.0, boundary }, output, kind).unwrap()
    }

    fn at(surface: f64) -> Tick<f64> {
        Tick { error: surface / 200.0, error_rate: surface / 2.0, ..Tick::default() }
    }

    #[test]
    fn the_brake_is_full_where_the_shaft_leads_and_off_where_it_lags_and_the_laws_between() {
        let inner = Command::<f64, [f64; 0]> { voltage: 3.0, ..Command::default() };
        let limits = OutputParams::within(0.5, 9.0);
        let out = |surface, kind| {
            let c = shell(0.125, &limits, kind).around(inner, &at(surface));
            (c.voltage, c.limit)
        };
        for (surface, brake, motor) in [
            (-0.125, (9.0, Limit::Highest), (0.5, Limit::Lowest)),
            (-0.124, (3.0, Limit::None), (3.0, Limit::None)),
            (0.124, (3.0, Limit::None), (3.0, Limit::None)),
            (0.125, (0.5, Limit::Lowest), (9.0, Limit::Highest)),
            (f64::NAN, (3.0, Limit::None), (3.0, Limit::None)),
        ] {
            assert_eq!(out(surface, ActuatorKind::Brake), brake, "{surface}");
            assert_eq!(out(surface, ActuatorKind::Both), brake, "{surface}");
            assert_eq!(out(surface, ActuatorKind::Motor), motor, "{surface}");
        }
    }

    #[test]
    fn a_demand_that_is_no_number_is_told_outside_too() {
        let invalid = Command::<f64, [f64; 0]> { voltage: 4.0, limit: Limit::Invalid, terms: [] };
        let out = shell(0.1, &OutputParams::default(), ActuatorKind::Brake).around(invalid, &at(0.2));
        assert_eq!((out.voltage, out.limit), (0.0, Limit::Invalid));
    }

    #[test]
    fn a_servo_without_a_shell_has_the_bits_of_its_law_and_one_with_it_differs_outside_alone() {
        let paper = ServoParams::<f64>::paper(LawParams::Pd(PdParams { kp: 1000.0, kd: 3.0 }));
        let (law, plant) = (paper.law, PlantParams::default());
        let law = Law::<f64>::new(&law, &Beside::paper(&plant, &paper.output)).unwrap();
        let shelled = ServoParams { shell: ShellParams { slope: 100.0, boundary: 0.1 }, ..paper };
        let (plain, shelled) = (Servo::new(&paper).unwrap(), Servo::new(&shelled).unwrap());
        let goal = Target { position: FixedCounts::from_counts(0), velocity: 0.0, acceleration: 0.0 };
        let (mut a, mut b) = (plain.start(Counts(0), &goal, 0.0), shelled.start(Counts(0), &goal, 0.0));
        let mut seen = [0; 3];
        for k in 0..2000 {
            let counts = Counts((6.0 * (f64::from(k) * 0.05).sin()) as i32);
            let (x, y) = (plain.tick(&mut a, counts, &goal), shelled.tick(&mut b, counts, &goal));
            let mut own = law.start(&x.tick, 0.0);
            assert_eq!(x.command, law.update(&mut own, &x.tick));
            let surface = 100.0 * x.tick.error + x.tick.error_rate;
            let (place, volts) = match surface {
                s if s <= -0.1 => (0, 10.0),
                s if s >= 0.1 => (1, 0.0),
                _ => (2, x.command.voltage),
            };
            seen[place] += 1;
            assert_eq!(y.command.voltage, volts);
        }
        assert!(seen.iter().all(|n| *n > 50), "{seen:?}");
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let p = ShellParams::<f64> { slope: 0.0, boundary: 0.1 };
        let new = |p| Shell::new(&p, &OutputParams::default(), ActuatorKind::Brake);
        assert_eq!(new(p).unwrap_err().field(), "slope");
        assert_eq!(new(ShellParams { slope: 1.0, boundary: -0.1 }).unwrap_err().field(), "boundary");
        assert_eq!(new(ShellParams { slope: 1.0, boundary: f64::NAN }).unwrap_err().field(), "boundary");
    }
}
