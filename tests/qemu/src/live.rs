//! A board in QEMU with sockets at its serial lines and at QEMU's monitor.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::debugger::Debugger;
use crate::images::Board;
use crate::memory::{Memory, RAM_START};

/// Bytes of RAM that are looked at: the most that a board has.
const SAVED: u64 = 192 * 1024;

/// How long QEMU may take to start or to answer.
const PATIENCE: Duration = Duration::from_secs(120);

/// A running board; ended when dropped.
#[derive(Debug)]
pub struct Live {
    qemu: Child,
    image: PathBuf,
    monitor: TcpStream,
    /// Sensor line.
    pub sensor: TcpStream,
    /// Navigation computer's line.
    pub navigation: TcpStream,
    /// Receiver's line.
    pub gnss: TcpStream,
    /// Command link.
    pub command: TcpStream,
}

impl Live {
    /// Starts `board` with `image`.
    ///
    /// # Errors
    /// QEMU cannot be started or does not connect.
    pub fn start(board: Board, image: &Path) -> Result<Self> {
        Self::start_with(board, image, &[])
    }

    /// As [`Live::start`], with memory contents that exist before the board starts: address and
    /// file.
    ///
    /// # Errors
    /// As [`Live::start`].
    pub fn start_with(board: Board, image: &Path, memory: &[(u32, &Path)]) -> Result<Self> {
        let listen = || TcpListener::bind("127.0.0.1:0");
        let listeners = [listen()?, listen()?, listen()?, listen()?, listen()?];
        let mut command = board.machine.command(image);
        for (index, listener) in listeners.iter().enumerate() {
            let option = if index < 4 { "-serial" } else { "-monitor" };
            let port = listener.local_addr()?.port();
            command.args([option, &format!("tcp:127.0.0.1:{port},nodelay=on")]);
        }
        for (address, file) in memory {
            let loader = format!(
                "loader,file={},addr={address:#x},force-raw=on",
                file.display()
            );
            command.args(["-device", &loader]);
        }
        let mut qemu = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::inherit())
            .spawn()
            .context("cannot start QEMU")?;
        // In the order of the boards' UARTs.
        let mut streams = Vec::new();
        for listener in &listeners {
            match accept(listener, &mut qemu) {
                Ok(stream) => streams.push(stream),
                Err(error) => {
                    let _ = qemu.kill();
                    let _ = qemu.wait();
                    return Err(error);
                }
            }
        }
        let [sensor, navigation, gnss, command, monitor] =
            <[TcpStream; 5]>::try_from(streams).map_err(|_| anyhow::anyhow!("five lines"))?;
        let mut live = Self {
            qemu,
            image: image.to_owned(),
            monitor,
            sensor,
            navigation,
            gnss,
            command,
        };
        live.prompt().context("QEMU's monitor")?;
        Ok(live)
    }

    /// Reads the output of QEMU's monitor up to its prompt.
    fn prompt(&mut self) -> Result<String> {
        let mut output = Vec::new();
        let mut byte = [0];
        while !output.ends_with(b"(qemu) ") {
            self.monitor.read_exact(&mut byte)?;
            output.push(byte[0]);
        }
        Ok(String::from_utf8_lossy(&output).into_owned())
    }

    /// What QEMU's monitor answers to a line.
    ///
    /// # Errors
    /// The monitor is gone.
    pub fn monitor(&mut self, line: &str) -> Result<String> {
        self.monitor.write_all(format!("{line}\n").as_bytes())?;
        self.prompt()
    }

    /// Stops the board.
    ///
    /// # Errors
    /// QEMU's debug server does not connect.
    pub fn debugger(&mut self) -> Result<Debugger> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let port = listener.local_addr()?.port();
        self.monitor(&format!(
            "chardev-add socket,id=debugger,host=127.0.0.1,port={port},nodelay=on"
        ))?;
        let line = accept(&listener, &mut self.qemu)?;
        self.monitor("gdbserver chardev:debugger")?;
        Debugger::new(line)
    }

    /// A copy of the board's RAM as it is now.
    ///
    /// # Errors
    /// QEMU does not write it.
    pub fn memory(&mut self) -> Result<Memory> {
        let directory = tempfile::tempdir()?;
        let file = directory.path().join("ram");
        let save = format!("pmemsave {RAM_START:#x} {SAVED} \"{}\"", file.display());
        let output = self.monitor(&save)?;
        let ram = std::fs::read(&file).with_context(|| output)?;
        ensure!(ram.len() as u64 == SAVED, "half a copy of RAM");
        Memory::new(&self.image, ram)
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

/// QEMU's connection, unless QEMU has ended or takes too long.
fn accept(listener: &TcpListener, qemu: &mut Child) -> Result<TcpStream> {
    listener.set_nonblocking(true)?;
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(PATIENCE))?;
                return Ok(stream);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => return Err(error.into()),
        }
        if let Some(status) = qemu.try_wait()? {
            bail!("QEMU ended at once: {status}");
        }
        thread::sleep(Duration::from_millis(2));
    }
    bail!("QEMU did not connect within {PATIENCE:?}")
}

/// Sends `bytes` on one line while reading up to `expected` bytes from another. Returns what
/// arrived; it is less only when the board stopped sending.
///
/// # Errors
/// A line is broken.
pub fn through(to: &TcpStream, bytes: &[u8], from: &TcpStream, expected: usize) -> Result<Vec<u8>> {
    thread::scope(|scope| {
        let mut to = to;
        let sender = scope.spawn(move || to.write_all(bytes));
        let mut from = from;
        let mut came = vec![0; expected];
        let mut filled = 0;
        while filled < expected {
            match from.read(&mut came[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    break;
                }
                Err(error) => return Err(error.into()),
            }
        }
        came.truncate(filled);
        match sender.join() {
            Ok(sent) => sent?,
            Err(_) => bail!("the sender panicked"),
        }
        Ok(came)
    })
}
