//! The other end of a UART: sends bytes at their times, and records what it receives.
use std::collections::VecDeque;

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;

/// A peer of a UART, with bytes to send and bytes received.
#[derive(Debug, Default)]
pub struct Line {
    /// When the start bit of each byte begins, ns, and the byte.
    pub coming: VecDeque<(u64, u8)>,
    /// When the stop bit of each byte ended, ns, and the byte.
    pub left: Vec<(u64, u16)>,
    /// Packets received: bytes that end with a zero.
    pub answers: usize,
}

impl Line {
    /// Queues bytes from a time on, ns. Returns when their start bits begin.
    pub fn send(&mut self, at: u64, baud: u64, bytes: &[u8]) -> Vec<u64> {
        let begins = (0..).map(|n| at + n * 10_000_000_000 / baud);
        let begins: Vec<u64> = begins.take(bytes.len()).collect();
        let coming = begins.iter().copied().zip(bytes.iter().copied());
        self.coming.extend(coming);
        begins
    }
}

impl Store for Line {}

impl Peer for Line {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        let is_first = self.left.last().is_none_or(|(_, last)| *last == 0);
        self.answers += usize::from(word == 0 && !is_first);
        self.left.push((context.now().0, word));
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let due = self.coming.front().is_some_and(|(at, _)| *at <= now.0);
        due.then(|| self.coming.pop_front())
            .flatten()
            .map(|(_, byte)| byte.into())
    }
}
