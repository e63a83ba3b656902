//! [`Joint`]: which quantities a linearised filter carries, in what order, and their derivatives from the model.
//!
//! The joint state of `J` numbers begins with the vehicle's state (`N`). Blocks may follow, anywhere behind it and in any
//! order: an unknown input b that adds to each state in each step, the model's parameters α, a constant bias of a sensor
//! triad. What is carried need not be estimated: the kernel's [`Gain`](super::linear::Gain) of a component decides that.

use super::models::{AXES, Measurement, Process};
use super::{EstimatorError, Part, finite};
use crate::math::Dual;

/// A block of the joint state that keeps its value, or fades, from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Its first component.
    pub first: usize,
    /// What remains of it after a step: 1 for a constant or a random walk, e^(−Δt/τ) for a Gauss–Markov process.
    pub persistence: f64,
}

impl Block {
    /// A block that keeps its value.
    #[must_use]
    pub const fn constant(first: usize) -> Self {
        Self { first, persistence: 1.0 }
    }
}

/// What follows the vehicle's state. No block: a plain EKF.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layout {
    /// Unknown input b (`N` components): x' = F(x, α) + s·b, with s the second number: 1 when b is an increment of a step
    /// (SEKF), the step's length when b is a rate.
    pub input: Option<(Block, f64)>,
    /// Errors of the model's parameters (`P` components), which otherwise are the constants of the [`Joint`].
    pub parameters: Option<Block>,
    /// Constant bias of a triad (3 components), for measurements that name a bias axis.
    pub bias: Option<Block>,
}

/// Derivatives of a step: rows of the vehicle's state in full; the components behind it only fade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition<const N: usize, const J: usize> {
    /// The joint state after the step.
    pub next: [f64; J],
    /// ∂(vehicle's state after)/∂(joint state before).
    pub rows: [[f64; J]; N],
    /// Factor of each component behind the vehicle's state (those before are unused).
    pub persistence: [f64; J],
}

/// A measurement as a kernel sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen<const J: usize> {
    /// What it should read.
    pub expected: f64,
    /// ∂(expected)/∂(joint state).
    pub row: [f64; J],
}

/// Derivatives found in one pass through a model. All at once would be a fifth faster; but each number of the model then takes
/// twice the stack, of which a flight computer has little, and the passes give the same bits.
const LANES: usize = 4;

/// A model as the joint state sees it. `W` is the width of the derivatives: `N`, or `N + P` when parameters are carried.
#[derive(Clone, Copy, Debug)]
pub struct Joint<'a, M, const N: usize, const P: usize, const W: usize> {
    /// The model.
    pub model: &'a M,
    /// Parameters where they are not carried.
    pub parameters: [f64; P],
    /// What is carried.
    pub layout: Layout,
}

impl<M: Process<N, P>, const N: usize, const P: usize, const W: usize> Joint<'_, M, N, P, W> {
    /// Ok when every block lies behind the vehicle's state and within `J`, and `W` is wide enough for what is carried.
    ///
    /// # Errors
    /// The block that does not, or the parameters when `W` has no room for their derivatives.
    pub fn check<const J: usize>(&self) -> Result<(), EstimatorError> {
        const { assert!(W == N || W == N + P, "derivatives are N wide, or N + P where parameters are carried") };
        let small = |n: usize| u8::try_from(n).unwrap_or(u8::MAX);
        let refuse = |first, size, joint| {
            Err(EstimatorError::BadLayout { first: small(first), size: small(size), joint: small(joint) })
        };
        if self.layout.parameters.is_some() && W != N + P {
            return refuse(N, P, W);
        }
        match self.blocks().find(|(block, size)| block.first < N || block.first.saturating_add(*size) > J) {
            Some((block, size)) => refuse(block.first, size, J),
            None => Ok(()),
        }
    }

    /// State and parameters, [`LANES`] of them from number `first` on as independent variables: state i is number i,
    /// parameter j, if it is carried, N + j.
    fn seeded<const J: usize>(&self, joint: &[f64; J], first: usize) -> ([Dual<LANES>; N], [Dual<LANES>; P]) {
        let seed = |value: f64, number: usize| match number.checked_sub(first) {
            Some(lane) => Dual::variable(value, lane),
            None => Dual::constant(value),
        };
        let mut state = [Dual::constant(0.0); N];
        for (i, (x, &value)) in state.iter_mut().zip(joint).enumerate() {
            *x = seed(value, i);
        }
        let mut parameters = self.parameters.map(Dual::constant);
        if let Some(block) = self.layout.parameters {
            for (j, (alpha, &value)) in parameters.iter_mut().zip(joint.iter().skip(block.first)).enumerate() {
                *alpha = seed(value, N + j);
            }
        }
        (state, parameters)
    }

    /// Numbers of the first variable of each pass.
    fn passes() -> impl Iterator<Item = usize> {
        (0..W).step_by(LANES)
    }

    /// One step of the joint state with its derivatives.
    ///
    /// # Errors
    /// The model has no finite value or derivative here.
    #[inline(never)]
    pub fn step<const J: usize>(&self, joint: &[f64; J], step_s: f64) -> Result<Transition<N, J>, EstimatorError> {
        let mut transition = Transition { next: *joint, rows: [[0.0; J]; N], persistence: [1.0; J] };
        for first in Self::passes() {
            let (state, parameters) = self.seeded(joint, first);
            let moved = self.model.step(&state, &parameters, step_s);
            for ((row, next), dual) in transition.rows.iter_mut().zip(&mut transition.next).zip(&moved) {
                self.spread(&dual.partials, first, row);
                *next = dual.value;
            }
        }
        self.completed(joint, transition)
    }

    /// What a measurement should read, with its derivatives.
    ///
    /// # Errors
    /// The measurement has no finite value or derivative here.
    #[inline(never)]
    pub fn see<Z: Measurement<N, P>, const J: usize>(
        &self,
        sensor: &Z,
        joint: &[f64; J],
    ) -> Result<Seen<J>, EstimatorError> {
        let mut seen = Seen { expected: 0.0, row: [0.0; J] };
        for first in Self::passes() {
            let (state, parameters) = self.seeded(joint, first);
            let dual = sensor.expected(&state, &parameters);
            self.spread(&dual.partials, first, &mut seen.row);
            seen.expected = dual.value;
        }
        self.biased(joint, sensor.bias_axis(), seen)
    }
}

/// What does not ask the model: it may be given with derivatives found elsewhere.
impl<M, const N: usize, const P: usize, const W: usize> Joint<'_, M, N, P, W> {
    /// A step of the joint state, given that of the vehicle and its derivatives by state and parameters.
    ///
    /// # Errors
    /// A number that is not finite.
    #[inline(never)]
    pub fn step_of<const J: usize>(
        &self,
        joint: &[f64; J],
        next: &[f64; N],
        rows: &[[f64; W]; N],
    ) -> Result<Transition<N, J>, EstimatorError> {
        let mut transition = Transition { next: *joint, rows: [[0.0; J]; N], persistence: [1.0; J] };
        transition.next.iter_mut().zip(next).for_each(|(to, from)| *to = *from);
        for (to, from) in transition.rows.iter_mut().zip(rows) {
            self.spread(from, 0, to);
        }
        self.completed(joint, transition)
    }

    /// A measurement of the joint state, given that of the vehicle and its derivatives by state and parameters.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn seen_of<const J: usize>(
        &self,
        joint: &[f64; J],
        expected: f64,
        row: &[f64; W],
        bias_axis: Option<usize>,
    ) -> Result<Seen<J>, EstimatorError> {
        let mut seen = Seen { expected, row: [0.0; J] };
        self.spread(row, 0, &mut seen.row);
        self.biased(joint, bias_axis, seen)
    }

    /// Puts derivatives, by number `first` and those that follow, where they belong in the row of the joint state.
    fn spread<const J: usize>(&self, partials: &[f64], first: usize, row: &mut [f64; J]) {
        for (lane, partial) in partials.iter().enumerate() {
            let number = first + lane;
            let at = match self.layout.parameters {
                _ if number < N => number,
                Some(block) if number < N + P => block.first + number - N,
                _ => continue,
            };
            if let Some(out) = row.get_mut(at) {
                *out = *partial;
            }
        }
    }

    /// What the layout adds to the step of the vehicle.
    fn completed<const J: usize>(
        &self,
        joint: &[f64; J],
        mut transition: Transition<N, J>,
    ) -> Result<Transition<N, J>, EstimatorError> {
        if let Some((block, scale)) = self.layout.input {
            for (i, (row, next)) in transition.rows.iter_mut().zip(&mut transition.next).enumerate() {
                let Some((input, by_input)) = joint.get(block.first + i).zip(row.get_mut(block.first + i)) else {
                    continue;
                };
                *next += scale * input;
                *by_input = scale;
            }
        }
        for (block, size) in self.blocks() {
            let fading = transition.next.iter_mut().zip(&mut transition.persistence).skip(block.first).take(size);
            for (next, persistence) in fading {
                *persistence = block.persistence;
                *next *= block.persistence;
            }
        }
        finite(Part::Prediction, &transition.next)?;
        transition.rows.iter().try_for_each(|row| finite(Part::Transition, row))?;
        Ok(transition)
    }

    /// The blocks that are carried, with their sizes.
    fn blocks(&self) -> impl Iterator<Item = (Block, usize)> {
        let all =
            [(self.layout.input.map(|(block, _)| block), N), (self.layout.parameters, P), (self.layout.bias, AXES)];
        all.into_iter().filter_map(|(block, size)| Some((block?, size)))
    }

    /// What the bias adds to a measurement.
    fn biased<const J: usize>(
        &self,
        joint: &[f64; J],
        bias_axis: Option<usize>,
        mut seen: Seen<J>,
    ) -> Result<Seen<J>, EstimatorError> {
        if let Some((block, axis)) = self.layout.bias.zip(bias_axis) {
            let at = block.first.saturating_add(axis);
            if let Some((bias, by_bias)) = joint.get(at).zip(seen.row.get_mut(at)) {
                seen.expected += bias;
                *by_bias = 1.0;
            }
        }
        finite(Part::Measurement, &seen.row)?;
        finite(Part::Measurement, &[seen.expected])?;
        Ok(seen)
    }
}
