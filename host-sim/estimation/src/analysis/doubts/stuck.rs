//! A sensor that holds its value while the vehicle moves and the other two of its kind change.

use super::{AXES, Doubt, Says};
use host_core::inertial::sins::Increment;
use host_io::recordings::record::{Record, TimedFix};

/// Shortest time for which a value is held, s, and the way of the vehicle in it, m.
const LEAST_S: f64 = 20.0;
const MOVES_M: f64 = 20.0;
/// Changes of a value that are none, as a share: those of the times in a file.
const SHARE: f64 = 1e-6;

/// The samples up to one of them.
#[derive(Debug, Clone, Copy, Default)]
struct Until {
    time: f64,
    samples: usize,
    /// How often the value of each sensor has changed.
    changes: [usize; 6],
}

/// A sensor, and the time for which it holds its value.
type Held = (usize, [Until; 2]);

pub(super) fn doubt(record: &Record, says: &Says) -> Option<Doubt> {
    let moves = |held: &Held| moves(&record.fixes, held);
    let found = held(record).into_iter().filter(moves);
    let (sensor, [from, to]) = found.max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let (field, how) = match sensor < 3 {
        true => (&says.gyro.name, "about"),
        false => (&says.accel.name, "along"),
    };
    let problem = format!(
        "holds one value {how} the axis called {} from {:.1} to {:.1} s, while the vehicle moves \
         and the other two change",
        AXES[sensor % 3],
        from.time,
        to.time
    );
    let remedy = "check its column, and the sensor and its driver; or cut the recording there";
    let field = field.trim_end_matches(".unit").to_owned();
    Some((field, problem, remedy.to_owned()))
}

fn length((_, [from, to]): &Held) -> f64 {
    to.time - from.time
}

/// Whether the vehicle moves meanwhile.
fn moves(fixes: &[TimedFix], (_, [from, to]): &Held) -> bool {
    let mut within = fixes
        .iter()
        .filter(|fix| fix.has_position() && (from.time..=to.time).contains(&fix.time));
    let Some(first) = within.next() else {
        return false;
    };
    within.any(|fix| fix.position().ned_from(&first.position()).norm() > MOVES_M)
}

/// All times for which a sensor holds its value and the other two of its kind do not.
fn held(record: &Record) -> Vec<Held> {
    let mut found = Vec::new();
    let mut now = Until::default();
    let mut since = [Until::default(); 6];
    let mut before: Option<(f64, [f64; 6])> = None;
    for (end, sample) in record.increments() {
        let (step, values) = (end - now.time, values(&sample));
        let last = now;
        now.time = end;
        now.samples += 1;
        if let Some((last_step, last_values)) = before {
            for k in 0..6 {
                let (value, old) = (values[k], last_values[k]);
                let [rate, old_rate] = [value / step, old / last_step];
                if value != old && (rate - old_rate).abs() > SHARE * rate.abs() {
                    found.push((k, [since[k], last]));
                    now.changes[k] += 1;
                    since[k] = now;
                }
            }
            found.retain(is_alone);
        }
        before = Some((step, values));
    }
    found.extend((0..6).map(|k| (k, [since[k], now])));
    found.retain(is_alone);
    found
}

fn values(sample: &Increment) -> [f64; 6] {
    let (angle, velocity) = (sample.dtheta, sample.dv);
    [
        angle.x, angle.y, angle.z, velocity.x, velocity.y, velocity.z,
    ]
}

/// Whether a value is held for long, and the other two change from sample to sample.
fn is_alone(held: &Held) -> bool {
    let (sensor, [from, to]) = held;
    let triad = sensor / 3 * 3;
    let mut others = (triad..triad + 3).filter(|k| k != sensor);
    length(held) > LEAST_S
        && others.all(|k| 2 * (to.changes[k] - from.changes[k]) > to.samples - from.samples)
}
