"""Figures in prose: each equals what a command printed when its evidence was made.

A table between two markers is written by its command; a figure in a sentence is typed by hand, and stays
when the command prints another one. So a sentence with such a figure has a row in `FIGURES`:

    Figure("docs/how-to/libraries.md", r"preset `mambo` takes (.+?) % of its period", lambda: ...)

- the file, from the root of the repository;
- a pattern that occurs once in its text, in which each run of blanks and line ends is one blank; its one
  group is the figure, or several with the words between them;
- a function that returns the group as it must be: from a stamp of evidence (`figures("footprint")`, what is
  in docs/evidence/data/footprint.json under "figures"), or from the code itself if that takes no time.

A figure in a console block of a tutorial or a how-to needs no row: `test_console` compares it.
"""

import json
import re
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from benchmarks.evidence.simulator_tables import PAGE

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Figure:
    """A figure in a sentence: where it stands, and what it must be."""

    page: str
    pattern: str
    expected: Callable[[], str]


@cache
def figures(item: str) -> Any:
    """Return the figures of an item of evidence."""
    return json.loads((ROOT / "docs" / "evidence" / "data" / f"{item}.json").read_text("utf-8"))["figures"]


def board(name: str, controller: str = "mambo") -> Any:
    """Return the footprint of a controller on a board."""
    found = figures("footprint") | figures("footprint-crazyflie")
    return next(one for one in found[controller] if one["name"] == name)


def instructions(name: str, controller: str = "mambo", kind: str = "mean") -> str:
    """Return instructions of a step."""
    return f"{board(name, controller)['instructions'][kind]:.0f}"


def step_us(name: str, controller: str = "mambo") -> str:
    """Return the least and the longest time of a step in microseconds."""
    least_s, most_s = board(name, controller)["time_s"]
    return f"{1e6 * least_s:.0f} to {1e6 * most_s:.0f}"


def period_percent(name: str, controller: str = "mambo") -> str:
    """Return the longest time of a step as a share of the update period of 10 ms."""
    return f"{100 * board(name, controller)['time_s'][1] / 0.01:.2g}"


def share_of_fixed() -> str:
    """Return the least and the largest share of fixed point in the instructions of float32, without FPU."""
    shares = [
        board(name, FIXED)["instructions"]["mean"] / board(name)["instructions"]["mean"]
        for name in ("mambo", "rp2040", "rv32")
    ]
    return f"{100 * min(shares):.0f} to {100 * max(shares):.0f}"


def processor_time(what: str) -> float:
    """Return the processor time of a row of `speed` that begins so, over that of a controller in C."""
    found = next(one for one in figures("speed")["rows"] if one["what flies"].startswith(what))
    return float(found["processor time"])


def crashes(campaign: str, controller: str = "mambo") -> str:
    """Return how many of 300 light drones with slow motors crash."""
    return str(figures("opponents")[campaign]["controllers"][controller]["crashed"]["count"])


def size(name: str) -> str:
    """Return stack, flash, RAM and time of preset `mambo`."""
    found = board(name)
    flash = f"{found['flash_bytes'] / 1000:.1f} KB"
    return f"{found['stack_bytes']} B, {flash}, {found['ram_bytes']} B, {step_us(name)} us"


def solver(name: str) -> str:
    """Return how many times our instructions a solver takes for the problem of a control step."""
    return str(next(row for row in figures("peers")["rows"] if row["solver"] == name)["over ours"])


def least_and_most_of_ours() -> str:
    """Return the least mean and the most instructions of our minimum."""
    ours = figures("peers")["rows"][0]
    counts = [text.split() for name, text in ours.items() if name.endswith("mean (most)")]
    return f"{min(int(mean) for mean, _ in counts)} to {max(int(most.strip('()')) for _, most in counts)}"


def in_app(part: str, *columns: str) -> str:
    """Return what a part of the Crazyflie's app takes in kilobytes, flash or RAM."""
    row = next(row for row in figures("app-sizes")["rows"] if row["part"] == part)
    return " KB of flash and ".join(f"{int(row[f'{column}, B']) / 1000:.1f}" for column in columns)


def times_in_float64() -> str:
    """Return how many times the instructions of float32 float64 takes on the Crazyflie."""
    double = board("crazyflie", "mambo --scalar float64")["instructions"]["mean"]
    return f"{double / board('crazyflie')['instructions']['mean']:.0f}"


def shown(value: float, digits: int = 2) -> str:
    """Return a figure with so many digits, without zeros behind the point."""
    return f"{value:.{digits}g}"


def in_simulator(drone: str, controller: str, item: str = "simulators") -> str:
    """Return the median RMS distance on the eight in a simulator of others, in mm, by default with noise."""
    return shown(statistics.median(figures(item)[drone][controller]["eight"]))


def in_firmware(curve: str, controller: str) -> str:
    """Return the mean distance in cm over 60 s of a curve in the Crazyflie's firmware, of nine flights."""
    record = json.loads((ROOT / "docs" / "evidence" / "records" / "firmware.json").read_text("utf-8"))
    iae_m_s = record["figures"]["curves"][curve][controller]["iae_m_s"]
    distance_cm = 100 * sum(iae_m_s) / len(iae_m_s) / 60
    return f"{distance_cm:.1f}" if distance_cm < 10 else f"{distance_cm:.0f}"


def ratio_of_pid(index: str) -> float:
    """Return the median, over 1000 random drones, of the tuned PID's index divided by that of `mambo`."""
    found = figures("opponents")["improvements"]
    return next(
        float(one["median"]) for one in found if (one["controller"], one["index"]) == ("mambo", index)
    )


def frozen() -> str:
    """Return the largest error of preset `mambo` on the eight if its state is frozen for 5 s, in m."""
    found = (one for one in figures("faults")["mambo"] if one["course"] == "eight")
    return next(f"{one['largest_error_m']:.0f}" for one in found if one["fault"] == "state frozen, 5 s")


def laps(column: str) -> list[float]:
    """Return the times of the laps in a column of their table, in s."""
    found = [next(text for name, text in row.items() if column in name) for row in figures("laps")["rows"]]
    return [float(text.split(",")[0]) for text in found]


def quicker(column: str, other: str) -> list[float]:
    """Return by how many percent the laps of a column are quicker than those of another."""
    return [100 * (1 - mine_s / its_s) for mine_s, its_s in zip(laps(column), laps(other), strict=True)]


FIXED, DERIVED = "mambo --scalar fixed", "design crazyflie"
CIRCLE, FAST_EIGHT = "slow-motors-circle", "slow-motors-fast-eight"
APP, SOLVERS = "docs/how-to/crazyflie.md", "docs/evidence/peers.md"
OF_DESIGN = "`design crazyflie`: flash", "`design crazyflie`: RAM"
OF_PRESET = "preset `crazyflie`: flash", "preset `crazyflie`: RAM"
X500, PYBULLET = "hb_x500, fitted", "gym-pybullet-drones, cf2x"
OPPONENTS, COMPATIBILITY = "docs/evidence/opponents.md", "docs/reference/compatibility.md"
HEIGHT, FIXED_POINT = "docs/evidence/height.md", "docs/explanation/fixed-point.md"
BOARDS, LIBRARIES = "docs/evidence/boards.md", "docs/how-to/libraries.md"
FIGURES = [
    Figure(
        "docs/how-to/plan.md",
        r"`plan` is (.+?) % quicker than the spline",
        lambda: "{}, {} and {}".format(*map(shown, quicker("`plan`", "smooth spline"))),
    ),
    Figure(
        "docs/how-to/plan.md",
        r"without them the quickest lap that all fly is (.+?) % quicker",
        lambda: "{}, {} and {}".format(*map(shown, quicker("largest share", "with lag and dead time"))),
    ),
    Figure(
        "docs/reference/python.md",
        r"A law takes at least (\d+) times",
        lambda: f"{processor_time('an empty law'):.0f}",
    ),
    Figure(
        "docs/evidence/simulators.md",
        r"does nothing takes (\d+) times",
        lambda: f"{processor_time('an empty law'):.0f}",
    ),
    Figure(
        "docs/evidence/simulators.md",
        r"own controller takes (\d+) times as long as that",
        lambda: f"{processor_time('RotorPy') / processor_time('an empty law'):.0f}",
    ),
    Figure(
        "docs/how-to/simulators.md",
        r"1,000 of them make (\d+) times as many",
        lambda: f"{round(processor_time('Gymnasium, 1 drone') / processor_time('Gymnasium, 1,000'), -1):.0f}",
    ),
    Figure(BOARDS, r"float32 takes (\d+) instructions on an ARM926", lambda: instructions("mambo")),
    Figure(BOARDS, r"ARM926, and fixed point (\d+)", lambda: instructions("mambo", FIXED)),
    Figure(BOARDS, r"takes \*\*(\S+) KB of flash", lambda: f"{board('crazyflie')['flash_bytes'] / 1000:.1f}"),
    Figure(BOARDS, r"KB of flash, (\d+) B of RAM", lambda: str(board("crazyflie")["ram_bytes"])),
    Figure(BOARDS, r"RAM and (\d+) instructions per step", lambda: instructions("crazyflie")),
    Figure(BOARDS, r"Cortex-M4F\*\*, (\d+ to \d+) us", lambda: step_us("crazyflie")),
    Figure(BOARDS, r"most of the Mega's (\d+) B", lambda: str(board("mega")["ram_bytes"])),
    Figure(BOARDS, r"in software: (\d+) times the instructions", times_in_float64),
    Figure(LIBRARIES, r"preset `mambo` takes (\S+) % of its period", lambda: period_percent("mega")),
    Figure(LIBRARIES, r"on a Teensy 4.1 (\S+) %", lambda: period_percent("teensy41")),
    Figure("docs/how-to/own-firmware.md", r"on a Cortex-M4F: (.+?) \(modelled\)", lambda: size("crazyflie")),
    Figure(
        "docs/how-to/own-firmware.md", r"adds (\S+) KB of flash", lambda: in_app("self-test", OF_PRESET[0])
    ),
    Figure(SOLVERS, r"(\d+ to \d+) instructions\*\*", least_and_most_of_ours),
    Figure(SOLVERS, r"takes (\d+ to \d+) times as many", lambda: solver("DAQP, float")),
    Figure(SOLVERS, r"OSQP (\d+ to \d+) times", lambda: solver("OSQP, float")),
    Figure(APP, r"With the self-test (\S+ KB of flash and \S+) KB", lambda: in_app("together", *OF_DESIGN)),
    Figure(
        APP,
        r"preset `crazyflie` (\S+ KB and \S+) KB",
        lambda: in_app("together", *OF_PRESET).replace(" of flash", ""),
    ),
    Figure(BOARDS, r"\*\*(\d+) instructions at least", lambda: instructions("crazyflie", kind="least")),
    Figure(BOARDS, r"instructions at least, (\d+) in the mean", lambda: instructions("crazyflie")),
    Figure(
        "docs/evidence/benchmarks.md", r"a step takes (\d+) for `mambo`", lambda: instructions("crazyflie")
    ),
    Figure(
        "docs/evidence/benchmarks.md",
        r"for `mambo`, (\d+) for `mambo-1norm`",
        lambda: instructions("crazyflie", "mambo-1norm"),
    ),
    Figure(
        "README.md",
        r"\*\*(\S+) KB of flash",
        lambda: f"{board('crazyflie', DERIVED)['flash_bytes'] / 1000:.1f}",
    ),
    Figure("README.md", r"flash, (\d+) bytes of RAM", lambda: str(board("crazyflie", DERIVED)["ram_bytes"])),
    Figure("README.md", r"(\d+ to \d+) us per step\*\*", lambda: step_us("crazyflie", DERIVED)),
    Figure("README.md", r"(\d+) instructions on average", lambda: instructions("crazyflie", DERIVED)),
    Figure(
        "docs/index.md",
        r"needs (\S+) KB of flash",
        lambda: f"{board('crazyflie', DERIVED)['flash_bytes'] / 1000:.1f}",
    ),
    Figure("docs/index.md", r"flash and (\d+) bytes", lambda: str(board("crazyflie", DERIVED)["ram_bytes"])),
    Figure("README.md", r"\[(\d+) instructions instead of", lambda: instructions("mambo", FIXED)),
    Figure("README.md", r"instructions instead of (\d+)\]", lambda: instructions("mambo")),
    Figure(
        OPPONENTS,
        r"is only (\d+) % larger with the PID",
        lambda: f"{100 * (ratio_of_pid('iae_m_s') - 1):.0f}",
    ),
    Figure(
        OPPONENTS, r"\*\*(\S+) times the error as estimated", lambda: f"{ratio_of_pid('seen_iae_m_s'):.1f}"
    ),
    Figure(OPPONENTS, r"\*\*(\d+) of 300 crash with", lambda: crashes("slow-motors", "pid-feedforward")),
    Figure(OPPONENTS, r"crashes: (\d+) of 300 on a circle", lambda: crashes(CIRCLE)),
    Figure(OPPONENTS, r"rad/s, (\d+) on the eight at 0.8", lambda: crashes(FAST_EIGHT)),
    Figure(COMPATIBILITY, r"and (\d+) on a circle at", lambda: crashes(CIRCLE)),
    Figure(HEIGHT, r"the mean distance is (\S+) cm;", lambda: shown(figures("space")["third-axis"])),
    Figure(HEIGHT, r"cm; (\d+) cm with the drone's own", lambda: shown(figures("space")["preset"])),
    Figure(FIXED_POINT, r"it takes (.+?) % of the instructions of float32", share_of_fixed),
    Figure(FIXED_POINT, r"on the Mega (\d+) % of the update", lambda: period_percent("mega", FIXED)),
    Figure(FIXED_POINT, r"where float32 takes (\d+) %", lambda: period_percent("mega")),
    Figure("README.md", r"on the desk \| (\S+) cm", lambda: in_firmware("eight", "design")),
    Figure("README.md", r"\| Mellinger (\S+) cm", lambda: in_firmware("eight", "mellinger")),
    Figure("README.md", r"cm, Lee (\S+) cm", lambda: in_firmware("eight", "lee")),
    Figure("README.md", r"cm, PID (\d+) cm", lambda: in_firmware("eight", "pid")),
    Figure(
        "README.md",
        r"in the firmware \((\S+ and \S+) cm",
        lambda: f"{in_firmware('circle', 'design')} and {in_firmware('circle', 'lee')}",
    ),
    Figure("README.md", r"2.3 kg, noise \| (\S+) mm", lambda: in_simulator(X500, PAGE)),
    Figure("README.md", r"\| Mellinger, tuned, (\S+) mm", lambda: in_simulator(X500, "Mellinger, tuned")),
    Figure("README.md", r"md\), noise \| (\S+) mm", lambda: in_simulator(PYBULLET, PAGE)),
    Figure("README.md", r"its own, tuned, (\S+) mm", lambda: in_simulator(PYBULLET, "DSLPIDControl, tuned")),
    Figure("docs/evidence/faults.md", r"worse than none \((\d+) m after 5 s", frozen),
    Figure("docs/index.md", r"the paper's PD (\d+) cm", lambda: shown(figures("space")["pd"])),
    Figure("docs/index.md", r"a tuned PID (\S+) cm", lambda: shown(figures("space")["pid"])),
    Figure("docs/index.md", r"this MPC (\S+) cm", lambda: shown(figures("space")["third-axis"])),
    Figure(
        "docs/reference/c-api.md",
        r"quadratic, (\d+ to \d+) instructions",
        lambda: f"{instructions('crazyflie', kind='least')} to {instructions('crazyflie', kind='most_met')}",
    ),
    Figure("docs/reference/c-api.md", r"Cortex-M4F, (\d+) in the mean", lambda: instructions("crazyflie")),
]


def fault(figure: Figure, text: str) -> str:
    """Return what is wrong with a figure in the text of its page, "" if nothing."""
    found = re.findall(figure.pattern, " ".join(text.split()))
    if len(found) != 1:
        return f"{figure.page}: {figure.pattern!r} occurs {len(found)} times, and should once"
    expected = figure.expected()
    return (
        "" if found[0] == expected else f"{figure.page}: {figure.pattern!r}: {found[0]}, should be {expected}"
    )


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: f"{figure.page}: {figure.pattern}")
def test_a_figure_in_a_sentence_is_what_its_command_prints(figure: Figure) -> None:
    """Where the evidence has another figure the page is wrong."""
    assert fault(figure, (ROOT / figure.page).read_text("utf-8")) == ""


def test_a_wrong_a_missing_and_a_doubled_figure_are_found() -> None:
    """With the page, the sentence, and what the figure should be."""
    figure = Figure("page.md", r"takes (\d+) B", lambda: "411")
    assert fault(figure, "It takes\n411 B.") == ""
    assert fault(figure, "It takes 395 B.") == r"page.md: 'takes (\\d+) B': 395, should be 411"
    assert "occurs 0 times" in fault(figure, "It takes room.")
    assert "occurs 2 times" in fault(figure, "It takes 411 B, and takes 411 B.")
