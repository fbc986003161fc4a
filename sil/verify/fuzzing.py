"""Check: a coverage-guided fuzzer searches for calls that break a promise or the bits of the reference."""

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.firmware.doctor import command_version
from mambo_nmpc.sil.verify import replay
from mambo_nmpc.sil.verify.calls import Tape, answers, call_type, tape_from
from mambo_nmpc.sil.verify.cases import random_tapes
from mambo_nmpc.sil.verify.check import CheckOutcome, Result, Subject

RUNS: Final = 500_000
SEED: Final = 1
SEEDS: Final = 32
LONGEST_TAPE: Final = 12
"""Calls that the fuzzer strings together at most."""

FLAGS: Final = (
    "-g",
    "-O1",
    "-fno-sanitize-recover=all",
    "-fsanitize=fuzzer,address,undefined,float-divide-by-zero,implicit-conversion,local-bounds",
)


def check(subject: Subject, *, runs: int = RUNS) -> Result:
    """Fuzz the bundle's harness for a fixed number of runs, then replay all it kept against the reference."""
    tools = {"clang": command_version("clang") or ""}
    gap = replay.missing("clang", FLAGS, subject.folder)
    if gap:
        return Result(CheckOutcome.INCOMPLETE, gap, tools=tools)
    seeds, corpus = subject.folder / "seeds", subject.folder / "corpus"
    _write_seeds(subject.settings, seeds)
    corpus.mkdir()
    try:
        done = _fuzz(subject, runs)
    except BuildError as error:
        return Result(CheckOutcome.FAILED, f"the harness does not build: {error}", tools=tools)
    log = done.stderr.decode(errors="replace")
    (subject.folder / "fuzzer.txt").write_text(log)
    files = sorted([*seeds.iterdir(), *corpus.iterdir()])
    tapes = [tape_from(subject.settings, file.read_bytes()) for file in files]
    made = _statistic(log, "number_of_executed_units")
    figures = {
        "runs": made,
        "runs_per_second": _statistic(log, "average_exec_per_sec"),
        "seed": SEED,
        "seeds": SEEDS,
        "corpus": len(files) - SEEDS,
        "replayed_calls": sum(len(tape) for tape in tapes),
    }
    finding = _finding(subject.folder, done.returncode, log)
    if finding is None:
        finding = _beside_the_reference(subject, files, tapes)
    if finding is not None:
        return Result(CheckOutcome.FAILED, finding, figures=figures, tools=tools)
    return Result(
        CheckOutcome.PASSED,
        f"{made} runs from seed {SEED} broke no promise; {figures['replayed_calls']} calls of the "
        f"{len(files)} tapes kept have the bits of the reference",
        figures=figures,
        tools=tools,
    )


def _write_seeds(settings: Settings, folder: Path) -> None:
    """Write tapes to start from: they depend on settings and scalar type, so they are made, not kept."""
    folder.mkdir()
    for index, tape in enumerate(random_tapes(settings, SEEDS)):
        (folder / f"seed-{index:02}").write_bytes(tape.tobytes())


def _fuzz(subject: Subject, runs: int) -> "subprocess.CompletedProcess[bytes]":
    """Build and run the harness; raises BuildError."""
    bundle = subject.bundle.resolve()
    harness = bundle / "fuzz" / f"{subject.settings.code.prefix}_fuzz.c"
    units = [str(path.resolve()) for path in (harness, *replay.sources(subject))]
    Toolchain(("clang",)).run(
        [*replay.FLAGS, *FLAGS, f"-I{bundle / 'include'}", *units, "-o", "fuzz"], subject.folder
    )
    longest = LONGEST_TAPE * call_type(subject.settings).itemsize
    return subprocess.run(
        [
            "./fuzz",
            f"-runs={runs}",
            f"-seed={SEED}",
            f"-max_len={longest}",
            "-len_control=0",
            "-reload=0",
            "-use_cmp=0",  # it remembers what was compared, addresses among it: another run, another corpus
            "-timeout=20",
            "-print_final_stats=1",
            "-artifact_prefix=./",
            "corpus",
            "seeds",
        ],
        cwd=subject.folder,
        capture_output=True,
        check=False,
    )


def _finding(folder: Path, returncode: int, log: str) -> str | None:
    """Say what the fuzzer found, and which file repeats it."""
    if returncode == 0:
        return None
    words = re.search(r"broken promise.*|runtime error:.*|ERROR: .*", log)
    artifact = re.search(r"Test unit written to \./(\S+)", log)
    what = words[0] if words else f"the fuzzer ended with {returncode}"
    where = f"; repeat it with {folder / 'fuzz'} {folder / artifact[1]}" if artifact else ""
    return f"{what}{where}; all it said: {folder / 'fuzzer.txt'}"


def _beside_the_reference(subject: Subject, files: Sequence[Path], tapes: Sequence[Tape]) -> str | None:
    """Replay tapes in C and in the reference; name the first difference and the file that has it."""
    program = replay.build(subject, "clang", ("-O2",), subject.folder)
    joined = subject.folder / "tapes.bin"
    replay.write_tapes(subject.settings, tapes, joined)
    played = replay.play(program, joined, subject.settings, tapes)
    expected = answers(subject.settings, tapes)
    fault = replay.fault(played, expected)
    found = replay.difference(expected, played.outcomes)
    return f"{files[found.tape]}: {found}" if found else fault


def _statistic(log: str, name: str) -> int:
    found = re.search(rf"stat::{name}:\s+(\d+)", log)
    return int(found[1]) if found else 0
