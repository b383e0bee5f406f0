//! Progress on standard error, with the time that is left; silent where that is not a terminal.
//!
//! A command that counts its work has a [`bar`]. A command that goes through stages has a line with
//! the present one ([`plan`]). The relative duration of the stages was measured. The duration of
//! the first stages shows how fast this machine is with this input, so the remaining time is an
//! estimate, and says "about".

use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::{self, Write as _};
use std::path::Path;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Name of the stage that reads a recording, for several commands.
pub const READING: &str = "reading the recording";
/// Name of the stage that writes a report, for several commands.
pub const WRITING: &str = "writing the report";

/// All bars, so that they do not write over each other.
static ALL: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);
/// The stages of the command that runs.
static STAGES: Mutex<Option<Stages>> = Mutex::new(None);

/// A bar of `length` steps in the form of `template`.
pub fn bar(length: u64, template: &str) -> ProgressBar {
    let bar = ALL.add(ProgressBar::new(length));
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style.with_key("eta", eta)),
        Err(_) => bar,
    }
}

/// The remaining time, unknown before the first step is done.
fn eta(state: &ProgressState, text: &mut dyn Write) {
    let _ = match state.pos() {
        0 => text.write_str("?"),
        _ => write!(text, "{:#}", HumanDuration(state.eta())),
    };
}

/// Writes a line on standard error, above the bars.
pub fn say(line: &str) {
    let _ = ALL.suspend(|| writeln!(io::stderr(), "{line}")); // nobody may be reading
}

/// The stages of a command in order, and the measured duration of each, s.
type Plan<'a> = &'a [(&'static str, f64)];

/// Progress of a command through its stages.
#[derive(Debug)]
struct Stages {
    line: ProgressBar,
    plan: Vec<(&'static str, f64)>,
    /// The present stage; `None`: one that is not in the plan.
    at: Option<usize>,
    begun: Instant,
    stage_begun: Instant,
}

/// The line of a command with stages. It is removed when this is dropped.
#[derive(Debug)]
pub struct ProgressLine(());

/// Shows the stages of a command. The first begins now.
pub fn plan(stages: Plan<'_>) -> ProgressLine {
    let line = ALL.add(ProgressBar::new_spinner());
    let template = "{spinner} {elapsed} {msg}{left}";
    let left = |_: &ProgressState, text: &mut dyn Write| {
        let _ = text.write_str(&words()); // writing to a string does not fail
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        line.set_style(style.with_key("left", left));
    }
    let now = Instant::now();
    let first = stages.first().map_or("", |(name, _)| name);
    line.set_message(first);
    let earlier = shown().replace(Stages {
        line: line.clone(),
        plan: stages.to_vec(),
        at: Some(0),
        begun: now,
        stage_begun: now,
    });
    drop(earlier); // drawing locks the stages, so not while they are locked
    line.enable_steady_tick(Duration::from_millis(100));
    ProgressLine(())
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        let gone = shown().take();
        if let Some(stages) = gone {
            stages.line.finish_and_clear();
        }
    }
}

/// A stage begins. Without a plan nothing is shown: the library of Python has none.
pub fn stage(name: &str) {
    let line = match &mut *shown() {
        None => return,
        Some(stages) => {
            stages.at = stages.plan.iter().position(|(known, _)| *known == name);
            stages.stage_begun = Instant::now();
            stages.line.clone()
        }
    };
    line.set_message(name.to_owned()); // draws, which calls `words`
}

/// The stages of the plan take `times` as long as was measured.
pub fn scale(times: f64) {
    if let Some(stages) = &mut *shown() {
        for (_, seconds) in &mut stages.plan {
            *seconds *= times;
        }
    }
}

/// Scales the stages by the length of a text file of samples; the measured one had 50 MB.
pub fn scale_by(file: &Path) {
    if let Ok(about) = file.metadata() {
        let packed = file.extension().is_some_and(|is| is == "gz");
        let text = about.len() as f64 * if packed { 3.0 } else { 1.0 };
        scale((text / 50e6).max(0.02));
    }
}

fn shown() -> MutexGuard<'static, Option<Stages>> {
    STAGES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Text behind the name of the stage: the remaining time.
fn words() -> String {
    let now = Instant::now();
    let stages = shown();
    let seconds = stages.as_ref().and_then(|of| {
        let before = (of.stage_begun - of.begun).as_secs_f64();
        left(
            &of.plan,
            of.at?,
            before,
            (now - of.stage_begun).as_secs_f64(),
        )
    });
    seconds.map_or(String::new(), |s| format!(", about {} left", duration(s)))
}

/// Seconds until the end. `before`: those of the stages before that number `at`; `within`: those of
/// the present one so far.
fn left(plan: Plan<'_>, at: usize, before: f64, within: f64) -> Option<f64> {
    let (_, expected) = plan.get(at)?;
    let sum = |of: Plan<'_>| of.iter().map(|(_, seconds)| seconds).sum::<f64>();
    let done = sum(&plan[..at]);
    // ratio of the time here to the measured time
    let slower = if done > 0.0 && before > 0.2 {
        before / done
    } else {
        1.0
    };
    // a stage that takes longer than expected is never about to end
    let rest = (expected * slower - within).max(0.1 * within);
    Some(rest + slower * sum(&plan[at + 1..]))
}

/// Whole seconds, or minutes, or hours.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{:.0} s", s.ceil()),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: Plan<'_> = &[("reading", 2.0), ("learning", 3.0), ("writing", 1.0)];

    #[test]
    fn the_time_left_follows_the_speed_of_the_stages_that_are_done() {
        let of = |at, before, within| left(PLAN, at, before, within).unwrap();
        assert!((of(0, 0.0, 0.5) - 5.5).abs() < 1e-9);
        // twice as slow as where it was measured
        assert!((of(1, 4.0, 0.0) - 8.0).abs() < 1e-9);
        assert!((of(1, 4.0, 2.0) - 6.0).abs() < 1e-9);
        assert!((of(2, 10.0, 1.0) - 1.0).abs() < 1e-9);
        assert_eq!(left(PLAN, 3, 1.0, 1.0), None);
    }

    #[test]
    fn a_stage_that_takes_too_long_is_never_about_to_end() {
        assert!((left(PLAN, 2, 5.0, 100.0).unwrap() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn durations_are_round() {
        let all = [0.2, 99.5, 130.0, 7200.0].map(duration);
        assert_eq!(all, ["1 s", "100 s", "2 min", "2.0 h"]);
    }

    /// Without a plan, as in the Python library, and with one.
    #[test]
    fn stages_are_followed_by_their_names() {
        stage("reading");
        assert_eq!(words(), "");
        let of = plan(PLAN);
        scale(10.0);
        assert_eq!(words(), ", about 60 s left");
        stage("another");
        assert_eq!(words(), "");
        stage("writing");
        assert_eq!(words(), ", about 10 s left");
        drop(of);
        assert_eq!(words(), "");
    }
}
