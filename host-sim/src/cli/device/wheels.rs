//! `device wheels`: speeds of the wheels from standard input to the device.

use firmware::control::Reason;
use firmware::wheels::WheelSpeed;
use firmware::wire::command::Request;
use host_core::error::Error;
use host_device::device::Link;
use std::io::BufRead;

/// Sends each line's speed as it comes, m/s, negative in reverse. Gives how many the device took,
/// and how many came while it did not learn. Empty lines and those that begin with # are left out.
///
/// # Errors
/// A line that is no speed, by its number; the device refuses; the link fails.
pub(super) fn run(link: &mut Link, input: impl BufRead) -> Result<[u64; 2], Error> {
    link.version()?;
    let [mut taken, mut not_yet] = [0; 2];
    for (k, line) in input.lines().enumerate() {
        let wrong = |problem: String| Error::Option {
            option: format!("line {} of standard input", k + 1),
            problem,
            remedy: "give one speed a line, m/s, -200 to 200, negative in reverse".into(),
        };
        let line = line.map_err(|e| wrong(e.to_string()))?;
        let text = line.trim();
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let speed = text.parse().map_err(|_| wrong(format!("is '{text}'")))?;
        let speed = WheelSpeed { speed, age_ms: 0 };
        if !speed.is_plausible() {
            return Err(wrong(format!("is {text} m/s")));
        }
        let request = Request::WheelSpeed(speed);
        match link.try_order(&request)? {
            Ok(()) => taken += 1,
            Err(Reason::NotAvailable) => not_yet += 1,
            Err(reason) => return Err(link.refused(&request, reason)),
        }
    }
    Ok([taken, not_yet])
}
