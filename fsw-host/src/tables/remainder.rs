//! The range that is left where a prediction is cut, fitted by a polynomial around the reference flight.

use std::fmt::Write;

use fsw_core::frames::PlanetRelative;
use fsw_core::guidance::segments::terms;
use fsw_core::guidance::tables::REMAINDER_TERMS;

use super::reference::{Reference, relative, speed, state};

/// Reach of the fit either way, per waypoint: altitude, m, and flight-path angle, rad. The further down, the more the flights spread.
const REACH: [(f64, f64); 3] = [(3e3, 0.015), (4e3, 0.03), (6e3, 0.08)];
/// The same of the logarithm of the density.
const LOG_DENSITY_REACH: f64 = 0.3;
/// Cosine of the bank, smallest and largest: 110° and 10°.
const COS_BANK: [f64; 2] = [-0.342, 0.985];
/// Chebyshev points per axis.
const POINTS: usize = 5;

/// A fitted waypoint.
pub struct Fitted {
    longitude_rad: f64,
    latitude_rad: f64,
    speed_mps: f64,
    validity: [(f64, f64); 4],
    coefficients: [f64; REMAINDER_TERMS],
}

/// Fits the remainder at waypoint `index`, longitude and latitude in degrees.
pub fn segment(reference: &Reference, index: usize, [longitude_deg, latitude_deg]: [f64; 2]) -> Fitted {
    let (altitude_reach_m, path_angle_reach_rad) = REACH[index];
    let (longitude_rad, latitude_rad) = (longitude_deg.to_radians(), latitude_deg.to_radians());
    let cut = reference.abeam(longitude_rad, latitude_rad);
    let at = relative(&cut);
    let altitude_m = at.radius_m - reference.radius_m();
    let [least, most] = COS_BANK;
    let validity = [
        (altitude_m, altitude_reach_m),
        (at.flight_path_angle_rad, path_angle_reach_rad),
        (0.5 * (least + most), 0.5 * (most - least)),
        (0.0, LOG_DENSITY_REACH),
    ];
    let mut normal = [[0.0; REMAINDER_TERMS]; REMAINDER_TERMS];
    let mut right = [0.0; REMAINDER_TERMS];
    for k in 0..POINTS.pow(4) {
        let share: [f64; 4] = std::array::from_fn(|axis| {
            let point = k / POINTS.pow(u32::try_from(axis).unwrap_or(0)) % POINTS;
            -(std::f64::consts::PI * (point as f64 + 0.5) / POINTS as f64).cos()
        });
        let [h, gamma, u, rho] = std::array::from_fn(|axis| validity[axis].0 + share[axis] * validity[axis].1);
        let (r, v) =
            PlanetRelative { radius_m: h + reference.radius_m(), flight_path_angle_rad: gamma, ..at }.to_cartesian();
        let range_m = reference.range_m(&state(&r, &v), u, rho.exp());
        let terms = terms(share);
        for (i, a) in terms.iter().enumerate() {
            right[i] += a * range_m;
            for (j, b) in terms.iter().enumerate() {
                normal[i][j] += a * b;
            }
        }
    }
    Fitted { longitude_rad, latitude_rad, speed_mps: speed(&cut), validity, coefficients: solve(normal, right) }
}

/// Solves the normal equations by elimination; they are positive definite, so that no pivoting is needed.
#[allow(clippy::needless_range_loop)] // rows and columns of one matrix
fn solve(mut a: [[f64; REMAINDER_TERMS]; REMAINDER_TERMS], mut b: [f64; REMAINDER_TERMS]) -> [f64; REMAINDER_TERMS] {
    for i in 0..REMAINDER_TERMS {
        for k in i + 1..REMAINDER_TERMS {
            let factor = a[k][i] / a[i][i];
            for j in i..REMAINDER_TERMS {
                a[k][j] -= factor * a[i][j];
            }
            b[k] -= factor * b[i];
        }
    }
    for i in (0..REMAINDER_TERMS).rev() {
        for j in i + 1..REMAINDER_TERMS {
            b[i] -= a[i][j] * b[j];
        }
        b[i] /= a[i][i];
    }
    b
}

/// A number as the source of a single-precision constant: the shortest text that makes it, of five significant digits.
#[allow(clippy::cast_possible_truncation)] // that is the purpose
fn single(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    format!("{:?}", rounded as f32)
}

impl Fitted {
    /// As an element of the table in source form.
    pub fn source(&self) -> String {
        let mut text = format!(
            "    Segment {{\n        longitude_rad: {},\n        latitude_rad: {},\n        speed_mps: {},\n        validity: [",
            single(self.longitude_rad),
            single(self.latitude_rad),
            single(self.speed_mps)
        );
        let validity: Vec<String> =
            self.validity.iter().map(|(c, r)| format!("({}, {})", single(*c), single(*r))).collect();
        let coefficients: Vec<String> = self.coefficients.iter().map(|c| single(*c)).collect();
        let _ =
            write!(text, "{}],\n        coefficients: [{}],\n    }},\n", validity.join(", "), coefficients.join(", "));
        text
    }
}
