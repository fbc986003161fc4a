"""Small programs for boards, without start-up code."""

import json
from dataclasses import replace
from pathlib import Path

from mambo_codegen.bundle.render import render
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.board import emulated
from mambo_sil.board.firmware.firmware_build import Builder
from mambo_sil.flight.controllers.controller_library import batch_source
from tests.support.one_norm import ONE_NORM
from tests.support.tools import board_builder

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
