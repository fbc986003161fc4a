"""Whole flights: the compiled C gives the reference's trace, the same on every processor, and tracks well."""

import json
import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse, with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.experiment.table2.table2 import PRINTED_IMPROVEMENT, PRINTED_PD
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Bernoulli
from tests.support.cases import SCALARS
from tests.support.golden_flights import GOLDEN
from tests.support.tools import toolchain

CASE = Bernoulli(2.0, 0.5)
CONDITIONS = {
    "hover start": Flight(CASE, duration_s=10.0),
    "take-off, turned, pushed": Flight(
        CASE, duration_s=5.0, start="take-off", yaw_rad=0.8, disturbances=Disturbances(push_m_s2=(0.5, -0.3))
    ),
}


def demand_reference(flight: Flight, trace: Trace, reference: PositionController) -> None:
    """Demand that the reference answers every update of `flight` with the commands and statuses of a trace.

    So the flight with the reference is this one: its first input is the same, and as long as the commands
    are, so are the next inputs, since the plant is the same (tests/flight/engine compares them).
    """
    inputs = np.concatenate(
        [trace.position_m[..., :2], trace.velocity_m_s[..., :2], trace.euler_rad], axis=-1
    )
    for update, target in enumerate(flight.given_targets):
        step = reference.step(inputs[update], target, trace.thrust_acceleration_m_s2[update])
        command_rad = np.asarray(step.command_rad, np.float64)
        assert command_rad.tobytes() == trace.command_rad[update].tobytes(), update
        assert (step.status == trace.status[update]).all(), update


def test_a_command_of_other_bits_is_found() -> None:
    """In the last bit of one update; the comparison above could miss it otherwise."""
    settings, flight = presets.load("mambo"), Flight(CASE, duration_s=0.2)
    trace = fly(flight, CompiledController(settings))
    demand_reference(flight, trace, method_of(settings).reference_controller())
    trace.command_rad[17, 0, 1] = np.nextafter(trace.command_rad[17, 0, 1], 1.0)
    with pytest.raises(AssertionError, match="17"):
        demand_reference(flight, trace, method_of(settings).reference_controller())


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("preset", ["mambo", pytest.param("table1", marks=pytest.mark.long)])
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_flight_with_the_c_is_the_reference_flight(condition: str, preset: str, scalar: str) -> None:
    """All commands are equal bit for bit; the closed loop would amplify any difference."""
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    flight = CONDITIONS[condition]
    library = build_library(settings, toolchain("gcc"))
    flown = fly(flight, CompiledController(settings, library=library))
    demand_reference(flight, flown, method_of(settings).reference_controller())


@pytest.mark.first_is_quick
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_flight_in_numpy_with_the_reference_is_the_flight_with_the_c(condition: str) -> None:
    """Nothing of C in one of them: all arrays of both traces are equal bit for bit."""
    settings = presets.load("mambo")
    flight = replace(CONDITIONS[condition], duration_s=2.0)
    ours = loop.fly(flight, method_of(settings).reference_controller())
    assert fly(flight, CompiledController(settings)).same_bits(ours)


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("preset", presets.names())
def test_the_hundred_seconds_of_table_2_are_the_reference_flight(preset: str) -> None:
    """Over Table II's 100 s, compilers and optimization levels give the same bits.

    The reference answers along: with preset mambo all the way, with the others two figures of the eight.
    """
    settings = presets.load(preset)
    flight = Flight(CASE)
    first, *others = (
        fly(flight, CompiledController(settings, library=build_library(settings, toolchain(*compiler))))
        for compiler in (("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O2"))
    )
    assert all(first.same_bits(other) for other in others)
    followed = flight if preset == "mambo" else replace(flight, duration_s=25.2)
    demand_reference(followed, first, method_of(settings).reference_controller())


def indices(preset: str, scalar: str, flight: Flight) -> np.ndarray:
    """Return the indices of Table II (4, n) of flights with the compiled C."""
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    return measure(fly(flight, CompiledController(settings, flight.flights))).table2


@pytest.mark.long
def test_preset_table1_improves_on_the_pd_by_more_than_the_paper_prints() -> None:
    """The PD flies its printed row within 2 % (`test_loop`), so that row is the reference."""
    assert np.all(PRINTED_PD / indices("table1", "float32", Flight(CASE))[:, 0] >= PRINTED_IMPROVEMENT)


def test_mambo_improves_on_the_pd_and_tracks_with_yaw_push_and_motor_lag() -> None:
    """By at least 20; the IAE is below 5 m s at yaw 0.8 rad, pushed along x or y, and with motor lag."""
    push = Disturbances(push_m_s2=(np.array([0, 0, 0.5, 0, 0]), np.array([0, 0, 0, 0.5, 0])))
    vehicle = Vehicle(motor_lag_s=np.array([0, 0, 0, 0, 0.03]))
    yaw_rad = np.array([0, 0.8, 0, 0, 0])
    flight = Flight(CASE, flights=5, yaw_rad=yaw_rad, vehicle=vehicle, disturbances=push)
    found = indices("mambo", "float32", flight)
    assert np.all(PRINTED_PD / found[:, 0] >= (20, 300, 300, 20))
    assert np.all(found[0] < 5)


def test_other_scalars_fly_like_float64() -> None:
    """The indices of Table II differ from those of float64 by at most a tenth."""
    found = {scalar: indices("mambo", scalar, Flight(CASE, duration_s=30.0)) for scalar in SCALARS}
    for scalar in ("float32", "fixed"):
        np.testing.assert_allclose(found[scalar], found["float64"], rtol=0.1, err_msg=scalar)


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


WITHDRAWN = """
horizon = { prediction = 6, control = 1, prediction_step_s = 0.08637 }
model = { roll_lag_s = 0.3037, pitch_lag_s = 0.05266 }
cost.effort_weight = 2027.0
optimizer = { iterations = 4, initial_step_rad = 0.01142, warm_start = "plan" }
"""
"""Settings that fly the figure at heading 0, and away from it at others (docs/evidence/tuning.md)."""


def largest_errors_m(settings: Settings, headings: int) -> np.ndarray:
    """Return the largest error (headings,) on the figure of eight at headings around the whole turn, 30 s."""
    turns = np.arange(headings) / headings
    scenarios = [Scenario(yaw_rad=float(turn), duration_s=30.0) for turn in 2.0 * np.pi * turns]
    flight = flight_of(scenarios, settings.horizon.update_period_s)
    return measure(fly(flight, CompiledController(settings, headings))).max_error_m


@pytest.mark.parametrize("name", ["mambo", "table1"])
def test_preset_stays_with_its_target_at_every_heading(name: str) -> None:
    """With the true state no heading takes the drone more than 0.3 m from its target."""
    assert largest_errors_m(presets.load(name), 32).max() < 0.3


def test_these_flights_tell_settings_that_fly_away() -> None:
    """The withdrawn settings hold heading 0 and leave the path by metres at others."""
    errors = largest_errors_m(parse(WITHDRAWN, "withdrawn"), 32)
    assert errors[0] < 0.3
    assert np.sum(errors > 5.0) >= 5
