"""What C of a simulator calls in place of `Controller.step`, called here through its addresses."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_nmpc import Controller, DroneState, TargetState
from mambo_sil.api.handles import ControllerHandles, as_address, is_native, target_rows
from mambo_sil.flight.columns import SPACE, STATE
from mambo_sil.flight.controllers.controller_library import ffi

DRONES = 3


def state_of(rng: np.random.Generator) -> DroneState:
    """Return drones near the origin."""
    position, velocity, attitude = (rng.normal(0.0, spread, (DRONES, 3)) for spread in (1.0, 0.5, 0.1))
    return DroneState(position, velocity, attitude, [False, True, False])


def target_of(rng: np.random.Generator) -> TargetState:
    """Return targets near the origin, with accelerations."""
    position, velocity, acceleration = (rng.normal(0.0, spread, (DRONES, 3)) for spread in (1.0, 0.5, 1.0))
    return TargetState(position, velocity, acceleration, np.zeros(DRONES))


def state_rows(state: DroneState) -> Any:
    """Return states in the columns of the closed loop."""
    rows = np.zeros((DRONES, SPACE.state))
    rows[:, STATE["position_m"]] = state.position_m[:, :2]
    rows[:, STATE["velocity_m_s"]] = state.velocity_m_s[:, :2]
    for axis, name in enumerate(("roll_rad", "pitch_rad", "yaw_rad")):
        rows[:, STATE[name].start] = state.attitude_rad[:, axis]
    rows[:, STATE["height_m"].start] = -state.position_m[:, 2]
    rows[:, STATE["climb_m_s"].start] = -state.velocity_m_s[:, 2]
    rows[:, STATE["on_ground"].start] = state.on_ground
    return rows


@pytest.mark.parametrize("scalar", ["float32", pytest.param("fixed", marks=pytest.mark.long)])
def test_the_functions_behind_the_addresses_do_what_a_step_does(scalar: Any) -> None:
    """Commands and headings bit for bit, from a reset on; both ways may be mixed."""
    designed = Controller.from_vehicle("crazyflie", sensors="true").settings
    settings = with_option(designed, "code.scalar", scalar)
    ours, theirs = (Controller(settings, DRONES) for _ in range(2))
    handles, rng = ControllerHandles(theirs), np.random.default_rng(1)
    found = handles.members
    step = ffi.cast("int64_t(*)(void *, const double *, const double *, double, double *)", found["step"])
    reset = ffi.cast("void(*)(void *, int, const void *, int *)", found["reset"])
    slew = ffi.cast("void(*)(int, const double *, const double *, double, double *)", found["slew_heading"])
    status = ffi.new("int *")
    for update in range(20):
        state, target = state_of(rng), target_of(rng)
        if update == 10:
            ours.reset()
            handles.headings_rad()[:] = np.nan
            for drone in range(DRONES):
                memory = ffi.cast("char *", found["controllers"]) + drone * found["controller_bytes"]
                reset(memory, 1, ffi.cast("void *", found["hover"]), status)
                assert status[0] == 0
        expected = ours.step(state, target)
        if update % 2 == 0:
            outcome = theirs.step(state, target)
            np.testing.assert_array_equal(outcome.thrust_m_s2, expected.thrust_m_s2)
            theirs_rad = outcome.yaw_rad
        else:
            rows, targets, command = state_rows(state), target_rows(target), np.empty(SPACE.command)
            for drone in range(DRONES):
                memory = ffi.cast("char *", found["controllers"]) + drone * found["controller_bytes"]
                pointers = (ffi.from_buffer("double[]", row) for row in (rows[drone], targets[drone]))
                assert step(memory, *pointers, np.nan, ffi.from_buffer("double[]", command)) == 0
                np.testing.assert_array_equal(command[:2], expected.command_rad[drone])
                np.testing.assert_array_equal(command[2], np.asarray(expected.thrust_m_s2)[drone])
            kept_rad = np.array(theirs_rad)
            headings = handles.headings_rad()
            address = ffi.cast("double *", headings.ctypes.data)
            wanted = np.zeros(DRONES)
            slew(DRONES, address, ffi.from_buffer("double[]", wanted), found["most_turn_rad"], address)
            np.testing.assert_array_equal(headings, expected.yaw_rad)
            np.testing.assert_array_equal(theirs_rad, kept_rad)  # what a step has returned stays


def test_a_controller_that_needs_python_is_not_native() -> None:
    """One with an altitude loop in Python."""
    assert is_native(Controller.from_vehicle("crazyflie", sensors="true"))
    assert not is_native(Controller.from_vehicle("crazyflie-flown", height="pid"))
    assert as_address(ffi.NULL) == 0
