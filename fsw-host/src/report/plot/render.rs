//! The only place that draws: panels onto an SVG canvas of the plotting library.

use maud::html;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::palette::{Ink, Theme};
use super::clip::{Frame, runs, simplify};
use super::scale::values;
use super::{Anchor, Layer, Panel, Point, finite};

/// The library places everything on whole units: this many of them per pixel keep curves smooth.
const UNITS: u32 = 4;
/// Margins of a panel, pixels.
const LEFT: u32 = 66;
const RIGHT: u32 = 14;
const TOP: u32 = 10;
const TOP_NAMED: u32 = 26;
const BOTTOM: u32 = 44;
const BOTTOM_SILENT: u32 = 8;
/// Text size, pixels.
const LABEL_PX: f64 = 14.0;
/// Curves may deviate from the data by this much, pixels.
const TOLERANCE_PX: f64 = 0.12;

/// A plot could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("a plot could not be drawn: {0}")]
pub struct PlotError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PlotError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self(error.to_string())
    }
}

type Coordinates = Cartesian2d<Scale, Scale>;

/// A linear axis of the library with ticks of our choice.
struct Scale {
    range: (f64, f64),
    ticks: Vec<f64>,
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (value - self.range.0) / (self.range.1 - self.range.0);
        from + (share * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.range.0..self.range.1
    }
}

/// An SVG picture in the making; sizes in pixels.
pub struct Canvas {
    size: (u32, u32),
    theme: Theme,
    body: String,
}

impl Canvas {
    /// An empty picture.
    #[must_use]
    pub const fn new(width: u32, height: u32, theme: Theme) -> Self {
        Self { size: (width, height), theme, body: String::new() }
    }

    /// Draws a panel with its upper left corner at `corner`.
    ///
    /// # Errors
    /// When the plotting library fails.
    pub fn draw(&mut self, panel: &Panel, corner: (u32, u32), width: u32) -> Result<(), PlotError> {
        let mut svg = String::new();
        {
            let size = (self.size.0 * UNITS, self.size.1 * UNITS);
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            let origin = (corner.0 * UNITS, corner.1 * UNITS);
            draw_panel(panel, root.clone().shrink(origin, (width * UNITS, panel.height * UNITS)), width, self.theme)?;
            root.present()?;
        }
        let start = svg.find('>').map_or(0, |i| i + 1);
        let end = svg.rfind("</svg>").unwrap_or(svg.len());
        self.text((corner.0 + LEFT, corner.1 + TOP_NAMED - 8), 13, Ink::Muted, &panel.name);
        self.body.extend(svg.get(start..end).unwrap_or_default().lines());
        Ok(())
    }

    /// Fills the ground, for pictures that stand alone.
    pub fn backdrop(&mut self) {
        let (w, h) = (self.size.0 * UNITS, self.size.1 * UNITS);
        let rectangle = html! { rect width=(w) height=(h) rx=(14 * UNITS) fill="#11161D" {} };
        self.body.push_str(&rectangle.into_string());
    }

    /// Writes a line of text whose baseline starts at `at`, pixels.
    pub fn text(&mut self, at: (u32, u32), size: u32, ink: Ink, content: &str) {
        if content.is_empty() {
            return;
        }
        let line = html! {
            text x=(at.0 * UNITS) y=(at.1 * UNITS) font-size=(size * UNITS) font-family="sans-serif" fill=(ink.hex(self.theme)) {
                (content)
            }
        };
        self.body.push_str(&line.into_string());
    }

    /// The picture as an element of an HTML page.
    #[must_use]
    pub fn into_inline(self, title: &str) -> String {
        let (w, h) = (self.size.0 * UNITS, self.size.1 * UNITS);
        format!("<svg class=\"plot\" viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{title}\">{}</svg>", self.body)
    }

    /// The picture as a file of its own.
    #[must_use]
    pub fn into_file(self) -> String {
        let (w, h) = self.size;
        let (vw, vh) = (w * UNITS, h * UNITS);
        format!(
            "<svg stroke-linecap=\"round\" stroke-linejoin=\"round\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {vw} {vh}\">{}</svg>\n",
            self.body
        )
    }
}

/// Draws one panel into its area of the canvas.
fn draw_panel(
    panel: &Panel,
    area: DrawingArea<SVGBackend<'_>, Shift>,
    width: u32,
    theme: Theme,
) -> Result<(), PlotError> {
    let bottom = if panel.x.silent { BOTTOM_SILENT } else { BOTTOM };
    let top = if panel.name.is_empty() { TOP } else { TOP_NAMED };
    let inner = (f64::from(width - LEFT - RIGHT), f64::from(panel.height.saturating_sub(top + bottom).max(1)));
    let frame = fit(panel, inner);
    let (x_ticks, y_ticks) =
        (panel.x.ticks(frame.x, (inner.0 / 72.0) as usize), panel.y.ticks(frame.y, (inner.1 / 38.0).max(2.0) as usize));
    let mut chart = ChartBuilder::on(&area)
        .margin_top(top * UNITS)
        .margin_right(RIGHT * UNITS)
        .set_label_area_size(LabelAreaPosition::Left, LEFT * UNITS)
        .set_label_area_size(LabelAreaPosition::Bottom, bottom * UNITS)
        .build_cartesian_2d(
            Scale { range: frame.x, ticks: x_ticks.clone() },
            Scale { range: frame.y, ticks: y_ticks.clone() },
        )?;
    let x_desc = if panel.x.silent { "" } else { panel.x.label.as_str() };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(Ink::Grid.color(theme).stroke_width(UNITS))
        .axis_style(Ink::Axis.color(theme).stroke_width(UNITS))
        .set_all_tick_mark_size(4 * UNITS)
        .label_style(text(Ink::Muted, LABEL_PX, theme))
        .axis_desc_style(text(Ink::Text, LABEL_PX, theme))
        .x_label_formatter(&|v| panel.x.label_of(*v, &x_ticks))
        .y_label_formatter(&|v| panel.y.label_of(*v, &y_ticks))
        .x_desc(x_desc)
        .y_desc(panel.y.label.as_str())
        .draw()?;
    let pixel = ((frame.x.1 - frame.x.0) / inner.0, (frame.y.1 - frame.y.0) / inner.1);
    let brush = Brush { area: chart.plotting_area(), frame, pixel, theme };
    panel.layers.iter().try_for_each(|layer| brush.layer(layer))
}

/// Ranges of both axes for a plotting area of `inner` pixels.
fn fit(panel: &Panel, inner: (f64, f64)) -> Frame {
    let mut frame = Frame { x: panel.x.range(values(panel, &|p| p.0)), y: panel.y.range(values(panel, &|p| p.1)) };
    if panel.equal {
        let per_pixel = ((frame.x.1 - frame.x.0) / inner.0).max((frame.y.1 - frame.y.0) / inner.1);
        let widen = |(from, to): (f64, f64), pixels: f64| {
            let (middle, half) = (0.5 * (from + to), 0.5 * per_pixel * pixels);
            (middle - half, middle + half)
        };
        frame = Frame { x: widen(frame.x, inner.0), y: widen(frame.y, inner.1) };
    }
    frame
}

/// Text style: the library divides sizes by 1.24 on the way out.
fn text<'a>(ink: Ink, pixels: f64, theme: Theme) -> TextStyle<'a> {
    ("sans-serif", pixels * f64::from(UNITS) * 1.24).into_font().color(&ink.color(theme))
}

/// Draws layers into the plotting area of one panel.
struct Brush<'a, 'b> {
    area: &'a DrawingArea<SVGBackend<'b>, Coordinates>,
    frame: Frame,
    /// Axis units per pixel.
    pixel: (f64, f64),
    theme: Theme,
}

impl Brush<'_, '_> {
    fn layer(&self, layer: &Layer) -> Result<(), PlotError> {
        let Frame { x, y } = self.frame;
        match layer {
            Layer::Line { points, ink, width, opacity } => self.line(points, *ink, *width, *opacity),
            Layer::Band { edges, ink, opacity } => self.band(edges, *ink, *opacity),
            Layer::Dots { points, ink, radius, hollow } => self.dots(points, *ink, *radius, *hollow),
            Layer::Area { corners, ink, opacity } => self.polygon(corners, *ink, *opacity),
            Layer::Level { y: level, ink, label } => {
                self.line(&[(x.0, *level), (x.1, *level)], *ink, 1.3, 0.9)?;
                let seen = *level >= y.0 && *level <= y.1;
                let at = (x.1 - 6.0 * self.pixel.0, *level + 3.0 * self.pixel.1);
                if seen { self.note(at, label, *ink, Anchor::End) } else { Ok(()) }
            }
            Layer::Instant { x: at, ink } => self.line(&[(*at, y.0), (*at, y.1)], *ink, 1.0, 0.55),
            Layer::Span { from, to, ink } => {
                let (from, to) = (from.clamp(x.0, x.1), to.clamp(x.0, x.1));
                if to > from {
                    self.polygon(&[(from, y.0), (to, y.0), (to, y.1), (from, y.1)], *ink, 0.07)
                } else {
                    Ok(())
                }
            }
            Layer::Note { at, text, ink, anchor } => {
                if self.frame.contains(*at) {
                    self.note(*at, text, *ink, *anchor)
                } else {
                    Ok(())
                }
            }
        }
    }

    fn line(&self, points: &[Point], ink: Ink, width: f64, opacity: f64) -> Result<(), PlotError> {
        let style = ShapeStyle::from(ink.color(self.theme).mix(opacity)).stroke_width(units(width));
        for run in runs(points, &self.frame) {
            self.area.draw(&PathElement::new(self.thin(&run), style))?;
        }
        Ok(())
    }

    fn band(&self, edges: &[(f64, f64, f64)], ink: Ink, opacity: f64) -> Result<(), PlotError> {
        let inside = |(x, low, high): &&(f64, f64, f64)| {
            (low + high).is_finite() && (self.frame.x.0..=self.frame.x.1).contains(x)
        };
        let clamp = |v: f64| v.clamp(self.frame.y.0, self.frame.y.1);
        let kept: Vec<_> = edges.iter().filter(inside).collect();
        let high = self.thin(&kept.iter().map(|(x, _, high)| (*x, clamp(*high))).collect::<Vec<_>>());
        let low = self.thin(&kept.iter().map(|(x, low, _)| (*x, clamp(*low))).collect::<Vec<_>>());
        let outline: Vec<Point> = high.into_iter().chain(low.into_iter().rev()).collect();
        self.polygon(&outline, ink, opacity)
    }

    fn polygon(&self, corners: &[Point], ink: Ink, opacity: f64) -> Result<(), PlotError> {
        let Frame { x, y } = self.frame;
        let inside: Vec<Point> =
            corners.iter().filter(|p| finite(p)).map(|p| (p.0.clamp(x.0, x.1), p.1.clamp(y.0, y.1))).collect();
        if inside.len() < 3 {
            return Ok(());
        }
        Ok(self.area.draw(&Polygon::new(inside, ShapeStyle::from(ink.color(self.theme).mix(opacity)).filled()))?)
    }

    fn dots(&self, points: &[Point], ink: Ink, radius: f64, hollow: bool) -> Result<(), PlotError> {
        let style =
            ShapeStyle::from(ink.color(self.theme).mix(if hollow { 1.0 } else { 0.75 })).stroke_width(units(1.3));
        for point in points.iter().filter(|p| finite(p) && self.frame.contains(**p)) {
            if hollow {
                self.area.draw(&Circle::new(*point, units(radius), style))?;
                self.area.draw(&Cross::new(*point, units(0.6 * radius), style))?;
            } else {
                self.area.draw(&Circle::new(*point, units(radius), style.filled()))?;
            }
        }
        Ok(())
    }

    fn note(&self, at: Point, label: &str, ink: Ink, anchor: Anchor) -> Result<(), PlotError> {
        let h_pos = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let style = text(ink, LABEL_PX - 1.0, self.theme).pos(Pos::new(h_pos, VPos::Bottom));
        Ok(self.area.draw(&Text::new(label.to_owned(), at, style))?)
    }

    /// Drops the points that no eye could tell, measured in pixels.
    fn thin(&self, run: &[Point]) -> Vec<Point> {
        let pixels: Vec<Point> = run.iter().map(|p| (p.0 / self.pixel.0, p.1 / self.pixel.1)).collect();
        simplify(&pixels, TOLERANCE_PX).into_iter().map(|p| (p.0 * self.pixel.0, p.1 * self.pixel.1)).collect()
    }
}

/// Pixels to the whole units of the library, at least one.
fn units(pixels: f64) -> u32 {
    (pixels * f64::from(UNITS)).round().max(1.0) as u32
}
