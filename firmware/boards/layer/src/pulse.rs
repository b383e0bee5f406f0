//! The receiver's time pulse at a pin of an STM32, by an external interrupt.
//!
//! The interrupt notes the time, to a microsecond. What runs at the same time delays it: another
//! interrupt, or a critical section. While flash is erased it comes late by that time on most
//! chips, and the application does not believe such an edge. An edge counts when the line is still
//! high in the interrupt, so that a glitch is none.

use core::cell::RefCell;

use embassy_stm32::Peri;
use embassy_stm32::exti::{Channel, ExtiInput, TriggerEdge};
use embassy_stm32::gpio::{ExtiPin, Pin, Pull};
use embassy_stm32::interrupt::typelevel::{self, Binding, Interrupt};
use embassy_stm32::mode::Blocking;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::Instant;

/// The pin, and when it has risen, if nobody has asked since.
struct State {
    pin: Option<ExtiInput<'static, Blocking>>,
    rose_us: Option<u64>,
}

static STATE: Mutex<CriticalSectionRawMutex, RefCell<State>> = Mutex::new(RefCell::new(State {
    pin: None,
    rose_us: None,
}));

/// Serves the pin's interrupt, in which no other pin has a part.
#[derive(Debug)]
pub struct Handler;

impl<I: Interrupt> typelevel::Handler<I> for Handler {
    #[allow(unsafe_code, reason = "the trait asks for it; nothing here needs it")]
    unsafe fn on_interrupt() {
        let now = Instant::now();
        STATE.lock(|state| {
            let Ok(state) = &mut state.try_borrow_mut() else {
                return;
            };
            let Some(pin) = &mut state.pin else { return };
            pin.clear_pending();
            // the driver's own handler of another line masks each line that it finds pending
            pin.enable_interrupt();
            if pin.is_high() {
                state.rose_us = Some(now.as_micros());
            }
        });
    }
}

/// Listens at a pin from now on.
pub fn open<P: Pin + ExtiPin>(
    pin: Peri<'static, P>,
    line: Peri<'static, P::ExtiChannel>,
    _: impl Binding<<P::ExtiChannel as Channel>::IRQ, Handler>,
) {
    let pin = ExtiInput::new_blocking(pin, line, Pull::Down, TriggerEdge::Rising);
    STATE.lock(|state| {
        if let Ok(state) = &mut state.try_borrow_mut() {
            state.pin = Some(pin);
        }
    });
    #[allow(
        unsafe_code,
        reason = "the driver leaves this to whoever has the handler"
    )]
    // SAFETY: the handler's state is there, and no critical section relies on a masked interrupt.
    unsafe {
        <P::ExtiChannel as Channel>::IRQ::enable();
    }
}

/// When the line has risen, if it has since the last call, microseconds.
pub fn rose() -> Option<u64> {
    STATE.lock(|state| state.try_borrow_mut().ok()?.rose_us.take())
}
