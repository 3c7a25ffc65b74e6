//! The results, as a page to read and as a table for a terminal.

use clutch_sim::paper::Claim;
use comfy_table::{ColumnConstraint, ContentArrangement, LineStyle, Table, TableStyle, Width};
use std::borrow::Cow;
use std::fmt::Write as _;

/// A figure of the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportFigure {
    /// Short name, unique in the page: the figure's anchor is `#figure-` and this name.
    pub id: String,
    /// The content of the figure, in words that also serve readers who cannot see it.
    pub caption: String,
    /// The drawing, put into the page as it is: from [`Figure::svg`](crate::plot::Figure::svg), whose
    /// elements have no ids that could clash.
    pub svg: String,
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

/// A page with everything in it: it opens without a network, runs no script, prints, fits a phone
/// and follows the reader's choice of light or dark.
///
/// `intro` are paragraphs; `settings` are names and values.
/// A part without content is left out. All texts are escaped.
#[must_use]
pub fn html(
    title: &str,
    intro: &[String],
    claims: &[Claim],
    tables: &[ReportTable],
    figures: &[ReportFigure],
    settings: &[(String, String)],
) -> String {
    let mut parts = vec![("claims", "Claims", !claims.is_empty())];
    parts.extend(tables.iter().map(|t| (t.id.as_str(), t.title.as_str(), t.rows.len() > 1)));
    parts.push(("figures", "Figures", !figures.is_empty()));
    parts.push(("settings", "Settings", !settings.is_empty()));
    let mut page =
        Page(String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"));
    page.raw("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    page.raw("<meta name=\"color-scheme\" content=\"light dark\">\n");
    page.element("title", "", title).raw("<style>\n").raw(include_str!("report/style.css"));
    page.raw("</style>\n</head>\n<body>\n<header>\n").element("h1", "", title);
    for paragraph in intro {
        page.element("p", "", paragraph);
    }
    page.raw("<nav aria-label=\"Contents\">\n<ul>\n");
    for (id, name, _) in parts.iter().filter(|p| p.2) {
        page.raw(&format!("<li><a href=\"#{}\">{}</a></li>\n", escape(id), escape(name)));
    }
    page.raw("</ul>\n</nav>\n</header>\n<main>\n");
    for (id, name, _) in parts.iter().filter(|p| p.2) {
        let (id, name) = (escape(id), escape(name));
        page.raw(&format!("<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{name}</h2>\n"));
        match (tables.iter().find(|t| escape(&t.id) == id), &*id) {
            (Some(table), _) => page.table(table),
            (None, "claims") => page.claims(claims),
            (None, "figures") => page.figures(figures),
            (None, _) => page.settings(settings),
        }
        page.raw("</section>\n");
    }
    page.raw("</main>\n</body>\n</html>\n");
    page.0
}

/// The claims as a table of at most 100 columns, in plain text. The band has the unit of the
/// measurement.
#[must_use]
pub fn claims_table(claims: &[Claim]) -> String {
    let rule = LineStyle::none().fill('─').junction('─');
    let mut table = Table::new();
    table
        .load_style(TableStyle::new().header_separator(rule))
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(100)
        .set_header(["id", "paper", "measured", "band", "verdict"]);
    for claim in claims {
        let fitted = if claim.fitted { " [fitted]" } else { "" };
        // A number stays with its unit.
        let paper = format!("{}{fitted}", claim.paper.replace(" °", "\u{a0}°").replace(" %", "\u{a0}%"));
        table.add_row([claim.id, &paper, &measured(claim), &range(claim.band), Verdict::of(claim).text()]);
    }
    // The statement takes the width that the others leave.
    for (number, width) in [(0, 24), (1, 0), (2, 18), (3, 18), (4, 14)] {
        if let Some(column) = table.column_mut(number) {
            column.set_padding((0, 1));
            if width > 0 {
                column.set_constraint(ColumnConstraint::UpperBoundary(Width::Fixed(width)));
            }
        }
    }
    table.trim_fmt().replace('\u{a0}', " ")
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

    /// Sign before the text, and class.
    fn look(self) -> (char, &'static str) {
        match self {
            Verdict::Holds => ('✓', "good"),
            Verdict::Deviates => ('≈', "known"),
            Verdict::Fails => ('✗', "bad"),
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

fn band(claim: &Claim) -> String {
    if claim.band == [None, None] { range(claim.band) } else { quantity(&range(claim.band), claim.unit) }
}

/// A text as HTML, in an element or a quoted attribute.
fn escape(text: &str) -> Cow<'_, str> {
    if !text.contains(['&', '<', '>', '"', '\'']) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            other => out.push(other),
        }
    }
    Cow::Owned(out)
}

/// A page being written.
struct Page(String);

impl Page {
    /// HTML as it is.
    fn raw(&mut self, html: &str) -> &mut Page {
        self.0.push_str(html);
        self
    }

    /// An element around a text, on a line of its own.
    fn element(&mut self, name: &str, attributes: &str, text: &str) -> &mut Page {
        let gap = if attributes.is_empty() { "" } else { " " };
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "<{name}{gap}{attributes}>{}</{name}>", escape(text));
        self
    }

    // Roles are written out where a style sheet turns rows into cards: browsers drop them there.
    fn claims(&mut self, claims: &[Claim]) {
        let count = |verdict| claims.iter().filter(|c| Verdict::of(c) == verdict).count();
        let mut summary = format!(
            "Statements of the paper: {}. Holding: {}. Documented deviations: {}. Not holding: {}. A statement \
             holds if what was measured lies within the band.",
            claims.len(),
            count(Verdict::Holds),
            count(Verdict::Deviates),
            count(Verdict::Fails)
        );
        if claims.iter().any(|c| c.fitted) {
            summary += " “fitted” marks those to which the rig was fitted.";
        }
        self.raw("<table class=\"cards\" role=\"table\">\n").element("caption", "", &summary);
        self.raw("<thead role=\"rowgroup\">\n<tr role=\"row\">\n");
        for (name, class) in
            [("id", ""), ("paper", ""), ("measured", "number"), ("band", "number"), ("verdict", "")]
        {
            let attributes = format!("role=\"columnheader\" scope=\"col\" class=\"{class}\"");
            self.element("th", attributes.trim_end_matches(" class=\"\""), name);
        }
        self.raw("</tr>\n</thead>\n<tbody role=\"rowgroup\">\n");
        for claim in claims {
            let verdict = Verdict::of(claim);
            let (sign, class) = verdict.look();
            self.raw("<tr role=\"row\">\n");
            self.element("th", "role=\"rowheader\" scope=\"row\" class=\"id whole\"", claim.id);
            self.raw("<td role=\"cell\" class=\"wide whole\">").raw(&escape(claim.paper));
            if claim.fitted {
                self.raw(" <span class=\"tag\">fitted</span>");
            }
            if !claim.note.is_empty() {
                self.raw("\n").element("p", "class=\"note\"", claim.note);
            }
            if let Some([low, high]) = claim.deviation {
                let known = quantity(&range([Some(low), Some(high)]), claim.unit);
                self.raw("\n").element("p", "class=\"note\"", &format!("Documented deviation: {known}."));
            }
            self.raw("</td>\n");
            self.element("td", "role=\"cell\" class=\"number\" data-name=\"measured\"", &measured(claim));
            self.element("td", "role=\"cell\" class=\"number\" data-name=\"band\"", &band(claim));
            self.raw(&format!("<td role=\"cell\" class=\"verdict whole {class}\">"));
            self.raw(&format!("<span aria-hidden=\"true\">{sign}</span> {}</td>\n</tr>\n", verdict.text()));
        }
        self.raw("</tbody>\n</table>\n");
    }

    fn table(&mut self, table: &ReportTable) {
        let Some((header, rows)) = table.rows.split_first() else { return };
        // Rows with words become cards where they do not fit; rows of numbers scroll.
        let cards = table.words > 0;
        let numbers = header.len() - table.words;
        let role = |name: &str| if cards { format!(" role=\"{name}\"") } else { String::new() };
        let class = |column: usize| if column < numbers { "number" } else { "wide whole" };
        let id = escape(&table.id);
        self.raw(&format!(
            "<div class=\"scroll\" role=\"region\" aria-labelledby=\"{id}\" tabindex=\"0\">\n"
        ));
        let look = if cards { "cards" } else { "narrow" };
        self.raw(&format!("<table class=\"{look}\"{}>\n", role("table"))).element(
            "caption",
            "",
            &table.caption,
        );
        self.raw(&format!("<thead{}>\n<tr{}>\n", role("rowgroup"), role("row")));
        for (column, name) in header.iter().enumerate() {
            let class = if column == 0 { String::new() } else { format!(" class=\"{}\"", class(column)) };
            self.element("th", &format!("scope=\"col\"{}{class}", role("columnheader")), name);
        }
        self.raw(&format!("</tr>\n</thead>\n<tbody{}>\n", role("rowgroup")));
        for row in rows {
            self.raw(&format!("<tr{}>\n", role("row")));
            for (column, (text, name)) in row.iter().zip(header).enumerate() {
                if column == 0 {
                    let whole = if cards { " class=\"whole\"" } else { "" };
                    self.element("th", &format!("scope=\"row\"{}{whole}", role("rowheader")), text);
                } else {
                    let name = if cards { format!(" data-name=\"{}\"", escape(name)) } else { String::new() };
                    let attributes = format!("class=\"{}\"{}{name}", class(column), role("cell"));
                    self.element("td", &attributes, text);
                }
            }
            self.raw("</tr>\n");
        }
        self.raw("</tbody>\n</table>\n</div>\n");
    }

    fn figures(&mut self, figures: &[ReportFigure]) {
        for figure in figures {
            let (id, caption) = (escape(&figure.id), escape(&figure.caption));
            self.raw(&format!("<figure id=\"figure-{}\">\n", id.replace(char::is_whitespace, "-")));
            self.raw(&format!("<div class=\"card\" role=\"img\" aria-label=\"{caption}\" tabindex=\"0\">\n"));
            self.raw(&sized(&figure.svg)).raw("\n</div>\n");
            self.element("figcaption", "", &figure.caption).raw("</figure>\n");
        }
    }

    fn settings(&mut self, settings: &[(String, String)]) {
        self.raw("<table class=\"narrow\">\n").element("caption", "", "The settings of the runs.");
        self.raw(
            "<thead>\n<tr>\n<th scope=\"col\">setting</th>\n<th scope=\"col\">value</th>\n</tr>\n</thead>\n",
        );
        self.raw("<tbody>\n");
        for (name, value) in settings {
            self.raw("<tr>\n").element("th", "scope=\"row\"", name).element("td", "", value).raw("</tr>\n");
        }
        self.raw("</tbody>\n</table>\n");
    }
}

/// A drawing that grows and shrinks with the page, but not so far that it cannot be read: a wide one
/// scrolls on a phone.
fn sized(svg: &str) -> Cow<'_, str> {
    let svg = svg.trim();
    let width = svg
        .strip_prefix("<svg width=\"")
        .and_then(|rest| rest.split_once('"'))
        .and_then(|(width, _)| width.parse::<f64>().ok());
    match width {
        None => Cow::Borrowed(svg),
        Some(width) => {
            let (least, most) = (0.55 * width, 1.1 * width);
            let style = format!("<svg style=\"min-width:{least:.0}px;max-width:{most:.0}px\" width=");
            Cow::Owned(svg.replacen("<svg width=", &style, 1))
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
            share_y: false,
            panels: vec![Panel {
                series: vec![Series::new("", vec![(0.0, 1.0), (1.0, 2.0)])],
                ..Panel::default()
            }],
        };
        let figures = ["8", "9"].map(|id| ReportFigure {
            id: id.to_owned(),
            caption: format!("Figure {id}: \"errors\" < 0.12°"),
            svg: figure.svg().unwrap(),
        });
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
        html(
            "Laws <b>",
            &["First & second".to_owned()],
            &claims,
            &[table3],
            &figures,
            &[("seed".to_owned(), "1 < 2".to_owned())],
        )
    }

    #[test]
    fn every_text_is_escaped() {
        let page = page();
        for text in [
            "<title>Laws &lt;b&gt;</title>",
            "<h1>Laws &lt;b&gt;</h1>",
            "<p>First &amp; second</p>",
            "worst of ten &lt;seeds&gt; &amp; &quot;more&quot;",
            "aria-label=\"Figure 8: &quot;errors&quot; &lt; 0.12°\"",
            "<td>1 &lt; 2</td>",
            "<td class=\"number\" role=\"cell\" data-name=\"paper (%)\">88.6</td>",
            "<td class=\"wide whole\" role=\"cell\" data-name=\"why\">a &lt; b</td>",
        ] {
            assert!(page.contains(text), "{text}");
        }
        assert!(!page.contains("<b>") && !page.contains("<seeds>"));
        assert_eq!(escape("it's"), "it&#39;s");
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
        assert_eq!(ids, ["claims", "table-3", "figures", "figure-8", "figure-9", "settings"]);
        ids.dedup();
        assert_eq!(ids.len(), 6);
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
        let page = html("T", &[], &[], &[], &[], &[]);
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
            id: "ctc-error-above-2-sim-and-more",
            paper: "The positional error of the computed-torque law stays at the resolution of the encoder for any \
                    velocity above 2 °/s",
            fitted: true,
            ..claim(123_456.789, "cycles/s", [Some(12_345.678), Some(23_456.789)])
        };
        let text = claims_table(&[claim(0.05, "°", [None, Some(0.12)]), long]);
        assert!(text.lines().all(|l| l.chars().count() <= 100), "{text}");
        assert!(!text.contains('\u{1b}'));
        for part in ["pd-error", "0.05 °", "≤ 0.12", "holds", "[fitted]", "verdict", "measured"] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
    }
}
