//! The state at which navigators begin the judged part.

use super::{Learnt, Settings, Split};
use crate::experiment::sessions::{CONTRADICTS, Timeline, state_at};
use host_core::inertial::session::Session;
use host_core::inertial::sins::NavState;

/// Samples and fixes before and after the state that give it, s.
const BEFORE_S: usize = 900;
const AFTER_S: usize = 300;

/// Where the navigators of all schemes begin the judged part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Begins {
    /// All at the reference's state, whose attitude is the truth.
    Reference,
    /// All at one state that is smoothed from samples and fixes with a model of its own, as in
    /// [`sessions`](crate::experiment::sessions).
    Smoothed,
    /// Each at the state of its own aided navigator, which has no sensor errors in its state except
    /// in the filters. The judged part must follow the learning part; otherwise as `Reference`.
    Own,
}

/// The common state, if there is one, with the residual of its smoothing, and where the navigators
/// begin, in sentences. `None`: no state can be found.
pub(super) fn begin(
    session: &Session,
    split: &Split,
    settings: &Settings,
    learnt: &Learnt,
) -> Option<(Option<NavState>, Option<f64>, String)> {
    match settings.begins {
        Begins::Own if split.follows() => Some((
            None,
            None,
            "Each row starts from the state of its own aided navigator, without sensor errors in \
             its state except in the filters."
                .into(),
        )),
        Begins::Own | Begins::Reference => Some((
            Some(session.referenced(split.judge.start)),
            None,
            "All rows start from one state, that of the reference.".into(),
        )),
        Begins::Smoothed => {
            let (nav, residual) = smoothed(session, split, learnt)?;
            let says = format!(
                "All rows start from one state, smoothed from samples and fixes before and after \
                 with a model of its own (residual {residual:.2}, where 1 is expected). No row's \
                 corrections shape it."
            );
            Some((Some(nav), Some(residual), says))
        }
    }
}

fn smoothed(session: &Session, split: &Split, learnt: &Learnt) -> Option<(NavState, f64)> {
    let at = split.judge.start;
    let gaps = session.outages.iter().map(|gap| gap.epochs.end);
    let whole = gaps.filter(|end| *end <= at).max().unwrap_or(0);
    let nominal = &learnt.nominal;
    let known = match split.follows() {
        true => split.learn.start + nominal.first,
        false => at,
    };
    let from = at.saturating_sub(BEFORE_S).max(whole).max(known);
    let gap = session.outages.iter().map(|gap| gap.epochs.start);
    let whole = gap.filter(|start| *start >= at).min();
    let to = whole.unwrap_or(session.epochs()).min(at + AFTER_S);
    let start = match split.follows() {
        true => {
            nominal
                .records
                .block(from - known..from - known + 1)
                .first()?
                .nav
        }
        false => session.referenced(from),
    };
    let until = |to| {
        let timeline = Timeline::of_part(session, &(from..to));
        state_at(&timeline, start, (at - from) as f64)
    };
    // where later fixes are wrong, those before it still give the state
    let found = until(to);
    let alone = found.is_none_or(|(_, residual)| residual > CONTRADICTS);
    let before = alone.then(|| until(at)).flatten().filter(|_| from < at);
    [before, found]
        .into_iter()
        .flatten()
        .min_by(|a, b| a.1.total_cmp(&b.1))
}
