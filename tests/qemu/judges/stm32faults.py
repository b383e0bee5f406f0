"""The STM32F405 of stm32f405.py with faults: wrong or dead crystals, a stuck loop, a runaway interrupt, a stuck output, a stack overflow, a low supply.

The board's image runs from power-on, through its resets, while a sensor sends bytes without an end. RAM holds garbage at power-on and survives resets.

Standard input, JSON: {"image": path, "ms": how long, "chip": {arguments of Chip}, "baud": {"sensor": bit/s ...} of the other ends, "faults": [[ms, name,
argument], ...], "ask": [[ms, hex], ...] requests on the command link, "quiet": [from ms, to ms] without sensor bytes, "every ms": time between 28 bytes, 2, "flash": [[address, hex], ...] what is
in flash beside the image, "seed": number, "break": a mutant of stm32broken.py}.
A fault of "every start" comes so many ms after each start.

Standard output: "start MS CAUSES FIRST EXACT BYTES": when, RCC_CSR's flags, ms until the first byte has passed (- if none), whether what has passed until
the next start is a piece of what the sensor has sent; "command HEX", "line NAME DIVIDER OVER8 GARBLED_IN GARBLED_OUT", "clock HZ", "now US" of the
world, "interrupts", "erased", "writes", "why TEXT" of resets.
"""
import json
import random
import sys

from unicorn import UC_HOOK_MEM_INVALID, UcError
from unicorn import arm_const as arm

import stm32f405
from stm32f405 import CCM, CORE, FLASH, SLICE, SRAM, Chip, Forbidden
from stm32dma import TEIF
from stm32parts import BROWN_OUT, PIN, POWER_ON, SOFTWARE

MS = CORE // 1000
HARD_FAULT, NMI = 3, 2


class Restart(Exception):
    pass


class Faulty(Chip):
    def __init__(self, asked):
        self.starts, self.why, self.cause, self.frozen, self.runaway, self.in_fault = [], [], None, False, None, False
        self.fault_address, self.offset_sent = 0, 0
        self.every = [(ms, name, argument) for ms, name, argument in asked.get("every start", [])]
        super().__init__(asked["image"], **asked.get("chip", {}))
        noise = random.Random(asked.get("seed", 1))
        self.cpu.mem_write(SRAM[0], noise.randbytes(SRAM[1]))
        for address, text in asked.get("flash", []):
            self.cpu.mem_write(address, bytes.fromhex(text))
        self.cpu.hook_add(UC_HOOK_MEM_INVALID, self.invalid)
        self.began(POWER_ON | PIN | BROWN_OUT)

    # Resets

    def began(self, causes):
        navigation = self.uarts["navigation"]
        self.start = {"at": self.cycles, "causes": causes, "first": None, "from": len(navigation.sent)}
        self.starts.append(self.start)
        self.faults = [(self.cycles + ms * MS, name, argument) for ms, name, argument in self.every]

    def restart(self, cause, why=""):
        self.cause = SOFTWARE if cause is None else cause
        self.why.append(f"{self.cycles / MS:.1f} ms {why or hex(self.cause)}")
        self.cpu.emu_stop()

    def again(self):
        """The reset itself: peripherals and core restart, RAM and the other ends of the lines keep their state."""
        flags, self.cause = self.rcc.flags | self.cause | PIN, None
        self.power_up(flags)
        self.frozen = self.in_fault = False
        stack, self.pc = (int.from_bytes(self.cpu.mem_read(FLASH[0] + n, 4), "little") for n in (0, 4))
        for register in (arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_FAULTMASK, arm.UC_ARM_REG_BASEPRI, arm.UC_ARM_REG_CONTROL, arm.UC_ARM_REG_IPSR):
            self.cpu.reg_write(register, 0)
        self.cpu.reg_write(arm.UC_ARM_REG_SP, stack)
        self.cpu.reg_write(arm.UC_ARM_REG_LR, 0xFFFF_FFFF)
        self.began(flags)

    def byte_left(self, uart):
        if uart.name == "navigation" and self.start["first"] is None:
            self.start["first"] = self.cycles

    # Faults of the core

    def invalid(self, _, __, address, *___):
        self.fault_address = address
        return False

    def enter(self, exception):
        """An exception that does not return."""
        self.cpu.reg_write(arm.UC_ARM_REG_SP, self.stacked(self.pc))
        self.cpu.reg_write(arm.UC_ARM_REG_LR, 0xFFFF_FFF9)
        self.cpu.reg_write(arm.UC_ARM_REG_PRIMASK, 0)
        self.pc = int.from_bytes(self.cpu.mem_read(FLASH[0] + 4 * exception, 4), "little") & ~1
        self.running = -1
        while True:
            self.execute(SLICE)

    def entered(self, pc):
        self.cpu.reg_write(arm.UC_ARM_REG_SP, self.stacked(pc))

    def stacked(self, pc):
        """Writes the frame of an exception, as far as the stack can take it (Armv7-M B1.5.6)."""
        get = self.cpu.reg_read
        sp = get(arm.UC_ARM_REG_SP) - 32 & ~7
        frame = [get(r) for r in (arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12, arm.UC_ARM_REG_LR)]
        frame += [pc, get(arm.UC_ARM_REG_XPSR)]
        if SRAM[0] <= sp and sp + 32 <= SRAM[0] + SRAM[1]:
            self.cpu.mem_write(sp, b"".join(word.to_bytes(4, "little") for word in frame))
        return sp

    def execute(self, instructions):
        if self.frozen:  # locked up
            return self.advanced(instructions)
        self.returned = self.asleep = False
        try:
            self.cpu.emu_start(self.pc | 1, 0, count=instructions)
        except UcError:
            self.broken = self.broken or "fault"
        self.pc = self.read(arm.UC_ARM_REG_PC)
        if self.cause is not None:
            raise Restart
        if self.broken and (self.broken == "fault" or self.broken.startswith("exception")):
            self.broken = None
            if self.in_fault:
                self.why.append(f"{self.cycles / MS:.1f} ms lockup")
                self.frozen = True
            else:
                self.in_fault = True
                self.enter(HARD_FAULT)
        if self.broken:
            raise Forbidden(self.broken)
        self.advanced(instructions)

    def advanced(self, instructions):
        self.advance(instructions * self.rcc.cost)
        if self.cause is not None:
            raise Restart
        self.inject()

    def core_read(self, cpu, offset, size, data):
        known = {0xED28: 0x8200 * self.in_fault, 0xED2C: self.in_fault << 30, 0xED38: self.fault_address}
        return known.get(offset, 0) or super().core_read(cpu, offset, size, data)

    def interrupt(self, below=256):
        if 0 in self.pending and self.next_interrupt(below) == 0:  # the window watchdog's does not return
            self.pending.discard(0)
            self.served[0] += 1
            self.enter(16)
        return super().interrupt(below)

    # Injected faults

    def inject(self):
        if not any(fault[0] <= self.cycles for fault in self.faults):
            return
        due = [fault for fault in self.faults if fault[0] <= self.cycles]
        self.faults = [fault for fault in self.faults if fault[0] > self.cycles]
        for at, name, argument in due:
            getattr(self, "make_" + name)(argument)
            self.changed = True

    def make_hang(self, masked):
        """The program enters a loop: the default handler's."""
        self.pc = int.from_bytes(self.cpu.mem_read(FLASH[0] + 4 * (16 + 1), 4), "little") & ~1
        self.cpu.reg_write(arm.UC_ARM_REG_PC, self.pc)
        self.cpu.reg_write(arm.UC_ARM_REG_PRIMASK, int(bool(masked)))

    def make_storm(self, number):
        """An interrupt whose cause does not go away."""
        self.runaway = number
        self.enabled.add(number)

    def make_endless(self, number):
        """An interrupt whose handler does not end, until the next start."""
        vector = FLASH[0] + 4 * (16 + number)
        self.patched = (vector, bytes(self.cpu.mem_read(vector, 4)))
        self.cpu.mem_write(vector, bytes(self.cpu.mem_read(FLASH[0] + 4 * (16 + 1), 4)))
        self.enabled.add(number)
        self.pending.add(number)

    def make_stuck(self, for_good):
        """The navigation line's transmitter accepts no more bytes, until it is switched off, or for good."""
        self.uarts["navigation"].stuck = "for good" if for_good else True

    def make_deaf(self, _):
        """The stream of the sensor's bytes stops, though the program has not switched it off."""
        self.streams[2, 2].cr &= ~1

    def make_crystal(self, _):
        """The crystal stops and does not start again."""
        self.dead_crystal = True
        if self.rcc.stop_crystal():
            self.enter(NMI)

    def make_overflow(self, left):
        """The program enters an endless recursion: push {r0-r7, lr}; b back. The ninth push fails, with so many bytes of the stack left."""
        self.cpu.reg_write(arm.UC_ARM_REG_SP, SRAM[0] + 8 * 36 + left)
        self.pc = FLASH[0] + 0xB_FF00  # nothing else is there
        self.cpu.mem_write(self.pc, bytes.fromhex("ffb5fde7"))
        self.cpu.reg_write(arm.UC_ARM_REG_PC, self.pc)

    def make_wild(self, address):
        """The program jumps to an address without code."""
        self.pc = address
        self.cpu.reg_write(arm.UC_ARM_REG_PC, address)

    def make_volts(self, volts):
        self.volts = self.power.volts = volts

    def make_tim5(self, speed):
        """The counter of microseconds of a board over embassy-stm32 runs faster by this factor."""
        timer = self.tim5
        timer.look()
        timer.psc = (timer.psc + 1) // speed - 1
        timer.since = self.cycles - timer.cycles(timer.seen)

    def make_torn(self, _):
        """The stream of the sensor's bytes reports a bus error (10.3.18), at which embassy-stm32 panics."""
        self.streams[2, 2].flags |= TEIF

    def make_tim2(self, speed):
        """The counter of microseconds runs at another speed."""
        self.tim2.look()
        self.tim2.speed = speed
        self.tim2.look()

    def settle(self):
        super().settle()
        if self.runaway is not None:
            self.pending.add(self.runaway)

    def advance(self, cycles):
        super().advance(cycles)
        if self.runaway is not None:
            self.pending.add(self.runaway)

    def power_up(self, flags):
        old = self.uarts.get("navigation")
        super().power_up(flags)
        self.runaway, patched, self.patched = None, getattr(self, "patched", None), None
        if patched:
            self.cpu.mem_write(*patched)
        if old and old.stuck == "for good":
            self.uarts["navigation"].stuck = old.stuck
        uart = self.uarts["navigation"]
        write = uart.write

        def watched(offset, value):
            if offset == 0x0C and not value >> 13 & 1 and uart.stuck is True:
                uart.stuck = False
            write(offset, value)

        uart.write = watched


def run(chip, until):
    while chip.cycles < until:
        try:
            while chip.cycles < until and chip.waits() and chip.interrupt():
                pass
            chip.execute(SLICE)
            if chip.asleep:
                chip.pc += 2
                sleeps = chip.sleeps()
                while sleeps and not chip.waits() and chip.cycles < until:
                    chip.advance(max(chip.next_event(min([until, *(at for at, *_ in chip.faults)])) - chip.cycles, 1))
                    if chip.cause is not None:
                        raise Restart
                    chip.inject()
        except Restart:
            chip.again()


def main():
    asked = json.load(sys.stdin)
    if asked.get("break"):
        import stm32broken

        stm32broken.break_model(asked["break"])
    chip = Faulty(asked)
    baud = {"sensor": 921_600, "navigation": 921_600, "gnss": 115_200, "command": 921_600} | asked.get("baud", {})
    for name, line in chip.uarts.items():
        line.peer = baud[name]
    end = asked["ms"] * MS
    # 28 bytes in two milliseconds, no two positions of the stream alike
    noise, byte = random.Random(asked.get("seed", 1) + 1), CORE * 10 / baud["sensor"]
    quiet = asked.get("quiet", [0, 0])
    stream = bytearray()
    for ms in range(0, asked["ms"], asked.get("every ms", 2)):
        if not quiet[0] <= ms < quiet[1]:
            frame = noise.randbytes(28)
            chip.uarts["sensor"].arrivals.extend((ms * MS + byte * (n + 1), b) for n, b in enumerate(frame))
            stream += frame
    chip.faults += [(at * MS, name, argument) for at, name, argument in asked.get("faults", [])]
    byte = CORE * 10 / baud["command"]
    asks = sorted(asked.get("ask", []))
    for ms, text in asks:
        chip.uarts["command"].arrivals.extend((ms * MS + byte * (n + 1), b) for n, b in enumerate(bytes.fromhex(text)))
    later = [fault for fault in chip.faults if fault[0] > 0]
    run_all(chip, later, end)
    sent = chip.uarts["navigation"].sent
    for n, start in enumerate(chip.starts):
        to = chip.starts[n + 1]["from"] if n + 1 < len(chip.starts) else len(sent)
        piece = bytes(sent[start["from"] : to])
        first = "-" if start["first"] is None else f"{(start['first'] - start['at']) / MS:.2f}"
        print("start", f"{start['at'] / MS:.1f}", hex(start["causes"]), first, piece in bytes(stream), len(piece))
    print("command", chip.uarts["command"].sent.hex())
    for name, line in chip.uarts.items():
        print("line", name, line.divider(), line.cr1 >> 15 & 1, *line.garbled)
    print("clock", round(chip.rcc.core))
    print("now", round(chip.cycles * 1000 / MS))
    print("interrupts", *(f"{number}:{count}" for number, count in sorted(chip.served.items())))
    print("erased", *chip.flash.erased)
    print("writes", chip.flash.writes)
    for text in chip.why:
        print("why", text)


def run_all(chip, faults, end):
    """Faults at an absolute time remain when the chip restarts."""
    begun = chip.began

    def began(causes):
        pending = [fault for fault in chip.faults if fault[0] > chip.cycles and fault in faults]
        begun(causes)
        chip.faults += pending

    chip.began = began
    run(chip, end)


if __name__ == "__main__":
    main()
