//! A standstill that is declared, and in which the fixes move. Every scheme aligns itself on it and
//! holds its velocity at zero there, so that all rows after it are wrong.

use super::evidence::Evidence;
use super::rests::speeds;
use super::{Doubt, Says};

/// A vehicle that is faster in so many fixes in a row moves: m/s, and standard deviations of the
/// speed. Sway at a berth or in a crowd is slower.
const MOVES_MPS: f64 = 1.0;
const SIGMAS: f64 = 5.0;
const FIXES: usize = 3;
/// A vehicle that starts gently has moved for so long before it is that fast, s.
const STARTS_S: f64 = 5.0;
/// The shortest standstill that a header may declare, s.
const LEAST_S: f64 = 90.0;

/// The field of a standstill.
pub(super) fn field(says: &Says) -> &'static str {
    match says.is_header() {
        true => "start.standstill_s",
        false => "--standstill-s",
    }
}

/// A standstill is declared, and the fixes move before it ends.
pub(super) fn doubt(evidence: &Evidence, says: &Says) -> Option<Doubt> {
    let [begin, end] = evidence.declared?;
    let mut declared = speeds(&evidence.fixes);
    declared.retain(|(time, ..)| (begin..end).contains(time));
    let moves =
        |(_, _, speed, sigma): &(f64, [f64; 2], f64, f64)| *speed > MOVES_MPS.max(SIGMAS * sigma);
    let mut rows = declared.windows(FIXES);
    let stood = rows.find(|row| row.iter().all(moves))?[0].0 - begin;
    let fastest = declared.iter().map(|(_, _, speed, _)| *speed);
    let problem = format!(
        "says {:.0} s, and the fixes move from {stood:.0} s on, at up to {:.1} m/s",
        end - begin,
        fastest.fold(0.0, f64::max)
    );
    let leave = "leave it out: then the attitude is found in motion";
    let remedy = match (stood - STARTS_S).floor() {
        stood if stood >= LEAST_S => format!("give {stood}, or {leave}"),
        _ => leave.into(),
    };
    Some((field(says).into(), problem, remedy))
}
