//! The lines of the application.

/// The four lines of a device; [`crate::link::NoLine`] for one that is not there.
#[derive(Debug, Default)]
pub struct Lines<S, N, C, G> {
    /// The sensor: frames in, requests out.
    pub sensor: S,
    /// The navigation computer: frames out, requests in.
    pub navigation: N,
    /// The command link.
    pub command: C,
    /// The receiver: fixes in.
    pub gnss: G,
}
