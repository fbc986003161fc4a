"""The linear systems: the C's memory, the sensors' memory, the load, and what leaves no linear system."""

import dataclasses

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import names, preset
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.controller_jacobian import has_linear_law, linear_controller
from mambo_sil.experiment.margins.drone_jacobians import drone_jacobians, repeating_ticks
from mambo_sil.experiment.margins.hover_loop import AT_COMMAND, BY_PUSH, PLACE, SENT, hover_loops
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import SensorsName
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.trajectories import Hover
from tests.support.height_settings import height_settings

SEEN: list[tuple[str, SensorsName]] = [
    ("mambo", "true"),
    ("mambo", "mambo-derotated"),
    ("crazyflie", "mocap"),
]
LINEAR = ["mambo", "crazyflie"]


@pytest.mark.parametrize("name", LINEAR)
def test_linear_controller_commands_what_the_c_commands(name: str) -> None:
    """From the start at hover, 100 steps of small random states give the same commands to 1e-9 rad."""
    settings = with_option(preset(name), "code.scalar", "float64")
    system, controller = linear_controller(settings), CompiledController(settings)
    memory = np.zeros(len(system.a))
    states = 1e-4 * np.random.default_rng(5).standard_normal((100, 7))
    states[:100, 6] = 0.0
    controller.step(np.zeros((1, 7)), np.zeros((1, 9)), np.array([GRAVITY_M_S2]))
    for state in states:
        sent = controller.step(state[np.newaxis], np.zeros((1, 9)), np.array([GRAVITY_M_S2])).command_rad[0]
        assert system.c @ memory + system.d @ state == pytest.approx(sent, abs=1e-8)
        memory = system.a @ memory + system.b @ state


def test_a_1_norm_is_no_linear_system() -> None:
    """Presets with a 1-norm have none; there are both kinds."""
    found = {name: has_linear_law(preset(name)) for name in names()}
    assert found == {name: preset(name).controller.method == "quadratic" for name in names()}
    assert {True, False} == set(found.values())


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("drone", "sensors"), SEEN)
def test_response_to_a_push_is_that_of_a_flight(
    drone: str, sensors: SensorsName, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A small steady push moves the drone as the linear loop says, through sensors without noise too.

    The accelerometer does not correct the tilt, as noise does not let it in flight.
    """
    monkeypatch.setattr("mambo_sil.drone.sensors.estimators.TILT_GATE", 0.0)
    settings = with_option(preset(drone), "code.scalar", "float64")
    vehicle, push_m_s2 = Vehicle.from_preset(drone), 1e-3
    seen = choose_sensors(sensors, vehicle.drone, noise_scale=0.0)
    flight = Flight(
        Hover(),
        duration_s=3.0,
        vehicle=vehicle,
        sensors=seen,
        update_period_s=settings.horizon.update_period_s,
        disturbances=Disturbances(push_m_s2=(push_m_s2, 0.0)),
    )
    trace = fly(flight, CompiledController(settings))
    (loops,) = hover_loops(settings, dataclasses.replace(flight, disturbances=Disturbances()))
    loop, ticks = loops[1], flight.ticks_per_update
    state, moved = np.zeros(loop.transition.shape[1]), []
    for tick in range(ticks * (len(trace.time_s) - 1) + 1):
        phase = tick % len(loop.transition)
        if tick % ticks == 0:
            moved.append(loop.outputs[phase, PLACE] @ state)
        state = loop.transition[phase] @ state + push_m_s2 * loop.inputs[phase, :, BY_PUSH]
    assert np.abs(trace.position_m[:, 0, 0]).max() > 4e-5
    assert np.array(moved) == pytest.approx(trace.position_m[:, 0, 0], abs=1e-8)


def test_sensors_repeat_after_ten_ticks() -> None:
    """The camera takes three images in ten ticks; motion capture, one position for each update."""
    found = []
    for drone, sensors in SEEN:
        vehicle = Vehicle.from_preset(drone)
        flight = Flight(Hover(), vehicle=vehicle, sensors=choose_sensors(sensors, vehicle.drone))
        found.append(repeating_ticks(flight))
        assert drone_jacobians(flight).transition.shape[1] == found[-1]
    assert found == [2, 10, 5]


def test_axes_are_separate_and_small() -> None:
    """The loop of an axis has no state of the other: at most 35 of the 136 numbers through sensors."""
    vehicle = Vehicle.from_preset("mambo")
    flight = Flight(Hover(), vehicle=vehicle, sensors=choose_sensors("mambo-derotated", vehicle.drone))
    found = drone_jacobians(flight)
    assert found.outputs.shape == (1, 10, 11, 108)
    (loops,) = hover_loops(preset("mambo"), flight)
    for loop in loops:
        assert loop.transition.shape[1] <= 35
        assert loop.response(np.array([1.0]))[0, SENT, AT_COMMAND] != 0.0


def test_a_narrow_fence_changes_nothing_midway() -> None:
    """Between walls 10 cm apart the four matrices are those without walls, to 1e-6 of their largest number.

    At a wall, and outside, the climb is limited on one side.
    """
    free = height_settings()
    walled = with_option(with_option(free, "limits.fence.ceiling_m", 1.1), "limits.fence.floor_m", 1.0)
    found, expected = linear_controller(walled), linear_controller(free)
    for name in ("a", "b", "c", "d"):
        right = getattr(expected, name)
        assert getattr(found, name) == pytest.approx(right, rel=0.0, abs=1e-6 * np.abs(right).max())


@pytest.mark.parametrize(
    ("settings", "load"),
    [
        (height_settings(delay_s=0.0), 1.2),
        (height_settings(delay_s=0.05), 1.2),
        (with_option(height_settings(), "observer.measurement_age_s", 0.024), 1.1),
    ],
    ids=["thrust without delay", "thrust with delay", "old state"],
)
def test_a_load_that_is_learnt_multiplies_the_thrust(settings: Settings, load: float) -> None:
    """The target's acceleration asks for as many times more thrust as the drone is heavier.

    A drone whose thrust or state were not as late as the settings say would not come to rest.
    """
    reference = Quadratic(settings).reference_controller(1)
    motion = reference.parts.target_observer.stored(reference.memory.target)
    acceleration = (
        6 + 10 + sum(one.shape[1] for one in motion) + 13
    )  # behind observer, attitude, target, height
    light, heavy = (linear_controller(settings, one).c[2, acceleration] for one in (1.0, load))
    assert light > 1.0
    assert heavy == pytest.approx(load * light, rel=1e-4)


def test_a_drone_that_falls_is_not_at_hover() -> None:
    """Also one whose controller learns nothing, which need not be at its target."""
    with pytest.raises(FlightError, match=r"hovers with 3 times the expected thrust does not hold"):
        linear_controller(height_settings(learnt="none"), 3.0)
