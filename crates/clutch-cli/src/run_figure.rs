//! Runs on common axes: closely in a window around a stick, and whole as envelopes.

use crate::plot::{Figure, Panel, Series, Shade};
use crate::table::number;
use clutch_sim::picture::{Envelope, PARTS, Window};
use clutch_sim::{Run, Scenario};

/// A run to be drawn.
pub(crate) struct Drawn<'a> {
    pub(crate) label: String,
    pub(crate) scenario: &'a Scenario,
    pub(crate) run: &'a Run,
}

/// The window that the runs are shown in.
pub(crate) fn window(runs: &[Drawn<'_>]) -> Option<Window> {
    Window::shared(runs.iter().map(|d| (d.scenario, d.run)))
}

impl Drawn<'_> {
    /// Values over the time of the window.
    fn within(&self, window: Window, values: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
        let time = &self.run.trace.time[window.samples(&self.run.trace)];
        time.iter().copied().zip(values).collect()
    }

    /// An angle or its rate over the time of the window, in degrees.
    fn degrees(&self, window: Window, values: &[f64]) -> Vec<(f64, f64)> {
        self.within(window, values[window.samples(&self.run.trace)].iter().map(|x| x.to_degrees()))
    }

    fn counts_per_rev(&self) -> u32 {
        self.scenario.spec().rig.encoder.sensor.counts_per_rev
    }

    /// The path and the encoder's counts, from where the path is at the window's begin.
    fn staircase(&self, window: Window, unit: f64) -> [Vec<(f64, f64)>; 2] {
        let counts = window.staircase(&self.run.trace);
        counts.map(|counts| self.within(window, counts.into_iter().map(|x| x * unit)))
    }

    fn envelope(&self, values: &[f64], factor: f64) -> Series {
        Series::envelope(&self.label, &Envelope::new(&self.run.trace.time, values, PARTS), factor)
    }
}

/// Guides that are the same are drawn once; the first has the name.
fn guides(label: &str, paths: Vec<Vec<(f64, f64)>>) -> Vec<Series> {
    let mut guides: Vec<Series> = Vec::new();
    for points in paths {
        if guides.iter().all(|g| g.points != points) {
            let label = if guides.is_empty() { label } else { "" };
            guides.push(Series { guide: true, ..Series::new(label, points) });
        }
    }
    guides
}

/// The figure of one run, or of several on the same axes: position and velocity in the window left, error and voltage of
/// the whole right.
pub(crate) fn figure(title: &str, runs: &[Drawn<'_>]) -> Figure {
    let alone = runs.len() == 1;
    let mut panels = Vec::new();
    if let Some(window) = window(runs) {
        let shades = || {
            let one = |(i, d): (usize, &Drawn<'_>)| Shade {
                label: if alone { "at rest".to_owned() } else { String::new() },
                stretches: window
                    .sticks(&d.run.events, d.scenario.spec().run.duration)
                    .into_iter()
                    .map(|s| (s.from, s.to))
                    .collect(),
                of: Some(i),
            };
            runs.iter().enumerate().map(one).collect::<Vec<_>>()
        };
        let close = |title: String, y_label: &str, curves: Vec<Series>, paths: Vec<Series>, step| Panel {
            title,
            x_label: "time (s)".to_owned(),
            y_label: y_label.to_owned(),
            // Guides last: a curve has the colour of its place.
            series: curves.into_iter().chain(paths).collect(),
            shades: shades(),
            step,
            ..Panel::default()
        };
        let same = runs.iter().all(|d| d.counts_per_rev() == runs[0].counts_per_rev());
        let (mut stairs, mut paths) = (Vec::new(), Vec::new());
        for d in runs {
            let unit = if same { 1.0 } else { 360.0 / f64::from(d.counts_per_rev()) };
            let [path, counts] = d.staircase(window, unit);
            stairs.push(Series::new(&d.label, counts));
            paths.push(path);
        }
        if alone {
            stairs[0].label = "encoder".to_owned();
        }
        let position = if same { "position (counts)" } else { "position (°)" };
        panels.push(close(
            format!("{} ms {}", number((1e3 * (window.to - window.from)).round()), window.words()),
            position,
            stairs,
            guides("path", paths),
            true,
        ));
        let velocities = runs.iter().map(|d| {
            let label = if alone { "shaft".to_owned() } else { d.label.clone() };
            Series::new(label, d.degrees(window, &d.run.trace.velocity))
        });
        let targets = runs.iter().map(|d| d.degrees(window, &d.run.trace.target_velocity)).collect();
        let at_rest = if alone { "The same: velocity" } else { "The same: velocity; strips on top: at rest" };
        let velocity =
            close(at_rest.to_owned(), "velocity (°/s)", velocities.collect(), guides("path", targets), false);
        panels.push(velocity);
        let mark =
            Shade { label: "the window".to_owned(), stretches: vec![(window.from, window.to)], of: None };
        let whole = |title: &str, y_label: &str, series: Vec<Series>| Panel {
            title: title.to_owned(),
            x_label: "time (s)".to_owned(),
            y_label: y_label.to_owned(),
            series: series
                .into_iter()
                .map(|s| Series { label: if alone { "mean".to_owned() } else { s.label }, ..s })
                .collect(),
            shades: vec![mark.clone()],
            ..Panel::default()
        };
        let errors = runs.iter().map(|d| d.envelope(&d.run.trace.error, 1.0_f64.to_degrees())).collect();
        panels.insert(1, whole("The whole run: error, lowest to highest and mean", "error (°)", errors));
        let volts = runs.iter().map(|d| d.envelope(&d.run.trace.voltage, 1.0)).collect();
        panels.push(whole("The whole run: voltage, lowest to highest and mean", "voltage (V)", volts));
    }
    Figure { title: title.to_owned(), columns: 2, panels, ..Figure::default() }
}
