"""Mutants of the chip model: each has one plausible mistake. `tests/chip.rs` asserts which drivers notice."""
import stm32dma
import stm32f405
import stm32more
import stm32parts
import stm32spi


def count_too_high():
    """A stream's NDTR is too large by one."""
    read = stm32dma.Stream.read
    stm32dma.Stream.read = lambda self, offset: read(self, offset) + (offset == 0x04 and self.ndtr > 0)


def no_wrap():
    """A circular stream, or one with two buffers, stops at its end."""
    stm32dma.CIRCULAR = stm32dma.TWO_BUFFERS = 0


def no_fraction():
    """The fraction of the bit rate's divider is 0."""
    stm32f405.Uart.divider = lambda self: self.brr & ~0xF


def no_idle():
    """A line is never idle."""
    stm32f405.IDLE = 0


def complete_early():
    """Transmission is complete when the byte begins."""
    step = stm32f405.Uart.step

    def early(self, now):
        step(self, now)
        if self.shifting is not None and self.waiting is None:
            self.sr |= stm32f405.TC

    stm32f405.Uart.step = early


def pll_by_four():
    """The PLL's output is half as fast."""
    divided = stm32parts.Rcc.divided_by
    stm32parts.Rcc.divided_by = lambda self: 2 * divided(self)


def timers_at_bus():
    """Timers do not have twice the clock of a divided bus."""
    derive = stm32parts.Rcc.derive

    def slow(self):
        derive(self)
        self.timers1, self.timers2 = self.apb1, self.apb2

    stm32parts.Rcc.derive = slow


def no_erase():
    """A sector keeps its content when it is erased."""
    stm32parts.Flash.BLANK = None


def dog_fast():
    """The independent watchdog is twice as fast."""
    period = stm32parts.Iwdg.period
    stm32parts.Iwdg.period = lambda self: period(self) / 2


def window_open():
    """The window watchdog may be fed at any time."""
    count = stm32parts.Wwdg.count
    stm32parts.Wwdg.count = lambda self: min(count(self), self.cfr & 0x7F)


def calendar_slow():
    """The calendar's asynchronous prescaler divides by one too many."""
    ticks = stm32more.Rtc.ticks
    stm32more.Rtc.ticks = lambda self: ticks(self) * ((self.domain.prer >> 16 & 0x7F) + 1) // ((self.domain.prer >> 16 & 0x7F) + 2)


def byte_late():
    """A byte leaves the SPI only with the next one."""
    shift = stm32spi.Spi.shift

    def late(self, byte, at):
        before = self.exchanged or 0
        shift(self, byte, at)
        self.kept, self.exchanged = self.exchanged, getattr(self, "kept", before)

    stm32spi.Spi.shift = late


def dma_leaves_byte():
    """A byte that the DMA has read from the SPI stays in its register."""
    request = stm32spi.Spi.request

    def leaves(self):
        came = self.came
        request(self)
        self.came = came if self.cr2 & 1 else self.came

    stm32spi.Spi.request = leaves


def supply_always_good():
    """The supply voltage detector never reports a low supply."""
    stm32parts.Power.low = lambda self: False


MUTANTS = {
    "dma-count": count_too_high,
    "dma-no-wrap": no_wrap,
    "uart-no-fraction": no_fraction,
    "uart-no-idle": no_idle,
    "uart-complete-early": complete_early,
    "clock-pll": pll_by_four,
    "clock-timers": timers_at_bus,
    "flash-no-erase": no_erase,
    "watchdog-fast": dog_fast,
    "watchdog-window": window_open,
    "calendar-slow": calendar_slow,
    "spi-late": byte_late,
    "spi-dma-leaves": dma_leaves_byte,
    "supply-good": supply_always_good,
}


def break_model(name):
    """Breaks the model for the rest of the process; `None` leaves it whole."""
    if name:
        MUTANTS[name]()
