"""SPI1 of an STM32F405 as a master (RM0090 section 28), and an ADIS16 at its bus.

A byte waits in the transmit buffer while the one before is shifted. A byte that comes while the last one was not taken is lost (OVR). The ADIS has registers of
two bytes at their addresses, pages if it has them, and is strict about the stall time and the clock of a burst.
"""
import collections

from stm32parts import CORE, Forbidden

SLICE = 100  # instructions between two updates of the peripherals
RXNE, TXE, OVR, BSY = 1, 2, 1 << 6, 1 << 7


class Spi:
    BASE, CHANNEL = 0x4001_3000, 3
    INTO, OUT = [(2, 0), (2, 2)], [(2, 3), (2, 5)]  # table 43

    def __init__(self, chip, adis):
        self.chip, self.device = chip, Adis(chip, adis) if adis else None
        self.selected = False
        self.reset()

    def reset(self):
        """As after power-on (7.3.9): a byte in transmission is aborted."""
        self.cr1, self.cr2, self.came, self.lost, self.seen = 0, 0, None, False, 0
        self.waiting, self.exchanged, self.done = None, None, None
        self.hangs, self.asked = False, 0

    def clock(self):
        return int(self.chip.rcc.apb2) >> (self.cr1 >> 3 & 7) + 1

    def look(self):
        if self.done is not None and self.chip.cycles >= self.done:
            if self.came is None:
                self.came = self.exchanged
            else:
                self.lost = True
            ended, self.done = self.done, None
            if self.waiting is not None:
                self.shift(self.waiting, ended)
                self.waiting = None
        self.request()

    def shift(self, byte, at):
        if self.device and self.selected:
            self.device.clocked(byte, self.clock())
        self.exchanged = self.device.reply(byte) if self.device and self.selected else 0
        self.done = at + 8 * CORE // self.clock()

    def request(self):
        """DMA (28.3.9). One that hangs asks for 10 bytes and no more."""
        data = self.BASE + 0x0C
        if self.hangs and self.asked >= 20:
            return
        if self.came is not None and self.cr2 & 1:
            for key in self.INTO:
                stream = self.chip.streams[key]
                if stream.serves(data, False, self.CHANNEL):
                    self.asked += 1
                    self.chip.cpu.mem_write(stream.moved(), bytes([self.read(0x0C)]))
                    break
        if self.waiting is None and self.cr2 >> 1 & 1 and self.cr1 >> 6 & 1:
            for key in self.OUT:
                stream = self.chip.streams[key]
                if stream.serves(data, True, self.CHANNEL):
                    self.asked += 1
                    self.write(0x0C, self.chip.cpu.mem_read(stream.moved(), 1)[0])
                    break

    def next_event(self):
        return self.done

    def read(self, offset):
        self.look() if offset == 0x08 else None
        if offset == 0x08:
            self.seen = (self.came is not None) * RXNE | (self.waiting is None) * TXE | self.lost * OVR | (self.done is not None) * BSY
            return self.seen
        if offset == 0x0C:
            value, self.came = self.came or 0, None
            if self.seen & OVR:  # cleared by DR, then SR; here by both
                self.lost = False
            return value
        return {0x00: self.cr1, 0x04: self.cr2}.get(offset, 0)

    def write(self, offset, value):
        if offset == 0x00:
            if self.done is not None and (value ^ self.cr1) & 0x3F:
                raise Forbidden("SPI1: clock or mode changed within a byte (28.5.1)")
            self.cr1 = value
        elif offset == 0x04:
            self.cr2 = value
        elif offset == 0x0C:
            if self.cr1 & 0x344 != 0x344:
                raise Forbidden(f"SPI1 is not enabled as a master: {self.cr1:#x}")
            if self.device and self.selected and self.cr1 & 3 != 3:
                raise Forbidden(f"the ADIS wants mode 3: {self.cr1:#x}")
            if self.waiting is not None:
                raise Forbidden("SPI1: written while the transmit buffer is full")
            if self.done is None:
                self.shift(value & 0xFF, self.chip.cycles)
            else:
                self.waiting = value & 0xFF

    def select(self, low):
        if low == self.selected:
            return
        self.look()
        if self.done is not None:
            raise Forbidden("chip select moves within a byte")
        self.selected, self.asked = low, 0
        if self.device:
            self.device.select(low)


class Adis:
    STALL = CORE // 1_000_000 * 16

    def __init__(self, chip, adis):
        self.chip, self.adis = chip, adis
        self.frame, self.answer, self.free_at = [], b"\0\0", 0
        self.burst, self.page, self.memory = b"", 0, collections.defaultdict(int)
        self.paged = paged = 16480 <= adis["product"] < 16500
        self.memory.update(self.word(0, 0x7E if paged else 0x72, adis["product"]))
        self.memory.update(self.word(3 if paged else 0, 0x12 if paged else 0x5E, adis["range"]))
        self.bursts = 0

    def decimation(self):
        """DEC_RATE."""
        page, address = (3, 0x0C) if self.paged else (0, 0x64)
        return self.memory[page, address] | self.memory[page, address + 1] << 8

    @staticmethod
    def word(page, address, value):
        return {(page, address): value & 0xFF, (page, address + 1): value >> 8}

    def clocked(self, byte, clock):
        if self.frame[:1] in ([0x68], [0x7C]) and clock > self.adis["hz"]:
            raise Forbidden(f"a burst at {clock} Hz")

    def reply(self, byte):
        self.frame.append(byte)
        n = len(self.frame) - 1
        if self.frame[:2] in ([0x68, 0], [0x7C, 0]):
            return self.burst[n - 2] if 2 <= n < 2 + len(self.burst) else 0
        return self.answer[n] if n < 2 else 0

    def select(self, low):
        if low:
            if self.chip.cycles + 2 * SLICE < self.free_at:
                raise Forbidden(f"stall time: {self.free_at - self.chip.cycles} cycles too early")
            self.frame = []
            return
        self.free_at = self.chip.cycles + self.STALL
        if len(self.frame) != 2:
            self.bursts += self.frame[:1] in ([0x68], [0x7C])
        elif self.frame[0] & 0x80:
            address = self.frame[0] & 0x7F
            if address == 0:
                self.page = self.frame[1]
            self.memory[self.page, address] = self.frame[1]
        else:
            self.answer = bytes(self.memory[self.page, self.frame[0] + n] for n in (1, 0))
