//! The log: defmt frames in a ring in RAM that a debug probe reads (RTT), as `defmt-rtt` has it.
//!
//! `defmt-rtt` panics when a log is made within a log, and no panic may be in the image. So it is
//! written here, and such a log is left out. It never waits for a reader: the oldest bytes are
//! overwritten.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use critical_section::RestoreState;
use defmt::Encoder;

use super::LOG_SIZE as SIZE;

/// SEGGER's control block with one channel up; a probe finds it by its first bytes.
#[repr(C)]
struct Control {
    identifier: [u8; 16],
    channels_up: u32,
    channels_down: u32,
    name: &'static [u8; 6],
    buffer: &'static [AtomicU8; SIZE],
    size: u32,
    /// By us.
    write: AtomicU32,
    /// By the reader, and the flags too.
    read: AtomicU32,
    flags: AtomicU32,
}

static BUFFER: [AtomicU8; SIZE] = [const { AtomicU8::new(0) }; SIZE];

// SAFETY: the name is SEGGER's and probes look for it; nothing else in the image has it.
#[unsafe(no_mangle)]
static _SEGGER_RTT: Control = Control {
    identifier: *b"SEGGER RTT\0\0\0\0\0\0",
    channels_up: 1,
    channels_down: 0,
    name: b"defmt\0",
    buffer: &BUFFER,
    size: SIZE as u32,
    write: AtomicU32::new(0),
    read: AtomicU32::new(0),
    flags: AtomicU32::new(0), // leave out what finds no room: never wait
};

fn put(bytes: &[u8]) {
    let mut at = _SEGGER_RTT.write.load(Ordering::Relaxed) as usize;
    for byte in bytes {
        if let Some(place) = BUFFER.get(at) {
            place.store(*byte, Ordering::Relaxed);
        }
        at = if at + 1 < SIZE { at + 1 } else { 0 };
    }
    _SEGGER_RTT.write.store(at as u32, Ordering::Release);
}

/// The frame being written. It is used only within the critical section that `acquire` enters and
/// `release` leaves.
struct Frame(UnsafeCell<(Encoder, RestoreState)>);

// SAFETY: one core, and all access is within a critical section.
unsafe impl Sync for Frame {}

static FRAME: Frame = Frame(UnsafeCell::new((Encoder::new(), RestoreState::invalid())));
/// How many logs are within one another.
static DEPTH: AtomicU32 = AtomicU32::new(0);

#[defmt::global_logger]
struct Log;

// SAFETY: `acquire` begins a critical section that the matching `release` ends. Logs within a log
// are left out.
unsafe impl defmt::Logger for Log {
    fn acquire() {
        // SAFETY: the outermost `release` ends it. An inner one enters a section that is already
        // entered.
        let restore = unsafe { critical_section::acquire() };
        let depth = DEPTH.load(Ordering::Relaxed);
        DEPTH.store(depth.wrapping_add(1), Ordering::Relaxed);
        if depth == 0 {
            // SAFETY: in the critical section, and at depth 0 nobody else has a reference.
            let (encoder, saved) = unsafe { &mut *FRAME.0.get() };
            *saved = restore;
            encoder.start_frame(put);
        }
    }

    unsafe fn flush() {}

    unsafe fn write(bytes: &[u8]) {
        if DEPTH.load(Ordering::Relaxed) == 1 {
            // SAFETY: in the critical section, and nobody else has a reference between two calls.
            let (encoder, _) = unsafe { &mut *FRAME.0.get() };
            encoder.write(bytes, put);
        }
    }

    unsafe fn release() {
        let depth = DEPTH.load(Ordering::Relaxed).wrapping_sub(1);
        DEPTH.store(depth, Ordering::Relaxed);
        if depth == 0 {
            // SAFETY: as in `write`; the state is the one that the matching `acquire` was given.
            unsafe {
                let (encoder, saved) = &mut *FRAME.0.get();
                encoder.end_frame(put);
                critical_section::release(*saved);
            }
        }
    }
}
