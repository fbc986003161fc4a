"""simavr, a second emulator of AVR: programs that start from reset and print over the serial port."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from tests.support.bundles import place
from tests.support.shell import shell
from tests.support.tools import require

PRINTING: Final = """
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

unsigned long run(void);

int main(void)
{
    const unsigned long answer = run();
    int bit;

    UCSR0B = (1U << TXEN0);
    for (bit = 28; bit >= 0; bit -= 4) {
        while ((UCSR0A & (1U << UDRE0)) == 0U) { }
        UDR0 = (unsigned char)"0123456789ABCDEF"[(answer >> bit) & 15U];
    }
    UDR0 = (unsigned char)'\\n';
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}
"""
"""A main program that prints what run() returns; simavr ends when the core sleeps without interrupts."""


def run_in_simavr(files: Mapping[str, str], optimisation: str, folder: Path) -> int:
    """Build the C in the root of `files` {path: text} for an ATmega2560; returns what run() returns there."""
    require("avr-gcc", "gcc-avr and avr-libc")
    place(dict(files) | {"simavr_main.c": PRINTING}, folder)
    sources = sorted(path.name for path in folder.glob("*.c"))
    flags = [*COMPILE_FLAGS, "-mmcu=atmega2560", optimisation, "-I."]
    shell("avr-gcc", *flags, *sources, "-o", "program.elf", folder=folder)
    require("simavr", "simavr")
    printed = shell("sh", "-c", "simavr -m atmega2560 -f 16000000 program.elf 2>&1", folder=folder)
    answer = re.search(r"\x1b\[32m([0-9A-F]{8})\.", printed)  # in green, with a point for the end of the line
    assert answer, printed
    return int(answer[1], 16)
