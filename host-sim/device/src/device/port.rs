//! A serial device or a TCP socket: `tcp:HOST:PORT`, or a path such as `/dev/ttyUSB0` or `COM3`.

use firmware::configuration::{Parity, SerialLines};
use host_core::error::Error;
use serialport::{SerialPort, StopBits};
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Longest wait of one read or write. Longer waits repeat it, so that an interruption is detected.
const WAIT: Duration = Duration::from_millis(50);

/// One end of a line.
#[derive(Debug)]
pub enum Port {
    /// A socket, for example a serial line of QEMU or a terminal server.
    Tcp(TcpStream),
    /// A serial device, 8 data bits.
    Serial(Box<dyn SerialPort>),
}

impl Port {
    /// Opens the port `name`, without parity and with one stop bit. Errors name `option`. Sockets
    /// ignore `baud`.
    ///
    /// # Errors
    /// There is no such port, or it may not be used.
    pub fn open(option: &str, name: &str, baud: u32) -> Result<Self, Error> {
        let lines = SerialLines {
            sensor_baud: baud,
            ..SerialLines::DEFAULT
        };
        Self::open_as(option, name, &lines)
    }

    /// As [`Port::open`], with bit rate, parity and stop bits of a sensor's line.
    ///
    /// # Errors
    /// As [`Port::open`].
    pub fn open_as(option: &str, name: &str, lines: &SerialLines) -> Result<Self, Error> {
        let refused = |problem: String, remedy: &str| Error::Option {
            option: format!("{option} {name}"),
            problem,
            remedy: remedy.into(),
        };
        if let Some(address) = name.strip_prefix("tcp:") {
            let port = address
                .rsplit_once(':')
                .map(|(_, port)| port.parse::<u16>());
            if !matches!(port, Some(Ok(_))) {
                let problem = "has no port number behind the host".into();
                return Err(refused(problem, "give tcp:HOST:PORT"));
            }
            let socket = TcpStream::connect(address).and_then(|socket| {
                socket.set_nodelay(true)?;
                socket.set_read_timeout(Some(WAIT))?;
                socket.set_write_timeout(Some(WAIT))?;
                Ok(socket)
            });
            return socket.map(Self::Tcp).map_err(|error| {
                let remedy = "start what listens at tcp:HOST:PORT: a port server, \
                              `host-sim device --simulate`, QEMU with -serial ...,server=on";
                refused(format!("does not connect ({error})"), remedy)
            });
        }
        let parity = match lines.parity {
            Parity::None => serialport::Parity::None,
            Parity::Even => serialport::Parity::Even,
            Parity::Odd => serialport::Parity::Odd,
        };
        let stop_bits = if lines.two_stop_bits {
            StopBits::Two
        } else {
            StopBits::One
        };
        let port = serialport::new(name, lines.sensor_baud)
            .parity(parity)
            .stop_bits(stop_bits)
            .timeout(WAIT)
            .open();
        port.map(Self::Serial).map_err(|error| {
            let remedy =
                "check cable and name, and that you may use the device and no other program does";
            refused(format!("does not open ({error})"), remedy)
        })
    }

    /// Another handle of the same port, for another thread.
    ///
    /// # Errors
    /// The system has no handles left.
    pub fn duplicate(&self) -> io::Result<Self> {
        match self {
            Self::Tcp(socket) => socket.try_clone().map(Self::Tcp),
            Self::Serial(port) => Ok(Self::Serial(port.try_clone()?)),
        }
    }

    /// Receives what arrives within 50 ms, perhaps nothing.
    ///
    /// # Errors
    /// The port is broken or closed.
    pub fn receive(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = match self {
            Self::Tcp(socket) => match socket.read(buffer) {
                Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
                other => other,
            },
            Self::Serial(port) => port.read(buffer),
        };
        match read {
            Err(error) if waits(&error) => Ok(0),
            other => other,
        }
    }

    /// Sends `bytes` until `stop` returns true. Returns whether all were sent.
    ///
    /// # Errors
    /// The port is broken or closed.
    pub fn send(&mut self, mut bytes: &[u8], stop: &dyn Fn() -> bool) -> io::Result<bool> {
        while !bytes.is_empty() {
            let written = match self {
                Self::Tcp(socket) => socket.write(bytes),
                Self::Serial(port) => port.write(bytes),
            };
            match written {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(n) => bytes = bytes.get(n..).unwrap_or_default(),
                Err(error) if waits(&error) => {}
                Err(error) => return Err(error),
            }
            if stop() && !bytes.is_empty() {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

fn waits(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}
