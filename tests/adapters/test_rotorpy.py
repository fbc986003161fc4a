"""The controller object that RotorPy's simulator calls, in that simulator."""

import importlib
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.reciprocal import RECIPROCAL_ERROR
from mambo_nmpc import ArgumentError, Controller
from mambo_nmpc.adapters.rotorpy import RotorpyController
from tests.support.tools import require_module

MADE = pytest.mark.parametrize(
    "made",
    [
        lambda: Controller.from_preset("crazyflie", vehicle="crazyflie", height="pid", measurement_age_s=0.0),
        lambda: Controller.from_vehicle("crazyflie", measurement_age_s=0.0),
    ],
    ids=["loop", "axis"],
)
"""With an altitude loop, and with the height as an axis of the controller."""
START_M = np.array([0.0, 0.0, 1.0])


@pytest.mark.first_is_quick
@MADE
def test_a_drone_of_rotorpy_goes_where_it_shall(made: Callable[[], Controller]) -> None:
    """A step of 0.4 m forward and 0.2 m to the left and up, in RotorPy's own closed loop."""
    require_module("rotorpy")
    vehicles: Any = importlib.import_module("rotorpy.vehicles.multirotor")
    quad: Any = importlib.import_module("rotorpy.vehicles.crazyflie_params").quad_params
    environments: Any = importlib.import_module("rotorpy.environments")
    start = {name: np.zeros(3) for name in ("v", "w", "wind")}
    start |= {"x": START_M, "q": np.array([0.0, 0.0, 0.0, 1.0]), "rotor_speeds": np.full(4, 1788.53)}
    vehicle = vehicles.Multirotor(quad, initial_state=start, control_abstraction="cmd_ctatt")
    goal_m = np.array([0.4, 0.2, 1.2])
    rest = {name: np.zeros(3) for name in ("x_dot", "x_ddot", "x_dddot", "x_ddddot")}
    flat = {"x": goal_m, **rest, "yaw": 0.3, "yaw_dot": 0.0}
    flown = environments.Environment(
        vehicle, RotorpyController(made(), quad["mass"]), SimpleNamespace(update=lambda _: flat)
    ).run(t_final=3.0, terminate=False)
    np.testing.assert_allclose(flown["state"]["x"][-1], goal_m, atol=0.05)
    x, y, z, w = flown["state"]["q"][-1]
    np.testing.assert_allclose(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)), 0.3, atol=0.03)


@MADE
def test_each_flight_starts_afresh(made: Callable[[], Controller]) -> None:
    """At time 0; thrust in N and attitude are those of the controller."""
    adapter = RotorpyController(made(), 0.03)
    state = {"x": START_M, "v": np.zeros(3), "q": np.array([0.0, 0.0, 0.0, 1.0])}
    flat = {"x": START_M, "x_dot": np.array([0.5, 0.0, 0.0])}
    first = adapter.update(0.0, state, flat)
    np.testing.assert_allclose(first["cmd_thrust"], 0.03 * 9.81, rtol=RECIPROCAL_ERROR)
    assert first["cmd_q"][1] > 0.0  # nose down
    assert (adapter.update(0.01, state, flat)["cmd_q"] != first["cmd_q"]).any()
    assert (adapter.update(0.0, state, flat)["cmd_q"] == first["cmd_q"]).all()


@pytest.mark.parametrize(
    ("ground", "height_m", "idle"), [(True, 0.0, True), (True, 0.1, False), (False, 0.0, False)]
)
def test_a_drone_on_the_ground_idles(ground: bool, height_m: float, idle: bool) -> None:
    """If the vehicle has one: without, height 0 is a height as others."""
    adapter = RotorpyController(
        Controller.from_vehicle("crazyflie", measurement_age_s=0.0), 0.03, enable_ground=ground
    )
    here = np.array([0.0, 0.0, height_m])
    state = {"x": here, "v": np.zeros(3), "q": np.array([0.0, 0.0, 0.0, 1.0])}
    thrust_n = adapter.update(0.0, state, {"x": here, "x_dot": np.zeros(3)})["cmd_thrust"]
    assert (thrust_n < 0.03 * 3.0) == idle


@pytest.mark.long
def test_wrong_arguments_are_refused() -> None:
    """By name."""
    with pytest.raises(ArgumentError, match="controller: was made for 2 drones; RotorPy simulates one"):
        RotorpyController(Controller.from_vehicle("crazyflie", 2), 0.03)
    with pytest.raises(ArgumentError, match="mass_kg = 0 must lie in"):
        RotorpyController(Controller.from_vehicle("crazyflie"), 0)
