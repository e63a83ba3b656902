//! Random numbers: one independent stream for every (seed, run, purpose).
//!
//! The key of a stream is made of nothing but the seed, the run number and the name of what it is for, so that one
//! quantity's draw never shifts another's, and run k of a seed is the same whatever flew before it.
//!
//! Without std, so that a flight processor can draw the very runs that a study flies on a host.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

use core::f64::consts::PI;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl Stream {
    /// The stream of a seed, a run and a purpose.
    #[must_use]
    pub fn new(seed: u64, run: u64, purpose: &str) -> Self {
        let mut key = [0u8; 32];
        let words = [seed, run, fnv1a(purpose, 0xcbf2_9ce4_8422_2325), fnv1a(purpose, 0x6c62_272e_07bb_0142)];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Self { generator: ChaCha8Rng::from_seed(key), spare: None }
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Standard normal, by the transformation of Box and Muller (1958) with `libm` functions: the same bits everywhere.
    pub fn normal(&mut self) -> f64 {
        if let Some(second) = self.spare.take() {
            return second;
        }
        // 1 − u lies in (0, 1]: the logarithm is finite.
        let radius = fsw_sqrt::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        let (sine, cosine) = libm::sincos(2.0 * PI * self.uniform());
        self.spare = Some(radius * sine);
        radius * cosine
    }

    /// Three independent standard normals.
    pub fn normal3(&mut self) -> [f64; 3] {
        [self.normal(), self.normal(), self.normal()]
    }
}

/// FNV-1a over the bytes of a name: enough to tell purposes apart, not a cryptographic hash.
fn fnv1a(name: &str, basis: u64) -> u64 {
    name.bytes().fold(basis, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_depends_on_seed_run_and_purpose_and_on_nothing_else() {
        let first = |seed, run, purpose| Stream::new(seed, run, purpose).uniform();
        assert_eq!(first(1, 2, "a"), first(1, 2, "a"));
        for other in [first(2, 2, "a"), first(1, 3, "a"), first(1, 2, "b")] {
            assert_ne!(first(1, 2, "a"), other);
        }
    }

    #[test]
    fn normals_have_the_moments_and_the_tails_of_a_normal() {
        let mut stream = Stream::new(7, 0, "moments");
        let n = 200_000;
        let (mut sum, mut square, mut fourth, mut beyond) = (0.0, 0.0, 0.0, 0);
        for _ in 0..n {
            let x = stream.normal();
            sum += x;
            square += x * x;
            fourth += x * x * x * x;
            beyond += i32::from(x.abs() > 3.0);
        }
        let n = f64::from(n);
        // Four standard errors each: 1/√n, √(2/n), √(96/n), √(p/n) with p = 0.0027.
        assert!((sum / n).abs() < 4.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((fourth / n - 3.0).abs() < 4.0 * (96.0 / n).sqrt());
        assert!((f64::from(beyond) / n - 0.0027).abs() < 4.0 * (0.0027 / n).sqrt());
    }
}
