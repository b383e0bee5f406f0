//! Plays the pages of a black box through the application, and compares its output.

use super::super::memory::{MemoryLine, SetClock};
use crate::device::faults::FAULTS;
use firmware::app::blackbox::read::{Content, Entry, Page as Recorded, page};
use firmware::app::blackbox::{AppState, Key, PAGES};
use firmware::app::{App, Config, Lines};
use firmware::configuration::Configuration;
use firmware::control::Mode;
use firmware::link::NoLine;
use firmware::wire::ImuFormat;
use firmware::wire::command::fault;

/// Most passes of the application until it has nothing left to do.
const PASSES: usize = 10_000;

/// Result of playing a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Its number: pages begun since the memory was blank.
    pub number: u32,
    /// Start of the page, microseconds after the device's start.
    pub at_us: u64,
    /// Number of pieces of the sensor's bytes that were played.
    pub pieces: usize,
    /// Number of bytes in these pieces.
    pub bytes: usize,
    /// Result of the comparison.
    pub verdict: Verdict,
}

/// Result of the comparison of a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The output bytes and the faults are the same.
    Agrees,
    /// Time of the first difference, microseconds after the device's start, and what differs.
    Differs(u64, String),
    /// The page cannot be played, and why.
    NotPlayed(&'static str),
}

/// Plays all pages of a black box, the oldest first.
#[must_use]
pub fn play(configuration: Option<&Configuration>, memory: &[u8]) -> Vec<Page> {
    let mut pages: Vec<Recorded> = (0..PAGES).filter_map(|index| page(memory, index)).collect();
    pages.sort_by_key(|page| page.number);
    let following = pages.iter().skip(1).map(Some).chain([None]);
    (pages.iter().zip(following))
        .map(|(page, next)| {
            let next = next.filter(|next| next.number == page.number.wrapping_add(1));
            of_page(configuration, page, next.map(|next| &next.key))
        })
        .collect()
}

fn of_page(configuration: Option<&Configuration>, recorded: &Recorded, next: Option<&Key>) -> Page {
    let mut result = Page {
        number: recorded.number,
        at_us: recorded.key.at_us,
        pieces: 0,
        bytes: 0,
        verdict: Verdict::Agrees,
    };
    let mut player = match Player::new(configuration, recorded) {
        Ok(player) => player,
        Err(why) => {
            result.verdict = Verdict::NotPlayed(why);
            return result;
        }
    };
    let entries: Vec<Entry> = recorded.entries().collect();
    let mut rest = entries.as_slice();
    while let Some((entry, after)) = rest.split_first() {
        let notes = after
            .iter()
            .take_while(|entry| !matches!(entry.content, Content::Piece(..) | Content::Burst(..)));
        let (notes, others) = after.split_at(notes.count());
        rest = others;
        if entry.content == Content::Break {
            return result;
        }
        let found = player.piece(entry, notes);
        result.pieces = player.pieces;
        result.bytes = player.bytes;
        if let Err((at_us, what)) = found {
            result.verdict = Verdict::Differs(at_us, what);
            return result;
        }
        if notes.iter().any(|note| note.content == Content::Break) {
            return result;
        }
    }
    // the next page, if it follows at once, has the hash of the output at the end of this one
    if let Some(next) = next.filter(|next| next.at_us == player.clock.0)
        && next.hash != player.app.blackbox().hash()
    {
        let what = "other bytes left at the end of the page".into();
        result.verdict = Verdict::Differs(next.at_us, what);
    }
    result
}

/// The application that plays a page.
struct Player {
    app: App<'static>,
    lines: Lines<MemoryLine, MemoryLine, NoLine, NoLine>,
    clock: SetClock,
    /// Fault bits of the last record.
    faults: u32,
    /// Bytes received and bytes sent so far.
    came: usize,
    left: usize,
    pieces: usize,
    bytes: usize,
}

/// Time of a difference, microseconds after the device's start, and what differs.
type Difference = (u64, String);

impl Player {
    fn new(
        configuration: Option<&Configuration>,
        recorded: &Recorded,
    ) -> Result<Player, &'static str> {
        let key = &recorded.key;
        if !key.plays {
            return Err(match key.stage {
                AppState::Run => "several kinds of frames came on the line",
                _ => "bytes passed unread",
            });
        }
        let mut config = configuration.map_or_else(Config::default, Config::of);
        if config.sensor.adis.is_none() {
            let format = ImuFormat::ALL.get(usize::from(key.format));
            let format = format.ok_or("its format is not known")?;
            config.format = Some(format.configured(&config.sensor));
        }
        // the corrections are given: no block ends by itself
        config.block = 1e9;
        config.mode = if key.corrects {
            Mode::Frozen
        } else {
            Mode::Bypass
        };
        let mut player = Player {
            app: App::new(config),
            lines: Lines::default(),
            clock: SetClock(key.at_us),
            faults: key.faults,
            came: 0,
            left: 0,
            pieces: 0,
            bytes: 0,
        };
        let adis = configuration.is_some_and(|of| of.wire_settings().adis.is_some());
        if adis {
            let mut frame = recorded.frame.to_vec();
            let _ = player
                .app
                .burst(&mut frame, &mut player.lines.navigation, &player.clock);
        } else {
            player.feed(recorded.frame);
        }
        player.lines.navigation.sent.clear();
        (player.came, player.left) = (0, 0);
        if player.app.counters().frames != 1 || !player.app.resume(key) {
            return Err("its first frame is none of the configuration");
        }
        Ok(player)
    }

    /// Plays a piece, with the notes until the next one.
    fn piece(&mut self, entry: &Entry, notes: &[Entry]) -> Result<(), Difference> {
        let (burst, hash, first) = match entry.content {
            Content::Piece(hash, bytes) => (false, hash, bytes),
            Content::Burst(hash, bytes) => (true, hash, bytes),
            _ => (false, self.app.blackbox().hash() as u16, &[][..]),
        };
        self.judge_hash(entry.at_us, hash)?;
        let mut bytes = first.to_vec();
        for note in notes {
            if let Content::More(more) = note.content {
                bytes.extend_from_slice(more);
            }
        }
        let (before, mut fed) = (self.came.saturating_sub(self.left), 0); // a burst may grow
        if bytes.is_empty() {
            self.advance(entry.at_us); // a poll without bytes, of a line that cannot report idle
        }
        self.clock.0 = entry.at_us;
        self.pieces += 1;
        self.bytes += bytes.len();
        let own = core::slice::from_ref(entry);
        for note in own.iter().chain(notes) {
            let (Content::Estimate(left, _) | Content::Faults(left, _)) = note.content else {
                continue;
            };
            let until = usize::from(left).saturating_sub(before).min(bytes.len());
            if !burst && until > fed {
                self.feed(&bytes[fed..until]);
                fed = until;
            }
            if burst && fed == 0 {
                self.burst(&mut bytes);
                fed = bytes.len();
            }
            self.advance(note.at_us);
            match note.content {
                Content::Estimate(_, estimate) => self.app.impose(&estimate),
                Content::Faults(_, bits) => self.judge_faults(note.at_us, bits)?,
                _ => {}
            }
        }
        if burst && fed == 0 {
            self.burst(&mut bytes);
        } else if !burst {
            self.feed(bytes.get(fed..).unwrap_or_default());
        }
        // at the end of a page there is no room for faults that changed with its last piece
        if notes.iter().any(|note| note.content == Content::Break) {
            return Ok(());
        }
        self.judge_faults(self.clock.0, self.faults)
    }

    fn feed(&mut self, bytes: &[u8]) {
        self.lines.sensor.received.extend(bytes);
        self.came += bytes.len();
        self.settle();
    }

    fn burst(&mut self, reply: &mut [u8]) {
        self.came += reply.len();
        // an error has been counted
        let _ = self
            .app
            .burst(reply, &mut self.lines.navigation, &self.clock);
        self.settle();
    }

    /// Advances the time without bytes.
    fn advance(&mut self, at_us: u64) {
        if at_us > self.clock.0 {
            self.clock.0 = at_us;
            self.settle();
        }
    }

    fn settle(&mut self) {
        for _ in 0..PASSES {
            if !self.app.poll(&mut self.lines, &self.clock) {
                break;
            }
        }
        self.left += self.lines.navigation.sent.len();
        self.lines.navigation.sent.clear();
        self.lines.sensor.sent.clear();
    }

    fn judge_hash(&self, at_us: u64, hash: u16) -> Result<(), Difference> {
        let here = self.app.blackbox().hash();
        if here as u16 == hash {
            return Ok(());
        }
        let what = format!(
            "other bytes left until then ({:04x} here, {hash:04x})",
            here as u16
        );
        Err((at_us, what))
    }

    fn judge_faults(&mut self, at_us: u64, bits: u32) -> Result<(), Difference> {
        self.faults = bits;
        let [recorded, here] = self.app.impose_faults(bits);
        // a page does not record the time of the last bytes before it
        let unknown = if self.bytes == 0 { fault::SILENT } else { 0 };
        if (recorded ^ here) & !unknown == 0 {
            return Ok(());
        }
        Err((
            at_us,
            format!("faults {} here, {}", names(here), names(recorded)),
        ))
    }
}

/// Names of fault bits.
pub fn names(bits: u32) -> String {
    let set = FAULTS.iter().filter(|fault| bits >> fault.bit & 1 == 1);
    let names: Vec<&str> = set.map(|fault| fault.name).collect();
    if names.is_empty() {
        "none".into()
    } else {
        names.join(" + ")
    }
}
