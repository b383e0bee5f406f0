//! What makes all comparisons meaningless: fixes at other times than the samples, fixes that are
//! elsewhere, gyros and accelerometers in each other's columns.

use super::evidence::Evidence;
use super::{DEGREE_M, Doubt, Says};
use firmware::units::G;
use host_core::words::counted;
use host_io::recordings::clocks;
use host_io::recordings::record::TimedFix;
use nalgebra::Vector3;

/// Least number of fixes that are looked at, and the share of them among the samples below which
/// the clocks are others.
const FIXES: usize = 10;
const AMONG: f64 = 0.1;
/// Nothing moves faster, m/s, or jumps farther by an error of its receiver, m.
const FASTEST_MPS: f64 = 1000.0;
const FARTHEST_M: f64 = 3000.0;
/// So many fixes at one position, as many seconds, are a receiver that holds its last one where
/// they say that they are faster than this, m/s.
const HELD: usize = 3;
const MOVES_MPS: f64 = 1.0;
/// From what it holds a receiver jumps by so much, m, to the next fix within this time, s, and by
/// more than it moves.
const JUMP_M: f64 = 100.0;
const NEAR_S: f64 = 2.5;
/// Fixes as close to each other as this, s, add nothing to a comparison.
const CLOSE_S: f64 = 0.09;
/// Share by which what seems to be gravity may differ from it.
const GRAVITY_SHARE: f64 = 0.05;

/// Nearly all fixes are before or after the samples. Where all are, the recording is refused.
pub(super) fn times(evidence: &Evidence, says: &Says) -> Option<Doubt> {
    let (blocks, fixes) = (&evidence.blocks, &evidence.fixes);
    let first = blocks.first()?;
    let samples = [first.end - first.seconds, blocks.last()?.end];
    let times = [fixes.first()?.time, fixes.last()?.time];
    let among = |t: f64| (samples[0] - 1.0..=samples[1] + 1.0).contains(&t);
    let inside: Vec<f64> = fixes
        .iter()
        .map(|fix| fix.time)
        .filter(|t| among(*t))
        .collect();
    let covered = match inside[..] {
        [first, .., last] => (last - first) / (samples[1] - samples[0]),
        _ => 0.0,
    };
    let few = !inside.is_empty() && (inside.len() as f64) < AMONG * fixes.len() as f64;
    (fixes.len() >= FIXES && few && covered < AMONG).then(|| {
        let problem = format!(
            "puts {} of {} outside the time of the samples",
            fixes.len() - inside.len(),
            counted(fixes.len(), "fix")
        );
        let field = says.fixes.time_unit.name.clone();
        (field, problem, clocks::apart(samples, times))
    })
}

/// Takes fixes out whose positions no vehicle reaches from those of most others.
pub(super) fn jumps(fixes: &mut Vec<TimedFix>, says: &Says) -> Option<Doubt> {
    let near = |a: &TimedFix, b: &TimedFix| {
        let far = a.position().ned_from(&b.position()).norm();
        far < FARTHEST_M + FASTEST_MPS * (a.time - b.time).abs()
    };
    // runs without a jump
    let mut runs: Vec<Vec<usize>> = Vec::new();
    for (k, fix) in fixes
        .iter()
        .enumerate()
        .filter(|(_, fix)| fix.has_position())
    {
        match runs.last_mut() {
            Some(run) if run.last().is_some_and(|last| near(&fixes[*last], fix)) => run.push(k),
            _ => runs.push(vec![k]),
        }
    }
    let main = runs.iter().max_by_key(|run| run.len())?;
    let anchor = fixes[main[main.len() / 2]];
    let odd: Vec<usize> = runs
        .iter()
        .filter(|run| run.iter().all(|k| !near(&fixes[*k], &anchor)))
        .flatten()
        .copied()
        .collect();
    let (first, last) = (fixes.get(*odd.first()?)?, fixes.get(*odd.last()?)?);
    let far = odd
        .iter()
        .map(|k| fixes[*k].position().ned_from(&anchor.position()).norm());
    let problem = format!(
        "puts {} from {} to {} s up to {:.0} km from the others",
        counted(odd.len(), "fix"),
        first.time,
        last.time,
        far.fold(0.0, f64::max) / 1e3
    );
    let remedy = "leave out what is not a fix: receivers without one fill the position with zeros, \
                  ones or an old value, and say so in another column ('gnss.valid')";
    let mut k = 0;
    fixes.retain(|_| {
        k += 1;
        odd.binary_search(&(k - 1)).is_err()
    });
    let field = says.fixes.position.name.trim_end_matches(".unit");
    Some((field.to_owned(), problem, remedy.to_owned()))
}

/// Fixes in a row that repeat a position to the last digit, although they say that they move, or
/// that end in a jump.
pub(super) fn held(evidence: &Evidence, says: &Says) -> Option<Doubt> {
    let fixes: Vec<&TimedFix> = evidence.fixes.iter().filter(|f| f.has_position()).collect();
    let speed = |fix: &TimedFix| fix.measured_velocity().map(|[n, e, _]| n.hypot(e));
    let moves = |fix: &TimedFix| speed(fix).is_some_and(|speed| speed > MOVES_MPS);
    let place = |fix: &TimedFix| [fix.lat_deg, fix.lon_deg];
    let same = |a: &TimedFix, b: &TimedFix| moves(a) == moves(b) && place(a) == place(b);
    let jump = |last: &TimedFix, next: &[&TimedFix]| {
        let first = next.first()?;
        let far = first.position().ned_from(&last.position()).norm();
        let step = next.get(1).map(|after| {
            let way = after.position().ned_from(&first.position()).norm();
            way / (after.time - first.time)
        });
        let passed = first.time - last.time;
        let fast = speed(first).or(step)?;
        (passed < NEAR_S && far > JUMP_M + 2.0 * fast * passed).then_some(far)
    };
    let (mut count, mut begin, mut jumped, mut at) = (0, None, None, 0);
    for run in fixes.chunk_by(|a, b| same(a, b)) {
        at += run.len();
        let (first, last) = (run[0], run[run.len() - 1]);
        let far = jump(last, &fixes[at..]);
        let is_long = run.len() >= HELD && last.time - first.time >= HELD as f64;
        if !is_long || !moves(first) && far.is_none() {
            continue;
        }
        count += run.len() - 1;
        begin = begin.or(Some(first.time));
        jumped = jumped.or(far.filter(|_| !moves(first)));
    }
    let but = match jumped {
        Some(far) => format!("and jumps by {far:.0} m then"),
        None => "while the velocities say that it moves".into(),
    };
    let problem = format!(
        "repeats a position {}, first from {} s on, {but}",
        counted(count, "time"),
        begin?
    );
    let remedy = match coarse(&fixes) {
        Some(step) => format!(
            "write the positions with all their digits: they are in steps of {step} deg, which are \
             {:.0} m",
            step * DEGREE_M
        ),
        None => "leave out what is not a fix: receivers without one hold the last position, and \
                 say so in another column ('gnss.valid'), as by a type of fix of 5 (time only) of \
                 u-blox"
            .into(),
    };
    let field = says.fixes.position.name.trim_end_matches(".unit");
    Some((field.to_owned(), problem, remedy))
}

/// The step of latitudes or longitudes whose last digits have been left out, deg.
fn coarse(fixes: &[&TimedFix]) -> Option<f64> {
    let all = |of: fn(&TimedFix) -> f64, step: f64| {
        let mut values = fixes.iter().map(|fix| of(fix));
        let first = values.clone().next();
        values.clone().any(|value| Some(value) != first)
            && values.all(|value| (value / step - (value / step).round()).abs() < 1e-6)
    };
    [1e-2, 1e-3, 1e-4, 1e-5]
        .into_iter()
        .find(|step| all(|fix| fix.lat_deg, *step) || all(|fix| fix.lon_deg, *step))
}

/// Takes out fixes that follow another one within [`CLOSE_S`]: every mistake of the table is fitted
/// to all fixes, and those of a reference come as often as the samples. Returns whether it took
/// any.
pub(super) fn thin(fixes: &mut Vec<TimedFix>) -> bool {
    let (all, mut last) = (fixes.len(), f64::NEG_INFINITY);
    fixes.retain(|fix| {
        let kept = fix.time - last > CLOSE_S;
        last = if kept { fix.time } else { last };
        kept
    });
    fixes.len() < all
}

/// The numbers of the gyros are gravity, and those of the accelerometers are not.
pub(super) fn exchanged(evidence: &Evidence, says: &Says) -> Option<Doubt> {
    let unit = |named: &Option<(String, f64)>| named.as_ref().map_or(1.0, |(_, unit)| *unit);
    let (gyro, accel) = (unit(&says.gyro.named), unit(&says.accel.named));
    let middle = |of: fn(&super::evidence::Block) -> Vector3<f64>| {
        let mut sizes: Vec<f64> = evidence.blocks.iter().map(|b| of(b).norm()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() / 2).copied()
    };
    let as_force = middle(|block| block.rate)? / gyro * accel;
    let is_gravity = |size: f64| (size / G - 1.0).abs() < GRAVITY_SHARE;
    let swapped = is_gravity(as_force) && middle(|block| block.force)? < 0.5 * G;
    swapped.then(|| {
        let (field, other) = (&says.gyro.name, &says.accel.name);
        let problem =
            format!("has numbers of {as_force:.3}, which is gravity in the unit of '{other}'");
        let remedy = "gyros and accelerometers seem to have changed places: check their columns";
        (
            field.trim_end_matches(".unit").to_owned(),
            problem,
            remedy.to_owned(),
        )
    })
}
