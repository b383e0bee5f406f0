"""TIM5 as a counter with two compare channels: the clock of other firmware and its wake-ups (RM0090 section 18; only what they use)."""
from stm32parts import CORE, Forbidden

UIF, CC1, CC2 = 1, 2, 4


class Tim5:
    BASE, interrupt = 0x4000_0C00, 50

    def __init__(self, chip):
        self.chip, self.registers, self.sr, self.psc = chip, {0x2C: 0xFFFF_FFFF}, 0, 0
        self.since, self.seen = None, 0  # the cycle at which the count was 0; ticks looked at

    def cycles(self, ticks):
        return ticks * (self.psc + 1) * CORE / self.chip.rcc.timers1

    def ticks(self):
        if self.since is None:
            return self.seen
        return int((self.chip.cycles - self.since) * self.chip.rcc.timers1 / CORE / (self.psc + 1) + 1e-6)

    def read(self, offset):
        self.look()
        if offset == 0x10:
            return self.sr
        if offset == 0x24:
            return self.ticks() % self.turn()
        return self.registers.get(offset, 0)

    def write(self, offset, value):
        if not self.chip.rcc.read(0x40) >> 3 & 1:
            raise Forbidden("TIM5 without its clock")
        self.look()
        if offset == 0x10:
            self.sr &= value
        elif offset == 0x14 and value & 1:  # the prescaler is taken over, and the count begins
            self.psc, self.seen = self.registers.get(0x28, 0), 0
            self.since = self.since and self.chip.cycles
            self.sr |= 0 if self.registers.get(0, 0) & 4 else UIF  # URS
        elif offset == 0x24:
            if value or self.since is not None:
                raise Forbidden("TIM5: the count is set while it runs, which is not modelled")
            self.seen = 0
        else:
            if offset == 0x2C and self.since is not None and value != self.registers[0x2C]:
                raise Forbidden("TIM5: its period changes while it runs, which is not modelled")
            self.registers[offset] = value
            if offset == 0x00 and value & 1 and self.since is None:
                self.since = self.chip.cycles - self.cycles(self.seen)

    def turn(self):
        return self.registers[0x2C] + 1

    def points(self):
        return (UIF, 0), (CC1, self.registers.get(0x34, 0)), (CC2, self.registers.get(0x38, 0))

    def look(self):
        if self.since is None:
            return
        now, turn = self.ticks(), self.turn()
        for flag, at in self.points():
            if (now - at) // turn > (self.seen - at) // turn:
                self.sr |= flag
        self.seen = now

    def level(self):
        return bool(self.sr & self.registers.get(0x0C, 0) & (UIF | CC1 | CC2))

    def next_event(self):
        enabled = [at for flag, at in self.points() if self.registers.get(0x0C, 0) & flag]
        if self.since is None or not enabled:
            return None
        ahead = min((at - self.seen - 1) % self.turn() + 1 for at in enabled)
        return self.since + self.cycles(self.seen + ahead) + 1
