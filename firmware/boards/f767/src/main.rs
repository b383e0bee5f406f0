//! Nucleo-F767ZI. The sensor's line is PG14 (out) and PG9 (in), the navigation computer's PD5 and
//! PD6, the receiver's PE8 and PE7; the command link is the USB socket beside the Ethernet socket.
//! An ADIS: clock PA5, in PA6, out PA7, select PD14, data-ready PF12. Time pulse:
//! PB8. Ran on no chip yet.
#![no_std]
#![no_main]

use embassy_futures::join::join;
use embassy_stm32::flash::Flash;
use embassy_stm32::rcc::{
    APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::usb::{self, Driver};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, dma, exti, interrupt, peripherals};
use layer::dma::Handler;
use layer::firmware::app::Lines;
use layer::firmware::configuration::SerialLines;
use layer::firmware::link::rates::Clock;
use layer::flash::Region;
use layer::line::Frame;
use layer::{Board, WATCHDOG_MS, adis, bytes, crystal, line};

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
    EXTI15_10 => exti::InterruptHandler<interrupt::typelevel::EXTI15_10>;
    EXTI9_5 => layer::pulse::Handler;
    OTG_FS => usb::InterruptHandler<peripherals::USB_OTG_FS>;
});

/// 216 MHz from the probe's 8 MHz; 108 and 54 MHz for the UARTs, 48 MHz for USB.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = crystal::start(Hse {
        freq: Hertz::mhz(8),
        mode: HseMode::Bypass,
    });
    let (source, prediv) = match config.rcc.hse {
        Some(_) => (PllSource::HSE, PllPreDiv::DIV4),
        None => (PllSource::HSI, PllPreDiv::DIV8),
    };
    config.rcc.pll_src = source;
    config.rcc.pll = Some(Pll {
        prediv,
        mul: PllMul::MUL216,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV9),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.mux.clk48sel = mux::Clk48sel::PLL1_Q;
    config
}

layer::main!(frame_path, embassy_stm32, CAN1_SCE, P15);

async fn frame_path() {
    layer::turn_caches_on();
    let chip = embassy_stm32::init(clocks());
    let lines = SerialLines::DEFAULT;
    let [sensor, receiver] = [Frame::sensor(&lines), Frame::plain(lines.receiver_baud)];
    let driver = Driver::new_fs(
        chip.USB_OTG_FS,
        Interrupts,
        chip.PA12,
        chip.PA11,
        bytes!(256),
        usb::Config::default(),
    );
    let (command, usb) = layer::usb::open(driver);
    let mut watchdog = IndependentWatchdog::new(chip.IWDG, WATCHDOG_MS * 1000);
    watchdog.unleash();
    layer::pulse::open(chip.PB8, chip.EXTI8, Interrupts);
    let board = Board {
        name: "f767",
        clocks: [108_000_000, 54_000_000, 54_000_000].map(Clock::stm32),
        parity: true,
        lines: Lines {
            sensor: line!(chip, USART6, PG9, PG14, DMA2_CH1, DMA2_CH6, sensor),
            navigation: line!(chip, USART2, PD6, PD5, DMA1_CH5, DMA1_CH6, sensor),
            command,
            gnss: line!(chip, UART7, PE7, PE8, DMA1_CH3, DMA1_CH1, receiver),
        },
        adis: adis!(chip: SPI1, PA5, PA7, PA6; DMA2_CH3, DMA2_CH0; 108_000_000; PD14, PF12, EXTI12),
        // sectors 10 and 11 of 256 KiB
        flash: Region::<_, 0x18_0000, 0x8_0000, 0x4_0000>::new(Flash::new_blocking(chip.FLASH)),
        feed: || watchdog.pet(),
        random: layer::random::bytes(chip.RNG),
    };
    join(usb, layer::run(board, Some(layer::whole_learner()))).await;
}
