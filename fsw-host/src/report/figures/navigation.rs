//! Navigation errors, radial, along and across the track, within their ±3σ and beside what is possible at all, and the
//! consistency of the filter.

use super::Story;
use crate::bound::Least;
use crate::record::TruthSample;
use crate::report::palette::Ink;
use crate::report::plot::{Axis, Figure, Mark, Panel, Point};
use fsw_core::frames::{Inertial, Vec3};
use fsw_core::link::packet::NavTlm;
use fsw_core::link::parameters::NavigationMode;
use nalgebra::{Matrix3, Vector3};

/// 95 % of the chi-square distribution with six degrees of freedom lies between these.
const NEES_95: (f64, f64) = (1.237, 14.449);
const AXES: [&str; 3] = ["radial", "along", "across"];

/// One navigation epoch against the truth, along the three directions.
struct Epoch {
    time_s: f64,
    position: [Along; 3],
    velocity: [Along; 3],
}

/// An error along a direction.
#[derive(Clone, Copy)]
struct Along {
    error: f64,
    /// Standard deviation that the filter states.
    sigma: f64,
    /// The least standard deviation, by the Cramér–Rao bound; NaN where that is not known.
    least: f64,
}

/// Position errors, velocity errors, consistency.
#[must_use]
pub fn figures(story: &Story<'_>) -> Vec<Figure> {
    let epoch = |t: f64, nav: &NavTlm| Epoch::new(t, nav, story.sample_at(t)?, story.record.least_at(t));
    let epochs: Vec<Epoch> = story.record.nav.iter().filter_map(|(t, nav)| epoch(t.as_s(), nav)).collect();
    let position = errors(story, &epochs, "Position error", "m", |e| &e.position);
    let velocity = errors(story, &epochs, "Velocity error", "m/s", |e| &e.velocity);
    vec![position, velocity, consistency(story), density(story)]
}

impl Epoch {
    fn new(time_s: f64, nav: &NavTlm, truth: &TruthSample, least: Option<&Least>) -> Option<Self> {
        let (r, v) = (truth.packet.position_m, truth.packet.velocity_mps);
        let radial = Vec3::<Inertial>::from_array(r).unit()?;
        let across = Vec3::from_array(v).cross(&radial).unit()?;
        let directions = [radial, radial.cross(&across), across];
        let difference = |a: [f64; 3], b: [f64; 3]| Vec3::<Inertial>::from_array(a) + -Vec3::from_array(b);
        let (dr, dv) = (difference(nav.position_m, r), difference(nav.velocity_mps, v));
        let along = |error: &Vec3<Inertial>, block: usize, least: Option<Matrix3<f64>>| {
            directions.map(|unit| Along {
                error: error.dot(&unit),
                sigma: sigma(&nav.covariance, block, unit.to_array()),
                least: least.map_or(f64::NAN, |least| {
                    let unit = Vector3::from(unit.to_array());
                    unit.dot(&(least * unit)).max(0.0).sqrt()
                }),
            })
        };
        let (position, velocity) = (least.map(|l| l.position), least.map(|l| l.velocity));
        Some(Self { time_s, position: along(&dr, 0, position), velocity: along(&dv, 3, velocity) })
    }
}

/// Standard deviation along a unit vector; `block` is 0 for position and 3 for velocity.
fn sigma(lower_triangle: &[f32], block: usize, unit: [f64; 3]) -> f64 {
    let element = |i: usize, j: usize| {
        let (row, column) = (block + i.max(j), block + i.min(j));
        lower_triangle.get(row * (row + 1) / 2 + column).map_or(f64::NAN, |c| f64::from(*c))
    };
    let variance: f64 = (0..9).map(|k| unit[k / 3] * unit[k % 3] * element(k / 3, k % 3)).sum();
    variance.max(0.0).sqrt()
}

fn errors(
    story: &Story<'_>,
    epochs: &[Epoch],
    title: &'static str,
    unit: &str,
    of: impl Fn(&Epoch) -> &[Along; 3],
) -> Figure {
    let panel = |axis: usize| {
        let of = |e: &Epoch| of(e)[axis];
        let (x, height) = if axis < 2 { (story.time_axis().silent(), 140) } else { (story.time_axis(), 176) };
        let band = epochs.iter().map(|e| (e.time_s, -3.0 * of(e).sigma, 3.0 * of(e).sigma)).collect();
        let error: Vec<Point> = epochs.iter().map(|e| (e.time_s, of(e).error)).collect();
        let least = |side: f64| -> Vec<Point> { epochs.iter().map(|e| (e.time_s, side * of(e).least)).collect() };
        Panel::new(x, Axis::fit(format!("{}, {unit}", AXES[axis])).symmetric(), height)
            .instants(story.modes().iter().map(|m| m.0), Ink::Muted)
            .band(band, Ink::Blue)
            .line(least(-3.0), Ink::Text)
            .line(least(3.0), Ink::Text)
            .line(error, Ink::Orange)
    };
    let mut legend =
        vec![(Mark::Line, Ink::Orange, "error".into()), (Mark::Band, Ink::Blue, "±3σ of the filter".into())];
    let limit = if !story.record.bound.is_empty() {
        legend.push((Mark::Line, Ink::Text, "±3σ at the Cramér–Rao bound".into()));
        "The bound is what the best filter could know from the readings of this flight, with every error of the sensors \
         that the flight software was told of."
    } else if story.record.facts.navigation == NavigationMode::Ideal {
        "Ideal navigation is the truth itself: no bound applies to it."
    } else {
        "What was recorded does not tell the Cramér–Rao bound."
    };
    Figure {
        title,
        caption: format!(
            "Estimate minus truth along the radius, along the track and across it (positive to the right). {limit}"
        ),
        legend,
        panels: if epochs.len() > 1 { vec![panel(0), panel(1), panel(2)] } else { Vec::new() },
        missing: "No navigation telemetry with a true state at its time was recorded.",
    }
}

/// Normalised estimation error squared, on a logarithmic axis.
fn consistency(story: &Story<'_>) -> Figure {
    let log = |v: f64| if v > 0.0 { v.log10() } else { f64::NAN };
    let nees: Vec<Point> = story.record.nees.iter().map(|n| (n.time_s, log(n.nees.unwrap_or(f64::NAN)))).collect();
    let known = nees.iter().filter(|p| p.1.is_finite()).count() > 1;
    let (low, high) = (NEES_95.0.log10(), NEES_95.1.log10());
    let end = story.end_s();
    let y = Axis::fit("NEES").decades().including(-0.5).including(1.6);
    let panel = Panel::new(story.time_axis(), y, 230)
        .instants(story.modes().iter().map(|m| m.0), Ink::Muted)
        .band(vec![(0.0, low, high), (end, low, high)], Ink::Green)
        .level(6f64.log10(), Ink::Green, "")
        .thin(nees, Ink::Orange);
    Figure {
        title: "Filter consistency",
        caption: "Normalised estimation error squared of position and velocity: six on average when the filter is as \
                  good as it says."
            .into(),
        legend: vec![
            (Mark::Line, Ink::Orange, "this flight".into()),
            (Mark::Band, Ink::Green, "95 % of a consistent filter".into()),
            (Mark::Line, Ink::Green, "its mean, six".into()),
        ],
        panels: if known { vec![panel] } else { Vec::new() },
        missing: "The navigation of this flight states no covariance to compare with.",
    }
}

/// Density estimate against the onboard model.
fn density(story: &Story<'_>) -> Figure {
    let percent = |log: f64| 100.0 * (log.exp() - 1.0);
    let rows =
        || story.record.nav.iter().map(|(t, n)| (t.as_s(), f64::from(n.log_density), f64::from(n.log_density_sigma)));
    let known = rows().any(|(_, _, s)| s > 0.0);
    let estimate: Vec<Point> = rows().map(|(t, l, _)| (t, percent(l))).collect();
    let band = rows().map(|(t, l, s)| (t, percent(l - 3.0 * s), percent(l + 3.0 * s))).collect();
    let panel = Panel::new(story.time_axis(), Axis::fit("density, % of model").including(-10.0).including(10.0), 230)
        .instants(story.modes().iter().map(|m| m.0), Ink::Muted)
        .band(band, Ink::Blue)
        .line(estimate, Ink::Blue);
    Figure {
        title: "Density estimate",
        caption: "How much denser the air is than the onboard model, as navigation sees it.".into(),
        legend: vec![(Mark::Line, Ink::Blue, "estimate".into()), (Mark::Band, Ink::Blue, "±3σ".into())],
        panels: if known { vec![panel] } else { Vec::new() },
        missing: "The navigation of this flight estimates no density.",
    }
}
