//! A line at a socket with any number of clients.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};

/// Number of bytes that wait for a slow reader. More bytes are lost, in whole messages.
const WAITING: usize = 1 << 18;
/// Most clients at a time.
const MOST: usize = 8;

/// A line at a socket.
pub(super) struct Socket {
    listener: TcpListener,
    clients: Vec<Client>,
}

/// A client of a line.
pub(super) struct Client {
    stream: TcpStream,
    waiting: VecDeque<u8>,
    gone: bool,
}

impl Socket {
    /// A line at a listener that does not block.
    pub fn new(listener: TcpListener) -> Self {
        Self {
            listener,
            clients: Vec::new(),
        }
    }

    /// The clients that are there now.
    pub fn clients(&mut self) -> &mut [Client] {
        self.clients.retain(|client| !client.gone);
        while self.clients.len() < MOST
            && let Ok((stream, _)) = self.listener.accept()
        {
            if stream.set_nonblocking(true).is_ok() {
                let _ = stream.set_nodelay(true); // only slower without
                self.clients.push(Client {
                    stream,
                    waiting: VecDeque::new(),
                    gone: false,
                });
            }
        }
        &mut self.clients
    }

    /// Sends to all clients. Without one the bytes are dropped.
    pub fn send(&mut self, bytes: &[u8]) {
        for client in self.clients() {
            client.send(bytes);
        }
    }
}

impl Client {
    /// Sends as much as the reader accepts; the rest waits.
    pub fn send(&mut self, bytes: &[u8]) {
        if self.waiting.len() + bytes.len() <= WAITING {
            self.waiting.extend(bytes);
        }
        loop {
            let (head, _) = self.waiting.as_slices();
            if head.is_empty() {
                return;
            }
            match self.stream.write(head) {
                Ok(sent @ 1..) => drop(self.waiting.drain(..sent)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                _ => {
                    self.gone = true;
                    return;
                }
            }
        }
    }

    /// Receives the bytes that have arrived. False: there are none.
    pub fn receive(&mut self, into: &mut VecDeque<u8>) -> bool {
        let mut buffer = [0; 1024];
        let before = into.len();
        loop {
            match self.stream.read(&mut buffer) {
                Ok(len @ 1..) => into.extend(buffer.get(..len).unwrap_or_default()),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                _ => {
                    self.gone = true;
                    break;
                }
            }
        }
        into.len() > before
    }
}
