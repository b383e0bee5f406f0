//! A loop of one's own: the frame path in a task of an RTIC program, and the learner in its idle
//! task. The interrupts of the two UARTs move bytes between `stm32f4xx-hal` and the rings of
//! `firmware::link::uart`, and trigger the frame path. It corrects with the networks that it is
//! built with, has neither store nor receiver, and is commanded over no line. STM32F405 on its
//! internal oscillator; the sensor is at PA9 and PA10, the navigation computer at PA2 and PA3.
#![no_std]
#![no_main]

use cortex_m::peripheral::SCB;
use defmt_rtt as _;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    SCB::sys_reset()
}

/// The program.
#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod program {
    use core::cell::Cell;

    use cortex_m::peripheral::NVIC;
    use cortex_m::peripheral::syst::SystClkSource;
    use firmware::app::{App, Config, Lines};
    use firmware::learn::WindowLearner;
    use firmware::learn::exchange::{Background, Exchange};
    use firmware::link::uart::{Port, Uart};
    use firmware::link::{Clock, NoLine};
    use static_cell::StaticCell;
    use stm32f4xx_hal::pac::{Interrupt, TIM5, USART1, USART2};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc;
    use stm32f4xx_hal::serial::{Config as Rate, Event, Serial};
    use stm32f4xx_hal::timer::CounterUs;

    /// Between interrupts and loop.
    static SENSOR: Uart = Uart::new();
    static NAVIGATION: Uart = Uart::new();

    /// Microseconds, of a counter that turns over after 71 minutes.
    struct Time {
        counter: CounterUs<TIM5>,
        seen: Cell<(u32, u64)>,
    }

    impl Clock for Time {
        fn now_us(&self) -> u64 {
            let now = self.counter.now().ticks();
            let (last, all) = self.seen.get();
            let all = all + u64::from(now.wrapping_sub(last));
            self.seen.set((now, all));
            all
        }
    }

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        app: &'static mut App<'static>,
        background: Option<Background<'static>>,
        sensor: Serial<USART1>,
        navigation: Serial<USART2>,
        lines: Lines<Port<'static>, Port<'static>, NoLine, NoLine>,
        time: Time,
    }

    #[init(local = [
        application: StaticCell<App<'static>> = StaticCell::new(),
        learner: WindowLearner = WindowLearner::new(),
        exchange: Exchange = Exchange::new(),
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let init::LocalResources {
            application,
            learner,
            exchange,
            ..
        } = context.local;
        // made where it stays: it is too large to be on the stack twice
        let app = application.init_with(|| App::with_learner(Config::default(), Some(learner)));
        let background = app.split(exchange);
        let chip = context.device;
        let mut rcc = chip.RCC.freeze(rcc::Config::hsi());
        let pins = chip.GPIOA.split(&mut rcc);
        let rate = || Rate::default().baudrate(460_800.bps());
        let sensor = Serial::new(chip.USART1, (pins.pa9, pins.pa10), rate(), &mut rcc);
        let navigation = Serial::new(chip.USART2, (pins.pa2, pins.pa3), rate(), &mut rcc);
        let (Ok(mut sensor), Ok(mut navigation)) = (sensor, navigation) else {
            panic!("rates that the clock can make");
        };
        sensor.listen(Event::RxNotEmpty);
        navigation.listen(Event::RxNotEmpty);
        let mut counter = chip.TIM5.counter_us(&mut rcc);
        let started = counter.start(u32::MAX.micros());
        assert!(started.is_ok(), "the longest period");
        // once a millisecond the loop has its turn
        context.core.SYST.set_clock_source(SystClkSource::Core);
        context
            .core
            .SYST
            .set_reload(rcc.clocks.hclk().raw() / 1000 - 1);
        context.core.SYST.clear_current();
        context.core.SYST.enable_counter();
        context.core.SYST.enable_interrupt();
        let lines = Lines {
            sensor: SENSOR.port(|| NVIC::pend(Interrupt::USART1)),
            navigation: NAVIGATION.port(|| NVIC::pend(Interrupt::USART2)),
            command: NoLine,
            gnss: NoLine,
        };
        let time = Time {
            counter,
            seen: Cell::new((0, 0)),
        };
        let local = Local {
            app,
            background,
            sensor,
            navigation,
            lines,
            time,
        };
        (Shared {}, local)
    }

    /// The frame path. The interrupt is one that this program does not use otherwise.
    #[task(binds = CAN1_SCE, priority = 1, local = [app, lines, time])]
    fn correct(context: correct::Context) {
        let correct::LocalResources {
            app, lines, time, ..
        } = context.local;
        while app.poll(lines, time) || !lines.sensor.want(app.needs()) {}
    }

    /// The learner.
    #[idle(local = [background])]
    fn idle(context: idle::Context) -> ! {
        let background = context.local.background;
        loop {
            while background.as_mut().is_some_and(Background::turn) {}
            // masked, so that nothing comes between the question and the sleep; it still wakes
            cortex_m::interrupt::free(|_| {
                if !background.as_ref().is_some_and(Background::waits) {
                    cortex_m::asm::wfi();
                }
            });
        }
    }

    #[task(binds = SysTick, priority = 2)]
    fn tick(_: tick::Context) {
        NVIC::pend(Interrupt::CAN1_SCE);
    }

    /// Both interrupts have one priority, so that none interrupts the other.
    #[task(binds = USART1, priority = 2, local = [sensor])]
    fn usart1(context: usart1::Context) {
        serve(context.local.sensor, &SENSOR);
    }

    #[task(binds = USART2, priority = 2, local = [navigation])]
    fn usart2(context: usart2::Context) {
        serve(context.local.navigation, &NAVIGATION);
    }

    /// Takes the byte that came, and gives the one that is to leave.
    fn serve<U: stm32f4xx_hal::serial::Instance>(serial: &mut Serial<U>, line: &Uart) {
        use stm32f4xx_hal::nb;
        match serial.read() {
            Ok(byte) => {
                if line.came(byte) {
                    NVIC::pend(Interrupt::CAN1_SCE);
                }
            }
            Err(nb::Error::WouldBlock) => {}
            Err(nb::Error::Other(_)) => {
                line.lost();
                NVIC::pend(Interrupt::CAN1_SCE);
            }
        }
        if !serial.is_tx_empty() {
            return;
        }
        match line.next() {
            Some(byte) => {
                let _ = serial.write(byte); // there is room
                serial.listen(Event::TxEmpty);
            }
            None => serial.unlisten(Event::TxEmpty),
        }
    }
}
