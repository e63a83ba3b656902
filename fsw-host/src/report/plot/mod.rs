//! The plotting toolkit: a [`Panel`] is a description of axes and layers, a [`Figure`] a stack of panels with title,
//! caption and legend. One renderer turns them into SVG; no figure draws anything itself.

mod clip;
mod figure;
mod render;
mod scale;

pub use figure::{Figure, Mark};
pub use render::{Canvas, PlotError};
pub use scale::{Axis, number};

use super::palette::Ink;

/// A point in the units of the axes. Points that are not finite interrupt a line.
pub type Point = (f64, f64);

/// Where a note stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins right of the point.
    Start,
    /// The text is centred over the point.
    Middle,
    /// The text ends left of the point.
    End,
}

/// One thing drawn in a panel.
#[derive(Clone, Debug)]
pub enum Layer {
    /// A curve.
    Line { points: Vec<Point>, ink: Ink, width: f64, opacity: f64 },
    /// The area between two curves over the same x, given as (x, low, high).
    Band { edges: Vec<(f64, f64, f64)>, ink: Ink, opacity: f64 },
    /// Separate points; hollow ones are circles with a cross through them: rejected, special.
    Dots { points: Vec<Point>, ink: Ink, radius: f64, hollow: bool },
    /// A closed region.
    Area { corners: Vec<Point>, ink: Ink, opacity: f64 },
    /// A horizontal line over the whole width, with a label at its right end.
    Level { y: f64, ink: Ink, label: String },
    /// A vertical line over the whole height.
    Instant { x: f64, ink: Ink },
    /// A shaded interval of x over the whole height.
    Span { from: f64, to: f64, ink: Ink },
    /// A text at a point.
    Note { at: Point, text: String, ink: Ink, anchor: Anchor },
}

/// One pair of axes and what is drawn between them.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What stands above the plot; may be empty.
    pub name: String,
    /// Height on the page, in the nominal pixels of the figure.
    pub height: u32,
    /// One unit is as long on both axes.
    pub equal: bool,
    /// From back to front.
    pub layers: Vec<Layer>,
}

impl Panel {
    /// An empty panel.
    #[must_use]
    pub const fn new(x: Axis, y: Axis, height: u32) -> Self {
        Self { x, y, name: String::new(), height, equal: false, layers: Vec::new() }
    }

    /// Makes one unit as long on both axes.
    #[must_use]
    pub const fn equal_scale(mut self) -> Self {
        self.equal = true;
        self
    }

    /// Names the panel, above its plot.
    #[must_use]
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Adds a layer.
    #[must_use]
    pub fn with(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// Adds a curve.
    #[must_use]
    pub fn line(self, points: Vec<Point>, ink: Ink) -> Self {
        self.with(Layer::Line { points, ink, width: 1.6, opacity: 1.0 })
    }

    /// Adds a thin curve.
    #[must_use]
    pub fn thin(self, points: Vec<Point>, ink: Ink) -> Self {
        self.with(Layer::Line { points, ink, width: 0.8, opacity: 0.9 })
    }

    /// Adds a light area between two curves.
    #[must_use]
    pub fn band(self, edges: Vec<(f64, f64, f64)>, ink: Ink) -> Self {
        self.with(Layer::Band { edges, ink, opacity: 0.18 })
    }

    /// Adds small filled points.
    #[must_use]
    pub fn dots(self, points: Vec<Point>, ink: Ink, radius: f64) -> Self {
        self.with(Layer::Dots { points, ink, radius, hollow: false })
    }

    /// Adds points that stand out: circles with a cross.
    #[must_use]
    pub fn crosses(self, points: Vec<Point>, ink: Ink) -> Self {
        self.with(Layer::Dots { points, ink, radius: 4.0, hollow: true })
    }

    /// Adds a labelled horizontal line, if its value is finite.
    #[must_use]
    pub fn level(self, y: f64, ink: Ink, label: impl Into<String>) -> Self {
        self.with(Layer::Level { y, ink, label: label.into() })
    }

    /// Adds vertical lines.
    #[must_use]
    pub fn instants(mut self, times: impl IntoIterator<Item = f64>, ink: Ink) -> Self {
        self.layers.extend(times.into_iter().map(|x| Layer::Instant { x, ink }));
        self
    }

    /// Adds a text.
    #[must_use]
    pub fn note(self, at: Point, text: impl Into<String>, ink: Ink, anchor: Anchor) -> Self {
        self.with(Layer::Note { at, text: text.into(), ink, anchor })
    }

    /// True when a curve, band or point has something finite to show.
    #[must_use]
    pub fn has_data(&self) -> bool {
        self.layers.iter().any(|layer| match layer {
            Layer::Line { points, .. } => points.iter().filter(|p| finite(p)).nth(1).is_some(),
            Layer::Dots { points, .. } => points.iter().any(finite),
            Layer::Band { edges, .. } => edges.iter().filter(|(x, l, h)| (x + l + h).is_finite()).nth(1).is_some(),
            Layer::Area { corners, .. } => corners.len() > 2,
            _ => false,
        })
    }
}

/// Both coordinates are numbers.
pub(super) fn finite(point: &Point) -> bool {
    point.0.is_finite() && point.1.is_finite()
}
