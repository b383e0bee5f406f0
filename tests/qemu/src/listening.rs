//! A board in QEMU whose serial lines are TCP ports that a program may connect to, as `host-sim
//! hil` does.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Stdio};

use anyhow::{Context, Result, bail};

use crate::images::Board;

/// A running board; ended when dropped.
#[derive(Debug)]
pub struct Listening {
    qemu: Child,
    /// Sensor, navigation computer, receiver, command link: `tcp:HOST:PORT`.
    pub ports: [String; 4],
}

impl Listening {
    /// Starts `board` with `image` on ports that the system chooses.
    ///
    /// # Errors
    /// QEMU cannot be started, or does not say where it listens.
    pub fn start(board: Board, image: &Path) -> Result<Self> {
        let mut command = board.machine.command(image);
        for _ in 0..4 {
            command.args(["-serial", "tcp:127.0.0.1:0,server=on,wait=off,nodelay=on"]);
        }
        command.args(["-monitor", "stdio"]);
        let mut qemu = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .context("cannot start QEMU")?;
        let ports = ports(&mut qemu);
        // Created first, so that QEMU ends if its ports are not found.
        let mut listening = Self {
            qemu,
            ports: Default::default(),
        };
        listening.ports = ports?;
        Ok(listening)
    }
}

/// Asks the monitor, in the order of the boards' UARTs: `serial0:
/// filename=disconnected:tcp:127.0.0.1:40001,server=on`.
fn ports(qemu: &mut Child) -> Result<[String; 4]> {
    let mut monitor = qemu.stdin.take().context("no monitor")?;
    monitor.write_all(b"info chardev\n")?;
    monitor.flush()?;
    let mut ports: [String; 4] = Default::default();
    let monitor_output = qemu.stdout.take().context("no monitor")?;
    for line in BufReader::new(monitor_output).lines() {
        let line = line?;
        for (number, port) in ports.iter_mut().enumerate() {
            if let Some((_, rest)) = line.split_once(&format!("serial{number}: "))
                && let Some((_, address)) = rest.split_once("tcp:")
            {
                let end = address.find(',').unwrap_or(address.len());
                *port = format!("tcp:{}", &address[..end]);
            }
        }
        if ports.iter().all(|port| !port.is_empty()) {
            qemu.stdin = Some(monitor); // stays open: QEMU ends with its monitor
            return Ok(ports);
        }
    }
    bail!("QEMU does not say where it listens")
}

impl Listening {
    /// Pauses the board, as if it hung or had lost its cable, or resumes it.
    ///
    /// # Errors
    /// QEMU's monitor is gone.
    pub fn stands_still(&mut self, still: bool) -> Result<()> {
        let monitor = self.qemu.stdin.as_mut().context("no monitor")?;
        let order: &[u8] = if still { b"stop\n" } else { b"cont\n" };
        monitor.write_all(order)?;
        Ok(monitor.flush()?)
    }
}

impl Drop for Listening {
    fn drop(&mut self) {
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}
