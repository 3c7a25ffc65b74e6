//! The experiment on a motor axis: to and fro within a travel and a rate that the user consents to.
//!
//! | part | law | shows |
//! |---|---|---|
//! | `crawl` | a soft PD far below the rate at which it sticks, both ways | break-aways under a voltage that rises slowly |
//! | `hops` | PD on a path of steps, both ways | the shaft sets off and is caught: J/K, delay |
//! | `to_and_fro_…` | PID, told J/K by the hops | friction at even rates both ways, its ripple |

use super::hops;
use crate::experiment::{ExperimentError, Runs, checked, part, table};
use crate::recording::Recording;
use clutch_core::Plant;
use clutch_core::friction::FrictionModel as _;
use clutch_sim::{Scenario, ScenarioError};
use toml::Value;

/// The parts of the experiment, and its limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Programme {
    /// Way to and fro, °.
    pub travel_deg: f64,
    /// Highest rate, °/s.
    pub fastest_deg_s: f64,
    /// Hops one way; as many go back.
    pub hops: u32,
}

/// About a minute.
impl Default for Programme {
    fn default() -> Self {
        Programme { travel_deg: 20.0, fastest_deg_s: 60.0, hops: 12 }
    }
}

/// Least and most of the way, °: a ride at 5 °/s needs 8° to be even.
pub const TRAVELS_DEG: (f64, f64) = (10.0, 3600.0);
/// Least and most of the highest rate, °/s: C/K needs one well above 5.
pub const FASTEST_DEG_S: (f64, f64) = (15.0, 3600.0);
/// Rate of the crawl, °/s, its way, °, and where it begins: within the rides, which show friction there.
const CRAWL_DEG_S: f64 = 0.5;
const CRAWL_DEG: f64 = 5.0;
const CRAWL_FROM_DEG: f64 = 2.0;
/// Time in which the crawl's voltage rises to what is believed to break the shaft away, s.
const RISE_S: f64 = 1.2;
/// Rate on ways between, °/s, and rests at their ends, s.
const WAY_DEG_S: f64 = 5.0;
const REST_S: f64 = 0.3;
/// Volts of a hop, over those that are believed to break the shaft away; its speed, as a share of the fastest; time in which
/// its step rises, and from one to the next, s.
const HOP_VOLTS: f64 = 2.0;
const HOP_SPEED: f64 = 0.7;
const HOP_RISE_S: f64 = 0.01;
const HOP_PACE_S: f64 = 0.25;
/// Share of the output's span that a hop may take: a law at a limit shows nothing.
const MOST_VOLTS: f64 = 0.6;
/// Bandwidth of the PID of the rides, rad/s.
const BANDWIDTH: f64 = 60.0;

/// Ways at even rates, °/s, each with its way, °, and the times that it is made.
impl Programme {
    fn rides(&self) -> Vec<(f64, f64, u32)> {
        let way = self.travel_deg;
        let slow = [(1.0, 6.0, 1), (2.0, 8.0, 1), (5.0, way, 1), (self.fastest_deg_s / 3.0, way, 2)];
        let mut rides: Vec<_> = slow
            .into_iter()
            .map(|(rate, most, n)| (f64::min(rate, self.fastest_deg_s), f64::min(most, way), n))
            .collect();
        rides.push((self.fastest_deg_s, way, 4));
        rides
    }

    /// Its length, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        let rides: f64 = self.rides().into_iter().map(|ride| length(&to_and_fro(ride))).sum();
        length(&crawl_path()) + length(&self.hop_path(1.0)) + rides
    }

    fn hop_path(&self, step: f64) -> Vec<(f64, f64)> {
        let mut points = vec![(0.0, 0.0)];
        let run = ((self.travel_deg / step) as u32).clamp(1, self.hops);
        let (mut time, mut angle) = (0.0, 0.0);
        for k in 0..2 * self.hops {
            time += HOP_PACE_S;
            points.push((time, angle));
            angle += if (k / run).is_multiple_of(2) { step } else { -step };
            points.push((time + HOP_RISE_S, angle));
        }
        points.push((time + HOP_PACE_S, angle));
        points
    }

    /// The plan, a line for each part: what it does, for how long, and how far.
    #[must_use]
    pub fn plan(&self) -> Vec<String> {
        let mut lines = vec![
            format!(
                "crawl       {CRAWL_DEG_S} °/s both ways over {CRAWL_DEG}° under a soft PD, it sticks and slips, {:.0} s",
                length(&crawl_path())
            ),
            format!(
                "hops        {} steps under PD, {:.0} s; about {:.0} °/s at most, by the model's inertia",
                2 * self.hops,
                length(&self.hop_path(1.0)),
                HOP_SPEED * self.fastest_deg_s
            ),
        ];
        lines.extend(self.rides().into_iter().map(|ride| {
            format!(
                "to and fro  {} °/s over {}° under PID, {} ×, {:.1} s",
                ride.0,
                ride.1,
                ride.2,
                length(&to_and_fro(ride))
            )
        }));
        lines.push(format!(
            "limits      paths within {}° forwards of where it rests, at {} °/s at most; a part ends by any check",
            self.travel_deg, self.fastest_deg_s
        ));
        lines
    }

    /// # Errors
    /// A limit out of its range.
    pub fn check(&self) -> Result<(), ExperimentError> {
        let limits = [
            ("travel", self.travel_deg, TRAVELS_DEG, "°"),
            ("fastest", self.fastest_deg_s, FASTEST_DEG_S, "°/s"),
        ];
        match limits.into_iter().find(|(_, x, (least, most), _)| !(*least..=*most).contains(x)) {
            Some((key, value, (least, most), unit)) => {
                Err(ExperimentError::Limit { key, value, least, most, unit })
            }
            None => Ok(()),
        }
    }
}

fn length(path: &[(f64, f64)]) -> f64 {
    path.last().map_or(0.0, |p| p.0)
}

/// Points of time and angle, from ways at a rate and rests.
fn ways(ways: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut points = vec![(0.0, 0.0)];
    let (mut time, mut angle) = (0.0, 0.0);
    for &(to, rate) in ways {
        time += REST_S;
        points.push((time, angle));
        time += f64::abs(to - angle) / rate;
        angle = to;
        points.push((time, angle));
    }
    points.push((time + REST_S, angle));
    points
}

fn crawl_path() -> Vec<(f64, f64)> {
    let end = CRAWL_FROM_DEG + CRAWL_DEG;
    ways(&[(CRAWL_FROM_DEG, WAY_DEG_S), (end, CRAWL_DEG_S), (CRAWL_FROM_DEG, CRAWL_DEG_S), (0.0, WAY_DEG_S)])
}

fn to_and_fro((rate, way, times): (f64, f64, u32)) -> Vec<(f64, f64)> {
    let once = [(way, rate), (0.0, rate)];
    ways(&once.repeat(times as usize))
}

/// Runs the programme, part by part; `run` makes one run of the loop, and says what was recorded. The rides are told what the
/// hops gave.
///
/// # Errors
/// A limit out of its range; the scenario has no safe state, no motor, or an output that goes one way; a part that cannot be
/// run, or was ended by a check.
pub fn experiment(
    base: &Scenario,
    programme: &Programme,
    run: &mut Runs<'_>,
) -> Result<Vec<Recording>, ExperimentError> {
    programme.check()?;
    base.safety()?;
    let axis = Axis::believed(base)?;
    let crawl = scenario(base, "crawl", axis.crawl(), &crawl_path())?;
    let mut recordings = run("crawl", &crawl)?;
    let (law, step) = axis.hop(programme.fastest_deg_s);
    recordings.extend(run("hops", &scenario(base, "hops", law, &programme.hop_path(step))?)?);
    let inertia = hops::rough(&recordings).unwrap_or(axis.inertia);
    for ride in programme.rides() {
        let name = format!("to_and_fro_{}", ride.0);
        let title = format!("to and fro at {} °/s", ride.0);
        recordings.extend(run(&name, &scenario(base, &title, axis.ride(inertia), &to_and_fro(ride))?)?);
    }
    Ok(recordings)
}

/// The axis as believed, in volts.
struct Axis {
    /// J/K, V s²/rad.
    inertia: f64,
    /// Voltages at which it breaks away, and at which it slides.
    at_rest: f64,
    sliding: f64,
    /// C/K, V s/rad.
    viscous: f64,
    /// Most volts either way.
    most: f64,
}

impl Axis {
    fn believed(base: &Scenario) -> Result<Axis, ExperimentError> {
        let spec = base.spec();
        let plant = Plant::new(&spec.model).map_err(|e| ExperimentError::Runs(e.to_string()))?;
        let actuator = plant.actuator();
        let gain = actuator.motor_gain();
        let most = spec.output.highest.min(-spec.output.lowest);
        if !actuator.kind().drives_above_0() {
            return Err(ExperimentError::NoMotor);
        }
        let output = &spec.output;
        if output.lowest >= 0.0 {
            return Err(ExperimentError::OneWay("output.lowest_v", output.lowest, "below"));
        }
        if output.highest <= 0.0 {
            return Err(ExperimentError::OneWay("output.highest_v", output.highest, "above"));
        }
        let least = 0.01 * most; // of a model without friction
        Ok(Axis {
            inertia: spec.model.inertia / gain,
            at_rest: (plant.friction().at_rest() * actuator.preload() / gain).clamp(least, 0.5 * most),
            sliding: plant.friction().sliding() * actuator.preload() / gain,
            viscous: spec.model.viscous_damping / gain,
            most: MOST_VOLTS * most,
        })
    }

    fn crawl(&self) -> Value {
        let kp = self.at_rest / (RISE_S * CRAWL_DEG_S.to_radians());
        pd(kp, 0.6 * (kp * self.inertia).sqrt())
    }

    /// Law and step, °.
    fn hop(&self, fastest_deg_s: f64) -> (Value, f64) {
        let speed = HOP_SPEED * fastest_deg_s.to_radians();
        let volts = (HOP_VOLTS * self.at_rest).min(self.most);
        // The energy of a spring that is let go, friction apart.
        let step = speed * speed * self.inertia / volts;
        let kp = volts / step;
        (pd(kp, 0.3 * (kp * self.inertia).sqrt()), step.to_degrees())
    }

    fn ride(&self, inertia: f64) -> Value {
        let kp = inertia * BANDWIDTH * BANDWIDTH;
        table([(
            "pid",
            table([
                ("kp_v_rad", Value::Float(kp)),
                ("ki_v_rad_s", Value::Float(kp * BANDWIDTH / 5.0)),
                ("kd_v_s_rad", Value::Float(2.0 * inertia * BANDWIDTH)),
                ("coulomb_v", Value::Float(self.sliding)),
                ("velocity_v_s_rad", Value::Float(self.viscous)),
            ]),
        )])
    }
}

fn pd(kp: f64, kd: f64) -> Value {
    table([("pd", table([("kp_v_rad", Value::Float(kp)), ("kd_v_s_rad", Value::Float(kd))]))])
}

fn scenario(base: &Scenario, name: &str, law: Value, path: &[(f64, f64)]) -> Result<Scenario, ScenarioError> {
    let points = path.iter().map(|(t, a)| Value::Array(vec![Value::Float(*t), Value::Float(*a)]));
    let points = Value::Array(points.collect());
    let linear = Value::String("linear".to_owned());
    let reference = table([("table", table([("points_s_deg", points), ("interpolation", linear)]))]);
    checked(base, name, part(base, law, reference, length(path))?)
}
