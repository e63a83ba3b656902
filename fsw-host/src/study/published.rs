//! What P4 (Xia, Shen, Sun, Zhou 2015) reports, and the same quantity of ours beside it.

use serde::Serialize;

use super::Flown;
use crate::campaign::statistics::{Share, mean};
use crate::campaign::summary::Spread;
use crate::columns::aligned;
use crate::report::number;

/// What the paper says of one quantity of one design.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Said {
    /// A figure.
    Number(f64),
    /// No figure, but a statement.
    Words(&'static str),
    /// Nothing.
    Nothing(()),
}

const NOTHING: Said = Said::Nothing(());

/// A figure of ours, with its 95 % bounds or the range of the runs where there is one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figure {
    /// The figure; none when no flight gave one.
    pub value: Option<f64>,
    /// Lower end.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
}

impl From<Option<f64>> for Figure {
    fn from(value: Option<f64>) -> Self {
        Self { value, ..Self::default() }
    }
}

impl From<f64> for Figure {
    fn from(value: f64) -> Self {
        Some(value).into()
    }
}

impl From<Option<Share>> for Figure {
    fn from(share: Option<Share>) -> Self {
        Self { value: share.map(|s| s.value), low: share.map(|s| s.low), high: share.map(|s| s.high) }
    }
}

/// One line of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What is compared, with its unit.
    pub quantity: &'static str,
    /// Where the paper says it; empty when it does not.
    pub source: &'static str,
    /// The paper's predictor-corrector and its segmented form.
    pub published: [Said; 2],
    /// Ours, in the order of the modes.
    pub ours: Vec<Figure>,
    /// Digits after the point.
    #[serde(skip)]
    pub digits: usize,
}

/// A line without its figures; `of` takes a mode and the full predictor-corrector that it is set against.
struct Question {
    quantity: &'static str,
    source: &'static str,
    published: [Said; 2],
    digits: usize,
    of: fn(&Flown, &Flown) -> Figure,
}

/// Seconds of the paper's two flights on its laptop, §5.
const SECONDS: [f64; 2] = [3.601, 1.824];

/// Every quantity for which the paper gives a figure or a statement, and what it leaves out but a reader wants to know.
const QUESTIONS: &[Question] = &[
    Question {
        quantity: "runs within 5 km, %",
        source: "§5, Fig. 6 and 7",
        published: [Said::Number(98.0), Said::Number(86.0)],
        digits: 1,
        of: |m, _| m.summary.within_pct.km5.into(),
    },
    Question {
        quantity: "runs within 10 km, %",
        source: "§5, Fig. 6 and 7",
        published: [Said::Number(100.0), Said::Number(100.0)],
        digits: 1,
        of: |m, _| m.summary.within_pct.km10.into(),
    },
    Question {
        quantity: "nominal: time of guidance, s",
        source: "§5, laptop of 2009",
        published: [Said::Number(SECONDS[0]), Said::Number(SECONDS[1])],
        digits: 4,
        of: |m, _| m.nominal.guidance_wall_s.into(),
    },
    Question {
        quantity: "nominal: that time, of full",
        source: "§5",
        published: [Said::Number(1.0), Said::Number(SECONDS[1] / SECONDS[0])],
        digits: 2,
        of: |m, full| ratio(m.nominal.guidance_wall_s, full.nominal.guidance_wall_s),
    },
    Question {
        quantity: "nominal: of it the predictor, s",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 4,
        of: |m, _| m.nominal.predictor_wall_s.into(),
    },
    Question {
        quantity: "nominal: the predictor's time, of full",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 2,
        of: |m, full| ratio(m.nominal.predictor_wall_s, full.nominal.predictor_wall_s),
    },
    Question {
        quantity: "nominal: evaluations in the flight",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 0,
        of: |m, _| f64::from(m.nominal.evaluations).into(),
    },
    Question {
        quantity: "nominal: evaluations, of full",
        source: "§5: times",
        published: [Said::Number(1.0), Said::Number(SECONDS[1] / SECONDS[0])],
        digits: 2,
        of: |m, full| ratio(f64::from(m.nominal.evaluations), f64::from(full.nominal.evaluations)),
    },
    Question {
        quantity: "nominal: evaluations a cycle",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 0,
        of: |m, _| m.nominal.evaluations_per_cycle().into(),
    },
    Question {
        quantity: "nominal: deploy altitude, km",
        source: "Table 1",
        published: [Said::Number(7.8), NOTHING],
        digits: 2,
        of: |m, _| m.nominal.deploy_altitude_m.map(|h| h * 1e-3).into(),
    },
    Question {
        quantity: "nominal: miss, m",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 0,
        of: |m, _| m.nominal.miss_m.into(),
    },
    Question {
        quantity: "nominal: bank reversals",
        source: "§5, Fig. 2 and 3",
        published: [NOTHING, Said::Words("fewer")],
        digits: 0,
        of: |m, _| f64::from(m.nominal.reversals).into(),
    },
    Question {
        quantity: "runs: evaluations, of full",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 2,
        of: |m, full| match (m.evaluations_per_flight(), full.evaluations_per_flight()) {
            (Some(m), Some(full)) => ratio(m, full),
            _ => Figure::default(),
        },
    },
    Question {
        quantity: "runs: mean |downrange error|, km",
        source: "§5",
        published: [NOTHING, Said::Words("the same")],
        digits: 2,
        of: |m, _| mean_magnitude_km(&m.points, |p| p.downrange_error_m),
    },
    Question {
        quantity: "runs: mean |crossrange error|, km",
        source: "§5",
        published: [NOTHING, Said::Words("larger")],
        digits: 2,
        of: |m, _| mean_magnitude_km(&m.points, |p| p.crossrange_error_m),
    },
    Question {
        quantity: "runs: median miss, m",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 0,
        of: |m, _| m.summary.miss_m.map(|d| d.p50).into(),
    },
    Question {
        quantity: "runs: 99 % miss at most, m",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 0,
        of: |m, _| m.summary.miss_m.map(|d| d.p99).into(),
    },
    Question {
        quantity: "runs: deploy altitude, km",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 1,
        of: |m, _| m.summary.deploy.altitude_m.map(spread_km).unwrap_or_default(),
    },
    Question {
        quantity: "runs: deployed inside the box, %",
        source: "",
        published: [NOTHING, NOTHING],
        digits: 1,
        of: |m, _| m.summary.success_pct.into(),
    },
];

fn ratio(value: f64, of: f64) -> Figure {
    (of > 0.0).then(|| value / of).into()
}

fn spread_km(spread: Spread) -> Figure {
    Figure { value: Some(spread.p50 * 1e-3), low: Some(spread.min * 1e-3), high: Some(spread.max * 1e-3) }
}

fn mean_magnitude_km(points: &[super::points::DeployPoint], of: fn(&super::points::DeployPoint) -> f64) -> Figure {
    let all: Vec<f64> = points.iter().map(|p| of(p).abs() * 1e-3).filter(|v| v.is_finite()).collect();
    mean(&all).into()
}

/// The comparison; the first mode is the full predictor-corrector.
#[must_use]
pub fn compare(modes: &[Flown]) -> Vec<Line> {
    let Some(full) = modes.first() else { return Vec::new() };
    let line = |q: &Question| Line {
        quantity: q.quantity,
        source: q.source,
        published: q.published,
        ours: modes.iter().map(|mode| (q.of)(mode, full)).collect(),
        digits: q.digits,
    };
    QUESTIONS.iter().map(line).collect()
}

impl Line {
    /// What the paper says, as text.
    #[must_use]
    pub fn said(&self, which: usize) -> String {
        match self.published.get(which) {
            Some(Said::Number(value)) => shortest(*value),
            Some(Said::Words(words)) => (*words).to_owned(),
            _ => "–".to_owned(),
        }
    }

    /// A figure of ours, as text with its bounds.
    #[must_use]
    pub fn text(&self, figure: &Figure) -> String {
        let of = |value: f64| number(value, self.digits);
        match (figure.value, figure.low, figure.high) {
            (Some(value), Some(low), Some(high)) => format!("{} [{} … {}]", of(value), of(low), of(high)),
            (Some(value), ..) => of(value),
            _ => "–".to_owned(),
        }
    }
}

/// A figure to three digits after the point, less the zeros at its end.
fn shortest(value: f64) -> String {
    number(value, 3).trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The comparison for a terminal.
#[must_use]
pub fn table(lines: &[Line], modes: &[&str]) -> String {
    let heads = ["", "P4 full", "P4 segmented"].iter().chain(modes).chain(&["P4 says it in"]);
    let heads: Vec<String> = heads.map(|s| (*s).to_owned()).collect();
    let row = |line: &Line| {
        let mut row = vec![line.quantity.to_owned(), line.said(0), line.said(1)];
        row.extend(line.ours.iter().map(|figure| line.text(figure)));
        row.push(line.source.to_owned());
        row
    };
    let rows: Vec<_> = lines.iter().map(row).collect();
    aligned(&heads, &rows, &[heads.len() - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::statistics::wilson;
    use crate::campaign::summary::Within;
    use crate::record::End;
    use crate::record::tests::facts;
    use crate::recorder::{FlightId, Recorder};
    use crate::study::nominal::Nominal;
    use crate::study::points::DeployPoint;
    use crate::study::{MODES, Mode};

    fn flown(mode: Mode, evaluations: u32, downrange_m: [f64; 3]) -> Flown {
        let record = Recorder::new(facts(), FlightId::default(), 1.0).finish(End::Deployed, 0.0);
        let nominal = Nominal {
            outcome: "deployed".into(),
            miss_m: Some(12.0),
            downrange_error_m: None,
            crossrange_error_m: None,
            deploy_altitude_m: Some(7_654.0),
            reversals: 3,
            cycles: 10,
            predictions: 30,
            evaluations,
            guidance_wall_s: f64::from(evaluations) * 1e-6,
            predictor_wall_s: 0.0,
            record,
        };
        let point = |downrange_error_m: f64| DeployPoint {
            run: 0,
            longitude_deg: 0.0,
            latitude_deg: 0.0,
            altitude_m: 7e3,
            speed_mps: 450.0,
            miss_m: downrange_error_m.abs(),
            downrange_error_m,
            crossrange_error_m: 0.0,
            reversals: 3.0,
            cycles: 10.0,
            evaluations_per_cycle: f64::from(evaluations) / 10.0,
        };
        let within_pct = Within { km5: wilson(2, 3), ..Within::default() };
        Flown {
            mode,
            nominal,
            summary: crate::campaign::summary::Summary { within_pct, ..Default::default() },
            points: downrange_m.map(point).to_vec(),
            facts: facts(),
            command: String::new(),
            is_whole: true,
        }
    }

    fn lines() -> Vec<Line> {
        compare(&[flown(MODES[0], 4_000, [-1e3, 2e3, f64::NAN]), flown(MODES[1], 1_000, [3e3, -3e3, 3e3])])
    }

    fn line(quantity: &str) -> Line {
        lines().into_iter().find(|line| line.quantity == quantity).unwrap()
    }

    #[test]
    fn ratios_are_to_the_full_predictor_corrector() {
        for quantity in ["nominal: that time, of full", "nominal: evaluations, of full", "runs: evaluations, of full"] {
            let ours: Vec<_> = line(quantity).ours.iter().map(|f| f.value.unwrap()).collect();
            assert!((ours[0] - 1.0).abs() < 1e-12 && (ours[1] - 0.25).abs() < 1e-12, "{quantity}: {ours:?}");
        }
    }

    #[test]
    fn errors_are_averaged_without_their_sign_over_the_runs_that_deployed() {
        let ours = line("runs: mean |downrange error|, km").ours;
        assert!((ours[0].value.unwrap() - 1.5).abs() < 1e-12 && (ours[1].value.unwrap() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn the_papers_figures_are_those_of_its_text() {
        let said = |quantity: &str| [0, 1].map(|which| line(quantity).said(which));
        assert_eq!(said("runs within 5 km, %"), ["98", "86"]);
        assert_eq!(said("runs within 10 km, %"), ["100", "100"]);
        assert_eq!(said("nominal: time of guidance, s"), ["3.601", "1.824"]);
        assert_eq!(said("nominal: that time, of full"), ["1", "0.507"]);
        assert_eq!(said("nominal: deploy altitude, km"), ["7.8", "–"]);
        assert_eq!(said("nominal: bank reversals"), ["–", "fewer"]);
        for line in lines() {
            let is_said = line.published.iter().any(|said| *said != NOTHING);
            assert_eq!(is_said, !line.source.is_empty(), "{}: what the paper says, it says somewhere", line.quantity);
        }
    }

    #[test]
    fn a_share_shows_its_bounds_and_a_gap_a_dash() {
        let share = line("runs within 5 km, %");
        assert_eq!(share.text(&share.ours[0]), "66.7 [20.8 … 93.9]");
        let gap = line("runs within 10 km, %");
        assert_eq!(gap.text(&gap.ours[0]), "–");
    }

    #[test]
    fn the_table_has_a_row_for_every_line_and_a_column_for_every_mode() {
        let text = table(&lines(), &["paper", "segmented"]);
        assert_eq!(text.lines().count(), QUESTIONS.len() + 2, "two lines of heads");
        let head: Vec<&str> = text.lines().take(2).flat_map(str::split_whitespace).collect();
        assert_eq!(head, ["P4", "P4", "full", "segmented", "paper", "segmented", "P4", "says", "it", "in"]);
    }
}
