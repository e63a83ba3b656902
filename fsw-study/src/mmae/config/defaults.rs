//! P3's numbers, and what is flown where P3 gives none.

use alloc::vec;

use super::*;

impl Default for Filters {
    fn default() -> Self {
        Self { fly: FilterName::ALL.to_vec() }
    }
}

impl Default for Entry {
    fn default() -> Self {
        Self {
            position_m: [-2_102_033.0, 2_816_074.0, -238_991.0],
            velocity_mps: [994.910, -781.820, 5_950.410],
            deviation_m: [1_015.0, 604.0, 1_714.0],
            deviation_mps: [2.149, 0.667, 0.106],
        }
    }
}

impl Default for Flight {
    fn default() -> Self {
        Self {
            step_s: 0.1,
            truth_substeps: 5,
            deploy_mps: 406.0,
            bank_deg: 0.0,
            longest_s: 600.0,
            record_s: 2.0,
            divergence_m: 20_000.0,
        }
    }
}

impl Default for World {
    fn default() -> Self {
        Self {
            mu_m3ps2: 4.2828e13,
            spin_radps: 7.0882e-5,
            density_kgpm3: 2e-4,
            reference_radius_m: 3_437_200.0,
            scale_height_m: 7_500.0,
            ballistic_kgpm2: 146.0,
            lift_to_drag: 0.24,
        }
    }
}

impl Default for Orbiter {
    fn default() -> Self {
        Self { radius_m: 3.7e6, inclination_deg: 90.0, node_deg: 127.3, argument_deg: 355.0 }
    }
}

impl Default for Sensors {
    fn default() -> Self {
        Self { pressure_share: 0.05, accelerometer_ug: 3_000.0, range_m: 100.0, range_rate_mps: 0.1 }
    }
}

impl Default for Density {
    fn default() -> Self {
        Self { law: Law::Uniform, width: 0.1 }
    }
}

impl Default for Models {
    fn default() -> Self {
        let fine = (-10..=10).map(|hundredths| 0.01 * f64::from(hundredths));
        Self {
            densities: vec![-0.10, -0.06, -0.02, 0.0, 0.02, 0.06, 0.10],
            fine_densities: fine.collect(),
            rates: vec![0.01, 0.1, 1.0],
            noise_mpsps: 0.0,
            floor: 0.0,
            stay: 0.999,
            scales: [636.0, 3.711, 3_389_500.0, 3_546.6],
        }
    }
}

impl Default for Augmented {
    fn default() -> Self {
        // The prior's 0.058 with the waves' 0.014 on it; within a minute, that of the peak load, the process walks as far as waves go.
        Self { walk_psqrts: 0.0, experts: 7, markov_sigma: 0.06, markov_s: 3_000.0, bias_ug: 3_000.0 }
    }
}

impl Default for Fixed {
    fn default() -> Self {
        Self { density: 0.095, rates: [0.1, 0.01], reading: Reading::A, rate_hz: 10.0 }
    }
}

impl Default for Table5 {
    fn default() -> Self {
        Self { rates: [1.0, 0.1], reading: Reading::B, rate_hz: 1.0 }
    }
}

impl Default for Rated {
    fn default() -> Self {
        Self { reading: Reading::A, rate_hz: 10.0 }
    }
}

impl Default for Efficiency {
    fn default() -> Self {
        Self { share_of_runs: 5.0 }
    }
}

impl Default for Robust {
    fn default() -> Self {
        Self { wave: 0.02, wavelength_m: 10_000.0, bias_ug: 3_000.0, share_of_runs: 1.0 }
    }
}
