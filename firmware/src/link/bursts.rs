//! Bursts of a sensor at an SPI that a DMA controller fetches: the decisions, without registers.
//!
//! An interrupt comes when the sensor has a new sample ([`Bursts::ready`]), and one when the
//! transfer has ended ([`Bursts::ended`]). Between them the core has nothing to do. The two do not
//! interrupt each other. The frame path takes what has come ([`Bursts::take`]), each burst once and
//! in order; some wait for it while it is busy.
//!
//! Nothing waits here, so nothing hangs. What goes wrong costs bursts, and each loss is reported:
//! - A transfer that has not ended when the next sample is ready is given up. That sample is left
//!   as well: the sensor wants a pause first.
//! - A sample that is ready within the pause behind a transfer is left.
//! - So is one without a free buffer, because the frame path was busy for too long.
//!
//! A data-ready that never comes shows in the sensor's counter, or as silence.

use super::Lost;
use super::atomics::{AtomicU8, AtomicU32, AtomicUsize, Ordering};

/// A controller with a sensor at its bus.
pub trait Exchange<'m> {
    /// Selects the sensor and begins to move bytes both ways: the command leaves, and what comes
    /// is written to these places.
    fn begin(&self, places: &'m [AtomicU8]);

    /// Ends the transfer, wherever it is, and releases the sensor. Whether all bytes had come; if
    /// not, the controller is as after its set-up.
    fn end(&self) -> bool;

    /// Microseconds, which turn over at 2^32.
    fn now_us(&self) -> u32;
}

/// Bursts on their way from the interrupts to the frame path. `N`: how many may wait, a power of
/// two; `LONGEST`: bytes of the longest exchange; `STALL_US`: the pause between two exchanges, us.
#[derive(Debug)]
pub struct Bursts<const N: usize, const LONGEST: usize, const STALL_US: u32> {
    places: [[AtomicU8; LONGEST]; N],
    /// Bytes of an exchange; 0: there is no sensor.
    length: AtomicUsize,
    /// A transfer is under way: 1, else 0.
    running: AtomicU8,
    /// Time at which the sensor was last released, microseconds.
    released_us: AtomicU32,
    /// Bursts that have come, been lost, been taken, and been reported as lost, wrapping.
    came: AtomicUsize,
    lost: AtomicUsize,
    taken: AtomicUsize,
    reported: AtomicUsize,
}

impl<const N: usize, const LONGEST: usize, const STALL_US: u32> Bursts<N, LONGEST, STALL_US> {
    /// A queue without a sensor.
    #[allow(clippy::new_without_default, reason = "a static")]
    pub const fn new() -> Self {
        const {
            assert!(N.is_power_of_two(), "counts wrap");
        }
        Self {
            places: [const { [const { AtomicU8::new(0) }; LONGEST] }; N],
            length: AtomicUsize::new(0),
            running: AtomicU8::new(0),
            released_us: AtomicU32::new(0),
            came: AtomicUsize::new(0),
            lost: AtomicUsize::new(0),
            taken: AtomicUsize::new(0),
            reported: AtomicUsize::new(0),
        }
    }

    /// A sensor has been found; an exchange with it has so many bytes, the command included.
    pub fn found(&self, length: usize) {
        self.length.store(length.min(LONGEST), Ordering::Relaxed);
    }

    /// Called by the interrupt: the sensor has a new sample. Returns whether to wake the frame
    /// path.
    #[inline(always)]
    pub fn ready<'b>(&'b self, bus: &impl Exchange<'b>) -> bool {
        let length = self.length.load(Ordering::Relaxed);
        if length == 0 {
            return false;
        }
        if self.running.load(Ordering::Relaxed) != 0 {
            self.ended(bus); // late
            return self.leave();
        }
        let came = self.came.load(Ordering::Relaxed);
        let waiting = came.wrapping_sub(self.taken.load(Ordering::Acquire));
        let since = bus
            .now_us()
            .wrapping_sub(self.released_us.load(Ordering::Relaxed));
        let place = self
            .places
            .get(came % N)
            .and_then(|place| place.get(..length));
        let Some(place) = place.filter(|_| waiting < N && since >= STALL_US) else {
            return self.leave();
        };
        self.running.store(1, Ordering::Relaxed);
        bus.begin(place);
        false
    }

    /// Called by the interrupt: the transfer has ended or failed. Returns whether to wake the frame
    /// path.
    #[inline(always)]
    pub fn ended<'b>(&'b self, bus: &impl Exchange<'b>) -> bool {
        if self.running.load(Ordering::Relaxed) == 0 {
            return false;
        }
        let whole = bus.end();
        self.running.store(0, Ordering::Relaxed);
        self.released_us.store(bus.now_us(), Ordering::Relaxed);
        if !whole {
            return self.leave();
        }
        let came = self.came.load(Ordering::Relaxed).wrapping_add(1);
        self.came.store(came, Ordering::Release);
        true
    }

    /// With interrupts masked: no burst is wanted any more until a sensor is found. A transfer
    /// under way is given up, and what waits is not taken.
    pub fn forget<'b>(&'b self, bus: &impl Exchange<'b>) {
        if self.running.load(Ordering::Relaxed) != 0 {
            bus.end();
            self.running.store(0, Ordering::Relaxed);
        }
        self.length.store(0, Ordering::Relaxed);
        let came = self.came.load(Ordering::Relaxed);
        self.taken.store(came, Ordering::Relaxed);
    }

    /// A burst is lost.
    fn leave(&self) -> bool {
        let lost = self.lost.load(Ordering::Relaxed).wrapping_add(1);
        self.lost.store(lost, Ordering::Release);
        true
    }

    /// Called by the frame path: the oldest reply that was not taken, copied by `copy` to `reply`.
    ///
    /// # Errors
    /// [`Lost`], once for each burst that was lost, before the bursts that are left.
    pub fn take<'r>(
        &self,
        reply: &'r mut [u8; LONGEST],
        copy: impl FnOnce(&[AtomicU8], &mut [u8]),
    ) -> Result<Option<&'r mut [u8]>, Lost> {
        let reported = self.reported.load(Ordering::Relaxed);
        if reported != self.lost.load(Ordering::Acquire) {
            self.reported
                .store(reported.wrapping_add(1), Ordering::Relaxed);
            return Err(Lost);
        }
        let taken = self.taken.load(Ordering::Relaxed);
        if taken == self.came.load(Ordering::Acquire) {
            return Ok(None);
        }
        let length = self.length.load(Ordering::Relaxed);
        // behind the command
        let places = self
            .places
            .get(taken % N)
            .and_then(|place| place.get(2..length));
        let places = places.unwrap_or_default();
        let reply = reply.get_mut(..places.len()).unwrap_or_default();
        copy(places, reply);
        self.taken.store(taken.wrapping_add(1), Ordering::Release);
        Ok(Some(reply))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::ring::get;
    use crate::wire::adis::spi::{LONGEST, STALL_US};
    use core::cell::Cell;

    type Waiting<const N: usize> = Bursts<N, LONGEST, STALL_US>;

    /// A bus whose transfers end when the test says so.
    struct Bus<'m> {
        now_us: Cell<u32>,
        places: Cell<&'m [AtomicU8]>,
        whole: Cell<bool>,
        selected: Cell<bool>,
        released_us: Cell<u32>,
    }

    impl<'m> Exchange<'m> for &Bus<'m> {
        fn begin(&self, places: &'m [AtomicU8]) {
            assert!(!self.selected.replace(true));
            let pause = self.now_us.get().wrapping_sub(self.released_us.get());
            assert!(pause >= STALL_US, "{pause} us");
            self.places.set(places);
        }

        fn end(&self) -> bool {
            assert!(self.selected.replace(false));
            self.released_us.set(self.now_us.get());
            self.whole.get()
        }

        fn now_us(&self) -> u32 {
            self.now_us.get()
        }
    }

    impl Bus<'_> {
        /// Just before the time turns over.
        fn new<'m>() -> Bus<'m> {
            Bus {
                now_us: Cell::new(u32::MAX - 100),
                places: Cell::new(&[]),
                whole: Cell::new(true),
                selected: Cell::new(false),
                released_us: Cell::new(0),
            }
        }

        fn wait(&self, us: u32) {
            self.now_us.set(self.now_us.get().wrapping_add(us));
        }
    }

    const LENGTH: usize = 22;

    /// A burst whose bytes are `byte`, from data-ready to its end.
    fn burst<'m, const N: usize>(bursts: &'m Waiting<N>, bus: &Bus<'m>, byte: u8) {
        bus.wait(STALL_US);
        bursts.ready(&bus);
        if bus.selected.get() {
            let places = bus.places.get().iter();
            places.for_each(|place| place.store(byte, Ordering::Relaxed));
        }
        bus.wait(200);
        bursts.ended(&bus);
    }

    fn take<const N: usize>(bursts: &Waiting<N>) -> Result<Option<(usize, u8)>, Lost> {
        let mut reply = [0; LONGEST];
        let taken = bursts.take(&mut reply, get)?;
        Ok(taken.map(|reply| (reply.len(), reply[0])))
    }

    #[test]
    fn bursts_come_once_each_in_order() {
        let (bursts, bus) = (Waiting::<4>::new(), &Bus::new());
        assert!(!bursts.ready(&bus), "no sensor");
        bursts.found(LENGTH);
        for round in 0..50u8 {
            for byte in 0..round % 5 {
                burst(&bursts, bus, byte);
            }
            for byte in 0..round % 5 {
                assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, byte))));
            }
            assert_eq!(take(&bursts), Ok(None));
        }
    }

    #[test]
    fn one_without_a_buffer_is_reported_as_lost_and_spoils_no_other() {
        let (bursts, bus) = (Waiting::<2>::new(), &Bus::new());
        bursts.found(LENGTH);
        for byte in 0..4 {
            burst(&bursts, bus, byte);
        }
        assert_eq!((take(&bursts), take(&bursts)), (Err(Lost), Err(Lost)));
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 0))));
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 1))));
        burst(&bursts, bus, 9);
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 9))));
        assert_eq!(take(&bursts), Ok(None));
    }

    #[test]
    fn a_transfer_that_hangs_is_given_up_with_the_next_sample() {
        let (bursts, bus) = (Waiting::<2>::new(), &Bus::new());
        bursts.found(LENGTH);
        burst(&bursts, bus, 1);
        bus.wait(500);
        assert!(!bursts.ready(&bus));
        bus.wait(500);
        bus.whole.set(false);
        assert!(bursts.ready(&bus), "the next sample");
        assert!(!bus.selected.get(), "a pause before it restarts");
        bus.whole.set(true);
        assert!(!bursts.ended(&bus), "nothing runs");
        assert_eq!((take(&bursts), take(&bursts)), (Err(Lost), Err(Lost)));
        burst(&bursts, bus, 2);
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 1))));
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 2))));
    }

    /// One that was only late has come; the sample that found it is lost.
    #[test]
    fn the_pause_is_held() {
        let (bursts, bus) = (Waiting::<2>::new(), &Bus::new());
        bursts.found(LENGTH);
        burst(&bursts, bus, 1);
        bus.wait(STALL_US - 1);
        assert!(bursts.ready(&bus), "it is reported");
        assert_eq!(take(&bursts), Err(Lost));
        bus.wait(1);
        assert!(!bursts.ready(&bus));
        assert!(bursts.ready(&bus), "late, but whole");
        assert_eq!(take(&bursts), Err(Lost));
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 1))));
        assert!(matches!(take(&bursts), Ok(Some(_))));
    }

    #[test]
    fn what_is_under_way_or_waits_is_forgotten() {
        let (bursts, bus) = (Waiting::<2>::new(), &Bus::new());
        bursts.found(LENGTH);
        burst(&bursts, bus, 1);
        bus.wait(500);
        assert!(!bursts.ready(&bus), "a second one begins");
        bursts.forget(&bus);
        assert!(!bus.selected.get());
        assert_eq!(take(&bursts), Ok(None));
        bus.wait(500);
        assert!(!bursts.ready(&bus) && !bus.selected.get(), "no sensor");
        bursts.found(LENGTH);
        burst(&bursts, bus, 2);
        assert_eq!(take(&bursts), Ok(Some((LENGTH - 2, 2))));
        assert_eq!(take(&bursts), Ok(None), "none is reported as lost");
    }
}
