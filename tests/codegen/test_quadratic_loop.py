"""The controller with a quadratic cost in closed loop with the plant that it models, and in bad weather."""

from collections.abc import Callable

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.controller import QuadraticController, QuadraticStep
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.model import Settings
from tests.support.quadratic import (
    ANGLES,
    ONE_MOVE,
    TWO_MOVES,
    Array,
    axis_of,
    case_values,
    settings_of,
    told,
)
from tests.support.strategies import Values

G_M_S2, HOVER = 9.81, 9.81
EXACT = TWO_MOVES | {"code.scalar": "float64"}


class LinearDrone:
    """One drone that obeys the model: [e, v, w, j, a, i, c, u] along each axis of its heading."""

    def __init__(
        self, settings: Settings, yaw_rad: float = 0.0, disturbance_m_s2: tuple[float, float] = (0, 0)
    ) -> None:
        self._axes = [axis_of(settings, angle) for angle in ANGLES]
        self._sine, self._cosine = np.sin(yaw_rad), np.cos(yaw_rad)
        self._model, self._yaw_rad = settings.model, yaw_rad
        self.states = np.zeros((2, 8))
        self._held = self._to_heading(np.array(disturbance_m_s2))

    def _to_heading(self, world: Array) -> Array:
        x, y = world
        return np.array([(y * self._cosine) - (x * self._sine), (x * self._cosine) + (y * self._sine)])

    def put(self, position_m: tuple[float, float], velocity_m_s: tuple[float, float] = (0, 0)) -> None:
        """Set position and velocity in the world."""
        self.states[:, 0] = self._to_heading(np.array(position_m))
        self.states[:, 1] = self._to_heading(np.array(velocity_m_s))

    def measured(self) -> Array:
        """Return the state (7,) as the controller reads it."""
        tilt = self.states[:, 4] / (G_M_S2 * self._model.acceleration_per_tilt) * [1, -1]
        world = []
        for right, forward in (self.states[:, 0], self.states[:, 1]):
            world += [
                (forward * self._cosine) - (right * self._sine),
                (right * self._cosine) + (forward * self._sine),
            ]
        trim = [self._model.roll_trim_rad, self._model.pitch_trim_rad]
        return np.array([*world, *(tilt + trim), self._yaw_rad])

    def step(self, command_rad: Array) -> None:
        """Fly on for an update period."""
        model = self._model
        gain, trim = (model.roll_gain, model.pitch_gain), (model.roll_trim_rad, model.pitch_trim_rad)
        for index, (axis, sign) in enumerate(zip(self._axes, (1, -1), strict=True)):
            state = self.states[index]
            state[2] = self._held[index]
            wanted = (
                G_M_S2 * model.acceleration_per_tilt * sign * (gain[index] * command_rad[index] - trim[index])
            )
            self.states[index] = (axis.transition @ state) + (axis.change * (wanted - state[7]))


def fly(
    controller: QuadraticController,
    drone: LinearDrone,
    steps: int,
    distort: Callable[[int, Array], Array] = lambda _, state: state,
) -> list[QuadraticStep]:
    """Fly to the origin; `distort` changes what the controller is told."""
    outcomes = []
    for step in range(steps):
        outcome = controller.step([distort(step, drone.measured())], told([[0.0] * 4]), [HOVER])
        drone.step(outcome.command_rad[0])
        outcomes.append(outcome)
    return outcomes


@pytest.mark.sampled(6)
@pytest.mark.long
@pytest.mark.parametrize(
    "index", [0, *(pytest.param(index, marks=pytest.mark.long) for index in range(1, 5))]
)
def test_the_loop_converges_with_any_settings_that_are_admitted(index: int) -> None:
    """From a small error, on the model's own plant: error and velocity vanish, whatever the settings."""
    without = {"model.drag_1_s": 0.0, "observer.measurement_age_s": 0.0}
    without |= {f"damping.{angle}_rate_feedback_s": 0.0 for angle in ANGLES}
    without |= {f"limits.fence.{axis}_{end}_m": 0.0 for axis in "xy" for end in ("min", "max")}
    settings = settings_of(case_values(20 + index) | without | {"code.scalar": "float64"})
    drone, controller = LinearDrone(settings, yaw_rad=0.7 * index), QuadraticController(Quadratic(settings))
    drone.put((1e-4, -2e-4))
    radius = float(np.max(Quadratic(settings).law.spectral_radius))
    fly(controller, drone, 1000)
    early = np.abs(drone.states[:, :2]).max()
    assert radius < 1
    assert early < 1.0
    fly(controller, drone, 4000)
    assert np.abs(drone.states[:, :2]).max() < max(1e-6, 0.5 * early)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    "yaw_rad", [0.8, *(pytest.param(yaw, marks=pytest.mark.long) for yaw in (0.0, -2.5))]
)
def test_the_observer_finds_a_constant_disturbance(yaw_rad: float) -> None:
    """Wind along x and y: the estimate is the wind, and the drone stands at the target."""
    settings, wind = settings_of(EXACT), (0.6, -0.35)
    drone, controller = LinearDrone(settings, yaw_rad, wind), QuadraticController(Quadratic(settings))
    drone.put((0.5, 0.3))
    last = fly(controller, drone, 2000)[-1]
    assert last.stored[0, 4:6] / settings.horizon.update_period_s**2 == pytest.approx(wind, rel=1e-3)
    assert np.abs(drone.states[:, 0]).max() < 1e-3
    assert np.abs(last.stored[0, 0:4]).max() < 1e-3


def test_a_trim_takes_no_disturbance_to_learn() -> None:
    """Hovering with the trim of the settings, command and estimate stay where they are."""
    settings = settings_of(
        EXACT | {"model.roll_trim_rad": 0.02, "model.pitch_trim_rad": -0.03, "model.roll_gain": 0.8}
    )
    drone, controller = LinearDrone(settings), QuadraticController(Quadratic(settings))
    controller.reset([[0.02 / 0.8, -0.03]])
    last = fly(controller, drone, 500)[-1]
    assert last.command_rad[0] == pytest.approx([0.02 / 0.8, -0.03], abs=1e-9)
    assert np.abs(last.stored[0, 4:6]).max() < 1e-12
    assert np.abs(drone.states[:, 0]).max() < 1e-9


BAD_STATES = ([np.nan] * 7, [np.inf] + [0.0] * 6, [0.0] * 3 + [1e9] + [0.0] * 3, [0.0] * 6 + [-np.inf])


def told_in_between(bad: list[float]) -> Callable[[int, Array], Array]:
    """Return what tells the controller a bad state in three steps."""
    return lambda step, state: np.array(bad) if 20 <= step < 23 else state


def test_a_bad_state_leaves_no_trace_of_its_value() -> None:
    """Whichever bad state it was: all stored numbers are the same after it, and finite."""
    settings = settings_of(EXACT | {"damping.roll_rate_feedback_s": 0.05})
    stored = set()
    for bad in BAD_STATES:
        drone, controller = LinearDrone(settings, 0.4), QuadraticController(Quadratic(settings))
        drone.put((0.4, -0.2))
        outcomes = fly(controller, drone, 40, told_in_between(bad))
        assert [int(outcome.status[0]) for outcome in outcomes[19:24]] == [
            Status.OK,
            *[Status.BAD_STATE] * 3,
            Status.OK,
        ]
        assert np.all(np.isfinite(outcomes[-1].stored))
        stored.add(outcomes[-1].stored.tobytes())
    assert len(stored) == 1


def test_in_a_short_outage_the_controller_flies_on() -> None:
    """Commands change, and the estimate follows the drone that it does not see."""
    settings = settings_of(EXACT)
    drone, controller = LinearDrone(settings, 0.3), QuadraticController(Quadratic(settings))
    drone.put((0.5, -0.3))
    outcomes = fly(controller, drone, 80, lambda step, state: state * np.nan if 30 <= step < 70 else state)
    commands = np.array([outcome.command_rad[0] for outcome in outcomes])
    assert np.all(np.any(np.diff(commands[29:70], axis=0) != 0, axis=1))
    assert [int(outcome.steps_blind[0]) for outcome in outcomes[29:71]] == [0, *range(1, 41), 0]
    seen, lost = outcomes[29].stored[0, :2], outcomes[69].stored[0, :2]
    found = outcomes[70].stored[0, :2]
    assert np.linalg.norm(lost - found) < 0.1 * np.linalg.norm(seen - found)


def test_after_a_long_outage_the_estimate_starts_anew() -> None:
    """When it is over its time the drone brakes to a stop; position and velocity are then those measured."""
    settings = settings_of(EXACT | {"observer.outage_s": 0.1})
    controller, period_s = QuadraticController(Quadratic(settings)), settings.horizon.update_period_s
    drone = LinearDrone(settings)
    drone.put((0.5, -0.3))
    outcomes = fly(controller, drone, 400, lambda step, state: state * np.nan if step >= 30 else state)
    commands = np.array([outcome.command_rad[0] for outcome in outcomes])
    assert np.all(np.any(np.diff(commands[29:40], axis=0) != 0, axis=1))
    assert np.all(commands[-1] == 0)
    assert int(outcomes[-1].steps_blind[0]) == 12
    elsewhere = [40.0, -30.0, 2.0, 1.0, 0.0, 0.0, 0.0]
    found = controller.step([elsewhere], told([[0.0] * 4]), [HOVER]).stored[0]
    assert found[2:4] == pytest.approx(np.array(elsewhere[2:4]) * period_s, rel=0.05)
    assert found[0:2] == pytest.approx(np.array(elsewhere[:2]) + found[2:4], abs=1e-3)


def test_a_command_of_others_moves_the_model() -> None:
    """What was sent in place of the own command is where the model and the next command begin."""
    settings = settings_of(EXACT)
    used, undisturbed = (QuadraticController(Quadratic(settings)) for _ in range(2))
    for controller in (used, undisturbed):
        controller.step([[0.0] * 7], told([[0.0] * 4]), [HOVER])
    assert used.report_command([[0.2, 0.1]])[0] == Status.OK
    held = used.step([[np.nan] * 7], told([[np.nan] * 4]), [HOVER])
    assert np.array_equal(held.command_rad, [[0.2, 0.1]])
    assert not np.array_equal(
        held.stored, undisturbed.step([[np.nan] * 7], told([[np.nan] * 4]), [HOVER]).stored
    )
    assert used.report_command([[np.nan, 0.1]])[0] == Status.BAD_COMMAND


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize(("values", "largest_m"), [(TWO_MOVES, 5e-4), (ONE_MOVE, 1.1e-3)])
def test_a_target_on_a_circle_is_followed_closely(values: Values, largest_m: float) -> None:
    """By its velocity alone, and by its acceleration too; this drone has its lag after rate feedback."""
    for known in (0.0, 1.0):
        settings = settings_of(values | {"damping.roll_rate_feedback_s": 0.0, "code.scalar": "float64"})
        drone, controller = LinearDrone(settings), QuadraticController(Quadratic(settings))
        largest = 0.0
        for step in range(1500):
            angle = 0.01 * step
            place = np.array([np.cos(angle), np.sin(angle)])
            across = np.array([-np.sin(angle), np.cos(angle)])
            target = np.concatenate([place, across, -place, [0.0, 0.0, known]])
            state = drone.measured()
            drone.step(controller.step([state], [target], [HOVER]).command_rad[0])
            if step > 800:
                largest = max(largest, float(np.hypot(*(state[:2] - place))))
        assert largest < largest_m
