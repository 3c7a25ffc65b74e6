//! Torque and inertia one by one of random rigs, with 60 g added at 24 mm for a second experiment: a table of docs/identify.md.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example added_mass -- 50 10001
//! ```

use clutch_identify::added::{Added, Separate, separate};
use clutch_identify::experiment::{PartRunner, Programme, experiment};
use clutch_identify::{Estimate, Finding, identify};
use clutch_sim::Scenario;
use rayon::prelude::*;

#[path = "random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of another example")]
mod random_rig;
#[path = "random_rig/rows.rs"]
#[allow(dead_code, reason = "details are of other examples")]
mod rows;
use random_rig::added::heavier;
use random_rig::{Outcome, truth};
use rows::{As, print_row};

fn found(scenario: &Scenario) -> Outcome<clutch_identify::Report> {
    let mut runner = PartRunner::default();
    let run = &mut |name: &str, part: &Scenario| runner.run(name, part);
    Ok(identify(&experiment(scenario, &Programme::default(), run)?))
}

fn main() -> Outcome<()> {
    let mut args = std::env::args().skip(1);
    let mut number = |default: u64| args.next().map_or(Ok(default), |text| text.parse::<u64>());
    let (rigs, first) = (number(50)?, number(10_001)?);
    let added = Added { mass: 0.06, radius: 0.024, gravity: 9.81 };
    let runs = (first..first + rigs).into_par_iter().map(|seed| {
        let truth = truth(seed)?;
        let rig = truth.scenario.spec().rig;
        let torque = truth.pull * rig.inertia;
        let told = separate(&found(&truth.scenario)?, &found(&heavier(&truth.scenario, &added)?)?, &added);
        let grip = torque / truth.hold;
        let inertia = rig.inertia;
        Ok(([torque, inertia, grip, truth.ratio * grip, truth.damping * inertia], told))
    });
    let done = runs.collect::<Outcome<Vec<([f64; 5], Separate)>>>()?;
    rows::print_head();
    for (k, name) in ["T", "J", "μ_d K", "μ_s K", "C"].into_iter().enumerate() {
        let known: Vec<(Estimate, f64)> =
            done.iter().filter_map(|(truth, told)| Some((told.rows()[k].3.known()?, truth[k]))).collect();
        print_row(name, As::Percent, &known, done.len());
    }
    for (k, (_, told)) in done.iter().enumerate() {
        if let Finding::Refused(why) = &told.torque {
            println!("rig {}: {why}", first + k as u64);
        }
    }
    println!("{rigs} rigs from seed {first}, two experiments each");
    Ok(())
}
