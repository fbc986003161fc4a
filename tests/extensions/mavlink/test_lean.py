"""The lean against wind: it stays where the drone leans to, whatever the estimator says."""

import math
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_extensions.mavlink.pilot_report import write_log
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.states import TargetState
from mambo_sil.life.lean import Lean
from mambo_sil.life.records import EstimatedState, SetAttitude
from mambo_sil.life.steering import Steering, Update
from mambo_sil.model.replay.log_replay import replay_log
from tests.support.links import controller

ROLL_RAD, PITCH_RAD = 0.15, -0.1
TURN_RAD = math.pi / 2.0
PERIOD_S = 0.01


def leaning(time_s: float, heading_rad: float = 0.3, resets: int = 0) -> EstimatedState:
    """Return an estimate of a drone that rests in wind, against which it leans."""
    return EstimatedState(
        time_s, np.zeros(3), np.zeros(3), np.array([ROLL_RAD, PITCH_RAD, heading_rad]), resets
    )


def here(ago_s: float) -> TargetState:  # noqa: ARG001 - it stays
    """Return the place where the drone is."""
    return TargetState(np.zeros(3), np.zeros(3), np.zeros(3))


def push_m_s2(heading_rad: float) -> FloatArray:
    """Return the push (2,) against which the drone leans, if that is its heading."""
    ahead, right = math.tan(PITCH_RAD), -math.tan(ROLL_RAD) / math.cos(PITCH_RAD)
    s, c = math.sin(heading_rad), math.cos(heading_rad)
    return GRAVITY_M_S2 * np.array([c * ahead - s * right, s * ahead + c * right])


def test_a_reset_of_the_heading_turns_the_lean(tmp_path: Path) -> None:
    """By 90 degrees, half a second after the take-over in wind: roll and pitch of the set-points stay.

    They would move by 13 degrees if the lean stayed in the old frame. The log, which has the
    drone upright, repeats the flight.
    """
    updates = list[Update]()
    steering = Steering(controller(), updates.append)
    steering.hover_thrust = steering.mean_thrust = 0.5
    for count in range(150):
        steering.lean.watch(leaning(count * PERIOD_S))
    sent = list[SetAttitude]()
    for count in range(150, 250):
        jumped = count >= 200
        sent.append(steering.steer(leaning(count * PERIOD_S, 0.3 + TURN_RAD * jumped, int(jumped)), here))
    np.testing.assert_allclose(updates[0].estimate.attitude_rad, [0.0, 0.0, 0.3], atol=1e-9)
    tilt_rad = np.array([one.attitude_rad[:2] for one in sent])
    np.testing.assert_allclose(np.diff(tilt_rad, axis=0), 0.0, atol=0.004)
    np.testing.assert_allclose(tilt_rad, [[ROLL_RAD, PITCH_RAD]] * 100, atol=0.02)
    faded = math.exp(-1.0 / 10.0)
    np.testing.assert_allclose(steering.lean.against_m_s2, -faded * push_m_s2(0.3 + TURN_RAD), atol=1e-9)
    write_log(updates, log := tmp_path / "flight.csv")
    replay = replay_log(log, {}, steering.controller.settings)
    assert replay.is_exact
    np.testing.assert_array_equal(replay.replayed_rad, replay.logged_rad)


@pytest.mark.parametrize(
    ("velocity_m_s", "roll_rad"),
    [(math.nan, ROLL_RAD), (math.inf, ROLL_RAD), (0.0, math.nan), (0.0, math.pi / 2.0), (0.0, 3.0)],
)
def test_an_estimate_that_shows_no_push_is_left_out(velocity_m_s: float, roll_rad: float) -> None:
    """One that is not finite, or of a drone on its side: the push is that of the others."""
    lean = Lean(drag_1_s=0.5, most_m_s2=5.0)
    bad = EstimatedState(0.8, np.zeros(3), np.full(3, velocity_m_s), np.array([roll_rad, PITCH_RAD, 0.3]), 0)
    for count in range(200):
        lean.watch(bad if count == 80 else leaning(count * PERIOD_S))
    lean.begin(np.zeros(2))
    np.testing.assert_allclose(lean.against_m_s2, -push_m_s2(0.3), atol=1e-9)
