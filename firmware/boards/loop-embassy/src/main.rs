//! A loop of one's own: the application as a task of an embassy program that has other work, too.
//! It corrects with the networks that it is built with, has neither store nor receiver, and is
//! commanded over no line. STM32F405 on its internal oscillator; the sensor is at PA9 and PA10, the
//! navigation computer at PA2 and PA3.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_futures::select::select3;
use embassy_futures::yield_now;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_time::{Instant, Timer};
use layer::dma::{Handler, Port};
use layer::firmware::app::{App, Config, Lines};
use layer::firmware::link::{Clock, NoLine};
use layer::line;
use layer::line::{Frame, Wire};

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

/// The co-processor. It never waits for long, so that other tasks have their turn.
#[embassy_executor::task]
async fn correct(sensor: Port, navigation: Port) {
    let mut app = App::new(Config::default());
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

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let chip = embassy_stm32::init(embassy_stm32::Config::default());
    let frame = Frame::plain(460_800);
    let lines = (
        line!(chip, USART1, PA10, PA9, DMA2_CH2, DMA2_CH7, frame),
        line!(chip, USART2, PA3, PA2, DMA1_CH5, DMA1_CH6, frame),
    );
    spawner.spawn(correct(lines.0, lines.1).expect("one such task"));
    // the other work
    let mut lamp = Output::new(chip.PC1, Level::Low, Speed::Low);
    loop {
        lamp.toggle();
        Timer::after_millis(500).await;
    }
}
