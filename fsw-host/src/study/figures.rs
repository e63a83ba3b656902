//! P4's plots: heading offset against its threshold (Fig. 2 and 3), trajectories (4 and 5), deploy points (6 and 7).

use fsw_core::link::packet::{EventKind, GuidanceTlm};
use fsw_core::units::deg;

use super::points::DeployPoint;
use super::{Flown, Mode};
use crate::campaign::report::misses::{curve, curve_of};
use crate::campaign::summary::ascending;
use crate::cli::GuidanceName;
use crate::record::TruthSample;
use crate::report::{Anchor, Axis, Figure, Ink, Layer, Mark, Panel, Point};
use crate::tables::WAYPOINTS_DEG;

/// Circles about the target, km.
const CIRCLES_KM: [f64; 2] = [5.0, 10.0];
/// Half the width of the plot of deploy points, km: the larger circle with room around it.
const REACH_KM: f64 = 11.5;
const DOWNRANGE: &str = "downrange from the target, km";
const CROSSRANGE: &str = "crossrange, km";
/// Most points of a drawn path.
const PATH_POINTS: usize = 600;

/// Titles of a mode: its offset, its deploy points.
fn titles(mode: Mode) -> (&'static str, &'static str) {
    match mode.0 {
        GuidanceName::Paper => {
            ("paper: crossrange and its threshold (P4, Fig. 2)", "paper: deploy points (P4, Fig. 6)")
        }
        GuidanceName::Segmented => {
            ("segmented: crossrange and its threshold (P4, Fig. 3)", "segmented: deploy points (P4, Fig. 7)")
        }
        _ => ("segmented-table: crossrange and its threshold", "segmented-table: deploy points"),
    }
}

/// Colour of a mode where several are in one plot.
pub fn ink(mode: Mode) -> Ink {
    match mode.0 {
        GuidanceName::Paper => Ink::Blue,
        GuidanceName::Segmented => Ink::Vermillion,
        _ => Ink::Purple,
    }
}

fn legend(modes: &[Flown]) -> Vec<(Mark, Ink, String)> {
    modes.iter().map(|m| (Mark::Line, ink(m.mode), m.mode.name().to_owned())).collect()
}

/// Heading offset of a nominal flight against its threshold, over time and over speed.
pub fn offset(flown: &Flown) -> Figure {
    let nominal = &flown.nominal;
    let cycles = || nominal.record.guidance.iter().map(|(_, g)| g).filter(|g| g.heading_threshold_m > 0.0);
    let time = |g: &GuidanceTlm| g.effective.as_s();
    let speed = |g: &GuidanceTlm| -nominal.speed_at_mps(g.effective.as_s());
    let panel = |panel: Panel, x: &dyn Fn(&GuidanceTlm) -> f64, reversals: Vec<f64>| {
        let threshold = |g| -> f64 { f64::abs(g) * 1e-3 };
        let band = cycles().map(|g| (x(g), -threshold(g.heading_threshold_m), threshold(g.heading_threshold_m)));
        panel
            .band(band.collect(), Ink::Green)
            .instants(reversals, Ink::Purple)
            .line(cycles().map(|g| (x(g), g.heading_offset_m * 1e-3)).collect(), Ink::Blue)
    };
    let times = reversals(flown);
    let speeds = times.iter().map(|t| -nominal.speed_at_mps(*t)).collect();
    let y = || Axis::fit("offset χ, km").symmetric();
    let plural = if nominal.reversals == 1 { "" } else { "s" };
    Figure {
        title: titles(flown.mode).0,
        caption: format!(
            "Undispersed flight. The paper's crossrange is the heading offset to the target, positive when it lies to \
             the right; a reversal is due when it leaves the threshold. {} reversal{plural}.",
            nominal.reversals
        ),
        legend: vec![
            (Mark::Line, Ink::Blue, "offset to the target".into()),
            (Mark::Band, Ink::Green, "threshold".into()),
            (Mark::Instant, Ink::Purple, "reversal".into()),
        ],
        panels: vec![
            panel(Panel::new(Axis::fit("time, s"), y(), 220), &time, times),
            panel(Panel::new(Axis::fit("planet-relative speed, m/s").negated(), y(), 220), &speed, speeds),
        ],
        missing: "Guidance did not control the bank in this flight.",
    }
}

/// Times of the reversals of a nominal flight, s.
fn reversals(flown: &Flown) -> Vec<f64> {
    let events = &flown.nominal.record.events;
    events.iter().filter(|e| matches!(e.kind, EventKind::Reversal { .. })).map(|e| e.time.as_s()).collect()
}

/// A path through the truth of a nominal flight.
fn path(flown: &Flown, point: impl Fn(&TruthSample) -> Point) -> Vec<Point> {
    let truth = &flown.nominal.record.truth;
    let every = truth.len().div_ceil(PATH_POINTS).max(1);
    truth.iter().step_by(every).chain(truth.last()).map(point).collect()
}

/// Altitude against speed of the nominal flights.
pub fn altitude(modes: &[Flown]) -> Figure {
    let axes =
        |height| Panel::new(Axis::fit("planet-relative speed, m/s"), Axis::fit("altitude, km").including(0.0), height);
    let whole = modes
        .iter()
        .fold(axes(300), |panel, m| panel.line(path(m, |s| (s.speed_mps, s.altitude_m * 1e-3)), ink(m.mode)));
    let end = Panel::new(Axis::fixed("planet-relative speed, m/s", 400.0, 1_050.0), Axis::fit("altitude, km"), 240);
    let late = |m: &Flown| {
        path(m, |s| if s.speed_mps < 1_050.0 { (s.speed_mps, s.altitude_m * 1e-3) } else { (f64::NAN, f64::NAN) })
    };
    let deployed = |m: &Flown| m.nominal.record.summary.deploy.map(|d| (d.speed_mps, d.altitude_m * 1e-3));
    let end = modes.iter().fold(end, |panel, m| {
        panel.line(late(m), ink(m.mode)).dots(deployed(m).into_iter().collect(), ink(m.mode), 4.5)
    });
    Figure {
        title: "Altitude against speed (P4, Fig. 4 and Fig. 5)",
        caption:
            "Undispersed flights; below, their end: the dots are the parachutes, for which the paper's Table 1 has \
                  7.8 km."
                .into(),
        legend: legend(modes),
        panels: vec![whole, end.level(7.8, Ink::Muted, "Table 1")],
        missing: "No true state was recorded.",
    }
}

/// Ground tracks of the nominal flights with the waypoints.
pub fn track(modes: &[Flown]) -> Figure {
    let axes = Panel::new(Axis::fit("longitude, deg"), Axis::fit("latitude, deg"), 300);
    let tracks = modes
        .iter()
        .fold(axes, |panel, m| panel.line(path(m, |s| (deg(s.longitude_rad), deg(s.latitude_rad))), ink(m.mode)));
    let waypoints: Vec<Point> = WAYPOINTS_DEG.iter().map(|[longitude, latitude]| (*longitude, *latitude)).collect();
    let target = modes.first().map(|m| (deg(m.facts.target.longitude_rad), deg(m.facts.target.latitude_rad)));
    let panel = tracks.dots(waypoints, Ink::Orange, 4.0).crosses(target.into_iter().collect(), Ink::Green);
    // How far each lies to the side is too little to be seen on a map.
    let side = |m: &Flown| -> Vec<Point> {
        path(m, |s| {
            let miss = crate::measure::miss(&m.facts, s);
            (miss.downrange_m * 1e-3, miss.crossrange_m * 1e-3)
        })
    };
    let axes = Panel::new(Axis::fit(DOWNRANGE), Axis::fit(CROSSRANGE).including(0.0), 220);
    let sides = modes.iter().fold(axes, |panel, m| panel.line(side(m), ink(m.mode)));
    let mut legend = legend(modes);
    legend.push((Mark::Dot, Ink::Orange, "waypoint".into()));
    legend.push((Mark::Cross, Ink::Green, "target".into()));
    Figure {
        title: "Trajectories over the ground (P4, Fig. 4 and Fig. 5)",
        caption: "Undispersed flights with the three waypoints of §5; below, how far they lie beside the great circle \
                  from entry to target."
            .into(),
        legend,
        panels: vec![panel, sides.crosses(vec![(0.0, 0.0)], Ink::Green)],
        missing: "No true state was recorded.",
    }
}

/// Flown bank of the nominal flights, one panel a mode.
pub fn bank(modes: &[Flown]) -> Figure {
    let last = modes.len().saturating_sub(1);
    let panel = |(at, m): (usize, &Flown)| {
        let time = Axis::fit(if at == last { "time, s" } else { "" }).including(0.0);
        let time = if at == last { time } else { time.silent() };
        let y = Axis::fit("bank, deg").symmetric().every(45.0).including(60.0);
        Panel::new(time, y, if at == last { 190 } else { 160 })
            .named(m.mode.name())
            .instants(reversals(m), Ink::Muted)
            .line(path(m, |s| (s.time_s, deg(s.packet.bank_rad))), ink(m.mode))
    };
    Figure {
        title: "Bank (P4, Fig. 4 and Fig. 5)",
        caption: "Undispersed flights, flown bank, positive to the right; upright lines are commanded reversals."
            .into(),
        legend: legend(modes),
        panels: modes.iter().enumerate().map(panel).collect(),
        missing: "No bank was recorded.",
    }
}

/// Deploy points of a mode about the target with the paper's two circles.
pub fn deploys(flown: &Flown) -> Figure {
    let point = |p: &DeployPoint| (p.downrange_error_m * 1e-3, p.crossrange_error_m * 1e-3);
    let all: Vec<Point> = flown.points.iter().map(point).filter(|p| p.0.is_finite()).collect();
    let inside = |p: &&Point| p.0.abs() <= REACH_KM && p.1.abs() <= REACH_KM;
    let shown: Vec<Point> = all.iter().filter(inside).copied().collect();
    let beyond = all.len() - shown.len();
    let near = |label: &str| Axis::fixed(label, -REACH_KM, REACH_KM);
    let mut panels = vec![cloud(Panel::new(near(DOWNRANGE), near(CROSSRANGE), 430), &shown, ink(flown.mode))];
    let more = if beyond == 0 {
        String::new()
    } else {
        let whole = Panel::new(Axis::fit(DOWNRANGE), Axis::fit(CROSSRANGE), 230).named("all runs");
        panels.push(cloud(whole, &all, ink(flown.mode)));
        format!(" {beyond} lie outside the upper plot and are in the lower one.")
    };
    Figure {
        title: titles(flown.mode).1,
        caption: format!(
            "{} runs about the target with the paper's circles of 5 and 10 km; downrange positive beyond the target.{more}",
            all.len()
        ),
        legend: vec![
            (Mark::Dot, ink(flown.mode), "a run".into()),
            (Mark::Line, Ink::Green, "5 and 10 km".into()),
            (Mark::Cross, Ink::Green, "target".into()),
        ],
        panels,
        missing: "No run deployed.",
    }
}

/// Deploy points with the circles, labelled where the target is near.
fn cloud(panel: Panel, points: &[Point], ink: Ink) -> Panel {
    let is_labelled = panel.name.is_empty();
    let panel = CIRCLES_KM.iter().fold(panel.equal_scale(), |panel, radius| {
        let ring = curve(|c, s| (radius * c, radius * s));
        let panel = panel.with(Layer::Line { points: ring, ink: Ink::Green, width: 1.3, opacity: 0.9 });
        if !is_labelled {
            return panel;
        }
        panel.note((0.72 * radius, 0.72 * radius), format!(" {radius} km"), Ink::Green, Anchor::Start)
    });
    let size = if points.len() > 400 { 1.7 } else { 2.4 };
    panel.dots(points.to_vec(), ink, size).crosses(vec![(0.0, 0.0)], Ink::Green)
}

/// Shares of the runs within a distance, all modes in one plot, with what the paper says.
pub fn distribution(modes: &[Flown]) -> Figure {
    let x = Axis::fit("miss, km").decades();
    let panel = Panel::new(x, Axis::fixed("within, % of the runs", 0.0, 100.0), 400)
        .instants(CIRCLES_KM.map(f64::log10), Ink::Green);
    let panel = modes.iter().fold(panel, |panel, m| {
        let km: Vec<f64> = m.points.iter().map(|p| p.miss_m * 1e-3).collect();
        panel.line(curve_of(&ascending(&km), km.len()), ink(m.mode))
    });
    let said = |mode: Mode, percent: f64| (CIRCLES_KM[0].log10(), percent, ink(mode));
    let published = [said(super::MODES[0], 98.0), said(super::MODES[1], 86.0)];
    let panel = published.iter().fold(panel, |panel, (x, y, ink)| panel.crosses(vec![(*x, *y)], *ink));
    let mut legend = legend(modes);
    legend.push((Mark::Instant, Ink::Green, "5 and 10 km".into()));
    legend.push((Mark::Cross, Ink::Text, "P4 at 5 km".into()));
    Figure {
        title: "Distribution of the miss",
        caption:
            "Share of the runs that deployed within a distance of the target. The crosses are the paper's 98 % and \
                  86 % at 5 km."
                .into(),
        legend,
        panels: vec![panel],
        missing: "No run deployed.",
    }
}
