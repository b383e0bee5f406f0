//! The soak on the target sends what it sends on the desktop.
//!
//! `SOAK_HOURS` sets how long it is; some minutes without it.

use std::time::{Duration, Instant};

use qemu::images::SOAK;
use qemu::machine::{Clock, MPS2_AN386, run_in};
use soak::{Memory, Plan, Report, Watch, run};

/// Simulated time, s, without `SOAK_HOURS`.
const SECONDS: u32 = 420;

/// The digests of the lines after each minute.
struct Minutes(Vec<String>);

impl Watch for Minutes {
    fn minute(&mut self, report: &Report) {
        self.0.push(format!("{:?}", report.lines));
    }
}

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
    let mut minutes = Minutes(Vec::new());
    let here = run(&mut memory, &plan, &mut minutes);
    let directory = tempfile::tempdir().expect("a directory");
    let mut input = plan.seed.to_le_bytes().to_vec();
    input.extend(plan.seconds.to_le_bytes());
    input.extend(plan.rate.to_le_bytes());
    std::fs::write(directory.path().join("input"), input).expect("it is written");
    // a simulated second takes some 0.02 s
    let limit = Duration::from_secs(200) + Duration::from_secs(seconds.into());
    let begun = Instant::now();
    let there = run_in(directory.path(), MPS2_AN386, &image, Clock::Free, limit);
    let there = there.expect("it runs");
    println!(
        "{:.0} s for {seconds} s: {here:?}",
        begun.elapsed().as_secs_f64()
    );
    let theirs = there.output.lines();
    let theirs = theirs.filter_map(|line| line.strip_prefix("minute "));
    for (minute, (ours, theirs)) in minutes.0.iter().zip(theirs).enumerate() {
        assert_eq!(ours, theirs, "minute {minute}, {:?}", soak::LINES);
    }
    assert_eq!(there.code, Some(0), "{}", there.output);
    let says = |name: &str| {
        let mut lines = there.output.lines();
        lines
            .find_map(|line| line.strip_prefix(name))
            .expect("a line")
            .trim()
            .to_owned()
    };
    // a stack that reached into the soak's memory would change bytes silently
    let left = says("stack_left ").parse::<u32>().expect("a number");
    assert!(left > 16 << 10, "{left} bytes of the stack are left");
    assert_eq!(here.violation, None);
    assert_eq!(says("violation "), "None");
    assert_eq!(says("samples "), here.samples.to_string());
    assert_eq!(says("corrected "), here.corrected.to_string());
    assert_eq!(says("digest "), here.digest.to_string(), "{here:?}");
}
