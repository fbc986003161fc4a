"""A board's compiler that cannot build for the board: the message says what the board demands."""

from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.board.firmware.firmware_build import Builder


def test_a_compiler_for_another_core_is_told_the_rule(tmp_path: Path) -> None:
    """Board, compiler, flags, and the package with the right one, before the compiler's words."""
    program = tmp_path / "old-gcc"
    program.write_text("#!/bin/sh\necho \"old-gcc: error: unrecognized option '-mthumb'\" >&2\nexit 1\n")
    program.chmod(0o755)
    wrong = Toolchain((str(program),))
    board = boards.load("crazyflie")
    with pytest.raises(BuildError) as caught:
        Builder(board, wrong, wrong).firmware({"src/a.c": "int a;\n"}, tmp_path)
    rule, _, words = str(caught.value).partition("\n")
    assert rule.startswith(f"{board.title}: {program} does not build for it; it must be a C99 compiler for ")
    assert " ".join(board.compiler.flags) in rule
    assert "gcc-arm-none-eabi" in rule
    assert words.endswith("unrecognized option '-mthumb'")
