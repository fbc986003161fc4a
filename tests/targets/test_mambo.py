"""The Mambo's shared library: built with its vendor's flags, loaded and flown on an emulated processor."""

import math
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Circle
from tests.support.bundles import place, write_target
from tests.support.height_settings import height_settings
from tests.support.knowing import Knowing
from tests.support.shell import shell
from tests.support.tools import require

STUBS: Final = Path(__file__).parent / "mambo_stubs"
VENDOR_FLAGS: Final = ("-std=gnu89", "-fPIC", "-Wall", "-Werror", "-ffp-contract=off")
ROOT: Final = "/usr/arm-linux-gnueabi"
BLOCK = "src/nmpc_mambo.c"
MUTANTS = {
    "velocity north": ("(ahead_x * u->dx) - (ahead_y * u->dy)", "(ahead_x * u->dx) + (ahead_y * u->dy)"),
    "velocity east": ("(ahead_y * u->dx) + (ahead_x * u->dy)", "(ahead_x * u->dy) - (ahead_y * u->dx)"),
    "roll": ("state.roll_rad = u->roll", "state.roll_rad = -u->roll"),
    "pitch": ("state.pitch_rad = u->pitch", "state.pitch_rad = -u->pitch"),
    "yaw": ("state.yaw_rad = u->yaw", "state.yaw_rad = -u->yaw"),
    "thrust": ("-u->thrust / MASS_KG", "u->thrust / MASS_KG"),
    "order": (
        "nmpc_mambo_Y.pitch = (float)command.pitch_rad",
        "nmpc_mambo_Y.pitch = (float)command.roll_rad",
    ),
    "rate": ("(tick % TICKS_PER_UPDATE) == 0U", "(tick % TICKS_PER_UPDATE) == 1U"),
}


SUBJECTS = {
    "mambo": presets.preset("mambo"),
    "1-norm": presets.preset("mambo-1norm"),
    "fixed": with_option(presets.preset("mambo"), "code.scalar", "fixed"),
    "height": height_settings(),
    "fixed height": height_settings("fixed"),
}


class FlightProcess:
    """A process on an emulated ARM that has loaded the library."""

    def __init__(self, process: "subprocess.Popen[bytes]", *, is_observed: bool) -> None:
        self._process, self._is_observed = process, is_observed

    def tick(self, state: FloatArray, target: FloatArray, thrust_n: float) -> FloatArray:
        """Return pitch, roll, status, refused, and with a height thrust and whether it is the controller's.

        state:  [x, y, vx, vy, roll, pitch, yaw], with a height [height, climb, 0] behind them.
        target: [x, y, vx, vy], with a height [height, climb] behind them.
        """
        x, y, vx, vy, roll, pitch, yaw, *vertical = state
        down, falling = (-vertical[0], -vertical[1]) if vertical else (0.0, 0.0)
        ahead, right = math.cos(yaw) * vx + math.sin(yaw) * vy, math.cos(yaw) * vy - math.sin(yaw) * vx
        reference = [*target[:4], *(-target[4:] if vertical else ())]
        # Accelerations, and how many of them are known.
        reference += [0.0] * (self._is_observed * (4 if vertical else 3))
        estimate = [x, y, down, yaw, pitch, roll, ahead, right, falling, 0.0, 0.0, 0.0]
        sensors = [*estimate, *reference, -thrust_n]
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(np.array(sensors, "<f4").tobytes())
        self._process.stdin.flush()
        return np.frombuffer(self._process.stdout.read(24), "<f4")


class Processes:
    """A position controller of the closed loop: one flight process a flight, two ticks an update."""

    def __init__(self, processes: Sequence[FlightProcess]) -> None:
        self._processes = processes

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Return the angles of the second tick, in which the state is NaN: they are held since the first."""
        thrusts_n = NOMINAL.body.mass_kg * thrust_acceleration_m_s2
        held = []
        for process, one, aim, thrust_n in zip(self._processes, state, target, thrusts_n, strict=True):
            process.tick(one, aim, float(thrust_n))
            held.append(process.tick(np.full(7, np.nan), aim, float(thrust_n)))
        rows = np.array(held, np.float64)
        return Applied(rows[:, 1::-1], rows[:, 2].astype(np.int64))


@contextmanager
def flight_process(folder: Path) -> Iterator[FlightProcess]:
    """Load librsedu.so in `folder` into a flight process under qemu-arm."""
    line = [
        require("qemu-arm", "qemu-user"),
        "-L",
        ROOT,
        str(folder / "process"),
        str(folder / "librsedu.so"),
    ]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            header = (folder / "src/nmpc_mambo.h").read_text("utf-8")
            yield FlightProcess(process, is_observed="is_known" in header)
        finally:
            process.kill()


def build(settings: Settings, folder: Path, right: str = "", wrong: str = "") -> Path:
    """Make librsedu.so with the target's Makefile, and the process; in the block `right` reads `wrong`."""
    compiler = require("arm-linux-gnueabi-gcc", "gcc-arm-linux-gnueabi and libc6-dev-armel-cross")
    files = render_target(settings, find_target("mambo"), with_digest=False)
    assert not right or files[BLOCK].count(right) == 1, f"the template moved on: {right}"
    place(files | {BLOCK: files[BLOCK].replace(right, wrong) if right else files[BLOCK]}, folder)
    numbers = (10 if settings.height else 7) if settings.controller.method == "quadratic" else 4
    references = f"-DREFERENCE_NUMBERS={numbers}"
    shell(
        *(compiler, *VENDOR_FLAGS, references, f"-I{STUBS}", f"-I{folder}/src"),
        *("-c", STUBS / "stock.c", "-o", folder / "stock.o"),
    )
    shell("make", "-s", "rsedu", f"VENDOR={STUBS}", "STOCK=stock.o", folder=folder)
    shell(compiler, references, f"-I{STUBS}", STUBS / "flight_process.c", "-ldl", "-o", folder / "process")
    return folder


def flight_of(flights: int) -> Flight:
    """Return flights of a circle, at a heading at which every sign counts."""
    return Flight(Circle(1.0, 1.0), duration_s=4.0, flights=flights, yaw_rad=0.8)


def distances_m(folders: Sequence[Path]) -> FloatArray:
    """Fly the libraries in `folders`; return how far each (n,) was at most from the controller alone."""
    alone = fly(flight_of(1), Knowing(presets.preset("mambo"), 0))
    with ExitStack() as stack:
        processes = [stack.enter_context(flight_process(folder)) for folder in folders]
        trace = fly(flight_of(len(folders)), Processes(processes))
    return np.asarray(np.abs(trace.position_m - alone.position_m).max(axis=(0, 2)))


@pytest.mark.long
def test_the_library_flies_in_a_flight_process_as_the_controller_alone(tmp_path: Path) -> None:
    """To the rounding of conversions: the stock estimator has floats, and velocities along the heading."""
    (right,) = distances_m([build(presets.preset("mambo"), tmp_path)])
    assert right < 1e-6


@pytest.mark.long
def test_every_sign_order_and_rate_counts(tmp_path: Path) -> None:
    """With a wrong one the drone flies another way."""
    settings = presets.preset("mambo")
    folders = [build(settings, tmp_path / name, *mutant) for name, mutant in MUTANTS.items()]
    assert not {name for name, off in zip(MUTANTS, distances_m(folders), strict=True) if off < 0.1}


def test_lost_states_are_counted_and_end_level(tmp_path: Path) -> None:
    """The controller flies on by its estimate for 0.5 s, brakes, and is then level."""
    target = np.array([0.5, 0.5, 0.0, 0.0])
    with flight_process(build(presets.preset("mambo"), tmp_path)) as process:
        for _ in range(6):
            assert process.tick(np.zeros(7), target, 0.6)[2] == 0
        outage = [process.tick(np.full(7, np.nan), target, 0.6) for _ in range(400)]
    assert outage[0][0] != 0.0
    assert outage[104][0] != 0.0, "it brakes, after 52 updates"
    assert list(outage[-1])[:4] == [0.0, 0.0, 2.0, 200.0]


def test_the_thrust_is_taken_over_in_the_air(tmp_path: Path) -> None:
    """After a second, above half a metre, as nmpc_reset does it; before, the stock loop's goes through."""
    settings, mass_kg = height_settings(), NOMINAL.body.mass_kg
    alone, draw = CompiledController(settings), np.random.default_rng(4)
    present, begun = np.zeros(2), False
    with flight_process(build(settings, tmp_path)) as process:
        for update in range(160):
            state, target = draw.normal(0.0, 0.1, (2, 10))
            state[7], state[9], target[4] = (0.44 if update < 120 else 0.55) + 0.01 * state[7], 0.0, 1.0
            stock_n = mass_kg * (9.81 + state[0]) if update else 0.0
            if update == 0:
                alone.reset([[*state[4:6], 0.0]])
            if not begun:
                begun = update == 120
                reported_m_s2 = stock_n / mass_kg
                alone.reset([[*present, reported_m_s2]]) if begun else alone.report_thrust([reported_m_s2])
            told = np.zeros(13)
            told[[0, 1, 2, 3, 6, 7]] = target[:6]
            expected = alone.step(state[np.newaxis], told[np.newaxis])
            present = expected.command_rad[0].astype(np.float64)
            for tick in range(2):
                found = process.tick(state, target[:6], stock_n + 0.01 * tick)
                np.testing.assert_allclose(found[1::-1], present, atol=1e-5)
                thrust_n = mass_kg * expected.thrust_m_s2[0] if begun else stock_n + 0.01 * tick
                np.testing.assert_allclose(found[4:], [-thrust_n, begun], atol=1e-5)


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("optimisation", ["-O0", "-O3"])
@pytest.mark.parametrize("name", SUBJECTS)
def test_the_flags_of_both_toolboxes_build_it_without_a_word(
    name: str, optimisation: str, tmp_path: Path
) -> None:
    """One has no optimisation, one -O3; both are gnu89, warnings are errors; the block needs only libm."""
    compiler = require("arm-linux-gnueabi-gcc", "gcc-arm-linux-gnueabi and libc6-dev-armel-cross")
    write_target("mambo", SUBJECTS[name], tmp_path)
    shell(
        *(compiler, *VENDOR_FLAGS, optimisation, "-shared", "-Wl,--no-undefined"),
        *("src/nmpc.c", "src/nmpc_mambo.c", "-lm", "-o", "block.so"),
        folder=tmp_path,
    )
    exported = shell("arm-linux-gnueabi-nm", "-D", "--defined-only", "block.so", folder=tmp_path)
    for symbol in ("nmpc_mambo_U", "nmpc_mambo_Y", "nmpc_mambo_initialize", "nmpc_mambo_step"):
        assert f" {symbol}\n" in exported
