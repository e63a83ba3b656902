//! Faults of the sensors, at the point where their packets leave. They change what is sent, never what is drawn: after a
//! fault the readings are those of the same flight without it.

use fsw_core::link::packet::{DELTA_THETA_LSB_RAD, DELTA_V_LSB_MPS, Imu, Pressure};
use fsw_core::time::FRAME;
use fsw_core::units::rad;

use crate::scenario::{Fault, FaultKind, FaultTarget};
use crate::truth::FramePackets;

/// Status of a pressure port that reports itself failed.
const PRESSURE_FAILED: u8 = 1;

/// The faults of one flight and the readings that a stuck sensor repeats.
#[derive(Clone, Debug, Default)]
pub struct SensorFaults {
    faults: Vec<Fault>,
    last_imu: Imu,
    last_pressure: Option<Pressure>,
}

impl SensorFaults {
    /// The faults of a scenario; those of the link are not meant.
    #[must_use]
    pub fn new(faults: &[Fault]) -> Self {
        let faults = faults.iter().filter(|f| f.target != FaultTarget::Uplink).cloned().collect();
        Self { faults, ..Self::default() }
    }

    /// Turns what the sensors said at a time into what leaves them.
    pub fn strike(&mut self, time_s: f64, packets: &mut FramePackets) {
        let (last_imu, last_pressure) = (self.last_imu, self.last_pressure);
        let acting = |target: FaultTarget| self.faults.iter().filter(move |f| f.target == target && f.acts_at(time_s));
        for fault in acting(FaultTarget::Accelerometer) {
            let count = DELTA_V_LSB_MPS / FRAME.as_s();
            triad(fault, &mut packets.imu.delta_v_counts, &last_imu.delta_v_counts, parameter(fault, "value") / count);
        }
        for fault in acting(FaultTarget::Gyro) {
            let bias = rad(parameter(fault, "value")) / (DELTA_THETA_LSB_RAD / FRAME.as_s());
            triad(fault, &mut packets.imu.delta_theta_counts, &last_imu.delta_theta_counts, bias);
        }
        for fault in acting(FaultTarget::Imu) {
            unit(fault.kind, &mut packets.imu, &last_imu);
        }
        for fault in acting(FaultTarget::Pressure) {
            packets.pressure = packets.pressure.and_then(|reading| port(fault, reading, last_pressure));
        }
        for fault in acting(FaultTarget::Radio) {
            match fault.kind {
                FaultKind::Bias => packets.radio.iter_mut().for_each(|r| r.range_m += parameter(fault, "value")),
                _ => packets.radio.clear(),
            }
        }
        self.last_imu = packets.imu;
        self.last_pressure = packets.pressure.or(self.last_pressure);
    }
}

fn parameter(fault: &Fault, name: &str) -> f64 {
    fault.parameters.get(name).copied().unwrap_or(0.0)
}

/// A triad of the inertial unit; `bias` in counts of a frame.
fn triad(fault: &Fault, counts: &mut [i32; 3], last: &[i32; 3], bias: f64) {
    for (count, last) in counts.iter_mut().zip(last) {
        let reading = f64::from(*count);
        // Beyond the range of an integer the cast stays at its end.
        *count = match fault.kind {
            FaultKind::Bias => (reading + bias).round() as i32,
            FaultKind::Scale => (reading * parameter(fault, "factor")).round() as i32,
            _ => *last,
        };
    }
}

/// The whole unit. Without data it still keeps the frame's time, empty and marked as failed: the flight computer runs
/// its frames on these packets. A line that is cut altogether is a fault of the uplink.
fn unit(kind: FaultKind, imu: &mut Imu, last: &Imu) {
    match kind {
        FaultKind::Dropout => *imu = Imu { status: Imu::FAILED, ..Imu::default() },
        FaultKind::Failed => imu.status |= Imu::FAILED,
        _ => *imu = *last,
    }
}

/// The pressure port.
fn port(fault: &Fault, reading: Pressure, last: Option<Pressure>) -> Option<Pressure> {
    let pa = f64::from(reading.stagnation_pa);
    let read = |pa: f64| Some(Pressure { stagnation_pa: pa as f32, ..reading });
    match fault.kind {
        FaultKind::Dropout => None,
        FaultKind::Failed => Some(Pressure { status: PRESSURE_FAILED, ..reading }),
        FaultKind::Bias => read(pa + parameter(fault, "value")),
        FaultKind::Scale => read(pa * parameter(fault, "factor")),
        _ => last.or(Some(reading)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::link::packet::Radio;

    fn packets(n: i32) -> FramePackets {
        FramePackets {
            pressure: Some(Pressure { stagnation_pa: n as f32, status: 0 }),
            radio: vec![Radio { range_m: f64::from(n), ..Radio::default() }],
            imu: Imu { delta_v_counts: [n; 3], delta_theta_counts: [-n; 3], status: 0 },
        }
    }

    /// What leaves at 1 s and 2 s of readings 1000 and 2000 under a fault from 1.5 s on, and at 4 s, after it.
    fn struck(kind: FaultKind, target: FaultTarget, parameters: &[(&str, f64)]) -> [FramePackets; 3] {
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let fault = Fault { kind, target, start_s: 1.5, duration_s: 2.0, parameters };
        let mut faults = SensorFaults::new(&[fault]);
        [(1.0, 1000), (2.0, 2000), (4.0, 4000)].map(|(time_s, n)| {
            let mut p = packets(n);
            faults.strike(time_s, &mut p);
            p
        })
    }

    #[test]
    fn each_fault_strikes_its_sensor_for_its_time_and_nothing_else() {
        use FaultKind::{Bias, Dropout, Failed, Scale, Stuck};
        use FaultTarget::{Accelerometer, Gyro, Imu as Unit, Pressure as Port, Radio as Link};
        type Edit = fn(&mut FramePackets);
        type Case = (FaultKind, FaultTarget, &'static [(&'static str, f64)], Edit);
        let cases: [Case; 14] = [
            (Bias, Accelerometer, &[("value", 0.5)], |p| p.imu.delta_v_counts = [12_000; 3]),
            (Scale, Accelerometer, &[("factor", 1.5)], |p| p.imu.delta_v_counts = [3000; 3]),
            (Stuck, Accelerometer, &[], |p| p.imu.delta_v_counts = [1000; 3]),
            // 0.1 deg/s over 20 ms are 34.9 µrad.
            (Bias, Gyro, &[("value", 0.1)], |p| p.imu.delta_theta_counts = [1491; 3]),
            (Scale, Gyro, &[("factor", -1e12)], |p| p.imu.delta_theta_counts = [i32::MAX; 3]),
            (Stuck, Gyro, &[], |p| p.imu.delta_theta_counts = [-1000; 3]),
            (Dropout, Unit, &[], |p| p.imu = Imu { status: Imu::FAILED, ..Imu::default() }),
            (Failed, Unit, &[], |p| p.imu.status = Imu::FAILED),
            (Stuck, Unit, &[], |p| p.imu = packets(1000).imu),
            (Dropout, Port, &[], |p| p.pressure = None),
            (Failed, Port, &[], |p| p.pressure.as_mut().unwrap().status = 1),
            (Bias, Port, &[("value", -500.0)], |p| p.pressure.as_mut().unwrap().stagnation_pa = 1500.0),
            (Stuck, Port, &[], |p| p.pressure = packets(1000).pressure),
            (Bias, Link, &[("value", 250.0)], |p| p.radio[0].range_m = 2250.0),
        ];
        for (kind, target, parameters, edit) in cases {
            let mut expected = packets(2000);
            edit(&mut expected);
            let found = struck(kind, target, parameters);
            assert_eq!(found, [packets(1000), expected, packets(4000)], "{kind:?} of {target:?}");
        }
        assert!(struck(Dropout, Link, &[])[1].radio.is_empty());
    }
}
