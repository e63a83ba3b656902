//! Winds: east and north components over altitude.

use crate::atmosphere::locate;

/// Wind at one altitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Altitude, m.
    pub altitude_m: f64,
    /// Wind towards the east, m/s.
    pub east_mps: f64,
    /// Wind towards the north, m/s.
    pub north_mps: f64,
}

/// Sum of layers, each linear between its rows and constant beyond them. The default is still air.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wind {
    layers: Vec<Layer>,
}

#[derive(Clone, Debug, PartialEq)]
struct Layer {
    altitude_m: Vec<f64>,
    east_mps: Vec<f64>,
    north_mps: Vec<f64>,
}

impl Wind {
    /// Adds rows to whatever blows already. Rows are sorted by altitude; fewer than two, or altitudes that are not
    /// distinct numbers, add the first row's wind at every altitude.
    #[must_use]
    pub fn with(mut self, rows: &[Row]) -> Self {
        let mut rows = rows.to_vec();
        rows.sort_by(|a, b| a.altitude_m.total_cmp(&b.altitude_m));
        let Some(first) = rows.first().copied() else { return self };
        let distinct = rows.windows(2).all(|w| w[1].altitude_m > w[0].altitude_m);
        if rows.len() < 2 || !distinct {
            rows = vec![Row { altitude_m: 0.0, ..first }, Row { altitude_m: 1.0, ..first }];
        }
        self.layers.push(Layer {
            altitude_m: rows.iter().map(|r| r.altitude_m).collect(),
            east_mps: rows.iter().map(|r| r.east_mps).collect(),
            north_mps: rows.iter().map(|r| r.north_mps).collect(),
        });
        self
    }

    /// True when no wind was given.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.layers.is_empty()
    }

    /// East and north component at an altitude, m/s.
    #[must_use]
    pub fn at(&self, altitude_m: f64) -> (f64, f64) {
        self.layers.iter().fold((0.0, 0.0), |(east, north), layer| {
            let (row, fraction) = locate(&layer.altitude_m, altitude_m);
            let f = fraction.clamp(0.0, 1.0);
            let between = |c: &[f64]| c[row] + f * (c[row + 1] - c[row]);
            (east + between(&layer.east_mps), north + between(&layer.north_mps))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_add_and_keep_their_end_values() {
        let row = |altitude_m, east_mps, north_mps| Row { altitude_m, east_mps, north_mps };
        let wind = Wind::default().with(&[row(0.0, 10.0, 0.0), row(10e3, 20.0, -4.0)]).with(&[row(0.0, 1.0, 1.0)]);
        assert_eq!(wind.at(-1e3), (11.0, 1.0));
        assert_eq!(wind.at(5e3), (16.0, -1.0));
        assert_eq!(wind.at(90e3), (21.0, -3.0));
        assert!(Wind::default().is_still() && !wind.is_still());
    }
}
