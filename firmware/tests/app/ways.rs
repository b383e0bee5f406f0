//! Every way into a fault of the sensor and out of it, on a line and at the SPI, in any order.

use crate::frames::Kind;
use crate::taught::Bench;
use crate::transitions::{BLOCK, SLEW, STORED, State, begun, damaged, fastest, noise};
use firmware::app::Phase;
use firmware::control::{Alignment, Mode};
use firmware::wire::command::fault;
use proptest::prelude::*;

#[derive(Debug, Clone, Copy)]
enum Disturbance {
    /// Frames with wrong checksums for this time, s.
    Damage(f64),
    /// This number of frames is missing.
    Missing(u32),
    /// This number of frames comes again and again.
    Stuck(u32),
    /// This number of bytes of no format on the sensor's line.
    Noise(u32),
    /// This number of frames of another sensor on its line.
    Another(u32),
    /// No byte for this time, ms; less than a power cycle.
    Silence(u64),
    /// The output has no room for this number of frames.
    Full(u32),
    /// The board lost bytes.
    Lost,
    /// The navigation computer asks for the service mode of another sensor.
    Service,
}

fn ways() -> impl Strategy<Value = Vec<Disturbance>> {
    let way = prop_oneof![
        (0.1..7.0).prop_map(Disturbance::Damage),
        (1..60u32).prop_map(Disturbance::Missing),
        (1..60u32).prop_map(Disturbance::Stuck),
        (1..12_000u32).prop_map(Disturbance::Noise),
        (1..200u32).prop_map(Disturbance::Another),
        (1..900u64).prop_map(Disturbance::Silence),
        (1..30u32).prop_map(Disturbance::Full),
        Just(Disturbance::Lost),
        Just(Disturbance::Service),
    ];
    prop::collection::vec(way, 1..6)
}

impl Disturbance {
    /// Goes there. What comes out meanwhile counts, as far as it is a frame of the sensor.
    fn into_it(self, bench: &mut Bench) {
        match self {
            Disturbance::Damage(seconds) => damaged(bench, seconds),
            Disturbance::Missing(frames) => bench.n += frames,
            Disturbance::Stuck(times) => {
                for _ in 0..times {
                    bench.step(1.0);
                    bench.n -= 1;
                }
            }
            Disturbance::Noise(bytes) => noise(bench, bytes),
            Disturbance::Another(frames) => {
                for frame in Kind::KVH.stream(0, frames) {
                    bench.device.feed(&frame);
                    bench.device.pass_us(1000);
                }
                bench.device.lines.navigation.sent.clear();
            }
            Disturbance::Silence(ms) => bench.device.wait_ms(ms),
            Disturbance::Full(frames) => {
                bench.device.lines.navigation.room = 0;
                (0..frames).for_each(|_| bench.step(1.0));
                bench.device.lines.navigation.room = usize::MAX;
            }
            Disturbance::Lost => bench.device.app.lost(),
            Disturbance::Service => {
                let bytes = b"SERVICEMODE\r";
                bench.device.lines.navigation.input.extend(bytes);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Out of every fault of the sensor the good frames lead back, at once and with the correction
    /// that was in force, on the sensor's line as at the SPI.
    #[test]
    fn good_frames_lead_out_of_every_fault(ways in ways(), spi: bool) {
        let kind = if spi { Kind::SPI } else { Kind::RAWIMUSX };
        let mut bench = begun(kind, State::Frozen, Some(Alignment::Finished));
        for way in ways {
            way.into_it(&mut bench);
            bench.run(0.3);
            let app = &bench.device.app;
            prop_assert_eq!(app.phase(), Phase::Run(Mode::Frozen), "{:?}", way);
            // a window of the rate goes over the time that was lost
            let now = app.faults() & !fault::RATE;
            prop_assert_eq!(now, 0, "{:?}", way);
        }
        let seen = bench.take();
        let (count, last) = (1.01 * bench.count(), seen.last().expect("words"));
        prop_assert!(fastest(&seen) <= f64::from(SLEW * BLOCK) * 1.001 + count, "{:?}", seen);
        if bench.device.app.faults() & fault::RATE == 0 {
            prop_assert!((last - f64::from(STORED)).abs() <= count, "{}", last);
        }
    }
}
