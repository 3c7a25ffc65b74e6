//! Verdicts on the sampled loop: the error bound, linear stability, sticks; each with its scope.

use crate::output::paragraph;
use clutch_certificate::Certificate;
use clutch_sim::scenario::{CertificateError, Proven, STICKS, Sampled, Unproven};
use serde_json::{Value, json as value};
use std::path::{Path, PathBuf};

/// The question about the error as sampled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Asked {
    /// None.
    Nothing,
    /// A proof is looked for.
    Search,
    /// The proof in a file is checked.
    Check(PathBuf),
}

/// The verdict on the error as sampled.
pub(crate) enum Bound {
    /// It was not asked for.
    NotLookedFor,
    /// The scenario has none.
    NotCovered(String),
    /// Proven and checked.
    Proven(Proven),
    /// Not proven, which does not mean unsafe.
    Open(String),
    /// Not looked for: the loop is linearly unstable.
    Unstable,
}

impl Bound {
    /// The verdict, and the proof that was found.
    pub(crate) fn of(sampled: &Sampled, asked: &Asked) -> anyhow::Result<(Bound, Option<Certificate>)> {
        match asked {
            Asked::Nothing => Ok((Bound::NotLookedFor, None)),
            Asked::Search => Bound::search(sampled),
            Asked::Check(file) => Ok((Bound::of_file(sampled, file)?, None)),
        }
    }

    /// Looks for a proof, and checks it.
    fn search(sampled: &Sampled) -> anyhow::Result<(Bound, Option<Certificate>)> {
        let without = match sampled.prove() {
            Ok((proven, certificate)) => return Ok((Bound::Proven(proven), Some(certificate))),
            Err(Unproven::NotCovered(why)) => Bound::NotCovered(why.to_string()),
            Err(Unproven::Unstable) => Bound::Unstable,
            Err(Unproven::Open(cell)) => Bound::Open(cell),
            Err(defect @ Unproven::Refused(_)) => return Err(defect.into()),
        };
        Ok((without, None))
    }

    /// Checks the proof of a file, and that it is this scenario's.
    fn of_file(sampled: &Sampled, path: &Path) -> anyhow::Result<Bound> {
        match sampled.proven_by(path) {
            Ok(proven) => Ok(Bound::Proven(proven)),
            Err(CertificateError::NotCovered(why)) => Ok(Bound::NotCovered(why.to_string())),
            Err(refusal) => Err(refusal.into()),
        }
    }

    /// The bound on `|e|`, rad.
    pub(crate) fn proven(&self) -> Option<f64> {
        match self {
            Bound::Proven(proven) => Some(proven.checked.error_bound),
            _ => None,
        }
    }

    fn reason(&self) -> Option<String> {
        match self {
            Bound::Proven(_) => None,
            Bound::NotLookedFor => Some("not looked for".to_owned()),
            Bound::NotCovered(why) => Some(why.clone()),
            Bound::Open(cell) => Some(format!("not certified (not shown unsafe): {cell}")),
            Bound::Unstable => Some("not looked for: the sampled loop is linearly unstable".to_owned()),
        }
    }
}

/// The verdicts of a run for which no bound was looked for, a paragraph each.
pub(crate) fn short_lines(sampled: &Sampled) -> String {
    let verdicts = match &sampled.setup {
        Ok(_) => vec![
            "error bound not looked for: `clutch certify --sampled` does".to_owned(),
            sampled.stability_line(),
        ],
        Err(why) => vec![why.to_string()],
    };
    let gains: String = verdicts.iter().map(|v| paragraph(&format!("gains, as sampled: {v}"))).collect();
    gains + &paragraph(&format!("sticks: {STICKS}"))
}

/// The verdicts, a paragraph each.
pub(crate) fn lines(sampled: &Sampled, bound: &Bound) -> String {
    let scope = sampled.scope();
    let error = match bound {
        Bound::Proven(proven) => sampled.bound_line(proven),
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
    [format!("as sampled: {error}"), format!("as sampled: {stability}"), format!("sticks: {STICKS}")]
        .map(|verdict| paragraph(&verdict))
        .concat()
}

/// The same as an object.
pub(crate) fn json(sampled: &Sampled, bound: &Bound) -> Value {
    let proven = match bound {
        Bound::Proven(proven) => Some(proven),
        _ => None,
    };
    value!({
        "not_covered": sampled.setup.as_ref().err().map(ToString::to_string),
        "scope": sampled.setup.as_ref().ok().map(|_| sampled.scope()),
        "looked_for": !matches!(bound, Bound::NotLookedFor),
        "error_bound_rad": bound.proven(),
        "limiting_friction_sliding": proven.map(|p| p.checked.limiting),
        "any_law": sampled.any_law(),
        "cells": proven.map(|p| p.cells),
        "reason": bound.reason(),
        "slower_fall": sampled.slower_fall,
        "spectral_radius": sampled.radii(),
        "stable": sampled.stable(),
        "sticks_excluded": false,
    })
}
