"""Programs over third-party drivers on the STM32F405 of stm32f405.py, one after the other: docs/BOARDS.md.

Standard input, JSON: {"break": name of a mutant in stm32broken.py or null, "runs": [{"image": path, "subject": number, "variant": number, "ms": how long at
most, "chip": {arguments of Chip}, "line": [[us, hex], ...] bytes at USART1 at 921 600 bit/s after the program's first mark, "volts": [[ms, volts], ...],
"adis": as for stm32f405.py}, ...]}.

Standard output, for each run: "run NUMBER", then "report PORT VALUE US" for each word that the program reports at the trace port, "start MS CAUSES" for each
start, "clock CORE APB1 APB2" in Hz, "line DIVIDER BITS SENT LAST": bytes sent, hexadecimal, and when the last stop bit ended, us; "interrupts NUMBER:COUNT ...", "wrong TEXT": what ended the run.
"""
import json
import sys

import stm32broken
from stm32f405 import CCM, CORE, FLASH, Forbidden
from stm32faults import MS, Faulty, run

US = CORE // 1_000_000
MARK, DONE, PANIC = 0, 30, 31


class Judged(Faulty):
    def __init__(self, asked):
        self.asked, self.reports, self.ended = asked, [], 0
        self.bursts = [(us * US, bytes.fromhex(text)) for us, text in asked.get("line", [])]
        super().__init__({"image": asked["image"], "chip": asked.get("chip", {}) | {"adis": asked.get("adis")}})
        self.ask()
        self.uarts["sensor"].peer = 921_600
        self.cpu.mem_write(FLASH[0] + 0xE_0000, bytes(range(256)))  # previous content of the last sector
        self.faults += [(ms * MS, "volts", volts) for ms, volts in asked.get("volts", [])]

    def ask(self):
        for n, name in enumerate(("subject", "variant")):
            self.cpu.mem_write(CCM[0] + 4 * n, self.asked.get(name, 0).to_bytes(4, "little"))

    def power_up(self, flags):
        super().power_up(flags)
        self.core.reports = self.reports  # one list over all starts

    def advanced(self, instructions):
        super().advanced(instructions)
        if self.bursts and self.reports:
            begin, byte = self.reports[0][2], CORE * 10 / 921_600
            for at, text in self.bursts:
                self.uarts["sensor"].arrivals.extend((begin + at + byte * (n + 1), value) for n, value in enumerate(text))
            self.bursts, self.changed = [], True
        if self.reports and self.reports[-1][0] in (DONE, PANIC):
            raise Ended

    def byte_left(self, uart):
        super().byte_left(uart)
        self.ended = uart.sends_until


class Ended(Exception):
    pass


def judge(number, asked):
    chip = Judged(asked)
    print("run", number)
    try:
        run(chip, asked["ms"] * MS)
        print("wrong", "no end")
    except Ended:
        pass
    except Forbidden as what:
        print("wrong", what)
    for port, value, cycle in chip.reports:
        print("report", port, value, f"{cycle / US:.2f}")
    for start in chip.starts:
        print("start", f"{start['at'] / MS:.3f}", hex(start["causes"]))
    print("clock", round(chip.rcc.core), round(chip.rcc.apb1), round(chip.rcc.apb2))
    line = chip.uarts["sensor"]
    print("line", line.divider(), line.bits(), line.sent.hex() or "-", f"{chip.ended / US:.2f}")
    print("interrupts", *(f"{number}:{count}" for number, count in sorted(chip.served.items())))


def main():
    asked = json.load(sys.stdin)
    stm32broken.break_model(asked.get("break"))
    for number, one in enumerate(asked["runs"]):
        judge(number, one)


if __name__ == "__main__":
    main()
