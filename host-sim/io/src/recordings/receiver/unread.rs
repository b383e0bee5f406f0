//! Logs of `NovAtel` receivers in text that cannot be read: abbreviated ones, which have no
//! checksum, and those that are longer than what a framer holds. They are named to the user whose
//! log holds no fix.

use firmware::wire::framer::LONGEST;
use std::collections::BTreeMap;

/// Bytes of a line that are looked at for its name.
const NAME: usize = 24;

/// Lines so far.
#[derive(Debug, Default)]
pub(super) struct Unread {
    head: Vec<u8>,
    len: usize,
    /// Abbreviated, by name.
    pub(super) abbreviated: BTreeMap<String, usize>,
    /// Too long, by name.
    pub(super) long: BTreeMap<String, usize>,
}

impl Unread {
    /// The next bytes; none at the end of the log.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if matches!(byte, b'\r' | b'\n') {
                self.line();
                continue;
            }
            self.len += 1;
            if self.head.len() < NAME {
                self.head.push(*byte);
            }
        }
        if bytes.is_empty() {
            self.line();
        }
    }

    fn line(&mut self) {
        let (head, len) = (
            std::mem::take(&mut self.head),
            std::mem::take(&mut self.len),
        );
        let Some((first, rest)) = head.split_first() else {
            return;
        };
        let is_name = |byte: &u8| byte.is_ascii_uppercase() || byte.is_ascii_digit();
        let end = rest.iter().take_while(|byte| is_name(byte)).count();
        let (name, behind) = rest.split_at(end);
        let counts = match (first, behind.first()) {
            _ if name.len() < 4 => return,
            (b'<', Some(b' ')) => &mut self.abbreviated,
            (b'#', Some(b',')) if len > LONGEST - 8 => &mut self.long,
            _ => return,
        };
        let name = String::from_utf8_lossy(name).into_owned();
        *counts.entry(name).or_default() += 1;
    }
}
