"""Vital parts of an STM32F405: clock tree, timers, watchdogs, flash controller, supply. Written from RM0090, stricter than it.

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
        self.stopped, self.lsi, self.lsi_at = False, False, 0
        self.derive()

    def hse(self):
        """On and settled, 2 ms after it was switched on."""
        return self.cr >> 16 & 1 and self.crystal and not self.stopped and self.chip.cycles >= self.on_at + CORE // 500

    def pll(self):
        source = self.crystal if self.pllcfgr >> 22 & 1 else self.internal
        alive = self.hse() if self.pllcfgr >> 22 & 1 else self.cr & 1
        return self.oscillates(source) / self.divided_by() if self.cr >> 24 & 1 and self.locks and alive else 0

    def oscillates(self, source):
        return source / (self.pllcfgr & 63) * (self.pllcfgr >> 6 & 511)

    def divided_by(self):
        """PLLP (7.3.2)."""
        return 2 * (self.pllcfgr >> 16 & 3) + 2

    def derive(self):
        """Clocks in Hz; a source that is selected but not ready leaves the core on its present one."""
        switch = self.cfgr & 3
        there = {0: self.internal, 1: self.crystal if self.hse() else 0, 2: self.pll()}.get(switch, 0)
        self.switched = switch if there else 0
        shift = lambda bits: {4: 1, 5: 2, 6: 3, 7: 4}.get(bits, 0)
        self.core = (there or self.internal) / {n: 1 << n - (7 if n < 12 else 6) for n in range(8, 16)}.get(self.cfgr >> 4 & 15, 1)
        self.divided = [shift(self.cfgr >> 10 & 7), shift(self.cfgr >> 13 & 7)]
        self.apb1, self.apb2 = (self.core / (1 << shift) for shift in self.divided)
        self.timers1, self.timers2 = (bus * (2 if shift else 1) for bus, shift in zip((self.apb1, self.apb2), self.divided))
        self.cost = CORE / self.core
        if self.core > 168e6 * 1.06 or self.apb1 > 42e6 * 1.06 or self.apb2 > 84e6 * 1.06:
            raise Forbidden(f"too fast: {self.core}, {self.apb1}, {self.apb2} Hz")
        if self.core > 30e6 * ((self.chip.registers.get(0x4002_3C00, 0) & 7) + 1):
            raise Forbidden(f"{self.core} Hz without wait states")
        power = getattr(self.chip, "power", None)
        if self.core > 144e6 * 1.06 and power and not power.cr >> 14 & 1:
            raise Forbidden(f"{self.core} Hz with the regulator in scale 2 (5.1.3)")

    def read(self, offset):
        if offset == 0x00:
            return self.cr & ~(1 << 17 | 1 << 25 | 2) | (self.cr & 1) << 1 | bool(self.hse()) << 17 | bool(self.pll()) << 25
        if offset == 0x08:
            self.derive()
            return self.cfgr & ~0xC | self.switched << 2
        if offset == 0x70:
            return self.chip.backup.bdcr  # there is no crystal of 32 kHz: LSERDY stays 0
        if offset == 0x74:
            return self.flags | self.lsi | (self.lsi and self.chip.cycles >= self.lsi_at + CORE // 66_000) << 1  # 15 us, DS8626 table 35
        return {0x04: self.pllcfgr}.get(offset, self.registers.get(offset, 1 << 20 if offset == 0x30 else 0))

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
            source = self.crystal if value >> 22 & 1 else self.internal
            if not 95e6 < self.oscillates(source) < 440e6:
                raise Forbidden(f"the PLL oscillates at {self.oscillates(source)} Hz (7.3.2)")
        elif offset == 0x70:
            self.write_backup(value)
        elif offset == 0x08:
            self.cfgr = value
        elif offset == 0x74:
            self.flags = 0 if value >> 24 & 1 else self.flags
            self.lsi_at = self.lsi_at if self.lsi else self.chip.cycles
            self.lsi = bool(value & 1)
        else:
            self.registers[offset] = value
            if offset == 0x20 and value >> 11 & 1:
                self.chip.wwdg.stop()
            if offset in (0x10, 0x20, 0x24) and value:
                self.chip.reset_peripherals(offset, value)
        self.derive()

    def write_backup(self, value):
        """RCC_BDCR behind DBP; BDRST clears the domain, and a source once chosen stays (7.3.20)."""
        domain = self.chip.backup
        if not self.chip.power.cr >> 8 & 1:
            return
        if value >> 16 & 1:
            domain.__init__()
            value = 1 << 16
        if domain.bdcr >> 8 & 3:
            value = value & ~0x300 | domain.bdcr & 0x300
        domain.bdcr = value & 0x1_8305

    def stop_crystal(self):
        """7.2.7: with CSS the core falls back to the internal oscillator and the NMI comes."""
        self.stopped = True
        self.cr = self.cr & ~(1 << 16 | 1 << 24) | 1
        self.cfgr &= ~3
        self.derive()
        return self.cr >> 19 & 1


class Tim2:
    """A free count of 32 bits. At another clock it goes on from where it is."""

    def __init__(self, chip):
        self.chip, self.psc, self.next_psc, self.on, self.speed = chip, 0, 0, False, 1
        self.base, self.since, self.rate = 0, 0, 0.0

    def look(self):
        """The count. A change of the clock or the speed counts from here on."""
        count = self.base + int((self.chip.cycles - self.since) * self.rate / CORE)
        rate = self.chip.rcc.timers1 * self.speed / (self.psc + 1)
        if rate != self.rate:
            self.base, self.since, self.rate = count, self.chip.cycles, rate
        return count & 0xFFFF_FFFF

    def read(self, offset):
        return self.look() if offset == 0x24 and self.on else 0

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) & 1:
            raise Forbidden("TIM2 without its clock")
        if offset == 0x28:
            self.next_psc = value
        if offset == 0x14 and value & 1:
            self.psc, self.base, self.since, self.rate = self.next_psc, 0, self.chip.cycles, 0.0
        if offset == 0x00:
            self.on, self.base, self.since, self.rate = bool(value & 1), 0, self.chip.cycles, 0.0
            self.look()


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
    """RM0090 section 24: a word of 48 MHz from the PLL. A pseudo-random generator replaces the noise."""

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
        self.open, self.taken = False, {0x04: 0, 0x08: 0}  # until when PVU and RVU are set

    def read(self, offset):
        if offset == 0x0C:
            return (self.chip.cycles < self.taken[0x04]) | (self.chip.cycles < self.taken[0x08]) << 1
        return {0x04: self.prescaler, 0x08: self.reload}.get(offset, 0)

    def write(self, offset, value):
        if offset in self.taken and self.open and self.chip.cycles >= self.taken[offset]:
            self.taken[offset] = self.chip.cycles + 5 * CORE // LSI
            if offset == 0x04:
                self.prescaler = value & 7
            else:
                self.reload = value & 0xFFF
        if offset == 0x00:
            self.open = value == 0x5555  # 21.3.2
        if offset == 0x00 and (value == 0xCCCC or value == 0xAAAA and self.ends):
            self.ends = self.chip.cycles + self.period()

    def period(self):
        return (self.reload + 1) * (4 << min(self.prescaler, 6)) * CORE / LSI

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
    """The supply and its voltage detector (section 5.2.3). Falling thresholds at their least, DS8626 table 19."""

    LEVELS = [1.98, 2.13, 2.29, 2.44, 2.59, 2.75, 2.85, 2.95]

    def __init__(self, chip, volts):
        self.chip, self.volts, self.cr = chip, volts, 0x4000  # regulator in scale 1 (5.4.1)

    def low(self):
        return bool(self.cr >> 4 & 1 and self.volts < self.LEVELS[self.cr >> 5 & 7])

    def read(self, offset):
        return self.cr if offset == 0 else self.low() << 2 | 1 << 14

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) >> 28 & 1:
            raise Forbidden("PWR without its clock")
        self.cr = value if offset == 0 else self.cr


class Flash:
    """The controller (3.5 to 3.9). The program is in the same flash, so the core is stalled while it works: 16 us for a piece, whatever its width,
    and for a sector the typical times of DS8626 tables 39 and 40. It reports refused operations in FLASH_SR, and leaves flash unchanged.

    Stricter than the chip: a bit is never set without erasing, and no sector is erased that a program was loaded into.
    """

    BEGINS = [0x4000 * n for n in range(4)] + [0x1_0000] + [0x2_0000 * n for n in range(1, 9)]
    LEAST = [1.7, 2.1, 2.7, 2.7]  # volts for bytes, half-words, words; double words want another supply
    ERASE = {0x4000: [0.4, 0.3, 0.25], 0x1_0000: [1.2, 0.7, 0.55], 0x2_0000: [2.0, 1.3, 1.0]}  # seconds
    BLANK = b"\xff"
    EOP, WRPERR, PGAERR, PGPERR, PGSERR = 1, 1 << 4, 1 << 5, 1 << 6, 1 << 7

    def __init__(self, chip, brown_out):
        self.chip, self.cr, self.sr, self.keys, self.brown_out, self.writes, self.erased = chip, 1 << 31, 0, [], brown_out, 0, []
        self.after = []  # pieces whose content differs from what the core wrote: address, bytes
        self.stands = 0  # cycles for which the core is still stalled

    def read(self, offset):
        self.done() if offset == 0x0C else None
        here = {0x0C: self.sr, 0x10: self.cr, 0x14: 0x0FFF_AAE1 | (3 - self.brown_out) << 2}
        return here.get(offset, self.chip.registers.get(0x4002_3C00 + offset, 0))

    def write(self, offset, value):
        if offset == 0x00:
            self.chip.registers[0x4002_3C00] = value
        if offset == 0x04:
            self.keys = (self.keys + [value])[-2:]
            if self.keys == [0x4567_0123, 0xCDEF_89AB]:
                self.cr &= ~(1 << 31)
        if offset == 0x0C:
            self.sr &= ~(value & 0xF3)
        if offset == 0x10:
            if self.cr >> 31:
                if not value >> 31:
                    raise Forbidden("FLASH_CR while it is locked")
                return
            self.cr = value & ~(1 << 16)
            if value >> 16 & 1:
                self.erase(value)

    def width(self):
        """Bytes of a piece (PSIZE); the supply must be enough for it (table 7)."""
        if self.chip.power.volts < self.LEAST[self.cr >> 8 & 3]:
            raise Forbidden(f"flash is changed {8 << (self.cr >> 8 & 3)} bits wide at {self.chip.power.volts} V")
        return 1 << (self.cr >> 8 & 3)

    def erase(self, value):
        sector, width = value >> 3 & 15, self.width()
        if not value >> 1 & 1 or value & 1 or sector > 11:
            self.sr |= self.PGSERR
            return
        begin, end = self.BEGINS[sector : sector + 2]
        if any(begin < to and at < end for at, to in self.chip.loaded):
            raise Forbidden(f"erase of sector {sector}, where the program is: FLASH_CR {value:#x}")
        self.erased.append(sector)
        self.sr |= self.EOP * (value >> 24 & 1)
        if self.BLANK:
            self.chip.cpu.mem_write(0x0800_0000 + begin, self.BLANK * (end - begin))
        self.chip.stall(int(self.ERASE[end - begin][{1: 0, 2: 1}.get(width, 2)] * CORE))

    def programmed(self, address, size, value):
        """Flash has the piece when `done` is called; here the core is about to write it."""
        before = bytes(self.chip.cpu.mem_read(address, size))
        wrong = self.PGSERR if not self.cr & 1 or self.cr & 6 else self.PGPERR * (size != 1 << (self.cr >> 8 & 3))
        wrong |= self.PGAERR * (address % 16 + size > 16)
        if self.cr >> 31 or wrong:
            self.sr |= wrong or self.WRPERR
            self.after.append((address, before))
            return
        self.width()
        if int.from_bytes(before, "little") & value != value:
            raise Forbidden(f"a bit of flash set at {address:#x}")
        self.writes += 1
        self.sr |= self.EOP * (self.cr >> 24 & 1)
        self.stands += CORE // 62_500

    def works(self):
        """Whether the core has written since `done`."""
        return self.stands or self.after

    def done(self):
        """The core's writes have ended."""
        if self.after:
            for address, piece in self.after:
                self.chip.cpu.mem_write(address, piece)
            self.after = []
        if self.stands:
            stands, self.stands = self.stands, 0
            self.chip.stall(stands)
