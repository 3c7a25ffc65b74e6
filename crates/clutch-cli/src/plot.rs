//! Drawings of curves, as SVG and PNG.
//!
//! A [`Figure`] is a grid of [`Panel`]s, each with its own axes, and curves or shaded cells. The PNG is the SVG, rendered.
//! Nothing of the machine is used – no font, no clock, no random number – so the same data
//! give the same bytes.
//!
//! A curve is drawn from at most four of its points per pixel column: the first, the lowest, the
//! highest and the last of those that follow one another in the column. The envelope of a curve of
//! a million samples is thus the true one, and no narrow peak is lost. A value that is not a number,
//! not finite or beyond ±1e150 is a gap. A point between two gaps is a dot.

use anyhow::{Context, bail};
use clutch_sim::picture::Envelope;
use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use skrifa::MetadataProvider;
use skrifa::instance::{LocationRef, Size};
use std::path::Path;

/// A curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub label: String,
    /// Points in the order in which they are joined, in the units of the panel's axes.
    pub points: Vec<(f64, f64)>,
    /// Band behind the curve, pale in its colour: place, lowest, highest. None for no band.
    pub band: Vec<(f64, f64, f64)>,
    /// True for what the others are held against, as a path: dark, behind them, and of no colour of its own.
    pub guide: bool,
}

impl Series {
    /// A curve without a band.
    pub fn new(label: impl Into<String>, points: Vec<(f64, f64)>) -> Series {
        Series { label: label.into(), points, ..Series::default() }
    }

    /// A curve of means over time (s), with the band from lowest to highest.
    #[must_use]
    pub fn envelope(label: impl Into<String>, of: &Envelope, factor: f64) -> Series {
        let points = of.time.iter().zip(&of.mean).map(|(t, y)| (*t, y * factor)).collect();
        let ends = of.low.iter().zip(&of.high);
        let band = of.time.iter().zip(ends).map(|(t, (low, high))| (*t, low * factor, high * factor));
        Series { band: band.collect(), ..Series::new(label, points) }
    }
}

/// Stretches of the horizontal axis, shaded behind the curves. Each of several shades in a panel is a strip at its top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shade {
    /// Name in the legend.
    pub label: String,
    /// Begin and end of each stretch.
    pub stretches: Vec<(f64, f64)>,
    /// Number of the curve whose colour it takes; none for grey.
    pub of: Option<usize>,
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
    /// The curves. With more than one there is a legend.
    pub series: Vec<Series>,
    /// Shaded stretches behind the curves.
    pub shades: Vec<Shade>,
    /// Ends of the vertical axis; none, or no interval = from the data and the guide lines.
    pub y_range: Option<(f64, f64)>,
    /// True if a value holds until the next one: stairs instead of straight lines.
    pub step: bool,
    /// Heights of dashed horizontal guide lines.
    pub lines: Vec<f64>,
    /// A table of shaded cells, in place of the curves.
    pub cells: Option<Cells>,
}

/// A table of shaded cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Names of the rows, from below.
    pub rows: Vec<String>,
    /// Cells, row by row from below.
    pub cells: Vec<Cell>,
}

/// A cell: its shade from 0, light, to 1, dark, and a short text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    /// The shade.
    pub shade: f64,
    /// The text.
    pub text: String,
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
    /// True if the panels of a row have one vertical scale: they are to be compared.
    pub share_y: bool,
    /// True if panels are narrow, so that their texts can be read on a phone.
    pub narrow: bool,
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
            let backend = SVGBackend::with_string(&mut text, layout.units());
            let canvas = Canvas { area: backend.into_drawing_area() };
            canvas.figure(self, &layout).context("cannot draw an SVG")?;
            canvas.area.present().context("cannot draw an SVG")?;
        }
        // Attributes that all elements share go to the root. A quote inside a label is `&quot;`,
        // so that no label is touched.
        let Some((head, body)) = text.split_once('>') else { bail!("the SVG has no root") };
        let family = format!(" font-family=\"{FAMILY}\"");
        let body = body
            .replace(" opacity=\"1\"", "")
            .replace(&family, "")
            .replace(">\n", ">")
            .replace("\n</text>", "</text>");
        let (w, h) = layout.units();
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
        let mut options = Options { font_family: FAMILY.to_owned(), ..Options::default() };
        let fonts = options.fontdb_mut();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.set_sans_serif_family("DejaVu Sans");
        let tree = Tree::from_str(&self.svg()?, &options).context("cannot draw a PNG")?;
        let size = tree.size().to_int_size();
        let (width, height) = (2 * size.width(), 2 * size.height());
        let mut pixels = Pixmap::new(width, height).context("cannot draw a PNG")?;
        resvg::render(&tree, Transform::from_scale(2.0, 2.0), &mut pixels.as_mut());
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: PIXELS_PER_METRE,
            yppu: PIXELS_PER_METRE,
            unit: png::Unit::Meter,
        }));
        // The figure has a ground: nothing shines through.
        let opaque: Vec<u8> = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&opaque)?;
        writer.finish()?;
        Ok(file)
    }

    /// The panels as narrow figures of their own, with the scales that they have in this one.
    #[must_use]
    pub fn split(&self) -> Vec<Figure> {
        let alone = |(panel, (_, y)): (&Panel, (Axis, Axis))| {
            let y_range = if panel.cells.is_some() { panel.y_range } else { Some((y.lo, y.hi)) };
            // Cells need their width.
            let narrow = panel.cells.is_none();
            let panels = vec![Panel { y_range, ..panel.clone() }];
            Figure { columns: 1, panels, narrow, ..Figure::default() }
        };
        self.panels.iter().zip(self.axes()).map(alone).collect()
    }

    /// The axes of each panel.
    fn axes(&self) -> Vec<(Axis, Axis)> {
        let mut ranges: Vec<_> = self.panels.iter().map(heights).collect();
        if self.share_y {
            for row in ranges.chunks_mut(self.columns.max(1)) {
                let all = extent(row.iter().flatten().flat_map(|(low, high)| [*low, *high]));
                row.fill(all);
            }
        }
        self.panels.iter().zip(ranges).map(|(panel, range)| axes(panel, range)).collect()
    }

    /// Writes the figure to a file whose name ends in `.svg` or `.png`.
    ///
    /// # Errors
    /// Another ending, as [`svg`](Self::svg) and [`png`](Self::png), or the file cannot be written; the
    /// file is named.
    pub fn save(&self, path: &Path) -> anyhow::Result<()> {
        let bytes = match figure_format(path)? {
            FigureFormat::Svg => self.svg()?.into_bytes(),
            FigureFormat::Png => self.png()?,
        };
        std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
    }
}

/// The format of a figure's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// `.svg`
    Svg,
    /// `.png`
    Png,
}

/// The format that the name of a figure's file requests.
///
/// # Errors
/// An ending other than `.svg` and `.png`; the file is named.
pub fn figure_format(path: &Path) -> anyhow::Result<FigureFormat> {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("svg") => Ok(FigureFormat::Svg),
        Some("png") => Ok(FigureFormat::Png),
        _ => bail!("cannot draw {}: the name of a figure must end in .svg or .png", path.display()),
    }
}

/// Size of a panel, px, and width of a narrow one.
const PANEL: (f64, f64) = (600.0, 350.0);
const NARROW: f64 = 480.0;
/// Least height of a row of cells, px.
const CELL: f64 = 22.0;
/// Ends of the scale of shades: of one hue, so that it is read without colours, too.
const SHADES: [RGBColor; 2] = [RGBColor(0xee, 0xf4, 0xfb), RGBColor(0x08, 0x30, 0x6b)];
/// Largest drawing, px: some 100 panels, 250 MB of pixels.
const LARGEST: f64 = 21e6;
/// 192 dpi.
const PIXELS_PER_METRE: u32 = 7559;
/// Units per CSS pixel: plotters takes whole numbers only.
const UNITS: u32 = 4;
/// Beyond this a value is not a datum: squares and differences stay finite.
const BEYOND: f64 = 1e150;

const FAMILY: &str = "DejaVu Sans, sans-serif";
/// Type sizes, px.
const FIGURE_TITLE: f64 = 19.0;
const PANEL_TITLE: f64 = 16.0;
const LABEL: f64 = 15.0;
const TICK: f64 = 14.0;

/// Okabe and Ito's palette without yellow, which is lost on white; the eighth curve has the first's colour.
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
/// Strength of the colour of a band, of a shade and of strips.
const BAND: f64 = 0.22;
const SHADE: f64 = 0.2;
const STRIP: f64 = 0.5;
/// Height of a strip, px, and the part of it that is filled.
const STRIP_HEIGHT: f64 = 9.0;
const STRIP_FILLED: f64 = 7.0;

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
        let round = match mantissa * mantissa {
            m if m <= 2.0 => 1,
            m if m <= 10.0 => 2,
            m if m <= 50.0 => 5,
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

    /// Takes marks away until their labels stand apart on a horizontal axis of that length.
    fn thin_out(&mut self, length: f64) -> anyhow::Result<()> {
        for count in (1..6).rev() {
            let mut labels = 0.0_f64;
            for (_, label) in &self.ticks {
                labels = labels.max(text_width(label, TICK)?);
            }
            if (labels + 16.0) * (self.ticks.len() as f64 - 1.0) <= length {
                break;
            }
            *self = Axis::new(self.lo, self.hi, f64::from(count));
        }
        Ok(())
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

    /// Position of a value: 0 at the lower end, 1 at the upper.
    fn share(&self, value: f64) -> f64 {
        ((value - self.lo) / (self.hi - self.lo)).clamp(-1e4, 1e4)
    }
}

/// Width of a text in the unit of its type size, in DejaVu Sans, without kerning.
fn text_width(text: &str, size: f64) -> anyhow::Result<f64> {
    let font = skrifa::FontRef::new(dejavu::sans::regular())
        .context("the built-in font DejaVu Sans cannot be read")?;
    let (letters, widths) = (font.charmap(), font.glyph_metrics(Size::unscaled(), LocationRef::default()));
    let em = f64::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
    let width = |c| letters.map(c).and_then(|glyph| widths.advance_width(glyph)).unwrap_or_default();
    Ok(text.chars().map(|c| f64::from(width(c))).sum::<f64>() * size / em)
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
    /// Area of the curves.
    area: Area,
    /// Baseline of the title.
    title: f64,
    /// From the vertical axis to the baseline of its name.
    y_label: f64,
    /// Baseline of the legend's first line.
    legend: f64,
    entries: Vec<Entry>,
}

/// The name of a curve or a shade in the legend.
#[derive(Clone, Debug)]
struct Entry {
    swatch: Swatch,
    label: String,
    /// Line of the legend, from 0.
    line: usize,
    /// Left end within the line, px.
    left: f64,
}

/// The sign before a name in the legend.
#[derive(Clone, Copy, Debug)]
enum Swatch {
    /// A line.
    Line(RGBColor),
    /// A field.
    Field(RGBColor),
}

impl Series {
    /// Colour of the curve of that number.
    fn colour(&self, number: usize) -> RGBColor {
        if self.guide { INK } else { PALETTE[number % PALETTE.len()] }
    }
}

impl Shade {
    /// Colour of that strength, as it is on white.
    fn colour(&self, strength: f64) -> RGBColor {
        let RGBColor(r, g, b) = self.of.map_or(QUIET, |number| PALETTE[number % PALETTE.len()]);
        let pale = |c: u8| (255.0 - strength * (255.0 - f64::from(c))).round() as u8;
        RGBColor(pale(r), pale(g), pale(b))
    }
}

/// Places of all parts.
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
        let columns = figure.columns.clamp(1, figure.panels.len().max(1));
        let rows = figure.panels.len().div_ceil(columns);
        let head = if figure.title.is_empty() { 0.0 } else { space::FIGURE_TITLE };
        let mut axes = figure.axes();

        let mut labels = 0.0_f64;
        for (_, label) in axes.iter().flat_map(|(_, y)| &y.ticks) {
            labels = labels.max(text_width(label, TICK)?);
        }
        let named = figure.panels.iter().any(|p| !p.y_label.is_empty());
        let left = labels + if named { 19.0 + LABEL } else { 10.0 };
        let panel = if figure.narrow { NARROW } else { PANEL.0 };
        let width = panel - left - space::RIGHT;
        for ((x, _), panel) in axes.iter_mut().zip(&figure.panels) {
            if panel.cells.is_none() {
                x.thin_out(width)?;
            }
        }

        let mut panels = Vec::new();
        let mut top = space::EDGE + head;
        for row in 0..rows {
            let these = row * columns..((row + 1) * columns).min(figure.panels.len());
            let mut legends = Vec::new();
            for panel in &figure.panels[these.clone()] {
                legends.push(legend(panel, width)?);
            }
            let lines = legends.iter().flatten().map(|e| e.line + 1).max().unwrap_or(0) as f64;
            let titled = figure.panels[these.clone()].iter().any(|p| !p.title.is_empty());
            let divided = axes[these.clone()].iter().any(|(_, y)| y.exponent != 0);
            let legend_top = top + if titled { space::PANEL_TITLE } else { 10.0 };
            let area_top = legend_top + space::LINE * (lines + if divided { 1.0 } else { 0.0 });
            let cells = figure.panels[these.clone()].iter().filter_map(|p| p.cells.as_ref());
            let cells = cells.map(|c| CELL * c.rows.len() as f64).fold(0.0, f64::max);
            let bottom = area_top + (PANEL.1 - space::PANEL_TITLE - space::BELOW).max(cells);
            for (column, (index, entries)) in these.zip(legends).enumerate() {
                let from = space::EDGE + column as f64 * panel + left;
                let (x, y) = axes[index].clone();
                panels.push(Placed {
                    x,
                    y,
                    area: Area { left: from, top: area_top, right: from + width, bottom },
                    title: top + 18.0,
                    y_label: labels + 19.0,
                    legend: legend_top + 11.0,
                    entries,
                });
            }
            top = bottom + space::BELOW;
        }
        let (width, height) = (2.0 * space::EDGE + columns as f64 * panel, top + space::EDGE);
        if width * height > LARGEST {
            bail!("a figure of {} panels is too large to draw; split it", figure.panels.len());
        }
        Ok(Layout { size: (width.ceil() as u32, height.ceil() as u32), panels })
    }

    fn units(&self) -> (u32, u32) {
        (self.size.0 * UNITS, self.size.1 * UNITS)
    }
}

/// Lowest and highest of what a panel shows.
fn heights(panel: &Panel) -> Option<(f64, f64)> {
    let points = panel.series.iter().flat_map(|s| &s.points).filter(|p| drawable(p)).map(|p| p.1);
    let bands = panel.series.iter().flat_map(|s| &s.band).flat_map(|b| [b.1, b.2]);
    extent(points.chain(bands).chain(panel.lines.iter().copied()))
}

/// The axes of a panel whose heights are these.
fn axes(panel: &Panel, heights: Option<(f64, f64)>) -> (Axis, Axis) {
    if let Some(cells) = &panel.cells {
        let axis = |names: &[String]| {
            let ticks = names.iter().enumerate().map(|(i, name)| (i as f64 + 0.5, name.clone()));
            Axis { lo: 0.0, hi: names.len().max(1) as f64, ticks: ticks.collect(), exponent: 0 }
        };
        return (axis(&cells.columns), axis(&cells.rows));
    }
    let points = || panel.series.iter().flat_map(|s| &s.points).copied().filter(drawable);
    let (lo, hi) = widen(extent(points().map(|p| p.0)));
    let x = Axis::over_data(lo, hi, 6.0, 0.02);
    let fixed = panel.y_range.filter(|&range| widen(Some(range)) == range && drawable(&range));
    let y = match fixed {
        Some((lo, hi)) => Axis::new(lo, hi, 5.5),
        None => {
            let (lo, hi) = widen(heights);
            let room = 0.05 * (hi - lo);
            Axis::over_data(lo - room, hi + room, 5.5, 0.05)
        }
    };
    (x, y)
}

/// The legend of a panel, in lines of that width: of what has a name, if that is more than one.
fn legend(panel: &Panel, width: f64) -> anyhow::Result<Vec<Entry>> {
    let curves = panel.series.iter().enumerate().map(|(i, s)| (&s.label, Swatch::Line(s.colour(i))));
    let shades = panel.shades.iter().map(|s| (&s.label, Swatch::Field(s.colour(SHADE))));
    let names: Vec<_> = curves.chain(shades).filter(|(label, _)| !label.is_empty()).collect();
    if names.len() < 2 {
        return Ok(Vec::new());
    }
    let (swatch, gap, next) = space::SWATCH;
    let (mut line, mut left, mut entries) = (0, 0.0, Vec::new());
    for (label, sign) in names {
        let (label, _) = fit(label, TICK, width - swatch - gap)?;
        let needed = swatch + gap + text_width(&label, TICK)?;
        if left > 0.0 && left + needed > width {
            (line, left) = (line + 1, 0.0);
        }
        entries.push(Entry { swatch: sign, label, line, left });
        left += needed + next;
    }
    Ok(entries)
}

/// The points in px that decide the picture: the first, the lowest, the highest and the last of
/// each run within one pixel column.
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

/// A curve's shape in px.
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

/// A plotters drawing.
struct Canvas<DB: DrawingBackend> {
    area: DrawingArea<DB, Shift>,
}

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// The middle of a pixel: lines there are sharp.
fn middle(px: f64) -> f64 {
    px.floor() + 0.5
}

impl<DB: DrawingBackend> Canvas<DB> {
    /// px to units.
    fn units(&self, px: f64) -> f64 {
        px * f64::from(UNITS)
    }

    /// px to the nearest unit.
    fn place(&self, (x, y): (f64, f64)) -> (i32, i32) {
        (self.units(x).round() as i32, self.units(y).round() as i32)
    }

    fn straight(&self, from: (f64, f64), to: (f64, f64), color: RGBColor, width: f64) -> Drawn<DB> {
        self.line(&[from, to], color, width)
    }

    fn line(&self, points: &[(f64, f64)], color: RGBColor, width: f64) -> Drawn<DB> {
        let mut path: Vec<(i32, i32)> = points.iter().map(|p| self.place(*p)).collect();
        path.dedup();
        let stroke_width = self.units(width).round() as u32;
        let style = ShapeStyle { color: color.into(), filled: true, stroke_width };
        self.area.draw(&PathElement::new(path, style))
    }

    /// An area in a colour of that strength, from 0 to 1.
    fn field(&self, corners: &[(f64, f64)], color: RGBColor, strength: f64) -> Drawn<DB> {
        let corners: Vec<(i32, i32)> = corners.iter().map(|p| self.place(*p)).collect();
        self.area.draw(&Polygon::new(corners, color.mix(strength)))
    }

    fn dot(&self, at: (f64, f64), color: RGBColor) -> Drawn<DB> {
        let radius = self.units(2.5).round() as i32;
        self.area.draw(&Circle::new(self.place(at), radius, color.filled()))
    }

    /// A text by its anchor on the baseline; `upwards` = turned a quarter to the left.
    fn text(
        &self,
        text: &str,
        at: (f64, f64),
        anchor: HPos,
        (size, color): (f64, RGBColor),
        upwards: bool,
    ) -> anyhow::Result<()>
    where
        DB::ErrorType: 'static,
    {
        if text.is_empty() {
            return Ok(());
        }
        // Control characters are not part of XML.
        let text = &text.replace(char::is_control, " ");
        let em = self.units(size);
        // For plotters, a font's size is 1.24 em, and the top of a text 0.76 em above its
        // baseline.
        let mut font = FontDesc::new(FontFamily::Name(FAMILY), 1.24 * em, FontStyle::Normal);
        let ascent = 0.76 * size;
        let (mut x, mut y) = at;
        if upwards {
            font = font.transform(FontTransform::Rotate270);
            x -= ascent;
        } else {
            y -= ascent;
        }
        let style = TextStyle::from(font).color(&color).pos(Pos::new(anchor, VPos::Top));
        Ok(self.area.draw_text(text, &style, self.place((x, y)))?)
    }

    fn figure(&self, figure: &Figure, layout: &Layout) -> anyhow::Result<()>
    where
        DB::ErrorType: 'static,
    {
        let (width, height) = layout.units();
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

    fn cells(&self, cells: &Cells, area: Area) -> anyhow::Result<()>
    where
        DB::ErrorType: 'static,
    {
        let (columns, rows) = (cells.columns.len().max(1), cells.rows.len().max(1));
        let (width, height) =
            ((area.right - area.left) / columns as f64, (area.bottom - area.top) / rows as f64);
        for (i, cell) in cells.cells.iter().enumerate() {
            let left = area.left + (i % columns) as f64 * width;
            let bottom = area.bottom - (i / columns) as f64 * height;
            let shade = cell.shade.clamp(0.0, 1.0);
            let mix = |of: fn(&RGBColor) -> u8| {
                let [light, dark] = SHADES.map(|colour| f64::from(of(&colour)));
                (light + (dark - light) * shade).round() as u8
            };
            let color = RGBColor(mix(|c| c.0), mix(|c| c.1), mix(|c| c.2));
            let corners = [self.place((left, bottom - height)), self.place((left + width, bottom))];
            self.area.draw(&Rectangle::new(corners, color.filled()))?;
            let (text, size) = fit(&cell.text, TICK.min(0.75 * height), width - 2.0)?;
            let at = (left + 0.5 * width, bottom - 0.5 * height + 0.365 * size);
            self.text(&text, at, HPos::Center, (size, if shade > 0.5 { WHITE } else { INK }), false)?;
        }
        Ok(())
    }

    /// The shaded stretches of a panel.
    fn shades(&self, panel: &Panel, placed: &Placed) -> Drawn<DB> {
        let Area { left, top, right, bottom } = placed.area;
        let alone = panel.shades.len() == 1;
        let (next, height, strength) =
            if alone { (0.0, bottom - top, SHADE) } else { (STRIP_HEIGHT, STRIP_FILLED, STRIP) };
        for (i, shade) in panel.shades.iter().enumerate() {
            let above = top + next * i as f64;
            for (from, to) in &shade.stretches {
                let [from, to] =
                    [from, to].map(|x| left + (right - left) * placed.x.share(*x).clamp(0.0, 1.0));
                if from < to {
                    let (low, high) = (above + height, above);
                    self.field(
                        &[(from, low), (from, high), (to, high), (to, low)],
                        shade.colour(strength),
                        1.0,
                    )?;
                }
            }
        }
        Ok(())
    }

    /// The band behind a curve.
    fn band(&self, series: &Series, number: usize, placed: &Placed) -> Drawn<DB> {
        let Area { left, top, right, bottom } = placed.area;
        let place = |x: f64, y: f64| {
            let (x, y) = (placed.x.share(x).clamp(0.0, 1.0), placed.y.share(y).clamp(0.0, 1.0));
            (left + (right - left) * x, bottom - (bottom - top) * y)
        };
        let drawn = |(x, low, high): &&(f64, f64, f64)| drawable(&(*x, *low)) && drawable(&(*x, *high));
        let there = || series.band.iter().filter(drawn);
        if there().count() < 2 {
            return Ok(());
        }
        let upper = there().map(|(x, _, high)| place(*x, *high));
        let lower = there().rev().map(|(x, low, _)| place(*x, *low));
        self.field(&upper.chain(lower).collect::<Vec<_>>(), series.colour(number), BAND)
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

        if let Some(cells) = &panel.cells {
            self.cells(cells, area)?;
        }
        let empty = panel.cells.is_none() && !panel.series.iter().any(|s| s.points.iter().any(drawable));
        let grid = !empty && panel.cells.is_none();
        self.shades(panel, placed)?;
        for (x, _) in placed.x.ticks.iter().filter(|_| grid) {
            self.straight((column(*x), high), (column(*x), low), GRID, 1.0)?;
        }
        for (y, _) in placed.y.ticks.iter().filter(|_| grid) {
            let zero = y.abs() < 1e-9 * (placed.y.hi - placed.y.lo);
            self.straight((near, row(*y)), (far, row(*y)), if zero { ZERO } else { GRID }, 1.0)?;
        }

        for (number, series) in panel.series.iter().enumerate() {
            self.band(series, number, placed)?;
        }
        // A guide, which the others are held against, lies behind them.
        let curves = || panel.series.iter().enumerate();
        for (number, series) in curves().filter(|c| c.1.guide).chain(curves().filter(|c| !c.1.guide)) {
            let (step, color) = (panel.step && !series.guide, series.colour(number));
            let trail = Trail::new(&series.points, step, placed);
            for line in &trail.lines {
                self.line(line, color, 1.25)?;
            }
            for dot in &trail.dots {
                self.dot(*dot, color)?;
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
        for Entry { swatch: sign, label, line, left: from } in &placed.entries {
            let (from, baseline) = (left + from, placed.legend + space::LINE * *line as f64);
            let (to, y) = (from + swatch, middle(baseline - 0.3 * TICK));
            match *sign {
                Swatch::Line(color) => self.straight((from, y), (to, y), color, 2.0)?,
                Swatch::Field(color) => {
                    let (above, below) = (y - 6.0, y + 6.0);
                    self.field(&[(from, above), (to, above), (to, below), (from, below)], color, 1.0)?;
                }
            }
            self.text(label, (from + swatch + gap, baseline), HPos::Left, (TICK, INK), false)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
        Series::new(label, points.into_iter().collect())
    }

    fn panel(series: Vec<Series>) -> Panel {
        Panel {
            title: "PD, 2 °/s".to_owned(),
            x_label: "time / s".to_owned(),
            y_label: "error / °".to_owned(),
            series,
            ..Panel::default()
        }
    }

    fn figure(panels: Vec<Panel>) -> Figure {
        Figure { title: "Figure 8 <&> \"e\" & θ̇".to_owned(), columns: 2, panels, ..Figure::default() }
    }

    fn wave(n: u32) -> impl Iterator<Item = (f64, f64)> {
        (0..n).map(move |i| (f64::from(i) * 1e-3, (f64::from(i) * 0.7).sin() + (f64::from(i) * 0.013).cos()))
    }

    /// Texts of an SVG document.
    fn texts(svg: &str) -> Vec<String> {
        let document = roxmltree::Document::parse(svg).expect("well-formed");
        document.descendants().filter_map(|n| n.text().map(str::trim)).map(str::to_owned).collect()
    }

    fn labels(lo: f64, hi: f64) -> Vec<String> {
        Axis::new(lo, hi, 5.0).ticks.into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn an_svg_is_well_formed_and_shows_its_labels() {
        let two = vec![series("PD <1>", wave(500)), series("SMC & more", wave(200))];
        let svg = figure(vec![panel(two), panel(vec![series("alone", wave(50))])]).svg().unwrap();
        let texts = texts(&svg);
        for label in
            ["Figure 8 <&> \"e\" & θ̇", "PD, 2 °/s", "time / s", "error / °", "PD <1>", "SMC & more", "0.2"]
        {
            assert!(texts.iter().any(|t| t == label), "{label} is missing in {texts:?}");
        }
        assert!(!texts.iter().any(|t| t == "alone"), "a single curve needs no legend");
        assert!(!svg.contains(" id="));
        assert!(
            svg.starts_with("<svg width=\"1228\" height=\"440\" viewBox=\"0 0 4912 1760\" xmlns="),
            "{svg:.120}"
        );
    }

    #[test]
    fn the_same_data_give_the_same_bytes() {
        let figure = figure(vec![panel(vec![series("e", wave(3000)), series("f", wave(20))])]);
        assert_eq!(figure.svg().unwrap(), figure.svg().unwrap());
        assert_eq!(figure.png().unwrap(), figure.png().unwrap());
    }

    #[test]
    fn a_png_has_twice_the_size_and_the_colours() {
        let png = figure(vec![panel(vec![series("e", wave(3000))])]).png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (2 * 628, 2 * 418));
        assert_eq!(pixels[..3], [255; 3]);
        let blue = pixels.chunks(3).filter(|p| *p == [0x00, 0x72, 0xb2]).count();
        assert!(blue > 10_000, "{blue}");
    }

    #[test]
    fn cells_have_their_shade_their_text_and_room_for_it() {
        let names = |n: u32| (0..n).map(|i| i.to_string()).collect::<Vec<_>>();
        let cells = |columns: u32, rows: u32| Cells {
            columns: names(columns),
            rows: names(rows),
            cells: (0..columns * rows)
                .map(|i| Cell { shade: f64::from(i % 2), text: format!("c{i}") })
                .collect(),
        };
        let map = |c| figure(vec![Panel { cells: Some(c), ..panel(vec![]) }]);
        let svg = map(cells(14, 24)).svg().unwrap();
        let seen = texts(&svg);
        assert!(["c0", "c335", "23"].iter().all(|t| seen.iter().any(|s| s == t)), "{seen:?}");
        assert!(!seen.iter().any(|t| t == "no data"));
        // The rows are as high as a text.
        let layout = Layout::new(&map(cells(14, 24))).unwrap();
        assert!(layout.panels[0].area.bottom - layout.panels[0].area.top >= 24.0 * CELL);
        let png = map(cells(2, 1)).png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        for shade in SHADES {
            let n = pixels.chunks(3).filter(|p| *p == [shade.0, shade.1, shade.2]).count();
            assert!(n > 100_000, "{n}");
        }
        map(Cells::default()).svg().unwrap();
    }

    #[test]
    fn strange_data_make_a_picture() {
        let (nan, inf) = (f64::NAN, f64::INFINITY);
        let odd: Vec<Vec<(f64, f64)>> = vec![
            vec![],
            vec![(1.0, 2.0)],
            vec![(0.0, 0.0)],
            vec![(0.0, 0.3); 4],
            vec![(0.0, 0.3), (1.0, 0.3), (2.0, 0.3)],
            vec![(nan, 1.0), (1.0, nan), (nan, nan)],
            vec![(0.0, 1.0), (1.0, nan), (2.0, 2.0), (3.0, inf), (4.0, -inf), (5.0, 1.0), (6.0, 2.0)],
            vec![(inf, 0.0), (-inf, 1.0)],
            vec![(0.0, f64::MAX), (1.0, f64::MIN), (2.0, 1e149), (3.0, -1e149)],
            vec![(0.0, 5e-324), (1e-320, 0.0)],
            vec![(1.7e9, 1.0), (1.7e9 + 1e-3, 1.0 + 1e-15)],
            vec![(3.0, 1.0), (1.0, 5.0), (2.0, -1.0)],
        ];
        for points in odd {
            for step in [false, true] {
                for y_range in [None, Some((0.5, 1.5)), Some((1.0, 1.0)), Some((nan, 2.0)), Some((inf, -inf))]
                {
                    let lines = vec![1.0, nan, inf, 7.0];
                    let panel = Panel { step, y_range, lines, ..panel(vec![series("odd", points.clone())]) };
                    let svg = figure(vec![panel]).svg().unwrap();
                    let none = !points.iter().any(drawable);
                    assert_eq!(texts(&svg).iter().any(|t| t == "no data"), none, "{points:?}");
                    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
                }
            }
            figure(vec![panel(vec![series("odd", points)])]).png().unwrap();
        }
        for columns in [0, 1, 9] {
            let empty = Figure { columns, ..figure(vec![]) };
            assert!(texts(&empty.svg().unwrap()).iter().any(|t| t.starts_with("Figure 8")));
            empty.png().unwrap();
        }
        let control = Panel { title: "a\u{0}b\nc".to_owned(), ..panel(vec![]) };
        assert!(texts(&figure(vec![control]).svg().unwrap()).iter().any(|t| t == "a b c"));
    }

    #[test]
    fn a_gap_parts_a_curve_and_a_lone_point_is_a_dot() {
        let points =
            [(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 0.5), (4.0, f64::NAN), (5.0, 1.0), (6.0, 0.0)];
        let panel = panel(vec![series("e", points)]);
        let layout = Layout::new(&figure(vec![panel.clone()])).unwrap();
        let trail = Trail::new(&panel.series[0].points, false, &layout.panels[0]);
        assert_eq!(trail.lines.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        assert_eq!(trail.dots.len(), 1);
    }

    #[test]
    fn decimation_keeps_the_extremes_of_every_column() {
        let mut points: Vec<(f64, f64)> = wave(100_000).map(|(x, y)| (5.0 * x, y)).collect();
        points[54_321].1 = 40.0;
        points[7].1 = -40.0;
        let kept = decimate(&points);
        assert!(kept.len() <= 4 * 501, "{}", kept.len());
        for column in 0..500 {
            let of =
                |p: &[(f64, f64)]| extent(p.iter().filter(|p| p.0.floor() == f64::from(column)).map(|p| p.1));
            assert_eq!(of(&kept), of(&points), "column {column}");
        }
        assert!(kept.windows(2).all(|w| w[0].0 < w[1].0), "the order is lost");
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
        let few = [(0.2, 1.0), (0.9, 2.0), (5.0, 3.0), (0.1, 4.0)];
        assert_eq!(decimate(&few), few);
    }

    #[test]
    fn long_curves_make_small_files() {
        let six =
            (0..6).map(|_| panel(vec![series("e", wave(100_000)), series("f", wave(60_000))])).collect();
        let svg = Figure { columns: 3, ..figure(six) }.svg().unwrap();
        assert!(svg.len() < 300_000, "{} bytes", svg.len());
    }

    #[test]
    fn stairs_hold_a_value_until_the_next() {
        let panel = Panel { step: true, ..panel(vec![series("u", [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)])]) };
        let layout = Layout::new(&figure(vec![panel.clone()])).unwrap();
        let trail = Trail::new(&panel.series[0].points, true, &layout.panels[0]);
        let [line] = trail.lines.as_slice() else { panic!("{trail:?}") };
        assert_eq!(line.len(), 5);
        assert!(line.windows(2).all(|w| w[0].0 == w[1].0 || w[0].1 == w[1].1));
    }

    #[test]
    fn a_band_a_guide_and_shades_are_drawn_in_their_colours_and_named_once() {
        let time: Vec<f64> = (0..1000).map(f64::from).collect();
        let values: Vec<f64> = time.iter().map(|t| (0.9 * t).sin()).collect();
        let whole = Series::envelope("mean", &Envelope::new(&time, &values, 50), 2.0);
        let guide = |label: &str| Series { guide: true, ..series(label, [(0.0, 0.0), (999.0, 1.0)]) };
        let rest = Shade {
            label: "at rest".to_owned(),
            stretches: vec![(-50.0, 100.0), (300.0, 400.0)],
            of: Some(0),
        };
        let panel = Panel { shades: vec![rest], ..panel(vec![whole, guide("path"), guide("")]) };
        let svg = figure(vec![panel.clone()]).svg().unwrap();
        let seen = texts(&svg);
        assert_eq!(seen.iter().filter(|t| *t == "path").count(), 2, "its element and its text: {seen:?}");
        let document = roxmltree::Document::parse(&svg).unwrap();
        let fields: Vec<_> = document.descendants().filter(|n| n.has_tag_name("polygon")).collect();
        let of = |n: &roxmltree::Node<'_, '_>| {
            (n.attribute("fill").unwrap().to_owned(), n.attribute("opacity").is_some())
        };
        // Two stretches and their swatch, pale; the band, through which the grid is seen.
        let (pale, band): (Vec<_>, Vec<_>) = fields.iter().map(of).partition(|(_, through)| !through);
        assert_eq!((pale.len(), band), (3, vec![("#0072B2".to_owned(), true)]));
        let layout = Layout::new(&figure(vec![panel])).unwrap();
        let Area { left, right, top, bottom } = layout.panels[0].area;
        for field in &fields {
            for corner in field.attribute("points").unwrap().split_whitespace() {
                let (x, y) = corner.split_once(',').unwrap();
                let [x, y] = [x, y].map(|v| v.parse::<f64>().unwrap() / f64::from(UNITS));
                assert!(x >= left - 0.2 && x <= right + 0.2 && y <= bottom + 0.2, "{corner}");
                assert!(y >= top - 40.0, "a swatch is above the axes, not more");
            }
        }
        // Twice the sine, at most 2: no peak is lost.
        let (low, high) = heights(&Panel {
            series: vec![Series::envelope("", &Envelope::new(&time, &values, 50), 2.0)],
            ..Panel::default()
        })
        .unwrap();
        assert!(low < -1.99 && high > 1.99);
    }

    #[test]
    fn the_panels_of_a_row_share_a_scale_and_keep_it_alone() {
        let of = |scale: f64| panel(vec![series("e", wave(500).map(|(x, y)| (x, scale * y)))]);
        let both = Figure { share_y: true, ..figure(vec![of(1.0), of(5.0), of(0.1)]) };
        let y = |figure: &Figure| figure.axes().into_iter().map(|(_, y)| (y.lo, y.hi)).collect::<Vec<_>>();
        let together = y(&both);
        assert_eq!(together[0], together[1]);
        assert!(together[2].1 < together[0].1, "another row has its own");
        let alone: Vec<_> = both.split().iter().map(|one| y(one)[0]).collect();
        assert_eq!(alone, together);
        assert!(y(&Figure { share_y: false, ..both })[0].1 < together[0].1);
    }

    #[test]
    fn nothing_is_drawn_outside_the_axes() {
        let panel = Panel { y_range: Some((-0.5, 0.5)), ..panel(vec![series("e", wave(4000))]) };
        let layout = Layout::new(&figure(vec![panel.clone()])).unwrap();
        let Area { left, top, right, bottom } = layout.panels[0].area;
        let trail = Trail::new(&panel.series[0].points, false, &layout.panels[0]);
        assert!(trail.lines.len() > 10);
        for (x, y) in trail.lines.iter().flatten() {
            assert!(*x >= left - 1e-9 && *x <= right + 1e-9 && *y >= top - 1e-9 && *y <= bottom + 1e-9);
        }
    }

    #[test]
    fn tick_labels_are_round() {
        assert_eq!(labels(0.0, 0.5), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(labels(-0.05, 0.12), ["−0.05", "0.00", "0.05", "0.10"]);
        assert_eq!(labels(0.0, 5.0), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(labels(0.0, 20_000.0), ["0", "5000", "10000", "15000", "20000"]);
        let small = Axis::new(0.0, 5e-6, 5.0);
        assert_eq!(
            small.ticks.iter().map(|t| t.1.as_str()).collect::<Vec<_>>(),
            ["0", "1", "2", "3", "4", "5"]
        );
        assert_eq!(small.factor().unwrap(), "×10⁻⁶");
        let large = Axis::new(-4e12, 4e12, 4.0);
        assert_eq!(large.ticks.iter().map(|t| t.1.as_str()).collect::<Vec<_>>(), ["−4", "−2", "0", "2", "4"]);
        assert_eq!(large.factor().unwrap(), "×10¹²");
        // Runs end one sample before the round time; the axis does not.
        assert_eq!(Axis::over_data(0.0, 4.999, 6.0, 0.02).hi, 5.0);
        assert_eq!(Axis::over_data(0.0, 4.7, 6.0, 0.02).hi, 4.7);
    }

    #[test]
    fn a_long_text_is_made_to_fit() {
        let (kept, size) = fit("short", 16.0, 500.0).unwrap();
        assert_eq!((kept.as_str(), size), ("short", 16.0));
        let (cut, size) = fit(&"a very long title ".repeat(9), 16.0, 500.0).unwrap();
        assert!(cut.ends_with('…') && text_width(&cut, size).unwrap() <= 500.0, "{cut}");
        assert_eq!(fit("W", 16.0, 1.0).unwrap().0, "…");
    }

    #[test]
    fn a_figure_is_saved_by_its_ending() {
        let dir = std::env::temp_dir().join(format!("clutch-plot-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let figure = figure(vec![panel(vec![series("e", wave(100))])]);
        figure.save(&dir.join("a.svg")).unwrap();
        figure.save(&dir.join("a.PNG")).unwrap();
        assert_eq!(std::fs::read_to_string(dir.join("a.svg")).unwrap(), figure.svg().unwrap());
        assert_eq!(std::fs::read(dir.join("a.PNG")).unwrap(), figure.png().unwrap());
        for wrong in ["figure8.pdf", "figure8", ".svg"] {
            let error = figure.save(&dir.join(wrong)).unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains(".svg or .png"), "{error}");
        }
        let error = figure.save(&dir.join("missing").join("a.svg")).unwrap_err().to_string();
        assert!(error.contains("missing"), "{error}");
        std::fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn a_figure_that_is_too_large_is_refused() {
        let error = figure(vec![Panel::default(); 200]).svg().unwrap_err().to_string();
        assert!(error.contains("200 panels"), "{error}");
    }
}
