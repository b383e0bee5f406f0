//! The soak on the target. The file `input` has three numbers, little-endian: seed u64, seconds
//! u32, samples a second u32. It prints the digests of the lines each simulated minute, and then
//! the report.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use core::fmt::Write;

    use cortex_m_semihosting::hio::HostStream;
    use qemu::target::files::File;
    use qemu::target::{exit, output, stack_left};
    use soak::{Memory, Plan, Report, Watch, run};

    struct Printed(HostStream);

    impl Watch for Printed {
        fn minute(&mut self, report: &Report) {
            let _ = writeln!(self.0, "minute {:?}", report.lines);
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        exit(soak().is_some())
    }

    fn soak() -> Option<()> {
        let mut bytes = [0; 16];
        if File::open(c"input")?.read(&mut bytes) != bytes.len() {
            return None;
        }
        let [seed, more] = bytes.as_chunks::<8>().0 else {
            return None;
        };
        let [a, b, c, d, e, f, g, h] = *more;
        let plan = Plan {
            seed: u64::from_le_bytes(*seed),
            seconds: u32::from_le_bytes([a, b, c, d]),
            rate: u32::from_le_bytes([e, f, g, h]),
        };
        let memory = cortex_m::singleton!(: Memory = Memory::ZEROED)?;
        let report = run(memory, &plan, &mut Printed(output()));
        let mut out = output();
        writeln!(out, "digest {}", report.digest).ok()?;
        writeln!(out, "samples {}", report.samples).ok()?;
        writeln!(out, "corrected {}", report.corrected).ok()?;
        writeln!(out, "power_ons {}", report.power_ons).ok()?;
        writeln!(out, "stack_left {}", stack_left()).ok()?;
        writeln!(out, "violation {:?}", report.violation).ok()
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
