"""Flights have the same bits on every processor."""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.golden_flights import GOLDEN

ROOT = Path(__file__).parents[2]
DISPATCHED: list[str] = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
"""Features of this processor for which NumPy has code of its own."""
PROCESSORS: dict[str, dict[str, str]] = {
    "as it is": {},
    "NumPy without its optional features": {"NPY_DISABLE_CPU_FEATURES": " ".join(DISPATCHED)},
    "C library without AVX2 and fused operations": {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX512F,-FMA,-FMA4"
    },
}


def run(*command: str, processor: str) -> str:
    """Return what a Python process prints that sees such a processor."""
    environment = os.environ | PROCESSORS[processor]
    return subprocess.run(
        [sys.executable, *command], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    ).stdout


CASES = [
    *((processor, ("c",), "whole") for processor in PROCESSORS),
    *((processor, ("numpy", "short"), "short") for processor in PROCESSORS),
]


@pytest.mark.parametrize(
    ("processor", "arguments", "part"),
    [pytest.param(*case, marks=[] if case[1] == ("c",) else [pytest.mark.long]) for case in CASES],
)
def test_flights_have_the_committed_digests(processor: str, arguments: tuple[str, ...], part: str) -> None:
    """In every bit of their traces; `python -m tests.support.golden_flights --write` writes them anew.

    In NumPy the first 200 ticks are flown: what differs between processors there is sine, cosine and such,
    which every tick calls. That the engine has the bits of NumPy is tested in `tests/flight/engine`.
    """
    flown = json.loads(run("-m", "tests.support.golden_flights", *arguments, processor=processor))
    assert flown == json.loads(GOLDEN.read_text("utf-8"))[part]


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has these switches")
@pytest.mark.skipif("X86_V3" not in DISPATCHED, reason="the processor has no fused operations to hide")
def test_the_processors_differ() -> None:
    """Without its fused operations the C library returns other sines, or the test above could not fail."""
    script = "import math; print([math.sin(0.001 * count) for count in range(10_000)])"
    other = "C library without AVX2 and fused operations"
    assert run("-c", script, processor="as it is") != run("-c", script, processor=other)
