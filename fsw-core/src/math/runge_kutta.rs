//! [`rk4`]: the classical fourth-order Runge–Kutta step.

use super::Scalar;

/// The state one step of `step_s` later. `rates(offset_s, state)` is the derivative of the state at `offset_s` after the
/// start of the step (0, half a step, a whole step), so that the bank may follow a profile within the step.
///
/// Four evaluations; local error of fifth order in the step. A negative step integrates backwards.
#[inline]
pub fn rk4<S, const N: usize, F>(state: &[S; N], step_s: f64, mut rates: F) -> [S; N]
where
    S: Scalar,
    F: FnMut(f64, &[S; N]) -> [S; N],
{
    let half_s = 0.5 * step_s;
    let k1 = rates(0.0, state);
    let k2 = rates(half_s, &moved(state, &k1, half_s));
    let k3 = rates(half_s, &moved(state, &k2, half_s));
    let k4 = rates(step_s, &moved(state, &k3, step_s));
    let sixth_s = step_s * (1.0 / 6.0);
    let mut next = *state;
    for ((((x, a), b), c), d) in next.iter_mut().zip(&k1).zip(&k2).zip(&k3).zip(&k4) {
        let middle = *b + *c;
        *x = *x + (*a + (middle + middle) + *d) * sixth_s;
    }
    next
}

/// `state + rates · duration`.
#[inline(always)]
fn moved<S: Scalar, const N: usize>(state: &[S; N], rates: &[S; N], duration_s: f64) -> [S; N] {
    let mut next = *state;
    for (x, k) in next.iter_mut().zip(rates) {
        *x = *x + *k * duration_s;
    }
    next
}
