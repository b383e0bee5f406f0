//! nRF52840-DK, or any board with these pins. The sensor's line is P1.02 (out) and P1.01 (in), the
//! navigation computer's P1.04 and P1.03; the command link is USB. The chip has no third UART, so
//! there is no receiver. An ADIS: clock P1.15, in P1.14, out P1.13, select P1.12, data-ready P1.11.
//! Ran on no chip yet.
#![no_std]
#![no_main]

use embassy_futures::join::join;
use embassy_nrf::buffered_uarte::{self, BufferedUarte};
use embassy_nrf::config::{Config, HfclkSource};
use embassy_nrf::gpio::{Input, Level, Output, OutputDrive, Pull};
use embassy_nrf::nvmc::Nvmc;
use embassy_nrf::peripherals::{SPI3, UARTE0, UARTE1, USBD};
use embassy_nrf::rng::Rng;
use embassy_nrf::spim::{self, Spim};
use embassy_nrf::usb::vbus_detect::{self, HardwareVbusDetect};
use embassy_nrf::usb::{self, Driver};
use embassy_nrf::wdt::{self, Watchdog};
use embassy_nrf::{bind_interrupts, uarte};
use layer::firmware::app::Lines;
use layer::firmware::configuration::SerialLines;
use layer::firmware::link::NoLine;
use layer::firmware::link::rates::Clock;
use layer::flash::Region;
use layer::line::{self, Port, RING, rate};
use layer::{Adis, Board, WATCHDOG_MS, bytes};

bind_interrupts!(struct Interrupts {
    UARTE0 => buffered_uarte::InterruptHandler<UARTE0>;
    UARTE1 => buffered_uarte::InterruptHandler<UARTE1>;
    SPIM3 => spim::InterruptHandler<SPI3>;
    USBD => usb::InterruptHandler<USBD>;
    CLOCK_POWER => vbus_detect::InterruptHandler;
});

layer::main!(frame_path, embassy_nrf, EGU0_SWI0, P7);

async fn frame_path() {
    let mut clocks = Config::default();
    clocks.hfclk_source = HfclkSource::ExternalXtal;
    let chip = embassy_nrf::init(clocks);
    let mut config = uarte::Config::default();
    config.baudrate = rate(SerialLines::DEFAULT.sensor_baud);
    macro_rules! line {
        ($uart:ident, $timer:ident, $first:ident, $second:ident, $group:ident, $into:ident, $out:ident) => {
            Port::new(BufferedUarte::new(
                chip.$uart,
                chip.$timer,
                chip.$first,
                chip.$second,
                chip.$group,
                chip.$into,
                chip.$out,
                Interrupts,
                config.clone(),
                bytes!(RING),
                bytes!(RING),
            ))
        };
    }
    let mut bus = spim::Config::default();
    (bus.frequency, bus.mode) = (spim::Frequency::M1, spim::MODE_3);
    let adis = Adis::new(
        Spim::new(
            chip.SPI3, Interrupts, chip.P1_15, chip.P1_14, chip.P1_13, bus,
        ),
        Output::new(chip.P1_12, Level::High, OutputDrive::Standard),
        Input::new(chip.P1_11, Pull::Down),
    );
    let driver = Driver::new(chip.USBD, Interrupts, HardwareVbusDetect::new(Interrupts));
    let (command, usb) = layer::usb::open(driver);
    let mut random = [0; 32];
    Rng::new_blocking(chip.RNG).blocking_fill_bytes(&mut random);
    let mut patience = wdt::Config::default();
    patience.timeout_ticks = WATCHDOG_MS * 32_768 / 1000;
    let watchdog = Watchdog::try_new(chip.WDT, patience);
    let mut watchdog = watchdog.ok().map(|(_, [handle])| handle);
    let board = Board {
        name: "nrf52840",
        // the second one would stand for the command link's, too, which is USB
        clocks: [line::CLOCK, Clock::ANY, Clock::ANY],
        parity: false,
        lines: Lines {
            sensor: line!(UARTE0, TIMER1, PPI_CH0, PPI_CH1, PPI_GROUP0, P1_01, P1_02),
            navigation: line!(UARTE1, TIMER2, PPI_CH2, PPI_CH3, PPI_GROUP1, P1_03, P1_04),
            command,
            gnss: NoLine,
        },
        adis: adis.expect("a pin can be set"),
        flash: Region::<_, 0xE_0000, 0x2_0000, 0x1_0000>::new(Nvmc::new(chip.NVMC)),
        feed: || {
            if let Some(watchdog) = &mut watchdog {
                watchdog.pet();
            }
        },
        random: Some(random),
    };
    join(usb, layer::run(board, Some(layer::whole_learner()))).await;
}
