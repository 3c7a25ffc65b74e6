//! Runs as a page draws them: closely in a window that they share, and whole as envelopes.

use crate::json::{list, number, object, text};
use clutch_sim::picture::{Envelope, PARTS, Window};
use clutch_sim::{Metrics, Run, Scenario};

/// Each run with its figures and curves, or the error that there is in its place; and the window.
pub(crate) fn drawn(runs: &[Result<&(Scenario, Run), &str>]) -> String {
    let done = runs.iter().filter_map(|r| r.ok().map(|(scenario, run)| (scenario, run)));
    let window = Window::shared(done);
    let ends =
        |w: Window| object([("from_s", number(w.from)), ("to_s", number(w.to)), ("words", text(&w.words()))]);
    let one = |run: &Result<&(Scenario, Run), &str>| match run {
        Ok((scenario, run)) => object([
            ("metrics", metrics(&run.metrics)),
            ("window", window.map_or_else(none, |w| close(w, scenario, run))),
            ("error_deg", envelope(run, &run.trace.error, 1.0_f64.to_degrees())),
            ("voltage_v", envelope(run, &run.trace.voltage, 1.0)),
        ]),
        Err(error) => object([("error", text(error))]),
    };
    object([("window", window.map_or_else(none, ends)), ("runs", list(runs.iter().map(one)))])
}

fn none() -> String {
    "null".to_owned()
}

/// As `clutch sim --json` has them.
fn metrics(metrics: &Metrics) -> String {
    object(Metrics::FIGURES.iter().map(|f| (f.field, f.of(metrics).map_or_else(none, number))))
}

/// The stretch of a run in a window: the encoder's counts and the path, from where the path is at its begin, and velocities.
fn close(window: Window, scenario: &Scenario, run: &Run) -> String {
    let trace = &run.trace;
    let samples = window.samples(trace);
    let [path, counts] = window.staircase(trace);
    let rests = window.sticks(&run.events, scenario.spec().run.duration);
    object([
        ("time_s", numbers(&trace.time[samples.clone()], 1.0)),
        ("path_counts", numbers(&path, 1.0)),
        ("counts", numbers(&counts, 1.0)),
        ("velocity_deg_s", numbers(&trace.velocity[samples.clone()], 1.0_f64.to_degrees())),
        ("path_velocity_deg_s", numbers(&trace.target_velocity[samples], 1.0_f64.to_degrees())),
        ("rests_s", list(rests.iter().map(|s| numbers(&[s.from, s.to], 1.0)))),
    ])
}

fn envelope(run: &Run, values: &[f64], factor: f64) -> String {
    let e = Envelope::new(&run.trace.time, values, PARTS);
    object([
        ("time_s", numbers(&e.time, 1.0)),
        ("low", numbers(&e.low, factor)),
        ("high", numbers(&e.high, factor)),
        ("mean", numbers(&e.mean, factor)),
    ])
}

/// Values in another unit, as exactly as a picture shows them: half as many digits to send.
fn numbers(values: &[f64], factor: f64) -> String {
    list(
        values
            .iter()
            .map(|x| (x * factor) as f32)
            .map(|x| if x.is_finite() { x.to_string() } else { none() }),
    )
}
