"""The DMA controllers of an STM32F405 (RM0090 section 10), as far as serial lines use them: direct mode, once, circular, or with two buffers.

What the manual forbids raises Forbidden. What drivers do that thousands of chips take is taken here as well; docs/BOARDS.md lists where this was learnt.
"""
from stm32parts import Forbidden

SRAM = (0x2000_0000, 0x2_0000)
DMA = {1: 0x4002_6000, 2: 0x4002_6400}
DMA_INTERRUPT = {1: [11, 12, 13, 14, 15, 16, 17, 47], 2: [56, 57, 58, 59, 60, 68, 69, 70]}
SHIFT = [0, 6, 16, 22]
TCIF, HTIF, TEIF, FLAGS = 1 << 5, 1 << 4, 1 << 3, 0x3D
ENABLE, CIRCULAR, TWO_BUFFERS, SECOND = 1, 1 << 8, 1 << 18, 1 << 19


class Stream:
    CHANNEL = 4  # of all UARTs of tables 42 and 43

    def __init__(self, controller, number):
        self.controller, self.number = controller, number
        self.cr = self.ndtr = self.par = self.m0ar = self.m1ar = self.at = self.flags = self.whole = 0
        self.fcr = 0x21
        self.interrupt = DMA_INTERRUPT[controller][number]

    def name(self):
        return f"DMA{self.controller} stream {self.number}"

    def write(self, offset, value):
        if offset == 0x00:
            self.control(value)
        elif offset == 0x14:
            if self.cr & 1 and (value ^ self.fcr) & 7:
                raise Forbidden(f"{self.name()}: FIFO configured while it is enabled (10.5.10)")
            self.fcr = value & 0x87 | self.fcr & 0x38
        elif self.cr & 1:
            # with two buffers the one that is not in use may change; the chip leaves the other as it is (10.5.8)
            if not self.cr & TWO_BUFFERS or offset not in (0x0C, 0x10):
                raise Forbidden(f"{self.name()} written at {offset:#x} while it is enabled")
            if (offset == 0x0C) == bool(self.cr & SECOND):
                setattr(self, {0x0C: "m0ar", 0x10: "m1ar"}[offset], value)
        elif offset in (0x04, 0x08, 0x0C, 0x10):
            setattr(self, {0x04: "ndtr", 0x08: "par", 0x0C: "m0ar", 0x10: "m1ar"}[offset], value & 0xFFFF if offset == 0x04 else value)

    def control(self, value):
        was = self.cr
        if was & 1 and value & 1:
            if (value ^ was) & ~0x1F:  # interrupts may change
                raise Forbidden(f"{self.name()} configured while it is enabled (10.5.5)")
            self.cr = value
        elif was & 1:
            self.cr = was & ~0x1F | value & 0x1E  # the rest is protected in the write that clears EN
            self.flags |= TCIF  # 10.3.12: flushed
        else:
            self.cr = value
            if value & 1:
                self.enable()

    def enable(self):
        if self.flags & (TCIF | TEIF):
            raise Forbidden(f"{self.name()} enabled with flags {self.flags:#x} (10.3.17)")
        if self.fcr >> 2 & 1 or self.cr >> 11 & 0xF or self.cr >> 21 & 0xF:
            raise Forbidden(f"{self.name()}: FIFO, words or bursts, which this model does not have")
        for buffer in [self.m0ar] + [self.m1ar] * bool(self.cr & TWO_BUFFERS):
            if not (self.ndtr and SRAM[0] <= buffer and buffer + self.ndtr <= SRAM[0] + SRAM[1]):
                raise Forbidden(f"{self.name()}: {self.ndtr} bytes at {buffer:#x}")
        self.whole, self.at = self.ndtr, self.buffer()

    def buffer(self):
        return self.m1ar if self.cr & TWO_BUFFERS and self.cr & SECOND else self.m0ar

    def read(self, offset):
        return {0x00: self.cr, 0x04: self.ndtr, 0x08: self.par, 0x0C: self.m0ar, 0x10: self.m1ar, 0x14: self.fcr}.get(offset, 0)

    def serves(self, data, outwards, channel=None):
        """Whether a request of a peripheral reaches the stream: it is enabled, and its channel, direction and address are right."""
        if not self.cr & 1 or self.cr >> 25 & 7 != (self.CHANNEL if channel is None else channel):
            return False
        if self.cr >> 6 & 3 != int(outwards) or self.par != data or not self.cr >> 10 & 1 or self.cr >> 9 & 1:
            raise Forbidden(f"{self.name()} is not set up for this line: {self.cr:#x}, {self.par:#x}")
        return True

    def moved(self):
        """Address of the next byte. The half and the end set flags; circular and with two buffers it goes on (10.3.8, 10.3.9)."""
        place, self.at, self.ndtr = self.at, self.at + 1, self.ndtr - 1
        if self.ndtr == self.whole - self.whole // 2:
            self.flags |= HTIF
        if self.ndtr == 0:
            self.ended()
        return place

    def ended(self):
        self.flags |= TCIF
        if self.cr & (CIRCULAR | TWO_BUFFERS):
            if self.cr & TWO_BUFFERS:
                self.cr ^= SECOND
            self.ndtr, self.at = self.whole, self.buffer()
        else:
            self.cr &= ~1

    def level(self):
        return bool(self.flags >> 1 & self.cr & 0x1C)  # TC, HT and TE lie one above their enables


class Registers:
    """The registers of a controller besides its streams: the flags of all streams, and how they are cleared."""

    def __init__(self, chip, controller):
        self.streams = [chip.streams[controller, number] for number in range(8)]

    def half(self, offset):
        return self.streams[4 * (offset >> 2 & 1) :][:4]

    def read(self, offset):
        return sum(stream.flags << SHIFT[n] for n, stream in enumerate(self.half(offset))) if offset < 8 else 0

    def write(self, offset, value):
        if offset in (0x08, 0x0C):
            for n, stream in enumerate(self.half(offset)):
                stream.flags &= ~(value >> SHIFT[n] & FLAGS)
