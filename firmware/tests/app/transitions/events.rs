//! States of a correction, and the events that it meets.

use firmware::control::{Alignment, Mode};

/// State of a correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Mode learn, live, nothing proved.
    Nothing,
    /// Mode frozen.
    Frozen,
    /// Mode learn: what was stored.
    Stored,
    /// Mode learn, live: what was proved, half in force.
    FadingIn,
    /// Mode learn, live: all of it.
    Live,
    /// Mode learn, live: half gone, since it was given up.
    FadingOut,
    /// Mode learn: what was stored, and what the first rest shows.
    AtRest,
}

pub const STATES: [State; 7] = [
    State::Nothing,
    State::Frozen,
    State::Stored,
    State::FadingIn,
    State::Live,
    State::FadingOut,
    State::AtRest,
];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    Mode(Mode),
    SameMode,
    Alignment(Alignment),
    /// The request of the state's own alignment once more.
    SameAlignment,
    Images,
    /// Networks that fail.
    Broken,
    CommitLearnt,
    Configuration,
    Proves,
    GivesUp,
    /// The vehicle rests, and that shows other errors of the gyros.
    Rests,
    /// The rest ends.
    DrivesOff,
    Harms,
    Gap,
    Silence,
    Restart,
    Rate,
    /// Frames with wrong checksums for 5 s.
    Damage,
    /// 10 000 bytes of no format on the sensor's line.
    Noise,
    /// The navigation computer asks a sensor that is no STIM300 for its service mode.
    Service,
}

pub const EVENTS: [Event; 24] = [
    Event::Mode(Mode::Bypass),
    Event::Mode(Mode::Frozen),
    Event::Mode(Mode::Shadow),
    Event::Mode(Mode::Learn),
    Event::SameMode,
    Event::Alignment(Alignment::Started),
    Event::Alignment(Alignment::Finished),
    Event::SameAlignment,
    Event::Images,
    Event::Broken,
    Event::CommitLearnt,
    Event::Configuration,
    Event::Proves,
    Event::GivesUp,
    Event::Rests,
    Event::DrivesOff,
    Event::Harms,
    Event::Gap,
    Event::Silence,
    Event::Restart,
    Event::Rate,
    Event::Damage,
    Event::Noise,
    Event::Service,
];
