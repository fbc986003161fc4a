"""Tests of a room notice every small fault of its Python, except those with a reason.

python -m tests.mutation.test_python_mutants [ROOM ...]   try every fault of rooms, print which go unnoticed
"""

import json
import subprocess
import sys
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pytest

from tests.mutation.python_bench import ROOMS, ROOT, mutants_of
from tests.mutation.python_mutants import python_mutants
from tests.mutation.reasons import Key, survivors
from tests.support.tools import require

SAMPLES: Final = {"fences": 10, "tracker": 4}
"""Rooms whose tests are quick: CI tries one fault in so many, others when the source changes."""
REASONS: Final = survivors("python_survivors.txt")


def in_function(line: str) -> set[str]:
    """Return the faults of a line in a function."""
    text = f"def f(a, b, low, high, climb_m_s, descent_m_s):\n    {line}\n"
    found = (
        one.apply(text).splitlines()[1].strip() for one in python_mutants("x.py", text, frozenset({"high"}))
    )
    return set(found)


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("return a + b", {"return a - b"}),
        ("return (a) - (b)", {"return (a) + (b)", "return (b) - (a)"}),
        ("return a / b", {"return a * b", "return (b) / (a)"}),
        ("return a * -b", {"return a / -b", "return a * (b)"}),
        ("return a <= b", {"return a < b", "return a > b"}),
        ("return min(a, b)", {"return max(a, b)"}),
        ("return a if b else low", {"return (a)", "return (low)", "return a if b else high"}),
        ("return a[1], 0.5", {"return a[2], 0.5", "return a[1], 0.55"}),
        ("return 2 * climb_m_s", {"return 2 / climb_m_s", "return 3 * climb_m_s", "return 2 * descent_m_s"}),
        ('return zip(a, ("low", "b"), strict=True)', {'return zip(a, ("high", "b"), strict=True)'}),
        ("return not a or b", {"return (a) or b", "return not a and b"}),
        ("return abs(a)", {"return (a)"}),
        ('return "few" if a < b else f"{a} times"', set()),
        ('raise ValueError("a" + b)', set()),
        ('"""a + b"""', set()),
        ("c: float", set()),
        ('return f"{a + b}"', set()),
    ],
)  # fmt: skip
def test_every_small_fault_of_a_line_is_made(line: str, wrong: set[str]) -> None:
    """Operators, order, constants, names, choices; nothing in a message, documentation, or annotation."""
    assert in_function(line) == wrong


@pytest.mark.long
def test_every_reason_is_of_a_fault_that_there_is() -> None:
    """A row whose line is gone is removed; and each file of a room has faults with keys of their own."""
    keys = [one.key for room in ROOMS.values() for found in mutants_of(room).values() for one in found]
    assert len(keys) == len(set(keys))
    assert REASONS.keys() <= set(keys)


def unnoticed(room: str, stride: int = 1, turn: int = 0) -> list[Key]:
    """Return which faults of a room, one in `stride` from number `turn` on, go unnoticed.

    In a process of its own, whose tests have imported nothing yet.
    """
    with TemporaryDirectory() as folder:
        answer = Path(folder) / "answer"
        line = [
            sys.executable,
            "-m",
            "tests.mutation.python_bench",
            room,
            str(stride),
            str(turn),
            str(answer),
        ]
        done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        rows = [json.loads(row) for row in answer.read_text("utf-8").splitlines()]
    return [(file, text, change) for file, text, change in rows]


@pytest.mark.long
@pytest.mark.parametrize("room", SAMPLES)
def test_a_fault_of_a_sample_is_noticed_or_explained(room: str) -> None:
    """In a sample of those of a room; the message has the survivors."""
    require("gcc", "gcc")
    stride = SAMPLES[room]
    turn = zlib.crc32(b"".join(path.read_bytes() for path in ROOMS[room].files)) % stride
    assert [key for key in unnoticed(room, stride, turn) if key not in REASONS] == []


@pytest.mark.thorough
@pytest.mark.long
@pytest.mark.parametrize("room", ROOMS)
def test_a_fault_is_noticed_or_explained(room: str) -> None:
    """Every fault of each room; the message has the survivors."""
    require("gcc", "gcc")
    assert [key for key in unnoticed(room) if key not in REASONS] == []


def main(rooms: list[str]) -> None:
    """Try every fault of rooms."""
    for room in rooms:
        for key in unnoticed(room):
            print(room, *key, REASONS.get(key, "NO REASON"), sep=": ", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or list(ROOMS))
