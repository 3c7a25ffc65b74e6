//! Verdicts on the sampled loop, each with its scope: the error bound, linear stability.

use super::sampled::{AT_ONCE, NotCovered, gains, sampled_laws};
use super::{Scenario, another_loop};
use crate::number;
use clutch_certificate::checker::{self, Checked, Refused};
use clutch_certificate::file::{self, FileError};
use clutch_certificate::{Certificate, Gains, Options, Setup, Stability, largest, search, stability};
use clutch_core::Bounds;
use clutch_core::params::{KG_M2, NM, NM_S_RAD, NM_V, NONE};
use std::path::Path;

/// The name of the verdict in continuous time: a column of a sweep, a field of a loop's summary, an entry of its log.
pub const CERTIFIED: &str = "certified_continuous_time";
/// The verdict on sticks.
pub const STICKS: &str = "not excluded, neither by a bound nor by stability";

/// Verdicts on a sampled loop that cost nothing, and the box for the one that does.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// The loop and the box of plants, or why there is none.
    pub setup: Result<Setup, NotCovered>,
    /// Spectral radii with the weakest, a middle and the strongest brake.
    pub stability: Option<[Stability; 3]>,
    /// The fall of the rig's friction from rest, if it is slower than the one of which a bound speaks.
    pub slower_fall: Option<String>,
}

/// A bound on the error that the checker has passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proven {
    /// The checker's statement.
    pub checked: Checked,
    /// Cells of `μ_d` that it took.
    pub cells: usize,
}

/// A saved certificate proves nothing for a scenario.
#[derive(Debug, thiserror::Error)]
pub enum CertificateError {
    /// The file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The scenario has no sampled certificate.
    #[error(transparent)]
    NotCovered(#[from] NotCovered),
    /// The certificate is another loop's.
    #[error("{name}: the certificate is another loop's; they differ in these, the scenario's value first:\n  {}", .differences.join("\n  "))]
    Other {
        /// The file.
        name: String,
        /// Quantities with both values, the scenario's first.
        differences: Vec<String>,
    },
    /// The proof does not hold.
    #[error("{name}: the proof does not hold: {refused}")]
    Refused {
        /// The file.
        name: String,
        /// The first flaw.
        refused: Refused,
    },
}

/// There is no proof of a bound, which does not mean that the loop is unsafe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unproven {
    /// The scenario has no sampled certificate.
    #[error(transparent)]
    NotCovered(#[from] NotCovered),
    /// The loop is linearly unstable.
    #[error("not looked for: the sampled loop is linearly unstable")]
    Unstable,
    /// The search left a cell open, which is named.
    #[error("not certified (not shown unsafe): {0}")]
    Open(String),
    /// A defect of the search.
    #[error("the proof that was found does not pass its check: {0}; please report this as a defect")]
    Refused(Refused),
}

impl Sampled {
    /// Looks for a proof of a bound on the error, and checks it: seconds.
    ///
    /// # Errors
    /// There is none, or none was found.
    pub fn prove(&self) -> Result<(Proven, Certificate), Unproven> {
        let setup = self.setup.as_ref().map_err(NotCovered::clone)?;
        // A shell holds whatever law is within, stable or not.
        if self.runs_away() {
            return Err(Unproven::Unstable);
        }
        let found = search(setup, &Options::default(), false);
        if let Some(open) = found.open.first() {
            let how = if open.grew {
                "the set grew beyond all limits"
            } else {
                "the search ended before the set was closed"
            };
            let [low, high] = open.sliding;
            return Err(Unproven::Open(format!("for mu_d {low:.4} … {high:.4} {how}")));
        }
        // Nothing is believed that the checker does not pass.
        let checked = checker::check(&found.certificate).map_err(Unproven::Refused)?;
        Ok((Proven { checked, cells: found.certificate.cells.len() }, found.certificate))
    }

    /// Small deviations die out, with the weakest, a middle and the strongest brake; none where nothing is known.
    #[must_use]
    pub fn stable(&self) -> Option<bool> {
        self.radius().map(|radius| radius < 1.0)
    }

    /// Spectral radii with the weakest, a middle and the strongest actuator, if they are known.
    #[must_use]
    pub fn radii(&self) -> Option<[f64; 3]> {
        self.stability.map(|radii| radii.map(|s| s.radius))
    }

    /// The largest of the spectral radii, if they are known.
    #[must_use]
    pub fn radius(&self) -> Option<f64> {
        self.stability.as_ref().map(largest)
    }

    /// True if small deviations grow, and no shell holds them.
    #[must_use]
    pub fn runs_away(&self) -> bool {
        self.stable() == Some(false) && !self.any_law()
    }

    /// True if any law stands within a shell.
    #[must_use]
    pub fn any_law(&self) -> bool {
        matches!(&self.setup, Ok(Setup { law: Gains::Shell { .. }, .. }))
    }

    /// True if a proven bound is all that is asked of the loop as sampled: it is linearly stable, or a shell holds whatever
    /// law is within.
    #[must_use]
    pub fn bound_suffices(&self) -> bool {
        self.any_law() || self.stable() == Some(true)
    }

    /// The proof of a file, checked in one sweep, if it is this loop's.
    ///
    /// # Errors
    /// The file is none, is another loop's, or its proof does not hold.
    pub fn proven_by(&self, path: &Path) -> Result<Proven, CertificateError> {
        let certificate = file::read(path)?;
        let setup = self.setup.as_ref().map_err(NotCovered::clone)?;
        let name = path.display().to_string();
        let differences = another_loop::differences(setup, &certificate.setup);
        if !differences.is_empty() {
            return Err(CertificateError::Other { name, differences });
        }
        match checker::check(&certificate) {
            Ok(checked) => Ok(Proven { checked, cells: certificate.cells.len() }),
            Err(refused) => Err(CertificateError::Refused { name, refused }),
        }
    }

    /// The plants and the loop that a bound speaks of; empty where there is none.
    #[must_use]
    pub fn scope(&self) -> String {
        self.setup.as_ref().map(scope).unwrap_or_default()
    }

    /// The verdict on the error with its scope.
    #[must_use]
    pub fn bound_line(&self, proven: &Proven) -> String {
        let Proven { checked, cells } = proven;
        let law = if self.any_law() { " with any inner law" } else { "" };
        let slower =
            self.slower_fall.as_ref().map_or(String::new(), |fall| format!("; not of this rig: {fall}"));
        format!(
            "|e| stays below {} °{law}, proven in {cells} {} of mu_d, the weakest {:.4} … {:.4} [{}]{slower}",
            number(checked.error_bound.to_degrees()),
            if *cells == 1 { "cell" } else { "cells" },
            checked.limiting[0],
            checked.limiting[1],
            self.scope()
        )
    }

    /// The verdict on the error with its scope, or that there is none.
    #[must_use]
    pub fn bound_if_any(&self, proven: Option<&Proven>) -> String {
        let none = || "the bound of the error is uncertified: no certificate was given".to_owned();
        proven.map_or_else(none, |proven| self.bound_line(proven))
    }

    /// The verdicts with their scopes, each by its name in a log. `certified`: in continuous time.
    #[must_use]
    pub fn verdicts(&self, certified: bool, proven: Option<&Proven>) -> [(String, String); 4] {
        [
            (CERTIFIED, certified.to_string()),
            ("as_sampled", self.bound_if_any(proven)),
            ("linear_stability", self.stability_line()),
            ("sticks", STICKS.to_owned()),
        ]
        .map(|(name, verdict)| (name.to_owned(), verdict))
    }

    /// The verdicts in a line of a table: on the error with the box of its bound, on linear stability, on sticks.
    #[must_use]
    pub fn short_line(&self, proven: Option<&Proven>) -> String {
        let error = match proven {
            Some(proven) => {
                let law = if self.any_law() { " with any inner law" } else { "" };
                let bound = number(proven.checked.error_bound.to_degrees());
                let within = self.setup.as_ref().map(short_scope).unwrap_or_default();
                format!("|e| below {bound} °{law}, certified for {within}")
            }
            None => "error bound UNCERTIFIED".to_owned(),
        };
        let stability = match &self.stability {
            Some(radii) => {
                let verdict = if largest(radii) < 1.0 { "linearly stable" } else { "linearly UNSTABLE" };
                format!("{verdict}, spectral radius up to {:.3}", largest(radii))
            }
            None => "linear stability not known".to_owned(),
        };
        format!("{error}; {stability}; sticks not excluded")
    }

    /// The verdict on linear stability with its scope.
    #[must_use]
    pub fn stability_line(&self) -> String {
        match (&self.stability, &self.setup) {
            (Some(radii), _) => {
                let verdict = if largest(radii) < 1.0 { "linearly stable" } else { "linearly UNSTABLE" };
                let [weak, middle, strong] = radii.map(|s| s.radius);
                let law = if self.any_law() { "the law within the shell is " } else { "" };
                let motor = self.setup.as_ref().is_ok_and(|s| s.motor.is_some());
                let of = if motor { "motor" } else { "brake" };
                format!(
                    "{law}{verdict}: spectral radius {weak:.3}, {middle:.3}, {strong:.3} with the weakest, a middle and the strongest {of}, while nothing saturates or sticks"
                )
            }
            (None, Err(why)) => why.to_string(),
            (None, Ok(_)) => {
                format!("linear stability is not known: it is computed for {}", sampled_laws(false))
            }
        }
    }
}

/// True of a quantity that is known exactly.
fn exact([low, high]: [f64; 2]) -> bool {
    high - low <= 1e-12 * high
}

fn ticks(s: &Setup) -> String {
    format!("{} {} of delay", s.delay_ticks, if s.delay_ticks == 1 { "tick" } else { "ticks" })
}

/// The sides of the box that are no points, its ramp and its delay.
fn short_scope(s: &Setup) -> String {
    let (name, gain) = gain(s);
    let sides = [
        ("mu_d", s.sliding, NONE),
        ("mu_s", s.at_rest, NONE),
        ("T_u", s.drive_torque, NM),
        (name, gain, NM_V),
        ("J", s.inertia, KG_M2),
        ("C_d", s.viscous_damping, NM_S_RAD),
    ];
    let mut parts = vec![format!("a ramp at {} °/s", number(s.rate.to_degrees())), ticks(s)];
    parts.extend(sides.into_iter().filter(|(_, side, _)| !exact(*side)).map(|(name, [low, high], unit)| {
        format!("{name} {} … {} {}", number(low), number(high), unit.text).trim_end().to_owned()
    }));
    if s.ripple > 0.0 {
        parts.push(format!("±{} % along the disc", number(100.0 * s.ripple)));
    }
    if s.torque_noise > 0.0 {
        parts.push(format!("torque noise up to {} N m", number(s.torque_noise)));
    }
    parts.push("[model] for the rest".to_owned());
    parts.join(", ")
}

/// The actuator's gain, by its symbol.
fn gain(s: &Setup) -> (&'static str, [f64; 2]) {
    s.motor.as_ref().map_or(("K_COF", s.brake_gain), |motor| ("k_t", motor.gain))
}

/// Every plant and everything of the loop that a bound speaks of, but the gains of the law.
fn scope(s: &Setup) -> String {
    let range = |side: [f64; 2]| {
        let [low, high] = side;
        if exact(side) { number(low) } else { format!("{} … {}", number(low), number(high)) }
    };
    let (name, gain) = gain(s);
    // A slower fall leaves more of it at speeds that count as fast.
    let [velocity, exponent] = s.stribeck;
    let falls = if s.at_rest[1] <= s.sliding[0] {
        String::new()
    } else if velocity <= AT_ONCE {
        ", which falls at once".to_owned()
    } else {
        format!(", v_s up to {} rad/s, δ {}", number(velocity), number(exponent))
    };
    let steps = if s.converter_step > 0.0 {
        format!(" in steps of {}", number(s.converter_step))
    } else {
        String::new()
    };
    let mut out = format!(
        "every {} µs, {}, {} counts/rev, K_Kal {}, volts {}{steps}; ramp at {} °/s, {} with {} V; mu_d {}, mu_s {}{}{falls}; J {} kg m², T_u {} N m, C_d {} N m s/rad, {name} {} N m/V",
        number(1e6 * s.period_s),
        ticks(s),
        s.counts_per_rev,
        number(s.smoothing),
        range(s.volts),
        number(s.rate.to_degrees()),
        if s.from_rest { "from rest" } else { "begun at its speed" },
        range(s.start_volts),
        range(s.sliding),
        range(s.at_rest),
        if s.rest_not_below_sliding { ", never below mu_d" } else { "" },
        range(s.inertia),
        range(s.drive_torque),
        range(s.viscous_damping),
        range(gain),
    );
    if let Some(motor) = &s.motor {
        out += &format!(", N_0 {} N m", number(motor.preload));
    }
    if let Gains::Shell { slope, boundary } = s.law {
        out += &format!("; shell f {} 1/s, S {} rad/s", number(slope), number(boundary));
    }
    if s.ripple > 0.0 {
        out += &format!("; ±{} % along the disc and in time", number(100.0 * s.ripple));
    }
    if s.torque_noise > 0.0 {
        out += &format!("; torque noise up to {} N m", number(s.torque_noise));
    }
    out
}

impl Scenario {
    /// The verdicts on the sampled loop that cost nothing.
    #[must_use]
    pub fn sampled(&self, bounds: &Bounds) -> Sampled {
        let setup = self.sampled_setup(bounds);
        // A shell has no gains: the law within has, where it is one of these.
        let within = |s: &Setup| {
            let gains = gains(&self.params.law, s.rate, self.limits(), s.motor.is_some());
            gains.and_then(|law| stability(&Setup { law, ..s.clone() }))
        };
        let stability = setup.as_ref().ok().and_then(within);
        let slower_fall = setup.as_ref().ok().and_then(|s| self.slower_fall(s.stribeck));
        Sampled { setup, stability, slower_fall }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_certificate::Motor;

    #[test]
    fn the_box_of_a_bound_tells_all_that_its_proof_is_for() {
        let mut setup = Setup::paper(Gains::Linear { kp: 5000.0, kd: 50.0, forward: 0.0 });
        assert_eq!(
            scope(&setup),
            "every 1000 µs, 0 ticks of delay, 20000 counts/rev, K_Kal 0.2, volts 0 … 9.995 in steps of 0.0048828; ramp at 2 °/s, \
             begun at its speed with 1.68 … 2.25 V; mu_d 0.15, mu_s 0.2, never below mu_d, v_s up to 0.001 rad/s, δ 1; \
             J 0.0017 kg m², T_u 0.047088 N m, C_d 0.001 N m s/rad, K_COF 0.14 N m/V"
        );
        // Each quantity of the proof that is not the law's changes the line.
        let before = scope(&setup);
        let changes: [fn(&mut Setup); 19] = [
            |s| s.period_s = 0.002,
            |s| s.counts_per_rev = 4096,
            |s| s.inertia[1] = 0.002,
            |s| s.drive_torque[0] = 0.04,
            |s| s.viscous_damping = [0.0, 0.002],
            |s| s.brake_gain[1] = 0.2,
            |s| s.motor = Some(Motor { gain: [0.05; 2], preload: 0.2 }),
            |s| s.sliding[0] = 0.1,
            |s| s.at_rest[1] = 0.3,
            |s| s.rest_not_below_sliding = false,
            |s| s.stribeck[0] = 0.002,
            |s| s.ripple = 0.1,
            |s| s.torque_noise = 0.001,
            |s| s.delay_ticks = 1,
            |s| s.converter_step = 0.0,
            |s| s.volts[1] = 5.0,
            |s| s.smoothing = 0.5,
            |s| s.from_rest = true,
            |s| s.start_volts[0] = 0.0,
        ];
        for (k, change) in changes.iter().enumerate() {
            let mut other = setup.clone();
            change(&mut other);
            assert_ne!(scope(&other), before, "change {k}");
        }
        setup.viscous_damping = [0.0005, 0.0015];
        assert!(scope(&setup).contains("C_d 0.0005 … 0.0015 N m s/rad"));
    }
}
