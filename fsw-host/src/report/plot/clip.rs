//! From data to what is worth drawing: lines cut at the edges of the panel, points that no eye could tell dropped.

use super::{Point, finite};

/// The rectangle of a panel in the units of its axes.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub x: (f64, f64),
    pub y: (f64, f64),
}

impl Frame {
    /// True when a point lies inside.
    pub fn contains(&self, (x, y): Point) -> bool {
        x >= self.x.0 && x <= self.x.1 && y >= self.y.0 && y <= self.y.1
    }

    /// The part of the segment a–b inside the frame (Liang–Barsky), if any.
    fn cut(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for (p, q) in [(-dx, a.0 - self.x.0), (dx, self.x.1 - a.0), (-dy, a.1 - self.y.0), (dy, self.y.1 - a.1)] {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                enter = enter.max(q / p);
            } else {
                leave = leave.min(q / p);
            }
        }
        let at = |s: f64| (a.0 + s * dx, a.1 + s * dy);
        (enter <= leave).then(|| (at(enter), at(leave)))
    }
}

/// A line in more pieces than this is drawn through its gaps: nobody could see them all.
const MOST_RUNS: usize = 200;

/// Splits a line where it is not finite or leaves the frame.
pub fn runs(points: &[Point], frame: &Frame) -> Vec<Vec<Point>> {
    let split = split(points, frame);
    if split.len() <= MOST_RUNS {
        return split;
    }
    let bridged: Vec<Point> = points.iter().filter(|p| finite(p)).copied().collect();
    self::split(&bridged, frame)
}

fn split(points: &[Point], frame: &Frame) -> Vec<Vec<Point>> {
    let mut runs: Vec<Vec<Point>> = vec![Vec::new()];
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let piece = if finite(&a) && finite(&b) { frame.cut(a, b) } else { None };
        let Some((from, to)) = piece else {
            runs.push(Vec::new());
            continue;
        };
        match runs.last_mut() {
            Some(run) if run.last() == Some(&from) => run.push(to),
            _ => runs.push(vec![from, to]),
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// Fewest points that keep a line within `tolerance` of the original (Ramer–Douglas–Peucker, without recursion).
/// Very long lines are first thinned to the extremes of short stretches, so that no peak is lost.
pub fn simplify(points: &[Point], tolerance: f64) -> Vec<Point> {
    let points = extremes(points, 4000);
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len().saturating_sub(1))];
    while let Some((first, last)) = open.pop() {
        keep.iter_mut().enumerate().filter(|(i, _)| *i == first || *i == last).for_each(|(_, k)| *k = true);
        if last <= first + 1 {
            continue;
        }
        let furthest = (first + 1..last)
            .map(|i| (i, distance(points[i], points[first], points[last])))
            .fold((first, tolerance), |best, this| if this.1 > best.1 { this } else { best });
        if furthest.0 != first {
            open.push((first, furthest.0));
            open.push((furthest.0, last));
        }
    }
    points.into_iter().zip(keep).filter_map(|(p, kept)| kept.then_some(p)).collect()
}

/// First, lowest, highest and last point of each of `count / 4` stretches.
fn extremes(points: &[Point], count: usize) -> Vec<Point> {
    if points.len() <= count {
        return points.to_vec();
    }
    let mut thinned = Vec::with_capacity(count);
    for stretch in points.chunks(points.len().div_ceil(count / 4)) {
        let by_y = |a: &(usize, &Point), b: &(usize, &Point)| a.1.1.total_cmp(&b.1.1);
        let low = stretch.iter().enumerate().min_by(by_y).map_or(0, |(i, _)| i);
        let high = stretch.iter().enumerate().max_by(by_y).map_or(0, |(i, _)| i);
        let mut chosen = [0, low, high, stretch.len() - 1];
        chosen.sort_unstable();
        thinned.extend(
            chosen.iter().enumerate().filter(|(n, i)| *n == 0 || chosen[n - 1] != **i).map(|(_, i)| stretch[*i]),
        );
    }
    thinned
}

/// Distance of `p` from the segment a–b.
fn distance(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length2 = dx * dx + dy * dy;
    let s = if length2 > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p.0 - a.0 - s * dx).hypot(p.1 - a.1 - s * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Frame = Frame { x: (0.0, 1.0), y: (0.0, 1.0) };

    #[test]
    fn a_line_through_the_frame_is_cut_at_its_edges() {
        assert_eq!(runs(&[(-1.0, 0.5), (2.0, 0.5)], &UNIT), [[(0.0, 0.5), (1.0, 0.5)]]);
        assert!(runs(&[(-1.0, 2.0), (2.0, 2.0)], &UNIT).is_empty());
    }

    #[test]
    fn what_is_not_a_number_interrupts_a_line() {
        let line = [(0.0, 0.0), (0.2, 0.2), (0.4, f64::NAN), (0.6, 0.6), (0.8, 0.8)];
        assert_eq!(runs(&line, &UNIT).len(), 2);
    }

    #[test]
    fn a_line_full_of_holes_is_drawn_through_them() {
        let y = |i: u32| if i.is_multiple_of(3) { f64::NAN } else { 0.5 };
        let line: Vec<Point> = (0..3000).map(|i| (f64::from(i) / 3000.0, y(i))).collect();
        assert_eq!(runs(&line, &UNIT).len(), 1);
    }

    #[test]
    fn a_straight_line_needs_two_points_and_a_peak_survives() {
        let mut line: Vec<Point> = (0..20_000).map(|i| (f64::from(i), 0.0)).collect();
        assert_eq!(simplify(&line, 0.1).len(), 2);
        line[12_345].1 = 5.0;
        assert!(simplify(&line, 0.1).contains(&(12_345.0, 5.0)));
    }
}
