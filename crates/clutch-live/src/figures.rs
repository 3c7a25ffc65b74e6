//! The figures of a run, as characters.

use crate::view::{Frame as Figure, Histogram, Note, Opening};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Sparkline};
use std::collections::VecDeque;

/// Time around now, s: position and path.
const NOW: f64 = 0.3;
/// Time of the envelopes, s.
const WHILE: f64 = 20.0;
/// Notes that are kept.
const NOTES: usize = 20;
/// The smallest screen.
const LEAST: (u16, u16) = (40, 10);
/// Rows from which there is room for the voltage's curve.
const TALL: u16 = 20;

/// A point of position and path.
#[derive(Clone, Copy, Debug)]
struct Point {
    time: f64,
    target: f64,
    position: f64,
}

/// The span of a value over a frame.
#[derive(Clone, Copy, Debug)]
struct Envelope {
    time: f64,
    low: f64,
    high: f64,
}

/// The figures.
#[derive(Debug, Default)]
pub(crate) struct Figures {
    /// True if the terminal may show colours.
    colour: bool,
    title: String,
    duration: f64,
    volts: [f64; 2],
    classes: &'static [u32],
    now: VecDeque<Point>,
    error: VecDeque<Envelope>,
    voltage: VecDeque<Envelope>,
    /// Error and voltage of the last sample; the error is not a number where no law was asked.
    last: (f64, f64),
    time: f64,
    state: &'static str,
    cycles: u64,
    cycles_per_s: f64,
    largest_error: f64,
    lost: u64,
    misses: u64,
    answers: Histogram,
    wake_ups: Histogram,
    notes: VecDeque<(f64, String, bool)>,
}

impl Figures {
    pub(crate) fn new(colour: bool) -> Figures {
        Figures { colour, state: "Ready", ..Figures::default() }
    }

    /// A run begins: nothing is left of the one before.
    pub(crate) fn begin(&mut self, run: &Opening<'_>) {
        let place = if run.simulated || run.place.is_empty() { "simulated" } else { run.place };
        *self = Figures {
            title: format!("{} · {} · {place}", run.scenario, run.law),
            duration: run.duration_s,
            volts: run.volts,
            classes: run.classes_us,
            ..Figures::new(self.colour)
        };
    }

    pub(crate) fn note(&mut self, note: &Note) {
        self.notes.push_back((note.time_s, note.text.clone(), note.bad));
        if self.notes.len() > NOTES {
            self.notes.pop_front();
        }
    }

    pub(crate) fn frame(&mut self, f: &Figure) {
        let Some(&time) = f.time_s.last() else { return };
        for ((&time, &target), &position) in f.time_s.iter().zip(&f.target_deg).zip(&f.position_deg.high) {
            self.now.push_back(Point { time, target, position });
        }
        while self.now.front().is_some_and(|point| point.time < time - NOW) {
            self.now.pop_front();
        }
        let fold = |values: &[f64], start, of: fn(f64, f64) -> f64| {
            values.iter().copied().filter(|value| value.is_finite()).fold(start, of)
        };
        for (spans, all) in [(&f.error_deg, &mut self.error), (&f.volts, &mut self.voltage)] {
            let low = fold(&spans.low, f64::INFINITY, f64::min);
            let high = fold(&spans.high, f64::NEG_INFINITY, f64::max);
            if low <= high {
                all.push_back(Envelope { time, low, high });
            }
            while all.front().is_some_and(|span| span.time < time - WHILE) {
                all.pop_front();
            }
        }
        let end = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
        self.last = (end(&f.error_deg.high), end(&f.volts.high));
        (self.time, self.state) = (time, f.state);
        (self.cycles, self.cycles_per_s, self.largest_error) =
            (f.cycles, f.cycles_per_s, f.largest_error_deg);
        (self.lost, self.misses) = (f.lost, f.deadline_misses);
        (self.answers, self.wake_ups) = (f.answers, f.wake_ups);
    }

    /// A style with a colour, if there are any.
    fn in_colour(&self, colour: Color) -> Style {
        if self.colour { Style::new().fg(colour) } else { Style::new() }
    }

    /// Draws them.
    pub(crate) fn render(&self, frame: &mut Frame<'_>) {
        let area = frame.area();
        if area.width < LEAST.0 || area.height < LEAST.1 {
            let words = format!("The scope needs {} columns and {} rows. q ends the run.", LEAST.0, LEAST.1);
            frame.render_widget(Paragraph::new(words).wrap(ratatui::widgets::Wrap { trim: true }), area);
            return;
        }
        let voltage = if area.height < TALL { 0 } else { 5 };
        let [title, position, error, volts, facts, latency, notes, help] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Fill(3),
            Constraint::Fill(2),
            Constraint::Length(voltage),
            Constraint::Length(2),
            Constraint::Length(1),
            Constraint::Length(1),
            Constraint::Length(1),
        ])
        .areas(area);
        self.render_title(frame, title);
        self.render_position(frame, position);
        let error_title = format!("error, last {WHILE} s, °");
        self.render_envelope(frame, error, (error_title, &self.error, Color::Yellow, None));
        if voltage > 0 {
            let title = format!("voltage, last {WHILE} s, V");
            self.render_envelope(frame, volts, (title, &self.voltage, Color::Magenta, Some(self.volts)));
        }
        self.render_facts(frame, facts);
        self.render_latency(frame, latency);
        let note = self.notes.back().map_or_else(Line::default, |(time, text, bad)| {
            let style =
                if *bad { self.in_colour(Color::Red).add_modifier(Modifier::BOLD) } else { Style::new() };
            Line::styled(format!("{time:.2} s  {text}"), style)
        });
        frame.render_widget(note, notes);
        frame.render_widget(
            Line::styled("q or Esc ends the run", Style::new().add_modifier(Modifier::DIM)),
            help,
        );
    }

    fn render_title(&self, frame: &mut Frame<'_>, area: Rect) {
        let state = format!("{}  {:.2} of {} s", self.state, self.time, self.duration);
        let [left, right] =
            Layout::horizontal([Constraint::Fill(1), Constraint::Length(state.chars().count() as u16 + 1)])
                .areas(area);
        let bad = matches!(self.state, "Faulted" | "Released" | "Disconnected");
        let style = self.in_colour(if bad { Color::Red } else { Color::Green });
        frame
            .render_widget(Span::styled(self.title.clone(), Style::new().add_modifier(Modifier::BOLD)), left);
        frame.render_widget(Line::styled(state, style.add_modifier(Modifier::BOLD)).right_aligned(), right);
    }

    fn render_position(&self, frame: &mut Frame<'_>, area: Rect) {
        let line = |of: fn(&Point) -> f64| -> Vec<(f64, f64)> {
            self.now.iter().map(|point| (point.time - self.time, of(point))).collect()
        };
        let (target, position) = (line(|p| p.target), line(|p| p.position));
        let values = target.iter().chain(&position).map(|point| point.1);
        // The path is of dots, so that it can be distinguished without colours.
        let datasets = vec![
            dataset(&target, Marker::Dot, self.in_colour(Color::Gray)),
            dataset(&position, Marker::Braille, self.in_colour(Color::Cyan)),
        ];
        let bounds = bounds(values);
        self.render_chart(
            frame,
            area,
            (format!("position, and path (•), last {NOW} s, °"), datasets, NOW, bounds),
        );
    }

    fn render_envelope(
        &self,
        frame: &mut Frame<'_>,
        area: Rect,
        (title, spans, colour, limits): (String, &VecDeque<Envelope>, Color, Option<[f64; 2]>),
    ) {
        let end = |of: fn(&Envelope) -> f64| -> Vec<(f64, f64)> {
            spans.iter().map(|span| (span.time - self.time, of(span))).collect()
        };
        let (low, high) = (end(|span| span.low), end(|span| span.high));
        let style = self.in_colour(colour);
        let datasets = vec![dataset(&low, Marker::Braille, style), dataset(&high, Marker::Braille, style)];
        let bounds = limits.unwrap_or_else(|| bounds(low.iter().chain(&high).map(|point| point.1)));
        self.render_chart(frame, area, (title, datasets, WHILE, bounds));
    }

    fn render_chart(
        &self,
        frame: &mut Frame<'_>,
        area: Rect,
        (title, datasets, span, bounds): (String, Vec<Dataset<'_>>, f64, [f64; 2]),
    ) {
        let digits = if bounds[1] - bounds[0] < 1.0 { 3 } else { 1 };
        let labels = bounds.map(|bound| format!("{bound:>9.digits$}"));
        let chart = Chart::new(datasets)
            .block(Block::new().title(title))
            .legend_position(None)
            .x_axis(Axis::default().bounds([-span, 0.0]))
            .y_axis(Axis::default().bounds(bounds).labels(labels));
        frame.render_widget(chart, area);
    }

    fn render_facts(&self, frame: &mut Frame<'_>, area: Rect) {
        let (error, volts) = self.last;
        let error = if error.is_finite() { format!("{error:+.4}°") } else { "none".to_owned() };
        let volts = if volts.is_finite() { format!("{volts:.3} V") } else { "none".to_owned() };
        let largest = format!("largest {:.4}°", self.largest_error);
        let lines = [
            format!("error {error}, {largest}   {volts}"),
            format!(
                "stick-slip {} cycles, {:.1}/s   lost {}   misses {}",
                self.cycles, self.cycles_per_s, self.lost, self.misses
            ),
        ];
        frame.render_widget(Paragraph::new(lines.map(Line::from).to_vec()), area);
    }

    /// The classes of answers, or of wake-ups where there are none, by the logarithm of their number.
    fn render_latency(&self, frame: &mut Frame<'_>, area: Rect) {
        let some = |histogram: &Histogram| histogram.0.iter().any(|count| *count > 0);
        let (name, histogram) = match (some(&self.answers), some(&self.wake_ups)) {
            (true, _) => ("answers", &self.answers),
            (false, true) => ("wake-ups", &self.wake_ups),
            (false, false) => {
                frame.render_widget("latency: not measured", area);
                return;
            }
        };
        let bars: Vec<u64> =
            histogram.0.iter().map(|count| (10.0 * (1.0 + *count as f64).ln()) as u64).collect();
        let longest =
            histogram.0.iter().rposition(|count| *count > 0).and_then(|class| self.classes.get(class));
        let longest = longest.map_or_else(|| "10 ms or more".to_owned(), |end| format!("below {end} µs"));
        let from = format!("{name} 1 µs ");
        let to = format!(" 10 ms   longest {longest}");
        let [left, middle, right] = Layout::horizontal([
            Constraint::Length(from.chars().count() as u16),
            Constraint::Length(bars.len() as u16),
            Constraint::Fill(1),
        ])
        .areas(area);
        frame.render_widget(from, left);
        frame.render_widget(Sparkline::default().data(bars).style(self.in_colour(Color::Cyan)), middle);
        frame.render_widget(to, right);
    }
}

fn dataset(points: &[(f64, f64)], marker: Marker, style: Style) -> Dataset<'_> {
    Dataset::default().data(points).marker(marker).graph_type(GraphType::Line).style(style)
}

/// The span of values, with a little room where they are all the same.
fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return [-1.0, 1.0];
    }
    let room = (0.05 * (high - low)).max(1e-3);
    [low - room, high + room]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Spans;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    const CLASSES: [u32; 13] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000];

    /// Two seconds at 2 °/s with steps of a sixteenth of a degree, in frames of a thirtieth of a second.
    fn figures(colour: bool) -> Figures {
        let mut figures = Figures::new(colour);
        figures.begin(&Opening {
            scenario: "SMC at 2 °/s",
            law: "SMC",
            version: "0.1.0",
            place: "/dev/ttyACM0",
            simulated: false,
            duration_s: 10.0,
            period_us: 1000,
            settle_s: 0.5,
            count_deg: 0.018,
            volts: [0.0, 5.0],
            classes_us: &CLASSES,
            gains: Vec::new(),
            live_gains: None,
        });
        for i in 0..60 {
            let times: Vec<f64> = (0..33).map(|k| f64::from(33 * i + k) * 1e-3).collect();
            let target: Vec<f64> = times.iter().map(|t| 2.0 * t).collect();
            let position: Vec<f64> = target.iter().map(|x| (x * 16.0).floor() / 16.0).collect();
            let error: Vec<f64> = target.iter().zip(&position).map(|(target, at)| target - at).collect();
            let volts: Vec<f64> = error.iter().map(|e| 2.0 + 8.0 * e).collect();
            let spans = |values: &[f64]| Spans { low: values.to_vec(), high: values.to_vec() };
            let mut answers = Histogram::default();
            answers.0[3] = 1500;
            answers.0[4] = 480;
            answers.0[7] = 3;
            figures.frame(&Figure {
                position_deg: spans(&position),
                error_deg: spans(&error),
                volts: spans(&volts),
                target_deg: target,
                time_s: times,
                state: "Running",
                cycles: 62,
                cycles_per_s: 31.4,
                largest_error_deg: 0.0625,
                lost: 1,
                deadline_misses: 2,
                answers,
                ..Figure::default()
            });
        }
        figures.note(&Note { time_s: 0.001, text: "armed → running".to_owned(), bad: false, gain: None });
        figures
    }

    fn screen(figures: &Figures, width: u16, height: u16) -> Terminal<TestBackend> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| figures.render(frame)).unwrap();
        terminal
    }

    fn text(terminal: &Terminal<TestBackend>) -> String {
        let buffer = terminal.backend().buffer();
        let rows = buffer.content().chunks(usize::from(buffer.area.width));
        rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned() + "\n")
            .collect()
    }

    /// The pictures were looked at. `SCOPE=write` writes them anew.
    #[test]
    fn the_screen_is_as_it_was_looked_at() {
        for (width, height) in [(80, 24), (60, 15)] {
            let file = format!("{}/tests/scope/{width}x{height}.txt", env!("CARGO_MANIFEST_DIR"));
            let shown = text(&screen(&figures(false), width, height));
            if std::env::var_os("SCOPE").is_some_and(|value| value == "write") {
                std::fs::write(&file, &shown).unwrap();
            }
            assert_eq!(shown, std::fs::read_to_string(&file).unwrap(), "{width}x{height}");
        }
    }

    #[test]
    fn without_colours_there_are_none_and_with_them_the_same_is_said() {
        let (plain, coloured) = (screen(&figures(false), 80, 24), screen(&figures(true), 80, 24));
        let colours = |terminal: &Terminal<TestBackend>| {
            terminal.backend().buffer().content().iter().filter(|cell| cell.fg != Color::Reset).count()
        };
        assert_eq!(colours(&plain), 0);
        assert!(colours(&coloured) > 100);
        assert_eq!(text(&plain), text(&coloured));
    }

    #[test]
    fn any_screen_can_be_drawn_on_and_one_that_is_too_small_says_so() {
        for width in [1, 2, 20, 39, 40, 41, 60, 80, 200] {
            for height in [1, 2, 5, 9, 10, 12, 19, 20, 40] {
                screen(&figures(true), width, height);
                screen(&Figures::new(true), width, height);
            }
        }
        assert!(text(&screen(&figures(true), 39, 10)).contains("40 columns and 10 rows"));
    }

    #[test]
    fn what_is_kept_does_not_grow_with_time() {
        let mut figures = figures(true);
        for i in 0..20_000_u32 {
            let time = 2.0 + f64::from(i) / 30.0;
            let one = || Spans { low: vec![0.0], high: vec![f64::NAN] };
            figures.frame(&Figure {
                time_s: vec![time],
                target_deg: vec![0.0],
                position_deg: one(),
                error_deg: one(),
                volts: Spans { low: vec![1.0], high: vec![2.0] },
                ..Figure::default()
            });
            figures.note(&Note { time_s: time, text: String::new(), bad: true, gain: None });
        }
        assert!(
            figures.now.len() < 40 && figures.error.is_empty(),
            "{} {}",
            figures.now.len(),
            figures.error.len()
        );
        assert!((590..=610).contains(&figures.voltage.len()), "{}", figures.voltage.len());
        assert_eq!(figures.notes.len(), NOTES);
    }
}
