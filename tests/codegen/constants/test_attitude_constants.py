"""The constants of attitude model and observer against their definitions: programmes, differences, roots."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, linprog
from scipy.spatial.transform import Rotation

from mambo_codegen.methods.quadratic.attitude_constants import MOST_WEIGHT, AttitudeConstants
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import TWO_MOVES, settings_of
from tests.support.strategies import Values

GAINS, TRIMS_RAD, SHARE, PERIOD_S, LIMIT_RAD = (0.8, 1.15), (-0.03, 0.05), 0.9, 0.02, 0.4
DRONE: Values = {
    "model.acceleration_per_tilt": SHARE,
    "horizon.update_period_s": PERIOD_S,
    "limits.tilt_rad": LIMIT_RAD,
    "model.roll_gain": GAINS[0],
    "model.pitch_gain": GAINS[1],
    "model.roll_trim_rad": TRIMS_RAD[0],
    "model.pitch_trim_rad": TRIMS_RAD[1],
}


def settings_with(values: Values, *, height: bool = False) -> Settings:
    """Return settings of a drone with gains and trims."""
    return settings_of((CRAZYFLIE if height else TWO_MOVES) | DRONE | values)


def attitude_of(settings: Settings) -> AttitudeConstants:
    """Return the constants of the attitude model."""
    return Quadratic(settings).attitude


def in_steps(acceleration_m_s2: float, period_s: float = PERIOD_S) -> float:
    """Return the second difference of the places of a body at updates."""
    return float(np.diff(0.5 * acceleration_m_s2 * (period_s * np.arange(3)) ** 2, n=2)[0])


def acceleration_m_s2(axis: int, command_rad: float, trims_rad: Any = TRIMS_RAD) -> float:
    """Return the acceleration of a steady command."""
    return float(GRAVITY_M_S2 * SHARE * (GAINS[axis] * command_rad - trims_rad[axis]))


@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
def test_commands_and_accelerations_are_each_other_s_inverse(axis: int) -> None:
    """By differences of the acceleration of a command, and where it is 0; of measured tilts likewise."""
    found = attitude_of(settings_with({}))
    slope_m_s2 = (acceleration_m_s2(axis, 0.1) - acceleration_m_s2(axis, -0.1)) / 0.2
    assert found.command_gain_m_step2_rad[axis] == pytest.approx(in_steps(slope_m_s2), rel=1e-12)
    assert found.command_rad_step2_m[axis] * in_steps(slope_m_s2) == pytest.approx(1.0, rel=1e-12)
    level_rad = brentq(lambda command_rad: acceleration_m_s2(axis, command_rad), -0.3, 0.3)
    assert found.trim_command_rad[axis] == pytest.approx(level_rad, rel=1e-9)
    assert found.gain_m_step2_rad == pytest.approx(in_steps(slope_m_s2 / GAINS[axis]), rel=1e-12)
    assert found.trim_rad[axis] == pytest.approx(GAINS[axis] * level_rad, rel=1e-9)


def largest_m_s2(axis: int, trims_rad: Any = TRIMS_RAD) -> list[float]:
    """Return the largest acceleration either way by commands within the limit, by linear programmes."""
    slope, rest = GRAVITY_M_S2 * SHARE * GAINS[axis], GRAVITY_M_S2 * SHARE * trims_rad[axis]
    both = [linprog([-sign * slope], bounds=[(-LIMIT_RAD, LIMIT_RAD)]) for sign in (1, -1)]
    return [-one.fun - sign * rest for one, sign in zip(both, (1, -1), strict=True)]


def test_the_limit_of_a_move_is_what_commands_give_either_way() -> None:
    """The smaller of both ways."""
    found = attitude_of(settings_with({})).command_limit_m_step2
    assert found == pytest.approx([in_steps(min(largest_m_s2(axis))) for axis in range(2)], rel=1e-12)


@pytest.mark.parametrize("height", [False, True])
def test_no_state_of_the_model_is_beyond_its_limit(height: bool) -> None:
    """Over the largest acceleration of any command it is that of a drone without trim, of either sign."""
    plain = settings_with(dict.fromkeys(("model.roll_trim_rad", "model.pitch_trim_rad"), 0.0), height=height)
    reference = attitude_of(plain).limit_m_step2 / in_steps(
        max(max(largest_m_s2(axis, (0.0, 0.0))) for axis in range(2))
    )
    for trims_rad in (TRIMS_RAD, (0.06, -0.01), (-0.19, 0.0), (0.19, 0.0)):
        trims = dict(zip(("model.roll_trim_rad", "model.pitch_trim_rad"), trims_rad, strict=True))
        limit = attitude_of(settings_with(trims, height=height)).limit_m_step2
        most_m_s2 = max(max(largest_m_s2(axis, trims_rad)) for axis in range(2))
        assert limit == pytest.approx(reference * in_steps(most_m_s2), rel=1e-9)
    if height:
        without = settings_of(TWO_MOVES | DRONE)
        lag = {name: getattr(plain.model, name) for name in ("roll_lag_s", "pitch_lag_s")}
        assert lag == {name: getattr(without.model, name) for name in lag}
        assert attitude_of(settings_with({}, height=True)).limit_m_step2 == pytest.approx(
            MOST_WEIGHT * attitude_of(without).limit_m_step2, rel=1e-9
        )


def slopes(roll_rad: Any, pitch_rad: Any) -> Any:
    """Return a rotated thrust, right and forward (n, 2), over its vertical component."""
    tilts = np.stack(np.broadcast_arrays(roll_rad, pitch_rad), axis=-1)
    forward, right, down = Rotation.from_euler("xy", tilts).apply([0.0, 0.0, -1.0]).T
    return np.stack([right, forward], axis=1) / -down[:, np.newaxis]


@pytest.mark.parametrize(
    ("limit_rad", "trims_rad"), [(LIMIT_RAD, TRIMS_RAD), (LIMIT_RAD, (0.06, -0.01)), (0.95, TRIMS_RAD)]
)
def test_limits_of_a_thrust_vector_are_those_of_a_rotated_thrust(limit_rad: float, trims_rad: Any) -> None:
    """Of a move the smaller of both ways; of a state the steepest attitude, at most 1.01 / 0.3."""
    values: Values = {
        "limits.tilt_rad": limit_rad,
        "model.roll_trim_rad": trims_rad[0],
        "model.pitch_trim_rad": trims_rad[1],
    }
    small, exact = (
        attitude_of(settings_with(values | {"model.tilt": tilt}, height=True))
        for tilt in ("small-angle", "exact")
    )
    ends_rad = np.outer([-1.0, 1.0], GAINS) * limit_rad - trims_rad
    rows = slopes(ends_rad[:, 0], 0.0)[:, 0], slopes(0.0, ends_rad[:, 1])[:, 1]
    moves = [in_steps(GRAVITY_M_S2 * SHARE * np.abs(row).min()) for row in rows]
    assert exact.command_limit_m_step2 == pytest.approx(moves, rel=1e-12)
    grid_rad = np.abs(ends_rad).max() * np.linspace(-1.0, 1.0, 41)
    steepest = np.abs(slopes(*(angle.ravel() for angle in np.meshgrid(grid_rad, grid_rad)))).max()
    larger = min(steepest, 1.01 / 0.3) / grid_rad[-1]
    assert exact.limit_m_step2 == pytest.approx(larger * small.limit_m_step2, rel=1e-9)


def test_the_observer_s_constants_are_in_steps() -> None:
    """Of an acceleration, a velocity, a drag and an age; an outage is a number of steps."""
    observer = {
        "observer.disturbance_limit_m_s2": 2.5,
        "model.drag_1_s": 0.3,
        "observer.measurement_age_s": 0.013,
        "observer.outage_s": 0.5,
        "ranges.velocity_m_s": 7.0,
    }
    found = Quadratic(settings_with(observer)).observer
    assert found.disturbance_limit_m_step2 == pytest.approx(in_steps(2.5), rel=1e-12)
    places_m = 7.0 * PERIOD_S * np.arange(2)
    assert found.velocity_limit_m_step == pytest.approx(np.diff(places_m)[0], rel=1e-12)
    slowed_m_step2 = in_steps(0.3 * 7.0)
    assert found.drag_1_step * found.velocity_limit_m_step == pytest.approx(slowed_m_step2, rel=1e-12)
    assert found.age_steps * PERIOD_S == pytest.approx(0.013, rel=1e-12)
    assert isinstance(found.outage_steps, int)
    assert found.outage_steps == len(np.arange(0.0, 0.5 - 1e-9, PERIOD_S))
    assert found.steps_per_s * found.velocity_limit_m_step == pytest.approx(7.0, rel=1e-12)
    assert found.steps2_per_s2 * found.disturbance_limit_m_step2 == pytest.approx(2.5, rel=1e-12)
