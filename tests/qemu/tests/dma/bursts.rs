//! An ADIS at the SPI of a board over `embassy-stm32` (`firmware/boards/f405`), whose asynchronous
//! SPI moves the bursts by DMA: the bytes at the sensor's rates, the cost, and the counters after
//! failures.

use std::path::PathBuf;

use firmware::wire::command::Request;
use qemu::boards::Family;
use qemu::budget::Budgets;
use qemu::protocol::packet_of;
use serde_json::json;

use super::adis::{SENSORS, bytes, configuration, cost, counters, sets_rates};
use super::*;

/// Interrupt at the end of the DMA stream to the SPI.
const OUT_END: i32 = 59;

fn f405() -> Option<(PathBuf, PathBuf)> {
    let python = python()?;
    let board = Family::named("f405").expect("a board");
    Some((python, board.build().expect("it builds")))
}

/// Both sensors at their fastest: each data-ready brings a burst, and each burst leaves unchanged.
/// Two interrupts end a burst, since the driver waits for both streams.
#[test]
fn all_bursts_leave_at_the_fastest_rates() {
    let Some((python, image)) = f405() else {
        return;
    };
    for (sensor, rate) in SENSORS.iter().zip([2000, 4250]) {
        let frames = sensor.bursts(200);
        let commands = configure(&configuration(sensor, f64::from(rate))).expect("packets");
        let description = sensor.description();
        let pace = (1000 * MILLISECOND / rate, 3_000_000);
        let done = run(&python, &image, &commands, &frames, pace, &description);
        let name = sensor.product;
        println!("ADIS{name} at {rate} a second: {:?}", done.served);
        assert!(done.sent == bytes(&frames), "{name}: {}", done.sent.len());
        assert_eq!(done.decimation, Some(0), "{name}");
        let counts = [DATA_READY, BURST_END, OUT_END].map(|number| done.served(number));
        assert_eq!(counts, [200; 3], "{name}");
    }
}

/// As on the board `stm32f405`, which takes 2 ms less because each of its transfers begins at once.
#[test]
fn the_configured_rate_is_set_over_their_spi() {
    if let Some((python, image)) = f405() {
        sets_rates(&python, &image, 3);
    }
}

/// A transfer that hangs is aborted before the next data-ready, and the SPI is reopened: only its
/// burst is lost.
#[test]
fn a_transfer_that_hangs_costs_its_burst() {
    let Some((python, image)) = f405() else {
        return;
    };
    let request = hex(&packet_of(1, &Request::GetCounters).expect("a packet"));
    for sensor in SENSORS {
        let frames = sensor.bursts(60);
        let mut adis = sensor.description();
        (adis["hangs"], adis["silent"]) = (json!([20]), json!([40]));
        let world = json!({"adis": adis, "ask": [request]});
        let done = run_in(&python, &image, &[], &frames, (MILLISECOND, BAUD), &world);
        let intact: Vec<Record> = (0..60)
            .filter(|n| ![20, 40].contains(n))
            .map(|n| frames[n].clone())
            .collect();
        let name = sensor.product;
        assert!(done.sent == bytes(&intact), "{name}: {}", done.sent);
        let counted = counters(&done.command);
        let all = (counted.lost, counted.missed, counted.frames);
        assert_eq!(all, (1, 2, 58), "{name}: {counted:?}");
    }
}

/// The cost of a burst at 2000 and at 4000 bursts a second is within its budget.
#[test]
fn a_burst_over_their_spi_costs_its_budget() {
    let Some((python, image)) = f405() else {
        return;
    };
    let budget = Budgets::read().expect("budgets.toml").adis;
    for (hz, sensor, most) in [
        (2000, &SENSORS[0], budget.over_embassy_2000),
        (4000, &SENSORS[1], budget.over_embassy_4000),
    ] {
        let period = 1000 * MILLISECOND / hz;
        let spi = json!({"adis": sensor.description()});
        let burst = cost(&python, &image, spi, &sensor.bursts(200), period);
        println!(
            "ADIS{} over embassy at {hz} a second: {burst:.0} instructions a burst",
            sensor.product
        );
        assert!(burst <= most, "{hz}: {burst}");
    }
}
