//! Discrete outputs behind `embedded-hal`: mortar arm, mortar fire, watchdog.
//!
//! The fire line has two inhibits here, on top of those of the executive: it goes high only together with the arm
//! command, and only if the arm line was driven without error.

use embedded_hal::digital::{Error, ErrorKind, OutputPin, PinState};

use super::packet::Actuator;

/// Which line failed, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DiscreteError {
    /// The arm line; the fire line was driven low.
    Arm(ErrorKind),
    /// The fire line.
    Fire(ErrorKind),
    /// Fire was commanded without arm: not done.
    FireWithoutArm,
    /// The watchdog line.
    Watchdog(ErrorKind),
}

impl core::fmt::Display for DiscreteError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Arm(kind) => write!(f, "mortar arm line failed: {kind}"),
            Self::Fire(kind) => write!(f, "mortar fire line failed: {kind}"),
            Self::FireWithoutArm => f.write_str("mortar fire commanded without arm"),
            Self::Watchdog(kind) => write!(f, "watchdog line failed: {kind}"),
        }
    }
}

impl core::error::Error for DiscreteError {}

/// The three output lines.
#[derive(Clone, Debug)]
pub struct Discretes<A, F, W> {
    arm: A,
    fire: F,
    watchdog: W,
    watchdog_high: bool,
}

impl<A: OutputPin, F: OutputPin, W: OutputPin> Discretes<A, F, W> {
    /// Takes the lines and drives all of them low, fire first.
    ///
    /// # Errors
    /// The first line that cannot be driven; the others are tried all the same.
    pub fn new(arm: A, fire: F, watchdog: W) -> Result<Self, DiscreteError> {
        let mut lines = Self { arm, fire, watchdog, watchdog_high: false };
        let safe = lines.drive_mortar(false, false);
        let quiet = lines.watchdog.set_low().map_err(|e| DiscreteError::Watchdog(e.kind()));
        safe.and(quiet)?;
        Ok(lines)
    }

    /// Drives arm and fire as the packet says.
    ///
    /// # Errors
    /// A line that failed, or fire without arm; the fire line is low then unless it is the one that failed.
    pub fn apply(&mut self, actuator: &Actuator) -> Result<(), DiscreteError> {
        let arm = actuator.discretes & Actuator::MORTAR_ARM != 0;
        let fire = actuator.discretes & Actuator::MORTAR_FIRE != 0;
        self.drive_mortar(arm, fire && arm)?;
        if fire && !arm { Err(DiscreteError::FireWithoutArm) } else { Ok(()) }
    }

    /// Toggles the watchdog line; called once per minor frame that was completed.
    ///
    /// # Errors
    /// The line failed; it will be driven to the same state next time.
    pub fn kick_watchdog(&mut self) -> Result<(), DiscreteError> {
        let next = !self.watchdog_high;
        self.watchdog.set_state(PinState::from(next)).map_err(|e| DiscreteError::Watchdog(e.kind()))?;
        self.watchdog_high = next;
        Ok(())
    }

    /// Arm before fire on the way up, fire before arm on the way down.
    fn drive_mortar(&mut self, arm: bool, fire: bool) -> Result<(), DiscreteError> {
        if !fire {
            let low = self.fire.set_low().map_err(|e| DiscreteError::Fire(e.kind()));
            let armed = self.arm.set_state(PinState::from(arm)).map_err(|e| DiscreteError::Arm(e.kind()));
            return low.and(armed);
        }
        match self.arm.set_high() {
            Ok(()) => self.fire.set_high().map_err(|e| DiscreteError::Fire(e.kind())),
            Err(error) => {
                let refused = DiscreteError::Arm(error.kind());
                self.fire.set_low().map_err(|e| DiscreteError::Fire(e.kind()))?;
                Err(refused)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal::digital::ErrorType;
    use std::cell::{Cell, RefCell};
    use std::rc::Rc;
    use std::vec::Vec;

    /// A line that writes what is done to it into a log shared by all lines, and fails on demand.
    #[derive(Clone)]
    struct Line {
        name: char,
        log: Rc<RefCell<Vec<(char, bool)>>>,
        broken: Rc<Cell<bool>>,
    }

    impl ErrorType for Line {
        type Error = ErrorKind;
    }

    impl OutputPin for Line {
        fn set_low(&mut self) -> Result<(), ErrorKind> {
            self.drive(false)
        }

        fn set_high(&mut self) -> Result<(), ErrorKind> {
            self.drive(true)
        }
    }

    impl Line {
        fn drive(&mut self, high: bool) -> Result<(), ErrorKind> {
            if self.broken.get() {
                return Err(ErrorKind::Other);
            }
            self.log.borrow_mut().push((self.name, high));
            Ok(())
        }

        fn level(&self) -> Option<bool> {
            self.log.borrow().iter().rev().find(|(name, _)| *name == self.name).map(|(_, high)| *high)
        }
    }

    fn lines() -> [Line; 3] {
        let log = Rc::new(RefCell::new(Vec::new()));
        ['A', 'F', 'W'].map(|name| Line { name, log: log.clone(), broken: Rc::default() })
    }

    fn actuator(discretes: u8) -> Actuator {
        Actuator { discretes, ..Actuator::default() }
    }

    #[test]
    fn the_mock_remembers_levels_and_fails_on_demand() {
        let [mut arm, ..] = lines();
        assert_eq!(arm.level(), None);
        arm.set_high().unwrap();
        assert_eq!(arm.level(), Some(true));
        arm.broken.set(true);
        assert_eq!(arm.set_low(), Err(ErrorKind::Other));
        assert_eq!(arm.level(), Some(true));
    }

    #[test]
    fn every_line_starts_low() {
        let [arm, fire, watchdog] = lines();
        Discretes::new(arm.clone(), fire.clone(), watchdog.clone()).unwrap();
        assert_eq!([arm.level(), fire.level(), watchdog.level()], [Some(false); 3]);
    }

    #[test]
    fn arm_rises_before_fire_and_falls_after_it() {
        let [arm, fire, watchdog] = lines();
        let mut discretes = Discretes::new(arm.clone(), fire, watchdog).unwrap();
        arm.log.borrow_mut().clear();
        discretes.apply(&actuator(Actuator::MORTAR_ARM | Actuator::MORTAR_FIRE)).unwrap();
        discretes.apply(&actuator(0)).unwrap();
        assert_eq!(*arm.log.borrow(), [('A', true), ('F', true), ('F', false), ('A', false)]);
    }

    #[test]
    fn fire_without_arm_is_refused() {
        let [arm, fire, watchdog] = lines();
        let mut discretes = Discretes::new(arm, fire.clone(), watchdog).unwrap();
        assert_eq!(discretes.apply(&actuator(Actuator::MORTAR_FIRE)), Err(DiscreteError::FireWithoutArm));
        assert_eq!(fire.level(), Some(false));
    }

    #[test]
    fn a_broken_arm_line_inhibits_fire() {
        let [arm, fire, watchdog] = lines();
        let mut discretes = Discretes::new(arm.clone(), fire.clone(), watchdog).unwrap();
        arm.broken.set(true);
        let command = actuator(Actuator::MORTAR_ARM | Actuator::MORTAR_FIRE);
        assert_eq!(discretes.apply(&command), Err(DiscreteError::Arm(ErrorKind::Other)));
        assert_eq!(fire.level(), Some(false));
    }

    #[test]
    fn failures_of_fire_and_watchdog_are_told_apart() {
        let [arm, fire, watchdog] = lines();
        let mut discretes = Discretes::new(arm, fire.clone(), watchdog.clone()).unwrap();
        fire.broken.set(true);
        watchdog.broken.set(true);
        let command = actuator(Actuator::MORTAR_ARM | Actuator::MORTAR_FIRE);
        assert_eq!(discretes.apply(&command), Err(DiscreteError::Fire(ErrorKind::Other)));
        assert_eq!(discretes.kick_watchdog(), Err(DiscreteError::Watchdog(ErrorKind::Other)));
    }

    #[test]
    fn the_watchdog_line_toggles_with_every_kick_that_worked() {
        let [arm, fire, watchdog] = lines();
        let mut discretes = Discretes::new(arm, fire, watchdog.clone()).unwrap();
        let mut levels = Vec::new();
        for broken in [false, true, false, false] {
            watchdog.broken.set(broken);
            let _ = discretes.kick_watchdog();
            levels.push(watchdog.level().unwrap());
        }
        assert_eq!(levels, [true, true, false, true]);
    }
}
