//! A law of your own in the servo, beside two built-in ones, on a simple shaft.
//!
//! ```sh
//! cargo run --package clutch-core --example own_law
//! ```
#![allow(clippy::std_instead_of_core, clippy::float_cmp_const, reason = "it runs on the host")]

use clutch_core::law::{Command, ControlLaw, LawParams, Output, OutputParams, PdParams, SmcParams, Tick};
use clutch_core::reference::{Reference, ReferenceParams};
use clutch_core::{Counts, FixedCounts, Micros, ParamError, Plant, PlantParams, Servo, ServoParams};

/// The super-twisting law: `u = −(k √|σ| sgn σ + w)`, `ẇ = h sgn σ`, `σ = f e + ė`. Its integral finds the voltage that
/// carries the load; nobody has to know the friction.
struct SuperTwisting {
    /// `k`, V/√(rad/s).
    root: f64,
    /// `h T`, V: how far the integral moves in a period.
    step: f64,
    /// `f`, 1/s.
    slope: f64,
    output: Output<f64>,
}

impl ControlLaw<f64> for SuperTwisting {
    /// `−w`, V.
    type State = f64;
    type Terms = [f64; 3];
    const TERMS: &'static [&'static str] = &["surface_rad_s", "root_v", "integral_v"];

    fn start(&self, _: &Tick<f64>, applied: f64) -> f64 {
        applied // without a bump
    }

    fn update(&self, integral: &mut f64, tick: &Tick<f64>) -> Command<f64, [f64; 3]> {
        let surface = self.slope * tick.error + tick.error_rate;
        let root = -self.root * surface.abs().sqrt().copysign(surface);
        let (voltage, limit) = self.output.apply(&mut Default::default(), root + *integral);
        // It winds no further than the brake can follow.
        let moved = *integral - self.step.copysign(surface);
        *integral = moved.max(self.output.lowest()).min(self.output.highest());
        Command { voltage, limit, terms: [surface, root, *integral] }
    }
}

/// The shaft (1), by Euler's method in steps of 10 µs: enough to see a law at work. `clutch-sim` has an exact one.
struct Shaft {
    plant: Plant<f64>,
    angle: f64,
    velocity: f64,
    sticks: u32,
}

impl Shaft {
    fn advance(&mut self, volts: f64) {
        for _ in 0..100 {
            let drive = self.plant.params().drive_torque;
            if self.velocity == 0.0 && drive.abs() <= self.plant.break_away_torque(volts) {
                continue;
            }
            let next = self.velocity + 1e-5 * self.plant.acceleration(self.velocity, volts);
            // Friction stops a shaft and does not turn it round.
            let stops = next * self.velocity < 0.0;
            self.sticks += u32::from(stops);
            self.velocity = if stops { 0.0 } else { next };
            self.angle += 1e-5 * self.velocity;
        }
    }
}

/// Ten seconds at 2 °/s; the root mean square of the error in degrees, and how often the shaft stuck, after one second.
fn run<C: ControlLaw<f64>>(servo: &Servo<f64, C>) -> Result<(f64, u32), ParamError> {
    let encoder = servo.encoder();
    let path = ReferenceParams::ramp(2.0_f64.to_radians());
    let path = Reference::new(&path, FixedCounts(0), encoder, servo.period())?;
    let plant = Plant::new(&PlantParams::default())?;
    let volts = plant.holding_voltage_sliding();
    let mut shaft = Shaft { plant, angle: 0.0, velocity: path.at(0).velocity, sticks: 0 };
    let mut state = servo.start(Counts(0), &path.at(0), volts);
    let (mut squares, mut sticks) = (0.0, 0);
    for tick in 0..10_000 {
        let counts = (shaft.angle * encoder.counts_per_radian::<f64>()).floor();
        let out = servo.tick(&mut state, Counts(counts as i32), &path.at(tick));
        shaft.advance(servo.dac().volts(out.code));
        if tick < 1000 {
            sticks = shaft.sticks;
        } else {
            squares += out.tick.error * out.tick.error;
        }
    }
    Ok(((squares / 9000.0_f64).sqrt().to_degrees(), shaft.sticks - sticks))
}

fn built_in(law: LawParams) -> Result<(f64, u32), ParamError> {
    run(&Servo::new(&ServoParams::paper(law))?)
}

fn own() -> Result<(f64, u32), ParamError> {
    let output = Output::new(&OutputParams::default(), Micros(1000))?;
    let law = SuperTwisting { root: 2.0, step: 0.5e-3, slope: 70.0, output };
    // The parameters name a built-in law, which is not used.
    run(&Servo::with_law(&ServoParams::paper(LawParams::Pd(PdParams::default())), law)?)
}

fn main() -> Result<(), ParamError> {
    println!("law               rms error, °   sticks in 9 s");
    for (name, (error, sticks)) in [
        ("PD", built_in(LawParams::Pd(PdParams::default()))?),
        ("sliding mode", built_in(LawParams::Smc(SmcParams::default()))?),
        ("super-twisting", own()?),
    ] {
        println!("{name:16} {error:13.4} {sticks:15}");
    }
    Ok(())
}

#[test]
fn the_law_keeps_the_shaft_moving_where_the_built_in_ones_let_it_stick() -> Result<(), ParamError> {
    let (error, sticks) = own()?;
    assert!(error < 0.01 && sticks == 0, "{error}°, {sticks} sticks");
    assert!(built_in(LawParams::Pd(PdParams::default()))?.1 > 100);
    assert!(built_in(LawParams::Smc(SmcParams::default()))?.1 > 100);
    Ok(())
}
