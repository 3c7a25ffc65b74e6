//! A friction laboratory: four experiments that show a friction model as its literature does.
//!
//! | experiment | what is done | what shows |
//! |---|---|---|
//! | steady sliding | constant velocities | the curve `μ(θ̇)` |
//! | pre-sliding | a slow motion to and fro over the deflection at which the bristles give way | the spring before the break-away, its hysteresis |
//! | lag | a velocity that swings without a reversal | friction that is behind its steady value |
//! | break-away | the paper's shaft at rest, a torque that grows at a rate | the largest coefficient, at which it breaks away |
//!
//! A friction without bristles has no spring and no lag: its pre-sliding loop is a step, and its lag a line on its curve.

use crate::drive::{Drive, DriveParams, RampDrive};
use crate::engine::{Bristle, DormandPrince, Engine, EngineError, EventKind, Input, Model, Shaft, Volts};
use clutch_core::friction::{Bend, Bristles, FrictionModel, FrictionParams};
use clutch_core::{ActuatorParams, ParamError, Plant, PlantParams};

/// Normal force of the break-away, as torque per unit of μ, N m: with it the paper's weight is just held.
const NORMAL: f64 = 0.23544;
/// Points of a curve.
const POINTS: usize = 200;
/// Steps of the torque up to a break-away and as far again.
const STEPS: u32 = 4000;

/// The results: pairs of the quantity that was set and the one that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Lab {
    /// Velocity, rad/s, and coefficient of steady sliding.
    pub steady: Vec<(f64, f64)>,
    /// Angle, rad, and coefficient, to and fro twice.
    pub pre_sliding: Vec<(f64, f64)>,
    /// Velocity, rad/s, and coefficient, of the last of some swings.
    pub lag: Vec<(f64, f64)>,
    /// Rate at which the torque grows, N m/s, and the largest coefficient of the friction, at the break-away.
    pub break_away: Vec<(f64, f64)>,
}

/// An experiment could not be done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LabError {
    /// A parameter of the friction is out of range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The break-away could not be followed.
    #[error(transparent)]
    Motion(#[from] EngineError),
}

/// Does the four experiments.
///
/// # Errors
/// A parameter out of range; a motion that cannot be followed.
pub fn examine(params: &FrictionParams) -> Result<Lab, LabError> {
    let plant = PlantParams {
        actuator: ActuatorParams::brake(NORMAL),
        drive_torque: 0.0,
        friction: *params,
        ..PlantParams::default()
    };
    let model = Model { plant: Plant::new(&plant)?, ripple: None };
    let (friction, bristles) = (model.plant.friction(), model.plant.friction().bristles());
    // The velocity at which the drop happens, or one at which something shows.
    let drops = friction.level(0.0) > friction.sliding();
    let slow = match (bristles, friction.exponential()) {
        (Some(bristles), _) if drops => bristles.stribeck_velocity(),
        (None, Some(curve)) if drops => curve.velocity,
        _ => 0.001,
    };
    let deflection = bristles.map_or(1e-4, |b| b.deflection());
    let steady = (0..POINTS)
        .map(|i| slow * libm::pow(10.0, -2.0 + 5.0 * i as f64 / (POINTS - 1) as f64))
        .map(|velocity| (velocity, friction.level(velocity)))
        .collect();
    let mut probe = Probe { friction, bristles, bend: Bend::none() };
    let pre_sliding = probe.pre_sliding(deflection, slow);
    probe.bend = bristles.map_or(Bend::none(), |b| b.steady(slow));
    let lag = probe.lag(slow, deflection);
    // Faster ones show more of the inertia than of the friction.
    let rates = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1];
    let break_away =
        rates.iter().map(|rate| Ok((*rate, break_away(&model, *rate)?))).collect::<Result<_, LabError>>()?;
    Ok(Lab { steady, pre_sliding, lag, break_away })
}

/// A friction whose velocity is prescribed.
struct Probe<'a> {
    friction: &'a clutch_core::Friction<f64>,
    bristles: Option<Bristles<f64>>,
    bend: Bend<f64>,
}

impl Probe<'_> {
    /// The coefficient at the end of a way at a velocity.
    fn go(&mut self, velocity: f64, seconds: f64) -> f64 {
        let Some(bristles) = self.bristles else { return self.friction.coefficient(velocity) };
        // Steps that bend the bristles by a thousandth of what they bear.
        let least = 1e-3 * bristles.deflection();
        let steps = (velocity.abs() * seconds / least).clamp(4.0, 1e5) as u32;
        let dt = seconds / f64::from(steps);
        for _ in 0..steps {
            // Each element goes its own way, `ż = f(z)`: an exponential step is exact where `f` is straight, however long the step
            // is against the time in which a sliding element comes to its share.
            let (mut moved, mut beside) = (self.bend, self.bend);
            beside.each.iter_mut().for_each(|z| *z += 1e-3 * least);
            let rates = bristles.rate(&self.bend, velocity);
            let slopes = bristles.rate(&beside, velocity).into_iter().zip(rates);
            let slopes = slopes.map(|(there, here)| (there - here) / (1e-3 * least));
            for ((z, rate), slope) in moved.each.iter_mut().zip(rates).zip(slopes) {
                let x = slope * dt;
                *z += dt * rate * if x.abs() > 1e-9 { libm::expm1(x) / x } else { 1.0 };
            }
            self.bend = bristles.settled(&moved, velocity);
        }
        bristles.coefficient(&self.bend, &bristles.rate(&self.bend, velocity))
    }

    /// From rest to one side, to the other, and again.
    fn pre_sliding(&mut self, amplitude: f64, velocity: f64) -> Vec<(f64, f64)> {
        let step = amplitude / (POINTS / 4) as f64;
        let (mut angle, mut out) = (0.0, vec![(0.0, 0.0)]);
        for (way, steps) in [(1.0, POINTS / 4), (-1.0, POINTS / 2), (1.0, POINTS / 2), (-1.0, POINTS / 2)] {
            for _ in 0..steps {
                // So slow that the bristles' damping shows nothing.
                let mu = self.go(way * 1e-3 * velocity, step / (1e-3 * velocity));
                angle += way * step;
                out.push((angle, mu));
            }
        }
        out
    }

    /// A velocity between a tenth and twice of `velocity`, over ways of some deflections.
    fn lag(&mut self, velocity: f64, deflection: f64) -> Vec<(f64, f64)> {
        let period = 20.0 * deflection / velocity;
        let dt = period / POINTS as f64;
        let mut out = Vec::new();
        for i in 0..=4 * POINTS {
            let phase = core::f64::consts::TAU * i as f64 / POINTS as f64;
            let now = velocity * (1.05 + 0.95 * libm::sin(phase));
            let mu = self.go(now, dt);
            if i >= 3 * POINTS {
                out.push((now, mu));
            }
        }
        out
    }
}

/// The largest coefficient of the friction of a shaft at rest under a torque that grows at a rate, N m/s: that at which it
/// breaks away.
fn break_away(model: &Model, rate: f64) -> Result<f64, LabError> {
    let drive = Drive::new(&DriveParams::Ramp(RampDrive { from: 0.0, rate }), 0)?;
    let (mut shaft, mut events) = (Shaft::new(0.0, 0.0), Vec::new());
    let bristles = model.plant.friction().bristles();
    let mut engine: Box<dyn Engine> =
        if bristles.is_some() { Box::new(Bristle::default()) } else { Box::new(DormandPrince::default()) };
    // Until twice of what it holds.
    let duration = 2.0 * model.break_away_torque(0.0, 1.0) / rate / f64::from(STEPS);
    let mut most = 0.0_f64;
    for i in 0..STEPS {
        let time = f64::from(i) * duration;
        let input = Input { time, duration, origin: 0.0, volts: Volts::Held(1.0), drive: &drive, noise: 0.0 };
        engine.advance(model, &input, &mut shaft, &mut events)?;
        match bristles {
            // Torque beyond what the friction bears accelerates the shaft.
            Some(bristles) => {
                let rate = bristles.rate(&shaft.bend, shaft.velocity);
                most = most.max(bristles.coefficient(&shaft.bend, &rate));
            }
            None => {
                if let Some(away) = events.iter().find(|e| e.kind == EventKind::BreakAway) {
                    return Ok(away.torque / NORMAL);
                }
            }
        }
    }
    Ok(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_core::friction::{
        CoulombParams, DahlParams, ElastoPlasticParams, LugreParams, MaxwellParams, StribeckParams,
    };

    #[test]
    fn friction_of_the_velocity_alone_has_no_spring_no_lag_and_one_break_away() {
        for params in [FrictionParams::from(StribeckParams::default()), CoulombParams::default().into()] {
            let lab = examine(&params).unwrap();
            assert!(lab.break_away.iter().all(|(_, mu)| (mu - 0.2).abs() < 1e-3), "{:?}", lab.break_away);
            let friction = clutch_core::Friction::build(&params).unwrap();
            assert!(lab.lag.iter().all(|(v, mu)| *mu == friction.coefficient(*v)));
            assert!(lab.pre_sliding.iter().skip(1).all(|(_, mu)| mu.abs() > 0.14));
        }
    }

    #[test]
    fn no_model_bears_more_than_its_friction_at_rest_before_it_slides() {
        let elements = |attraction| MaxwellParams { attraction, ..MaxwellParams::default() }.into();
        let all: [FrictionParams; 8] = [
            StribeckParams::default().into(),
            CoulombParams::default().into(),
            LugreParams::default().into(),
            DahlParams::default().into(),
            ElastoPlasticParams::default().into(),
            elements(1.0),
            elements(50.0),
            elements(1e5),
        ];
        for params in all {
            let lab = examine(&params).unwrap();
            let most = lab.pre_sliding.iter().fold(0.0_f64, |most, (_, mu)| most.max(mu.abs()));
            let friction = clutch_core::Friction::build(&params).unwrap();
            // Coulomb's has its sliding level at any velocity; Dahl's comes near it alone.
            assert!(
                most > 0.7 * friction.sliding() && most < 1.001 * friction.at_rest(),
                "{params:?}: {most}"
            );
        }
    }

    #[test]
    fn break_aways_are_those_of_their_equations() {
        let lab = |params: FrictionParams| examine(&params).unwrap().break_away;
        // By SciPy's Radau method over the equations of LuGre's paper, tolerance 1e-9.
        let found = lab(LugreParams::default().into());
        for (rate, mu) in LUGRE {
            let (_, found) = found.iter().find(|(r, _)| *r == rate).unwrap();
            assert!((found - mu).abs() < 2e-5, "{rate} N m/s: {found}, {mu}");
        }
        // Dahl's bristles never bear more than they do sliding, and come near it.
        let dahl = lab(DahlParams::default().into());
        assert!(dahl.iter().all(|(_, mu)| (*mu - 0.15).abs() < 1e-9), "{dahl:?}");
        // Stiff ones break away as Coulomb's friction with a level at rest does.
        let stiff = LugreParams { stiffness: 1e9, ..LugreParams::default() };
        let stiff = lab(stiff.into());
        assert!((stiff[0].1 - 0.2).abs() < 2e-4, "{stiff:?}");
    }

    /// Rate of torque, N m/s, and first maximum of the coefficient, LuGre's defaults on the paper's shaft.
    const LUGRE: [(f64, f64); 4] =
        [(1e-4, 0.199_207), (1e-3, 0.196_342), (1e-2, 0.183_584), (0.1, 0.150_000_6)];

    #[test]
    fn bristles_have_a_spring_a_lag_and_a_break_away_that_falls_with_the_rate() {
        for params in [FrictionParams::from(LugreParams::default()), ElastoPlasticParams::default().into()] {
            let lab = examine(&params).unwrap();
            let (angle, mu) = lab.pre_sliding[1];
            assert!((mu / angle / 2000.0 - 1.0).abs() < 0.05, "{mu} at {angle} rad");
            let (slow, fast) = (lab.break_away[0].1, lab.break_away[6].1);
            assert!(slow > fast && slow < 0.2 && fast >= 0.15 - 1e-5, "{:?}", lab.break_away);
            // As the velocity passes its mean upwards and downwards.
            let (up, down) = (lab.lag[0].1, lab.lag[POINTS / 2].1);
            assert!(up > down, "{up} on the way up, {down} on the way down");
        }
    }
}
