"""Small programs for boards, without start-up code; and for simavr, another emulator of AVR, from reset."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.board import emulated
from mambo_sil.board.firmware.firmware_build import Builder
from mambo_sil.flight.controllers.controller_library import batch_source
from tests.support.bundles import place
from tests.support.one_norm import ONE_NORM
from tests.support.shell import shell
from tests.support.tools import board_builder, require

GUEST = """
#include "nmpc_self_test.h"
nmpc_t nmpc_instance;
nmpc_state_t state;
nmpc_target_t target;
nmpc_real_t thrust;
nmpc_command_t command;
long run(void);
long fly(void);
long run(void) { return nmpc_self_test(&nmpc_instance); }
long fly(void) { return nmpc_step(&nmpc_instance, &state, &target, thrust, &command); }
"""
"""A program that runs the self-test, or one step from variables."""


def builder_with(board: str, *flags: str) -> Builder:
    """Return the builder of a board that also passes `flags` to the compiler."""
    found = board_builder(board)
    return replace(found, own_flags=(*found.own_flags, *flags))


def link(board: str, text: str, folder: Path, *flags: str, keep: tuple[str, ...] = ("run",)) -> Path:
    """Compile and link `text`, C with the functions `keep`, for a board."""
    return builder_with(board, *flags).guest({}, text, keep, folder)


def link_step(name: str, assembly: str, folder: Path) -> Path:
    """Build a program for a board in which the function nmpc_known of the assembly takes the step's place."""
    declared = (
        '#include "nmpc.h"\nnmpc_status_t nmpc_known(nmpc_t *self, const nmpc_state_t *state,'
        "const nmpc_target_t *target, nmpc_real_t thrust, nmpc_command_t *command);\n"
        f"__asm({json.dumps(assembly)});\n"
    )
    glue = batch_source()
    assert glue.count("nmpc_step(") == 2, "with a height, and without"
    stepped = glue.replace("nmpc_step(", "nmpc_known(")
    files = render(ONE_NORM, with_digest=False)
    return board_builder(name).guest(files, declared + stepped, emulated.GUEST, folder)


def link_controller(board: str, folder: Path, *flags: str, scalar: str = "float32") -> Path:
    """Link GUEST with the controller of preset mambo; gcc's frame sizes are written beside the program."""
    files = render(with_option(ONE_NORM, "code.scalar", scalar), with_digest=False)
    return builder_with(board, "-fstack-usage", *flags).guest(files, GUEST, ("run", "fly"), folder)


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
