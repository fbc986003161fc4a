"""Processor time and memory of whole commands that fly, with the engine in C and in NumPy.

Each command runs in a process of its own and a new folder, after a first run that builds the C. Its time is
that of all its processes, user and system, and depends little on the load of the machine. In NumPy fewer
flights are flown; the ratio is that of the times of a flight or a trial, start of the command included.
"""

import os
import statistics
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.markdown import table
from mambo_sil.flight.engine.engine_library import VARIABLE
from mambo_sil.flight.names import EngineName

WORKERS: Final = 2


@dataclass(frozen=True)
class Case:
    """A command, the option that counts what it does, if any, and that number and the runs by engine."""

    arguments: tuple[str, ...]
    counted: str | None = None
    counts: tuple[int, int] = (1, 1)
    runs: int = 1


CASES: Final = (
    Case(("fly",), runs=5),
    Case(("fly", "--no-pictures"), runs=5),
    Case(("fly", "--no-pictures", "--sensors", "mambo-derotated"), runs=5),
    Case(("faults",)),
    Case(("table2",)),
    Case(("campaign", "--workers", str(WORKERS)), "--flights", (1000, 40)),
    Case(("tune", "--workers", str(WORKERS)), "--trials", (100, 8)),
)


@dataclass(frozen=True)
class Used:
    """What one run of a command used: processor time, and the memory of its largest process."""

    processor_s: float
    memory_mb: float


def run(arguments: Sequence[str], engine: EngineName = "c") -> Used:
    """Run mambo-nmpc with `arguments` in a new folder."""
    with TemporaryDirectory() as folder, (Path(folder) / "said").open("w") as said:
        line = [sys.executable, "-m", "mambo_nmpc", *arguments, "-o", "out"]
        environment = os.environ | {VARIABLE: engine}
        process = subprocess.Popen(line, cwd=folder, stdout=said, stderr=said, env=environment)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0, (Path(folder) / "said").read_text("utf-8")
    return Used(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0)


def measure(case: Case, engine: EngineName, count: int) -> Used:
    """Return the medians of the runs of a case."""
    counted = () if case.counted is None else (case.counted, str(count))
    runs = [run((*case.arguments, *counted), engine) for _ in range(case.runs)]
    return Used(
        statistics.median(one.processor_s for one in runs), statistics.median(one.memory_mb for one in runs)
    )


def row(case: Case) -> dict[str, str]:
    """Return the cells of a case."""
    first, second = case.counts
    ours, theirs = measure(case, "c", first), measure(case, "numpy", second)
    per_unit = theirs.processor_s / second, ours.processor_s / first
    unit = "" if case.counted is None else f" {case.counted.removeprefix('--')}"
    return {
        "command": " ".join(case.arguments) + (f" {case.counted} {first}" if case.counted else ""),
        "processor time, s": f"{ours.processor_s:.2f}",
        "of the largest process, MB": f"{ours.memory_mb:.0f}",
        "in NumPy, s": f"{theirs.processor_s:.1f}" + (f" ({second}{unit})" if unit else ""),
        "NumPy over C": f"{per_unit[0] / per_unit[1]:.1f}",
    }


def main() -> None:
    """Build the C, run all, and print a table."""
    run(("fly", "--duration-s", "1"))
    rows = []
    for case in CASES:
        rows.append(row(case))
        print(f"measured: {rows[-1]}", file=sys.stderr)
    print(table(rows))


if __name__ == "__main__":
    main()
