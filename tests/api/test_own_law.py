"""A law of a program's own flies in place of the C, and a bad one loses its own flight alone."""

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mambo_nmpc import ArgumentError, Controller, DroneState, FlightResult, TargetState, Vehicle, fly
from mambo_sil.flight.engine.engine_library import VARIABLE

CRAZYFLIE = Vehicle.from_preset("crazyflie")


class Pd:
    """Errors of position and velocity, and the target's acceleration; it counts its steps."""

    def __init__(self) -> None:
        self.steps = 0

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return roll and pitch at heading 0."""
        self.steps += 1
        wanted = self.wanted(state, target)
        return [wanted[1] / 9.81, -wanted[0] / 9.81]

    def wanted(self, state: DroneState, target: TargetState) -> Any:
        """Return the wanted acceleration (3,)."""
        assert target.acceleration_m_s2 is not None
        error_m, error_m_s = target.position_m - state.position_m, target.velocity_m_s - state.velocity_m_s
        return target.acceleration_m_s2 + 6.0 * error_m + 4.0 * error_m_s


class Lifting(Pd):
    """The same, which commands the thrust too."""

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return roll, pitch and the thrust over mass."""
        return [*super().step(state, target), 9.81 - self.wanted(state, target)[2]]


class Breaking(Pd):
    """The same, but what `answer` does where the heading is 0 and x is less than 0."""

    def __init__(self, answer: Callable[[], Any]) -> None:
        super().__init__()
        self._answer = answer

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return roll and pitch, or something else."""
        if state.position_m[0] < 0.0 and abs(state.attitude_rad[2]) < 0.1:
            return self._answer()
        return super().step(state, target)


class Four(Pd):
    """Returns too much."""

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return four numbers."""
        return [*super().step(state, target), 0.0, 0.0]


class Alone(Pd):
    """Cannot be copied."""

    def __deepcopy__(self, memo: Any) -> "Alone":
        raise TypeError("there is one of it")


def flown(law: Any, curve: Any = "circle", **others: Any) -> FlightResult:
    """Fly for 4 s."""
    return fly(law, CRAZYFLIE, curve, size_m=1.0, rate_rad_s=1.5, duration_s=4.0, **others)


@pytest.mark.parametrize(("law", "curve"), [(Pd(), "circle"), (Lifting(), "helix")])
def test_it_flies_with_the_same_bits_in_both_engines(
    law: Pd, curve: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through sensors with noise, several flights with a copy each: the law itself keeps its memory."""
    found = flown(law, curve, sensors="mocap", seeds=range(5))
    assert not found.crashed.any()
    assert found.failures == {}
    assert found.metrics.rms_error_m.max() < 0.15
    assert len(np.unique(found.metrics.rms_error_m)) == 5
    assert law.steps == 0
    monkeypatch.setenv(VARIABLE, "numpy")
    assert found.trace.same_bits(flown(law, curve, sensors="mocap", seeds=range(5)).trace)


def test_what_it_is_given_is_z_down() -> None:
    """The state of the drone, and where the curve is, in north, east, down."""
    seen: list[tuple[DroneState, TargetState]] = []

    class Watching(Lifting):
        def __deepcopy__(self, memo: Any) -> "Watching":
            return self

        def step(self, state: DroneState, target: TargetState) -> Any:
            seen.append((state, target))
            return super().step(state, target)

    trace = flown(Watching(), "helix").trace
    states, targets = zip(*seen[1:], strict=True)  # the first one asked what it returns
    np.testing.assert_array_equal([one.position_m for one in states], trace.position_m[:, 0])
    np.testing.assert_array_equal([one.velocity_m_s for one in states], trace.velocity_m_s[:, 0])
    np.testing.assert_array_equal([one.attitude_rad for one in states], trace.euler_rad[:, 0])
    np.testing.assert_array_equal([one.position_m[:2] for one in targets], trace.target[:, 0, :2])
    np.testing.assert_array_equal([-one.position_m[2] for one in targets], trace.target_height_m[:, 0])
    assert states[0].position_m[2] < 0.0
    velocities_m_s = np.array([one.velocity_m_s for one in targets])
    accelerations_m_s2 = np.array([one.acceleration_m_s2 for one in targets])
    mean_m_s2 = 0.5 * (accelerations_m_s2[1:] + accelerations_m_s2[:-1])
    np.testing.assert_allclose(np.diff(velocities_m_s, axis=0), 0.01 * mean_m_s2, atol=1e-5)
    ahead_m_s2 = np.array([one.ahead_m_s2 for one in targets])
    np.testing.assert_allclose(ahead_m_s2[:-5], accelerations_m_s2[5:], atol=1e-12)
    assert {one.known for one in targets} == {2}


def test_a_law_may_have_a_controller_of_its_own() -> None:
    """One that observes its target: the flight is that of the controller itself, in every bit."""

    class Ours:
        def __init__(self, controller: Controller) -> None:
            self.controller = controller

        def __deepcopy__(self, memo: Any) -> "Ours":
            return Ours(Controller(self.controller.settings))

        def step(self, state: DroneState, target: TargetState) -> Any:
            found = self.controller.step(state, target, 9.81)
            return found.command_rad

    controller = Controller.from_preset("crazyflie")
    assert flown(Ours(controller)).trace.same_bits(flown(controller).trace)


def test_its_period_is_its_own() -> None:
    """By default 10 ms."""
    law: Any = Pd()
    assert len(flown(law).trace.time_s) == 401
    law.update_period_s = 0.02
    assert len(flown(law).trace.time_s) == 201
    law.update_period_s = "fast"
    with pytest.raises(ArgumentError, match='update_period_s = "fast" must'):
        flown(law)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda: [math.nan, 0.0], r"returned \[nan, 0.0\]; it must return roll and pitch in rad, or these"),
        (lambda: [0.0, 0.0, 9.81], r"returned \[0.0, 0.0, 9.81\]; it must return"),
        (lambda: None, "returned None; it must return"),
    ],
)
@pytest.mark.parametrize("engine", ["c", "numpy"])
def test_a_bad_answer_loses_its_flight_alone(
    answer: Callable[[], Any], words: str, engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a sentence that says which flight, when and why; the others go on."""
    monkeypatch.setenv(VARIABLE, engine)
    with pytest.warns(UserWarning, match=rf"flight 0, [\d.]+ s: law\.step: {words}"):
        found = flown(Breaking(answer), seeds=(0, 1), yaw_rad=np.array([0.0, 0.2]))
    assert found.crashed.tolist() == [True, False]
    assert list(found.failures) == [0]


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (object(), "must be a Controller or an object with the method step"),
        (Pd, r"law: Pd is a class; give an object, Pd\(\)"),
        (Four(), r"law\.step: returned \[.*, 0.0, 0.0\]; it must return roll and pitch"),
        (Alone(), "there is one of it; it is copied for each flight: give it __deepcopy__"),
    ],
)
def test_what_is_no_law_is_refused(law: Any, words: str) -> None:
    """Before anything flies."""
    with pytest.raises(ArgumentError, match=words):
        flown(law)


class Noisy(Pd):
    """Adds noise of its own, of the seed of its flight."""

    def __init__(self) -> None:
        super().__init__()
        self._rng = np.random.default_rng()

    def reset(self, seed: int) -> None:
        """Begin a flight."""
        self._rng = np.random.default_rng(seed)

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return roll and pitch."""
        return np.array(super().step(state, target)) + 0.01 * self._rng.standard_normal(2)


class Refusing(Noisy):
    """Cannot begin."""

    def reset(self, seed: int) -> None:
        """Raise."""
        raise OSError(f"no {seed}")


def test_a_law_is_given_the_seed_of_its_flight() -> None:
    """Before the first step: its noise differs from flight to flight, and is the same again."""
    found = flown(Noisy(), seeds=(4, 5))
    assert len(set(found.metrics.rms_error_m.tolist())) == 2
    assert found.trace.same_bits(flown(Noisy(), seeds=(4, 5)).trace)
    with pytest.raises(ArgumentError, match=r"law\.reset: OSError: no 4"):
        flown(Refusing(), seeds=(4, 5))


def test_metrics_may_leave_out_the_start() -> None:
    """They are those of the rest of the trace; a crashed flight hides no other."""
    whole, late = flown(Pd()), flown(Pd(), measured_from_s=2.0)
    assert whole.trace.same_bits(late.trace)
    assert late.metrics.max_error_m[0] < whole.metrics.max_error_m[0]
    off_m = np.linalg.norm(late.trace.position_m[200:, 0, :2] - late.trace.target[200:, 0, :2], axis=1)
    assert late.metrics.max_error_m[0] == off_m.max()
    with pytest.raises(ArgumentError, match=r"measured_from_s = 4\.0 must lie in 0\.\.3\.99"):
        flown(Pd(), measured_from_s=4.0)
    with pytest.warns(UserWarning, match="law.step"):
        some = flown(Breaking(lambda: None), seeds=(0, 1, 2), yaw_rad=np.array([0.0, 0.2, 0.2]))
    assert repr(some).startswith("FlightResult(3 flights: rms error ")
    assert re.search(r"rms error [\d.]+ cm in the median", repr(some))
    assert repr(some).endswith(" at most, 1 crashed)")
