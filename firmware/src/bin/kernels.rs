//! Kernels whose cycle counts on a real Cortex-M7 are public, each a frame of the meter: the checks of the cycle
//! estimate (`doc/cycles.md`).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    #[cfg(target_arch = "arm")]
    kernels::run();
    firmware::job::exit(firmware::job::DONE)
}

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(all(target_os = "none", target_arch = "arm"))]
mod kernels {
    use core::arch::asm;
    use core::hint::black_box;

    use fsw_core::probe::{Counter, FrameMeter, Meter, Probe};
    use static_cell::ConstStaticCell;

    /// Frames are found by the meter's calls; nothing needs to be counted here.
    struct Uncounted;

    impl Counter for Uncounted {
        fn restart(&mut self) {}

        fn read(&mut self) -> u32 {
            black_box(0)
        }
    }

    /// A function that repeats some lines of assembly 20 times in a loop of 100.
    macro_rules! repeated {
        ($name:ident, $($line:literal),+) => {
            #[inline(never)]
            fn $name() {
                // SAFETY: the lines work on registers only, and all that they change is declared.
                unsafe {
                    asm!(
                        "movs r0, #100",
                        "2:",
                        ".rept 20",
                        $($line,)+
                        ".endr",
                        "subs r0, #1",
                        "bne.w 2b",
                        out("r0") _, out("d0") _, out("d1") _, out("d2") _, out("d3") _, out("d4") _, out("d5") _, out("d6") _, out("d7") _,
                        out("d8") _, out("d9") _, out("d10") _, out("d11") _, out("d12") _, out("d13") _, out("d14") _, out("d15") _,
                        options(nostack, nomem)
                    );
                }
            }
        };
    }

    repeated!(
        add_independent,
        "vadd.f64 d0, d8, d9",
        "vadd.f64 d1, d8, d9",
        "vadd.f64 d2, d8, d9",
        "vadd.f64 d3, d8, d9"
    );
    repeated!(add_chain, "vadd.f64 d0, d0, d9", "vadd.f64 d0, d0, d9", "vadd.f64 d0, d0, d9", "vadd.f64 d0, d0, d9");
    repeated!(
        mul_independent,
        "vmul.f64 d0, d8, d9",
        "vmul.f64 d1, d8, d9",
        "vmul.f64 d2, d8, d9",
        "vmul.f64 d3, d8, d9"
    );
    repeated!(
        div_independent,
        "vdiv.f64 d0, d8, d9",
        "vdiv.f64 d1, d8, d9",
        "vdiv.f64 d2, d8, d9",
        "vdiv.f64 d3, d8, d9"
    );
    repeated!(accumulate, "vmla.f64 d0, d8, d9", "vmla.f64 d1, d8, d9", "vmla.f64 d2, d8, d9", "vmla.f64 d3, d8, d9");
    repeated!(
        low_pass_single,
        "vsub.f32 s2, s4, s0",
        "vfma.f32 s0, s2, s6",
        "vsub.f32 s2, s4, s0",
        "vfma.f32 s0, s2, s6"
    );

    /// Order of the Linpack problem.
    const ORDER: usize = 50;
    /// Sines of 0, 1, 2, …
    const SINES: usize = 400;
    type Matrix = [[f64; ORDER]; ORDER];

    /// Linpack's test matrix, column by column, and the right-hand side whose solution is all ones.
    fn matgen(a: &mut Matrix, b: &mut [f64; ORDER]) {
        let mut seed = 1325_i32;
        *b = [0.0; ORDER];
        for column in a.iter_mut() {
            for (value, sum) in column.iter_mut().zip(b.iter_mut()) {
                seed = 3125 * seed % 65536;
                *value = (f64::from(seed) - 32768.0) / 16384.0;
                *sum += *value;
            }
        }
    }

    #[inline(never)]
    fn daxpy(factor: f64, x: &[f64], y: &mut [f64]) {
        for (y, x) in y.iter_mut().zip(x) {
            *y += factor * x;
        }
    }

    /// Linpack's `dgefa`: Gaussian elimination with partial pivoting.
    fn factor(a: &mut Matrix, pivots: &mut [usize; ORDER]) {
        for k in 0..ORDER - 1 {
            let mut l = k;
            for i in k + 1..ORDER {
                if a[k][i].abs() > a[k][l].abs() {
                    l = i;
                }
            }
            pivots[k] = l;
            a[k].swap(k, l);
            let scale = -1.0 / a[k][k];
            for value in &mut a[k][k + 1..] {
                *value *= scale;
            }
            let (done, rest) = a.split_at_mut(k + 1);
            for column in rest {
                column.swap(l, k);
                let pivot = column[k];
                daxpy(pivot, &done[k][k + 1..], &mut column[k + 1..]);
            }
        }
        pivots[ORDER - 1] = ORDER - 1;
    }

    /// Linpack's `dgesl`.
    fn solve(a: &Matrix, pivots: &[usize; ORDER], b: &mut [f64; ORDER]) {
        for k in 0..ORDER - 1 {
            b.swap(pivots[k], k);
            let value = b[k];
            daxpy(value, &a[k][k + 1..], &mut b[k + 1..]);
        }
        for k in (0..ORDER).rev() {
            b[k] /= a[k][k];
            let value = -b[k];
            daxpy(value, &a[k][..k], &mut b[..k]);
        }
    }

    /// Too large for the stack.
    static MATRIX: ConstStaticCell<Matrix> = ConstStaticCell::new([[0.0; ORDER]; ORDER]);

    /// Runs all kernels, in the order of the table in `doc/cycles.md`.
    pub fn run() {
        let mut meter = FrameMeter::new(Uncounted);
        let mut measure = |kernel: &mut dyn FnMut()| {
            meter.resume();
            kernel();
            meter.frame_done();
            meter.pause();
        };
        for kernel in [add_independent, add_chain, mul_independent, div_independent, accumulate, low_pass_single] {
            measure(&mut || kernel());
        }
        let a = MATRIX.take();
        let (mut b, mut pivots) = ([0.0; ORDER], [0; ORDER]);
        matgen(a, &mut b);
        measure(&mut || {
            factor(a, &mut pivots);
            solve(a, &pivots, &mut b);
        });
        black_box(&b);
        let mut sines = [0.0; SINES];
        measure(&mut || {
            for (i, sine) in (0_u32..).zip(&mut sines) {
                *sine = fsw_core::math::fun::sin(f64::from(i));
            }
        });
        black_box(&sines);
    }
}
