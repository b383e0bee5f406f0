//! A loop of one's own: the application as a task of an embassy program that has other work, too.
//! The frame path interrupts the main thread, which has the learner and the other work. It corrects
//! with the networks that it is built with, has neither store nor receiver, and is commanded over
//! no line. STM32F405 on its internal oscillator; the sensor is at PA9 and PA10, the
//! navigation computer at PA2 and PA3.
#![no_std]
#![no_main]

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_futures::select::select3;
use embassy_futures::yield_now;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::{Peri, bind_interrupts, dma, interrupt, peripherals};
use embassy_time::{Instant, Timer};
use layer::dma::{Handler, Port};
use layer::firmware::app::{App, Config, Lines};
use layer::firmware::learn::exchange::Background;
use layer::firmware::link::{Clock, NoLine};
use layer::line::{Frame, Wire};
use layer::{learners, line};
use static_cell::StaticCell;

bind_interrupts!(struct Interrupts {
    USART1 => Handler<peripherals::USART1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
    USART2 => Handler<peripherals::USART2>;
    DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
});

/// The time that the application asks for.
struct Now;

impl Clock for Now {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }
}

/// The frame path, in the executor of an interrupt: nothing in the main thread delays a frame.
#[embassy_executor::task]
async fn correct(app: &'static mut App<'static>, sensor: Port, navigation: Port) {
    let mut lines = Lines {
        sensor,
        navigation,
        command: NoLine,
        gnss: NoLine,
    };
    loop {
        while app.poll(&mut lines, &Now) {
            yield_now().await;
        }
        // at least once a millisecond, as `App::poll` asks
        let arrived = (lines.sensor.arrived(), lines.navigation.arrived());
        select3(arrived.0, arrived.1, Timer::after_millis(1)).await;
    }
}

/// The learner, in the main thread beside the other work. An order takes some milliseconds at most,
/// for which other tasks of the thread wait.
#[embassy_executor::task]
async fn learn(mut background: Background<'static>) {
    loop {
        if background.turn() {
            yield_now().await;
        } else {
            Timer::after_millis(1).await;
        }
    }
}

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();
/// Made where it stays: a task would hold each copy that it passes on.
static APP: StaticCell<App<'static>> = StaticCell::new();

/// An interrupt that this program does not use otherwise.
#[interrupt]
#[allow(unsafe_code, reason = "the executor asks for it")]
unsafe fn CAN1_SCE() {
    // SAFETY: this is the interrupt's handler, and it comes only after `start`.
    unsafe { EXECUTOR.on_interrupt() }
}

/// What the two lines need of the chip.
#[allow(non_snake_case, reason = "the names of the chip's parts")]
struct Parts {
    USART1: Peri<'static, peripherals::USART1>,
    PA10: Peri<'static, peripherals::PA10>,
    PA9: Peri<'static, peripherals::PA9>,
    DMA2_CH2: Peri<'static, peripherals::DMA2_CH2>,
    DMA2_CH7: Peri<'static, peripherals::DMA2_CH7>,
    USART2: Peri<'static, peripherals::USART2>,
    PA3: Peri<'static, peripherals::PA3>,
    PA2: Peri<'static, peripherals::PA2>,
    DMA1_CH5: Peri<'static, peripherals::DMA1_CH5>,
    DMA1_CH6: Peri<'static, peripherals::DMA1_CH6>,
}

/// Opens the lines where they are used: they cannot be sent to another executor.
#[embassy_executor::task]
#[allow(unsafe_code, reason = "the executor asks for it")]
async fn begin(app: &'static mut App<'static>, chip: Parts) {
    // SAFETY: the executor's own context.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    let frame = Frame::plain(460_800);
    let sensor = line!(chip, USART1, PA10, PA9, DMA2_CH2, DMA2_CH7, frame);
    let navigation = line!(chip, USART2, PA3, PA2, DMA1_CH5, DMA1_CH6, frame);
    spawner.spawn(correct(app, sensor, navigation).expect("one such task"));
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let chip = embassy_stm32::init(embassy_stm32::Config::default());
    let parts = Parts {
        USART1: chip.USART1,
        PA10: chip.PA10,
        PA9: chip.PA9,
        DMA2_CH2: chip.DMA2_CH2,
        DMA2_CH7: chip.DMA2_CH7,
        USART2: chip.USART2,
        PA3: chip.PA3,
        PA2: chip.PA2,
        DMA1_CH5: chip.DMA1_CH5,
        DMA1_CH6: chip.DMA1_CH6,
    };
    let learner = layer::small_learner();
    let app = APP.init_with(|| App::with_learner(Config::default(), Some(learner)));
    if let Some(background) = learners::apart(app) {
        spawner.spawn(learn(background).expect("one such task"));
    }
    // below all others, above the main thread
    interrupt::CAN1_SCE.set_priority(Priority::P15);
    let above = EXECUTOR.start(interrupt::CAN1_SCE);
    above.spawn(begin(app, parts).expect("one such task"));
    // the other work
    let mut lamp = Output::new(chip.PC1, Level::Low, Speed::Low);
    loop {
        lamp.toggle();
        Timer::after_millis(500).await;
    }
}
