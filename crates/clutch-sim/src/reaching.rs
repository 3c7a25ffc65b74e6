//! Time in which a run reached its sliding surface, against what the certificate promises.

use crate::run::Trace;
use clutch_core::certificate::Certificate;
use serde::Serialize;

/// Time in which the sliding surface was reached, against the bound (15).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Reaching {
    /// Time until `σ = f e + ė`, with the true velocity, was first within the law's layer, s; none
    /// if it never was, or for a law without a surface.
    pub time_s: Option<f64>,
    /// The bound (15) of the certificate, s; none where nothing is certified or `γ` is 0.
    pub bound_s: Option<f64>,
}

impl Reaching {
    /// Reaching of a run, by the surface and the layer of the law's certificate.
    #[must_use]
    pub fn new(trace: &Trace, c: &Certificate) -> Reaching {
        let surface = |i: usize| c.slope * trace.error[i] + trace.target_velocity[i] - trace.velocity[i];
        // A law without a layer never is within it; a hair's breadth stands in.
        let within = c.layer.max(1e-3);
        let first = (0..trace.time.len()).find(|i| surface(*i).abs() <= within);
        Reaching {
            time_s: first.filter(|_| c.slope > 0.0).map(|i| trace.time[i]),
            bound_s: if trace.time.is_empty() { None } else { c.reaching_time(surface(0)) },
        }
    }
}
