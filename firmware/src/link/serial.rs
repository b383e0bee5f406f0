//! A line over `embedded-io`.

use super::{Full, Line, Lost};
use embedded_io::{Read, ReadReady, Write, WriteReady};
use heapless::Vec;

/// The longest message a [`Serial`] sends: any frame, any packet of the command link.
pub const LONGEST: usize = 256;

/// A line made of a reader and a writer that do not wait when they are ready: the ends of a
/// [`super::ring`], a UART driver, a socket.
#[derive(Debug)]
pub struct Serial<R, W> {
    reader: R,
    writer: W,
    /// The part of the last message that the writer did not take at once. The next message is
    /// accepted when it is gone.
    rest: Vec<u8, LONGEST>,
}

impl<R, W> Serial<R, W> {
    /// A line from a reader and a writer.
    pub const fn new(reader: R, writer: W) -> Serial<R, W> {
        Serial {
            reader,
            writer,
            rest: Vec::new(),
        }
    }

    /// The reader and the writer.
    pub fn parts(&mut self) -> (&mut R, &mut W) {
        (&mut self.reader, &mut self.writer)
    }
}

impl<R, W: Write + WriteReady> Serial<R, W> {
    /// Bytes the writer takes now; none when it is not ready or broken.
    fn write(writer: &mut W, bytes: &[u8]) -> usize {
        match writer.write_ready() {
            Ok(true) => writer.write(bytes).unwrap_or(0),
            _ => 0,
        }
    }
}

impl<R: Read + ReadReady, W: Write + WriteReady> Line for Serial<R, W> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        match self.reader.read_ready() {
            Ok(true) => self.reader.read(buffer).map_err(|_| Lost),
            Ok(false) => Ok(0),
            Err(_) => Err(Lost),
        }
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.poll();
        if !self.rest.is_empty() || message.len() > LONGEST {
            return Err(Full);
        }
        let taken = Self::write(&mut self.writer, message);
        if taken == 0 && !message.is_empty() {
            return Err(Full);
        }
        // always fits: the message does
        let _ = self
            .rest
            .extend_from_slice(message.get(taken..).unwrap_or_default());
        Ok(())
    }

    fn poll(&mut self) {
        if self.rest.is_empty() {
            return;
        }
        let taken = Self::write(&mut self.writer, &self.rest).min(self.rest.len());
        let left = self.rest.len() - taken;
        self.rest.rotate_left(taken);
        self.rest.truncate(left);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;

    /// Takes at most `room` bytes in all.
    #[derive(Default)]
    struct Port {
        sent: std::vec::Vec<u8>,
        room: usize,
    }

    impl embedded_io::ErrorType for Port {
        type Error = Infallible;
    }
    impl Write for Port {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
            assert!(self.room > 0, "it would wait");
            let n = bytes.len().min(self.room);
            self.room -= n;
            self.sent.extend_from_slice(&bytes[..n]);
            Ok(n)
        }
        fn flush(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }
    impl WriteReady for Port {
        fn write_ready(&mut self) -> Result<bool, Infallible> {
            Ok(self.room > 0)
        }
    }
    impl Read for Port {
        fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
            panic!("nothing was ready")
        }
    }
    impl ReadReady for Port {
        fn read_ready(&mut self) -> Result<bool, Infallible> {
            Ok(false)
        }
    }

    #[test]
    fn messages_go_whole_or_not_at_all() {
        let mut line = Serial::new(Port::default(), Port::default());
        assert_eq!(line.receive(&mut [0; 4]), Ok(0));
        assert_eq!(line.send(b"none"), Err(Full));
        line.parts().1.room = 3;
        assert_eq!(line.send(b"hello"), Ok(()));
        assert_eq!(line.send(b"lost"), Err(Full));
        line.parts().1.room = 1;
        line.poll();
        assert_eq!(line.send(b"lost"), Err(Full));
        line.parts().1.room = 100;
        assert_eq!(line.send(b" there"), Ok(()));
        assert_eq!(line.parts().1.sent, b"hello there");
        assert_eq!(line.send(&[0; LONGEST + 1]), Err(Full));
    }
}
