//! A line at a socket, connected to the latest client.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

/// Number of bytes that wait for a slow reader. More bytes are lost, in whole messages.
const WAITING: usize = 1 << 18;

/// A line at a socket.
pub(super) struct Socket {
    listener: TcpListener,
    stream: Option<TcpStream>,
    waiting: VecDeque<u8>,
}

impl Socket {
    /// A line at a listener that does not block.
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

    /// Sends as much as the reader accepts. Without a reader the bytes are dropped.
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

    /// Receives the bytes that have arrived.
    pub fn receive(&mut self, into: &mut VecDeque<u8>) {
        let mut buffer = [0; 1024];
        while let Some(Ok(len @ 1..)) = self.stream().map(|of| of.read(&mut buffer)) {
            into.extend(buffer.get(..len).unwrap_or_default());
        }
    }
}
