//! Tables of the guidance modes `apollo` and `segmented-table`. Made by
//! `aeroshell guidance-tables msl --set planet.rotation_radps=0 --set planet.j2=0`;
//! do not edit.

/// What the onboard model was that these tables were made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MadeWith {
    /// Speed at which the parachute fires, m/s.
    pub trigger_speed_mps: f32,
    /// Lift over drag.
    pub lift_to_drag: f32,
    /// Altitude (m) and drag over the square of the speed (1/m).
    pub drag: [[f32; 2]; 3],
}

/// The onboard model of these tables.
pub const MADE_WITH: MadeWith = MadeWith {
    trigger_speed_mps: 450.0,
    lift_to_drag: 0.2400,
    drag: [[10000.0, 2.2301e-5], [15000.0, 1.3067e-5], [30000.0, 2.6288e-6]],
};

/// Cosine of the constant bank of the reference flight, 41.459°.
pub const REFERENCE_COS_BANK: f64 = 0.749427;
/// Speed (m/s), range to go (m), drag (m/s²), altitude rate (m/s), ∂R/∂D (s²), ∂R/∂ḣ (s), ∂R/∂cos σ (m).
pub type ReferenceRow = [f32; 7];
/// The reference flight by increasing speed; rows stand where the flight bends.
pub const REFERENCE: [ReferenceRow; 24] = [
    [500.4, 5231.6, 5.5739, -170.71, -1079.3, 0.3, -7.1],
    [530.9, 8632.3, 5.5332, -164.65, -1639.4, 4.3, 15.9],
    [579.8, 14458.4, 5.4745, -152.81, -2426.1, 14.4, 156.1],
    [620.8, 19668.0, 5.4476, -141.19, -2993.7, 25.6, 403.9],
    [672.4, 26583.5, 5.4641, -124.94, -3596.7, 41.8, 913.5],
    [746.5, 37008.5, 5.6221, -99.89, -4245.7, 67.6, 2060.6],
    [844.6, 51111.1, 6.1275, -66.98, -4720.2, 103.3, 4340.0],
    [1019.2, 74958.3, 7.9272, -18.47, -4746.2, 162.9, 10411.6],
    [1122.9, 87638.0, 9.5237, 2.05, -4501.4, 193.6, 15116.9],
    [1251.3, 101658.9, 11.9954, 19.32, -4119.4, 226.4, 21931.3],
    [1386.6, 114611.7, 15.1234, 29.26, -3716.9, 255.0, 30128.0],
    [1560.4, 129031.1, 19.8087, 32.21, -3259.0, 284.7, 41933.2],
    [1765.8, 143623.5, 26.0961, 24.78, -2819.0, 311.5, 57340.9],
    [2005.1, 158268.2, 34.1168, 4.88, -2423.5, 335.0, 76813.0],
    [2795.0, 197045.5, 61.1143, -118.71, -1672.6, 380.3, 148245.5],
    [4049.8, 252256.5, 80.0664, -435.43, -1335.7, 424.2, 273911.9],
    [4991.0, 313496.4, 49.3146, -760.05, -1908.8, 484.0, 378034.3],
    [5197.5, 338093.8, 34.7580, -849.06, -2567.5, 514.1, 403343.7],
    [5337.1, 363561.5, 22.8277, -919.43, -3735.3, 548.2, 421616.4],
    [5425.2, 389585.2, 14.2103, -974.36, -5793.1, 585.4, 434053.2],
    [5469.3, 410643.8, 9.4466, -1010.04, -8534.5, 616.8, 440802.1],
    [5497.4, 431821.4, 6.1553, -1040.49, -12897.4, 649.3, 445472.6],
    [5514.5, 453058.3, 3.9463, -1067.28, -19894.2, 682.6, 448643.6],
    [5527.4, 484939.7, 1.9762, -1103.03, -39293.2, 733.6, 451533.4],
];

/// Terms of the polynomials of [`Segment`], in the order of [`terms`](super::segments::terms).
pub const REMAINDER_TERMS: usize = 13;

/// A waypoint, and the range still flown from its speed to the parachute trigger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Longitude, rad.
    pub longitude_rad: f32,
    /// Planetocentric latitude, rad.
    pub latitude_rad: f32,
    /// Speed of the reference flight abeam, m/s.
    pub speed_mps: f32,
    /// Centre and reach, either way, of altitude (m), flight-path angle (rad), cosine of the bank and log-density.
    pub validity: [(f32, f32); 4],
    /// Coefficients, m.
    pub coefficients: [f32; REMAINDER_TERMS],
}

/// P4's waypoints, in the order of the flight.
pub const SEGMENTS: [Segment; 3] = [
    Segment {
        longitude_rad: -1.46608,
        latitude_rad: -0.75468,
        speed_mps: 5526.05,
        validity: [(63554.4, 3000.0), (-0.199906, 0.015), (0.3215, 0.6635), (0.0, 0.3)],
        coefficients: [
            359163.0, 22492.8, 44515.6, 148889.0, 294.085, 3513.79, 5863.48, 5078.18, 30687.2, 98934.5, -19745.9,
            -606.219, -7968.65,
        ],
    },
    Segment {
        longitude_rad: -1.39626,
        latitude_rad: -0.74543,
        speed_mps: 4892.8,
        validity: [(31244.7, 4000.0), (-0.147947, 0.03), (0.3215, 0.6635), (0.0, 0.3)],
        coefficients: [
            202671.0, 35091.0, 48830.9, 126169.0, 531.007, 9333.86, 14267.7, 8650.32, 41008.8, 79581.0, -23562.7,
            -832.962, -11903.4,
        ],
    },
    Segment {
        longitude_rad: -1.32645,
        latitude_rad: -0.73426,
        speed_mps: 1568.42,
        validity: [(19420.0, 6000.0), (0.0204799, 0.08), (0.3215, 0.6635), (0.0, 0.3)],
        coefficients: [
            114058.0, 39208.9, 30560.8, 20905.6, -45.169, 10856.4, 4096.79, 5677.3, 7757.08, 4118.29, -18256.6,
            43.8103, -1956.91,
        ],
    },
];
