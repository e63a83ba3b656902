//! Colours of the report: the Okabe–Ito set, told apart by readers with any colour vision, in a light and a dark cut.

use plotters::style::RGBColor;

/// A colour by its role or its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Text and main curves.
    Text,
    /// Secondary text.
    Muted,
    /// Axes.
    Axis,
    /// Grid lines.
    Grid,
    /// Estimates, commands and everything of the flight software.
    Blue,
    /// What truly happened.
    Orange,
    /// Good, target, box.
    Green,
    /// Limits, rejections, faults.
    Vermillion,
    /// Second quantity of the flight software.
    Sky,
    /// Third quantity.
    Purple,
    /// A point of the heat ramp: 0 cool, 255 hot. The same in both cuts.
    Ramp(u8),
}

/// The two cuts of the palette.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark on light.
    #[default]
    Light,
    /// Light on dark.
    Dark,
}

/// Stations of the heat ramp: readable on a dark ground, monotonic in lightness, safe for any colour vision.
const RAMP: [(u8, u8, u8); 5] =
    [(0x3d, 0x5a, 0x9e), (0x7b, 0x52, 0xab), (0xd1, 0x4a, 0x6b), (0xf5, 0x8f, 0x3c), (0xff, 0xf0, 0xa8)];

impl Ink {
    /// Every colour, for the style sheet.
    pub const ALL: [Self; 10] = [
        Self::Text,
        Self::Muted,
        Self::Axis,
        Self::Grid,
        Self::Blue,
        Self::Orange,
        Self::Green,
        Self::Vermillion,
        Self::Sky,
        Self::Purple,
    ];

    /// Name of the style-sheet variable.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Muted => "muted",
            Self::Axis => "axis",
            Self::Grid => "grid",
            Self::Blue => "blue",
            Self::Orange => "orange",
            Self::Green => "green",
            Self::Vermillion => "vermillion",
            Self::Sky => "sky",
            Self::Purple => "purple",
            Self::Ramp(_) => "ramp",
        }
    }

    /// Red, green, blue.
    #[must_use]
    pub fn rgb(self, theme: Theme) -> (u8, u8, u8) {
        let (light, dark) = match self {
            Self::Text => ((0x1f, 0x29, 0x33), (0xe4, 0xe7, 0xeb)),
            Self::Muted => ((0x5f, 0x6c, 0x7b), (0x9a, 0xa5, 0xb1)),
            Self::Axis => ((0x9a, 0xa5, 0xb1), (0x61, 0x6e, 0x7c)),
            Self::Grid => ((0xe4, 0xe7, 0xeb), (0x2b, 0x35, 0x42)),
            Self::Blue => ((0x00, 0x72, 0xb2), (0x4a, 0xa8, 0xe0)),
            Self::Orange => ((0xe6, 0x9f, 0x00), (0xf0, 0xb4, 0x29)),
            Self::Green => ((0x00, 0x9e, 0x73), (0x2b, 0xbf, 0x94)),
            Self::Vermillion => ((0xd5, 0x5e, 0x00), (0xff, 0x8a, 0x3d)),
            Self::Sky => ((0x56, 0xb4, 0xe9), (0x8f, 0xd3, 0xff)),
            Self::Purple => ((0xcc, 0x79, 0xa7), (0xe3, 0x9c, 0xc4)),
            Self::Ramp(level) => (ramp(level), ramp(level)),
        };
        if theme == Theme::Dark { dark } else { light }
    }

    /// The colour as CSS.
    #[must_use]
    pub fn hex(self, theme: Theme) -> String {
        let (r, g, b) = self.rgb(theme);
        format!("#{r:02X}{g:02X}{b:02X}")
    }

    /// The colour for the plotting library.
    #[must_use]
    pub fn color(self, theme: Theme) -> RGBColor {
        let (r, g, b) = self.rgb(theme);
        RGBColor(r, g, b)
    }
}

/// Linear between the stations of the ramp.
fn ramp(level: u8) -> (u8, u8, u8) {
    let position = f64::from(level) / 255.0 * (RAMP.len() - 1) as f64;
    let below = (position as usize).min(RAMP.len() - 2);
    let share = position - below as f64;
    let mix = |a: u8, b: u8| (f64::from(a) * (1.0 - share) + f64::from(b) * share).round() as u8;
    let (a, b) = (RAMP[below], RAMP[below + 1]);
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// Style sheet that declares every colour twice and lets plots, drawn in the light cut, follow the page.
#[must_use]
pub fn style_sheet() -> String {
    let declare = |cut: &dyn Fn(Ink) -> String| {
        Ink::ALL.iter().map(|ink| format!("--{}:{};", ink.name(), cut(*ink))).collect::<String>()
    };
    let light = declare(&|ink| ink.hex(Theme::Light));
    let dark = declare(&|ink| ink.hex(Theme::Dark));
    let follow: String = Ink::ALL
        .iter()
        .map(|ink| {
            let (hex, name) = (ink.hex(Theme::Light), ink.name());
            format!(".plot [fill=\"{hex}\"]{{fill:var(--{name})}}.plot [stroke=\"{hex}\"]{{stroke:var(--{name})}}")
        })
        .collect();
    format!(":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}{follow}")
}
