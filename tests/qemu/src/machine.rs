//! Runs one image in QEMU and collects its output and exit code.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use xtask::needs::start;
pub use xtask::needs::{OTHER, QEMU, QEMU_RISCV, REMEDY, available, can_start};

/// A machine of the emulator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Its name in QEMU.
    pub name: &'static str,
    /// Rate of the counter behind the instruction counts, Hz: SysTick, or RISC-V's `cycle`.
    pub systick_hz: f64,
    /// The emulator that has it.
    pub emulator: &'static str,
}

/// STM32F405 with Cortex-M4F: the product's memory map and peripherals. Its flash appears at 0 too,
/// as on the chip, so that images linked there run here and on [`MPS2_AN386`].
pub const NETDUINOPLUS2: Machine = Machine {
    name: "netduinoplus2",
    systick_hz: 168e6,
    emulator: QEMU,
};
/// Arm's MPS2 with Cortex-M4F.
pub const MPS2_AN386: Machine = Machine {
    name: "mps2-an386",
    systick_hz: 25e6,
    emulator: QEMU,
};
/// Arm's MPS2 with Cortex-M7.
pub const MPS2_AN500: Machine = Machine {
    name: "mps2-an500",
    systick_hz: 25e6,
    emulator: QEMU,
};
/// Arm's MPS2 with Cortex-M3, which executes the instructions of a Cortex-M0+, too.
pub const MPS2_AN385: Machine = Machine {
    name: "mps2-an385",
    systick_hz: 25e6,
    emulator: QEMU,
};
/// Arm's MPS2 with Cortex-M33 and its FPU.
pub const MPS2_AN505: Machine = Machine {
    name: "mps2-an505",
    systick_hz: 20e6,
    emulator: QEMU,
};
/// QEMU's own RISC-V machine. Its counter counts every instruction.
pub const RISCV32: Machine = Machine {
    name: "virt",
    systick_hz: 1e9,
    emulator: QEMU_RISCV,
};

/// How QEMU keeps time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Real time, as fast as QEMU can run.
    Free,
    /// One instruction takes one virtual nanosecond: SysTick counts instructions.
    Instructions,
}

/// The result of a run.
#[derive(Debug)]
pub struct Run {
    /// QEMU's exit code, which is the image's.
    pub code: Option<i32>,
    /// The output of the image and QEMU's own messages.
    pub output: String,
}

impl Machine {
    /// Instructions in a tick of SysTick with [`Clock::Instructions`]: one nanosecond each.
    pub fn instructions_per_tick(self) -> f64 {
        1e9 / self.systick_hz
    }

    /// QEMU with this machine and `image`, nothing connected.
    pub fn command(self, image: &Path) -> Command {
        let mut command = start(self.emulator);
        command.args(["-machine", self.name, "-display", "none", "-kernel"]);
        command.arg(image);
        if self.emulator == QEMU_RISCV {
            command.args(["-bios", "none"]); // the image is all there is
        }
        command
    }
}

/// Runs `image` to its end.
///
/// # Errors
/// As [`run_in`].
pub fn run(machine: Machine, image: &Path, clock: Clock, limit: Duration) -> Result<Run> {
    run_in(Path::new("."), machine, image, clock, limit)
}

/// Runs `image` to its end; the files it opens are in `directory`.
///
/// # Errors
/// QEMU cannot be started, or is still running after `limit`; it is killed then.
pub fn run_in(
    directory: &Path,
    machine: Machine,
    image: &Path,
    clock: Clock,
    limit: Duration,
) -> Result<Run> {
    let mut command = machine.command(image);
    command.args(["-serial", "none", "-monitor", "none"]);
    command.args(["-semihosting-config", "enable=on,target=native"]);
    if clock == Clock::Instructions {
        command.args(["-icount", "shift=0"]);
    }
    command
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command
        .spawn()
        .with_context(|| format!("cannot start {}: {REMEDY}", machine.emulator))?;
    let readers = [reader(child.stdout.take()), reader(child.stderr.take())];
    let code = wait(&mut child, limit)?;
    let output = readers
        .into_iter()
        .map(|reader| reader.join().unwrap_or_default())
        .collect();
    match code {
        Some(code) => Ok(Run { code, output }),
        None => bail!(
            "{} is still running after {limit:?}; its output so far:\n{output}",
            image.display()
        ),
    }
}

fn reader(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            let _ = pipe.read_to_end(&mut bytes); // what came before an error is worth showing
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// The exit code, or `None` when the time is over.
fn wait(child: &mut Child, limit: Duration) -> Result<Option<Option<i32>>> {
    let start = Instant::now();
    while start.elapsed() < limit {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status.code()));
        }
        thread::sleep(Duration::from_millis(5));
    }
    child.kill()?;
    child.wait()?;
    Ok(None)
}
