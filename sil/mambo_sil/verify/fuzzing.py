"""Check: a coverage-guided fuzzer finds no call that breaks a promise of nmpc.h or has other bits."""

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mambo_codegen.errors import BuildError
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_sil.verify import tape_replay
from mambo_sil.verify.calls import Tape, answers, call_type, tape_from
from mambo_sil.verify.cases import random_tapes
from mambo_sil.verify.check import Result, Subject, failed, incomplete, passed
from mambo_sil.verify.tools import number

RUNS: Final = 500_000
SEED: Final = 1
SEEDS: Final = 32
LONGEST_TAPE: Final = 12
"""Most calls in a tape that the fuzzer makes."""

FLAGS: Final = (
    "-g",
    "-O1",
    "-fno-sanitize-recover=all",
    "-fsanitize=fuzzer,address,undefined,float-divide-by-zero,implicit-conversion,local-bounds",
    "-fno-sanitize-coverage=stack-depth",  # it depends on where the stack begins, so runs would not repeat
)


def check(subject: Subject, *, runs: int = RUNS) -> Result:
    """Run the fuzzer `runs` times, then compare all tapes that it kept with the reference."""
    gap = tape_replay.missing("clang", FLAGS, subject.folder)
    if gap:
        return incomplete(gap)
    seeds, corpus = subject.folder / "seeds", subject.folder / "corpus"
    _write_seeds(subject.settings, seeds)
    corpus.mkdir()
    try:
        done = _fuzz(subject, runs)
    except BuildError as error:
        return failed(f"the harness does not compile: {error}")
    log = done.stderr.decode(errors="replace")
    (subject.folder / "fuzzer.txt").write_text(log)
    files = sorted([*seeds.iterdir(), *corpus.iterdir()])
    tapes = [tape_from(subject.settings, file.read_bytes()) for file in files]
    made = number(log, r"stat::number_of_executed_units:\s+(\d+)")
    figures = {
        "runs": made,
        "runs_per_second": number(log, r"stat::average_exec_per_sec:\s+(\d+)"),
        "seed": SEED,
        "seeds": SEEDS,
        "corpus": len(files) - SEEDS,
        "replayed_calls": sum(len(tape) for tape in tapes),
    }
    fault = _broken_promise(subject.folder, done.returncode, log) or _other_bits(subject, files, tapes)
    if fault is not None:
        return failed(fault, figures)
    return passed(
        f"{made} runs from seed {SEED} broke no promise; {figures['replayed_calls']} calls of the "
        f"{len(files)} tapes kept have the same bits as the reference",
        figures,
    )


def _write_seeds(settings: Settings, folder: Path) -> None:
    """Write the random tapes from which the fuzzer starts."""
    folder.mkdir()
    for index, tape in enumerate(random_tapes(settings, SEEDS)):
        (folder / f"seed-{index:02}").write_bytes(tape.tobytes())


def _fuzz(subject: Subject, runs: int) -> "subprocess.CompletedProcess[bytes]":
    """Build and run the harness; raises BuildError."""
    bundle = subject.bundle.resolve()
    harness = bundle / "fuzz" / f"{subject.settings.code.prefix}_fuzz.c"
    units = [str(path.resolve()) for path in (harness, *tape_replay.sources(subject))]
    Toolchain(("clang",)).run(
        [*tape_replay.FLAGS, *FLAGS, f"-I{bundle}", *units, "-o", "fuzz"], subject.folder
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
            "-use_cmp=0",  # its table contains addresses, so runs would not repeat
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


def _broken_promise(folder: Path, returncode: int, log: str) -> str | None:
    """Return the fault that the fuzzer found and the command that repeats it; None if it found none."""
    if returncode == 0:
        return None
    words = re.search(r"broken promise.*|runtime error:.*|ERROR: .*", log)
    artifact = re.search(r"Test unit written to \./(\S+)", log)
    what = words[0] if words else f"the fuzzer ended with {returncode}"
    where = f"; repeat it with {folder / 'fuzz'} {folder / artifact[1]}" if artifact else ""
    return f"{what}{where}; its output: {folder / 'fuzzer.txt'}"


def _other_bits(subject: Subject, files: Sequence[Path], tapes: Sequence[Tape]) -> str | None:
    """Run tapes in the C; return the first difference from the reference and the file of its tape."""
    program = tape_replay.build(subject, "clang", ("-O2",), subject.folder)
    joined = subject.folder / "tapes.bin"
    tape_replay.write_tapes(subject.settings, tapes, joined)
    played = tape_replay.play(program, joined, subject.settings, tapes)
    expected = answers(subject.settings, tapes)
    fault = tape_replay.fault(played, expected)
    found = tape_replay.difference(expected, played.outcomes)
    return f"{files[found.tape]}: {found}" if found else fault
