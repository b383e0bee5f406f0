//! Runs the application over the recording in the file `input`. It writes what it sends to the
//! navigation computer to the file `output`, then prints `<name> <value>` lines: records, bytes,
//! FNV-1a digest of the bytes, the ticks that the records cost, and what was learnt.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use core::fmt::Write;

    use firmware::app::Config;
    use firmware::app::blackbox::Memory;
    use firmware::learn::exchange::Exchange;
    use firmware::link::progress::Progress;
    use firmware::wire::ImuFormat;
    use qemu::replay::{
        HEADER, Input, LONGEST, Pace, Replay, Wires, config, configured, learning_config,
    };
    use qemu::target::files::File;
    use qemu::target::{dma, exit, interrupts, output, stack_left, start_counter};
    use vectors::Digest;

    /// Bytes of the stack that are never used, since variables lie below it.
    const SPARE: usize = 1024;

    /// Files are read and written in pieces, because a semihosting call costs thousands of
    /// instructions.
    struct Reader {
        file: File,
        buffer: [u8; 1024],
        next: usize,
        end: usize,
    }

    impl Reader {
        fn byte(&mut self) -> Option<u8> {
            if self.next == self.end {
                self.end = self.file.read(&mut self.buffer);
                self.next = 0;
            }
            let byte = self.buffer.get(self.next).filter(|_| self.end > 0)?;
            self.next += 1;
            Some(*byte)
        }

        fn bytes(&mut self, into: &mut [u8]) -> Option<()> {
            into.iter_mut().try_for_each(|slot| {
                *slot = self.byte()?;
                Some(())
            })
        }
    }

    struct Writer {
        file: File,
        buffer: heapless::Vec<u8, 1024>,
        digest: Digest,
        bytes: u32,
    }

    impl Writer {
        fn write(&mut self, bytes: &[u8]) -> bool {
            bytes.iter().for_each(|&byte| self.digest.byte(byte));
            self.bytes += bytes.len() as u32;
            if self.buffer.extend_from_slice(bytes).is_ok() {
                return true;
            }
            self.flush() && self.buffer.extend_from_slice(bytes).is_ok()
        }

        fn flush(&mut self) -> bool {
            let written = self.file.write(&self.buffer);
            self.buffer.clear();
            written
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        exit(start_counter() && run().is_some())
    }

    /// `None` when a file could not be used or the recording is incomplete.
    fn run() -> Option<()> {
        let mut reader = Reader {
            file: File::open(c"input")?,
            buffer: [0; 1024],
            next: 0,
            end: 0,
        };
        let mut writer = Writer {
            file: File::create(c"output")?,
            buffer: heapless::Vec::new(),
            digest: Digest::new(),
            bytes: 0,
        };
        let format = *ImuFormat::ALL.get(usize::from(reader.byte()?))?;
        let pace = Pace::from_number(reader.byte()?)?;
        let learns = reader.byte()? != 0;
        if pace == Pace::Dma {
            over(
                &mut reader,
                &mut writer,
                (format, pace, learns),
                dma::wires(),
            )
        } else {
            over(
                &mut reader,
                &mut writer,
                (format, pace, learns),
                interrupts::wires(),
            )
        }
    }

    /// Passes the records of `reader` through the application at these lines.
    fn over<S: Progress + Copy>(
        reader: &mut Reader,
        writer: &mut Writer,
        (format, pace, learns): (ImuFormat, Pace, bool),
        wires: Wires<'static, S>,
    ) -> Option<()> {
        let learner = if learns {
            Some(qemu::target::learner()?)
        } else {
            None
        };
        let config = if !learns {
            config(format)
        } else if pace == Pace::Time {
            let variant = reader.byte()?;
            let mut rate = [0; 2];
            reader.bytes(&mut rate)?;
            Config::of(&configured(format, variant, u16::from_le_bytes(rate))?)
        } else {
            learning_config(format)
        };
        let mut replay = Replay::with_learner(config, pace, wires, learner);
        replay.begin();
        replay.learn_apart(cortex_m::singleton!(: Exchange = Exchange::new())?);
        replay.record_in(cortex_m::singleton!(: Memory = Memory::ZEROED)?);
        while let Some(input) = reader.byte() {
            let input = Input::from_number(input)?;
            let mut header = [0; HEADER - 1];
            reader.bytes(&mut header)?;
            let [l0, l1, t0, t1, t2, t3] = header;
            let mut record = [0; LONGEST];
            let record = record.get_mut(..usize::from(u16::from_le_bytes([l0, l1])))?;
            reader.bytes(record)?;
            let at_us = u32::from_le_bytes([t0, t1, t2, t3]);
            if !writer.write(replay.record(input, at_us, record)) {
                return None;
            }
        }
        if !(writer.write(replay.end()) && writer.flush()) {
            return None;
        }
        let (cost, learnt) = (replay.cost(), replay.learnt());
        let mut out = output();
        if stack_left() < SPARE {
            writeln!(out, "the stack has overflowed").ok()?;
            return None;
        }
        writeln!(out, "records {}", cost.records).ok()?;
        writeln!(out, "bytes {}", writer.bytes).ok()?;
        writeln!(out, "digest {}", writer.digest.value()).ok()?;
        writeln!(out, "total {}", cost.total).ok()?;
        writeln!(out, "worst {}", cost.worst).ok()?;
        writeln!(out, "later {}", cost.later).ok()?;
        writeln!(out, "latency {}", cost.latency).ok()?;
        writeln!(out, "pass {}", cost.pass).ok()?;
        writeln!(out, "pass_at {}", cost.pass_at).ok()?;
        writeln!(out, "late {}", cost.late).ok()?;
        writeln!(out, "late_at {}", cost.late_at).ok()?;
        writeln!(out, "weights {}", learnt.weights).ok()?;
        writeln!(out, "fixes {}", learnt.fixes).ok()?;
        writeln!(out, "winner {}", learnt.winner).ok()
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
