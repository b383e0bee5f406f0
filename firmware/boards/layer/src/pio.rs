//! A third line for the RP2350, which has two UARTs: the receiver's, only in, by PIO0.
//!
//! The driver has room for eight bytes, 0.7 ms at 115 200 bit/s. So its task is above the loop.

use embassy_executor::InterruptExecutor;
use embassy_rp::Peri;
use embassy_rp::interrupt::typelevel::Binding;
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::peripherals::PIO0;
use embassy_rp::pio::{InterruptHandler, Pio, PioPin};
use embassy_rp::pio_programs::uart::{PioUartRx, PioUartRxProgram};
use firmware::link::rates::Clock;

use crate::through::{Through, ThroughLine};

/// Its only rate, bit/s.
const BAUD: u32 = 115_200;
/// The only rate, for the application, which then refuses another one.
pub const FIXED: Clock = Clock {
    hz: BAUD,
    least: 1,
    most: 1,
    listed: &[],
};

static ABOVE: InterruptExecutor = InterruptExecutor::new();
static RECEIVER: Through = Through::new();

#[embassy_rp::interrupt]
#[allow(
    unsafe_code,
    reason = "the executor of this interrupt, and nobody else's"
)]
fn SWI_IRQ_0() {
    // SAFETY: this is the interrupt that `ABOVE` is started with.
    unsafe { ABOVE.on_interrupt() }
}

#[embassy_executor::task]
async fn receive(mut line: PioUartRx<'static, PIO0, 0>) {
    loop {
        RECEIVER.came(line.read_u8().await);
    }
}

/// Opens it at a pin. Called once.
///
/// # Panics
/// It is called again.
pub fn receiver(
    pio: Peri<'static, PIO0>,
    interrupts: impl Binding<<PIO0 as embassy_rp::pio::Instance>::Interrupt, InterruptHandler<PIO0>>,
    pin: Peri<'static, impl PioPin>,
) -> ThroughLine {
    let Pio {
        mut common, sm0, ..
    } = Pio::new(pio, interrupts);
    let program = PioUartRxProgram::new(&mut common);
    let line = PioUartRx::new(BAUD, &mut common, sm0, pin, &program);
    interrupt::SWI_IRQ_0.set_priority(Priority::P2);
    let task = receive(line).expect("called once");
    ABOVE.start(interrupt::SWI_IRQ_0).spawn(task);
    RECEIVER.line()
}
