//! Healthy shafts: drawn from anywhere inside wide bounds, under every law that follows a path, with lines that lose, delay and
//! jitter.
//! Nothing is broken but the line, so that no other check may end one of them: [`is_nuisance`].

use crate::campaign::CampaignError;
use crate::campaign::healthy_run::RigName;
use crate::campaign::laws;
use crate::faults::{Direction, Fault, FaultKind};
use crate::from_scenario::{self, BuiltRun};
use crate::station::ControllerStation;
use crate::virtual_time::{VirtualLoop, VirtualOptions, VirtualReport};
use clutch_core::Real;
use clutch_core::supervisor::Cause;
use clutch_node::ControllerNode;
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Scenario, ScenarioError};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Causes that a bad line explains: samples lost or late, none for too long, and a board whose watchdog got no codes.
const OF_A_BAD_LINE: [Cause; 4] = [Cause::Lost, Cause::Late, Cause::Silence, Cause::Board];

/// True if a run of a healthy shaft may not end so: by any check but those of a bad line.
#[must_use]
pub fn is_nuisance(cause: Cause) -> bool {
    Cause::CHECKS.contains(&cause) && !OF_A_BAD_LINE.contains(&cause)
}

/// A healthy shaft and its run; everything follows from its seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HealthyShaft {
    /// Seed.
    pub seed: u64,
    /// Length, s.
    pub seconds: u32,
}

impl HealthyShaft {
    /// A shaft with friction of ±40 %, a load of half to twice the paper's, and ±10 % of inertia and gain, inside
    /// bounds that say so.
    ///
    /// # Errors
    /// None, unless a row of the tables is wrong.
    pub fn scenario(&self) -> Result<Scenario, ScenarioError> {
        Scenario::parse("healthy", &self.text(), &[])
    }

    fn text(&self) -> String {
        let mut rng = Pcg64::seed_from_u64(self.seed ^ 0x6865_616c_7468);
        let mut within = |percent: f64| 1.0 + percent / 100.0 * rng.random_range(-1.0..=1.0_f64);
        let (friction, gain, inertia) = (within(40.0), within(10.0), within(10.0));
        // About 1.25 times the paper's mass: 60 % either way are a half and twice.
        let mass = 0.25 * within(60.0);
        let damping = 0.001 * within(50.0);
        let drawn = laws::following();
        let name = drawn[rng.random_range(0..drawn.len())];
        let (delay, micro) = (rng.random_range(0..=1), rng.random_bool(0.5));
        let law = laws::of(name);
        // One that is at a limit in every period may be there throughout.
        let saturated = if law.switches { f64::from(self.seconds) } else { 5.0 };
        let law = format!("[law.{name}]\n{}{}", (law.brake)(RigName::Paper, micro, delay), law.holds_all);
        let rate = [2.0, 5.0, 10.0, 20.0, 40.0, 60.0][rng.random_range(0..6)];
        let path = match rng.random_range(0..3) {
            0 => format!("[reference.ramp]\nrate_deg_s = {rate:?}\n"),
            1 => format!(
                "[reference.minimum_jerk]\ndistance_deg = {:?}\nduration_s = {:?}\n",
                0.5 * rate * f64::from(self.seconds),
                f64::from(self.seconds)
            ),
            _ => format!(
                "[reference.sine]\nrate_deg_s = {rate:?}\namplitude_deg = {:?}\nfrequency_hz = 2.0\n",
                0.06 * rate
            ),
        };
        let scalar = if rng.random_bool(0.5) { "f32" } else { "f64" };
        let observer = if rng.random_bool(0.25) { "[velocity.observer]\n" } else { "" };
        let start = if rng.random_bool(0.5) { "rest" } else { "on_path" };
        format!(
            "name = \"healthy\"\n[rig]\nbase = \"paper\"\ndelay_ticks = {delay}\n\
             inertia_kg_m2 = {:?}\nviscous_damping_nm_s_rad = {damping:?}\n\
             [rig.actuator.brake]\ngain_nm_v = {:?}\n\
             [rig.friction.stribeck]\nmu_static = {:?}\nmu_dynamic = {:?}\n[rig.drive.weight]\nmass_kg = {mass:?}\n\
             [model]\ndrive_torque_nm = 0.05886\n\
             {law}{path}{observer}[sampling]\nscalar = \"{scalar}\"\n\
             [bounds]\nfriction_percent = 40.0\ndrive_torque_percent = 60.0\ninertia_percent = 10.0\n\
             brake_gain_percent = 10.0\nviscous_damping_percent = 50.0\n\
             [run]\nduration_s = {:?}\nstart = \"{start}\"\nseed = {}\n\
             [safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 9.99\n\
             [safety.limits]\nwatchdog_cycles = 8\nsilence_cycles = 8\nfollowing_error_deg = 20.0\nsaturation_time_s = {saturated:?}\n",
            0.0017 * inertia,
            0.14 * gain,
            0.2 * friction,
            0.15 * friction,
            f64::from(self.seconds),
            self.seed,
        )
    }

    /// Runs it.
    ///
    /// # Errors
    /// None, unless a row of the tables is wrong.
    pub fn run(&self) -> Result<VirtualReport, CampaignError> {
        let scenario = self.scenario()?;
        match scenario.scalar() {
            ScalarKind::F32 => self.run_in::<f32>(&scenario),
            ScalarKind::F64 => self.run_in::<f64>(&scenario),
        }
    }

    fn run_in<T: Real>(&self, scenario: &Scenario) -> Result<VirtualReport, CampaignError> {
        let mut rng = Pcg64::seed_from_u64(self.seed ^ 0x6c69_6e65);
        let built = BuiltRun::<T>::new(scenario, 7)?;
        let path = from_scenario::path::<T>(scenario)?;
        let mut options = VirtualOptions {
            latency_ns: rng.random_range(20_000..300_000),
            seed: self.seed,
            duration: f64::from(self.seconds),
            ..VirtualOptions::default()
        };
        if rng.random_bool(0.5) {
            let lost = Fault { probability: 0.003, ..Fault::new(FaultKind::Drop, 0.0) };
            let jitter = Fault { direction: Direction::Both, ..Fault::new(FaultKind::Jitter(0.0003), 0.0) };
            options.faults = vec![lost, jitter];
        }
        let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
        let mut world = VirtualLoop::new(scenario, options, ControllerStation::new(node, &path))?;
        Ok(world.run(&path)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_core::law::LawParams;

    #[test]
    fn every_check_but_those_of_a_bad_line_counts_as_a_nuisance() {
        let excused: Vec<_> = Cause::CHECKS.into_iter().filter(|cause| !is_nuisance(*cause)).collect();
        assert_eq!(excused, [Cause::Lost, Cause::Late, Cause::Silence, Cause::Board]);
        assert!(![Cause::None, Cause::Operator, Cause::Done].into_iter().any(is_nuisance));
    }

    /// The one run under sliding mode with a layer, of seeds 10 001 to 60 000, that ends by [`Cause::Saturation`] with the gains of Table 2.
    const TOO_WEAK: u64 = 11_522;

    #[test]
    fn sliding_mode_holds_every_shaft_of_the_bounds() {
        let mut seen = 0;
        for seed in 1..60 {
            let scenario = HealthyShaft { seed, seconds: 20 }.scenario().expect("a scenario");
            let kp = match scenario.spec().law {
                LawParams::Smc(p) => p.kp,
                LawParams::SmcSign(p) => p.kp,
                LawParams::SmcIntegral(p) => p.kp,
                _ => continue,
            };
            let bounds = scenario.plan().expect("a plan").bounds;
            let needed = bounds.drive_torque.high / bounds.weakest_brake();
            assert!(needed > 8.0 && kp > needed, "seed {seed}: {kp} V against {needed} V");
            seen += 1;
        }
        assert!(seen > 10, "{seen} runs");
    }

    #[test]
    fn a_law_that_is_too_weak_to_hold_ends_by_saturation_far_ahead_and_one_that_holds_goes_on() {
        let run = HealthyShaft { seed: TOO_WEAK, seconds: 20 };
        assert_eq!(run.run().expect("a run").cause, None);
        let weak = Scenario::parse("weak", &run.text(), &[("law.smc.kp_v".to_owned(), "3.0".to_owned())])
            .expect("a scenario");
        let report = match weak.scalar() {
            ScalarKind::F32 => run.run_in::<f32>(&weak),
            ScalarKind::F64 => run.run_in::<f64>(&weak),
        };
        let report = report.expect("a run");
        assert_eq!(report.cause, Some(Cause::Saturation));
        // It stands under the whole brake, and its path is long in coming.
        let ahead = report.largest_error.to_degrees();
        assert!((10.0..13.0).contains(&ahead), "{ahead}°");
    }
}
