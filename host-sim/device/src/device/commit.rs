//! Puts what a device has learnt into use.

use super::link::Link;
use firmware::learn::bank::NAMES;
use firmware::learn::rehearsal::of_100;
use firmware::wire::command::{Progress, Request};
use host_core::error::Error;

/// Uses what the device has learnt from the next block on. Returns what is in use then, in words.
///
/// # Errors
/// As [`Link::ask`]; nothing has proved itself and no reference was used, so that the device would
/// put into use what is in use already, and forget what waits for the next power-on.
pub fn commit(link: &mut Link) -> Result<String, Error> {
    let winner = link.health()?.winner;
    let references = link.estimate()?.used;
    let progress = link.progress()?;
    // a board without a learner refuses the order in its own words
    if let (0, 0, Some(progress)) = (winner, references, progress) {
        return Err(link.error(
            format!(
                "nothing has proved itself yet ({}), so there is nothing to use; what is in use \
                 stays",
                so_far(&progress)
            ),
            "wait for the proof: `host-sim device watch` shows how far it is",
        ));
    }
    link.order(&Request::CommitLearnt)?;
    let what = match winner {
        0 => format!("the networks learnt from {references} references"),
        winner => {
            let name = NAMES.get(usize::from(winner)).unwrap_or(&"another one");
            format!("the networks of \"{name}\", which has proved itself,")
        }
    };
    Ok(format!("{what} are in use; `store` keeps them"))
}

/// How near the nearest proof is.
fn so_far(of: &Progress) -> String {
    let name = NAMES.get(usize::from(of.nearest)).copied();
    match name.filter(|_| of.nearest > 0) {
        Some(name) => format!("\"{name}\": proof {} of 100", of_100(of.proof, of.proved)),
        None => "no rehearsal has ended".into(),
    }
}
