//! `clutch certify`.

use crate::args::ScenarioArgs;
use crate::output::{Exit, beside, check_files, json, paragraph, report, to_write, wrote};
pub use crate::sampled::Asked;
use crate::sampled::{self, Bound};
use crate::table::{number, quantities};
use clap::Args;
use clutch_certificate::file;
use clutch_core::certificate::{Certificate, PaperConditions, Shortfall};
use clutch_core::params::{
    DEG, DEG_S, DEG_S2, KG_M2, NM, NM_S_RAD, NM_V, NONE, PER_S, PERCENT, RAD_S, RAD_S2, Unit, V, V_S_RAD,
};
use clutch_core::{ActuatorKind, Interval};
use clutch_sim::scenario::{CERTIFIED, CertificateError, Plan, Sampled, Table};
use clutch_sim::{Scenario, ScenarioError, written};
use serde_json::{Value, json as value};
use std::path::PathBuf;

/// Checks a scenario's gains against every plant within its bounds.
///
/// Prints three verdicts apart: on the error, in continuous time and as sampled; on the linear stability of the sampled
/// loop; on sticks, which neither excludes. Exit code 0: certified in continuous time and not known to be unstable as sampled,
/// with --sampled or --check as sampled and linearly stable; 2: not so.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch certify smc_2 --set bounds.friction_percent=20\n  \
    clutch certify pd_2 --set bounds.friction_percent=40 --sampled --save pd.json\n\n\
    docs/theory.md derives the conditions and gives their limits.")]
pub(crate) struct Certify {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Prints the certificate as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Looks for a proof that bounds the error of the sampled loop: seconds to minutes.
    #[arg(long)]
    sampled: bool,
    /// Writes that proof to a file, which --check reads.
    #[arg(long, value_parser = to_write(), value_name = "FILE.json", requires = "sampled")]
    save: Option<PathBuf>,
    /// Checks the proof in a file, and that it is this scenario's, instead of looking for one.
    #[arg(long, value_name = "FILE.json", conflicts_with = "sampled")]
    check: Option<PathBuf>,
}

impl Certify {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let asked = match (self.check, self.sampled) {
            (Some(file), _) => Asked::Check(file),
            (None, true) => Asked::Search,
            (None, false) => Asked::Nothing,
        };
        let save = self.save;
        check_files(&save)?;
        let scenario = self.scenario.load()?;
        // Nothing that is proven in continuous time asks for a delay.
        self.scenario.hold_times(&scenario, !matches!(asked, Asked::Nothing))?;
        let plan = scenario.plan()?;
        let outside = scenario.outside_bounds(&plan.bounds)?;
        let rig =
            scenario.cannot_follow()?.map_or(String::new(), |reason| paragraph(&format!("note: {reason}")));
        let sampled = scenario.sampled(&plan.bounds);
        let (bound, proof) = Bound::of(&sampled, &asked)?;
        let mut saved = Vec::new();
        if let (Some(file), Some(proof)) = (save.as_deref(), &proof) {
            file::write(file, proof).map_err(CertificateError::from)?;
            saved.push(file);
        }
        report(
            self.json,
            || json(&whole(&scenario, &sampled, &bound)?),
            || text(&scenario, &plan, &outside) + &rig + &sampled::lines(&sampled, &bound) + &wrote(&saved),
        )?;
        if let (Some(file), None) = (&save, &proof) {
            eprintln!("{}: not written: nothing is proven", file.display());
        }
        let certified = match bound {
            Bound::NotLookedFor => plan.certificate.certified() && !sampled.runs_away(),
            _ => bound.proven().is_some() && sampled.bound_suffices(),
        };
        Ok(if certified { Exit::Done } else { Exit::NotCertified })
    }
}

fn reason(s: Shortfall) -> &'static str {
    match s {
        Shortfall::Kp => {
            "K_p is too small for the worst corner: the weakest brake, or motor, against the strongest load, at the \
             path's acceleration and the reaching rate wanted"
        }
        Shortfall::Kd => "K_d is too small: it does not cover f |ė|",
        Shortfall::Voltage => {
            "the output's limits are too small for brake or motor against the strongest load"
        }
        Shortfall::Drive => "the drive is too weak for the path: a shaft that is behind does not catch up",
        Shortfall::Start => {
            "the start's error rate is more than brake, motor or drive can follow: start on the path, or slower"
        }
        Shortfall::Jump => {
            "the path's velocity jumps on the way, which no shaft follows at once: smooth it (a table: interpolation = \
             \"cubic\")"
        }
        Shortfall::Layer => {
            "the law saturates so far off its surface that the error rate there may exceed what brake or drive can \
             follow: raise the gain on the error rate, or thin the law's boundary, or follow a slower path"
        }
        Shortfall::Slope => "the surface's slope f is below C_d/J: raise K_p against K_d",
        Shortfall::Surface => {
            "the law has no sliding surface, of which the certificate speaks: a law has one that has gains above 0 on the \
             error and on its rate, and no integral"
        }
        _ => "not certified",
    }
}

/// The words for an actuator.
struct Words {
    ahead: &'static str,
    gain: &'static str,
    behind: &'static str,
    given: &'static str,
}

impl Words {
    const fn of(kind: ActuatorKind) -> Words {
        let brake = Words {
            ahead: "\nShaft ahead: the brake stops it (worst corner: strongest drive, weakest brake)",
            gain: "worst corner: brake mu K_COF",
            behind: "\nShaft behind: the brake lets go (worst corner: weakest drive)",
            given: "voltage given (highest)",
        };
        match kind {
            ActuatorKind::Brake => brake,
            ActuatorKind::Both => Words {
                behind: "\nShaft behind: the motor drives it on (worst: weakest drive, weakest motor)",
                ..brake
            },
            ActuatorKind::Motor => Words {
                given: "voltage given (nearer limit)",
                ahead: "\nShaft ahead: the motor drives it back (worst: weakest motor, all against it)",
                gain: "worst corner: torque per volt",
                behind: "\nShaft behind: the motor drives it on (worst: weakest motor, all against it)",
            },
        }
    }
}

/// A row of a table: a name, a value and its unit.
type Row = (&'static str, String, &'static str);

/// A value that is given in SI.
fn row(name: &'static str, x: f64, unit: &Unit) -> Row {
    // Nothing is needed where no voltage is: no margin is a number.
    (name, if x.is_finite() { number(unit.from_si(x)) } else { "–".to_owned() }, unit.text)
}

/// An interval, in SI.
fn between(name: &'static str, i: &Interval, unit: &Unit) -> Row {
    let (low, high) = (number(unit.from_si(i.low)), number(unit.from_si(i.high)));
    #[allow(clippy::float_cmp, reason = "an interval of one point is exactly that")]
    (name, if i.low == i.high { low } else { format!("{low} … {high}") }, unit.text)
}

/// Rows that go on a table.
fn more(rows: &[Row]) -> String {
    quantities("", rows).trim_start_matches('\n').to_owned()
}

fn text(scenario: &Scenario, plan: &Plan, outside: &[String]) -> String {
    let (c, words) = (&plan.certificate, Words::of(plan.bounds.actuator));
    let mut out = format!("{}\n{}\n\n", scenario.name(), scenario.spec().law.title());
    out += &assumed(plan);
    out += &ahead(c, &words);
    out += &behind(c, plan.demand.start_error_rate, &words);
    if has_surface(c) {
        out += &with_both(c);
    }
    if let Some(paper) = &plan.paper {
        out += &printed(paper);
    }
    out.push('\n');
    out += &match c.shortfall {
        None => paragraph(
            "continuous time: certified (exact sensor: sampling, encoder steps and delay come on top)",
        ),
        Some(s) => paragraph(&format!("continuous time: NOT certified: {}", reason(s))),
    };
    if !outside.is_empty() {
        out += "\nThe scenario's rig is outside these bounds; in continuous time not covered:\n";
        for line in outside {
            out += &beside(" ", line);
        }
    }
    out
}

/// Bounds on the plant, and what the path asks for.
fn assumed(plan: &Plan) -> String {
    let (b, d) = (&plan.bounds, &plan.demand);
    let shaft = [
        between("inertia J", &b.inertia, &KG_M2),
        between("driving torque M g R_p", &b.drive_torque, &NM),
        between("viscous damping C_d", &b.viscous_damping, &NM_S_RAD),
    ];
    let mut rows = Vec::new();
    if b.brake_gain.high > 0.0 {
        rows.push(between("brake gain K_COF", &b.brake_gain, &NM_V));
    }
    if b.motor_gain.high > 0.0 {
        rows.push(between("motor gain k_t", &b.motor_gain, &NM_V));
    }
    if b.preload > 0.0 {
        rows.push(row("normal force without a voltage N_0", b.preload, &NM));
    }
    if b.load_share > 0.0 {
        rows.push(row("share of the load that presses λ", b.load_share, &NONE));
    }
    rows.extend([
        between("friction at rest", &b.friction_at_rest, &NONE),
        between("friction, fast", &b.friction_sliding, &NONE),
        row("path: velocity v_d", d.velocity, &DEG_S),
        row("path: acceleration a_d", d.acceleration, &DEG_S2),
        row("reaching rate γ wanted", d.reach_rate, &RAD_S2),
    ]);
    quantities("Bounds", &shaft) + &more(&rows)
}

/// A shaft ahead of its path.
fn ahead(c: &Certificate, words: &Words) -> String {
    let is_smc = c.kd_required > 0.0;
    let mut out = quantities(
        words.ahead,
        &[
            row("worst corner: torque", c.worst_torque, &NM),
            row("worst corner: inertia", c.worst_inertia, &KG_M2),
            row(words.gain, c.weakest_brake, &NM_V),
            row(if is_smc { "K_p required" } else { "voltage required" }, c.kp_required, &V),
            row("    of which for the boundary layer", c.kp_for_boundary, &V),
            row(if is_smc { "K_p given" } else { words.given }, c.kp_given, &V),
            row("    margin", c.kp_given / c.kp_required - 1.0, &PERCENT),
            row("reaching rate γ possible", c.reach_rate_possible, &RAD_S2),
        ],
    );
    if has_surface(c) {
        out += &more(&[row("valid up to an error rate of", c.error_rate_ahead, &DEG_S)]);
    }
    if is_smc {
        out += &more(&[
            row("K_d required", c.kd_required, &V_S_RAD),
            row("K_d given", c.kd_given, &V_S_RAD),
            row("    margin", c.kd_given / c.kd_required - 1.0, &PERCENT),
        ]);
    }
    out
}

/// A shaft behind its path.
fn behind(c: &Certificate, start_error_rate: f64, words: &Words) -> String {
    let mut rows = vec![row("worst corner: torque", c.least_torque, &NM)];
    if has_surface(c) {
        rows.push(row("valid up to an error rate of", c.error_rate_behind, &DEG_S));
    }
    rows.push(row("error rate at the start", start_error_rate, &DEG_S));
    quantities(words.behind, &rows)
}

/// True for a law with a sliding surface: for another, figures about one would mean nothing.
fn has_surface(c: &Certificate) -> bool {
    c.shortfall != Some(Shortfall::Surface)
}

/// Consequence for the error.
fn with_both(c: &Certificate) -> String {
    let mut rows =
        vec![row("sliding surface: slope f", c.slope, &PER_S), row("layer around it", c.layer, &RAD_S)];
    if c.certified() {
        rows.push(row("error stays below", c.error_bound, &DEG));
    }
    quantities("\nWith both", &rows)
}

/// The paper's conditions.
fn printed(p: &PaperConditions) -> String {
    quantities(
        "\nThe paper's own conditions, as printed (not sound: docs/theory.md)",
        &[
            row("(26) K_p above", p.kp, &V),
            row("(27) K_d above", p.kd, &V_S_RAD),
            row("(28) reaching rate γ", p.gamma, &RAD_S2),
        ],
    )
}

/// Refuses a file for a proof that cannot be written, before one is looked for.
///
/// # Errors
/// A folder that is not there, a file that is one or is read-only.
pub fn check_save(file: &PathBuf) -> anyhow::Result<()> {
    check_files([file])
}

/// A scenario's certificate: the object that `--json` prints, described in `docs/scenario.md`, and the proof that was found.
///
/// # Errors
/// A path that a brake cannot follow; a file that proves nothing for this scenario.
pub fn certificate(
    scenario: &Scenario,
    asked: &Asked,
) -> anyhow::Result<(Value, Option<clutch_certificate::Certificate>)> {
    let plan = scenario.plan()?;
    let sampled = scenario.sampled(&plan.bounds);
    let (bound, proof) = Bound::of(&sampled, asked)?;
    Ok((whole(scenario, &sampled, &bound)?, proof))
}

fn whole(scenario: &Scenario, sampled: &Sampled, bound: &Bound) -> Result<Value, ScenarioError> {
    let plan = scenario.plan()?;
    let outside = scenario.outside_bounds(&plan.bounds)?;
    let c: &Certificate = &plan.certificate;
    let paper =
        |p: &PaperConditions| value!({"kp_26_v": p.kp, "kd_27_v_s_rad": p.kd, "gamma_28_rad_s2": p.gamma});
    Ok(value!({
        "scenario": scenario.name(),
        "version": env!("CARGO_PKG_VERSION"),
        "law": scenario.spec().law.title(),
        (CERTIFIED): c.certified(),
        "reason": c.shortfall.map(reason),
        "rig_outside_bounds": outside,
        "bounds": pairs(written(&plan.bounds)),
        "demand": pairs(written(&plan.demand)),
        "ahead": {
            "torque_nm": c.worst_torque,
            "inertia_kg_m2": c.worst_inertia,
            "brake_nm_v": c.weakest_brake,
            "kp_required_v": c.kp_required,
            "kp_for_boundary_v": c.kp_for_boundary,
            "kp_given_v": c.kp_given,
            "kd_required_v_s_rad": c.kd_required,
            "kd_given_v_s_rad": c.kd_given,
            "reach_rate_possible_rad_s2": c.reach_rate_possible,
            "error_rate_limit_rad_s": c.error_rate_ahead,
        },
        "behind": {
            "torque_nm": c.least_torque,
            "error_rate_limit_rad_s": c.error_rate_behind,
        },
        "layer": {
            "slope_1_s": c.slope,
            "thickness_rad_s": c.layer,
            "error_bound_rad": c.error_bound,
        },
        "paper": plan.paper.as_ref().map(paper),
        "sampled": sampled::json(sampled, bound),
    }))
}

/// A table as JSON, an interval in it as its two ends.
fn pairs(table: Table) -> Value {
    let one = |(key, value): (String, toml::Value)| {
        let ends = value
            .as_table()
            .and_then(|i| Some(value!([i.get("low")?.as_float(), i.get("high")?.as_float()])));
        (key, ends.unwrap_or_else(|| value!(value)))
    };
    table.into_iter().map(one).collect::<serde_json::Map<_, _>>().into()
}
