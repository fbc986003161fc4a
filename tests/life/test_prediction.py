"""The state that the controller gets over a link with a delay: that in which its command finds the drone."""

import math

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2, hover_thrust
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.life.prediction import DelayPrediction
from mambo_sil.life.records import EstimatedState
from tests.support.derived import settings_for
from tests.support.links import drone

DELAY_S, HEADING_RAD = 0.1, 0.7
PUSH_M_S2 = np.array([1.5, -0.8])
TICKS = 10
"""Of the drone in a period of 10 ms."""


def prediction(delay_s: float = DELAY_S) -> DelayPrediction:
    """Return the prediction of a pilot of the drone over a link."""
    settings = settings_for(drone())
    assert settings.height is not None
    found = DelayPrediction(settings, settings.height, hover_thrust(settings))
    found.delay_s = delay_s
    return found


def command(time_s: float) -> FloatArray:
    """Return the roll and pitch (2,) commanded at a time."""
    return np.array([0.2 * math.sin(2.0 * time_s), 0.15 * math.sin(3.0 * time_s + 1.0)])


def flight(seconds: float) -> list[EstimatedState]:
    """Return the states, one every 10 ms, of the drone of the settings in wind; a command acts 200 ms later.

    Its thrust carries it at every tilt.
    """
    model, states, step_s = settings_for(drone()).model, list[EstimatedState](), 0.01 / TICKS
    position_m, velocity_m_s, tilt_rad = np.zeros(3), np.zeros(3), np.zeros(2)
    s, c = math.sin(HEADING_RAD), math.cos(HEADING_RAD)
    for tick in range(round(seconds / step_s)):
        time_s = tick * step_s
        if tick % TICKS == 0:
            attitude_rad = np.array([*tilt_rad, HEADING_RAD])
            states.append(EstimatedState(time_s, position_m, velocity_m_s, attitude_rad))
        heard_s = time_s - 2.0 * DELAY_S - model.roll_delay_s
        goal_rad = command(math.floor(heard_s / 0.01 + 1e-6) * 0.01)
        tilt_rad = goal_rad + math.exp(-step_s / model.roll_lag_s) * (tilt_rad - goal_rad)
        roll_rad, pitch_rad = tilt_rad.tolist()
        ahead, right = (
            -GRAVITY_M_S2 * math.tan(pitch_rad),
            GRAVITY_M_S2 * math.tan(roll_rad) / math.cos(pitch_rad),
        )
        change_m_s2 = np.array([c * ahead - s * right, s * ahead + c * right, 0.0])
        change_m_s2[:2] += PUSH_M_S2 - model.drag_1_s * velocity_m_s[:2]
        position_m = position_m + step_s * velocity_m_s
        velocity_m_s = velocity_m_s + step_s * change_m_s2
    return states


@pytest.mark.parametrize("hover_m_s2", [9.81, 10.4])
def test_the_state_of_a_link_with_a_delay_is_that_of_the_time_when_the_command_acts(
    hover_m_s2: float,
) -> None:
    """Over 100 ms each way, on a curve in wind, where the thrust of hover is 6 % wrong too."""
    states, told, ahead = flight(2.0), prediction(), round(2.0 * DELAY_S / 0.01)

    def send(time_s: float) -> None:
        tilt_rad = command(time_s)
        told.sent(time_s, tilt_rad, hover_m_s2 / float(np.prod(np.cos(tilt_rad))), 0.01)

    for number in range(-900, 0):
        send(0.01 * number)
    for state, later in zip(states, states[ahead:], strict=False):
        found = told.ahead(state, PUSH_M_S2)
        np.testing.assert_allclose(found.position_m, later.position_m, atol=0.01)
        np.testing.assert_allclose(found.velocity_m_s, later.velocity_m_s, atol=0.05)
        np.testing.assert_allclose(found.attitude_rad, later.attitude_rad, atol=0.01)
        send(state.time_s)


def test_the_state_of_a_quick_link_stays_as_it_came() -> None:
    """Bit for bit, up to 10 ms each way."""
    state = flight(0.01)[0]
    assert prediction(0.01).ahead(state, PUSH_M_S2) is state
    assert prediction(0.011).ahead(state, PUSH_M_S2) is not state
