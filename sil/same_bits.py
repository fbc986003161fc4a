"""Same bits: the digest of the same frozen steps from every build at hand."""

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from codegen.boards import Board
from codegen.errors import BuildError
from codegen.footprint.build import OPTIMISATIONS, builder
from codegen.reference import ReferenceController
from codegen.settings import Settings
from codegen.toolchain import Toolchain
from sil.compiled import CompiledController, compiled
from sil.emulated import EmulatedController, build_guest
from sil.frozen import TOGETHER, frozen_digest
from sil.machine import CORES

HOST_COMPILERS: Final = ("gcc", "clang")
REFERENCE: Final = "reference"


@dataclass(frozen=True)
class BuildDigest:
    """The digest of one build; None, and why, where there is none."""

    where: str
    compiler: str
    optimisation: str
    digest: str | None
    reason: str = ""


def same_bits(settings: Settings, boards: Sequence[Board], steps: int) -> Iterator[BuildDigest]:
    """Yield the digest of the reference first, then of every build on this machine and on `boards`."""
    yield BuildDigest(
        REFERENCE, "NumPy", "", frozen_digest(settings, ReferenceController(settings, TOGETHER), steps)
    )
    for name in HOST_COMPILERS:
        for optimisation in OPTIMISATIONS:
            yield _on_host(settings, name, optimisation, steps)
    for board in boards:
        for optimisation in OPTIMISATIONS:
            yield _on_board(settings, board, optimisation, steps)


def builds(boards: Sequence[Board]) -> int:
    """Count what `same_bits` yields."""
    return 1 + len(OPTIMISATIONS) * (len(HOST_COMPILERS) + len(boards))


def _on_host(settings: Settings, compiler: str, optimisation: str, steps: int) -> BuildDigest:
    if shutil.which(compiler) is None:
        return BuildDigest("host", compiler, optimisation, None, f"{compiler} is not here")
    extension = compiled(settings, Toolchain((compiler,), optimisation))
    controller = CompiledController(settings, TOGETHER, extension)
    return BuildDigest("host", compiler, optimisation, frozen_digest(settings, controller, steps))


def _on_board(settings: Settings, board: Board, optimisation: str, steps: int) -> BuildDigest:
    core = board.emulated_core.value
    if core not in CORES:
        return BuildDigest(board.name, "", optimisation, None, f"{core} is not emulated here")
    try:
        found = builder(board, optimisation)
    except BuildError as error:
        return BuildDigest(board.name, "", optimisation, None, str(error))
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as work:
        controller = EmulatedController(settings, build_guest(settings, found, Path(work)), core, TOGETHER)
    command = found.toolchain.command[0]
    return BuildDigest(board.name, command, optimisation, frozen_digest(settings, controller, steps))
