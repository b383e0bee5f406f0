//! The chip: the emulator's core, clocks, interrupt controller, timers, PIO, watchdog and memory,
//! with the peripherals of this program around it.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use rp2350_emu::core::CoreBus;
use rp2350_emu::{Config, Emulator};

use crate::fabric::{Fabric, LINES, Own};
use crate::gaps::Pairs;
use crate::rom::Rom;

/// Cycles of a microsecond, as the image sets its clock.
pub const US: u64 = 150;
/// Cycles between two updates of the emulator's peripherals. It counts its watchdog down by one at
/// each update; the chip does so each microsecond.
const QUANTUM: u32 = US as u32;
/// Cycles between two packets of USB.
const PACKET: u64 = 40 * US;
/// The receiver's pin.
const RECEIVER: u32 = 6;
/// First word of the image: its vectors.
const VECTORS: u32 = 0x1000_0000;
/// Memory, and its content at power-on.
const RAM: u32 = 0x2000_0000;
const RAM_LEN: usize = 520 * 1024;
const GARBAGE: u8 = 0xA5;
/// Vector table, and the request of a reset in AIRCR with its key.
const VTOR: u32 = 0xE000_ED08;
const RESET_ASKED: u32 = 1 << 2;
/// FPCCR.LSPEN: registers of the FPU are saved when a handler first uses it. The emulator treats
/// the end of an interrupt within such a handler as a fault, so here they are saved at once.
const LAZY: u32 = 1 << 30;

/// The chip.
pub struct Chip {
    emulator: Emulator,
    /// Peripherals of this program.
    pub own: Own,
    /// Boot ROM and flash.
    pub rom: Rom,
    pairs: Pairs,
    /// Cycles slept: the emulator's core does not count them.
    slept: u64,
    active: [u32; 2],
    /// How often each interrupt was served.
    pub served: BTreeMap<u32, usize>,
    /// Instructions outside interrupts and in them.
    pub executed: [u64; 2],
    /// Starts of the image, and why.
    pub starts: Vec<(u64, &'static str)>,
    /// Levels of the receiver's line, each with the cycle from which on it holds.
    pub receiver: Vec<(u64, bool)>,
    /// Whether interrupts are kept from the core, until it restarts.
    pub deaf: bool,
    /// Output of the log's channel.
    pub log: Vec<u8>,
    log_at: Option<u32>,
}

impl Chip {
    /// A chip with this flash, at power-on.
    pub fn new(flash: Vec<u8>) -> Self {
        let emulator = Emulator::new(Config::default());
        let mut chip = Self {
            emulator,
            own: Own::default(),
            pairs: Pairs::new(&flash),
            rom: Rom::new(flash),
            slept: 0,
            active: [0; 2],
            served: BTreeMap::new(),
            executed: [0; 2],
            starts: Vec::new(),
            receiver: Vec::new(),
            deaf: false,
            log: Vec::new(),
            log_at: None,
        };
        chip.emulator.step_quantum = QUANTUM;
        chip.emulator.load_bootrom(&chip.rom.bytes());
        chip.emulator.load_flash(&chip.rom.flash);
        chip.start("power");
        chip
    }

    /// Cycles since power-on.
    pub fn now(&self) -> u64 {
        self.own.now
    }

    /// Starts the image, as the boot ROM does.
    pub fn start(&mut self, why: &'static str) {
        let begun = self.own.now;
        let theirs = self.own.theirs;
        self.starts.push((begun, why));
        self.emulator.reset();
        if why == "power" {
            self.emulator.load_image(RAM, &[GARBAGE; RAM_LEN]);
        }
        self.emulator.core_mut(1).halt();
        self.emulator.mmio_write32(VTOR, VECTORS);
        self.emulator.cores.expect_arm_mut()[0].ppb.fpccr &= !LAZY;
        self.own = Own {
            now: begun,
            theirs,
            ..Own::default()
        };
        // the emulator's cycles restart at 0, ours go on
        self.slept = begun;
        self.emulator.clock.cycles = begun;
        self.active = [0; 2];
        self.deaf = false;
        self.log_at = None;
    }

    /// Runs to this cycle.
    pub fn run(&mut self, until: u64) {
        while self.own.now < until {
            self.quantum();
        }
    }

    fn quantum(&mut self) {
        let begin = self.emulator.clock.cycles;
        let target = begin + u64::from(QUANTUM);
        if begin / PACKET != target / PACKET {
            self.own.usb.turn();
            self.own.changed = true;
        }
        self.pins(begin);
        self.cores(target);
        self.own.advance(target);
        self.interrupts();
        self.tick(target);
        if begin / (1000 * US) != target / (1000 * US) {
            self.read_log();
        }
        let core = self.emulator.core(0);
        if self.emulator.bus.watchdog_reset_requested() {
            self.start("watchdog");
        } else if core.ppb.aircr & RESET_ASKED != 0 {
            self.start("asked");
        }
    }

    /// Sets the level of the receiver's pin.
    fn pins(&mut self, now: u64) {
        let passed = self.receiver.partition_point(|(from, _)| *from <= now);
        let level = passed.checked_sub(1).is_none_or(|at| self.receiver[at].1);
        let bus = &mut self.emulator.bus;
        bus.gpio_external_mask = 1 << RECEIVER;
        bus.gpio_external_in
            .store(u32::from(level) << RECEIVER, Ordering::Relaxed);
    }

    /// Runs the core to this cycle.
    fn cores(&mut self, target: u64) {
        loop {
            let core = self.emulator.core(0);
            if core.is_wfe_waiting() || core.is_halted() {
                if self.deaf || !self.wakes() {
                    self.slept = target - self.emulator.core(0).cycles();
                    return;
                }
                continue;
            }
            let now = core.cycles() + self.slept;
            if now >= target {
                return;
            }
            let pc = core.regs.pc();
            self.own.advance(now);
            if pc < 0x8000 {
                self.rom.at(&mut self.emulator, pc, now, US);
            }
            if self.own.changed {
                self.interrupts();
            }
            self.instruction();
        }
    }

    /// Wakes a sleeping core at the next event or interrupt. The emulator wakes a core from "wait
    /// for event" only by an event, and not before its next update.
    fn wakes(&mut self) -> bool {
        let core = &self.emulator.cores.expect_arm()[0];
        let atomics = &self.emulator.bus.atomics;
        let word = |words: &[std::sync::atomic::AtomicU32; 2]| {
            words
                .each_ref()
                .map(|word| u64::from(word.load(Ordering::Relaxed)))
        };
        let [low, high] = word(&core.ppb.nvic_ispr);
        let pending = atomics.irq_pending_load(0) | low | high << 32;
        let awake = core.ppb.any_pending_enabled(pending) || atomics.event_flag_consume(0);
        if awake {
            atomics.clear_wfe_waiting(0);
            atomics.clear_halted(0);
        }
        awake
    }

    fn instruction(&mut self) {
        let core = &mut self.emulator.cores.expect_arm_mut()[0];
        let bus = &mut self.emulator.bus;
        let before = core.regs.xpsr & 0x1FF;
        self.executed[usize::from(before != 0)] += 1;
        let pc = core.regs.pc();
        let pair = self.pairs.at(pc).filter(|_| {
            let block = core.it_state();
            let always = block & 0xF == 0;
            always || core.regs.condition_passed(block >> 4)
        });
        let mut fabric = Fabric {
            bus,
            own: &mut self.own,
        };
        core.step(&mut fabric);
        if let Some(pair) = pair.filter(|_| core.regs.pc() == pc + 4) {
            pair.run(core, &mut fabric, pc);
        }
        if !bus.pending_cache_invalidations.is_empty() {
            core.invalidate_decode_cache_entries(&bus.pending_cache_invalidations);
            bus.pending_cache_invalidations.clear();
        }
        if let Some((number, priority)) = self.own.priority.take() {
            let (word, at) = (&mut core.ppb.nvic_ipr[number / 4], number % 4 * 8);
            *word = *word & !(0xFF << at) | u32::from(priority) << at;
        }
        let after = core.regs.xpsr & 0x1FF;
        if before == after {
            return;
        }
        self.changed_handler(after);
    }

    /// Notes that another handler runs, or none; `after` is its number, 16 for the first interrupt.
    fn changed_handler(&mut self, after: u32) {
        let words = &self.emulator.core(0).ppb.nvic_iabr;
        let active = words.each_ref().map(|word| word.load(Ordering::Relaxed));
        let is =
            |words: [u32; 2], number: u32| words[number as usize / 32] >> (number % 32) & 1 == 1;
        if let Some(number) = after.checked_sub(16)
            && is(active, number)
            && !is(self.active, number)
        {
            *self.served.entry(number).or_default() += 1;
        }
        self.active = active;
        // a line that is still high when its handler ends requests again
        for (number, last) in LINES.into_iter().zip(&mut self.own.reported) {
            *last &= is(active, number);
        }
        self.own.changed = true;
    }

    /// Reports rising lines to the interrupt controller.
    fn interrupts(&mut self) {
        let lines = self.own.settle();
        for ((number, line), last) in LINES.iter().zip(lines).zip(&mut self.own.reported) {
            if line && !*last {
                self.emulator.bus.assert_irq_shared(*number);
            }
            *last = line;
        }
    }

    /// One update of the emulator's own peripherals; its core, which we have run, is stopped.
    fn tick(&mut self, target: u64) {
        // a deaf core only waits for the watchdog, which counts updates
        self.emulator.step_quantum = if self.deaf { 1 } else { QUANTUM };
        let atomics = &self.emulator.bus.atomics;
        let sleeps = [atomics.is_halted(0), atomics.is_wfe_waiting(0)];
        atomics.set_halted(0);
        atomics.clear_wfe_waiting(0);
        let _ = self.emulator.step();
        self.emulator.clock.cycles = target;
        let atomics = &self.emulator.bus.atomics;
        atomics.clear_halted(0);
        if sleeps[0] {
            atomics.set_halted(0);
        }
        if sleeps[1] {
            atomics.set_wfe_waiting(0);
        }
    }

    /// Reads what the image has written to the first channel of its log (RTT), so fast that it
    /// never waits.
    fn read_log(&mut self) {
        let Self {
            emulator,
            log,
            log_at,
            ..
        } = self;
        let bus = &mut emulator.bus;
        let block = match *log_at {
            Some(at) => at,
            None => {
                let id = |at: &u32| {
                    (0..10).all(|n| bus.memory.peek8(at + n) == b"SEGGER RTT"[n as usize])
                };
                let Some(at) = (0x2000_0000..0x2008_0000).step_by(4).find(id) else {
                    return;
                };
                *log_at = Some(at);
                at
            }
        };
        let [buffer, size, written, mut read] =
            [28, 32, 36, 40].map(|at| CoreBus::read32(bus, block + at, 0));
        while read != written && size > 0 {
            log.push(bus.memory.peek8(buffer + read));
            read = (read + 1) % size;
        }
        CoreBus::write32(bus, block + 40, read, 0);
    }

    /// State of a pin in the chip: its function, and whether its pad is isolated.
    pub fn pin(&mut self, number: u32) -> (u32, bool) {
        let function = self.emulator.mmio_read32(0x4002_8004 + 8 * number) & 0x1F;
        let pad = self.emulator.mmio_read32(0x4003_8004 + 4 * number);
        (function, pad & 1 << 8 == 0 && pad & 1 << 6 != 0)
    }
}
