//! Updates the firmware of a device over its command link.

use super::info::board;
use super::link::Link;
use firmware::control::Reason;
use firmware::control::update::{Refusal, Report, Running, Step};
use firmware::update::header::{HEADER_LEN, Header};
use firmware::wire::command::{MAX_CHUNK, Request, Response};
use host_core::error::Error;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

/// The first version of the command link that has updates. Messages are never moved, so a device
/// with another version than this program's can be updated.
const FIRST_LINK: u16 = 13;
/// Time between two looks at a device that restarts.
const LOOK: Duration = Duration::from_millis(500);

/// An update: an image for each slot of a board.
#[derive(Clone, Debug)]
pub struct Update {
    file: PathBuf,
    parts: Vec<SlotImage>,
}

#[derive(Clone, Debug)]
struct SlotImage {
    bytes: [u8; HEADER_LEN],
    header: Header,
    image: Vec<u8>,
}

/// Result of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tried {
    /// It has proved itself and stays.
    Confirmed,
    /// It runs, and has not proved itself yet.
    OnTrial,
    /// The device went back to the firmware before.
    WentBack,
}

impl Update {
    /// Reads the file of an update.
    ///
    /// # Errors
    /// It cannot be read, or is none.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(file).map_err(|error| Error::reading(file, error))?;
        Self::parse(file, &bytes)
    }

    /// The bytes of a file, whose name is for messages.
    ///
    /// # Errors
    /// The bytes are no update.
    pub fn parse(file: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let refused = |problem: &str| Error::Option {
            option: file.display().to_string(),
            problem: problem.into(),
            remedy: "give the file BOARD.update of a release, or of `cargo xtask sign`, and \
                     compare its checksum"
                .into(),
        };
        let (mut rest, mut parts) = (bytes, Vec::new());
        while !rest.is_empty() {
            let header = rest.first_chunk().and_then(|bytes| {
                let header = Header::parse(bytes)?;
                Some((*bytes, header))
            });
            let Some((bytes, header)) = header else {
                return Err(refused("is no update: it has no header of one"));
            };
            rest = &rest[HEADER_LEN..];
            let length = header.length as usize;
            let Some((image, behind)) = rest.split_at_checked(length) else {
                return Err(refused(
                    "is truncated: an image is shorter than its header states",
                ));
            };
            rest = behind;
            parts.push(SlotImage {
                bytes,
                header,
                image: image.to_vec(),
            });
        }
        if parts.is_empty() {
            return Err(refused("is empty"));
        }
        Ok(Self {
            file: file.to_owned(),
            parts,
        })
    }

    /// Version of the firmware.
    #[must_use]
    pub fn version(&self) -> String {
        version(self.parts[0].header.version)
    }

    /// The part for the free slot of this board.
    fn part(&self, name: &str, slot: u32) -> Result<&SlotImage, Error> {
        let refused = |problem: String, remedy: &str| Error::Option {
            option: self.file.display().to_string(),
            problem,
            remedy: remedy.into(),
        };
        let of = self.parts[0].header.board;
        let of = String::from_utf8_lossy(&of);
        let of = of.trim_end_matches('\0');
        if of != name {
            return Err(refused(
                format!("is an update of the board {of}, and the device's board is {name}"),
                &format!("give {name}.update"),
            ));
        }
        let part = self.parts.iter().find(|part| part.header.address == slot);
        part.ok_or_else(|| {
            refused(
                format!("has no image for the free slot of the device, at {slot:#x}"),
                "make it again with `cargo xtask sign`, which makes both",
            )
        })
    }

    /// Sends the update, or the rest of one that was interrupted. `progress` gets the bytes sent
    /// and all of them. Afterwards the device is ready to restart with it.
    ///
    /// # Errors
    /// As [`Link::ask`]; the device refuses it.
    pub fn send(
        &self,
        link: &mut Link,
        older: bool,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<(), Error> {
        takes_updates(link)?;
        let name = board(link)?.name;
        let state = report(link)?;
        let part = self.part(&name, state.slot)?;
        link.order(&Request::BeginUpdate {
            header: &part.bytes,
            older,
        })?;
        let length = part.image.len();
        let mut at = report(link)?.received as usize;
        while at < length {
            progress(at, length);
            let end = length.min(at + MAX_CHUNK);
            let request = Request::WriteUpdate {
                offset: at as u32,
                bytes: &part.image[at..end],
            };
            at = match link.try_order(&request)? {
                Ok(()) => end,
                // another program has sent a piece, or an answer was lost
                Err(Reason::Update(Refusal::Order(received))) if (received as usize) > at => {
                    received as usize
                }
                Err(reason) => return Err(link.refused(&request, reason)),
            };
        }
        progress(length, length);
        link.order(&Request::FinishUpdate)
    }

    /// What becomes of the update after [`Request::Restart`]. It is looked for until it has proved
    /// itself, or `patience` is over. `open` reopens the link.
    ///
    /// # Errors
    /// The device does not come back.
    pub fn tried(
        &self,
        open: &mut dyn FnMut() -> Result<Link, Error>,
        patience: Duration,
    ) -> Result<Tried, Error> {
        let (begun, stated) = (Instant::now(), self.parts[0].header.version);
        loop {
            thread::sleep(LOOK);
            let found = open().and_then(|link| report(&mut link.with_tries(2)));
            let late = begun.elapsed() > patience;
            match found {
                Ok(report) if report.step == Step::Ready && !late => {} // before the restart
                Ok(report) if report.failed == Some(stated) => return Ok(Tried::WentBack),
                Ok(report) if report.running == Running::Confirmed => return Ok(Tried::Confirmed),
                Ok(_) if late => return Ok(Tried::OnTrial),
                Err(error) if late => return Err(error),
                Ok(_) | Err(_) => {}
            }
        }
    }
}

/// A version in words.
pub(super) fn version([major, minor, patch]: [u16; 3]) -> String {
    format!("{major}.{minor}.{patch}")
}

/// Refuses a device whose firmware is too old to be updated over the link.
fn takes_updates(link: &mut Link) -> Result<(), Error> {
    let of = link.ask(&Request::GetVersion, |answer| match answer {
        Response::Version(version) => Some(*version),
        _ => None,
    })?;
    if of.wire >= FIRST_LINK {
        return Ok(());
    }
    let problem = format!(
        "the device has firmware {}, which takes no updates over the command link",
        version(of.firmware)
    );
    Err(link.error(problem, "flash it once with a probe (docs/BOARDS.md)"))
}

/// State of the updates.
///
/// # Errors
/// As [`Link::ask`]; the board takes none.
pub(super) fn report(link: &mut Link) -> Result<Report, Error> {
    link.ask(&Request::GetUpdate, taken)
}

/// As [`report`]; `None`: the board takes no updates.
pub(super) fn perhaps(link: &mut Link) -> Result<Option<Report>, Error> {
    match link.request(&Request::GetUpdate, taken)? {
        Err(Reason::Unsupported) => Ok(None),
        other => other
            .map(Some)
            .map_err(|reason| link.refused(&Request::GetUpdate, reason)),
    }
}

fn taken(answer: &Response) -> Option<Report> {
    match answer {
        Response::Update(report) => Some(*report),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::sign::signed;
    use super::*;
    use firmware::update::DEVELOPMENT_SEED;
    use firmware::wire::command::key::Secret;

    fn file() -> Vec<u8> {
        let images = [(0x0802_0000, vec![1; 300]), (0x0810_0000, vec![2; 400])];
        signed("h743", [0, 2, 0], &images, &Secret(DEVELOPMENT_SEED)).expect("a short name")
    }

    #[test]
    fn a_file_has_an_image_for_each_slot() {
        let update = Update::parse(Path::new("h743.update"), &file()).expect("one");
        assert_eq!(update.version(), "0.2.0");
        let part = update.part("h743", 0x0810_0000).expect("the second");
        assert_eq!(part.image, [2; 400]);
        let text = |part: Result<&SlotImage, Error>| part.expect_err("none").to_string();
        let other = text(update.part("pico2", 0x0810_0000));
        assert!(
            other.contains("board h743") && other.contains("give pico2.update"),
            "{other}"
        );
        let none = text(update.part("h743", 0x0800_0000));
        assert!(
            none.contains("free slot") && none.contains("0x8000000"),
            "{none}"
        );
    }

    #[test]
    fn what_is_no_update_or_truncated_is_refused_with_the_files_name() {
        let good = file();
        for (bytes, problem) in [
            (&good[..HEADER_LEN + 299], "truncated"),
            (&good[..HEADER_LEN - 1], "no header"),
            (&good[1..], "no header"),
            (&[][..], "empty"),
        ] {
            let error = Update::parse(Path::new("a.update"), bytes).expect_err(problem);
            let text = error.to_string();
            assert!(
                text.starts_with("a.update") && text.contains(problem),
                "{text}"
            );
        }
    }
}
