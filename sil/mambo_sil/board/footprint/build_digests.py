"""Compare the self-test digest of every available build: compilers, optimisations, boards."""

import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from mambo_codegen.boards import Board
from mambo_codegen.bundle.digest import self_test_digest
from mambo_codegen.errors import BuildError, echo
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_sil.board.emulated import build_guest, digest_emulated
from mambo_sil.board.firmware.firmware_build import OPTIMISATIONS, Builder, builder, clang_builder
from mambo_sil.errors import EmulatorError
from mambo_sil.flight.controllers.compiled import digest_compiled
from mambo_sil.flight.controllers.controller_library import build_library
from mambo_sil.results.build_folders import scratch_folder
from mambo_sil.results.terminal import sentence, table

HOST_COMPILERS: Final = ("gcc", "clang")
BOARD_COMPILERS: Final[dict[str, Callable[[Board, str], Builder]]] = {"gcc": builder, "clang": clang_builder}
REFERENCE: Final = "reference"


@dataclass(frozen=True)
class BuildDigest:
    """The digest of one build as a C literal; None if it could not run, for `reason`."""

    where: str
    compiler: str
    optimisation: str
    digest: str | None
    reason: str = ""


def run_everywhere(settings: Settings, boards: Sequence[Board], episodes: int) -> Iterator[BuildDigest]:
    """Yield the digest of the reference, then of every build for this machine and for `boards`."""
    yield reference_digest(settings, episodes)
    for name in HOST_COMPILERS:
        for optimisation in OPTIMISATIONS:
            yield _on_host(settings, name, optimisation, episodes)
    for board in boards:
        for name in BOARD_COMPILERS:
            for optimisation in OPTIMISATIONS:
                yield _on_board(settings, board, name, optimisation, episodes)


def reference_digest(settings: Settings, episodes: int) -> BuildDigest:
    """Return the digest of the reference, with which all others are compared."""
    return BuildDigest(REFERENCE, "NumPy", "", digest_text(self_test_digest(method_of(settings), episodes)))


def count_builds(boards: Sequence[Board]) -> int:
    """Return the number of digests that `run_everywhere` yields."""
    return 1 + len(OPTIMISATIONS) * (len(HOST_COMPILERS) + len(BOARD_COMPILERS) * len(boards))


def builds_text(builds: Sequence[BuildDigest], source: str, steps: int) -> str:
    """Return digests as text: the answer, then a row for each build; the first one is the reference."""
    reference = builds[0].digest
    ran = [one for one in builds[1:] if one.digest is not None]
    other = sum(one.digest != reference for one in ran)
    found = f"OTHER BITS in {other}" if other else f"the bits of the reference in {len(ran)}"
    said = f"{echo(source)}: {found} of {len(ran)} builds, over {steps} self-test steps"
    if len(ran) < len(builds) - 1:
        said += f"; {len(builds) - 1 - len(ran)} builds not run"
    rows = [
        (
            one.where,
            one.compiler,
            one.optimisation,
            one.reason if one.digest is None else one.digest,
            "" if one.digest in (None, reference) else "DIFFERS",
        )
        for one in builds
    ]
    heads = ("build for", "compiler", "flag", "self-test digest", "")
    return "\n".join([sentence(said), "", *table(heads, rows, range(len(heads)))])


def _on_host(settings: Settings, compiler: str, optimisation: str, episodes: int) -> BuildDigest:
    if shutil.which(compiler) is None:
        return BuildDigest("host", compiler, optimisation, None, f"{compiler} is missing")
    library = build_library(settings, Toolchain((compiler,), optimisation))
    return BuildDigest("host", compiler, optimisation, digest_text(digest_compiled(library, episodes)))


def _on_board(
    settings: Settings, board: Board, compiler: str, optimisation: str, episodes: int
) -> BuildDigest:
    try:
        found = BOARD_COMPILERS[compiler](board, optimisation)
        with scratch_folder() as work:
            elf = build_guest(settings, found, work)
            digest = digest_emulated(settings, elf, board.emulated_core.value, episodes)
    except (BuildError, EmulatorError) as error:
        return BuildDigest(board.name, compiler, optimisation, None, str(error))
    return BuildDigest(board.name, found.toolchain.command[0], optimisation, digest_text(digest))


def digest_text(digest: int) -> str:
    """Return a digest as a C literal."""
    return f"0x{digest:08X}"
