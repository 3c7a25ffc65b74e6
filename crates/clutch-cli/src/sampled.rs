//! Verdicts on the sampled loop: the error bound, linear stability, sticks; each with its scope.

use crate::output::paragraph;
use crate::table::number;
use anyhow::Context;
use clutch_certificate::{Options, Setup, checker, file, search};
use clutch_sim::scenario::Sampled;
use serde_json::{Value, json as value};
use std::path::Path;

/// The verdict on the error as sampled.
pub(crate) enum Bound {
    /// It was not asked for.
    NotLookedFor,
    /// The scenario has none.
    NotCovered(String),
    /// Proven and checked.
    Proven { checked: checker::Checked, cells: usize },
    /// Not proven, which does not mean unsafe.
    Open(String),
    /// Not looked for: the loop is linearly unstable.
    Unstable,
}

impl Bound {
    /// Looks for a proof, checks it, and saves it if asked.
    pub(crate) fn search(sampled: &Sampled, save: Option<&Path>) -> anyhow::Result<Bound> {
        let setup = match &sampled.setup {
            Ok(setup) => setup,
            Err(why) => return Ok(Bound::NotCovered(why.to_string())),
        };
        if sampled.stable() == Some(false) {
            return Ok(Bound::Unstable);
        }
        let found = search(setup, &Options::default(), false);
        if let Some(open) = found.open.first() {
            let how = if open.grew {
                "the set grew beyond all limits"
            } else {
                "the search ended before the set was closed"
            };
            let [low, high] = open.sliding;
            return Ok(Bound::Open(format!("for mu_d {low:.4} … {high:.4} {how}")));
        }
        // Nothing is believed that the checker does not pass.
        let checked = checker::check(&found.certificate)
            .context("the proof that was found does not pass its check; please report this as a defect")?;
        if let Some(path) = save {
            file::write(path, &found.certificate)?;
        }
        Ok(Bound::Proven { checked, cells: found.certificate.cells.len() })
    }

    /// Checks the proof of a file, and that it is this scenario's.
    pub(crate) fn of_file(sampled: &Sampled, path: &Path) -> anyhow::Result<Bound> {
        let certificate = file::read(path)?;
        let setup = match &sampled.setup {
            Ok(setup) => setup,
            Err(why) => return Ok(Bound::NotCovered(why.to_string())),
        };
        let others = setup.differences(&certificate.setup);
        if !others.is_empty() {
            anyhow::bail!(
                "{}: the certificate is another loop's; scenario and file differ in\n  {}",
                path.display(),
                others.join("\n  ")
            );
        }
        let checked = checker::check(&certificate).with_context(|| path.display().to_string())?;
        Ok(Bound::Proven { checked, cells: certificate.cells.len() })
    }

    /// The bound on `|e|`, rad.
    pub(crate) fn proven(&self) -> Option<f64> {
        match self {
            Bound::Proven { checked, .. } => Some(checked.error_bound),
            _ => None,
        }
    }

    fn reason(&self) -> Option<String> {
        match self {
            Bound::Proven { .. } => None,
            Bound::NotLookedFor => Some("not looked for".to_owned()),
            Bound::NotCovered(why) => Some(why.clone()),
            Bound::Open(cell) => Some(format!("not certified (not shown unsafe): {cell}")),
            Bound::Unstable => Some("not looked for: the sampled loop is linearly unstable".to_owned()),
        }
    }
}

/// The plants and the loop that a bound speaks of.
fn scope(s: &Setup) -> String {
    let range = |[low, high]: [f64; 2]| {
        if high - low <= 1e-12 * high { number(low) } else { format!("{} … {}", number(low), number(high)) }
    };
    let ticks = if s.delay_ticks == 1 { "tick" } else { "ticks" };
    let mut out = format!(
        "every {} µs, {} {ticks} of delay, {} counts/rev; ramp at {} °/s, {}; mu_d {}, mu_s {}{}; J {} kg m², T_u {} N m, K_COF {} N m/V",
        number(1e6 * s.period_s),
        s.delay_ticks,
        s.counts_per_rev,
        number(s.rate.to_degrees()),
        if s.from_rest { "from rest" } else { "begun at its speed" },
        range(s.sliding),
        range(s.at_rest),
        if s.rest_not_below_sliding { ", never below mu_d" } else { "" },
        range(s.inertia),
        range(s.drive_torque),
        range(s.brake_gain),
    );
    if s.ripple > 0.0 {
        out += &format!("; ±{} % along the disc and in time", number(100.0 * s.ripple));
    }
    if s.torque_noise > 0.0 {
        out += &format!("; torque noise up to {} N m", number(s.torque_noise));
    }
    out
}

/// The verdicts, a paragraph each.
pub(crate) fn lines(sampled: &Sampled, bound: &Bound) -> String {
    let scope = sampled.setup.as_ref().map(scope).unwrap_or_default();
    let error = match bound {
        Bound::Proven { checked, cells } => format!(
            "|e| stays below {} °, proven in {cells} cells of mu_d, the weakest {:.4} … {:.4} [{scope}]",
            number(checked.error_bound.to_degrees()),
            checked.limiting[0],
            checked.limiting[1]
        ),
        Bound::Open(cell) => format!("NOT certified (not shown unsafe): {cell} [{scope}]"),
        Bound::Unstable => {
            format!("NOT certified: the loop is linearly unstable, no bound is looked for [{scope}]")
        }
        Bound::NotCovered(why) => why.clone(),
        Bound::NotLookedFor => match &sampled.setup {
            Ok(_) => format!("error bound not looked for: --sampled does [{scope}]"),
            Err(why) => why.to_string(),
        },
    };
    let stability = match &sampled.setup {
        Ok(_) => sampled.stability_line(),
        Err(_) => "nothing is said of linear stability either".to_owned(),
    };
    [
        format!("as sampled: {error}"),
        format!("as sampled: {stability}"),
        "sticks: not excluded, neither by a bound nor by stability".to_owned(),
    ]
    .map(|verdict| paragraph(&verdict))
    .concat()
}

/// The same as an object.
pub(crate) fn json(sampled: &Sampled, bound: &Bound) -> Value {
    let checked = match bound {
        Bound::Proven { checked, cells } => Some((checked, cells)),
        _ => None,
    };
    value!({
        "not_covered": sampled.setup.as_ref().err().map(ToString::to_string),
        "scope": sampled.setup.as_ref().ok().map(scope),
        "error_bound_rad": bound.proven(),
        "limiting_friction_sliding": checked.map(|(c, _)| c.limiting),
        "cells": checked.map(|(_, cells)| cells),
        "reason": bound.reason(),
        "spectral_radius": sampled.stability.map(|radii| radii.map(|s| s.radius)),
        "stable": sampled.stable(),
        "sticks_excluded": false,
    })
}
