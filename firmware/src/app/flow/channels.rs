//! The kinds of frames on one line. A sensor may send its samples in several, each with its own
//! units and its own carried remainder.

use crate::compensator::OUTPUT_STREAMS;
use crate::wire::Source;
use heapless::Vec;

/// Identifies a kind of frames: source and content.
pub type Kind = (Source, u8);

#[derive(Debug, Clone, Copy)]
struct Channel {
    kind: Kind,
    /// Whether its samples have the stream's units and make its blocks.
    leads: bool,
}

/// The kinds of frames on one line, in the order of their first frames. Their positions are those
/// of the compensator's output streams. The first one leads.
#[derive(Debug, Default)]
pub(in crate::app) struct Channels {
    /// The kind of the last frame; `None`: the next frame is looked at more closely.
    kind: Option<Kind>,
    /// Its position.
    current: u8,
    /// Whether it leads.
    leads: bool,
    /// The position of the last frame whose sample was counted.
    counted: u8,
    list: Vec<Channel, OUTPUT_STREAMS>,
}

impl Channels {
    /// Whether a frame with this content is of the last one's kind. The source need not be
    /// compared: before another one sends, all kinds are forgotten.
    #[inline(always)]
    pub fn is(&self, content: u8) -> bool {
        self.kind.is_some_and(|(_, last)| last == content)
    }

    /// Makes a known kind the present one. False: it is not known.
    pub fn select(&mut self, kind: Kind) -> bool {
        let place = self.list.iter().position(|channel| channel.kind == kind);
        let known = place.and_then(|place| Some((place, self.list.get(place)?)));
        (self.kind, self.leads) = (None, false);
        if let Some((place, channel)) = known {
            self.current = place as u8; // less than OUTPUT_STREAMS
            (self.kind, self.leads) = (Some(kind), channel.leads);
        }
        known.is_some()
    }

    /// The next frame is looked at more closely.
    pub fn unselect(&mut self) {
        self.kind = None;
    }

    /// Adds a kind, which is then the present one, and gives its position. `None`: there is no more
    /// room.
    pub fn add(&mut self, kind: Kind, leads: bool) -> Option<usize> {
        self.list.push(Channel { kind, leads }).ok()?;
        self.select(kind);
        Some(self.current())
    }

    /// Forgets all kinds.
    pub fn clear(&mut self) {
        *self = Channels::default();
    }

    /// All kinds.
    pub fn kinds(&self) -> impl Iterator<Item = Kind> {
        self.list.iter().map(|channel| channel.kind)
    }

    /// Whether no kind is known.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether one kind is known.
    pub fn is_one(&self) -> bool {
        self.list.len() == 1
    }

    /// Source of the present frame.
    pub fn source(&self) -> Option<Source> {
        self.kind.map(|(source, _)| source)
    }

    /// The position of the present kind.
    #[inline(always)]
    pub fn current(&self) -> usize {
        self.current.into()
    }

    /// Whether the present kind's samples make blocks.
    #[inline(always)]
    pub fn leads(&self) -> bool {
        self.leads
    }

    /// Whether the present kind is another than that of the last sample counted.
    #[inline(always)]
    pub fn changed(&self) -> bool {
        self.current != self.counted
    }

    /// The present frame's sample counts.
    pub fn counted(&mut self) {
        self.counted = self.current;
    }
}
