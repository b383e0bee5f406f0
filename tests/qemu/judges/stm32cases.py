"""A case of `stm32-cases` (`tests/chip`) on the STM32F405 of stm32f405.py, which answers its semihosting calls as `probe-rs run` does.

Lines in half-duplex mode receive what they send (RM0090 30.3.10); their transmitter must be pulled up. A call for the time takes 10 ms, as with a probe.

Standard input, JSON: {"image": path, "case": address of its entry, "chip": {arguments of Chip}, "flash": [[address, hex], ...] what is in flash beside the image,
"break": a mutant of stm32broken.py or null}. Standard output: what the case says, then "exit CODE", or "wrong TEXT": what ended the run.
"""
import json
import struct
import sys

import stm32broken
from stm32f405 import CORE, Chip, Forbidden, arm

OPEN, CLOSE, WRITE, TIME, COMMAND_LINE, EXIT, EXIT_EXTENDED = 1, 2, 5, 0x11, 0x15, 0x18, 0x20
APPLICATION_EXIT, BREAKPOINT = 0x20026, 7  # the latter is Unicorn's number of the exception
TRANSMITTERS = {"sensor": (0x4002_040C, 6), "navigation": (0x4002_000C, 2), "gnss": (0x4002_040C, 10), "command": (0x4002_000C, 0)}
LONGEST = 60 * CORE  # probe-rs gives a case a minute


class Ended(Exception):
    pass


class Probed(Chip):
    def __init__(self, asked):
        self.line, self.called, self.said = f"run_addr {asked['case']}", False, ""
        super().__init__(asked["image"], **asked.get("chip", {}))
        for address, text in asked.get("flash", []):
            self.cpu.mem_write(address, bytes.fromhex(text))

    def exception(self, cpu, number, _):
        if number != BREAKPOINT:
            return super().exception(cpu, number, _)
        self.called = True
        cpu.emu_stop()

    def execute(self, instructions):
        super().execute(instructions)
        if self.called:
            self.called = False
            self.cpu.reg_write(arm.UC_ARM_REG_R0, self.answer(*(self.cpu.reg_read(r) for r in (arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1))))
            self.pc += 2

    def answer(self, call, at):
        words = struct.unpack("<3I", self.cpu.mem_read(at, 12)) if call in (WRITE, COMMAND_LINE, EXIT_EXTENDED) else ()
        if call == TIME:
            self.stall(CORE // 100)
            return int(self.cycles / CORE)
        if call == COMMAND_LINE:
            self.cpu.mem_write(words[0], self.line.encode() + b"\0")
            self.cpu.mem_write(at + 4, len(self.line).to_bytes(4, "little"))
        elif call == WRITE:
            self.said += self.cpu.mem_read(*words[1:]).decode()
        elif call == EXIT_EXTENDED:
            raise Ended(words[1] if words[0] == APPLICATION_EXIT else 1)
        elif call == EXIT:
            raise Ended(int(at != APPLICATION_EXIT))
        elif call not in (OPEN, CLOSE):
            raise Forbidden(f"semihosting call {call:#x}")
        return int(call == OPEN)

    def byte_left(self, uart):
        pull, pin = TRANSMITTERS[uart.name]
        if uart.cr3 >> 3 & 1 and self.registers.get(pull, 0) >> 2 * pin & 3 == 1:
            uart.arrivals.append((uart.sends_until, uart.sent[-1]))


def main():
    asked = json.load(sys.stdin)
    stm32broken.break_model(asked.get("break"))
    chip, end = Probed(asked), "wrong no end"
    try:
        chip.run(LONGEST)
    except Ended as code:
        end = f"exit {code}"
    except Forbidden as what:
        end = f"wrong {what}"
    print(chip.said + end)


if __name__ == "__main__":
    main()
