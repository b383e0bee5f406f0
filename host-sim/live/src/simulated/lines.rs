//! A line at a socket, at whose other end is whoever connected last.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

/// Bytes that wait for a slow reader. What comes beyond is lost, whole messages at a time.
const WAITING: usize = 1 << 18;

/// See the module.
pub(super) struct Socket {
    listener: TcpListener,
    stream: Option<TcpStream>,
    waiting: VecDeque<u8>,
}

impl Socket {
    /// Of a listener that does not block.
    pub fn new(listener: TcpListener) -> Self {
        Self {
            listener,
            stream: None,
            waiting: VecDeque::new(),
        }
    }

    fn stream(&mut self) -> Option<&mut TcpStream> {
        if let Ok((stream, _)) = self.listener.accept()
            && stream.set_nonblocking(true).is_ok()
        {
            let _ = stream.set_nodelay(true); // only slower without
            self.stream = Some(stream);
            self.waiting.clear();
        }
        self.stream.as_mut()
    }

    /// Sends what the reader takes. Nothing waits without a reader.
    pub fn send(&mut self, bytes: &[u8]) {
        if self.stream().is_none() {
            return;
        }
        if self.waiting.len() + bytes.len() <= WAITING {
            self.waiting.extend(bytes);
        }
        while let (Some(stream), (head, _)) = (&mut self.stream, self.waiting.as_slices()) {
            if head.is_empty() {
                return;
            }
            match stream.write(head) {
                Ok(sent @ 1..) => drop(self.waiting.drain(..sent)),
                _ => return,
            }
        }
    }

    /// Receives what has come.
    pub fn receive(&mut self, into: &mut VecDeque<u8>) {
        let mut buffer = [0; 1024];
        while let Some(Ok(len @ 1..)) = self.stream().map(|of| of.read(&mut buffer)) {
            into.extend(buffer.get(..len).unwrap_or_default());
        }
    }
}
