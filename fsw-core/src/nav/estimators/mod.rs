//! The filters of the papers and those that surpass them: each family one kernel, over models that are written once.
//!
//! * [`models`] how a vehicle moves and what sensors read; generic in the scalar, so derivatives are exact.
//! * [`joint`] from a model to the joint state that a linearised filter estimates: vehicle, unknown input, parameters, sensor
//!   bias. * [`linear`] the linearised kernel: EKF, SEKF and its ρ variant, augmented EKFs, Schmidt's consider filter. They
//!   differ in the layout of the joint state and in one [`Gain`](linear::Gain) for each of its components, in nothing else.
//! * [`bank`] several linearised filters side by side, of which the readings tell which to believe: P3's mixture of experts and
//!   its rivals. * [`weights`] the rules by which they are believed.
//! * [`divided`] the divided-difference kernel: DDF1, DDF2, their desensitized forms RDDF1 and RDDF2, and ARDDF, which
//!   chooses the order by the degree of nonlinearity.
//!
//! Covariances are kept as triangular factors, so that no rounding can make them indefinite, and every number that a kernel
//! would take in is looked at before: a filter that cannot go on says so by an [`EstimatorError`] and keeps its last
//! sound state. Nothing that is not finite ever comes out.

pub mod bank;
pub mod divided;
pub mod joint;
pub mod linear;
pub mod models;
pub mod weights;

/// Why an estimator cannot take a step. What it held before the step is untouched, if the step was refused on its way in.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EstimatorError {
    /// A number is not finite: the model has no value here, or the estimate has run away.
    NotFinite {
        /// Of what.
        part: Part,
        /// Which component.
        component: u8,
    },
    /// The variance of a measurement, or of an innovation, is not positive and finite.
    BadVariance(f64),
    /// More measurements at once than there is room for.
    TooMany {
        /// How many.
        given: usize,
        /// How many there is room for.
        room: usize,
    },
    /// A block of the joint state overlaps the vehicle's state, or lies beyond the end.
    BadLayout {
        /// First component of the block.
        first: u8,
        /// Size of the block.
        size: u8,
        /// Size of the joint state.
        joint: u8,
    },
}

/// Where a number that is not finite was met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Part {
    /// Initial state or its deviations.
    Start,
    /// The state a step later.
    Prediction,
    /// Its derivatives.
    Transition,
    /// Process noise.
    ProcessNoise,
    /// An innovation or the derivatives of its measurement.
    Measurement,
    /// The estimate.
    Estimate,
    /// The factor of the covariance.
    Covariance,
}

impl core::fmt::Display for EstimatorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite { part, component } => write!(f, "component {component} of {part:?} is not finite"),
            Self::BadVariance(value) => write!(f, "a variance must be above 0 and finite, not {value}"),
            Self::TooMany { given, room } => write!(f, "{given} measurements at once, there is room for {room}"),
            Self::BadLayout { first, size, joint } => {
                write!(f, "a block of {size} at {first} does not fit into a joint state of {joint}")
            }
        }
    }
}

impl core::error::Error for EstimatorError {}

/// Ok when every number is finite; else the component that is not.
pub(crate) fn finite(part: Part, values: &[f64]) -> Result<(), EstimatorError> {
    // A sum is finite only where all its terms are; which is not, and whether it is only the sum, is asked after that.
    if values.iter().sum::<f64>().is_finite() {
        return Ok(());
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Err(EstimatorError::NotFinite { part, component: u8::try_from(at).unwrap_or(u8::MAX) }),
    }
}
