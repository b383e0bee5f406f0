//! Decisions in case of a failure, without registers: which crystal is there ([`crystal`]), what
//! survives a reset ([`retained`]), whether the output is stuck ([`output`]), and when the window
//! watchdog may be fed ([`window`]). Whether the application is healthy is [`super::App::unwell`].

pub mod crystal;
pub mod output;
pub mod retained;
pub mod window;
