//! What boards share: a serial line between the main loop and an interrupt that moves single bytes.

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex};
use embedded_io::Read;
use firmware::link::ring::{Inlet, Outlet, Ring};
use firmware::link::{Full, Line, Lost};

/// Room for received bytes: 4 ms of the fastest sensor (STIM300, 118 kB/s).
pub const RECEIVED: usize = 512;
/// Room for bytes to be sent: some messages of the longest kind.
pub const TO_SEND: usize = 1024;

/// The two rings of a line.
pub type Rings = (Ring<RECEIVED>, Ring<TO_SEND>);

/// The interrupt's ends of both rings.
pub struct Ends {
    /// Received bytes go in here.
    pub received: Inlet<'static>,
    /// Bytes to be sent come out here.
    pub to_send: Outlet<'static>,
}

/// Where the interrupt finds its ends: empty until the line is opened.
pub type Slot = Mutex<RefCell<Option<Ends>>>;

/// No line yet.
pub const fn closed() -> Slot {
    Mutex::new(RefCell::new(None))
}

/// Interrupt: does `work` on the ends, if the line is open. Nothing nests in here, so the ends are never borrowed twice.
pub fn serve(slot: &Slot, work: impl FnOnce(&mut Ends)) {
    interrupt::free(|cs| {
        if let Ok(mut ends) = slot.borrow(cs).try_borrow_mut()
            && let Some(ends) = ends.as_mut()
        {
            work(ends);
        }
    });
}

/// The main loop's end of a line.
pub struct Port {
    received: Outlet<'static>,
    to_send: Inlet<'static>,
    /// Makes the line's interrupt pending, which finds what there is to send.
    wake: fn(),
}

impl Port {
    /// Gives the interrupt its ends and keeps the others.
    pub fn open(rings: &'static mut Rings, slot: &Slot, wake: fn()) -> Self {
        let (into, received) = rings.0.split();
        let (to_send, out) = rings.1.split();
        let ends = Ends {
            received: into,
            to_send: out,
        };
        interrupt::free(|cs| {
            if let Ok(mut slot) = slot.borrow(cs).try_borrow_mut() {
                *slot = Some(ends);
            }
        });
        Self {
            received,
            to_send,
            wake,
        }
    }
}

impl Line for Port {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        self.received.read(buffer).map_err(|_| Lost)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if self.to_send.room() < message.len() {
            return Err(Full);
        }
        for &byte in message {
            self.to_send.push(byte);
        }
        (self.wake)();
        Ok(())
    }
}
