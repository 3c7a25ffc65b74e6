//! Drawings of curves, as SVG and PNG.
//!
//! A [`Figure`] is a grid of [`Panel`]s, each with its own axes. One layout serves both
//! formats. Nothing of the machine goes in – no font, no clock, no random number – so the same
//! data give the same bytes.
//!
//! A curve is drawn from at most four of its points per pixel column: the first, the lowest, the
//! highest and the last of those that follow one another in the column. The envelope of a curve of
//! a million samples is thus the true one, and no narrow peak is lost. A value that is not a number,
//! not finite or beyond ±1e150 is a gap. A point between two gaps is a dot.

use anyhow::{Context, bail};
use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, register_font};
use std::path::Path;
use std::sync::OnceLock;

/// A curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub label: String,
    /// Points in the order in which they are joined, in the units of the panel's axes.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes with its curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Title above the axes; may be empty.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// The curves. More than one get a legend.
    pub series: Vec<Series>,
    /// Ends of the vertical axis; none, or no interval = from the data and the guide lines.
    pub y_range: Option<(f64, f64)>,
    /// Whether a value holds until the next one: stairs instead of straight lines.
    pub step: bool,
    /// Heights of dashed horizontal guide lines.
    pub lines: Vec<f64>,
}

/// Panels in rows, under a title.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Title of the whole; may be empty.
    pub title: String,
    /// Panels per row.
    pub columns: usize,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// The figure as an SVG document: text stays text, and no element has an `id`, so that many
    /// figures fit into one HTML document.
    ///
    /// # Errors
    /// The font cannot be read (it is built in), or the figure is too large to draw.
    pub fn svg(&self) -> anyhow::Result<String> {
        let layout = Layout::new(self)?;
        let (width, height) = layout.size;
        let mut text = String::new();
        {
            let backend = SVGBackend::with_string(&mut text, layout.units(UNITS));
            let canvas = Canvas { area: backend.into_drawing_area(), em: 1.24, ascent: 0.76, whole: true };
            canvas.figure(self, &layout).context("cannot draw an SVG")?;
            canvas.area.present().context("cannot draw an SVG")?;
        }
        // Attributes that all elements share go to the root. A quote inside a label is `&quot;`,
        // so that no label is touched.
        let Some((head, body)) = text.split_once('>') else { bail!("the SVG has no root") };
        let family = format!(" font-family=\"{FAMILY}\"");
        let body = body.replace(" opacity=\"1\"", "").replace(&family, "").replace(">\n", ">");
        let (w, h) = layout.units(UNITS);
        let head = head.replacen(
            &format!("width=\"{w}\" height=\"{h}\""),
            &format!("width=\"{width}\" height=\"{height}\""),
            1,
        );
        Ok(format!("{head}{family} stroke-linejoin=\"round\" stroke-linecap=\"butt\">{body}\n"))
    }

    /// The figure as a PNG file at twice the size of the SVG.
    ///
    /// # Errors
    /// The font cannot be read (it is built in), or the figure is too large to draw.
    pub fn png(&self) -> anyhow::Result<Vec<u8>> {
        let layout = Layout::new(self)?;
        let (width, height) = layout.units(UNITS);
        let mut pixels = vec![255; 3 * width as usize * height as usize];
        {
            let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
            let canvas = Canvas {
                area: backend.into_drawing_area(),
                em: FONT_HEIGHT,
                ascent: 0.5 * FONT_HEIGHT,
                whole: false,
            };
            canvas.figure(self, &layout).context("cannot draw a PNG")?;
            canvas.area.present().context("cannot draw a PNG")?;
        }
        // Drawn at twice the resolution and averaged: smooth edges.
        let (wide, row) = (width as usize * 3, width as usize / 2);
        let mut small = Vec::with_capacity(pixels.len() / 4);
        for pair in pixels.chunks_exact(2 * wide) {
            let (upper, lower) = pair.split_at(wide);
            for i in 0..row {
                for c in 0..3 {
                    let at = 6 * i + c;
                    let sum = [upper[at], upper[at + 3], lower[at], lower[at + 3]].map(u16::from);
                    small.push(((sum.iter().sum::<u16>() + 2) / 4) as u8);
                }
            }
        }
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width / 2, height / 2);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: PIXELS_PER_METRE,
            yppu: PIXELS_PER_METRE,
            unit: png::Unit::Meter,
        }));
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&small)?;
        writer.finish()?;
        Ok(file)
    }

    /// Writes the figure to a file whose name ends in `.svg` or `.png`.
    ///
    /// # Errors
    /// Another ending, as [`svg`](Self::svg) and [`png`](Self::png), or the file cannot be written; the
    /// file is named.
    pub fn save(&self, path: &Path) -> anyhow::Result<()> {
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let bytes = match ending.as_deref() {
            Some("svg") => self.svg()?.into_bytes(),
            Some("png") => self.png()?,
            _ => bail!("cannot draw {}: the name of a figure must end in .svg or .png", path.display()),
        };
        std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
    }
}

/// Units per CSS pixel in which both formats are drawn: plotters takes whole numbers only.
const UNITS: u32 = 4;
/// Size of a panel, px.
const PANEL: (f64, f64) = (600.0, 350.0);
/// Largest drawing, px: its bitmap takes 1.3 GB while it is drawn.
const LARGEST: f64 = 27e6;
/// 192 dpi.
const PIXELS_PER_METRE: u32 = 7559;
/// Beyond this a value is no datum: squares and differences stay finite.
const BEYOND: f64 = 1e150;

const FAMILY: &str = "DejaVu Sans, sans-serif";
/// Ascent and descent of DejaVu Sans, em: what plotters takes for the size of a font.
const FONT_HEIGHT: f64 = 1.164;
/// Type sizes, px.
const FIGURE_TITLE: f64 = 19.0;
const PANEL_TITLE: f64 = 16.0;
const LABEL: f64 = 15.0;
const TICK: f64 = 14.0;

/// Okabe and Ito's palette without yellow, which is lost on white. Dark against dark first.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x00, 0x00, 0x00),
];
const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const QUIET: RGBColor = RGBColor(0x6b, 0x6b, 0x6b);
const GRID: RGBColor = RGBColor(0xe6, 0xe6, 0xe6);
const ZERO: RGBColor = RGBColor(0xbd, 0xbd, 0xbd);

/// A point that can be drawn.
fn drawable(&(x, y): &(f64, f64)) -> bool {
    // Not a number compares false.
    x.abs() <= BEYOND && y.abs() <= BEYOND
}

/// Lowest and highest of the values that can be drawn.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| v.abs() <= BEYOND).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((lo, hi)) => Some((lo.min(v), hi.max(v))),
    })
}

/// An interval with room around it, if it has no length.
fn widen(range: Option<(f64, f64)>) -> (f64, f64) {
    match range {
        None => (0.0, 1.0),
        Some((lo, hi)) => {
            let size = lo.abs().max(hi.abs());
            if hi - lo > (1e-12 * size).max(BEYOND.recip()) {
                (lo, hi)
            } else if size > BEYOND.recip() {
                (lo - 0.1 * size, hi + 0.1 * size)
            } else {
                (-1.0, 1.0)
            }
        }
    }
}

/// An axis: its ends, the marks on it, and the power of ten by which their labels are divided.
#[derive(Clone, Debug, PartialEq)]
struct Axis {
    lo: f64,
    hi: f64,
    ticks: Vec<(f64, String)>,
    exponent: i32,
}

impl Axis {
    /// Marks at about `count` round values.
    fn new(lo: f64, hi: f64, count: f64) -> Axis {
        // The step is `round` · 10^`power`, as whole numbers: a mark is one division away from the
        // exact decimal, and 3 · 0.1 does not become 0.30000000000000004.
        let rough = (hi - lo) / count;
        let mut power = rough.log10().floor() as i32;
        let mantissa = rough / 10_f64.powi(power);
        let round = match mantissa {
            m if m <= 1.0 => 1,
            m if m <= 2.0 => 2,
            m if m <= 5.0 => 5,
            _ => {
                power += 1;
                1
            }
        };
        let at = |i: i64, power: i32| {
            let whole = (i * round) as f64;
            if power < 0 { whole / 10_f64.powi(-power) } else { whole * 10_f64.powi(power) }
        };
        let step = at(1, power);
        let (first, last) = ((lo / step - 1e-6).ceil() as i64, (hi / step + 1e-6).floor() as i64);
        let largest = at(first.abs().max(last.abs()), power);
        let exponent = match largest.log10() {
            _ if largest <= 0.0 => 0,
            size if size >= 5.0 || (size < -2.0 && power < -3) => (size + 1e-9).floor() as i32,
            _ => 0,
        };
        let digits = (exponent - power).max(0) as usize;
        let ticks = (first..=last)
            .map(|i| (at(i, power), format!("{:.digits$}", at(i, power - exponent)).replace('-', "−")))
            .collect();
        Axis { lo, hi, ticks, exponent }
    }

    /// An axis over data from `lo` to `hi`; an end that lies just inside a round value is moved there.
    fn over_data(lo: f64, hi: f64, count: f64, slack: f64) -> Axis {
        let axis = Axis::new(lo, hi, count);
        let step = match axis.ticks.as_slice() {
            [a, b, ..] => b.0 - a.0,
            _ => return axis,
        };
        let (down, up) = ((lo / step).floor() * step, (hi / step).ceil() * step);
        let reach = slack * (hi - lo);
        let (lo, hi) = (if lo - down <= reach { down } else { lo }, if up - hi <= reach { up } else { hi });
        Axis::new(lo, hi, count)
    }

    /// `×10⁻⁶`, if the labels are divided.
    fn factor(&self) -> Option<String> {
        if self.exponent == 0 {
            return None;
        }
        let digits = self.exponent.to_string();
        let raised = digits.chars().map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        });
        Some("×10".chars().chain(raised).collect())
    }

    /// Where a value lies: 0 at the lower end, 1 at the upper.
    fn share(&self, value: f64) -> f64 {
        ((value - self.lo) / (self.hi - self.lo)).clamp(-1e4, 1e4)
    }
}

/// Width of a text in px.
fn text_width(text: &str, size: f64) -> anyhow::Result<f64> {
    // Measured large: plotters gives whole pixels.
    const LARGE: f64 = 1000.0;
    let font = FontDesc::new(FontFamily::Name(FAMILY), LARGE * FONT_HEIGHT, FontStyle::Normal);
    let ((left, _), (right, _)) = font.layout_box(text)?;
    Ok(f64::from(right - left) * size / LARGE)
}

/// A text made to fit: its size reduced by at most a third, then its end left out.
fn fit(text: &str, size: f64, width: f64) -> anyhow::Result<(String, f64)> {
    let size = size * (width / text_width(text, size)?.max(width)).max(2.0 / 3.0);
    if text_width(text, size)? <= width + 1e-6 {
        return Ok((text.to_owned(), size));
    }
    let mut kept = text.to_owned();
    loop {
        let shorter = format!("{}…", kept.trim_end());
        if kept.pop().is_none() || text_width(&shorter, size)? <= width {
            return Ok((shorter, size));
        }
    }
}

/// A rectangle in px, its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

/// A panel, ready to be drawn.
#[derive(Clone, Debug)]
struct Placed {
    x: Axis,
    y: Axis,
    /// Where the curves go.
    area: Area,
    /// Baseline of the title.
    title: f64,
    /// From the vertical axis to the baseline of its name.
    y_label: f64,
    /// Lines of the legend: number, label and left end of each entry, and the baseline.
    legend: Vec<(usize, String, f64, f64)>,
}

/// Where everything goes.
#[derive(Clone, Debug)]
struct Layout {
    /// Size of the figure, px.
    size: (u32, u32),
    panels: Vec<Placed>,
}

/// Space around and between things, px.
mod space {
    /// Around the figure.
    pub(super) const EDGE: f64 = 14.0;
    /// For the figure's title.
    pub(super) const FIGURE_TITLE: f64 = 40.0;
    /// For a panel's title.
    pub(super) const PANEL_TITLE: f64 = 32.0;
    /// For a line of the legend, or a factor above the axis.
    pub(super) const LINE: f64 = 22.0;
    /// From the axes to the panel's lower end.
    pub(super) const BELOW: f64 = 62.0;
    /// From the axes to the panel's right end: half a label sticks out.
    pub(super) const RIGHT: f64 = 24.0;
    /// A line in the legend, with the gap to its label; the gap to the next.
    pub(super) const SWATCH: (f64, f64, f64) = (24.0, 7.0, 20.0);
}

impl Layout {
    fn new(figure: &Figure) -> anyhow::Result<Layout> {
        static FONT: OnceLock<bool> = OnceLock::new();
        let usable =
            FONT.get_or_init(|| register_font(FAMILY, FontStyle::Normal, dejavu::sans::regular()).is_ok());
        if !usable {
            bail!("the built-in font DejaVu Sans cannot be read");
        }

        let columns = figure.columns.clamp(1, figure.panels.len().max(1));
        let rows = figure.panels.len().div_ceil(columns);
        let head = if figure.title.is_empty() { 0.0 } else { space::FIGURE_TITLE };
        let axes: Vec<(Axis, Axis)> = figure.panels.iter().map(axes).collect();

        let mut labels = 0.0_f64;
        for (_, label) in axes.iter().flat_map(|(_, y)| &y.ticks) {
            labels = labels.max(text_width(label, TICK)?);
        }
        let named = figure.panels.iter().any(|p| !p.y_label.is_empty());
        let left = labels + if named { 19.0 + LABEL } else { 10.0 };
        let width = PANEL.0 - left - space::RIGHT;

        let mut panels = Vec::new();
        let mut top = space::EDGE + head;
        for row in 0..rows {
            let these = row * columns..((row + 1) * columns).min(figure.panels.len());
            let mut legends = Vec::new();
            for panel in &figure.panels[these.clone()] {
                legends.push(legend(panel, width)?);
            }
            let lines = legends.iter().map(|(lines, _)| *lines).max().unwrap_or(0) as f64;
            let titled = figure.panels[these.clone()].iter().any(|p| !p.title.is_empty());
            let divided = axes[these.clone()].iter().any(|(_, y)| y.exponent != 0);
            let legend_top = top + if titled { space::PANEL_TITLE } else { 10.0 };
            let area_top = legend_top + space::LINE * (lines + if divided { 1.0 } else { 0.0 });
            let bottom = area_top + PANEL.1 - space::PANEL_TITLE - space::BELOW;
            for (column, (index, (_, legend))) in these.zip(legends).enumerate() {
                let from = space::EDGE + column as f64 * PANEL.0 + left;
                let (x, y) = axes[index].clone();
                panels.push(Placed {
                    x,
                    y,
                    area: Area { left: from, top: area_top, right: from + width, bottom },
                    title: top + 18.0,
                    y_label: labels + 19.0,
                    legend: legend
                        .into_iter()
                        .map(|(number, label, line, at)| {
                            (number, label, from + at, legend_top + space::LINE * line as f64 + 11.0)
                        })
                        .collect(),
                });
            }
            top = bottom + space::BELOW;
        }
        let (width, height) = (2.0 * space::EDGE + columns as f64 * PANEL.0, top + space::EDGE);
        if width * height > LARGEST {
            bail!("a figure of {} panels is too large to draw; split it", figure.panels.len());
        }
        Ok(Layout { size: (width.ceil() as u32, height.ceil() as u32), panels })
    }

    fn units(&self, units: u32) -> (u32, u32) {
        (self.size.0 * units, self.size.1 * units)
    }
}

/// The axes of a panel.
fn axes(panel: &Panel) -> (Axis, Axis) {
    let points = || panel.series.iter().flat_map(|s| &s.points).copied().filter(drawable);
    let (lo, hi) = widen(extent(points().map(|p| p.0)));
    let x = Axis::over_data(lo, hi, 6.0, 0.02);
    let fixed = panel.y_range.filter(|&range| widen(Some(range)) == range && drawable(&range));
    let y = match fixed {
        Some((lo, hi)) => Axis::new(lo, hi, 5.0),
        None => {
            let (lo, hi) = widen(extent(points().map(|p| p.1).chain(panel.lines.iter().copied())));
            let room = 0.05 * (hi - lo);
            Axis::over_data(lo - room, hi + room, 5.0, 0.05)
        }
    };
    (x, y)
}

/// How many lines a legend takes, and for each entry: number of the series, label, line, left end.
#[allow(clippy::type_complexity)]
fn legend(panel: &Panel, width: f64) -> anyhow::Result<(usize, Vec<(usize, String, usize, f64)>)> {
    if panel.series.len() < 2 {
        return Ok((0, Vec::new()));
    }
    let (swatch, gap, next) = space::SWATCH;
    let (mut line, mut at, mut entries) = (0, 0.0, Vec::new());
    for (number, series) in panel.series.iter().enumerate() {
        let (label, _) = fit(&series.label, TICK, width - swatch - gap)?;
        let needed = swatch + gap + text_width(&label, TICK)?;
        if at > 0.0 && at + needed > width {
            (line, at) = (line + 1, 0.0);
        }
        entries.push((number, label, line, at));
        at += needed + next;
    }
    Ok((line + 1, entries))
}

/// Of points in px, those that decide the picture: of each run within one pixel column the first,
/// the lowest, the highest and the last.
fn decimate(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    let mut rest = points;
    while let Some(first) = rest.first() {
        let column = first.0.floor();
        let length = rest.iter().take_while(|p| p.0.floor() == column).count();
        let (run, after) = rest.split_at(length);
        rest = after;
        let by_height = |a: &usize, b: &usize| run[*a].1.total_cmp(&run[*b].1);
        let lowest = (0..length).min_by(by_height).unwrap_or(0);
        let highest = (0..length).max_by(by_height).unwrap_or(0);
        let mut indices = [0, lowest.min(highest), lowest.max(highest), length - 1].to_vec();
        indices.dedup();
        kept.extend(indices.into_iter().map(|i| run[i]));
    }
    kept
}

/// The part of a straight line within an area; none = it passes by (Liang and Barsky 1984).
fn clip(a: (f64, f64), b: (f64, f64), area: Area) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (speed, room) in
        [(-dx, a.0 - area.left), (dx, area.right - a.0), (-dy, a.1 - area.top), (dy, area.bottom - a.1)]
    {
        if speed > 0.0 {
            leave = leave.min(room / speed);
        } else if speed < 0.0 {
            enter = enter.max(room / speed);
        } else if room < 0.0 {
            return None;
        }
    }
    let at = |t: f64| if t == 1.0 { b } else { (a.0 + t * dx, a.1 + t * dy) };
    (enter <= leave).then(|| (at(enter), at(leave)))
}

/// What a curve looks like in px.
#[derive(Clone, Debug, Default, PartialEq)]
struct Trail {
    /// Connected lines.
    lines: Vec<Vec<(f64, f64)>>,
    /// Lone points.
    dots: Vec<(f64, f64)>,
}

impl Trail {
    fn new(points: &[(f64, f64)], step: bool, placed: &Placed) -> Trail {
        let Area { left, top, right, bottom } = placed.area;
        let place = |&(x, y): &(f64, f64)| {
            (left + (right - left) * placed.x.share(x), bottom - (bottom - top) * placed.y.share(y))
        };
        let mut trail = Trail::default();
        for piece in points.split(|p| !drawable(p)) {
            let piece: Vec<_> = piece.iter().map(place).collect();
            if let [first, rest @ ..] = piece.as_slice()
                && rest.iter().all(|p| p == first)
            {
                if clip(*first, *first, placed.area).is_some() {
                    trail.dots.push(*first);
                }
                continue;
            }
            let mut corners = decimate(&piece);
            if step {
                let stairs = |w: &[(f64, f64)]| [(w[1].0, w[0].1), w[1]];
                corners = corners[..corners.len().min(1)]
                    .iter()
                    .copied()
                    .chain(corners.windows(2).flat_map(stairs))
                    .collect();
            }
            let mut line: Vec<(f64, f64)> = Vec::new();
            for pair in corners.windows(2) {
                let Some((from, to)) = clip(pair[0], pair[1], placed.area) else { continue };
                if line.last() != Some(&from) {
                    trail.lines.push(std::mem::replace(&mut line, vec![from]));
                }
                line.push(to);
            }
            trail.lines.push(line);
        }
        trail.lines.retain(|l| l.len() > 1);
        trail
    }
}

/// A plotters drawing with what its backends see differently.
struct Canvas<DB: DrawingBackend> {
    area: DrawingArea<DB, Shift>,
    /// What the backend wants to be told for a font of one em.
    em: f64,
    /// From where the backend puts a text's top to its baseline, em.
    ascent: f64,
    /// Whether the backend draws a bent line well in one go. The bitmap backend fills the outline of a
    /// wide one by the even-odd rule, and leaves holes where it crosses itself.
    whole: bool,
}

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// px to units.
fn units(px: f64) -> i32 {
    (px * f64::from(UNITS)).round() as i32
}

/// The middle of a pixel: lines there are sharp.
fn middle(px: f64) -> f64 {
    px.floor() + 0.5
}

impl<DB: DrawingBackend> Canvas<DB> {
    fn line(&self, points: &[(f64, f64)], color: RGBColor, width: f64) -> Drawn<DB> {
        let mut path: Vec<(i32, i32)> = points.iter().map(|p| (units(p.0), units(p.1))).collect();
        path.dedup();
        let style = ShapeStyle { color: color.into(), filled: true, stroke_width: units(width) as u32 };
        if self.whole {
            return self.area.draw(&PathElement::new(path, style));
        }
        for pair in path.windows(2) {
            self.area.draw(&PathElement::new(pair, style))?;
        }
        for corner in path.get(1..path.len().saturating_sub(1)).unwrap_or_default() {
            self.area.draw(&Circle::new(*corner, units(width) / 2, style))?;
        }
        Ok(())
    }

    fn straight(&self, from: (f64, f64), to: (f64, f64), color: RGBColor, width: f64) -> Drawn<DB> {
        self.line(&[from, to], color, width)
    }

    fn dot(&self, at: (f64, f64), color: RGBColor) -> Drawn<DB> {
        let style = ShapeStyle { color: color.into(), filled: true, stroke_width: 0 };
        self.area.draw(&Circle::new((units(at.0), units(at.1)), units(2.5), style))
    }

    /// A text by its anchor on the baseline; `upwards` = turned a quarter to the left.
    fn text(
        &self,
        text: &str,
        at: (f64, f64),
        anchor: HPos,
        (size, color): (f64, RGBColor),
        upwards: bool,
    ) -> Drawn<DB> {
        if text.is_empty() {
            return Ok(());
        }
        let mut font =
            FontDesc::new(FontFamily::Name(FAMILY), size * f64::from(UNITS) * self.em, FontStyle::Normal);
        let (mut x, mut y) = at;
        if upwards {
            font = font.transform(FontTransform::Rotate270);
            x -= self.ascent * size;
        } else {
            y -= self.ascent * size;
        }
        let style = TextStyle::from(font).color(&color).pos(Pos::new(anchor, VPos::Top));
        self.area.draw_text(text, &style, (units(x), units(y)))
    }

    fn figure(&self, figure: &Figure, layout: &Layout) -> anyhow::Result<()>
    where
        DB::ErrorType: 'static,
    {
        let (width, height) = layout.units(UNITS);
        self.area.draw(&Rectangle::new([(0, 0), (width as i32, height as i32)], WHITE.filled()))?;
        if !figure.title.is_empty() {
            let from = layout.panels.first().map_or(space::EDGE, |p| p.area.left);
            let room = f64::from(layout.size.0) - from - space::EDGE;
            let (title, size) = fit(&figure.title, FIGURE_TITLE, room)?;
            self.text(&title, (from, space::EDGE + 20.0), HPos::Left, (size, INK), false)?;
        }
        for (panel, placed) in figure.panels.iter().zip(&layout.panels) {
            self.panel(panel, placed)?;
        }
        Ok(())
    }

    fn panel(&self, panel: &Panel, placed: &Placed) -> anyhow::Result<()>
    where
        DB::ErrorType: 'static,
    {
        let area @ Area { left, top, right, bottom } = placed.area;
        let (width, height) = (right - left, bottom - top);
        let column = |x: f64| middle(left + width * placed.x.share(x));
        let row = |y: f64| middle(bottom - height * placed.y.share(y));
        let (low, high) = (middle(bottom), middle(top));
        let (near, far) = (middle(left), middle(right));

        for (x, _) in &placed.x.ticks {
            self.straight((column(*x), high), (column(*x), low), GRID, 1.0)?;
        }
        for (y, _) in &placed.y.ticks {
            let zero = y.abs() < 1e-9 * (placed.y.hi - placed.y.lo);
            self.straight((near, row(*y)), (far, row(*y)), if zero { ZERO } else { GRID }, 1.0)?;
        }

        let mut empty = true;
        for (series, color) in panel.series.iter().zip(PALETTE.iter().cycle()) {
            let trail = Trail::new(&series.points, panel.step, placed);
            empty &= !series.points.iter().any(drawable);
            for line in &trail.lines {
                self.line(line, *color, 1.25)?;
            }
            for dot in &trail.dots {
                self.dot(*dot, *color)?;
            }
        }
        if empty {
            let at = (left + width / 2.0, top + height / 2.0);
            self.text("no data", at, HPos::Center, (LABEL, QUIET), false)?;
        }
        for &y in &panel.lines {
            let y = bottom - height * placed.y.share(y);
            if clip((left, y), (right, y), area).is_none() {
                continue;
            }
            let mut from = left;
            while from < right {
                self.straight((from, middle(y)), ((from + 7.0).min(right), middle(y)), INK, 1.0)?;
                from += 12.0;
            }
        }

        self.straight((near, high), (near, low + 0.5), INK, 1.0)?;
        self.straight((near - 0.5, low), (far, low), INK, 1.0)?;
        for (x, label) in &placed.x.ticks {
            self.straight((column(*x), low), (column(*x), low + 5.0), INK, 1.0)?;
            self.text(label, (column(*x), low + 20.0), HPos::Center, (TICK, INK), false)?;
        }
        for (y, label) in &placed.y.ticks {
            self.straight((near - 5.0, row(*y)), (near, row(*y)), INK, 1.0)?;
            // Half the height of a digit below the mark.
            self.text(label, (near - 9.0, row(*y) + 0.365 * TICK), HPos::Right, (TICK, INK), false)?;
        }

        let (title, size) = fit(&panel.title, PANEL_TITLE, width)?;
        self.text(&title, (left, placed.title), HPos::Left, (size, INK), false)?;
        let (label, size) = fit(&panel.x_label, LABEL, width - 2.0 * 60.0)?;
        self.text(&label, (left + width / 2.0, low + 43.0), HPos::Center, (size, INK), false)?;
        let (label, size) = fit(&panel.y_label, LABEL, height)?;
        self.text(&label, (left - placed.y_label, top + height / 2.0), HPos::Center, (size, INK), true)?;
        if let Some(factor) = placed.x.factor() {
            self.text(&factor, (right, low + 43.0), HPos::Right, (TICK, INK), false)?;
        }
        if let Some(factor) = placed.y.factor() {
            self.text(&factor, (left, top - 8.0), HPos::Left, (TICK, INK), false)?;
        }
        let (swatch, gap, _) = space::SWATCH;
        for (number, label, from, baseline) in &placed.legend {
            let (color, y) = (PALETTE[number % PALETTE.len()], middle(baseline - 0.3 * TICK));
            self.straight((*from, y), (from + swatch, y), color, 2.0)?;
            self.text(label, (from + swatch + gap, *baseline), HPos::Left, (TICK, INK), false)?;
        }
        Ok(())
    }
}
