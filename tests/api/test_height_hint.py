"""The hint that a drone rests beside the height of its target, by an altitude loop without an integral."""

import warnings
from typing import Any

import numpy as np
import pytest

from mambo_nmpc import Controller, DroneState, TargetState
from mambo_sil.flight.names import AltitudeName

GOAL = np.array([[0.0, 0.0, -1.0]] * 2)


def hold(height: AltitudeName, off_m: float, steps: int = 220, **how: Any) -> None:
    """Let two drones rest, of which the second is lower than its target."""
    pilot = Controller.from_preset("crazyflie", 2, vehicle="crazyflie", height=height, age_s=0.0)
    low = GOAL + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, off_m]])
    climb = np.array([0.0, 0.0, how.get("climb_m_s", 0.0)])
    state = DroneState(low, np.zeros((2, 3)) - climb, np.zeros((2, 3)), how.get("grounded", False))
    for _ in range(steps):
        pilot.step(state, TargetState(GOAL, np.zeros((2, 3)) - climb))


@pytest.mark.parametrize(
    ("off_m", "words"),
    [(0.055, "55 mm below its target: it has 8 % less thrust"), (-0.1, "100 mm above .* 15 % more thrust")],
)
def test_a_drone_that_stays_low_is_named_once(off_m: float, words: str) -> None:
    """With the share of the thrust: the gain of 15 1/s^2 times the distance, over 9.81."""
    with pytest.warns(UserWarning, match=words) as said:
        hold("feedforward", off_m, steps=500)
    assert len(said) == 1
    assert "than vehicle crazyflie; write its mass_kg and [thrust]" in str(said[0].message)


@pytest.mark.parametrize(
    ("height", "off_m", "steps", "how"),
    [
        ("pid", 0.055, 500, {}),  # its integral takes it away
        ("feedforward", 0.02, 500, {}),
        ("feedforward", 1.0, 500, {}),  # motors that are not armed
        ("feedforward", 0.055, 190, {}),  # less than 2 s
        ("feedforward", 0.055, 500, {"climb_m_s": 0.2}),
        ("feedforward", 0.055, 500, {"grounded": True}),
    ],
)
def test_nothing_is_said_elsewhere(
    height: AltitudeName, off_m: float, steps: int, how: dict[str, Any]
) -> None:
    """Of a small error, a short one, a climb, the floor, or a loop with an integral."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hold(height, off_m, steps, **how)
