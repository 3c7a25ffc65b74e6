//! `clutch map`.

use crate::args::ScenarioArgs;
use crate::output::{Exit, Forms, json, paragraph, with_progress};
use crate::plot::{Cell, Cells, Figure, Panel};
use crate::report::{Page, ReportFigure};
use crate::table::number;
use clap::Args;
use clutch_sim::Scenario;
use clutch_sim::smooth_speed::{
    Axis, DISCS, ENCODER_LIMIT, GainMap, RATES_DEG_S, RateMap, SmoothSpeed, Trials, Tried, Wall, gain_map,
    law_keys, rate_map,
};
use serde::Serialize;
use serde_json::json as value;

/// Maps the lowest rate at which a scenario moves without a stick, and the reason why slower does not.
///
/// Two keys span the map, as two gains of the law; with --x alone a key is set against the rates. Each cell simulates ramps
/// on several discs, from the lowest rate up, and counts for smooth where none of them comes to rest.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch map bench_pd_2\n  \
    clutch map bench_pd_2 --x law.pd.kp_v_rad=500:5000:8 --y law.pd.kd_v_s_rad=5,10,20,50 --plot map.png\n  \
    clutch map bench_pd_2 --x law.pd.kd_v_s_rad=5:50:14 --rates 1:20:10\n\n\
    docs/map.md says how to read it.")]
pub(crate) struct Map {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// The key across and its values: LOW:HIGH:NUMBER, evenly spaced in ratio from LOW above 0, else in difference, or a
    /// list; unless given, the law's first gain from a quarter to four times its value.
    #[arg(long, value_name = "KEY=VALUES", value_parser = axis)]
    x: Option<Asked>,
    /// The key down and its values; with neither --x nor --y the law's second gain.
    #[arg(long, value_name = "KEY=VALUES", value_parser = axis, requires = "x")]
    y: Option<Asked>,
    /// Rates that are tried, °/s, as LOW:HIGH:NUMBER or a list.
    #[arg(long, value_name = "VALUES", value_parser = values)]
    rates: Option<List>,
    /// Discs that each rate is tried on: the seeds 1 to N.
    #[arg(long, value_name = "N", default_value_t = DISCS)]
    discs: u32,
    /// Discs that the rates above a cell's lowest smooth one are tried on, in search of holes, those that stuck below it
    /// first.
    #[arg(long, value_name = "N", default_value_t = 1)]
    discs_above: u32,
    #[command(flatten)]
    forms: Forms,
}

/// Values of an axis.
#[derive(Clone, Debug)]
pub(crate) struct List(pub(crate) Vec<f64>);

/// More values than anybody waits for.
const MOST: usize = 1000;

/// Evenly spaced values, in ratio from above 0, else in difference; the ends as they are given, those between with as few
/// digits, four or more, as keep them apart: what is typed again is what was run.
fn spread(low: f64, high: f64, n: usize) -> Vec<f64> {
    let value = |i: usize, digits: usize| {
        let share = i as f64 / (n - 1) as f64;
        let x = if low > 0.0 { low * (high / low).powf(share) } else { low + (high - low) * share };
        match i {
            0 => low,
            _ if i == n - 1 => high,
            _ => format!("{x:.digits$e}").parse().unwrap_or(x),
        }
    };
    let with = |digits: usize| (0..n).map(|i| value(i, digits)).collect::<Vec<f64>>();
    let apart = |list: &Vec<f64>| list.windows(2).all(|pair| pair[0] < pair[1]);
    (3..17).map(with).find(apart).unwrap_or_else(|| with(17))
}

pub(crate) fn values(text: &str) -> Result<List, String> {
    let expected = "expected LOW:HIGH:NUMBER, as 500:5000:8, or a list, as 5,10,20";
    let wrong = |what: &str| format!("{text}: {what}");
    let read = |x: &str| x.trim().parse::<f64>().map_err(|_| wrong(expected));
    let list = match text.split(':').collect::<Vec<_>>()[..] {
        [low, high, n] => {
            let (low, high) = (read(low)?, read(high)?);
            let n: usize = n.trim().parse().map_err(|_| wrong(expected))?;
            if !(low.is_finite() && high > low && high.is_finite() && (2..=MOST).contains(&n)) {
                return Err(wrong(&format!("expected LOW < HIGH and 2 to {MOST} values")));
            }
            spread(low, high, n)
        }
        [list] => list.split(',').map(read).collect::<Result<Vec<_>, _>>()?,
        _ => return Err(wrong(expected)),
    };
    if list.len() > MOST {
        return Err(wrong(&format!("expected at most {MOST} values")));
    }
    Ok(List(list))
}

/// An axis as it is given.
#[derive(Clone)]
struct Asked {
    axis: Axis,
    /// Made from LOW:HIGH:NUMBER.
    spread: bool,
}

impl Asked {
    /// A key that takes whole numbers has those of a range, each once.
    fn of(mut self, scenario: &Scenario) -> Axis {
        if self.spread && scenario.takes_whole(&self.axis.key) {
            self.axis.values.iter_mut().for_each(|x| *x = x.round());
            self.axis.values.dedup();
        }
        self.axis
    }
}

fn axis(text: &str) -> Result<Asked, String> {
    let (key, list) = text.split_once('=').ok_or("expected KEY=VALUES, as law.pd.kp_v_rad=500:5000:8")?;
    let axis = Axis { key: key.trim().to_owned(), values: values(list)?.0 };
    Ok(Asked { axis, spread: list.contains(':') })
}

/// The law's first two gains, each from a quarter to four times its value.
fn own_axes(scenario: &Scenario) -> anyhow::Result<(Axis, Axis)> {
    let keys = law_keys(scenario);
    let axis = |(key, x): &(String, f64)| {
        let values = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0].map(|share| share * x);
        (*x > 0.0).then(|| Axis { key: key.clone(), values: values.to_vec() })
    };
    let mut axes = keys.iter().filter_map(axis);
    match (axes.next(), axes.next()) {
        (Some(x), Some(y)) => Ok((x, y)),
        _ => {
            let keys: Vec<&str> = keys.iter().map(|(key, _)| key.as_str()).collect();
            anyhow::bail!(
                "--x: missing; expected a key and its values, as KEY=1:10:8, of {}",
                keys.join(", ")
            )
        }
    }
}

enum Found {
    Gains(GainMap),
    Rates(RateMap),
}

impl Map {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        self.forms.check()?;
        let scenario = self.scenario.load()?;
        let origin = self.scenario.scenario.to_string_lossy();
        let rates = self.rates.as_ref().map_or(&RATES_DEG_S[..], |list| &list.0);
        let trials = Trials::new(&origin, rates, self.discs.into())?.above(self.discs_above);
        let found = with_progress("cells", |progress| -> anyhow::Result<Found> {
            let of = |asked: Asked| asked.of(&scenario);
            Ok(match (self.x.map(of), self.y.map(of)) {
                (Some(x), None) => Found::Rates(rate_map(&scenario, x, &trials, progress)?),
                (Some(x), Some(y)) => Found::Gains(gain_map(&scenario, (x, y), &trials, progress)?),
                (None, _) => Found::Gains(gain_map(&scenario, own_axes(&scenario)?, &trials, progress)?),
            })
        })?;
        let grid = match &found {
            Found::Gains(map) => gains(&scenario, &trials, map),
            Found::Rates(map) => against_rates(&scenario, &trials, map),
        };
        self.forms.give(
            || Ok(grid.figure(&scenario)),
            |figure| grid.page(&scenario, figure),
            || match &found {
                Found::Gains(map) => whole(&scenario, map),
                Found::Rates(map) => whole(&scenario, map),
            },
            || grid.text(&scenario),
        )?;
        Ok(Exit::Done)
    }
}

fn whole(scenario: &Scenario, map: &impl Serialize) -> anyhow::Result<String> {
    json(&value!({ "scenario": scenario.name(), "version": env!("CARGO_PKG_VERSION"), "map": map }))
}

/// A map as it is shown, on a terminal or drawn.
struct Grid {
    about: String,
    across: String,
    down: String,
    columns: Vec<String>,
    rows: Vec<String>,
    /// Row by row.
    cells: Vec<Vec<Shown>>,
    legend: Vec<(String, String)>,
    notes: Vec<String>,
}

/// A cell as it is shown.
struct Shown {
    /// 0 for the best, 1 for the worst.
    shade: f64,
    text: String,
    mark: char,
    hole: bool,
}

/// Letters of the causes, and of none.
const LETTERS: &str = "USEJR.";

/// Letter of the first cause that holds.
fn letter(causes: &[Wall]) -> char {
    match causes.first() {
        Some(Wall::SampledLoop) => 'U',
        Some(Wall::StribeckEdge) => 'S',
        Some(Wall::EncoderEdge) => 'E',
        Some(Wall::EdgeJolt) => 'J',
        Some(Wall::Ripple) => 'R',
        None => '.',
    }
}

/// The causes that stand in a map, in words.
fn causes(marks: impl Fn(char) -> bool) -> Vec<(String, String)> {
    let encoder = format!("Encoder: what grows by itself grows e^{ENCODER_LIMIT} and more between two edges");
    [
        ('U', "Unstable: the sampled loop's spectral radius is above 1, at any rate"),
        ('S', "Stribeck: friction falls faster with the speed than the law brakes"),
        ('E', encoder.as_str()),
        ('J', "Jolt: an edge of the encoder, by the gain on its rate, stops the shaft"),
        ('R', "Ripple: the disc that sticks does not if its friction is even along it"),
        ('.', "none of the causes that the map knows: U, S, E, J, R"),
    ]
    .into_iter()
    .filter(|(mark, _)| marks(*mark))
    .map(|(mark, text)| (mark.to_string(), text.to_owned()))
    .collect()
}

/// The length of a run, and what of it counts.
fn length(scenario: &Scenario) -> String {
    let run = scenario.params().run;
    format!("{} s each, the first {} s not counted", number(run.duration), number(run.settle))
}

fn gains(scenario: &Scenario, trials: &Trials, map: &GainMap) -> Grid {
    let rates = trials.rates_deg_s();
    let shown = |cell: &SmoothSpeed| {
        let place = |rate: f64| rates.iter().position(|r| *r == rate).unwrap_or(0) as f64;
        let mark = match (cell.rate_deg_s, cell.below) {
            (Some(_), None) => '<',
            _ => letter(&cell.evidence.causes),
        };
        Shown {
            shade: cell.rate_deg_s.map_or(1.0, |rate| place(rate) / rates.len() as f64),
            text: cell.rate_deg_s.map_or("--".to_owned(), |rate| narrow(rate, 3)),
            mark,
            hole: !cell.holes.is_empty(),
        }
    };
    let cells: Vec<Vec<Shown>> = map.cells.iter().map(|row| row.iter().map(shown).collect()).collect();
    let any = |of: &dyn Fn(&Shown) -> bool| cells.iter().flatten().any(of);
    let mut legend = vec![("2.0".to_owned(), "lowest rate, °/s, at which no disc sticks".to_owned())];
    let mut also = |there: bool, sign: &str, text: &str| {
        if there {
            legend.push((sign.to_owned(), text.to_owned()));
        }
    };
    also(any(&|c| c.text == "--"), "--", "at every rate tried a disc sticks, or leaves its path");
    also(any(&|c| c.mark == '<'), "<", "smooth at the lowest rate tried");
    also(any(&|c| c.hole), "!", "a hole: a higher rate sticks again");
    also(any(&|c| LETTERS.contains(c.mark)), "", "then why the next lower rate sticks:");
    legend.extend(causes(|mark| any(&|c| c.mark == mark)));
    let (mut runs, mut holes) = (0, Vec::new());
    for (cell, (x, y)) in map
        .cells
        .iter()
        .flatten()
        .zip(map.y.values.iter().flat_map(|y| map.x.values.iter().map(move |x| (*x, *y))))
    {
        runs += cell.runs;
        if let (Some(rate), [first, ..]) = (cell.rate_deg_s, &cell.holes[..]) {
            holes.push(format!(
                "{} {}, {} {}: smooth at {} °/s, sticks at {} °/s on disc {}",
                map.x.key,
                number(x),
                map.y.key,
                number(y),
                number(rate),
                number(first.rate_deg_s),
                first.seed
            ));
        }
    }
    let tried = map.cells.iter().flatten().next().map_or(0, |cell| cell.discs_above);
    let found = match holes.len() {
        _ if tried == 0 => "Rates above a cell's were not tried.".to_owned(),
        0 => format!("Rates above a cell's were tried on {tried} of the discs: no hole."),
        n => format!("Rates above a cell's were tried on {tried} of the discs. Cells with a hole: {n}, as"),
    };
    let mut notes = vec![format!(
        "{runs} runs on discs 1 to {}, {}; rates tried: {} °/s. {found}",
        trials.discs(),
        length(scenario),
        rates.iter().map(|r| number(*r)).collect::<Vec<_>>().join(", "),
    )];
    notes.extend(holes.into_iter().take(5));
    Grid {
        about: "lowest rate without a stick, °/s".to_owned(),
        across: map.x.key.clone(),
        down: map.y.key.clone(),
        columns: map.x.values.iter().map(|x| narrow(*x, 4)).collect(),
        rows: map.y.values.iter().map(|y| narrow(*y, 7)).collect(),
        cells,
        legend,
        notes,
    }
}

fn against_rates(scenario: &Scenario, trials: &Trials, map: &RateMap) -> Grid {
    let shown = |tried: &Tried| {
        let n = tried.failures.len();
        Shown {
            shade: n as f64 / f64::from(map.discs),
            text: n.to_string(),
            mark: if n == 0 { ' ' } else { letter(&tried.evidence.causes) },
            hole: false,
        }
    };
    // The fastest on top, as on a plot.
    let row = |i: usize| map.columns.iter().map(|column| shown(&column.rates[i])).collect();
    let cells: Vec<Vec<Shown>> = (0..map.rates_deg_s.len()).rev().map(row).collect();
    let any = |mark| cells.iter().flatten().any(|c| c.mark == mark);
    let mut legend =
        vec![("1".to_owned(), format!("of {} discs sticks at this rate, or leaves its path", map.discs))];
    if LETTERS.chars().any(any) {
        legend.push((String::new(), "then why:".to_owned()));
    }
    legend.extend(causes(any));
    let runs = map.columns.len() * map.rates_deg_s.len() * map.discs as usize;
    Grid {
        about: format!("discs of {} that stick", map.discs),
        across: map.x.key.clone(),
        down: "rate, °/s".to_owned(),
        columns: map.x.values.iter().map(|x| narrow(*x, 4)).collect(),
        rows: map.rates_deg_s.iter().rev().map(|rate| narrow(*rate, 7)).collect(),
        cells,
        legend,
        notes: vec![format!("{runs} runs on discs 1 to {}, {}.", trials.discs(), length(scenario))],
    }
}

/// A number in so many characters, with as many digits as fit.
fn narrow(x: f64, width: usize) -> String {
    let fits = |text: &String| text.chars().count() <= width;
    let plain = |digits: usize| {
        let text = format!("{x:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        text.strip_prefix("0.").map_or(text.to_owned(), |rest| {
            if text.len() > width { format!(".{rest}") } else { text.to_owned() }
        })
    };
    let close = |text: &String| text.parse::<f64>().is_ok_and(|y| (y - x).abs() <= 0.05 * x.abs());
    let thousands = || format!("{}k", narrow(x / 1000.0, width - 1));
    let plain = (0..6).rev().map(plain).find(|text| fits(text) && close(text));
    plain.unwrap_or_else(|| if (1e3..1e6).contains(&x) { thousands() } else { format!("{x:.0e}") })
}

/// Columns of a terminal, of the rows' names, and of a cell.
const WIDTH: usize = 80;
const NAMES: usize = 8;
const CELL: usize = 5;

/// Shades of a terminal, from the best to the worst.
const SHADES: [char; 5] = [' ', '░', '▒', '▓', '█'];

impl Grid {
    fn text(&self, scenario: &Scenario) -> String {
        let mut out = paragraph(&format!("{}: {}", scenario.name(), self.about));
        out += &paragraph(&format!("across: {}; down: {}", self.across, self.down));
        let across = (WIDTH - NAMES) / CELL;
        for from in (0..self.columns.len()).step_by(across) {
            let to = self.columns.len().min(from + across);
            out += &format!("\n{:NAMES$}", "");
            for column in &self.columns[from..to] {
                out += &format!("{column:>4} ");
            }
            out = out.trim_end().to_owned() + "\n";
            for (name, row) in self.rows.iter().zip(&self.cells) {
                let mut line = format!("{name:>7} ");
                for cell in &row[from..to] {
                    let last = SHADES.len() - 1;
                    let shade = SHADES[((cell.shade * last as f64).ceil() as usize).min(last)];
                    let sign = if cell.hole { '!' } else { shade };
                    line += &format!("{sign}{:>3}{}", cell.text, cell.mark);
                }
                out += &(line.trim_end().to_owned() + "\n");
            }
        }
        out.push('\n');
        for (sign, text) in &self.legend {
            out += &format!("{sign:>6}  {text}\n");
        }
        out.push('\n');
        out + &self.notes.iter().map(|note| paragraph(note)).collect::<String>()
    }

    fn figure(&self, scenario: &Scenario) -> Figure {
        let cell = |c: &Shown| {
            let hole = if c.hole { "!" } else { "" };
            let mark = c.mark.to_string().replace('.', "");
            Cell { shade: c.shade, text: format!("{hole}{}{}", c.text, mark.trim()) }
        };
        // Every other name where all would touch one another.
        let apart = |i: usize| self.columns.len() <= 10 || i.is_multiple_of(2);
        let names = self.columns.iter().enumerate();
        let cells = Cells {
            columns: names.map(|(i, name)| if apart(i) { name.clone() } else { String::new() }).collect(),
            rows: self.rows.iter().rev().cloned().collect(),
            cells: self.cells.iter().rev().flatten().map(cell).collect(),
        };
        let marks: Vec<String> = self
            .legend
            .iter()
            .filter(|(sign, _)| ["U", "S", "E", "J", "R", "!", "<", "--"].contains(&sign.as_str()))
            .map(|(sign, text)| format!("{sign} {}", text.split(':').next().unwrap_or(text).to_lowercase()))
            .collect();
        Figure {
            title: format!("{}: {}", scenario.name(), self.about),
            columns: 1,
            panels: vec![Panel {
                title: marks.join(" · "),
                x_label: self.across.clone(),
                y_label: self.down.clone(),
                cells: Some(cells),
                ..Panel::default()
            }],
            ..Figure::default()
        }
    }

    fn page(&self, scenario: &Scenario, figure: &Figure) -> anyhow::Result<String> {
        let title = format!("{}: {}", scenario.name(), self.about);
        let legend = self.legend.iter().map(|(sign, text)| format!("{sign} {text}"));
        let about: Vec<String> = legend.chain(self.notes.iter().cloned()).collect();
        let caption = format!("{} over {} and {}.", self.about, self.across, self.down);
        let figures = [ReportFigure::new("map", &caption, figure)?];
        let settings = scenario.parameters();
        Page { title: &title, about: &about, figures: &figures, settings: &settings, ..Page::default() }
            .html()
    }
}
