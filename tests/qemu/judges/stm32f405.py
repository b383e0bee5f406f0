"""An STM32F405 with DMA: Unicorn's Cortex-M4, and around it the peripherals the board's lines need, written from RM0090 and stricter than it.

QEMU has no DMA controller. Here the board's own image runs with one: clocks, four UARTs at their bit rates, both DMA controllers with their
request tables, the interrupt controller (priorities, PRIMASK, BASEPRI), SysTick. An instruction takes a cycle, and entering and leaving an interrupt
what the core's manual says. What the reference manual forbids ends the run:
configuring a stream that is enabled, enabling one with flags set or with memory out of its reach.

Standard input, JSON: {"image": path, "command": [hex, ...], "sensor": [hex, ...], "period": cycles between frames, "adis": null}. Each command is
sent when the answer to the one before has come; "baud": bit rate of the sensor, 921 600 if there is none. "adis": {"product": number, "range": number, "hz": fastest clock}: an ADIS at the SPI, whose bursts
are what is in "sensor"; of the bursts with the numbers in "hangs" the DMA moves only the first bytes until the SPI is reset, and data-ready does not rise for those in "silent"; "before": hex, a burst that is ready each ms while a command waits for its answer; "rest": ms after the last answer, 1 if there is none. "decimation N": the sensor's at the end. "count": N for "executed OUTSIDE INSIDE": instructions of the core, outside interrupts and in them, from the Nth frame to the last. "gnss": [[cycle after the first frame, hex], ...] on the receiver's line at its bit rate; "pulses": [cycle, ...] at which
PB8 rises, for "width" cycles, if not 100 us; "chip": {arguments of Chip}; "times": true for "came CYCLE ..." and "left CYCLE ...": the end of each byte's stop bit on the sensor's line, the begin of its start bit on the navigation line; "ask": [hex, ...]: requests after the frames; "damage": [[frame, byte, "overrun", "noise", "framing" or "parity"], ...]: that byte comes with this flag, or is lost; "stalls": [[cycle, cycles], ...]: from then on the core stands still for so long, as while flash is erased; "break": a mutant of stm32broken.py. Standard output: "navigation HEX", "gnss HEX", "command HEX", "line NAME BITS DIVIDER", "interrupts NUMBER COUNT", "cycles N",
"coupled TOUCHED NOT_ZERO": bytes of core-coupled memory.
"""
import collections
import ctypes
import json
import struct
import sys

from unicorn import UC_ARCH_ARM, UC_HOOK_BLOCK, UC_HOOK_CODE, UC_HOOK_INTR, UC_HOOK_MEM_WRITE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm

from stm32dma import DMA, SRAM, Registers, Stream
from stm32more import Backup, Bits, Core, Exti, Rtc, clocked, held, wired
from stm32parts import CORE, POWER_ON, PIN, BROWN_OUT, Flash, Forbidden, Iwdg, Power, Rcc, Rng, Tim2, Tim11, Wwdg
from stm32spi import Spi
from stm32timer import Tim5

SLICE = 100  # most instructions between two updates of the peripherals: a byte takes 1823 cycles
FINE = 16  # the same in an interrupt, and while a masked one is pending
PENDSV = -2  # number of its exception less 16
ENTRY, EXIT = 12, 10  # cycles for the registers that an exception saves (Cortex-M4 TRM, 3.9.1; ARM DDI 0439)
FLASH, CCM, SYSTEM = (0x0800_0000, 0x10_0000), (0x1000_0000, 0x1_0000), (0x1FFF_0000, 0x8000)
GARBAGE = 0xA5  # content of core-coupled memory at start

# base, bus, interrupt, (controller, stream) in and out: RM0090 tables 42 and 43, channel 4
UARTS = {
    "sensor": (0x4001_1000, "apb2", 37, (2, 2), (2, 7)),
    "navigation": (0x4000_4400, "apb1", 38, (1, 5), (1, 6)),
    "gnss": (0x4000_4800, "apb1", 39, (1, 1), (1, 3)),
    "command": (0x4000_4C00, "apb1", 52, (1, 2), (1, 4)),
}
RXNE, IDLE, ORE, NF, FE, PE, TXE, TC = 1 << 5, 1 << 4, 1 << 3, 1 << 2, 1 << 1, 1 << 0, 1 << 7, 1 << 6
INTERRUPTS = RXNE | IDLE | TC | TXE
DAMAGE = {"overrun": ORE, "noise": NF, "framing": FE, "parity": PE}


class Uart:
    def __init__(self, chip, name):
        self.chip, self.name = chip, name
        self.base, self.bus, self.interrupt, into, out = UARTS[name]
        self.stream_in, self.stream_out = chip.streams[into], chip.streams[out]
        self.sr, self.cr1, self.cr2, self.cr3, self.brr = TXE | TC, 0, 0, 0, 0
        self.data = 0
        self.waiting, self.shifting, self.sends_until = None, None, 0
        self.since = 0  # when DR was written
        self.sent = bytearray()
        self.began = []  # when the start bit of each byte sent began
        self.arrivals = collections.deque()  # (cycle, byte); the byte may carry a flag of SR
        self.peer = None  # bit rate at the other end, if it matters
        self.garbled = [0, 0]  # bytes in and out that arrive garbled
        self.stuck = False  # the transmitter accepts no more bytes
        self.idle_at = None
        self.seen = 0  # SR as last read: then DR clears

    def bits(self):
        """Start bit, data with parity, stop bits (30.6.4, 30.6.5)."""
        return 1 + (9 if self.cr1 >> 12 & 1 else 8) + (2 if self.cr2 >> 12 & 3 == 2 else 1)

    def divider(self):
        """30.3.4: with OVER8 the fraction has three bits, and the fourth must be 0."""
        return (self.brr >> 4) * 8 + (self.brr & 0xF) if self.cr1 >> 15 & 1 else self.brr

    def byte_cycles(self):
        return self.bits() * self.bit_cycles()

    def bit_cycles(self):
        return self.divider() * CORE / getattr(self.chip.rcc, self.bus)

    def agrees(self, way):
        """Whether the other end's bytes are understood (30.3.5, table 139: 3.33 %, with OVER8 2 %)."""
        most = 0.02 if self.cr1 >> 15 & 1 else 0.0333
        agrees = not self.peer or abs(self.bit_cycles() * self.peer / CORE - 1) <= most
        self.garbled[way] += not agrees
        return agrees

    def read(self, offset):
        if offset == 0x00:
            self.seen = self.sr
            return self.sr
        if offset == 0x04:
            self.sr &= ~(RXNE | (self.seen & (ORE | IDLE | FE | NF | PE)))
            self.seen &= ~(ORE | IDLE | FE | NF | PE)
            return self.data
        return {0x08: self.brr, 0x0C: self.cr1, 0x10: self.cr2, 0x14: self.cr3}.get(offset, 0)

    def write(self, offset, value):
        if offset == 0x04:
            self.waiting, self.since = value & 0xFF, self.chip.cycles
            self.sr &= ~(TXE | self.seen & TC)  # TC: SR read, then DR written; not by DMA (30.6.1)
            self.seen &= ~TC
        elif offset == 0x00:
            self.sr &= value | ~(RXNE | TC)
        elif offset in (0x08, 0x10):
            if self.cr1 >> 13 & 1 and self.shifting is not None:
                raise Forbidden(f"{self.name}: bit rate or stop bits changed within a byte (30.3.4)")
            setattr(self, {0x08: "brr", 0x10: "cr2"}[offset], value)
        elif offset == 0x0C:
            if value >> 13 & 1 and self.divider() < (8 if value >> 15 & 1 else 16) and value >> 15 & 1 == self.cr1 >> 15 & 1:
                raise Forbidden(f"{self.name}: a divider of {self.divider()} (30.3.4)")
            if value >> 13 & 1 and (value >> 15 & 1 and self.brr & 8 or value >> 10 & 1 and not value >> 12 & 1):
                raise Forbidden(f"{self.name}: fourth bit of the fraction with OVER8, or parity in eight bits")
            self.cr1 = value
            if not value >> 13 & 1:  # off: a byte in transmission is lost
                self.sr, self.waiting, self.shifting, self.idle_at = TXE | TC, None, None, None
        elif offset == 0x14:
            self.cr3 = value

    def level(self):
        error = self.sr & (ORE | FE | NF) and (self.cr3 & 1 and self.cr3 >> 6 & 1 or self.cr1 >> 5 & 1)
        error = error or self.sr & PE and self.cr1 >> 8 & 1
        return bool(error or self.sr & self.cr1 & INTERRUPTS)  # each enable is at the same bit as its flag

    def next_event(self):
        at = self.arrivals[0][0] if self.arrivals else None
        if self.idle_at is not None and (at is None or self.idle_at < at):
            at = self.idle_at
        if self.shifting is not None and (at is None or self.sends_until < at):
            at = self.sends_until
        return at

    def step(self, now):
        due = self.next_event()
        if due is not None and due <= now:
            self.happens(now)
        else:
            self.request()
        if self.shifting is None and self.waiting is not None and not self.stuck and self.cr1 >> 3 & 1:
            self.shifting, self.waiting = self.waiting, None
            # a byte waiting in DR follows without a pause, however late this is called (30.3.2)
            self.began.append(max(self.since, self.sends_until))
            self.sends_until = self.began[-1] + self.byte_cycles()
            self.sr |= TXE
            self.request()

    def happens(self, now):
        """Handles due events: received bytes, an idle line, the end of a byte that is sent."""
        while self.arrivals and self.arrivals[0][0] <= now:
            at, byte, *flag = self.arrivals.popleft()
            if self.cr1 >> 2 & 1 and self.cr1 >> 13 & 1 and wired(self.chip, self.name, True):
                if self.sr & RXNE or ORE in flag:
                    self.sr |= ORE  # this byte is lost
                else:
                    self.data, self.sr = byte, self.sr | RXNE | sum(flag)
                    if not self.agrees(0):
                        self.data, self.sr = byte ^ 0x5A, self.sr | FE
                self.idle_at = at + self.byte_cycles()
            self.request()
        if self.idle_at is not None and self.idle_at <= now:
            # a start bit has come within the frame of ones: the line is not idle (30.3.3)
            begun = self.arrivals and self.arrivals[0][0] - self.byte_cycles() * 1.03 < self.idle_at
            self.sr, self.idle_at = self.sr if begun else self.sr | IDLE, None
        self.request()
        if self.shifting is not None and self.sends_until <= now:
            if wired(self.chip, self.name, False):
                self.sent.append(self.shifting if self.agrees(1) else self.shifting ^ 0x5A)
                self.chip.byte_left(self)
            self.shifting = None
            self.sr |= TC if self.waiting is None else 0

    def request(self):
        if self.sr & RXNE and self.cr3 >> 6 & 1 and self.stream_in.serves(self.base + 4, False):
            self.sr &= ~RXNE
            self.chip.cpu.mem_write(self.stream_in.moved(), bytes([self.data]))
        if self.sr & TXE and self.cr3 >> 7 & 1 and self.stream_out.serves(self.base + 4, True):
            place = self.stream_out.moved()
            self.waiting, self.since = self.chip.cpu.mem_read(place, 1)[0], self.chip.cycles
            self.sr &= ~TXE


class Timer:
    """TIM4 with channel 3 as an input (18.3.5, 18.4): a count of 16 bits, stored when PB8 rises and stays high for the filter's time."""

    def __init__(self, chip):
        self.chip, self.registers = chip, collections.defaultdict(int)
        self.since, self.stored, self.flags = 0, 0, 0

    def count(self):
        return int((self.chip.cycles - self.since) * self.chip.rcc.timers1 / CORE / (self.registers["psc"] + 1)) & 0xFFFF

    def read(self, offset):
        if offset == 0x10:
            return self.flags
        if offset == 0x24:
            return self.count()
        if offset == 0x3C:
            self.flags &= ~8
            return self.stored
        return 0

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) >> 2 & 1:
            raise Forbidden("TIM4 without its clock")
        if offset == 0x1C and self.registers[0x20] >> 8 & 1:
            raise Forbidden("TIM4: channel 3 configured while it is on (18.4.8)")
        if offset == 0x14 and value & 1:  # the prescaler is taken over, the count begins
            self.registers["psc"], self.since = self.registers[0x28], self.chip.cycles
        if offset == 0x10:
            self.flags &= value
        self.registers[offset] = value

    def rise(self):
        port = lambda offset: self.chip.registers.get(0x4002_0400 + offset, 0)
        if port(0x00) >> 16 & 3 != 2 or port(0x24) & 0xF != 2 or port(0x0C) >> 16 & 3 != 2:
            raise Forbidden("PB8 is not TIM4's, pulled down")
        on = self.registers[0x00] & 1 and self.registers[0x20] & 0x900 == 0x100 and self.registers[0x1C] & 3 == 1
        if not on or self.registers[0x2C] != 0xFFFF:
            raise Forbidden("TIM4 does not capture rising edges at channel 3")
        self.flags |= 0x800 if self.flags & 8 else 0
        self.stored, self.flags = self.count(), self.flags | 8


ALL = range(0x400)
CLEARED = {Uart: (0x04,), Stream: (), Tim2: (), Iwdg: ()}  # registers that reading changes; of classes not listed reading may change all


class Chip:
    """`crystal`: MHz, 0 is a dead one; `internal`: factor on the internal oscillator's 16 MHz; `locks`: the PLL; `volts`: the supply."""

    def __init__(self, image, adis=None, crystal=12, internal=1.0, locks=True, volts=3.3, brown_out=3):
        self.adis, self.world = adis, (crystal, internal, locks)
        self.cycles, self.dead_crystal = 0, False
        self.cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.cpu.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.word = ctypes.c_uint64()
        self.word_at = ctypes.byref(self.word)
        self.cpu.mem_map(*FLASH)
        self.cpu.mem_write(FLASH[0], b"\xff" * FLASH[1])
        self.cpu.mem_map(*SRAM)
        self.cpu.mem_map(*CCM)
        self.cpu.mem_write(CCM[0], bytes([GARBAGE]) * CCM[1])
        self.cpu.mmio_map(0x4000_0000, 0x8_0000, self.bus_read, None, self.bus_write, None)
        self.cpu.mmio_map(0x5006_0000, 0x1000, lambda _, offset, *__: self.rng.read(offset - 0x800), None, lambda _, offset, __, value, ___: self.rng.write(offset - 0x800, value), None)
        self.cpu.mem_map(*SYSTEM)
        self.cpu.mem_write(SYSTEM[0] + 0x7A10, b"ECHIP MODEL " + b"\xff" * 6 + struct.pack("<H", FLASH[1] >> 10))  # 39.1, 39.2
        self.bits = Bits(self)
        self.cpu.mmio_map(0xE000_0000, 0x10_0000, self.core_read, None, self.core_write, None)
        self.cpu.hook_add(UC_HOOK_INTR, self.exception)
        self.served = collections.Counter()
        self.registers, self.volts, self.brown_out, self.uarts = {}, volts, brown_out, {}
        self.power_up(POWER_ON | PIN | BROWN_OUT)
        self.load(image)
        self.cpu.hook_add(UC_HOOK_MEM_WRITE, self.programs, None, FLASH[0], FLASH[0] + FLASH[1] - 1)

    def power_up(self, flags):
        """The peripherals as after a reset; the other ends of the lines keep their state."""
        crystal, internal, locks = self.world
        self.registers = {}
        self.backup = getattr(self, "backup", None) or Backup()
        self.rcc = Rcc(self, 0 if self.dead_crystal else crystal, internal, locks, flags)
        self.spi, self.timer = Spi(self, self.adis), Timer(self)
        self.tim2, self.tim5, self.tim11, self.iwdg, self.wwdg = Tim2(self), Tim5(self), Tim11(self), Iwdg(self), Wwdg(self)
        self.rng, self.power, self.flash = Rng(self), Power(self, self.volts), Flash(self, self.brown_out)
        self.exti, self.rtc, self.core = Exti(self), Rtc(self), Core(self)
        self.streams = {(c, n): Stream(c, n) for c in DMA for n in range(8)}
        self.controllers = {c: Registers(self, c) for c in DMA}
        before, self.uarts = self.uarts, {name: Uart(self, name) for name in UARTS}
        for name, old in before.items():
            new = self.uarts[name]
            new.arrivals, new.sent, new.peer, new.garbled = old.arrivals, old.sent, old.peer, old.garbled
        self.places = {uart.base: uart for uart in self.uarts.values()} | {
            0x4000_0800: self.timer,
            0x4002_3800: self.rcc,
            0x4002_3C00: self.flash,
            0x4000_7000: self.power,
            0x4000_0000: self.tim2,
            Tim5.BASE: self.tim5,
            0x4001_4800: self.tim11,
            0x4000_3000: self.iwdg,
            0x4000_2C00: self.wwdg,
            0x4001_3C00: self.exti,
            Spi.BASE: self.spi,
            0x4000_2800: self.rtc,
        }
        self.timed = (*self.uarts.values(), self.spi, self.tim5, self.iwdg, self.wwdg)
        self.reload, self.systick_at, self.systick, self.systick_ended = 0, None, 0, False
        self.enabled, self.pending, self.systick_pending = {PENDSV}, set(), False
        self.active, self.high = set(), set()  # active handlers; lines that were high at the last update
        self.priorities, self.running = collections.defaultdict(int), 256
        self.returned = self.asleep = self.waits_for_event = self.event = False
        self.broken = None
        self.changed, self.due = True, 0  # whether something may have changed since the last update; cycle of the next event

    def reset_peripherals(self, register, bits):
        for base in held(register, bits):
            self.reset_peripheral(base)

    def reset_peripheral(self, base):
        """As it is after power-on; the other ends of the lines keep their state."""
        for controller, at in DMA.items():
            if at == base:
                self.streams |= {(controller, n): Stream(controller, n) for n in range(8)}
                self.controllers[controller] = Registers(self, controller)
        for name, (at, *_) in UARTS.items():
            if at == base:
                self.uarts[name].cr3, self.uarts[name].brr, self.uarts[name].cr2 = 0, 0, 0
                self.uarts[name].write(0x0C, 0)
        for uart in self.uarts.values():
            uart.stream_in, uart.stream_out = (self.streams[key] for key in UARTS[uart.name][3:])
        if base == self.spi.BASE:
            self.spi.reset()
        for address in [address for address in self.registers if address & ~0x3FF == base]:
            del self.registers[address]

    def load(self, path):
        elf = open(path, "rb").read()
        self.loaded = []
        # Unicorn walks all hooks of instructions at each instruction. So the many ISB have hooks of the block behind each.
        hooks = {b"\x30\xbf": (UC_HOOK_CODE, self.wfi), b"\x20\xbf": (UC_HOOK_CODE, self.wfe), b"\x40\xbf": (UC_HOOK_CODE, self.sev)}
        hooks[b"\xbf\xf3\x6f\x8f"] = (UC_HOOK_BLOCK, self.isb)
        start, count = struct.unpack_from("<I", elf, 28)[0], struct.unpack_from("<H", elf, 44)[0]
        for n in range(count):
            kind, offset, _, physical, size, _, flags = struct.unpack_from("<7I", elf, start + 32 * n)
            if kind == 1 and size:
                code = elf[offset : offset + size]
                self.cpu.mem_write(physical, code)
                self.loaded.append((physical - FLASH[0], physical - FLASH[0] + size))
                for instruction, (of, hook) in hooks.items():
                    at = code.find(instruction)
                    while flags & 1 and at >= 0:  # or a constant, which nobody executes
                        if at % 2 == 0:
                            place = physical + at + (4 if of == UC_HOOK_BLOCK else 0)
                            self.cpu.hook_add(of, hook, None, place, place)
                        at = code.find(instruction, at + 1)
        stack, self.pc = struct.unpack("<II", self.cpu.mem_read(FLASH[0], 8))
        self.cpu.reg_write(arm.UC_ARM_REG_SP, stack)

    def wfi(self, *_):
        self.asleep = True
        self.cpu.emu_stop()

    def wfe(self, *_):
        """Armv7-M B1.5.18: sleeps if nothing has happened since the last one: an exception that ended, or SEV."""
        self.asleep, self.waits_for_event = True, True
        self.cpu.emu_stop()

    def sev(self, *_):
        self.event = True

    def sleeps(self):
        """Whether the core stays asleep after its WFE or WFI."""
        event, self.waits_for_event = self.waits_for_event and self.event, False
        self.event = self.event and not event
        return not event

    def isb(self, *_):
        """Serves interrupts that have become pending or enabled before."""
        if self.next_interrupt(self.running) is not None:
            self.cpu.emu_stop()

    def exception(self, cpu, number, _):
        self.returned = number == 8  # EXCP_EXCEPTION_EXIT
        if not self.returned:
            self.broken = f"exception {number} at {cpu.reg_read(arm.UC_ARM_REG_PC):#x}"
        cpu.emu_stop()

    # Peripherals

    def at(self, address):
        device = self.places.get(address & ~0x3FF)
        if device:
            return device, address & 0x3FF
        for controller, base in DMA.items():
            if base + 0x10 <= address < base + 0xD0:
                number, offset = divmod(address - base - 0x10, 0x18)
                return self.streams[controller, number], offset
            if base <= address < base + 0x10:
                return self.controllers[controller], address - base
        return None, 0

    def bus_read(self, _, offset, size, __):
        address = 0x4000_0000 + offset
        device, register = self.at(address)
        if device:
            self.changed |= register in CLEARED.get(type(device), ALL)
            return device.read(register)
        return self.registers.get(address, 0)

    def bus_write(self, _, offset, size, value, __):
        try:
            address = 0x4000_0000 + offset
            clocked(self, address)
            device, register = self.at(address)
            if device:
                device.write(register, value)
                return self.settle()
            self.registers[address] = value
            if address == 0x4002_0018 and value & (1 << 4 | 1 << 20):  # GPIOA_BSRR
                self.spi.select(not value >> 4 & 1)
        except Forbidden as what:
            self.broken = str(what)
            self.cpu.emu_stop()

    def core_read(self, _, offset, size, __):
        if offset == 0xE018:  # SYST_CVR
            return int(max(self.systick_at - self.cycles, 0) / self.rcc.cost) if self.systick_at else 0
        if offset == 0xE010:  # COUNTFLAG: since it was read last
            ended, self.systick_ended = self.systick_ended, False
            return self.systick | ended << 16
        if offset == 0xED04:
            return self.systick_pending << 26 | (PENDSV in self.pending) << 28
        return self.core.read(offset) or 0

    def core_write(self, _, offset, size, value, __):
        self.core.write(offset, value)
        if offset == 0xE014:
            self.reload = value
        elif offset == 0xE018:  # any value clears the count and COUNTFLAG
            self.systick_at, self.systick_ended = self.systick_at and self.cycles + (self.reload + 1) * self.rcc.cost, False
        elif offset == 0xE010:
            if value & 1 and not self.systick & 1:
                self.systick_at = self.cycles + (self.reload + 1) * self.rcc.cost
            self.systick_at, self.systick = self.systick_at if value & 1 else None, value & 7
        elif 0xE400 <= offset < 0xE4F0 or offset in (0xED22, 0xED23):  # IPR, and SHPR3 for PendSV and SysTick
            for n in range(size):
                number = offset - 0xED24 if offset >= 0xED00 else offset - 0xE400 + n
                self.priorities[number] = value >> 8 * n & 0xF0
        elif 0xE100 <= offset < 0xE120:
            self.enabled |= {8 * (offset - 0xE100) + n for n in range(32) if value >> n & 1}
        elif 0xE180 <= offset < 0xE1A0:
            self.enabled -= {8 * (offset - 0xE180) + n for n in range(32) if value >> n & 1}
        elif 0xE280 <= offset < 0xE2A0:
            self.pending -= {8 * (offset - 0xE280) + n for n in range(32) if value >> n & 1}
            self.settle()
        elif 0xE200 <= offset < 0xE220:
            self.pending |= {8 * (offset - 0xE200) + n for n in range(32) if value >> n & 1}
        elif offset == 0xED04 and value >> 28 & 1:  # ICSR.PENDSVSET (Armv7-M B3.2.4)
            self.pending.add(PENDSV)
        elif offset == 0xEF00:  # STIR (Armv7-M B3.4.11)
            self.pending.add(value & 0x1FF)
        elif offset == 0xED0C:
            self.restart(None)

    def settle(self):
        """Requests and interrupt lines after something has changed."""
        self.spi.look()
        self.exti.look()
        self.tim5.look()
        for uart in self.uarts.values():
            uart.step(self.cycles)
        level = {stream.interrupt for stream in self.streams.values() if stream.flags and stream.level()}
        level |= {device.interrupt for device in (*self.uarts.values(), self.tim5) if device.level()}
        # while its handler runs, an interrupt becomes pending again when its line rises, else when the handler has ended (B3.4.1)
        self.pending |= level - (self.active & self.high)
        self.high = level
        self.changed, self.due = False, self.coming()

    def rise(self):
        """Data-ready at PC4: EXTI's mask and edge, and the port in SYSCFG_EXTICR2."""
        if self.registers.get(0x4001_380C, 0) & 0xF == 2:
            self.exti.edge(4)
        self.settle()

    def pulse(self, width):
        """PB8 rises for some cycles: TIM4's, or a line of EXTI, pulled down, with the port in SYSCFG_EXTICR3."""
        if not self.exti.imr >> 8 & 1:
            return self.timer.rise()
        port = lambda offset: self.registers.get(0x4002_0400 + offset, 0)
        if port(0x00) >> 16 & 3 or port(0x0C) >> 16 & 3 != 2 or self.registers.get(0x4001_3810, 0) & 0xF != 1:
            raise Forbidden("PB8 is not at its line of EXTI, pulled down")
        self.registers[0x4002_0410] = port(0x10) | 1 << 8
        self.exti.edge(8)
        self.run(self.cycles + width)
        self.registers[0x4002_0410] = port(0x10) & ~(1 << 8)

    # Time

    def execute(self, instructions):
        self.returned = self.asleep = False
        try:
            self.cpu.emu_start(self.pc | 1, 0, count=instructions)
        except UcError as error:
            self.broken = self.broken or f"{error} at {self.cpu.reg_read(arm.UC_ARM_REG_PC):#x}"
        self.pc = self.read(arm.UC_ARM_REG_PC)
        if self.broken:
            raise Forbidden(self.broken)
        self.advance(instructions * self.rcc.cost)

    def read(self, register):
        """A register of 32 bits. As `reg_read` reads it, without its search for the kind of register: this is for each slice."""
        self.cpu._do_reg_read(register, self.word_at)
        return self.word.value

    def restart(self, cause, why=""):
        """A reset; here none is expected."""
        self.broken = f"it restarts {why}"
        self.cpu.emu_stop()

    def programs(self, _, __, address, size, value, ___):
        """A piece of flash, written by the core. The time that it takes comes after the slice, or when FLASH_SR is read."""
        try:
            self.flash.programmed(address, size, value & (1 << 8 * size) - 1)
        except Forbidden as what:
            self.broken = str(what)
            self.cpu.emu_stop()

    def byte_left(self, uart):
        """A byte has left on a line."""

    def count(self):
        """From now on counts the instructions that the core executes: outside interrupts, and in them."""
        self.executed = [0, 0]

        def one(*_):
            self.executed[self.running < 256] += 1

        self.cpu.hook_add(UC_HOOK_CODE, one, None, FLASH[0], FLASH[0] + FLASH[1] - 1)
        self.cpu.ctl_flush_tb()

    def stall(self, cycles):
        """The core is stalled; the rest goes on."""
        self.advance(cycles)

    def advance(self, cycles):
        self.cycles += cycles
        if self.flash.works():
            self.flash.done()
        if self.systick_at and self.systick_at <= self.cycles:
            self.systick_pending |= bool(self.systick & 2)
            self.systick_ended = True
            while self.systick_at <= self.cycles:  # pending once, however often it ran out
                self.systick_at += (self.reload + 1) * self.rcc.cost
        if self.changed or self.cycles >= self.due - 1:  # the window watchdog bites a cycle before its event
            self.iwdg.look()
            self.wwdg.look()
            self.settle()

    def waits(self):
        """Whether an interrupt is ready, masked or not."""
        return self.systick_pending or not self.pending.isdisjoint(self.enabled)

    def next_interrupt(self, below=256):
        """The ready one of the highest priority; of equal ones that with the lowest number, SysTick first (Armv7-M B1.5.4).
        PRIMASK holds all back, BASEPRI, unless it is 0, those of its priority and below (B1.4.3)."""
        if not self.waits():
            return None
        ready = self.pending & self.enabled
        ready |= {-1} if self.systick_pending else set()
        priority, first = min((self.priorities[number], number) for number in ready)
        # most of what waits is below what runs: then the registers need not be read
        if priority >= below or self.read(arm.UC_ARM_REG_PRIMASK) & 1:
            return None
        return first if priority < (self.read(arm.UC_ARM_REG_BASEPRI) & 0xF0 or 256) else None

    def interrupt(self, below=256):
        """Serves one interrupt to its end, if there is one."""
        number = self.next_interrupt(below)
        if number is None:
            return False
        if number < 0:
            self.systick_pending = False
        self.pending.discard(number)
        self.active.add(number)
        self.served[number] += 1
        context, pc, running = self.cpu.context_save(), self.pc, self.running
        self.running = self.priorities[number]
        self.pc = struct.unpack("<I", self.cpu.mem_read(FLASH[0] + 4 * (16 + number), 4))[0] & ~1
        self.cpu.reg_write(arm.UC_ARM_REG_LR, 0xFFFF_FFF9)
        self.cpu.reg_write(arm.UC_ARM_REG_IPSR, 16 + number)
        self.entered(pc)
        self.advance(ENTRY * self.rcc.cost)
        self.returned = False
        while not self.returned:
            self.execute(FINE)
            if not self.returned:
                while self.waits() and self.interrupt(self.priorities[number]):
                    self.returned = False
        self.cpu.context_restore(context)
        self.active.discard(number)
        self.advance(EXIT * self.rcc.cost)
        self.pc, self.running, self.event = pc, running, True
        self.settle()
        return True

    def entered(self, pc):
        """Enters a handler that does not read its frame."""

    def run(self, until):
        """Runs to a cycle."""
        self.changed = True  # bytes of the other ends
        while self.cycles < until:
            storm = self.cycles + CORE // 4  # a board over embassy starts in one interrupt
            while self.waits() and self.interrupt():
                if self.cycles > storm:
                    raise Forbidden(f"interrupts without end: {self.served}")
            self.execute(self.look())
            if self.asleep:
                self.pc += 2
                sleeps = self.sleeps()
                while sleeps and not self.waits() and self.cycles < until:
                    self.advance(max(self.next_event(until) - self.cycles, 1))

    def look(self):
        """Instructions until something may happen."""
        if self.waits():
            return FINE
        ahead = int((self.next_event(self.cycles + SLICE * self.rcc.cost) - self.cycles) / self.rcc.cost)
        return min(max(ahead, 1), SLICE)

    def coming(self):
        """Cycle of the next event, SysTick aside."""
        return min([at for device in self.timed if (at := device.next_event()) is not None], default=float("inf"))

    def next_event(self, until):
        """The cycle of the next one, at the latest this one."""
        due = self.coming() if self.changed else self.due
        return min(due, until, self.systick_at or until)


def ask(chip, text):
    """Sends a request and waits for its answer."""
    line = chip.uarts["command"]
    byte, answered = round(CORE * 10 / 921_600), len(line.sent)
    line.arrivals.extend((chip.cycles + byte * (n + 1), b) for n, b in enumerate(bytes.fromhex(text)))
    give_up = chip.cycles + CORE // 20
    while 0 not in line.sent[answered:] and chip.cycles < give_up:
        chip.run(chip.cycles + CORE // 10_000)
        if chip.adis and chip.adis.get("before") and chip.cycles >= chip.ready_at:
            chip.ready_at = chip.cycles + CORE // 1000
            chip.rise()


def main():
    asked = json.load(sys.stdin)
    if asked.get("break"):
        import stm32broken

        stm32broken.break_model(asked["break"])
    adis = asked.get("adis")
    chip = Chip(asked["image"], adis, **asked.get("chip", {}))  # 12 MHz, as the image is built for
    lines = chip.uarts
    if adis:
        chip.spi.device.burst, chip.ready_at = bytes.fromhex(adis.get("before", "")), 0
    chip.run(CORE // 1000 * (250 if adis else 40))
    for text in asked["command"]:
        ask(chip, text)
    if adis and adis.get("before"):
        chip.run(chip.cycles + CORE // 1000 * adis.get("rest", 1))  # the last of these bursts ends
    chip.served.clear()
    start = chip.cycles
    byte = round(CORE * lines["sensor"].bits() / asked.get("baud", 921_600))
    came, lines["navigation"].began = [], []
    skip = asked.get("count")
    for n, text in enumerate(asked["sensor"]):
        at = start + asked["period"] * n
        if adis:
            if n == skip:
                chip.count()
            chip.spi.device.burst = bytes.fromhex(text)
            chip.spi.hangs |= n in adis.get("hangs", [])
            if n not in adis.get("silent", []):
                chip.rise()
            chip.run(at + asked["period"])
            continue
        damage = {k: [DAMAGE[name]] for frame, k, name in asked.get("damage", []) if frame == n}
        lines["sensor"].arrivals.extend((at + byte * (k + 1), b, *damage.get(k, [])) for k, b in enumerate(bytes.fromhex(text)))
        came.extend(at + byte * (k + 1) for k in range(len(text) // 2))
    byte = lines["gnss"].byte_cycles()
    for at, text in asked.get("gnss", []):
        lines["gnss"].arrivals.extend((start + at + byte * (k + 1), b) for k, b in enumerate(bytes.fromhex(text)))
    for at, cycles in asked.get("stalls", []):
        chip.run(start + at)
        chip.stall(cycles)
    for at in asked.get("pulses", []):
        chip.run(start + at)
        chip.pulse(asked.get("width", CORE // 10_000))
    if skip is not None and not adis:
        chip.run(start + asked["period"] * skip)
        chip.count()
    chip.run(start + asked["period"] * len(asked["sensor"]))
    executed = skip is not None and list(chip.executed)
    chip.run(start + asked["period"] * len(asked["sensor"]) + CORE // 200)
    for text in asked.get("ask", []):
        ask(chip, text)
    print("navigation", lines["navigation"].sent.hex())
    if asked.get("times"):
        print("came", *(at - start for at in came))
        print("left", *(round(at - start) for at in lines["navigation"].began))
    print("gnss", lines["gnss"].sent.hex())
    print("command", lines["command"].sent.hex())
    for name, line in lines.items():
        print("line", name, line.bits(), line.divider())
    for number, count in sorted(chip.served.items()):
        print("interrupts", number, count)
    print("cycles", chip.cycles - start)
    if executed:
        print("executed", *executed)
    print("bursts", chip.spi.device.bursts if adis else 0)
    if adis:
        print("decimation", chip.spi.device.decimation())
    coupled = chip.cpu.mem_read(*CCM)
    print("coupled", len(coupled.rstrip(bytes([GARBAGE]))), sum(byte != 0 for byte in coupled.rstrip(bytes([GARBAGE]))))


if __name__ == "__main__":
    import stm32f405  # under the name that its mutants know

    stm32f405.main()
