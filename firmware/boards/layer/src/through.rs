//! A line whose bytes a task moves: USB, or a driver that has no ring of its own. Between task and
//! loop there are two rings of `firmware::link`.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use firmware::link::ring::{Consumer, Producer, Ring};
use firmware::link::{Full, Line, Lost};

use crate::line::{Frame, RING, Wire};

/// Rings and events of one line, a `static`.
pub struct Through {
    received: Ring<RING>,
    to_send: Ring<RING>,
    came: Signal<CriticalSectionRawMutex, ()>,
    wakes: Signal<CriticalSectionRawMutex, ()>,
}

impl Through {
    /// An idle line.
    #[allow(clippy::new_without_default, reason = "a static")]
    pub const fn new() -> Self {
        Self {
            received: Ring::new(),
            to_send: Ring::new(),
            came: Signal::new(),
            wakes: Signal::new(),
        }
    }

    /// The loop's end; there is one.
    pub fn line(&'static self) -> ThroughLine {
        ThroughLine {
            received: self.received.consumer(),
            to_send: self.to_send.producer(),
            of: self,
        }
    }

    /// For the task: a byte came. One without room is lost, which is reported.
    pub fn came(&self, byte: u8) {
        self.received.push(byte);
        self.came.signal(());
    }

    /// For the task: bytes were lost.
    pub fn lost(&self) {
        self.received.producer().mark_lost();
        self.came.signal(());
    }

    /// For the task: the next bytes to be sent, at least one.
    pub async fn next(&self, bytes: &mut [u8]) -> usize {
        loop {
            let mut taken = 0;
            while let Some(place) = bytes.get_mut(taken)
                && let Some(byte) = self.to_send.pop()
            {
                *place = byte;
                taken += 1;
            }
            if taken > 0 {
                return taken;
            }
            self.wakes.wait().await;
        }
    }
}

/// The loop's end.
pub struct ThroughLine {
    received: Consumer<'static>,
    to_send: Producer<'static>,
    of: &'static Through,
}

impl Line for ThroughLine {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        self.received
            .read_by(buffer, firmware::link::ring::get)
            .map_err(|_| Lost)
    }

    fn is_idle(&self) -> bool {
        self.received.is_empty() && !self.received.has_lost()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if !self.to_send.put_all(message) {
            return Err(Full);
        }
        self.of.wakes.signal(());
        Ok(())
    }
}

impl Wire for ThroughLine {
    async fn arrived(&mut self) {
        while self.is_idle() {
            self.of.came.wait().await;
        }
    }

    fn open(&mut self, _: &Frame) {}
}
