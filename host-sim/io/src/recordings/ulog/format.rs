//! The `ULog` format of PX4 (docs.px4.io, "ULog File Format", version 1), read from front to back.
//!
//! ```text
//! file     55 4C 6F 67 01 12 35 | version | start, us, u64 | messages
//! message  length u16 | type, a letter | content
//! B        8 bytes of flags | 8 bytes of flags that a reader must know | three offsets u64
//! F        "topic:type field;type field;..."; types may be arrays and other topics
//! P        length of the key | "float NAME" or "int32_t NAME" | value
//! A        instance | number u16 | topic
//! D        number u16 | fields in the order of F, without padding at the end
//! O        duration of a dropout of the logger, ms, u16
//! S        2F 73 13 20 25 0C BB 12, where reading goes on after damage
//! ```
//!
//! It is written here because the crates for it do not fit: `px4-ulog` 0.6.1 panics on short
//! messages and stops at the first damaged one, and `yule_log` 0.4.0 brings a logger and regular
//! expressions.

use super::row::{Fields, Number, Row, Subscription};
use crate::recordings::input::Input;
use std::collections::BTreeMap;
use std::io::{self, Read};

const MAGIC: [u8; 7] = [0x55, 0x4C, 0x6F, 0x67, 0x01, 0x12, 0x35];
/// A whole message of type S.
const SYNC: [u8; 11] = [8, 0, b'S', 0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12];
/// The messages of version 1.
const KNOWN: &[u8] = b"BFIMPQARDLCSO";
/// The only flag that a reader must know: the log has been continued at an offset.
const APPENDED: [u8; 8] = [1, 0, 0, 0, 0, 0, 0, 0];
/// Largest depth of nested topics.
const DEEPEST: usize = 8;
/// Largest size of a topic, bytes.
const LARGEST: usize = u16::MAX as usize;

/// Summary of a file.
#[derive(Debug, Default)]
pub(super) struct Summary {
    /// Parameters of the autopilot at the start.
    pub(super) parameters: BTreeMap<String, f64>,
    /// Topics with their instances.
    pub(super) topics: BTreeMap<String, Vec<u8>>,
    /// Dropouts of the logger, and their whole duration, ms.
    pub(super) dropouts: (usize, u64),
    /// Damaged bytes that were left out.
    pub(super) damaged: u64,
    /// Whether the file ends within a message.
    pub(super) cut: bool,
}

/// Why a file cannot be read: rest of a sentence that begins with the location, and remedy.
pub(super) type Fault = (String, &'static str);

/// Reads a file.
pub(super) struct Walk<'a> {
    /// Whether messages of a topic are wanted. It is asked once for each.
    wanted: &'a mut dyn FnMut(&str, u8) -> bool,
    /// Takes a message; `None` if it lacks a field.
    take: &'a mut dyn FnMut(&Row<'_>) -> Option<()>,
    formats: BTreeMap<String, Vec<Declared>>,
    subscriptions: BTreeMap<u16, Subscription>,
    /// Offsets at which the log continues, in rising order.
    offsets: Vec<u64>,
    summary: Summary,
}

/// A field as it is declared: type, number of elements, name.
type Declared = (String, usize, String);

impl<'a> Walk<'a> {
    pub(super) fn new(
        wanted: &'a mut dyn FnMut(&str, u8) -> bool,
        take: &'a mut dyn FnMut(&Row<'_>) -> Option<()>,
    ) -> Self {
        Self {
            wanted,
            take,
            formats: BTreeMap::new(),
            subscriptions: BTreeMap::new(),
            offsets: Vec::new(),
            summary: Summary::default(),
        }
    }

    /// Reads to the end, and beyond damage.
    pub(super) fn file(mut self, input: &mut Input<'_>) -> Result<Summary, Fault> {
        let mut head = [0; 16];
        let whole = input.read_exact(&mut head);
        if whole.is_err() || !head.starts_with(&MAGIC) {
            let remedy = "give a log of PX4, which ends in .ulg";
            return Err(("is no ULog file".into(), remedy));
        }
        let mut buffer = Vec::new();
        loop {
            match self.message(input, &mut buffer) {
                Ok(true) => {}
                Ok(false) => return Ok(self.summary),
                Err(Stop::Io(_)) if input.ended => {
                    self.summary.cut = true;
                    return Ok(self.summary);
                }
                Err(Stop::Io(error)) => {
                    let remedy = "get the file again, it is damaged";
                    return Err((format!("cannot be unpacked ({error})"), remedy));
                }
                Err(Stop::Fault(fault)) => return Err(fault),
            }
        }
    }

    /// One message; false at the end of the file.
    fn message(&mut self, input: &mut Input<'_>, buffer: &mut Vec<u8>) -> Result<bool, Stop> {
        let start = input.at;
        let mut head = [0; 3];
        let (first, rest) = head.split_at_mut(1);
        if input.read(first)? == 0 {
            return Ok(false);
        }
        input.read_exact(rest)?;
        let length = u64::from(u16::from_le_bytes([head[0], head[1]]));
        // The part before an offset may end within a message.
        if let Some(at) = self
            .offsets
            .first()
            .copied()
            .filter(|at| start + 3 + length > *at)
        {
            self.offsets.remove(0);
            if start < at && input.at <= at {
                skip(input, at - input.at)?;
                return Ok(true);
            }
        }
        if !KNOWN.contains(&head[2]) {
            self.resume(input, head)?;
            return Ok(true);
        }
        buffer.clear();
        if Read::by_ref(input).take(length).read_to_end(buffer)? as u64 != length {
            return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
        }
        self.content(head[2], buffer)?;
        Ok(true)
    }

    fn content(&mut self, kind: u8, bytes: &[u8]) -> Result<(), Stop> {
        let intact = match kind {
            b'B' => return self.flags(bytes).map_err(Stop::Fault),
            b'F' => self.format(bytes).is_some(),
            b'P' => self.parameter(bytes).is_some(),
            b'A' => self.subscribe(bytes).is_some(),
            b'D' => self.data(bytes).is_some(),
            b'O' => self.dropout(bytes).is_some(),
            _ => true,
        };
        if !intact {
            self.summary.damaged += 3 + bytes.len() as u64;
        }
        Ok(())
    }

    fn flags(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        let must_know: [u8; 8] = bytes
            .get(8..16)
            .and_then(|b| b.try_into().ok())
            .unwrap_or_default();
        if must_know
            .iter()
            .zip(APPENDED)
            .any(|(flag, known)| flag & !known != 0)
        {
            let problem = format!("needs a newer reader (flags {must_know:02x?})");
            return Err((problem, "convert it with the tools of PX4"));
        }
        let offsets = bytes.get(16..40).unwrap_or_default().chunks_exact(8);
        let offset = |b: &[u8]| Some(u64::from_le_bytes(b.try_into().ok()?));
        self.offsets = offsets.filter_map(offset).filter(|at| *at > 0).collect();
        self.offsets.sort_unstable();
        Ok(())
    }

    fn format(&mut self, bytes: &[u8]) -> Option<()> {
        let (topic, fields) = std::str::from_utf8(bytes).ok()?.split_once(':')?;
        let fields = fields.split(';').filter(|field| !field.is_empty());
        let fields: Option<Vec<Declared>> = fields.map(declared).collect();
        self.formats.insert(topic.to_owned(), fields?);
        Some(())
    }

    fn parameter(&mut self, bytes: &[u8]) -> Option<()> {
        let (length, rest) = bytes.split_first()?;
        let (key, value) = rest.split_at_checked(usize::from(*length))?;
        let value: [u8; 4] = value.try_into().ok()?;
        let (kind, name) = std::str::from_utf8(key).ok()?.split_once(' ')?;
        let value = match kind {
            "float" => f64::from(f32::from_le_bytes(value)),
            "int32_t" => f64::from(i32::from_le_bytes(value)),
            _ => return None,
        };
        let parameters = &mut self.summary.parameters;
        parameters.entry(name.to_owned()).or_insert(value);
        Some(())
    }

    fn subscribe(&mut self, bytes: &[u8]) -> Option<()> {
        let (&[instance, low, high], topic) = bytes.split_first_chunk()?;
        let topic = std::str::from_utf8(topic).ok()?.to_owned();
        let mut fields = Fields::new();
        let mut at = 0;
        for (kind, count, name) in self.formats.get(&topic)? {
            if let Some(number) = Number::of(kind) {
                fields.push((name.clone(), number, at, *count));
            }
            at = size(&self.formats, kind, DEEPEST)?
                .checked_mul(*count)?
                .checked_add(at)?;
        }
        let instances = self.summary.topics.entry(topic.clone()).or_default();
        if !instances.contains(&instance) {
            instances.push(instance);
        }
        let subscription = Subscription {
            wanted: (self.wanted)(&topic, instance),
            topic,
            instance,
            fields,
        };
        self.subscriptions
            .insert(u16::from_le_bytes([low, high]), subscription);
        Some(())
    }

    fn data(&mut self, bytes: &[u8]) -> Option<()> {
        let (number, bytes) = bytes.split_first_chunk()?;
        let subscription = self.subscriptions.get(&u16::from_le_bytes(*number))?;
        match subscription.wanted {
            true => (self.take)(&Row {
                subscription,
                bytes,
            }),
            false => Some(()),
        }
    }

    fn dropout(&mut self, bytes: &[u8]) -> Option<()> {
        let (count, ms) = &mut self.summary.dropouts;
        *count += 1;
        *ms += u64::from(u16::from_le_bytes(*bytes.first_chunk()?));
        Some(())
    }

    /// Looks for the next message of type S after one that cannot be, and counts the bytes before.
    fn resume(&mut self, input: &mut Input<'_>, head: [u8; 3]) -> Result<(), Stop> {
        let mut last = [0; SYNC.len()];
        let mut bytes = head.to_vec();
        loop {
            for byte in bytes.drain(..) {
                self.summary.damaged += 1;
                last.rotate_left(1);
                last[SYNC.len() - 1] = byte;
            }
            if last == SYNC {
                self.summary.damaged -= SYNC.len() as u64;
                return Ok(());
            }
            let mut next = [0];
            input.read_exact(&mut next)?;
            bytes.push(next[0]);
        }
    }
}

/// Why a message cannot be read.
enum Stop {
    Io(io::Error),
    Fault(Fault),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

fn skip(input: &mut Input<'_>, length: u64) -> Result<(), Stop> {
    if io::copy(&mut input.take(length), &mut io::sink())? == length {
        Ok(())
    } else {
        Err(io::Error::from(io::ErrorKind::UnexpectedEof).into())
    }
}

/// `type name` or `type[count] name`.
fn declared(field: &str) -> Option<Declared> {
    let (kind, name) = field.split_once(' ')?;
    match kind.strip_suffix(']') {
        None => Some((kind.to_owned(), 1, name.to_owned())),
        Some(array) => {
            let (kind, count) = array.split_once('[')?;
            let count = count.parse().ok()?;
            (1..=LARGEST).contains(&count).then_some(())?;
            Some((kind.to_owned(), count, name.to_owned()))
        }
    }
}

/// Bytes of a type; `None` if it is empty, too large, nested too deep or not declared.
fn size(formats: &BTreeMap<String, Vec<Declared>>, kind: &str, deepest: usize) -> Option<usize> {
    if let Some(number) = Number::of(kind) {
        return Some(number.size());
    }
    let deeper = deepest.checked_sub(1)?;
    let mut sum = 0_usize;
    for (kind, count, _) in formats.get(kind)? {
        sum = size(formats, kind, deeper)?
            .checked_mul(*count)?
            .checked_add(sum)?;
        (sum <= LARGEST).then_some(())?;
    }
    (sum > 0).then_some(sum)
}
