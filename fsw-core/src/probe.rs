//! Points of the minor frame at which execution cost is read, and the meter that adds it up.
//!
//! The core owns no clock. It tells a [`Probe`] what has just been done; what that cost, in whatever unit the caller
//! counts, is the caller's affair. With [`NoProbe`] every mark compiles to nothing, and no result depends on a mark.

/// Schedule slots that report their cost.
pub const SLOT_COUNT: usize = 8;

/// A piece of the minor frame whose cost is budgeted on its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotId {
    /// Frames of the link found, checked and decoded.
    Receive = 0,
    /// Validation of the sensor packets.
    Sensors = 1,
    /// Strapdown and filter.
    Navigation = 2,
    /// Guidance quota.
    Guidance = 3,
    /// Bank control and parachute trigger.
    Control = 4,
    /// Monitors and mode.
    Fault = 5,
    /// Building of the telemetry packets.
    Telemetry = 6,
    /// Packets encoded for the link.
    Transmit = 7,
}

/// Algorithms that report their cost.
pub const KERNEL_COUNT: usize = 7;

/// An algorithm whose cost is reported across slots; its unit of work in brackets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Byte stream to packet (packets).
    Decode = 0,
    /// Strapdown integration of one frame (frames).
    Strapdown = 1,
    /// Prediction of the filter's covariance (slices).
    FilterPredict = 2,
    /// Check of the covariance, or scalar updates (scalar updates, at least 1).
    FilterUpdate = 3,
    /// Predictor (evaluations of the equations of motion; four in a Runge–Kutta step).
    Predictor = 4,
    /// Rest of guidance: corrector, lateral logic, alignment (frames).
    Corrector = 5,
    /// Packet to bytes (packets).
    Encode = 6,
}

impl Kernel {
    /// All, in the order of their indices.
    pub const ALL: [Self; KERNEL_COUNT] = [
        Self::Decode,
        Self::Strapdown,
        Self::FilterPredict,
        Self::FilterUpdate,
        Self::Predictor,
        Self::Corrector,
        Self::Encode,
    ];

    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Decode => "packet decode",
            Self::Strapdown => "strapdown",
            Self::FilterPredict => "filter predict",
            Self::FilterUpdate => "filter update",
            Self::Predictor => "predictor",
            Self::Corrector => "corrector",
            Self::Encode => "packet encode",
        }
    }
}

/// Told when each piece of a frame is done.
pub trait Probe {
    /// The slot has just ended: it is charged all cost since the slot before ended.
    fn slot_done(&mut self, slot: SlotId);

    /// `units` of an algorithm have just ended: it is charged all cost since the last mark of any kind.
    fn kernel_done(&mut self, kernel: Kernel, units: u32);

    /// A minor frame has just been closed: what comes next belongs to the next one.
    fn frame_done(&mut self);

    /// What was done so far belongs to no minor frame: the flight has not begun.
    fn nothing_done(&mut self);

    /// The packet at hand is the first usable one of so many minor frames of the flight.
    fn frames_passed(&mut self, _frames: u32) {}
}

/// A probe that measures nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    fn slot_done(&mut self, _slot: SlotId) {}

    fn kernel_done(&mut self, _kernel: Kernel, _units: u32) {}

    fn frame_done(&mut self) {}

    fn nothing_done(&mut self) {}
}

/// Cost of a frame in the caller's unit (instructions on target); zero where not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeasuredCost {
    /// The whole frame, from its first byte decoded to its last byte encoded.
    pub whole: u32,
    /// Per slot.
    pub slots: [u32; SLOT_COUNT],
    /// Per algorithm.
    pub kernels: [u32; KERNEL_COUNT],
    /// Units of work done per algorithm.
    pub units: [u16; KERNEL_COUNT],
    /// Deepest stack use so far, bytes.
    pub stack_high_water_bytes: u32,
}

impl MeasuredCost {
    /// Nothing measured.
    pub const NONE: Self = Self {
        whole: 0,
        slots: [0; SLOT_COUNT],
        kernels: [0; KERNEL_COUNT],
        units: [0; KERNEL_COUNT],
        stack_high_water_bytes: 0,
    };
}

/// A counter of cost: instructions, cycles, nanoseconds. It must not wrap within a frame.
pub trait Counter {
    /// Begins again at zero.
    fn restart(&mut self);

    /// Cost since the last restart.
    fn read(&mut self) -> u32;
}

/// A [`Probe`] that knows when frames are worked on, and what they cost.
pub trait Meter: Probe {
    /// Begins a span.
    fn resume(&mut self);

    /// Ends a span.
    fn pause(&mut self);

    /// Forgets the frame being worked on: what comes before a flight belongs to no frame of it.
    fn discard(&mut self);

    /// Cost of the minor frame closed since the last call; of the dearest, where a packet closed several.
    fn take(&mut self) -> Option<MeasuredCost>;

    /// Enters how deep the stack has been.
    fn note_stack(&mut self, high_water_bytes: u32);
}

/// A [`Meter`] that adds up what a [`Counter`] counts.
///
/// A minor frame is worked on in spans, one per received packet; the span of the packet that closes it is the last. The
/// counter runs in the spans only: waiting for bytes and sending them belong to no frame.
///
/// `resume`, `pause` and `frame_done` stay functions of their own in every image: who watches one from outside (an
/// emulator that counts executed blocks, a debugger) finds the frames by them.
#[derive(Clone, Debug)]
pub struct FrameMeter<C> {
    counter: C,
    /// The frame being worked on.
    open: MeasuredCost,
    /// The dearest frame closed since the last [`FrameMeter::take`], without its slot `Receive`, which the frames share.
    closed: Option<MeasuredCost>,
    /// Frames closed since then, or passed without any that could be, and what receiving cost them together.
    closed_frames: u32,
    passed_frames: u32,
    received: u32,
    frame_began: u32,
    slot_began: u32,
    mark: u32,
    stack_high_water_bytes: u32,
}

impl<C: Counter> FrameMeter<C> {
    /// A meter that has measured nothing.
    pub const fn new(counter: C) -> Self {
        Self {
            counter,
            open: MeasuredCost::NONE,
            closed: None,
            closed_frames: 0,
            passed_frames: 0,
            received: 0,
            frame_began: 0,
            slot_began: 0,
            mark: 0,
            stack_high_water_bytes: 0,
        }
    }

    /// The counter.
    pub fn counter_mut(&mut self) -> &mut C {
        &mut self.counter
    }
}

impl<C: Counter> Meter for FrameMeter<C> {
    #[inline(never)]
    fn resume(&mut self) {
        self.frame_began = 0;
        self.slot_began = 0;
        self.mark = 0;
        self.counter.restart();
    }

    #[inline(never)]
    fn pause(&mut self) {
        // What a span does after its last mark is receiving.
        self.slot_done(SlotId::Receive);
        self.open.whole = self.open.whole.wrapping_add(self.slot_began.wrapping_sub(self.frame_began));
    }

    fn discard(&mut self) {
        self.open = MeasuredCost::NONE;
    }

    fn take(&mut self) -> Option<MeasuredCost> {
        let mut cost = self.closed.take()?;
        let (closed, passed) = (core::mem::take(&mut self.closed_frames), core::mem::take(&mut self.passed_frames));
        let frames = if passed > closed { passed } else { closed };
        let share = core::mem::take(&mut self.received).checked_div(frames).unwrap_or(0);
        cost.whole = cost.whole.saturating_add(share);
        let [receive, ..] = &mut cost.slots;
        *receive = share;
        cost.stack_high_water_bytes = self.stack_high_water_bytes;
        Some(cost)
    }

    fn note_stack(&mut self, high_water_bytes: u32) {
        self.stack_high_water_bytes = high_water_bytes;
    }
}

impl<C: Counter> Probe for FrameMeter<C> {
    #[inline]
    fn slot_done(&mut self, slot: SlotId) {
        let now = self.counter.read();
        // A counter does not wrap within a frame; if it did, figures would be wrong, not the flight.
        if let Some(cost) = self.open.slots.get_mut(slot as usize) {
            *cost = cost.wrapping_add(now.wrapping_sub(self.slot_began));
        }
        self.slot_began = now;
        self.mark = now;
    }

    #[inline]
    fn kernel_done(&mut self, kernel: Kernel, units: u32) {
        let now = self.counter.read();
        if let Some(cost) = self.open.kernels.get_mut(kernel as usize) {
            *cost = cost.wrapping_add(now.wrapping_sub(self.mark));
        }
        if let Some(done) = self.open.units.get_mut(kernel as usize) {
            *done = done.wrapping_add(units as u16);
        }
        self.mark = now;
    }

    #[inline(never)]
    fn frame_done(&mut self) {
        let now = self.counter.read();
        let mut frame = core::mem::replace(&mut self.open, MeasuredCost::NONE);
        frame.whole = frame.whole.saturating_add(now.saturating_sub(self.frame_began));
        (self.frame_began, self.slot_began, self.mark) = (now, now, now);
        // Packets that came while frames went missing came in the time of those frames.
        let [receive, ..] = &mut frame.slots;
        self.received = self.received.saturating_add(*receive);
        frame.whole = frame.whole.saturating_sub(core::mem::take(receive));
        self.closed_frames = self.closed_frames.saturating_add(1);
        if self.closed.is_none_or(|dearest| frame.whole > dearest.whole) {
            self.closed = Some(frame);
        }
    }

    fn frames_passed(&mut self, frames: u32) {
        self.passed_frames = frames;
    }

    fn nothing_done(&mut self) {
        self.open = MeasuredCost::NONE;
        let now = self.counter.read();
        (self.frame_began, self.slot_began, self.mark) = (now, now, now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts ten at every reading.
    #[derive(Default)]
    struct Ticks(u32);

    impl Counter for Ticks {
        fn restart(&mut self) {
            self.0 = 0;
        }

        fn read(&mut self) -> u32 {
            self.0 += 10;
            self.0
        }
    }

    #[test]
    fn slots_cover_the_frame_and_kernels_take_what_came_since_the_last_mark() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.resume();
        meter.slot_done(SlotId::Receive); // at 10
        meter.kernel_done(Kernel::Strapdown, 1); // at 20
        meter.kernel_done(Kernel::FilterUpdate, 3); // at 30
        meter.slot_done(SlotId::Navigation); // at 40
        meter.slot_done(SlotId::Guidance); // at 50
        meter.frame_done(); // at 60
        let cost = meter.take().unwrap();
        assert_eq!(cost.whole, 60);
        assert_eq!(cost.slots, [10, 0, 30, 10, 0, 0, 0, 0]);
        assert_eq!((cost.kernels[Kernel::Strapdown as usize], cost.kernels[Kernel::FilterUpdate as usize]), (10, 10));
        assert_eq!(cost.units[Kernel::FilterUpdate as usize], 3);
        assert_eq!(meter.take(), None);
    }

    #[test]
    fn a_frame_is_the_sum_of_the_spans_of_its_packets() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.note_stack(77);
        for _ in 0..2 {
            meter.resume();
            meter.slot_done(SlotId::Receive); // 10
            meter.pause(); // 20
        }
        assert_eq!(meter.take(), None, "no frame is closed yet");
        meter.resume();
        meter.frame_done(); // 10
        meter.pause(); // belongs to the next frame: 10
        let cost = meter.take().unwrap();
        assert_eq!((cost.whole, cost.slots[0], cost.stack_high_water_bytes), (50, 40, 77));
        meter.resume();
        meter.frame_done();
        assert_eq!(meter.take().unwrap().whole, 20);
    }

    #[test]
    fn what_is_discarded_is_charged_to_no_frame() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.resume();
        meter.slot_done(SlotId::Receive);
        meter.pause();
        meter.discard();
        meter.resume();
        meter.frame_done();
        assert_eq!(meter.take().unwrap(), MeasuredCost { whole: 10, ..MeasuredCost::NONE });
    }

    #[test]
    fn of_several_frames_closed_by_one_packet_the_dearest_is_kept() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.resume();
        meter.frame_done();
        meter.slot_done(SlotId::Guidance);
        meter.frame_done();
        meter.frame_done();
        assert_eq!(meter.take().unwrap().whole, 20);
    }

    #[test]
    fn frames_closed_together_share_what_receiving_cost() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.resume();
        meter.slot_done(SlotId::Receive); // 10
        meter.frame_done(); // 20: 10 of its own
        meter.frame_done(); // 30: 10 of its own
        let cost = meter.take().unwrap();
        assert_eq!((cost.whole, cost.slots[SlotId::Receive as usize]), (15, 5));
    }

    #[test]
    fn frames_that_passed_without_a_usable_packet_share_what_receiving_cost() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.resume();
        meter.slot_done(SlotId::Receive); // 10
        meter.pause(); // 20: nothing usable
        meter.resume();
        meter.slot_done(SlotId::Receive); // 10 more: 30 in all
        meter.frames_passed(3);
        meter.frame_done(); // 10 of its own
        let cost = meter.take().unwrap();
        assert_eq!((cost.whole, cost.slots[SlotId::Receive as usize]), (20, 10));
    }

    #[test]
    fn what_was_done_before_the_flight_belongs_to_no_frame() {
        let mut meter = FrameMeter::new(Ticks::default());
        meter.resume();
        meter.slot_done(SlotId::Receive);
        meter.nothing_done(); // at 20
        meter.pause(); // at 30
        meter.resume();
        meter.frame_done();
        let cost = meter.take().unwrap();
        assert_eq!((cost.whole, cost.slots[0]), (20, 10));
    }

    #[test]
    fn the_names_of_the_kernels_are_in_the_order_of_their_indices() {
        assert!(Kernel::ALL.iter().enumerate().all(|(index, kernel)| *kernel as usize == index));
    }
}
