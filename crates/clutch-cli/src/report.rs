//! The results, as a page to read and as a table for a terminal.

use crate::output::{WIDTH, beside};
use crate::plot::Figure;
use askama::Template;
use clutch_sim::paper::Claim;

/// A figure of the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportFigure {
    /// Short name, unique in the page: the figure's anchor is `#figure-` and this name.
    pub id: String,
    /// The content of the figure, in words that also serve readers who cannot see it.
    pub caption: String,
    /// The panels, as drawings of their own: beside one another where they fit, else below. Put into the page as they are.
    pub panels: Vec<String>,
}

impl ReportFigure {
    /// A figure under that name.
    ///
    /// # Errors
    /// As [`Figure::svg`].
    pub fn new(id: &str, caption: &str, figure: &Figure) -> anyhow::Result<ReportFigure> {
        let panels = figure.split().into_iter().map(|panel| panel.svg().map(|svg| sized(&svg)));
        Ok(ReportFigure {
            id: id.to_owned(),
            caption: caption.to_owned(),
            panels: panels.collect::<anyhow::Result<_>>()?,
        })
    }
}

/// A table of the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportTable {
    /// Short name, unique in the page: the anchor of its part.
    pub id: String,
    /// Name of its part of the page.
    pub title: String,
    /// The content of the table, in words.
    pub caption: String,
    /// The rows, of which the first is the header.
    pub rows: Vec<Vec<String>>,
    /// Last columns that hold words, not numbers.
    pub words: usize,
}

impl ReportTable {
    /// Class of the cells of a column.
    fn class(&self, column: &usize) -> &'static str {
        let numbers = self.rows.first().map_or(0, Vec::len) - self.words;
        match *column {
            0 if self.words > 0 => "whole",
            0 => "",
            column if column < numbers => "number",
            _ => "wide whole",
        }
    }
}

/// A page with everything in it: it opens without a network, runs no script, prints, fits a phone
/// and follows the reader's choice of light or dark. It begins with what matters and the figures.
///
/// A part without content is left out. All texts are escaped.
#[derive(Clone, Debug, Default, Template)]
#[template(path = "page.html")]
pub struct Page<'a> {
    /// Title.
    pub title: &'a str,
    /// Sentences that matter most.
    pub lead: &'a [String],
    /// The figures.
    pub figures: &'a [ReportFigure],
    /// Statements and their verdicts.
    pub claims: &'a [Claim],
    /// Tables.
    pub tables: &'a [ReportTable],
    /// Paragraphs on where all this comes from.
    pub about: &'a [String],
    /// Names and values.
    pub settings: &'a [(String, String)],
}

impl Page<'_> {
    /// The page as HTML.
    ///
    /// # Errors
    /// None that is known: what the template refers to is checked when it is compiled.
    pub fn html(&self) -> anyhow::Result<String> {
        Ok(self.render()? + "\n")
    }

    /// Anchors and names of the parts that are there.
    fn parts(&self) -> Vec<(&str, &str)> {
        let part = |there: bool, id, name| there.then_some((id, name));
        let tables = self.tables.iter().map(|t| part(t.rows.len() > 1, t.id.as_str(), t.title.as_str()));
        let before = [
            part(!self.figures.is_empty(), "figures", "Figures"),
            part(!self.claims.is_empty(), "claims", "Claims"),
        ];
        let after = [
            part(!self.about.is_empty(), "about", "About"),
            part(!self.settings.is_empty(), "settings", "Parameters"),
        ];
        before.into_iter().chain(tables).chain(after).flatten().collect()
    }

    /// The claims, counted by their verdicts.
    fn counted(&self) -> String {
        let count = |verdict| self.claims.iter().filter(|c| Verdict::of(c) == verdict).count();
        let mut summary = format!(
            "Statements of the paper: {}. Holding: {}. Documented deviations: {}. Not holding: {}. A statement \
             holds if what was measured lies within the band.",
            self.claims.len(),
            count(Verdict::Holds),
            count(Verdict::Deviates),
            count(Verdict::Fails)
        );
        if self.claims.iter().any(|c| c.fitted) {
            summary += " “fitted” marks those to which the rig was fitted.";
        }
        summary
    }
}

/// The claims as a table of at most 80 columns, in plain text; below each line is the statement. The band has the unit of
/// the measurement.
#[must_use]
pub fn claims_table(claims: &[Claim]) -> String {
    let line = |id: &str, measured: &str, band: &str, verdict: &str| {
        format!("{id:<22}{measured:>15}   {band:<17}{verdict}\n")
    };
    let mut table = line("id", "measured", "band", "verdict") + &"─".repeat(WIDTH) + "\n";
    for claim in claims {
        let fitted = if claim.fitted { " [fitted]" } else { "" };
        table += &line(claim.id, &measured(claim), &range(claim.band), Verdict::of(claim).text());
        table += &beside("   ", &format!("{}{fitted}", claim.paper));
    }
    table
}

/// The verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Holds,
    Deviates,
    Fails,
}

impl Verdict {
    fn of(claim: &Claim) -> Verdict {
        match (claim.holds, claim.as_expected()) {
            (true, _) => Verdict::Holds,
            (false, true) => Verdict::Deviates,
            (false, false) => Verdict::Fails,
        }
    }

    fn text(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Deviates => "documented deviation",
            Verdict::Fails => "does not hold",
        }
    }

    /// Sign before the text.
    fn sign(self) -> char {
        match self {
            Verdict::Holds => '✓',
            Verdict::Deviates => '≈',
            Verdict::Fails => '✗',
        }
    }

    /// Class of its look.
    fn class(self) -> &'static str {
        match self {
            Verdict::Holds => "good",
            Verdict::Deviates => "known",
            Verdict::Fails => "bad",
        }
    }
}

/// A number without an exponent where that is readable, rounded to significant digits.
fn number(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "not a number".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.into();
    }
    // Rounding first: 0.09999 has its first digit before the one that 0.1 has.
    let rounded: f64 = format!("{value:.*e}", digits.max(1) - 1).parse().unwrap_or(value);
    let size = if rounded == 0.0 { 0 } else { rounded.abs().log10().floor() as i32 };
    let text = if (-5..9).contains(&size) {
        let places = usize::try_from(digits as i32 - 1 - size).unwrap_or(0);
        let text = format!("{rounded:.places$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{rounded:e}")
    };
    match text.as_str() {
        "-0" => "0".into(),
        _ => text.replace('-', "−"),
    }
}

/// A number with its unit.
fn quantity(number: &str, unit: &str) -> String {
    if unit.is_empty() { number.to_owned() } else { format!("{number} {unit}") }
}

fn inside(value: f64, band: [Option<f64>; 2]) -> bool {
    band[0].is_none_or(|lo| value >= lo) && band[1].is_none_or(|hi| value <= hi)
}

/// The measurement: four digits, and more if these would put it on the other side of the band's
/// end.
fn measured(claim: &Claim) -> String {
    if claim.measured.is_nan() {
        return number(claim.measured, 4);
    }
    let exact = inside(claim.measured, claim.band);
    let rounded = |digits: &usize| {
        let text = format!("{:.*e}", digits - 1, claim.measured);
        text.parse().is_ok_and(|v| inside(v, claim.band) == exact)
    };
    quantity(&number(claim.measured, (4..17).find(rounded).unwrap_or(17)), claim.unit)
}

/// `≤ 0.12`, `83.6 … 93.6`.
fn range(ends: [Option<f64>; 2]) -> String {
    let text = |v| number(v, 6);
    match ends {
        [None, None] => "any".into(),
        [None, Some(hi)] => format!("≤ {}", text(hi)),
        [Some(lo), None] => format!("≥ {}", text(lo)),
        [Some(lo), Some(hi)] if text(lo) == text(hi) => format!("= {}", text(lo)),
        [Some(lo), Some(hi)] => format!("{} … {}", text(lo), text(hi)),
    }
}

/// The values in which the statement is known not to hold.
fn deviation(claim: &Claim) -> Option<String> {
    claim.deviation.map(|[low, high]| quantity(&range([Some(low), Some(high)]), claim.unit))
}

fn band(claim: &Claim) -> String {
    if claim.band == [None, None] { range(claim.band) } else { quantity(&range(claim.band), claim.unit) }
}

/// A drawing that grows and shrinks with the page, but not so far that its lines become bars.
fn sized(svg: &str) -> String {
    let svg = svg.trim();
    let width = svg.strip_prefix("<svg width=\"").and_then(|rest| rest.split_once('"'));
    match width.and_then(|(width, _)| width.parse::<f64>().ok()) {
        None => svg.to_owned(),
        Some(width) => {
            svg.replacen("<svg width=", &format!("<svg style=\"max-width:{:.0}px\" width=", 1.2 * width), 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Figure, Panel, Series};

    fn claim(measured: f64, unit: &'static str, band: [Option<f64>; 2]) -> Claim {
        Claim {
            id: "pd-error",
            paper: "PD: error under 0.12°",
            measured,
            unit,
            band,
            holds: inside(measured, band),
            deviation: None,
            fitted: false,
            note: "worst of ten <seeds> & \"more\"",
        }
    }

    fn page() -> String {
        let figure = Figure {
            title: "Figure".to_owned(),
            columns: 1,
            panels: vec![Panel {
                series: vec![Series::new("", vec![(0.0, 1.0), (1.0, 2.0)])],
                ..Panel::default()
            }],
            ..Figure::default()
        };
        let figures = ["8", "9"]
            .map(|id| ReportFigure::new(id, &format!("Figure {id}: \"errors\" < 0.12°"), &figure).unwrap());
        let claims = [
            claim(0.05, "°", [None, Some(0.12)]),
            Claim { deviation: Some([0.17, 0.19]), ..claim(0.18, "°", [None, Some(0.12)]) },
            Claim { fitted: true, ..claim(99.0, "%", [Some(83.6), Some(93.6)]) },
        ];
        let rows = [["rate", "paper (%)", "why"], ["10 °/s", "88.6", "a < b"]];
        let table3 = ReportTable {
            id: "table-3".to_owned(),
            title: "Table 3".to_owned(),
            caption: "Table 3 of the paper.".to_owned(),
            rows: rows.map(|r| r.map(str::to_owned).to_vec()).to_vec(),
            words: 1,
        };
        Page {
            title: "Laws <b>",
            lead: &["First & second".to_owned()],
            claims: &claims,
            tables: &[table3],
            figures: &figures,
            about: &["Third".to_owned()],
            settings: &[("seed".to_owned(), "1 < 2".to_owned())],
        }
        .html()
        .unwrap()
    }

    #[test]
    fn every_text_is_escaped() {
        let page = page();
        for text in [
            "<title>Laws &#60;b&#62;</title>",
            "<h1>Laws &#60;b&#62;</h1>",
            "<p class=\"lead\">First &#38; second</p>",
            "worst of ten &#60;seeds&#62; &#38; &#34;more&#34;",
            "aria-label=\"Figure 8: &#34;errors&#34; &#60; 0.12°\"",
            "<td>1 &#60; 2</td>",
            "<td role=\"cell\" class=\"number\" data-name=\"paper (%)\">88.6</td>",
            "<td role=\"cell\" class=\"wide whole\" data-name=\"why\">a &#60; b</td>",
        ] {
            assert!(page.contains(text), "{text}");
        }
        assert!(!page.contains("<b>") && !page.contains("<seeds>"));
    }

    #[test]
    fn the_page_needs_nothing_from_elsewhere() {
        let page = page().replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        for outside in ["http://", "https://", "<script", "<link", "@import", "url(", "src="] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn the_page_can_be_read_without_eyes() {
        let page = page();
        assert!(page.starts_with("<!DOCTYPE html>\n<html lang=\"en\">"));
        assert_eq!(page.matches("<table").count(), page.matches("<caption>").count());
        assert_eq!(page.matches("<th ").count(), page.matches("scope=").count());
        assert_eq!(page.matches("role=\"img\"").count(), 2);
        assert_eq!(page.matches("<h1>").count(), 1);
        let mut ids: Vec<&str> =
            page.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        assert_eq!(ids, ["figures", "figure-8", "figure-9", "claims", "table-3", "about", "settings"]);
        ids.dedup();
        assert_eq!(ids.len(), 7);
    }

    #[test]
    fn verdicts_are_words() {
        let page = page();
        for text in ["</span> holds</td>", "</span> documented deviation</td>", "</span> does not hold</td>"]
        {
            assert_eq!(page.matches(text).count(), 1, "{text}");
        }
        assert!(page.contains("Documented deviation: 0.17 … 0.19 °."));
        assert!(page.contains("Holding: 1. Documented deviations: 1. Not holding: 1."));
        assert_eq!(page.matches("class=\"tag\">fitted<").count(), 1);
        let elsewhere = Claim { deviation: Some([0.3, 0.4]), ..claim(0.18, "°", [None, Some(0.12)]) };
        assert_eq!(Verdict::of(&elsewhere).text(), "does not hold");
    }

    #[test]
    fn a_part_without_content_is_left_out() {
        let page = Page { title: "T", ..Page::default() }.html().unwrap();
        assert!(!page.contains("<h2") && !page.contains("<table") && page.ends_with("</html>\n"));
    }

    #[test]
    fn bands_and_numbers_are_short() {
        let of = |lo, hi, unit| band(&claim(1.0, unit, [lo, hi]));
        assert_eq!(of(None, Some(0.12), "°"), "≤ 0.12 °");
        assert_eq!(of(Some(83.6), Some(88.6 + 5.0), "%"), "83.6 … 93.6 %");
        assert_eq!(of(Some(-1.0), None, "V"), "≥ −1 V");
        assert_eq!(of(Some(0.0), Some(0.0), "cycles/s"), "= 0 cycles/s");
        assert_eq!(of(Some(0.1 + 0.2), Some(1.0), ""), "0.3 … 1");
        assert_eq!(of(Some(0.018 - 1e-9), Some(0.018 + 1e-9), "°"), "= 0.018 °");
        assert_eq!(of(None, None, "°"), "any");
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.042_134_56, "0.04213"),
            (99.996, "100"),
            (1_234_567.0, "1235000"),
            (-0.5, "−0.5"),
            (1.5e-9, "1.5e−9"),
            (2e12, "2e12"),
            (f64::NAN, "not a number"),
            (f64::NEG_INFINITY, "−∞"),
        ] {
            assert_eq!(number(value, 4), text);
        }
    }

    #[test]
    fn rounding_does_not_contradict_the_verdict() {
        let of = |v| measured(&claim(v, "°", [None, Some(0.12)]));
        assert_eq!(of(0.118_76), "0.1188 °");
        assert_eq!(of(0.120_004), "0.120004 °");
        assert_eq!(of(0.119_999), "0.12 °");
        assert_eq!(measured(&claim(f64::NAN, "°", [None, Some(0.12)])), "not a number");
    }

    #[test]
    fn the_terminal_table_fits() {
        let long = Claim {
            id: "ctc-error-above-2-sim",
            paper: "The positional error of the computed-torque law stays at the resolution of the encoder for any \
                    velocity above 2 °/s",
            fitted: true,
            ..claim(123.456_7, "cycles/s", [Some(12.345_678), Some(2345.678)])
        };
        let text = claims_table(&[claim(0.05, "°", [None, Some(0.12)]), long]);
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
        assert!(!text.contains('\u{1b}'));
        for part in ["pd-error", "0.05 °", "≤ 0.12", "holds", "[fitted]", "verdict", "measured"] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
    }
}
