//! Nucleo-F446RE. The sensor's line is PA9 (out) and PA10 (in), the navigation computer's PC10 and
//! PC11, the receiver's PC6 and PC7. The command link is the probe's serial port (PA2 and PA3). An
//! ADIS: clock PA5, in PA6, out PA7, select PB6, data-ready PC4. Time pulse: PB8. Ran on
//! no chip yet.
#![no_std]
#![no_main]

use embassy_stm32::flash::Flash;
use embassy_stm32::rcc::{
    APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, dma, exti, interrupt, peripherals};
use layer::dma::Handler;
use layer::firmware::app::{COMMAND_BAUD, Lines};
use layer::firmware::configuration::SerialLines;
use layer::firmware::link::rates::Clock;
use layer::flash::Region;
use layer::line::Frame;
use layer::{Board, WATCHDOG_MS, adis, crystal, line};

bind_interrupts!(struct Interrupts {
    USART1 => Handler<peripherals::USART1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
    USART2 => Handler<peripherals::USART2>;
    DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    USART3 => Handler<peripherals::USART3>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    USART6 => Handler<peripherals::USART6>;
    DMA2_STREAM1 => dma::InterruptHandler<peripherals::DMA2_CH1>;
    DMA2_STREAM6 => dma::InterruptHandler<peripherals::DMA2_CH6>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    EXTI4 => exti::InterruptHandler<interrupt::typelevel::EXTI4>;
    EXTI9_5 => layer::pulse::Handler;
});

/// 168 MHz from the probe's 8 MHz; 84 and 42 MHz for the UARTs.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = crystal::start(Hse {
        freq: Hertz::mhz(8),
        mode: HseMode::Bypass,
    });
    let (source, prediv) = match config.rcc.hse {
        Some(_) => (PllSource::HSE, PllPreDiv::DIV8),
        None => (PllSource::HSI, PllPreDiv::DIV16),
    };
    config.rcc.pll_src = source;
    config.rcc.pll = Some(Pll {
        prediv,
        mul: PllMul::MUL336,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

layer::main!(frame_path, embassy_stm32, CAN1_SCE, P15);

async fn frame_path() {
    let chip = embassy_stm32::init(clocks());
    let lines = SerialLines::DEFAULT;
    let [sensor, receiver, command] = [
        Frame::sensor(&lines),
        Frame::plain(lines.receiver_baud),
        Frame::plain(COMMAND_BAUD),
    ];
    let mut watchdog = IndependentWatchdog::new(chip.IWDG, WATCHDOG_MS * 1000);
    watchdog.unleash();
    layer::pulse::open(chip.PB8, chip.EXTI8, Interrupts);
    let board = Board {
        name: "f446",
        clocks: [84_000_000, 42_000_000, 84_000_000].map(Clock::stm32),
        parity: true,
        lines: Lines {
            sensor: line!(chip, USART1, PA10, PA9, DMA2_CH2, DMA2_CH7, sensor),
            navigation: line!(chip, USART3, PC11, PC10, DMA1_CH1, DMA1_CH3, sensor),
            command: line!(chip, USART2, PA3, PA2, DMA1_CH5, DMA1_CH6, command),
            gnss: line!(chip, USART6, PC7, PC6, DMA2_CH1, DMA2_CH6, receiver),
        },
        adis: adis!(chip: SPI1, PA5, PA7, PA6; DMA2_CH3, DMA2_CH0; 84_000_000; PB6, PC4, EXTI4),
        // sectors 2 and 3 of 16 KiB, between the interrupt table and the program
        flash: Region::<_, 0x8000, 0x8000, 0x4000>::new(
            Flash::new_blocking(chip.FLASH)
                .into_blocking_regions()
                .bank1_region1,
        ),
        feed: || watchdog.pet(),
        random: None,
    };
    layer::run(board, Some(layer::small_learner())).await;
}
