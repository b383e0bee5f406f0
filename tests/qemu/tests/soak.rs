//! The soak on the target sends what it sends on the desktop.
//!
//! `SOAK_HOURS` sets how long it is; some minutes without it.

use std::time::{Duration, Instant};

use qemu::images::SOAK;
use qemu::machine::{Clock, NETDUINOPLUS2, run_in};
use soak::{Memory, Plan, run};

/// Simulated time, s, if nothing else is said.
const SECONDS: u32 = 420;

#[test]
fn desktop_and_target_send_the_same_bytes() {
    let Some(image) = SOAK.build_or_skip() else {
        return;
    };
    let hours = std::env::var("SOAK_HOURS").ok();
    let hours = hours.map(|text| text.parse::<f64>().expect("SOAK_HOURS is a number"));
    let seconds = hours.map_or(SECONDS, |hours| (hours * 3600.0) as u32);
    let plan = Plan {
        seed: 1,
        seconds,
        rate: 200,
    };
    let mut memory = Box::new(Memory::ZEROED);
    let here = run(&mut memory, &plan, &mut ());
    let directory = tempfile::tempdir().expect("a directory");
    let mut input = plan.seed.to_le_bytes().to_vec();
    input.extend(plan.seconds.to_le_bytes());
    input.extend(plan.rate.to_le_bytes());
    std::fs::write(directory.path().join("input"), input).expect("it is written");
    // a simulated second takes some 0.02 s
    let limit = Duration::from_secs(200) + Duration::from_secs(seconds.into());
    let begun = Instant::now();
    let there = run_in(directory.path(), NETDUINOPLUS2, &image, Clock::Free, limit);
    let there = there.expect("it runs");
    println!(
        "{:.0} s for {seconds} s\n{}",
        begun.elapsed().as_secs_f64(),
        there.output
    );
    assert_eq!(there.code, Some(0), "{}", there.output);
    let says = |name: &str| {
        let mut lines = there.output.lines();
        lines
            .find_map(|line| line.strip_prefix(name))
            .expect("a line")
            .trim()
            .to_owned()
    };
    assert_eq!(here.violation, None);
    assert_eq!(says("violation "), "None");
    assert_eq!(says("samples "), here.samples.to_string());
    assert_eq!(says("corrected "), here.corrected.to_string());
    assert_eq!(says("digest "), here.digest.to_string(), "{here:?}");
}
