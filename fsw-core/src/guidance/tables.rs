//! Tables of the guidance modes `apollo` and `segmented-table`. Made by
//! `aeroshell guidance-tables msl --set planet.rotation_radps=0 --set planet.j2=0`;
//! do not edit.

/// Cosine of the constant bank of the reference flight, 41.459°.
pub const REFERENCE_COS_BANK: f64 = 0.749427;
/// Speed (m/s), range to go (m), drag (m/s²), altitude rate (m/s), ∂R/∂D (s²), ∂R/∂ḣ (s), ∂R/∂cos σ (m).
pub type ReferenceRow = [f32; 7];
/// The reference flight by increasing speed.
pub const REFERENCE: [ReferenceRow; 18] = [
    [599.7, 16955.2, 5.4579, -147.33, -2711.9, 19.6, 260.1],
    [889.3, 57450.6, 6.4782, -53.03, -4808.5, 119.3, 5657.2],
    [1179.1, 93996.6, 10.5413, 10.65, -4338.6, 208.7, 17972.7],
    [1469.4, 121758.7, 17.2710, 31.88, -3488.9, 270.1, 35591.0],
    [1758.0, 143107.8, 25.8451, 25.24, -2833.9, 310.7, 56730.7],
    [2046.9, 160629.1, 35.5666, 0.38, -2365.0, 338.4, 80350.0],
    [2338.0, 175875.1, 45.7980, -38.00, -2026.4, 358.3, 105857.5],
    [2626.1, 189491.6, 55.6841, -86.31, -1783.3, 373.1, 132304.5],
    [2914.2, 202251.0, 64.6975, -143.21, -1606.0, 385.0, 159657.9],
    [3208.3, 214853.8, 72.3587, -209.04, -1476.6, 395.3, 188325.5],
    [3493.1, 227028.0, 77.6979, -279.53, -1392.3, 404.7, 216698.7],
    [3785.4, 239896.2, 80.4541, -358.44, -1344.0, 414.5, 246440.5],
    [4073.7, 253421.9, 79.8804, -442.65, -1336.8, 425.1, 276420.7],
    [4360.7, 268361.5, 75.4750, -532.99, -1380.8, 437.8, 307006.6],
    [4657.7, 286536.9, 66.2453, -634.16, -1513.5, 454.9, 339648.3],
    [4945.8, 309189.3, 52.0560, -741.99, -1826.5, 479.1, 372691.1],
    [5236.6, 344139.7, 31.6036, -867.56, -2790.6, 522.0, 408336.2],
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
