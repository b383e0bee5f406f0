//! Software in the loop: the application of the firmware on the desktop, with the input of the
//! board.

use super::memory::{MemoryLine, SetClock};
use firmware::app::{App, Config, Lines};
use firmware::configuration::Configuration;
use firmware::link::NoLine;
use firmware::model::Nets;
use firmware::wire::command::{MAX_PACKET, Request, encode};
use lrnn_nostd::{Net, Normalisation, Weights};

/// The application with its lines and time.
#[derive(Debug)]
pub struct Software {
    app: App<'static>,
    lines: Lines<MemoryLine, MemoryLine, MemoryLine, NoLine>,
    now: SetClock,
}

impl Software {
    /// Software in the same state as a board that has just been configured.
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        Self {
            app: App::new(Config::of(configuration)),
            lines: Lines::default(),
            now: SetClock(0),
        }
    }

    /// Receives bytes of the sensor at `at_us`. Returns the bytes for the navigation computer.
    pub fn sensor(&mut self, at_us: u32, bytes: &[u8]) -> Vec<u8> {
        self.now.0 = at_us.into();
        self.lines.sensor.received.extend(bytes);
        self.settle();
        core::mem::take(&mut self.lines.navigation.sent)
    }

    /// Receives a request over the command link.
    pub fn command(&mut self, request: &Request) {
        let mut packet = [0; MAX_PACKET];
        if let Ok(packet) = encode(0, request, &mut packet) {
            self.lines.command.received.extend(&*packet);
        }
        self.settle();
        self.lines.command.sent.clear();
    }

    /// Runs the application until it has nothing to do.
    fn settle(&mut self) {
        while self.app.poll(&mut self.lines, &self.now) {}
        // requests for the configuration of the sensor, which the drive contains anyway
        self.lines.sensor.sent.clear();
    }
}

/// Networks that correct by up to about 1 deg/h and 100 ug. They are useless for navigation, but
/// every sample depends on their state.
#[must_use]
pub fn nets() -> Nets {
    let weights = Weights::from_fn(|index| ((index * 37 + 11) % 129) as f32 / 128.0 - 0.5);
    let net = |input_scale: f32, output_scale: f32| -> Net {
        Net::new(
            weights,
            Normalisation {
                input_offset: [0.0; 3],
                input_scale: [input_scale; 3],
                output_scale: [output_scale; 3],
            },
        )
    };
    Nets {
        gyro: net(2.0, 5e-6),
        accel: net(0.1, 1e-3),
        ..Nets::NONE
    }
}
