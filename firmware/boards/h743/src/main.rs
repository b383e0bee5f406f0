//! Nucleo-H743ZI2. The sensor's line is PG14 (out) and PG9 (in), the navigation computer's PD5 and
//! PD6, the receiver's PE8 and PE7; the command link is the USB socket beside the Ethernet socket.
//! An ADIS: clock PA5, in PA6, out PA7, select PD14, data-ready PF12. Time pulse:
//! PB8. Ran on no chip yet.
//!
//! An image for one of the two slots takes updates; `boot-h743` starts it. One for the flash's
//! beginning runs alone and takes none. With the feature `probe-line` the command link is the
//! probe's serial port.
#![no_std]
#![no_main]

use embassy_futures::join::join;
use embassy_stm32::flash::Flash;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Hsi48Config, Pll, PllDiv, PllMul, PllPreDiv,
    PllSource, Sysclk, VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::usb;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, dma, exti, interrupt, peripherals};
use layer::dma::Handler;
use layer::firmware::app::Lines;
use layer::firmware::configuration::SerialLines;
use layer::firmware::link::rates::Clock;
use layer::firmware::update::slots::Places;
use layer::flash::Region;
use layer::line::Frame;
use layer::update::{signer, updater};
use layer::{Board, WATCHDOG_MS, adis, crystal, line};

bind_interrupts!(struct Interrupts {
    USART6 => Handler<peripherals::USART6>;
    DMA2_STREAM1 => dma::InterruptHandler<peripherals::DMA2_CH1>;
    DMA2_STREAM6 => dma::InterruptHandler<peripherals::DMA2_CH6>;
    USART2 => Handler<peripherals::USART2>;
    DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    UART7 => Handler<peripherals::UART7>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    #[cfg(feature = "probe-line")]
    USART3 => Handler<peripherals::USART3>;
    #[cfg(feature = "probe-line")]
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    #[cfg(feature = "probe-line")]
    DMA1_STREAM2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
    EXTI15_10 => exti::InterruptHandler<interrupt::typelevel::EXTI15_10>;
    EXTI9_5 => layer::pulse::Handler;
    OTG_FS => usb::InterruptHandler<peripherals::USB_OTG_FS>;
});

/// 400 MHz from the probe's 8 MHz; 100 MHz for the UARTs. USB has an oscillator of its own.
fn clocks() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = crystal::start(Hse {
        freq: Hertz::mhz(8),
        mode: HseMode::Bypass,
    });
    let (source, prediv) = match rcc.hse {
        Some(_) => (PllSource::HSE, PllPreDiv::DIV2),
        None => (PllSource::HSI, PllPreDiv::DIV16),
    };
    rcc.hsi48 = Some(Hsi48Config {
        sync_from_usb: true,
    });
    rcc.pll1 = Some(Pll {
        source,
        prediv,
        mul: PllMul::MUL200,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8), // 100 MHz for SPI1
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale1;
    rcc.mux.usbsel = mux::Usbsel::HSI48;
    config
}

/// The command link's line, and what serves it: USB.
#[cfg(not(feature = "probe-line"))]
macro_rules! command_link {
    ($chip:ident) => {
        layer::usb::open(usb::Driver::new_fs(
            $chip.USB_OTG_FS,
            Interrupts,
            $chip.PA12,
            $chip.PA11,
            layer::bytes!(256),
            usb::Config::default(),
        ))
    };
}

/// The same at the probe's serial port, which nothing has to serve.
#[cfg(feature = "probe-line")]
macro_rules! command_link {
    ($chip:ident) => {{
        let frame = Frame::plain(layer::firmware::app::COMMAND_BAUD);
        let line = line!($chip, USART3, PD9, PD8, DMA1_CH0, DMA1_CH2, frame);
        (line, core::future::pending::<()>())
    }};
}

/// The flash, and the two slots in it (boot-h743).
type Whole<F> = Region<F, 0, 0x20_0000, 0x2_0000>;
const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [0x2_0000, 0x10_0000],
    len: 0xC_0000,
};
const SIGNER: [u8; 32] = signer(include!(concat!(env!("OUT_DIR"), "/signer.rs")));

layer::main!(frame_path, embassy_stm32, FDCAN_CAL, P15);

async fn frame_path() {
    layer::turn_caches_on();
    let chip = embassy_stm32::init(clocks());
    let lines = SerialLines::DEFAULT;
    let [sensor, receiver] = [Frame::sensor(&lines), Frame::plain(lines.receiver_baud)];
    let (command, served) = command_link!(chip);
    let mut watchdog = IndependentWatchdog::new(chip.IWDG1, WATCHDOG_MS * 1000);
    watchdog.unleash();
    layer::pulse::open(chip.PB8, chip.EXTI8, Interrupts);
    let board = Board {
        name: "h743",
        clocks: [100_000_000; 3].map(Clock::stm32),
        parity: true,
        lines: Lines {
            sensor: line!(chip, USART6, PG9, PG14, DMA2_CH1, DMA2_CH6, sensor),
            navigation: line!(chip, USART2, PD6, PD5, DMA1_CH5, DMA1_CH6, sensor),
            command,
            gnss: line!(chip, UART7, PE7, PE8, DMA1_CH3, DMA1_CH1, receiver),
        },
        adis: adis!(chip: SPI1, PA5, PA7, PA6; DMA2_CH3, DMA2_CH0; 100_000_000; PD14, PF12, EXTI12),
        // the last two sectors of the second bank: the program in the first one goes on meanwhile
        flash: Region::<_, 0x1C_0000, 0x4_0000, 0x2_0000>::new(Flash::new_blocking(chip.FLASH)),
        feed: || watchdog.pet(),
        random: layer::random::bytes(chip.RNG),
    };
    // SAFETY: the store and what takes updates are both the main thread's, which uses one at a
    // time.
    #[allow(unsafe_code, reason = "one flash for both")]
    let flash = unsafe { peripherals::FLASH::steal() };
    let updater = updater(
        Whole::new(Flash::new_blocking(flash)),
        PLACES,
        "h743",
        &SIGNER,
    );
    let learner = Some(layer::whole_learner() as _);
    join(served, layer::run_updatable(board, learner, updater)).await;
}
