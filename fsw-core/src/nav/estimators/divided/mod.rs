//! [`Divided`]: the one kernel of the divided-difference filters, plain, desensitized and of adaptive order, in square-root
//! form (NPR00; P2 with the equations that its text lost).
//!
//! | filter | order | sensitivities | weights |
//! |---|---|---|---|
//! | DDF1, DDF2 | [`Order::First`], [`Order::Second`] | [`Sensitivities::None`] | |
//! | RDDF1 | [`Order::First`] | [`Sensitivities::First`] | variances of the parameters |
//! | RDDF2 | [`Order::Second`] | [`Sensitivities::Full`] | the same |
//! | RDDF2 with the sensitivities of RDDF1 | [`Order::Second`] | [`Sensitivities::First`] | the same |
//! | ARDDF, free measure | [`Order::Measured`] | any | the same |
//! | ARDDF, rank-sampled measure (P2) | [`Divided::nonlinearity_by_ranks`], then [`Divided::set_order`] | any | the same |
//!
//! **What desensitizing is.** The gain minimises tr(P + S W Sᵀ), S = ∂x̂/∂α (P2 eq. 41). That is Schmidt's gain for parameters
//! of covariance W (tested to 1e-12), so W is no free weight but what is known of the parameters, and the covariance that
//! is reported is P + S W Sᵀ.
//!
//! **Measurements come in batches**, of up to `O` scalars that are differenced about one state and weighed by one gain. One
//! scalar after the other would not be the same: Schmidt's gain of a batch is only that of its scalars in turn if none
//! depends on the parameters directly, which accelerations and pressures do. A batch costs no more code than a scalar
//! (`O` is the room, how many there are is known at run time), and blocks may still follow each other in later frames.
//!
//! **Nothing can become indefinite**: covariances are triangular factors (P, and that of the innovations), to which columns
//! are added by rotations; for any gain K the factor after the update is that of `[Sb − K T1, K Sv, K T2]`. Whatever is
//! not finite is an error, and the filter is then as it was before the call.

mod nonlinearity;
mod points;
mod sensitivity;
mod update;

use nalgebra::SMatrix;

pub use points::{Chained, Map, Sensed, Stepped};
pub use update::Corrected;

use super::models::Process;
use super::{EstimatorError, Part, finite};
use crate::math::factor::add_column;
use crate::math::fun::sqrt;
use crate::math::sqrt_tools::tria;
use nonlinearity::Spread;
use points::{Column, Detail, Middle};

/// Which differences count.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Order {
    /// First differences (DDF1).
    First,
    /// First and second (DDF2).
    Second,
    /// Second where the degree of nonlinearity of step and measurements together, as their own difference points show it,
    /// is above this; first elsewhere (ARDDF). A step goes by its own points and those of the measurements before it, a
    /// batch by its own and those of the step before it.
    Measured {
        /// Threshold in [0, 1]: 0 is the second order, wherever there is any curvature; 1 the first.
        threshold: f64,
    },
}

/// What is known of the estimate's derivatives with respect to the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sensitivities {
    /// Nothing: plain divided-difference filters.
    None,
    /// ∂x̂/∂α, carried through the middle of the points (RDDF1).
    First,
    /// With those of the factor, so that they follow the second-order equations exactly (RDDF2, P2 eq. 54–65). Under
    /// [`Order::Measured`] a second-order step costs its points twice: what has to be differentiated is known after them.
    Full,
}

/// What makes a filter one of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<const N: usize, const P: usize> {
    /// Order.
    pub order: Order,
    /// Sensitivities.
    pub sensitivities: Sensitivities,
    /// The model's parameters; zero is the nominal model.
    pub parameters: [f64; P],
    /// Diagonal of W: the variances of their errors, not negative. Nothing to a filter without sensitivities.
    pub weights: [f64; P],
    /// What is one unit of each state in its degree of nonlinearity; all 1 is P2's raw sum, which is that of the position.
    /// Measurements count in units of their noise.
    pub units: [f64; N],
}

impl<const N: usize, const P: usize> Settings<N, P> {
    /// A plain filter, DDF1 or DDF2 by its order.
    #[must_use]
    pub const fn plain(order: Order) -> Self {
        Self { order, sensitivities: Sensitivities::None, parameters: [0.0; P], weights: [0.0; P], units: [1.0; N] }
    }

    /// A desensitized filter, RDDF1, RDDF2 or ARDDF by its order.
    #[must_use]
    pub const fn desensitized(order: Order, sensitivities: Sensitivities, weights: [f64; P]) -> Self {
        Self { order, sensitivities, parameters: [0.0; P], weights, units: [1.0; N] }
    }
}

/// What a step or a batch was taken to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degree {
    /// Degree of nonlinearity of step and measurements in [0, 1], as [`Order::Measured`] takes it: 0 is linear.
    pub nonlinearity: f64,
    /// Whether second differences counted.
    pub is_second: bool,
}

/// A divided-difference filter of a state of `N` numbers, desensitized to `P` parameters; everything in place.
#[derive(Clone, Debug, PartialEq)]
pub struct Divided<const N: usize, const P: usize> {
    settings: Settings<N, P>,
    state: [f64; N],
    /// Lower triangular S with P = S Sᵀ.
    factor: SMatrix<f64, N, N>,
    /// ∂(state)/∂(parameter), a row each.
    sensitivity: [[f64; N]; P],
    /// ∂(factor)/∂(parameter).
    factor_sensitivity: [SMatrix<f64, N, N>; P],
    /// Differences of the last step, and of the batches since then.
    stepped: Spread,
    seen: Spread,
}

impl<const N: usize, const P: usize> Divided<N, P> {
    /// A filter that knows `state` to within `sigmas`, uncorrelated, whatever the parameters are.
    ///
    /// # Errors
    /// A number that is not finite; a weight that is negative.
    pub fn new(state: [f64; N], sigmas: &[f64; N], settings: Settings<N, P>) -> Result<Self, EstimatorError> {
        finite(Part::Start, &state)?;
        finite(Part::Start, sigmas)?;
        finite(Part::Start, &settings.parameters)?;
        if let Some(bad) = settings.weights.iter().find(|w| !(**w >= 0.0 && w.is_finite())) {
            return Err(EstimatorError::BadVariance(*bad));
        }
        let mut factor = SMatrix::<f64, N, N>::zeros();
        for (i, sigma) in sigmas.iter().enumerate() {
            if let Some(diagonal) = factor.get_mut((i, i)) {
                *diagonal = crate::math::num::abs(*sigma);
            }
        }
        Ok(Self {
            settings,
            state,
            factor,
            sensitivity: [[0.0; N]; P],
            factor_sensitivity: [SMatrix::zeros(); P],
            stepped: Spread::default(),
            seen: Spread::default(),
        })
    }

    /// The estimate.
    #[must_use]
    pub const fn state(&self) -> &[f64; N] {
        &self.state
    }

    /// Its settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings<N, P> {
        &self.settings
    }

    /// Chooses the order of what follows: what ARDDF does with a measure from elsewhere.
    pub const fn set_order(&mut self, order: Order) {
        self.settings.order = order;
    }

    /// ∂(estimate)/∂(parameter), a row each.
    #[must_use]
    pub const fn sensitivity(&self) -> &[[f64; N]; P] {
        &self.sensitivity
    }

    /// Lower triangular L with L Lᵀ = P + S W Sᵀ, the covariance with what the parameters add.
    #[must_use]
    pub fn factor(&self) -> SMatrix<f64, N, N> {
        let mut total = self.factor;
        for (column, weight) in self.sensitivity.iter().zip(&self.settings.weights) {
            add_column(&mut total, &column.map(|s| sqrt(*weight) * s));
        }
        total
    }

    /// Covariance of two components, P + S W Sᵀ; zero beyond the state.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let element = |i: usize, k: usize| self.factor.get((i, k)).copied().unwrap_or(0.0);
        let own: f64 = (0..N).map(|k| element(i, k) * element(j, k)).sum();
        let by_parameters = self.sensitivity.iter().zip(&self.settings.weights).map(|(column, weight)| {
            weight * column.get(i).copied().unwrap_or(0.0) * column.get(j).copied().unwrap_or(0.0)
        });
        own + by_parameters.sum::<f64>()
    }

    /// Standard deviation of a component.
    #[must_use]
    pub fn sigma(&self, i: usize) -> f64 {
        sqrt(self.covariance(i, i))
    }

    /// One step of the model, then independent noise of these standard deviations.
    ///
    /// # Errors
    /// The model has no finite value at a point, or an estimate leaves the range of numbers: nothing has changed then.
    #[inline(never)]
    pub fn predict<M: Process<N, P>>(
        &mut self,
        process: &M,
        step_s: f64,
        sigmas: &[f64; N],
    ) -> Result<Degree, EstimatorError> {
        finite(Part::ProcessNoise, sigmas)?;
        let map = Stepped { process, step_s };
        let (mut factor, mut second) = (SMatrix::<f64, N, N>::zeros(), SMatrix::<f64, N, N>::zeros());
        let (mut half, mut middle) = ([SMatrix::zeros(); P], Middle::nothing());
        let units = |_: &[f64; N]| Ok(self.settings.units);
        let visit = |p: usize, column: &Column<N, P>| {
            factor.set_column(p, &column.first.into());
            second.set_column(p, &column.second.into());
            sensitivity::gather(&mut half, column);
        };
        let (degree, stepped) = self.differences(&map, units, &self.seen, Part::Prediction, &mut middle, visit)?;
        tria(&mut factor);
        add_independent(&mut factor, sigmas);
        if degree.is_second {
            add_columns(&mut factor, &second);
        }
        let is_full = self.is_full(degree);
        self.accept(&factor, &mut half, is_full)?;
        self.state = if degree.is_second { middle.mean } else { middle.centre };
        self.sensitivity = if is_full { middle.mean_by } else { middle.by };
        (self.stepped, self.seen) = (stepped, Spread::default());
        Ok(degree)
    }

    /// Whether the factor's sensitivities follow an operation of this degree.
    fn is_full(&self, degree: Degree) -> bool {
        self.settings.sensitivities == Sensitivities::Full && degree.is_second
    }

    /// Takes over a factor and, if `is_full`, its sensitivities from what [`sensitivity::gather`] gathered.
    #[inline(never)]
    fn accept(
        &mut self,
        factor: &SMatrix<f64, N, N>,
        half: &mut [SMatrix<f64, N, N>; P],
        is_full: bool,
    ) -> Result<(), EstimatorError> {
        finite(Part::Covariance, factor.as_slice())?;
        if is_full {
            sensitivity::of_factor(factor, half)?;
        }
        self.factor = *factor;
        for (to, from) in self.factor_sensitivity.iter_mut().zip(half) {
            if is_full {
                *to = *from;
            } else {
                to.fill(0.0);
            }
        }
        Ok(())
    }

    /// All differences of a map about the estimate, and which of them count; `units` of its results, given the value
    /// there; `others` are differences that are judged with them. `middle` takes what all points together tell; `visit` is
    /// told every column, under [`Order::Measured`] with full sensitivities possibly again, then with its derivatives.
    fn differences<F, const O: usize>(
        &self,
        map: &F,
        units: impl Fn(&[f64; O]) -> Result<[f64; O], EstimatorError>,
        others: &Spread,
        part: Part,
        middle: &mut Middle<O, P>,
        mut visit: impl FnMut(usize, &Column<O, P>),
    ) -> Result<(Degree, Spread), EstimatorError>
    where
        F: Map<N, P, O>,
    {
        let wanted = match (self.settings.sensitivities, self.settings.order) {
            (Sensitivities::None, _) => Detail::Values,
            (Sensitivities::Full, Order::Second) => Detail::Everywhere,
            _ => Detail::Middle,
        };
        self.scan(map, wanted, part, middle, &mut visit)?;
        let spread = middle.spread(&units(&middle.centre)?);
        let nonlinearity = spread.with(others).nonlinearity();
        let is_second = match self.settings.order {
            Order::First => false,
            Order::Second => true,
            Order::Measured { threshold } => nonlinearity > threshold,
        };
        let degree = Degree { nonlinearity, is_second };
        if self.is_full(degree) && wanted != Detail::Everywhere {
            self.scan(map, Detail::Everywhere, part, middle, &mut visit)?;
        }
        Ok((degree, spread))
    }
}

/// Adds noise that is independent in every component.
fn add_independent<const N: usize>(factor: &mut SMatrix<f64, N, N>, sigmas: &[f64; N]) {
    for (i, &sigma) in sigmas.iter().enumerate() {
        let mut column = [0.0; N];
        column.iter_mut().skip(i).take(1).for_each(|c| *c = sigma);
        add_column(factor, &column);
    }
}

/// Adds columns: the factor of factor·factorᵀ + columns·columnsᵀ.
fn add_columns<const N: usize, const C: usize>(factor: &mut SMatrix<f64, N, N>, columns: &SMatrix<f64, N, C>) {
    for column in columns.column_iter() {
        let mut added = [0.0; N];
        added.iter_mut().zip(column.iter()).for_each(|(to, from)| *to = *from);
        add_column(factor, &added);
    }
}

#[cfg(test)]
mod tests;
