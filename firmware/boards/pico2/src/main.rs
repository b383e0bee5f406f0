//! Raspberry Pi Pico 2 (RP2350). The sensor's line is GP0 (out) and GP1 (in), the navigation
//! computer's GP4 and GP5, the receiver's GP6 (in) at 115 200 bit/s; the command link is USB. An
//! ADIS: clock GP18, in GP16, out GP19, select GP17, data-ready GP20. Ran on no chip yet.
#![no_std]
#![no_main]

use embassy_futures::join::join;
use embassy_rp::flash::{Blocking, Flash};
use embassy_rp::gpio::{Input, Level, Output, Pull};
use embassy_rp::peripherals::{PIO0, TRNG, UART0, UART1, USB};
use embassy_rp::spi::{self, Spi};
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUart, Config};
use embassy_rp::watchdog::Watchdog;
use embassy_rp::{bind_interrupts, pio, trng, usb};
use embassy_time::Duration;
use layer::firmware::app::Lines;
use layer::firmware::configuration::SerialLines;
use layer::firmware::link::rates::Clock;
use layer::flash::Region;
use layer::line::{Port, RING};
use layer::pio::{FIXED, receiver};
use layer::{Adis, Board, WATCHDOG_MS, bytes};

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
    UART1_IRQ => BufferedInterruptHandler<UART1>;
    PIO0_IRQ_0 => pio::InterruptHandler<PIO0>;
    USBCTRL_IRQ => usb::InterruptHandler<USB>;
    TRNG_IRQ => trng::InterruptHandler<TRNG>;
});

/// A UART of the chip at 150 MHz: sixteen times the rate, in steps of a sixty-fourth.
const UART: Clock = Clock {
    hz: 600_000_000,
    least: 64,
    most: 64 * 65_535,
    listed: &[],
};
layer::main!(frame_path, embassy_rp, SWI_IRQ_1, P3);

async fn frame_path() {
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    let lines = SerialLines::DEFAULT;
    let mut config = Config::default();
    config.baudrate = lines.sensor_baud;
    macro_rules! line {
        ($uart:ident, $out:ident, $into:ident) => {
            Port::new(BufferedUart::new(
                chip.$uart,
                chip.$out,
                chip.$into,
                Interrupts,
                bytes!(RING),
                bytes!(RING),
                config,
            ))
        };
    }
    let mut bus = spi::Config::default();
    (bus.frequency, bus.polarity, bus.phase) = (
        1_000_000,
        spi::Polarity::IdleHigh,
        spi::Phase::CaptureOnSecondTransition,
    );
    let adis = Adis::new(
        Spi::new_blocking(chip.SPI0, chip.PIN_18, chip.PIN_19, chip.PIN_16, bus),
        Output::new(chip.PIN_17, Level::High),
        Input::new(chip.PIN_20, Pull::Down),
    );
    let (command, usb) = layer::usb::open(usb::Driver::new(chip.USB, Interrupts));
    let mut random = [0; 32];
    trng::Trng::new(chip.TRNG, Interrupts, trng::Config::default())
        .blocking_fill_bytes(&mut random);
    let patience = Duration::from_millis(WATCHDOG_MS.into());
    let mut watchdog = Watchdog::new(chip.WATCHDOG);
    watchdog.start(patience);
    let board = Board {
        name: "pico2",
        clocks: [UART, UART, FIXED],
        parity: false,
        lines: Lines {
            sensor: line!(UART0, PIN_0, PIN_1),
            navigation: line!(UART1, PIN_4, PIN_5),
            command,
            gnss: receiver(chip.PIO0, Interrupts, chip.PIN_6),
        },
        adis: adis.expect("a pin can be set"),
        flash: Region::<_, 0x3E_0000, 0x2_0000, 0x1_0000>::new(
            Flash::<_, Blocking, 0x40_0000>::new_blocking(chip.FLASH),
        ),
        feed: || watchdog.feed(patience),
        random: Some(random),
    };
    join(usb, layer::run(board, Some(layer::whole_learner()))).await;
}
