//! Certificates of candidates: each is found, and then checked by the checker, which shares nothing with the search.

use clutch_certificate::{Certificate, Gains, Options, checker, largest, search};
use clutch_sim::Scenario;
use clutch_sim::ScenarioError;
use clutch_sim::scenario::{Proven, Value};
use clutch_sim::smooth_speed::RATE;

/// A shell that is tried around a law.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ShellTried {
    /// `f`, 1/s.
    pub slope_1_s: f64,
    /// `S`, rad/s.
    pub boundary_rad_s: f64,
    /// Smoothing of (5), by which the shell knows the rate.
    pub smoothing: f64,
}

/// `f`, 1/s, and `S`, rad/s, of shells that let an edge of an encoder of 20 000 counts pass, the tightest first: it counts as
/// `κ q/T_s` = 0.06 rad/s.
const SHELLS: [[f64; 2]; 2] = [[50.0, 0.2], [70.0, 0.3]];
const COUNTS: f64 = 20_000.0;
/// Time constant `T_s/κ` of the rate that they know, s.
const FILTER_S: f64 = 0.005;

/// Shells that are tried, the tightest first. Their filter's time is the same at each period. One of a coarser encoder has to be
/// wider, and slower as well: within it the shaft goes on for `1/f`.
pub(crate) fn shells(base: &Scenario) -> [ShellTried; 2] {
    let spec = base.spec();
    let coarser = (COUNTS / f64::from(spec.rig.encoder.sensor.counts_per_rev)).max(1.0).sqrt();
    let smoothing = (spec.period.seconds::<f64>() / FILTER_S).min(1.0);
    SHELLS.map(|[slope, boundary]| ShellTried {
        slope_1_s: typed(slope / coarser),
        boundary_rad_s: typed(boundary * coarser),
        smoothing: typed(smoothing),
    })
}

/// Four digits: what is typed again is what was run.
pub(crate) fn typed(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Effort of a search: comparisons per attempt, some seconds.
const WORK: u64 = 2_500_000_000;
const WORK_ALONE: u64 = 200_000_000;
/// Widest cell of a shell, largest `μ_d` over smallest.
const WIDE: f64 = 1.5;
/// Errors above this are not worth proving, rad.
const WORST: f64 = 6.0_f64.to_radians();

/// Bounds that were proven, one for each rate.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
    /// The bound at each rate, in words with its scope.
    pub(crate) lines: Vec<String>,
    /// The largest, rad.
    pub(crate) error_rad: f64,
    /// The certificate of the scenario's own rate, for a file.
    pub(crate) certificate: Certificate,
}

/// Looks for a bound at each rate, the first of which is the scenario's; what limits, where there is none.
pub(crate) fn prove(
    scenario: &Scenario,
    rates_deg_s: &[f64],
) -> Result<Result<Bounds, String>, ScenarioError> {
    let (mut lines, mut error_rad, mut first) = (Vec::new(), 0.0_f64, None);
    for rate in rates_deg_s {
        let set = [(RATE.to_owned(), Value::Float(*rate))];
        let here = Scenario::from_table(scenario.name(), scenario.table().clone(), &set)?;
        let sampled = here.sampled(&here.plan()?.bounds);
        let setup = match &sampled.setup {
            Ok(setup) => setup,
            Err(why) => return Ok(Err(why.to_string())),
        };
        let shell = sampled.any_law();
        if let (false, Some(radii)) = (shell, &sampled.stability)
            && largest(radii) >= 1.0
        {
            return Ok(Err(format!("the sampled loop is unstable, spectral radius {:.3}", largest(radii))));
        }
        let options = Options {
            refinements: 0,
            work: if shell { WORK } else { WORK_ALONE },
            // A shell minds little how strong the brake is: a wide cell costs less than many narrow ones, and where it did not
            // close, narrow ones did not either (docs/tune.md).
            widest: if shell { WIDE } else { Options::default().widest },
            narrowest: if shell { WIDE } else { Options::default().narrowest },
            error_limit: WORST,
            // Nor is patience worth its minute with an integral.
            patient: !matches!(setup.law, Gains::Shell { .. } | Gains::Integral { .. }),
        };
        let found = search(setup, &options, false);
        if let Some(open) = found.open.first() {
            let how = if open.grew { "grew beyond all limits" } else { "did not close" };
            return Ok(Err(format!(
                "no proof found at {rate} °/s (not shown unsafe): for mu_d {:.4} … {:.4} the set {how}",
                open.sliding[0], open.sliding[1]
            )));
        }
        // Nothing is believed that the checker does not pass.
        let checked = match checker::check(&found.certificate) {
            Ok(checked) => checked,
            Err(flaw) => return Ok(Err(format!("the proof does not pass its check: {flaw}"))),
        };
        let proven = Proven { checked, cells: found.certificate.cells.len() };
        lines.push(sampled.bound_line(&proven));
        error_rad = error_rad.max(checked.error_bound);
        first.get_or_insert(found.certificate);
    }
    Ok(match first {
        Some(certificate) => Ok(Bounds { lines, error_rad, certificate }),
        None => Err("no rate".to_owned()),
    })
}
