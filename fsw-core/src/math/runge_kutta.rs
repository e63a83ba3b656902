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

#[cfg(test)]
mod tests {
    use super::*;

    fn oscillator(steps: u32) -> [f64; 2] {
        let step_s = 2.0 / f64::from(steps);
        (0..steps).fold([1.0, 0.0], |state, _| rk4(&state, step_s, |_, &[x, v]| [v, -x]))
    }

    #[test]
    fn halving_the_step_divides_the_error_by_sixteen() {
        let error = |steps| (oscillator(steps)[0] - 2.0_f64.cos()).abs();
        let ratio = error(20) / error(40);
        // Fourth order: 16 in the limit, 15.5–16.5 at these steps.
        assert!((15.0..17.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_cubic_in_time_is_integrated_exactly() {
        // Simpson's rule is exact for cubics: x' = t³ from 0 to 2 is 4.
        let [x] = rk4(&[0.0_f64], 2.0, |t, _| [t * t * t]);
        assert!((x - 4.0).abs() < 1e-14);
    }

    #[test]
    fn a_negative_step_comes_back() {
        let rates = |_, &[x, v]: &[f64; 2]| [v, -x];
        let there = rk4(&[1.0, 0.5], 0.01, rates);
        let [x, v] = rk4(&there, -0.01, rates);
        // Local error of fifth order: 0.01⁵ = 1e-10, of which 1/120 remains.
        assert!((x - 1.0).abs() < 1e-11 && (v - 0.5).abs() < 1e-11);
    }
}
