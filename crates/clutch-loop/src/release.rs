//! The release test: before a run the brake lets go for some milliseconds and grips again, and the envelope of the
//! supervisor judges the way of the shaft: its acceleration, its sign, its scale, and what the brake does to it.
//!
//! It is a run like any other, under the open-loop law: the same checks, frames and safe state. The faults that it would
//! not see are found by running it in virtual time on the corners of the bounds, with each lie.

use crate::campaign::CampaignError;
use crate::faults::{Fault, FaultKind};
use crate::from_scenario::{self, BuiltRun};
use crate::station::ControllerStation;
use crate::virtual_time::{VirtualLoop, VirtualOptions};
use clutch_core::supervisor::Cause;
use clutch_core::{ActuatorKind, Bounds};
use clutch_node::ControllerNode;
use clutch_sim::scenario::{Plan, Table, Value};
use clutch_sim::{Scenario, ScenarioError, Start};

/// The longest way that a shaft of the bounds may make unless another is given, °.
pub const WAY_DEG: f64 = 0.1;
/// The longest that may be given, °.
pub const LONGEST_WAY_DEG: f64 = 10.0;
/// Periods that are watched once the slowest brake has stopped the shaft.
const WATCHED: f64 = 3.0;
/// Voltage at the rate of the law's way back, V/s: within a period.
const AT_ONCE: f64 = 1e6;

/// Wiring that is not as the scenario says.
const LIES: [(&str, FaultKind); 6] = [
    ("counts stand still", FaultKind::EncoderFreeze),
    ("counts reversed", FaultKind::EncoderScale(-1.0)),
    ("counts doubled", FaultKind::EncoderScale(2.0)),
    ("counts halved", FaultKind::EncoderScale(0.5)),
    ("voltage reversed", FaultKind::DacScale(-1.0)),
    ("voltage halved", FaultKind::DacScale(0.5)),
];

/// A reason why there is no release test for a scenario, as the end of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoRelease {
    /// Letting go moves nothing, or everything.
    #[error("it is for a brake on a shaft that is driven forwards at every corner of the bounds")]
    Actuator,
    /// The shaft moves already.
    #[error("the run begins in motion")]
    InMotion,
    /// The pad never lifts.
    #[error("output.lowest_v is above 0: the brake never lets go")]
    NeverOpen,
    /// Nothing stops the shaft again.
    #[error("the safe state does not grip, or not at every corner of the bounds")]
    NoGrip,
    /// A period is too long.
    #[error("the shaft would go {0:.2}° in the shortest one, and may go {1:.2}°")]
    TooFar(f64, f64),
}

/// A release test.
#[derive(Clone, Debug)]
pub struct ReleaseTest {
    /// The run.
    pub scenario: Scenario,
    /// Periods without a voltage.
    pub periods: u32,
    /// The longest way of a shaft within the bounds, rad.
    pub longest_way: f64,
    bounds: Bounds,
}

/// The lies that a test finds wherever in the bounds the shaft is, and those that it may not see.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tells {
    /// Seen at each corner.
    pub told: Vec<&'static str>,
    /// Taken for a sound shaft at one of them.
    pub untold: Vec<&'static str>,
}

impl ReleaseTest {
    /// The longest release that stays within `way` (rad, above 0) for every shaft of the bounds.
    ///
    /// # Errors
    /// None for a checked scenario; the reason why there is no test is inside.
    pub fn new(
        scenario: &Scenario,
        plan: &Plan,
        way: f64,
    ) -> Result<Result<ReleaseTest, NoRelease>, ScenarioError> {
        let bounds = scenario.supervised_bounds(&plan.bounds)?;
        Ok(match Fall::of(scenario, &bounds, way) {
            Ok(fall) => Ok(ReleaseTest {
                scenario: fall.scenario(scenario)?,
                periods: fall.periods,
                longest_way: fall.way,
                bounds,
            }),
            Err(none) => Err(none),
        })
    }

    /// Its power to find faults: the test in virtual time, on the corners of the bounds, with each lie.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn tells(&self) -> Result<Tells, CampaignError> {
        let rigs = corners(&self.bounds).map(|c| c.rig(&self.scenario)).collect::<Result<Vec<_>, _>>()?;
        let mut tells = Tells { told: Vec::new(), untold: Vec::new() };
        for (lie, kind) in LIES {
            let mut seen = true;
            for rig in &rigs {
                seen = seen && is_seen(rig, kind)?;
            }
            if seen { &mut tells.told } else { &mut tells.untold }.push(lie);
        }
        Ok(tells)
    }

    /// Its course and its word, for people.
    ///
    /// # Errors
    /// As [`ReleaseTest::tells`].
    pub fn describe(&self) -> Result<String, CampaignError> {
        let tells = self.tells()?;
        let finds = if tells.told.is_empty() { "nothing".to_owned() } else { tells.told.join(", ") };
        let cannot = if tells.untold.is_empty() {
            String::new()
        } else {
            format!("; cannot find {}", tells.untold.join(", "))
        };
        Ok(format!(
            "0 V for {} periods, at most {:.2}°: finds {finds}{cannot}",
            self.periods,
            self.longest_way.to_degrees()
        ))
    }
}

/// A fall and the grip after it.
struct Fall {
    periods: u32,
    volts: f64,
    /// Time until the last shaft stands, s.
    time: f64,
    way: f64,
}

impl Fall {
    fn of(scenario: &Scenario, bounds: &Bounds, longest: f64) -> Result<Fall, NoRelease> {
        let spec = scenario.spec();
        if bounds.actuator == ActuatorKind::Motor || bounds.drive_torque.low <= 0.0 {
            return Err(NoRelease::Actuator);
        }
        if spec.run.start != Start::Rest {
            return Err(NoRelease::InMotion);
        }
        if spec.output.lowest > 0.0 {
            return Err(NoRelease::NeverOpen);
        }
        let volts =
            scenario.safety().ok().and_then(|s| s.on_fault.holding_voltage()).ok_or(NoRelease::NoGrip)?;
        let period: f64 = spec.period.seconds();
        // The lightest shaft with the strongest drive and the weakest brake.
        let onward = bounds.drive_torque.high / bounds.inertia.low;
        let brake = (bounds.weakest_brake() * volts - bounds.drive_torque.high) / bounds.inertia.high;
        if brake <= 0.0 {
            return Err(NoRelease::NoGrip);
        }
        // A slow actuator grips late: by then nothing is left of what it lacked.
        let late = 5.0 * spec.rig.actuator_time_constant.unwrap_or(0.0);
        let fall = |periods: u32| {
            // One period more than asked for, for jitter.
            let open = f64::from(periods + 1) * period + late;
            let speed = onward * open;
            (0.5 * speed * open + 0.5 * speed * speed / brake, open + speed / brake)
        };
        let fits = |periods: &u32| fall(*periods).0 <= longest;
        let Some(periods) = (1..1000).take_while(fits).last() else {
            return Err(NoRelease::TooFar(fall(1).0.to_degrees(), longest.to_degrees()));
        };
        let (way, stands) = fall(periods);
        let time = stands + (WATCHED + f64::from(spec.rig.delay_ticks)) * period;
        Ok(Fall { periods, volts, time, way })
    }

    /// The scenario with this instead of its law, path and shell.
    fn scenario(&self, of: &Scenario) -> Result<Scenario, ScenarioError> {
        let mut table = of.table().clone();
        for part in ["law", "reference", "shell", "velocity"] {
            let _ = table.remove(part);
        }
        let period: f64 = of.spec().period.seconds();
        let wait = f64::from(self.periods) * period;
        // The target rests, so that the whole way is an error of following; the envelope judges the way.
        let limit = of.safety().map_or(0.0_f64, |s| s.limits.supervisor.following_error).max(1.5 * self.way);
        let set: [(&str, Value); 10] = [
            ("name", format!("release test of {}", of.name()).into()),
            ("law.voltage.start_v", 0.0.into()),
            ("law.voltage.end_v", self.volts.into()),
            ("law.voltage.rate_v_s", AT_ONCE.into()),
            ("law.voltage.wait_s", wait.into()),
            ("output.bumpless_time_s", 0.0.into()),
            ("run.duration_s", ((self.time / period).ceil() * period).into()),
            ("run.settle_s", 0.0.into()),
            ("safety.limits.following_error_deg", limit.to_degrees().into()),
            // It must still hold when the run itself begins.
            ("safety.on_fault", hold(self.volts)),
        ];
        let set: Vec<(String, Value)> = set.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let _ = table.insert("reference".to_owned(), one("hold", Table::new().into()));
        let _ = table.insert("law".to_owned(), one("voltage", Table::new().into()));
        Scenario::from_table(of.name(), table, &set)
    }
}

fn one(key: &str, value: Value) -> Value {
    Table::from_iter([(key.to_owned(), value)]).into()
}

fn hold(volts: f64) -> Value {
    one("hold", one("volts_v", volts.into()))
}

/// A shaft at a corner of the bounds.
struct Corner {
    drive: f64,
    inertia: f64,
    friction: f64,
    gain: f64,
    bounds: Bounds,
}

/// The corners: strong or weak pull, strong or weak brake.
fn corners(b: &Bounds) -> impl Iterator<Item = Corner> + '_ {
    let pulls = [(b.drive_torque.high, b.inertia.low), (b.drive_torque.low, b.inertia.high)];
    let brakes = [(b.friction.low, b.brake_gain.low), (b.friction.high, b.brake_gain.high)];
    pulls.into_iter().flat_map(move |(drive, inertia)| {
        brakes.map(|(friction, gain)| Corner { drive, inertia, friction, gain, bounds: *b })
    })
}

impl Corner {
    /// The test with this shaft for a rig.
    fn rig(&self, test: &Scenario) -> Result<Scenario, ScenarioError> {
        let mut table = test.table().clone();
        if let Some(Value::Table(rig)) = table.get_mut("rig") {
            for part in ["drive", "friction", "actuator", "ripple", "runout"] {
                let _ = rig.remove(part);
            }
        }
        let points: Value = vec![Value::from(vec![Value::from(0.0), self.drive.into()])].into();
        let mu = |key: &str| (key.to_owned(), Value::from(self.friction));
        let friction = Table::from_iter(["mu_static", "mu_dynamic"].map(mu));
        let set: [(&str, Value); 8] = [
            ("rig.inertia_kg_m2", self.inertia.into()),
            ("rig.viscous_damping_nm_s_rad", self.bounds.viscous_damping.high.into()),
            ("rig.drive", one("table", one("points_s_nm", points))),
            ("rig.torque_noise_nm", 0.0.into()),
            ("rig.actuator", one("brake", Table::new().into())),
            ("rig.actuator.brake.gain_nm_v", self.gain.into()),
            ("rig.actuator.brake.preload_nm", self.bounds.preload.into()),
            ("rig.friction", one("coulomb", friction.into())),
        ];
        let set: Vec<(String, Value)> = set.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        Scenario::from_table(test.name(), table, &set)
    }
}

/// True if a check ends the test on a rig with this lie, as none does on a sound one.
fn is_seen(scenario: &Scenario, kind: FaultKind) -> Result<bool, CampaignError> {
    Ok(judged(scenario, vec![Fault::new(kind, 0.0)])?.is_some())
}

/// The cause by which the test ends on a rig with faults, if it does.
fn judged(scenario: &Scenario, faults: Vec<Fault>) -> Result<Option<Cause>, CampaignError> {
    // A board has single precision; the last bits of a verdict are the margins' business.
    let built = BuiltRun::<f64>::new(scenario, 1)?;
    let path = from_scenario::path::<f64>(scenario)?;
    let duration = scenario.spec().run.duration;
    let options = VirtualOptions {
        latency_ns: 100_000,
        duration,
        ticks: built.ticks,
        faults,
        ..VirtualOptions::default()
    };
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut world = VirtualLoop::new(scenario, options, ControllerStation::new(node, &path))?;
    Ok(world.run(&path)?.cause)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario(set: &[(&str, &str)]) -> Scenario {
        let set: Vec<_> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let toml = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == "board_smc_2").unwrap().toml;
        Scenario::parse("board_smc_2", toml, &set).unwrap()
    }

    fn test_of(set: &[(&str, &str)]) -> Result<ReleaseTest, NoRelease> {
        let scenario = scenario(set);
        ReleaseTest::new(&scenario, &scenario.plan().unwrap(), WAY_DEG.to_radians()).unwrap()
    }

    const WIDE: [(&str, &str); 4] = [
        ("bounds.friction_percent", "20"),
        ("bounds.drive_torque_percent", "10"),
        ("bounds.inertia_percent", "10"),
        ("safety.on_fault.hold.volts_v", "9.99"),
    ];

    #[test]
    fn a_sound_shaft_at_any_corner_passes_and_goes_no_further_than_said() {
        for set in [&WIDE[3..], &WIDE[..]] {
            let test = test_of(set).unwrap();
            let bounds = test.scenario.supervised_bounds(&test.scenario.plan().unwrap().bounds).unwrap();
            assert!(
                test.longest_way <= WAY_DEG.to_radians() && test.longest_way > 0.5 * WAY_DEG.to_radians()
            );
            let mut longest: f64 = 0.0;
            for corner in corners(&bounds) {
                let rig = corner.rig(&test.scenario).unwrap();
                assert_eq!(judged(&rig, Vec::new()).unwrap(), None, "{set:?}");
                let run = clutch_sim::simulate::<f64>(&rig.spec()).unwrap();
                let (first, last) = (run.trace.position[0], *run.trace.position.last().unwrap());
                assert_eq!(*run.trace.velocity.last().unwrap(), 0.0, "it stands again");
                longest = longest.max(last - first);
            }
            assert!(longest <= test.longest_way && longest > 0.4 * test.longest_way, "{longest}");
        }
    }

    #[test]
    fn a_sound_shaft_passes_a_long_test_as_it_passes_a_short_one() {
        let wide = scenario(&WIDE);
        for degrees in [0.1, 0.9, 1.2, 2.0, LONGEST_WAY_DEG] {
            let test = ReleaseTest::new(&wide, &wide.plan().unwrap(), degrees.to_radians()).unwrap().unwrap();
            let bounds = wide.supervised_bounds(&wide.plan().unwrap().bounds).unwrap();
            for corner in corners(&bounds) {
                let rig = corner.rig(&test.scenario).unwrap();
                assert_eq!(judged(&rig, Vec::new()).unwrap(), None, "{degrees}°");
            }
        }
    }

    #[test]
    fn wrong_signs_and_dead_counts_are_told_and_wide_bounds_hide_a_scale() {
        let tells = |set: &[(&str, &str)]| test_of(set).unwrap().tells().unwrap();
        let exact = tells(&WIDE[3..]);
        for lie in ["counts stand still", "counts reversed", "counts doubled", "voltage reversed"] {
            assert!(exact.told.contains(&lie), "{lie}: {exact:?}");
        }
        let all = exact.told.len() + exact.untold.len();
        assert_eq!(all, LIES.len());
        let loose = [("bounds.drive_torque_percent", "60"), ("bounds.inertia_percent", "40")];
        let wide = tells(&[&WIDE[..1], &WIDE[3..], &loose].concat());
        assert!(wide.told.len() < exact.told.len(), "{wide:?} / {exact:?}");
        assert!(wide.untold.contains(&"counts halved"), "{wide:?}");
    }

    #[test]
    fn a_longer_way_tells_more() {
        let wide = scenario(&WIDE);
        let told = |degrees: f64| {
            let test = ReleaseTest::new(&wide, &wide.plan().unwrap(), degrees.to_radians()).unwrap();
            test.unwrap().tells().unwrap().told
        };
        let (short, long) = (told(0.1), told(0.5));
        assert_eq!(short, ["counts reversed", "voltage reversed"]);
        assert_eq!(
            long,
            ["counts stand still", "counts reversed", "counts doubled", "counts halved", "voltage reversed"]
        );
        // Beyond the following error another check sees it first.
        assert!(long.iter().all(|lie| told(2.0).contains(lie)));
    }

    #[test]
    fn no_release_where_nothing_would_catch_the_shaft() {
        assert_eq!(test_of(&[("run.start", "on_path")]).unwrap_err(), NoRelease::InMotion);
        let toml = scenario(&[])
            .canonical()
            .replace("[safety.on_fault.hold]\nvolts_v = 4.5", "[safety.on_fault.release]");
        let lets_go = Scenario::parse("lets go", &toml, &[]).unwrap();
        assert_eq!(
            ReleaseTest::new(&lets_go, &lets_go.plan().unwrap(), WAY_DEG.to_radians()).unwrap().unwrap_err(),
            NoRelease::NoGrip
        );
        let slow = [("sampling.period_us", "10000"), ("safety.limits.delay_cycles", "0")];
        assert!(matches!(test_of(&slow).unwrap_err(), NoRelease::TooFar(..)));
    }
}
