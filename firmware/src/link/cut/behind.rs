//! The navigation line for bytes of which some may have left already.

use super::Cut;
use crate::link::{Full, Line, Lost};

/// A line on which a part of the next bytes has left already.
#[derive(Debug)]
pub struct Behind<'l, L> {
    line: &'l mut L,
    gone: usize,
}

impl<'l, L: Line> Behind<'l, L> {
    /// No byte has left yet.
    pub fn nothing(line: &'l mut L) -> Behind<'l, L> {
        Behind { line, gone: 0 }
    }

    /// The next `len` bytes are those from this position of the sensor's stream on. What has not
    /// left is not cut any more.
    #[inline(always)]
    pub fn of(line: &'l mut L, start: u32, len: usize) -> Behind<'l, L> {
        let mut gone = 0;
        line.cut(&mut |cut| gone = cut.claim(start, len as u32) as usize);
        Behind { line, gone }
    }
}

impl<L: Line> Line for Behind<'_, L> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        self.line.receive(buffer)
    }

    fn is_idle(&self) -> bool {
        self.line.is_idle()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        let rest = message.get(self.gone..).unwrap_or_default();
        self.gone = self.gone.saturating_sub(message.len());
        if rest.is_empty() {
            return Ok(());
        }
        self.line.send(rest)
    }

    fn cut(&mut self, work: &mut dyn FnMut(&mut Cut)) -> bool {
        self.line.cut(work)
    }

    fn poll(&mut self) {
        self.line.poll();
    }
}
