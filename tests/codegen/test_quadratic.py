"""Constants of a quadratic cost: against SciPy, against a simulated cost, and the same digits anywhere."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.riccati import mp, solve_riccati, sum_costs
from mambo_codegen.settings.model import Settings
from tests.support.golden_gains import GOLDEN
from tests.support.quadratic import (
    ANGLES,
    MAMBO_LOOPS,
    ONE_MOVE,
    TWO_MOVES,
    Array,
    attitude_model,
    axis_of,
    closed_loop,
    settings_of,
    settling_steps,
    two_move_cost,
)

ROOT = Path(__file__).parents[2]
WITHOUT_FUSED = {"NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3", "OPENBLAS_CORETYPE": "Nehalem"}
CASES = {
    "one move": ONE_MOVE,
    "two moves": TWO_MOVES,
    "velocity weight, no delay": ONE_MOVE
    | {"cost.velocity_weight_s": 0.3, "model.roll_delay_s": 0.0, "model.pitch_delay_s": 0.0},
    "no integrator, 50 Hz, ramp": MAMBO_LOOPS
    | {
        "controller.method": "quadratic",
        "horizon.update_period_s": 0.02,
        "horizon.ramp_s": 0.6,
        "model.roll_integral_1_s": 0.0,
        "model.pitch_integral_1_s": 0.0,
    },
}


@pytest.fixture(params=CASES)
def settings(request: pytest.FixtureRequest) -> Settings:
    """Each of the cases."""
    return settings_of(CASES[request.param])


def in_si(settings: Settings) -> Array:
    """Return the rows of the law (2, moves, 8) for SI units, i being the integral of u - a."""
    scales = np.array([axis_of(settings, angle).scale for angle in ANGLES])
    rows = Quadratic(settings).law.rows
    found: Array = np.divide(rows, scales[:, None], out=np.zeros_like(rows), where=scales[:, None] != 0)
    return found


def test_one_move_is_the_gain_of_the_riccati_equation(settings: Settings) -> None:
    """The row of one free move is SciPy's, to 9 digits."""
    one = settings_of({**CASES["one move"], **_values(settings), "horizon.ramp_s": 0.0})
    for index, angle in enumerate(ANGLES):
        axis = axis_of(one, angle)
        to_go = solve_discrete_are(
            axis.transition, axis.change[:, None], axis.state_cost, np.array([[axis.change_cost]])
        )
        row = np.eye(8)[7] - axis.gain(to_go)
        used = axis.decided
        assert in_si(one)[index, 0][used] == pytest.approx(row[used], rel=1e-9, abs=1e-11)


def _values(settings: Settings) -> dict[str, object]:
    """Return the values in use by their dotted paths."""
    return {
        f"{section}.{name}": value
        for section, names in settings.in_use.items()
        for name, value in names.items()
    }


def test_two_moves_are_the_minimum_of_a_simulated_cost() -> None:
    """Rows and ratios are those of a cost summed over thousands of simulated steps."""
    for values in (TWO_MOVES, CASES["no integrator, 50 Hz, ramp"]):
        settings = settings_of(values)
        law = Quadratic(settings).law
        for index, angle in enumerate(ANGLES):
            axis = axis_of(settings, angle)
            curvature, slope = two_move_cost(axis, settling_steps(settings))
            rows = -np.linalg.solve(curvature, slope)
            used = axis.decided
            assert in_si(settings)[index][:, used] == pytest.approx(rows[:, used], rel=1e-8)
            assert law.ratios[index] == pytest.approx(curvature[0, 1] / curvature[0, 0], rel=1e-9)


def test_a_cost_of_many_steps_is_the_sum_of_its_steps() -> None:
    """Doubling gives what adding does, for every number of steps."""
    transition = mp.matrix([[1, "0.1"], ["-0.2", "0.9"]])
    cost, to_go = mp.diag([1, "0.5"]), mp.diag([3, 2])
    total = to_go
    for steps in range(1, 20):
        total = cost + (transition.T * total * transition)
        assert mp.mnorm(sum_costs(transition, cost, to_go, steps) - total, 1) < 1e-30


def test_observer_has_the_gain_of_the_riccati_equation(settings: Settings) -> None:
    """That of SciPy, to 9 digits."""
    observer, period_s = settings.observer, settings.horizon.update_period_s
    transition = np.array([[1, period_s, period_s**2 / 2], [0, 1, period_s], [0, 0, 1]])
    measured = np.eye(3)[:2]
    process = np.diag(
        [0, observer.acceleration_noise**2 * period_s, observer.disturbance_noise**2 * period_s]
    )
    noise = np.diag([observer.position_noise**2, observer.velocity_noise**2]) / period_s
    spread = solve_discrete_are(transition.T, measured.T, process, noise)
    gain = spread @ measured.T @ np.linalg.inv((measured @ spread @ measured.T) + noise)
    powers = np.array([[period_s ** (row - column) for column in range(2)] for row in range(3)])
    assert Quadratic(settings).observer.gain == pytest.approx(gain * powers, rel=1e-9)


def test_attitude_model_is_the_exact_solution_for_a_held_command(settings: Settings) -> None:
    """Rows and share are those of SciPy's matrix exponential, to 9 digits."""
    attitude = Quadratic(settings).attitude
    for index, angle in enumerate(ANGLES):
        transition, command = attitude_model(settings, angle)
        share = getattr(settings.model, f"{angle}_integral_1_s")
        tilt, integral, lagged = np.column_stack([transition, command])
        tilt_row, integral_row = attitude.tilt_row[index], attitude.integral_row[index]
        assert tilt_row[[0, 2, 3]] == pytest.approx(tilt[[0, 2, 3]], rel=1e-9)
        assert integral_row[[0, 2, 3]] == pytest.approx(share * integral[[0, 2, 3]], rel=1e-9, abs=1e-15)
        assert integral_row[1] == pytest.approx(integral[1], rel=1e-9)
        if share:
            assert tilt_row[1] == pytest.approx(tilt[1] / share, rel=1e-9)
        assert attitude.lagged_row[index] == pytest.approx(lagged[2:], rel=1e-9)


def test_the_limit_bounds_the_model_under_any_commands(settings: Settings) -> None:
    """The worst commands, each with the sign that drives a state furthest, on both axes and turned."""
    attitude = Quadratic(settings).attitude
    for index in range(2):
        lagged = [0, 0, *attitude.lagged_row[index]]
        rows = np.array([attitude.tilt_row[index], attitude.integral_row[index], lagged])
        sums, response = np.zeros(3), rows[:, 3]
        for _ in range(20_000):
            sums += np.abs(response)
            response = rows[:, :3] @ response
        worst = max(1.0, sums.max()) * attitude.command_limit_m_step2[index]
        assert np.hypot(worst, worst) < 2 * worst <= attitude.limit_m_step2 < 2.2 * worst


def test_the_limit_holds_commands_on_either_side_of_the_trim() -> None:
    """A command at the tilt limit against the trim asks for more acceleration than a move may have."""
    trimmed = settings_of({**ONE_MOVE, "limits.tilt_rad": 0.215, "model.roll_trim_rad": 0.2})
    attitude = Quadratic(trimmed).attitude
    assert attitude.limit_m_step2 > 2 * attitude.gain_m_step2_rad * (0.215 + 0.2)
    assert attitude.command_limit_m_step2[0] == pytest.approx(attitude.gain_m_step2_rad * 0.015)


def test_the_spectral_radius_is_that_of_the_loop(settings: Settings) -> None:
    """Of the states that the command moves, with the first move of the rows."""
    for index, angle in enumerate(ANGLES):
        loop = closed_loop(axis_of(settings, angle), in_si(settings)[index, 0])
        radius = np.abs(np.linalg.eigvals(loop)).max()
        assert Quadratic(settings).law.spectral_radius[index] == pytest.approx(radius, abs=1e-7)
        assert radius < 1


def test_riccati_without_a_solution_is_an_error() -> None:
    """A state that grows by itself, which no input moves, drives another that does cost."""
    with pytest.raises(ValueError, match="no stabilising solution"):
        solve_riccati(mp.matrix([[4, 0], [1, 1]]), mp.matrix([0, 1]), mp.eye(2), mp.eye(1))


@pytest.mark.first_is_quick
@pytest.mark.parametrize("processor", [{}, WITHOUT_FUSED], ids=["as it is", "without fused operations"])
def test_constants_have_the_committed_digits(processor: dict[str, str]) -> None:
    """All of them; `python -m tests.support.golden_gains --write` writes them anew."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.support.golden_gains"]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | processor, capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout) == json.loads(GOLDEN.read_text("utf-8"))
