//! A figure of the page: title, what to look for, legend beside (never over) the data, panels below each other.

use maud::{Markup, PreEscaped, html};

use super::super::palette::{Ink, Theme};
use super::{Canvas, Panel, PlotError};

/// The sign of a legend entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line.
    Line,
    /// A shaded area.
    Band,
    /// A dot.
    Dot,
    /// A crossed circle.
    Cross,
    /// A vertical line.
    Instant,
}

/// Width that figures are designed for; the page scales them.
pub const FIGURE_WIDTH: u32 = 640;

/// A titled stack of panels.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Title.
    pub title: &'static str,
    /// One or two sentences: what it shows.
    pub caption: String,
    /// Legend.
    pub legend: Vec<(Mark, Ink, String)>,
    /// Panels from top to bottom. Those without data are left out.
    pub panels: Vec<Panel>,
    /// Said instead of a plot when no panel has data.
    pub missing: &'static str,
}

impl Figure {
    /// The figure as HTML.
    ///
    /// # Errors
    /// When the plotting library fails.
    pub fn render(&self) -> Result<Markup, PlotError> {
        let panels: Vec<&Panel> = self.panels.iter().filter(|panel| panel.has_data()).collect();
        if panels.is_empty() {
            return Ok(html! {
                figure { h3 { (self.title) } p.missing { (self.missing) } }
            });
        }
        let mut canvas = Canvas::new(FIGURE_WIDTH, panels.iter().map(|panel| panel.height).sum(), Theme::Light);
        let mut top = 0;
        for panel in panels {
            canvas.draw(panel, (0, top), FIGURE_WIDTH)?;
            top += panel.height;
        }
        Ok(html! {
            figure {
                h3 { (self.title) }
                @if !self.caption.is_empty() { p.caption { (self.caption) } }
                @if !self.legend.is_empty() { ul.legend { @for entry in &self.legend { (legend_entry(entry)) } } }
                (PreEscaped(canvas.into_inline(self.title)))
            }
        })
    }
}

/// One entry of the legend: a small drawn sign and its meaning.
fn legend_entry((mark, ink, text): &(Mark, Ink, String)) -> Markup {
    let color = format!("var(--{})", ink.name());
    html! {
        li {
            svg viewBox="0 0 22 12" aria-hidden="true" {
                @match mark {
                    Mark::Line => line x1="1" y1="6" x2="21" y2="6" stroke=(color) stroke-width="2.4" {},
                    Mark::Band => rect x="1" y="1" width="20" height="10" rx="2" fill=(color) fill-opacity="0.3" {},
                    Mark::Dot => circle cx="11" cy="6" r="3.4" fill=(color) {},
                    Mark::Cross => {
                        circle cx="11" cy="6" r="4.4" fill="none" stroke=(color) stroke-width="1.4" {}
                        path d="M8 3L14 9M14 3L8 9" stroke=(color) stroke-width="1.4" {}
                    }
                    Mark::Instant => line x1="11" y1="0" x2="11" y2="12" stroke=(color) stroke-width="1.4" {},
                }
            }
            (text)
        }
    }
}
