"""Fixed point: formats that cannot overflow, refusals that say what would fit, conversions."""

import re
import subprocess
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as profile
from numpy.typing import NDArray

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.formats import formats
from mambo_codegen.methods.one_norm.horizon import horizon_tables
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.numbers.fixed_point import LARGEST, raw
from mambo_codegen.numbers.representation import COMMAND, STATE, TARGET, THRUST, WEIGHTS
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse, with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library
from mambo_sil.verify.calls import ApiFunction, Tape, answers, calls
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.strategies import Values, faults_of, toml, valid_values
from tests.support.subjects import played_fault, subject
from tests.support.tools import require, toolchain

MAMBO = with_option(ONE_NORM, "code.scalar", "fixed", "test")
SETTINGS = {
    "mambo": MAMBO,
    "table1-printed": with_option(presets.load("table1-printed"), "code.scalar", "fixed", "test"),
} | {f"case {index}": settings_case(index, "fixed") for index in range(12)}
FAULT = re.compile(r"slow\.toml: (\S+) = .*(?:write a smaller (\S+)|at (?:least|most) (\S+)(?: with .*)?)")
"""A refusal by fixed point: the key, and of what to write less, or a value that fits."""
MOST_ROUNDS = 4
"""Refusals that a user meets one after the other."""
SMALLER = {"cost.tracking_weight": 1000, "cost.effort_weight": 1000, "horizon.prediction_step_s": 10}
"""By what a key is divided where a refusal asks for less."""
CONVERSIONS = Path(__file__).parents[1] / "support" / "conversions.c"
WATCH = ("-O1", "-g", "-fsanitize=undefined", "-fno-sanitize-recover=all")


def extremes(settings: Settings, n: int) -> list[Tape]:
    """Step n controllers through the ends of all ranges, from commands and with weights at theirs."""
    rng, method, ranges = np.random.default_rng(0), OneNorm(settings), settings.ranges

    def ends(count: int) -> NDArray[np.float64]:
        return rng.choice([-1.0, 1.0], (n, count))

    columns = []
    bounds = np.array([ranges.position_m] * 2 + [ranges.velocity_m_s] * 2 + [3.25] * 2)
    for step in range(8):
        if step % 3 == 0:
            weights = rng.choice([0.0, 1.0], (n, 2)) * np.array(method.weight_limits)
            columns.append(calls(settings, ApiFunction.RESET, ends(2) * settings.limits.tilt_rad))
            columns.append(calls(settings, ApiFunction.SET_WEIGHTS, weights))
        state = ends(6) * bounds
        target = -state[:, :4]
        near = rng.random((n, 1)) < 0.5  # so near that errors change their sign on the way
        target = np.where(near, state[:, :4] * [1, 1, -1, -1] - ends(4) * [1e-3, 1e-3, 0, 0], target)
        target = np.clip(target, -bounds[:4], bounds[:4])
        yaw = rng.uniform(-1, 1, (n, 1)) * rng.choice([1024.0, np.pi], (n, 1))
        thrust = np.full((n, 1), ranges.thrust_acceleration_max_m_s2)
        columns.append(
            calls(settings, ApiFunction.STEP, np.concatenate([state, yaw, target, thrust], axis=1))
        )
    return list(np.stack(columns, axis=1))


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "name",
    [
        name if name in {"mambo", "case 0", "case 3"} else pytest.param(name, marks=pytest.mark.long)
        for name in SETTINGS
    ],
)
def test_nothing_overflows_at_the_ends_of_all_ranges(name: str, tmp_path: Path) -> None:
    """Nothing undefined, no step refused, and the bits of the reference, which computes in 64 bits."""
    settings = SETTINGS[name]
    require("gcc", "gcc")
    tapes = extremes(settings, 200)
    expected = answers(settings, tapes)
    assert all(np.all(outcome["status"] == Status.OK) for outcome in expected)
    assert played_fault(subject(settings, tmp_path), *WATCH, played=(tapes, expected)) is None


@pytest.mark.parametrize("name", SETTINGS)
def test_intermediates_use_their_formats(name: str) -> None:
    """Bounds are not lavish: the position's difference, gains and angles leave at most two bits unused."""
    settings = SETTINGS[name]
    found, ranges = formats(settings, horizon_tables(settings)), settings.ranges
    gain = ranges.thrust_acceleration_max_m_s2 * settings.horizon.prediction_step_s**2
    for value, bits in (
        (2 * ranges.velocity_m_s, found.velocity),
        (gain, found.gain),
        (3.25, found.angle + (settings.limits.tilt_rad * 2 > 3.25)),
        (ranges.thrust_acceleration_max_m_s2, found.thrust),
    ):
        assert 2**29 <= raw(value, bits) < 2**31
    assert found.position <= found.error < found.acceleration


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[cost]\ntracking_weight = 0.01\neffort_weight = 5000.0",
            "cost.tracking_weight = 0.01 is too small compared with cost.effort_weight = 5000",
        ),
        (
            "[cost]\ntracking_weight = 1e6\neffort_weight = 1e-5",
            "cost.effort_weight = 1e-05 is too small compared with cost.tracking_weight = 1e+06",
        ),
        ("[optimizer]\ntolerance = 1e-12", "optimizer.tolerance = 1e-12 must be 0 or at least"),
        ("[optimizer]\nstep_min_rad = 1e-9", "optimizer.step_min_rad = 1e-09 must be at least 1.87e-09"),
        (
            "[horizon]\nprediction = 50\nprediction_step_s = 1.0\n[model]\nroll_lag_s = 0.5\n"
            "[limits]\ntilt_rad = 1.2\n[ranges]\nthrust_acceleration_max_m_s2 = 1000.0",
            "ranges.thrust_acceleration_max_m_s2 = 1000.0 lets errors reach",
        ),
    ],
)
def test_what_fixed_point_cannot_hold_is_refused_with_what_it_can(text: str, message: str) -> None:
    """Key, value, rule; floating point takes the same settings."""
    parse(text, "x.toml")
    with pytest.raises(InvalidSettingsError) as refused:
        parse(f'{text}\n[code]\nscalar = "fixed"', "x.toml")
    assert message in str(refused.value)


def test_the_value_that_a_refusal_names_is_taken() -> None:
    """The nearest weight that fits, rounded up to three digits, is accepted; a tenth less is not."""
    text = '[cost]\ntracking_weight = {}\neffort_weight = 5000.0\n[code]\nscalar = "fixed"'
    with pytest.raises(InvalidSettingsError) as refused:
        parse(text.format(0.01), "x.toml")
    fits = float(str(refused.value).rpartition("at least ")[2])
    parse(text.format(fits), "x.toml")
    with pytest.raises(InvalidSettingsError):
        parse(text.format(0.9 * fits), "x.toml")


@pytest.mark.long
@profile(max_examples=40)
@given(valid_values())
def test_any_refusal_has_a_way_out(values: Values) -> None:
    """Whatever floating point takes: with what refusals name in its place, fixed point takes it as well."""
    wanted = values | {"code.scalar": "fixed"}
    for _ in range(MOST_ROUNDS):
        for fault in faults_of(toml(wanted)):
            named = FAULT.fullmatch(fault)
            assert named is not None, fault
            key, other, value = named.groups()
            wanted |= {other: wanted[other] / SMALLER[other]} if other else {key: float(value)}
    assert faults_of(toml(wanted)) == []


def test_numbers_are_the_nearest_ties_away_from_zero() -> None:
    """Half a number up is the next one, down the one below; what no format holds is the largest."""
    numbers = OneNorm(MAMBO).numbers
    unit = 2.0 ** -asdict(formats(MAMBO, horizon_tables(MAMBO)))["position"]
    given = np.array([0.0, 0.49, 0.5, 1.5, -0.5, -0.51, -1.5, 7.0])[:, None] * unit
    assert numbers.quantize(given, ("position",))[:, 0].tolist() == [0, 0, 1, 2, -1, -1, -2, 7]
    for beyond in (np.nan, np.inf, -np.inf, 1e30, -1e30, 2.0**31 * unit, -(2.0**31) * unit):
        assert numbers.quantize([[beyond]], ("position",))[0, 0] == LARGEST


def test_numbers_mean_what_was_given() -> None:
    """To and fro, every number is itself."""
    numbers = OneNorm(MAMBO).numbers
    for quantities in (STATE, TARGET, THRUST, COMMAND, WEIGHTS):
        given = np.random.default_rng(0).integers(-LARGEST + 1, LARGEST, (1000, len(quantities)), np.int32)
        assert np.array_equal(numbers.quantize(numbers.to_si(given, *quantities), quantities), given)


@pytest.mark.long
def test_floats_and_constants_in_c_convert_like_the_reference(tmp_path: Path) -> None:
    """Interface with floats, macros of nmpc.h: statuses, commands and costs of the nearest numbers."""
    gcc = require("gcc", "gcc")
    bundle = subject(MAMBO, tmp_path).bundle
    sources = [*bundle.glob("*.c"), CONVERSIONS]
    flags = [*COMPILE_FLAGS, "-Wall", "-Wextra", "-Werror", f"-I{bundle}"]
    subprocess.run([gcc, *flags, *sources, "-o", "convert"], cwd=tmp_path, check=True)
    rng = np.random.default_rng(0)
    rows = rng.normal(0, 1, (500, 12)).astype(np.float32)
    rows[:, 4:6] *= 0.2
    rows[:, 11] = 9.81 + rows[:, 11]
    rows[::7, :] = np.where(
        rng.random((72, 12)) < 0.1, rng.choice([np.nan, np.inf, -1e30], (72, 12)), rows[::7]
    )
    done = subprocess.run(
        [tmp_path / "convert"], input=rows.tobytes(), capture_output=True, check=True
    ).stdout

    numbers = OneNorm(MAMBO).numbers
    constants = [(-1.5, "position"), (0.1, "velocity"), (-0.3, "angle"), (3.14159, "yaw"), (9.81, "thrust")]
    constants += [(123.4, "tracking"), (0.7, "effort")]
    expected = [int(numbers.quantize([[value]], (quantity,))[0, 0]) for value, quantity in constants]
    assert np.frombuffer(done[:28], np.int32).tolist() == expected

    found = np.frombuffer(done[28:], np.float32).reshape(-1, 4)
    controller = OneNormController(OneNorm(MAMBO))
    for row, (status, roll, pitch, cost) in zip(rows, found, strict=True):
        step = controller.step(row[None, :7], row[None, 7:11], row[11:])
        assert status == step.status[0]
        assert [roll, pitch, cost] == [*step.command_rad[0].astype(np.float32), np.float32(step.cost[0])]
    assert 0 < np.count_nonzero(found[:, 0]) < len(found)


def test_an_error_beyond_the_horizon_s_reach_moves_like_one_within() -> None:
    """Clamping far errors changes the reported cost alone: command, gradient and convergence are the same."""
    numbers, found = OneNorm(MAMBO).numbers, formats(MAMBO, horizon_tables(MAMBO))
    limit_m = float(numbers.to_si(np.array([found.error_limit]), "position")[0])
    assert limit_m < MAMBO.ranges.position_m
    state = np.zeros((2, 7))
    state[:, 2:7] = [30.0, -20.0, 0.3, -0.2, 1.0]
    state[:, 0] = limit_m, limit_m + 500.0
    step = CompiledController(MAMBO, 2, build_library(MAMBO, toolchain("gcc"))).step(
        state, np.zeros((2, 4)), np.full(2, 9.81)
    )
    for values in (step.command_rad, step.gradient, step.converged, step.cost):
        assert np.array_equal(values[0], values[1])


def test_a_changed_value_obeys_the_rule_between_sections() -> None:
    """`with_option` refuses what a file with that value would be refused for."""
    with pytest.raises(InvalidSettingsError, match=r"cost.effort_weight = 1e-06 is too small"):
        with_option(MAMBO, "cost.effort_weight", 1e-6)
