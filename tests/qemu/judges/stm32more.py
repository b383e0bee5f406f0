"""More of an STM32F405: parts that our firmware does not use and other drivers do, from RM0090 and the Armv7-M manual.

External interrupts and the supply's detector at their line (section 12), real-time clock and backup domain (26), the alias that has an address for each
bit, clocks and resets of peripherals (7.3), pins of the lines (8.3), and of the core: trace port, counter of cycles, read access to the interrupt
controller.
"""
import collections

from stm32parts import CORE, LSI, Forbidden

# line: interrupt (RM0090 table 61)
LINE_INTERRUPT = {n: 6 + n for n in range(5)} | {n: 23 for n in range(5, 10)} | {n: 40 for n in range(10, 16)} | {16: 1, 17: 41, 21: 2, 22: 3}


class Exti:
    """Edges of 23 lines (12.3)."""

    NAMES = {0x00: "imr", 0x04: "emr", 0x08: "rtsr", 0x0C: "ftsr", 0x10: "swier", 0x14: "pr"}

    def __init__(self, chip):
        self.chip = chip
        self.imr = self.emr = self.rtsr = self.ftsr = self.swier = self.pr = 0
        self.were = set()
        self.levels = collections.defaultdict(bool)

    def read(self, offset):
        return getattr(self, self.NAMES[offset]) if offset in self.NAMES else 0

    def write(self, offset, value):
        if offset == 0x14:
            self.pr &= ~value
            self.swier &= ~value
        elif offset == 0x10:
            self.pr |= value & ~self.swier & self.imr
            self.swier |= value
        elif offset in self.NAMES:
            setattr(self, self.NAMES[offset], value)

    def edge(self, line, rises=True):
        if (self.rtsr if rises else self.ftsr) >> line & 1:
            self.pr |= 1 << line

    def level(self, line, high):
        if self.levels[line] != high:
            self.levels[line] = high
            self.edge(line, high)

    def look(self):
        self.level(16, self.chip.power.low())
        ready, now = self.pr & self.imr, set()
        if not ready and not self.were:
            return
        while ready:
            line = ready.bit_length() - 1
            ready &= ~(1 << line)
            now |= {LINE_INTERRUPT[line]} if line in LINE_INTERRUPT else set()
        # while its handler runs, an interrupt becomes pending again when its line rises (Armv7-M B3.4.1)
        self.chip.pending |= now - (getattr(self.chip, "active", set()) & self.were)
        self.were = now


class Backup:
    """The backup domain: RCC_BDCR, 20 registers and the calendar. It survives a reset of the chip, not a loss of its supply."""

    def __init__(self):
        self.bdcr, self.words = 0, [0] * 20
        self.tr, self.dr, self.cr, self.prer, self.init = 0, 0x2101, 0, 0x007F_00FF, True
        self.base, self.since = (0, 0x2101), None  # the calendar, and the cycle since which it counts

    def clock(self, lsi):
        """RTCCLK in Hz (7.3.20); there is no crystal of 32 kHz."""
        return LSI if self.bdcr >> 15 & 1 and self.bdcr >> 8 & 3 == 2 and lsi else 0


class Rtc:
    """The calendar (26.3): written after two keys and in initialisation mode, read through shadow registers or directly."""

    def __init__(self, chip):
        self.chip, self.domain = chip, chip.backup
        self.keys, self.open, self.init_at, self.latched = [], False, None, None
        self.asked, self.shadows = False, False

    def ticks(self):
        """Cycles of RTCCLK since the calendar was set; it takes four to start again (26.3.5)."""
        clock, since = self.domain.clock(self.chip.rcc.lsi), self.domain.since
        if since is None or not clock:
            return 0
        return max(int((self.chip.cycles - since) * clock / CORE) - 4, 0)

    def now(self):
        """TR, DR and SSR."""
        synchronous, asynchronous = self.domain.prer & 0x7FFF, self.domain.prer >> 16 & 0x7F
        seconds, part = divmod(self.ticks() // (asynchronous + 1), synchronous + 1)
        time, date = self.domain.base
        seconds += self.seconds(time)
        days, seconds = divmod(seconds, 86_400)
        return self.coded(seconds // 3600) << 16 | self.coded(seconds // 60 % 60) << 8 | self.coded(seconds % 60), self.later(date, days), synchronous - part

    @staticmethod
    def coded(number):
        return number // 10 << 4 | number % 10

    @staticmethod
    def plain(code):
        return (code >> 4) * 10 + (code & 15)

    def seconds(self, time):
        return self.plain(time >> 16 & 0x3F) * 3600 + self.plain(time >> 8 & 0x7F) * 60 + self.plain(time & 0x7F)

    def later(self, date, days):
        year, month, day, weekday = self.plain(date >> 16 & 0xFF), self.plain(date >> 8 & 0x1F), self.plain(date & 0x3F), date >> 13 & 7
        for _ in range(days):
            day, weekday = day + 1, weekday % 7 + 1
            if day > (29 if month == 2 and year % 4 == 0 else [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31][month - 1]):
                day, month = 1, month + 1
            if month > 12:
                month, year = 1, (year + 1) % 100
        return self.coded(year) << 16 | weekday << 13 | self.coded(month) << 8 | self.coded(day)

    def initialising(self):
        """INITF: two cycles of RTCCLK after INIT."""
        clock = self.domain.clock(self.chip.rcc.lsi)
        return self.asked and clock and self.chip.cycles >= self.init_at + 2 * CORE / clock

    def read(self, offset):
        if offset in (0x00, 0x04, 0x28):
            value = self.latched or self.now()
            if not self.domain.cr >> 5 & 1:  # shadows: the first read holds the rest until DR is read (26.3.6)
                self.latched = None if offset == 0x04 else value
            return value[{0x00: 0, 0x04: 1, 0x28: 2}[offset]]
        if offset == 0x0C:
            set_up = (self.domain.base[1] >> 16 != 0) << 4
            return 7 | set_up | (not self.asked and self.ticks() >= 2) << 5 | bool(self.initialising()) << 6 | self.asked << 7
        if 0x50 <= offset < 0xA0:
            return self.domain.words[(offset - 0x50) // 4]
        return {0x08: self.domain.cr, 0x10: self.domain.prer}.get(offset, 0)

    def write(self, offset, value):
        if not self.chip.power.cr >> 8 & 1:
            return  # DBP: the domain is write-protected (5.1.2)
        if offset == 0x24:
            self.keys = (self.keys + [value & 0xFF])[-2:]
            self.open = self.keys == [0xCA, 0x53]
        elif 0x50 <= offset < 0xA0:
            self.domain.words[(offset - 0x50) // 4] = value
        elif self.open:
            self.unprotected(offset, value)

    def unprotected(self, offset, value):
        domain = self.domain
        if offset == 0x0C and value >> 7 & 1 and not self.asked:
            domain.base, self.asked, self.init_at = self.now()[:2], True, self.chip.cycles
            domain.since = None
        elif offset == 0x0C and not value >> 7 & 1 and self.asked:
            self.asked, domain.since, self.latched = False, self.chip.cycles, None
        elif offset == 0x08:
            domain.cr = value
        elif offset in (0x00, 0x04, 0x10) and self.initialising():
            if offset == 0x10:
                domain.prer = value & 0x7F_7FFF
            else:
                domain.base = (value, domain.base[1]) if offset == 0x00 else (domain.base[0], value)


class Bits:
    """The alias of the peripherals: a word for each bit (RM0090 2.3.3, Armv7-M)."""

    def __init__(self, chip):
        self.chip = chip
        chip.cpu.mmio_map(0x4200_0000, 0x0200_0000, self.read, None, self.write, None)

    def read(self, cpu, offset, *_):
        return self.chip.bus_read(cpu, offset >> 5 & ~3, 4, None) >> (offset >> 2 & 31) & 1

    def write(self, cpu, offset, _, value, __):
        word, bit = offset >> 5 & ~3, offset >> 2 & 31
        old = self.chip.bus_read(cpu, word, 4, None)
        self.chip.bus_write(cpu, word, 4, old & ~(1 << bit) | (value & 1) << bit, None)


# first address, RCC's enable register, its bit (7.3.10, 7.3.13, 7.3.14)
CLOCKS = [(0x4002_0000 + 0x400 * n, 0x30, n) for n in range(9)] + [
    (0x4002_6000, 0x30, 21), (0x4002_6400, 0x30, 22), (0x4000_4400, 0x40, 17), (0x4000_4800, 0x40, 18), (0x4000_4C00, 0x40, 19),
    (0x4001_1000, 0x44, 4), (0x4001_3000, 0x44, 12), (0x4001_3800, 0x44, 14),
]  # fmt: skip
CLOCK_OF = {base: (register, bit) for base, register, bit in CLOCKS}


def clocked(chip, address):
    """A peripheral without a clock ignores writes; a program that writes to it is at fault."""
    register, bit = CLOCK_OF.get(address & ~0x3FF, (None, 0))
    if register is not None and not chip.rcc.read(register) >> bit & 1:
        raise Forbidden(f"{address:#x} without its clock")


def held(register, bits):
    """First addresses of the peripherals that RCC holds in reset (7.3.5, 7.3.8, 7.3.9)."""
    return [address for address, (enable, bit) in CLOCK_OF.items() if enable - 0x20 == register and bits >> bit & 1]


# line: alternate function, transmitter's and receiver's pins (DS8626 table 9, as stm32f4xx-hal and stm32-metapac have them)
PINS = {
    "sensor": (7, ["A9", "B6"], ["A10", "B7"]),
    "navigation": (7, ["A2", "D5"], ["A3", "D6"]),
    "gnss": (7, ["B10", "C10", "D8"], ["B11", "C11", "D9"]),
    "command": (8, ["A0", "C10"], ["A1", "C11"]),
}


def wired(chip, line, receives):
    """Whether a pin is this line's: its mode and its alternate function (8.4.1, 8.4.9)."""
    function, *pins = PINS[line]
    for pin in pins[receives]:
        port, number = 0x4002_0000 + 0x400 * (ord(pin[0]) - ord("A")), int(pin[1:])
        mode = chip.registers.get(port, 0) >> 2 * number & 3
        if mode == 2 and chip.registers.get(port + 0x20 + 4 * (number // 8), 0) >> 4 * (number % 8) & 15 == function:
            return True
    return False


class Core:
    """Registers of the core that programs read: identity, the interrupt controller's registers, cycles, and the trace port that they report by (Armv7-M C1.7)."""

    def __init__(self, chip):
        self.chip, self.words, self.reports = chip, {}, []

    def read(self, offset):
        """`None`: no register here."""
        chip = self.chip
        if offset < 0x80:
            return 1  # the port takes a word
        for base, numbers in ((0xE100, chip.enabled), (0xE180, chip.enabled), (0xE200, chip.pending), (0xE280, chip.pending)):
            if base <= offset < base + 0x20:
                return sum(1 << n for n in range(32) if n + 8 * (offset - base) in numbers)
        if offset == 0xE014:
            return chip.reload
        if offset == 0x1004 and self.words.get(0x1000, 0) & 1:
            return int(chip.cycles / chip.rcc.cost) & 0xFFFF_FFFF
        if offset == 0xED00:
            return 0x410F_C241  # Cortex-M4 r0p1
        return self.words.get(offset)

    def write(self, offset, value):
        if offset < 0x80:
            if self.words.get(0xEDFC, 0) >> 24 & 1 and self.words.get(0x0E80, 0) & 1 and self.words.get(0x0E00, 0) >> offset // 4 & 1:
                self.reports.append((offset // 4, value, self.chip.cycles))
        elif offset in (0x0E00, 0x0E80, 0x1000, 0xED08, 0xED10, 0xED14, 0xED88, 0xEDFC):
            self.words[offset] = value
