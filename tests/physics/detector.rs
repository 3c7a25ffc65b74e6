//! The online detector on encoder counts against the simulator's ground truth.
//!
//! The figures below are those of docs/theory.md; this test holds them.

use clutch_core::law::{LawParams, PdParams, SmcParams};
use clutch_core::reference::ReferenceParams;
use clutch_sim::engine::EventKind;
use clutch_sim::{RigParams, Run, RunSpec, simulate};

/// A stick shorter than this (s) is not required: nothing on the encoder distinguishes it from
/// motion.
fn visible(rate_deg_s: f64) -> f64 {
    // The detector waits for the path to move 1.25 counts and for 6 ticks.
    (1.25 * 0.018 / rate_deg_s).max(6e-3)
}

/// True stuck intervals after settling.
fn sticks(run: &Run) -> Vec<(f64, f64)> {
    let mut out = Vec::new();
    let mut since = None;
    for e in &run.events {
        match e.kind {
            EventKind::Stick => since = Some(e.time),
            EventKind::BreakAway => {
                if let Some(s) = since.take() {
                    out.push((s, e.time));
                }
            }
        }
    }
    out.retain(|(s, _)| *s >= 1.0);
    out
}

/// Precision, recall (of visible sticks) and cycles per second off the truth, over ten seeds.
fn measure(rig: &RigParams, law: LawParams, rate: f64) -> (f64, f64, f64, f64) {
    let (mut hits, mut calls, mut found, mut wanted) = (0, 0, 0, 0);
    let (mut seen, mut truth) = (0.0, 0.0);
    for seed in 1..=10 {
        let mut spec = RunSpec::new(rig.clone(), law, ReferenceParams::ramp(rate.to_radians()));
        spec.run.seed = seed;
        let run = simulate::<f64>(&spec).unwrap();
        let true_sticks = sticks(&run);
        let called: Vec<f64> =
            run.detections.iter().map(|k| *k as f64 * 1e-3).filter(|t| *t >= 1.0).collect();
        calls += called.len();
        // A call is right if the shaft was stuck at some time in the silence that led to it.
        let window = visible(rate) + 2e-3;
        hits += called
            .iter()
            .filter(|t| true_sticks.iter().any(|(a, b)| **t >= *a && **t - window <= *b))
            .count();
        let long: Vec<_> = true_sticks.iter().filter(|(a, b)| b - a >= visible(rate)).collect();
        wanted += long.len();
        found += long.iter().filter(|(a, b)| called.iter().any(|t| *t >= *a && *t <= *b + 2e-3)).count();
        seen += run.detected.stick_slip_cycles_per_s / 10.0;
        truth += run.metrics.stick_slip_cycles_per_s / 10.0;
    }
    let share = |a: usize, b: usize| if b == 0 { 1.0 } else { a as f64 / b as f64 };
    (share(hits, calls), share(found, wanted), seen, truth)
}

#[test]
fn the_detector_agrees_with_the_truth_within_the_stated_band() {
    let pd = LawParams::Pd(PdParams::default());
    let smc = LawParams::Smc(SmcParams::default());
    for (name, rig) in [("paper", RigParams::paper()), ("bench", RigParams::bench())] {
        for (law_name, law) in [("PD", pd), ("SMC", smc)] {
            for rate in [2.0, 6.0, 10.0, 20.0] {
                let (precision, recall, seen, truth) = measure(&rig, law, rate);
                let row = format!(
                    "| {name} | {law_name} | {rate} | {precision:.2} | {recall:.2} | {seen:.1} | {truth:.1} |"
                );
                println!("{row}");
                // The stated band: cycles per second within 4 and 20 % of the truth.
                assert!((seen - truth).abs() <= 4.0 + 0.2 * truth, "{row}");
                // Where sticks are common, most calls are right and most long sticks are called.
                if truth >= 10.0 {
                    assert!(precision >= 0.75 && recall >= 0.9, "{row}");
                }
            }
        }
    }
}
