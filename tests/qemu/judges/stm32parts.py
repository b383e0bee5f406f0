"""Parts of an STM32F405 that decide whether it lives: clock tree, timers, watchdogs, flash controller, supply. Written from RM0090, stricter than it.

Time is counted in cycles of 168 MHz, whatever the core's clock is: an instruction takes `Rcc.cost` of them. `chip` gives `cycles`, `power` (a Power),
and `restart(cause)`. What the manual forbids raises Forbidden.
"""

CORE = 168_000_000
POWER_ON, PIN, SOFTWARE, WATCHDOG, WINDOW, BROWN_OUT = 1 << 27, 1 << 26, 1 << 28, 1 << 29, 1 << 30, 1 << 25  # RCC_CSR
LSI = 32_000


class Forbidden(Exception):
    pass


class Rcc:
    """RM0090 section 7: oscillators, PLL, prescalers, reset flags. `crystal`: MHz, 0 is a dead one; `internal`: factor on its 16 MHz."""

    def __init__(self, chip, crystal, internal, locks, flags):
        self.chip, self.crystal, self.internal, self.locks, self.flags = chip, crystal * 1e6, 16e6 * internal, locks, flags
        self.cr, self.pllcfgr, self.cfgr, self.registers, self.on_at = 0x83, 0x2400_3010, 0, {}, 0
        self.stopped = False
        self.derive()

    def hse(self):
        """On and settled, 2 ms after it was switched on."""
        return self.cr >> 16 & 1 and self.crystal and not self.stopped and self.chip.cycles >= self.on_at + CORE // 500

    def pll(self):
        source = self.crystal if self.pllcfgr >> 22 & 1 else self.internal
        alive = self.hse() if self.pllcfgr >> 22 & 1 else True
        return source / (self.pllcfgr & 63) * (self.pllcfgr >> 6 & 511) / 2 if self.cr >> 24 & 1 and self.locks and alive else 0

    def derive(self):
        """Clocks in Hz; what is asked for and not there leaves the core on what it has."""
        switch = self.cfgr & 3
        self.core = {0: self.internal, 1: self.crystal if self.hse() else 0, 2: self.pll()}.get(switch, 0) or self.internal
        self.switched = switch if self.core != self.internal or switch == 0 else 0
        shift = lambda bits: {4: 1, 5: 2, 6: 3, 7: 4}.get(bits, 0)
        if self.cfgr >> 4 & 15 >= 8:
            raise Forbidden("the AHB is divided")
        self.divided = [shift(self.cfgr >> 10 & 7), shift(self.cfgr >> 13 & 7)]
        self.apb1, self.apb2 = (self.core / (1 << shift) for shift in self.divided)
        self.timers1, self.timers2 = (bus * (2 if shift else 1) for bus, shift in zip((self.apb1, self.apb2), self.divided))
        self.cost = CORE / self.core
        if self.core > 168e6 * 1.06 or self.apb1 > 42e6 * 1.06 or self.apb2 > 84e6 * 1.06:
            raise Forbidden(f"too fast: {self.core}, {self.apb1}, {self.apb2} Hz")
        if self.core > 30e6 * ((self.chip.registers.get(0x4002_3C00, 0) & 7) + 1):
            raise Forbidden(f"{self.core} Hz without wait states")

    def read(self, offset):
        if offset == 0x00:
            return self.cr & ~(1 << 17 | 1 << 25) | 2 | bool(self.hse()) << 17 | bool(self.pll()) << 25
        if offset == 0x08:
            self.derive()
            return self.cfgr & ~0xC | self.switched << 2
        return {0x04: self.pllcfgr, 0x74: self.flags}.get(offset, self.registers.get(offset, 1 << 20 if offset == 0x30 else 0))

    def write(self, offset, value):
        if offset == 0x00:
            if value >> 16 & 1 and not self.cr >> 16 & 1:
                self.on_at = self.chip.cycles
            self.cr = value
        elif offset == 0x04:
            if self.cr >> 24 & 1:
                raise Forbidden("RCC_PLLCFGR while the PLL is on (7.3.2)")
            if not 0.9e6 < (self.crystal if value >> 22 & 1 else self.internal) / (value & 63) < 2.2e6:
                raise Forbidden("the PLL's input is not 1 to 2 MHz (7.3.2)")
            self.pllcfgr = value
        elif offset == 0x08:
            self.cfgr = value
        elif offset == 0x74:
            self.flags = 0 if value >> 24 & 1 else self.flags
        else:
            self.registers[offset] = value
            if offset == 0x20 and value >> 11 & 1:
                self.chip.wwdg.stop()
        self.derive()

    def stop_crystal(self):
        """7.2.7: with CSS the core falls back to the internal oscillator and the NMI comes."""
        self.stopped = True
        self.cr &= ~(1 << 16 | 1 << 24)
        self.cfgr &= ~3
        self.derive()
        return self.cr >> 19 & 1


class Tim2:
    """A free count of 32 bits."""

    def __init__(self, chip):
        self.chip, self.psc, self.next_psc, self.since, self.on, self.speed = chip, 0, 0, 0, False, 1

    def read(self, offset):
        if offset != 0x24 or not self.on:
            return 0
        ticks = (self.chip.cycles - self.since) * self.chip.rcc.timers1 * self.speed / CORE
        return int(ticks / (self.psc + 1)) & 0xFFFF_FFFF

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) & 1:
            raise Forbidden("TIM2 without its clock")
        if offset == 0x28:
            self.next_psc = value
        if offset == 0x14 and value & 1:
            self.psc, self.since = self.next_psc, self.chip.cycles
        if offset == 0x00:
            self.on, self.since = bool(value & 1), self.chip.cycles


class Tim11:
    """Channel 1 captures every eighth edge of HSE_RTC (7.2.11, 19.6.12)."""

    def __init__(self, chip):
        self.chip, self.registers, self.on_at, self.seen = chip, {}, None, 0

    def edges(self):
        rcc = self.chip.rcc
        divider = rcc.cfgr >> 16 & 31
        good = self.registers.get(0x50, 0) == 2 and self.registers.get(0x18, 0) & 0xFF == 0x0D and self.registers.get(0x20, 0) & 1
        if not good or divider < 2 or not rcc.hse():
            return 0, 0
        self.period = 8 * divider * CORE / rcc.crystal
        return int((self.chip.cycles - self.on_at) / self.period), self.period

    def read(self, offset):
        if self.on_at is None:
            return 0
        count = lambda cycles: int((cycles - self.on_at) * self.chip.rcc.timers2 / CORE) & 0xFFFF
        edges, period = self.edges()
        if offset == 0x10:
            return 2 * (edges > self.seen) | 0x200 * (edges > self.seen + 1)
        if offset == 0x24:
            return count(self.chip.cycles)
        if offset == 0x34:
            self.seen = edges
            return count(self.on_at + edges * period)
        return 0

    def write(self, offset, value):
        if not self.chip.rcc.read(0x44) >> 18 & 1:
            raise Forbidden("TIM11 without its clock")
        self.registers[offset] = value
        if offset == 0x00:
            self.on_at, self.seen = (self.chip.cycles, 0) if value & 1 else (None, 0)


class Rng:
    """RM0090 section 24: a word of 48 MHz from the PLL. A generator of pseudo-random numbers stands for the noise."""

    def __init__(self, chip):
        self.chip, self.cr, self.word = chip, 0, 1

    def read(self, offset):
        on = self.cr >> 2 & 1 and self.chip.rcc.read(0x34) >> 6 & 1 and self.chip.rcc.pll()
        if offset == 8 and on:
            self.word = self.word * 1_664_525 + 1_013_904_223 & 0xFFFF_FFFF
            return self.word
        return {0: self.cr, 4: int(bool(on))}.get(offset, 0)

    def write(self, offset, value):
        self.cr = value if offset == 0 else self.cr


class Iwdg:
    """RM0090 section 21, at its nominal 32 kHz."""

    def __init__(self, chip):
        self.chip, self.prescaler, self.reload, self.ends = chip, 0, 0xFFF, None

    def read(self, offset):
        return 0

    def write(self, offset, value):
        if offset == 0x04:
            self.prescaler = value & 7
        if offset == 0x08:
            self.reload = value & 0xFFF
        if offset == 0x00 and (value == 0xCCCC or value == 0xAAAA and self.ends):
            self.ends = self.chip.cycles + (self.reload + 1) * (4 << self.prescaler) * CORE / LSI

    def look(self):
        if self.ends and self.chip.cycles >= self.ends:
            self.chip.restart(WATCHDOG)

    def next_event(self):
        return self.ends


class Wwdg:
    """RM0090 section 22."""

    def __init__(self, chip):
        self.chip, self.cfr, self.at, self.start, self.warned = chip, 0x7F, None, 0x7F, False

    def tick(self):
        return 4096 * (1 << (self.cfr >> 7 & 3)) * CORE / self.chip.rcc.apb1

    def count(self):
        return self.start - int((self.chip.cycles - self.at) / self.tick())

    def stop(self):
        self.at = None

    def read(self, offset):
        return {0x00: (self.count() & 0x7F | 0x80) if self.at is not None else 0x7F, 0x04: self.cfr}.get(offset, 0)

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) >> 11 & 1:
            raise Forbidden("WWDG without its clock")
        if offset == 0x04:
            self.cfr = value
        if offset == 0x00 and value >> 7 & 1:
            if self.at is not None and self.count() > self.cfr & 0x7F:
                return self.chip.restart(WINDOW, "fed too early")
            if not value >> 6 & 1:
                return self.chip.restart(WINDOW)
            self.at, self.start, self.warned = self.chip.cycles, value & 0x7F, False

    def look(self):
        if self.at is None:
            return
        if self.count() <= 0x40 and self.cfr >> 9 & 1 and not self.warned:
            self.warned = True
            self.chip.pending.add(0)
        if self.count() < 0x40:
            self.chip.restart(WINDOW)

    def next_event(self):
        if self.at is None:
            return None
        ticks = self.start - (0x40 if not self.warned else 0x3F)
        return self.at + ticks * self.tick() + 1


class Power:
    """The supply and its detector (section 5.2.3). Falling thresholds at their least, DS8626 table 19."""

    LEVELS = [1.98, 2.13, 2.29, 2.44, 2.59, 2.75, 2.85, 2.95]

    def __init__(self, chip, volts):
        self.chip, self.volts, self.cr = chip, volts, 0

    def read(self, offset):
        low = self.cr >> 4 & 1 and self.volts < self.LEVELS[self.cr >> 5 & 7]
        return self.cr if offset == 0 else bool(low) << 2

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) >> 28 & 1:
            raise Forbidden("PWR without its clock")
        self.cr = value if offset == 0 else self.cr


class Flash:
    """The controller (3.6, 3.9). A word takes 16 us, a sector of 128 KiB one second, and the core stands still. Below 2.7 V x32 is forbidden."""

    def __init__(self, chip, brown_out):
        self.chip, self.cr, self.keys, self.brown_out, self.writes, self.erased = chip, 1 << 31, [], brown_out, 0, []

    def read(self, offset):
        return {0x10: self.cr, 0x14: 0x0FFF_AAE1 | (3 - self.brown_out) << 2}.get(offset, self.chip.registers.get(0x4002_3C00 + offset, 0))

    def write(self, offset, value):
        if offset == 0x00:
            self.chip.registers[0x4002_3C00] = value
        if offset == 0x04:
            self.keys = (self.keys + [value])[-2:]
            if self.keys == [0x4567_0123, 0xCDEF_89AB]:
                self.cr &= ~(1 << 31)
        if offset == 0x10:
            if self.cr >> 31 and not value >> 31:
                raise Forbidden("FLASH_CR while it is locked")
            self.cr = value & ~(1 << 16)
            if value >> 16 & 1:
                self.erase(value)

    def erase(self, value):
        self.supplied()
        sector = value >> 3 & 15
        if not value >> 1 & 1 or value & 1 or sector not in (10, 11):
            raise Forbidden(f"erase with FLASH_CR {value:#x}")
        self.erased.append(sector)
        self.chip.cpu.mem_write(0x0800_0000 + 0xC_0000 + (sector - 10) * 0x2_0000, b"\xff" * 0x2_0000)
        self.chip.stall(CORE)

    def supplied(self):
        if self.chip.power.volts < 2.7 or self.cr >> 8 & 3 != 2:
            raise Forbidden(f"flash is changed x32 at {self.chip.power.volts} V")

    def programmed(self, address, size, value):
        self.supplied()
        if self.cr >> 31 or not self.cr & 1 or size != 4:
            raise Forbidden(f"{size} bytes written to flash at {address:#x}")
        if int.from_bytes(self.chip.cpu.mem_read(address, 4), "little") & value != value:
            raise Forbidden(f"a bit of flash set at {address:#x}")
        self.writes += 1
        self.chip.stall(CORE // 62_500)
