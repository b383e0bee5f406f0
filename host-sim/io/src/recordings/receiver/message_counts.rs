//! The messages of a log, counted by their names, for the user whose log holds no fix.

use super::line::Line;
use super::name;
use super::unread::Unread;
use crate::recordings::session::complain;
use firmware::wire::framer::Kind;
use firmware::wire::receiver::ReceiverFormat;
use host_core::error::Error;
use std::collections::BTreeMap;
use std::path::Path;

/// Names that are listed.
const LISTED: usize = 6;

/// Good messages by name.
#[derive(Debug, Default)]
pub(super) struct MessageCounts {
    good: BTreeMap<String, usize>,
    /// Number of the good messages that are read.
    read: usize,
    /// Sentences of NMEA without a checksum.
    unchecked: BTreeMap<String, usize>,
}

impl MessageCounts {
    pub(super) fn note(&mut self, format: ReceiverFormat, kind: Kind, message: &[u8]) {
        let is_long = kind == Kind::Long && is_known(format, message);
        if !is_long && !matches!(kind, Kind::Frame | Kind::Other) {
            return;
        }
        let mut name = message_name(format, message);
        let is_position = ["GGA", "GNS", "RMC", "GLL"].contains(&name.as_str());
        if kind == Kind::Other && is_position && message.contains(&b'*') {
            name = text_name(message); // of a talker that is no receiver
        }
        if format == ReceiverFormat::Nmea && !message.contains(&b'*') {
            *self.unchecked.entry(name).or_default() += 1;
            return;
        }
        self.read += usize::from(kind == Kind::Frame);
        *self.good.entry(name).or_default() += 1;
    }

    /// Whether there are sentences that would be read, and none has a checksum.
    pub(super) fn lacks_checksums(&self) -> bool {
        self.read == 0 && !self.unchecked.is_empty()
    }

    fn is_empty(&self) -> bool {
        self.good.is_empty() && self.unchecked.is_empty()
    }

    /// "412 PVTCartesian, wanted PVTGeodetic"
    fn text(&self, format: ReceiverFormat, given: bool) -> String {
        let mut text = listed(&self.good);
        if self.lacks_checksums() {
            let join = if text.is_empty() { "" } else { ", " };
            text += &format!("{join}{} without a checksum", listed(&self.unchecked));
            if !given {
                return text;
            }
        }
        if self.read > 0 || self.lacks_checksums() {
            let none = ", none with a fix";
            return match format {
                ReceiverFormat::Nmea => text + none,
                _ => text + none + " in three dimensions",
            };
        }
        text + ", wanted " + wanted(format)
    }
}

/// The messages that a fix needs.
const fn wanted(format: ReceiverFormat) -> &'static str {
    match format {
        ReceiverFormat::Ubx => "NAV-PVT, or NAV-POSLLH and NAV-VELNED",
        ReceiverFormat::Nmea => {
            "GGA, GNS, RMC or GLL of a receiver (GP, GN, GL, GA, GB, BD, GQ, QZ, GI)"
        }
        ReceiverFormat::Novatel => "BESTPOS and BESTVEL, or BESTXYZ",
        ReceiverFormat::Sbf => "PVTGeodetic or PVTCartesian",
    }
}

/// The most frequent ones.
fn listed(counts: &BTreeMap<String, usize>) -> String {
    let mut all: Vec<_> = counts.iter().collect();
    all.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    let more = all.len().saturating_sub(LISTED);
    let most = all.iter().take(LISTED);
    let mut texts: Vec<String> = most
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    if more > 0 {
        texts.push(format!("{more} other kinds"));
    }
    texts.join(", ")
}

/// The error of a log without a fix. `other`: a protocol that is not read, and whether it has
/// positions.
pub(super) fn nothing(
    file: &Path,
    lines: &[Line],
    unread: &Unread,
    other: Option<(String, bool)>,
) -> Error {
    if let Some(error) = in_text(file, lines, unread) {
        return error;
    }
    let heard = lines.iter().filter(|line| !line.seen.is_empty());
    let seen = heard.map(|line| {
        let text = line.seen.text(line.format, line.given);
        format!("{}: {text}", name(line.format))
    });
    let mut seen: Vec<String> = seen.collect();
    let is_other = seen.is_empty() && other.is_some();
    let positions = other.as_ref().is_some_and(|(_, positions)| *positions);
    seen.extend(other.map(|(what, _)| format!("{what}, not read")));
    if seen.is_empty() {
        let given = lines.first().filter(|line| line.given);
        let (problem, remedy) = match given {
            Some(line) => (
                format!("has no {} messages", name(line.format)),
                "leave --fixes-protocol out: the protocol is then detected",
            ),
            None => (
                "has no messages of a receiver that is known".to_owned(),
                "give a log of UBX, NMEA 0183, NovAtel (OEM, binary or text) or SBF messages",
            ),
        };
        return complain(file, "fixes", problem, remedy);
    }
    let problem = format!("has no fix; seen are {}", seen.join("; "));
    let unchecked = lines
        .iter()
        .any(|line| line.seen.lacks_checksums() && !line.given);
    if unchecked {
        let remedy = "give --fixes-protocol nmea: it reads sentences without a checksum";
        return complain(file, "fixes", problem, remedy);
    }
    let remedy = match is_other && positions {
        true => {
            "set the receiver to NMEA 0183, or let gpsd read it and log its reports (gpspipe -w)"
        }
        false => {
            "give a log with positions: UBX-NAV-PVT, GGA and RMC, BESTPOS and BESTVEL, or \
             PVTGeodetic, while the receiver sees satellites"
        }
    };
    complain(file, "fixes", problem, remedy)
}

/// The error of a log of a `NovAtel` receiver in a form of text that is not read.
fn in_text(file: &Path, lines: &[Line], unread: &Unread) -> Option<Error> {
    let novatel = |line: &&Line| line.format == ReceiverFormat::Novatel;
    lines.iter().find(novatel)?;
    let forms = [
        (
            &unread.abbreviated,
            "in abbreviated text, without a checksum",
        ),
        (&unread.long, "in text of more bytes than a device holds"),
    ];
    let forms = forms.iter().filter(|(counts, _)| !counts.is_empty());
    let seen: Vec<String> = forms
        .map(|(counts, what)| format!("{} {what}", listed(counts)))
        .collect();
    let problem = format!("has no fix; seen are NovAtel: {}", seen.join("; "));
    let remedy = "log BESTPOSB and BESTVELB (binary), or BESTPOSA and BESTVELA";
    (!seen.is_empty()).then(|| complain(file, "fixes", problem, remedy))
}

fn number(message: &[u8], at: usize) -> u16 {
    let byte = |at: usize| message.get(at).copied().unwrap_or_default();
    u16::from_le_bytes([byte(at), byte(at + 1)])
}

/// Whether bytes are the head of a message with a name. That of a long one is not checked.
fn is_known(format: ReceiverFormat, message: &[u8]) -> bool {
    let (mark, names, id): (&[u8], &[(u16, &str)], u16) = match format {
        ReceiverFormat::Ubx => (&[0xB5, 0x62], &UBX, number(message, 2).swap_bytes()),
        ReceiverFormat::Sbf => (b"$@", &SBF, number(message, 4) & 0x1FFF),
        ReceiverFormat::Novatel => (&[0xAA, 0x44], &NOVATEL, number(message, 4)),
        ReceiverFormat::Nmea => return false,
    };
    message.starts_with(mark) && names.iter().any(|(number, _)| *number == id)
}

fn message_name(format: ReceiverFormat, message: &[u8]) -> String {
    match format {
        ReceiverFormat::Ubx => {
            let [class, id] = number(message, 2).to_le_bytes();
            named(&UBX, number(message, 2).swap_bytes(), || {
                format!("{class:02X}-{id:02X}")
            })
        }
        ReceiverFormat::Sbf => {
            let id = number(message, 4) & 0x1FFF;
            named(&SBF, id, || format!("block {id}"))
        }
        ReceiverFormat::Novatel if message.first() == Some(&b'#') => text_name(message),
        ReceiverFormat::Novatel => {
            let id = number(message, 4);
            named(&NOVATEL, id, || format!("log {id}"))
        }
        ReceiverFormat::Nmea => {
            let address = text_name(message);
            let standard = address.len() == 5 && !address.starts_with('P');
            address
                .get(2..)
                .filter(|_| standard)
                .map_or_else(|| address.clone(), str::to_owned)
        }
    }
}

/// Letters and digits behind the first byte.
fn text_name(message: &[u8]) -> String {
    let text = message.iter().skip(1).map(|byte| char::from(*byte));
    text.take_while(char::is_ascii_alphanumeric)
        .take(20)
        .collect()
}

fn named(names: &[(u16, &str)], id: u16, or: impl FnOnce() -> String) -> String {
    let found = names.iter().find(|(number, _)| *number == id);
    found.map_or_else(or, |(_, name)| (*name).to_owned())
}

/// Class and id.
const UBX: [(u16, &str); 30] = [
    (0x0101, "NAV-POSECEF"),
    (0x0102, "NAV-POSLLH"),
    (0x0103, "NAV-STATUS"),
    (0x0104, "NAV-DOP"),
    (0x0105, "NAV-ATT"),
    (0x0106, "NAV-SOL"),
    (0x0107, "NAV-PVT"),
    (0x0111, "NAV-VELECEF"),
    (0x0112, "NAV-VELNED"),
    (0x0113, "NAV-HPPOSECEF"),
    (0x0114, "NAV-HPPOSLLH"),
    (0x0120, "NAV-TIMEGPS"),
    (0x0121, "NAV-TIMEUTC"),
    (0x0122, "NAV-CLOCK"),
    (0x0130, "NAV-SVINFO"),
    (0x0135, "NAV-SAT"),
    (0x0136, "NAV-COV"),
    (0x013C, "NAV-RELPOSNED"),
    (0x0143, "NAV-SIG"),
    (0x0161, "NAV-EOE"),
    (0x0210, "RXM-RAW"),
    (0x0211, "RXM-SFRB"),
    (0x0213, "RXM-SFRBX"),
    (0x0214, "RXM-MEASX"),
    (0x0215, "RXM-RAWX"),
    (0x0A09, "MON-HW"),
    (0x0D03, "TIM-TM2"),
    (0x1002, "ESF-MEAS"),
    (0x1003, "ESF-RAW"),
    (0x1010, "ESF-STATUS"),
];

/// Numbers of blocks.
const SBF: [(u16, &str); 18] = [
    (4001, "DOP"),
    (4006, "PVTCartesian"),
    (4007, "PVTGeodetic"),
    (4013, "ChannelStatus"),
    (4014, "ReceiverStatus"),
    (4017, "GPSRawCA"),
    (4027, "MeasEpoch"),
    (4028, "BaseVectorGeod"),
    (4043, "BaseVectorCart"),
    (5905, "PosCovCartesian"),
    (5906, "PosCovGeodetic"),
    (5907, "VelCovCartesian"),
    (5908, "VelCovGeodetic"),
    (5914, "ReceiverTime"),
    (5921, "EndOfPVT"),
    (5922, "EndOfMeas"),
    (5938, "AttEuler"),
    (5939, "AttCovEuler"),
];

/// Numbers of logs.
const NOVATEL: [(u16, &str); 23] = [
    (41, "RAWEPHEM"),
    (42, "BESTPOS"),
    (43, "RANGE"),
    (47, "PSRPOS"),
    (99, "BESTVEL"),
    (100, "PSRVEL"),
    (101, "TIME"),
    (140, "RANGECMP"),
    (141, "RTKPOS"),
    (216, "RTKVEL"),
    (241, "BESTXYZ"),
    (243, "PSRXYZ"),
    (244, "RTKXYZ"),
    (268, "RAWIMU"),
    (325, "RAWIMUS"),
    (507, "INSPVA"),
    (508, "INSPVAS"),
    (1335, "HEADING2"),
    (1429, "BESTGNSSPOS"),
    (1430, "BESTGNSSVEL"),
    (1465, "INSPVAX"),
    (1538, "PPPPOS"),
    (726, "BESTUTM"),
];
