//! Progress on standard error; silent where that is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// A bar of `length` steps in the form of `template`.
pub(super) fn bar(length: u64, template: &str) -> ProgressBar {
    styled(ProgressBar::new(length), template)
}

fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// A spinner that names the present stage.
pub(super) struct Stages(ProgressBar);

impl Stages {
    pub(super) fn new() -> Self {
        let spinner = styled(ProgressBar::new_spinner(), "{spinner} {elapsed} {msg}");
        spinner.enable_steady_tick(Duration::from_millis(100));
        Self(spinner)
    }

    pub(super) fn begin(&self, stage: &str) {
        self.0.set_message(stage.to_string());
    }

    pub(super) fn end(&self) {
        self.0.finish_and_clear();
    }
}
