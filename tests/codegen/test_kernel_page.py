"""The page of the kernel: its target observer, written from its sentences alone, against the reference."""

from collections import Counter
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.step import QuadraticMemory
from mambo_codegen.methods.quadratic.target_observer import ObservedMotion
from mambo_codegen.methods.shared.limits import ActiveLimit
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.height_settings import height_settings
from tests.support.kernel_page import Loop, Numbers, ObservedAxis, jerk_numbers, turn
from tests.support.quadratic import ANGLES, ONE_MOVE, TWO_MOVES, Array, case_values, settings_of
from tests.support.strategies import Values

FENCE, HEIGHT, THRUST = ActiveLimit.FENCE, ActiveLimit.HEIGHT, ActiveLimit.THRUST


def _with(settings: Settings, values: Values) -> Settings:
    """Return settings with other `values`."""
    for path, value in values.items():
        settings = with_option(settings, path, value)
    return settings


DOUBLE: Final[Values] = {"code.scalar": "float64"}
OBSERVED: Final[Values] = TWO_MOVES | DOUBLE
QUICK: Final[Values] = {
    "horizon.update_period_s": 0.0025,
    "model.drag_1_s": 0.07,
    "observer.outage_s": 0.025,
    "ranges.velocity_m_s": 2.0,
}
SLOW: Final[Values] = {
    "horizon.update_period_s": 0.1,
    "cost.response_time_s": 0.5,
    "limits.tilt_rad": 1.0,
    "observer.outage_s": 1.0,
    "ranges.thrust_acceleration_max_m_s2": 12.0,
}
HIGH: Final = _with(
    height_settings("float64", thrust_max_m_s2=35.0),
    {
        "horizon.update_period_s": 0.02,
        "observer.outage_s": 0.2,
        "ranges.thrust_acceleration_max_m_s2": 36.0,
    },
)
"""What the thrust gives the height, times 1.5, is more than the range."""
DRONES: Final = 12
MEMBERS: Final = (
    ("position_m", "height_m"),
    ("velocity_m_s", "climb_m_s"),
    ("acceleration_m_s2", "climb_acceleration_m_s2"),
    ("ahead_m_s2", "climb_ahead_m_s2"),
)
KINDS: Final = "velocity", "acceleration"
CASES: Final = (
    *(f"{verdict} {what}" for verdict in ("accepted", "rejected", "jump") for what in KINDS),
    *("velocities begin", "accelerations begin", *(f"first, known {known}" for known in range(3))),
    *("largest noise", "shorter memory", "faded", "faded wholly", "turned, known 0", "turned, known 1"),
    *("limits begin", "limited", "limited jump", "fed by limits", "fed by the target"),
    *("outage", "bad target"),
    *("largest a", "largest j", "largest s"),
)
"""What every flight must have met."""


class Program:
    """Random paths of n targets, smooth but for jumps, with noise, whose `known` changes at times."""

    def __init__(self, settings: Settings, axes: int, rng: np.random.Generator) -> None:
        ranges, shape = settings.ranges, (DRONES, axes)
        self.rng, self.period_s = rng, settings.horizon.update_period_s
        self.most_m_s, self.most_m_s2 = ranges.velocity_m_s, ranges.thrust_acceleration_max_m_s2
        self.path = np.stack([rng.normal(0, sigma, shape) for sigma in (1.0, 0.3, 1.0)])
        self.noise = np.resize([0, 0.003, 0.02, 0.1, 1.0], (DRONES, 1))
        self.given_noise = np.resize([0, 0.01, 0.3, 3.0], (DRONES, 1))
        self.known = np.arange(DRONES) % 3

    def draw(self) -> Array:
        """Return positions, velocities, accelerations, and these 0.05 s later (4, n, axes)."""
        rng, step = self.rng, self.period_s
        jumps = rng.random((2, DRONES, 1)) < 0.02
        changes = (rng.random(DRONES) < 0.02) & (np.arange(DRONES) % 5 < 4)
        self.known = np.where(changes, rng.integers(0, 3, DRONES), self.known)
        place, velocity, acceleration = self.path
        white = [rng.normal(0, 1, place.shape) for _ in range(6)]
        moved = np.where(jumps[0], 0.5 * white[0], velocity + step * acceleration)
        turned = np.where(jumps[1], 5 * white[1], (1 - 0.5 * step) * acceleration + 20 * step * white[2])
        bounds = np.array([50.0, self.most_m_s, 0.8 * self.most_m_s2])[:, None, None]
        self.path = np.clip([place + step * velocity, moved, turned], -bounds, bounds)
        told, given = self.path[1] + self.noise * white[3], self.path[2] + self.given_noise * white[4]
        bounds = np.array([50.0, self.most_m_s, self.most_m_s2, self.most_m_s2])[:, None, None]
        drawn: Array = np.clip([self.path[0], told, given, given + white[5]], -bounds, bounds)
        return drawn


class Flight:
    """n controllers of the reference beside n targets observed as the page says."""

    def __init__(self, settings: Settings, seed: int) -> None:
        self.method = Quadratic(settings)
        self.controller = self.method.reference_controller(DRONES)
        self.axes = 3 if settings.height else 2
        self.rng, self.cases = np.random.default_rng(seed), Counter[str]()
        self.program = Program(settings, self.axes, self.rng)
        level = Numbers(settings, float(np.mean(self.method.law.snap_s)), is_height=False)
        self.numbers = [level, level]
        if self.method.height:
            self.numbers.append(Numbers(settings, self.method.height.snap_s, is_height=True))
        self.pages = [[ObservedAxis(one, self.cases) for one in self.numbers] for _ in range(DRONES)]
        self.missed = np.full(DRONES, self.method.outage_steps)
        self.worst, self.worst_fed, self.was_limited = 0.0, 0.0, np.zeros(DRONES, np.bool_)
        self.desired: Array = np.zeros((DRONES, 2))
        limit = self.controller.parts.limits.limit

        def recorded(*inputs: Any) -> Any:
            found = limit(*inputs)
            self.desired = found[1][:, 2:4]
            return found

        self.controller.parts.limits.limit = recorded  # type: ignore[assignment, method-assign]

    def fly(self, steps: int) -> None:
        """Step both, with all that may happen to a target, and keep the largest differences."""
        for step in range(steps):
            if step % 47 == 30:
                self._shift()
            if step == 250:
                assert (self.controller.reset(np.zeros((DRONES, self.axes))) == 0).all()
                self.missed[:] = self.method.outage_steps
                self.was_limited[:] = False
                self._forget(np.arange(DRONES))
            self._step(step)
            self._compare()

    def _step(self, step: int) -> None:
        """Step: at times a drone is far from its target, has no good state, or no good target."""
        drawn, number = self.program.draw(), np.arange(DRONES)
        far = np.where(number == 11, 50.0, np.where((number % 3 == 0) & (step % 60 < 20), 5.0, 0.0))[:, None]
        lost = (step - 5) % 120 >= 120 - 4 * (number % 4)
        bad = self.rng.random(DRONES) < 0.02
        level = np.concatenate([drawn[0, :, :2] + far, drawn[1, :, :2], np.zeros((DRONES, 3))], axis=1)
        state = np.column_stack([level, *drawn[:2, :, 2:].swapaxes(1, 2).reshape(-1, DRONES)])
        if self.axes > 2:
            state = np.column_stack([state, np.zeros(DRONES)])
        target = self._target(drawn)
        state[lost, 2] = target[bad, 0] = np.nan
        before = self.controller.memory
        self.controller.step(state, target, None if self.axes > 2 else np.full(DRONES, 9.81))
        self.missed = np.where(lost, self.missed + 1, 0)
        gone = self.missed > self.method.outage_steps
        self._forget(np.flatnonzero(self.missed == self.method.outage_steps + 1))
        self.cases.update({"outage": int(gone.sum()), "bad target": int((bad & ~lost).sum())})
        self._observe(drawn, ~(bad | gone), before)

    def _observe(self, drawn: Array, follows: Any, before: QuadraticMemory) -> None:
        """Let the pages take in set-points; compare the velocities along x and y that the law is given."""
        limited = (self.controller.memory.limits.active & ~(HEIGHT | THRUST)) != 0
        aim = np.concatenate([drawn[0, :, :2], drawn[1, :, :2]], axis=1)
        aim[limited, 2:4] = self.desired[limited]
        given = np.zeros((DRONES, self.axes))
        parts = self.controller.parts.limits
        slow = parts.is_slow(before.limits.bounds, np.concatenate([drawn[0, :, :2], drawn[1, :, :2]], axis=1))
        feeds = slow | (self.controller.memory.limits.active & FENCE != 0)
        for drone in np.flatnonzero(follows):
            known, begins = int(self.program.known[drone]), not self.was_limited[drone]
            for axis, page in enumerate(self.pages[drone]):
                begins = begins or page.is_first
                given[drone, axis] = page.step(drawn[1:, drone, axis], known)
                if axis < 2 and limited[drone]:
                    given[drone, axis] = self.desired[drone, axis]
                    page.follow(given[drone, axis], begins=begins, feeds=bool(feeds[drone]))
        self.was_limited = np.where(follows, limited, self.was_limited)
        program = np.column_stack([*drawn[:, :, :2], self.program.known])
        theirs = self.controller.parts.target_observer.follow(before.target, program, aim, limited)[1][:, 2:4]
        self._keep((theirs - given[:, :2])[follows])

    def _compare(self) -> None:
        """Compare all that is kept, but of targets of which nothing is known."""
        memory = self.controller.memory
        motions = [memory.target, memory.height.target][: self.axes - 1]
        theirs = np.concatenate([_kept(one) for one in motions], axis=1)
        own = np.array([[page.kept() for page in pages] for pages in self.pages])
        known = [not pages[0].is_first for pages in self.pages]
        differences = ((own - theirs) / np.array([one.scales for one in self.numbers]))[known]
        self._keep(np.nan_to_num(differences[..., 2:]))
        self.worst_fed = max(self.worst_fed, float(np.abs(differences[..., :2]).max(initial=0.0)))

    def _keep(self, differences: Array) -> None:
        self.worst = max(self.worst, float(np.abs(differences).max(initial=0.0)))

    def _shift(self) -> None:
        """Let the frames jump, half of them without a turn."""
        change = self.rng.normal(0, 0.3, (DRONES, 2 * self.axes + 1))
        change[:, -1] = np.where(self.rng.random(DRONES) < 0.5, 3 * change[:, -1], 0.0)
        assert (self.controller.frame_jumped(change) == 0).all()
        for pages, one in zip(self.pages, change, strict=True):
            for page, velocity in zip(pages, one[self.axes : -1], strict=True):
                page.shift(float(velocity))
            if one[-1] != 0:
                turn(pages[0], pages[1], float(one[-1]))
        self._compare()

    def _forget(self, drones: Any) -> None:
        for drone in drones:
            for page in self.pages[drone]:
                page.forget()

    def _target(self, drawn: Array) -> Array:
        """Return the set-points (n, k) in the order of nmpc_target_t."""
        numbers = self.method.port.numbers("target")
        target = np.zeros((DRONES, len(numbers)))
        for names, value in zip(MEMBERS, drawn, strict=True):
            columns = [one.column for name in names for one in numbers if one.row.member == name]
            target[:, columns] = value
        target[:, [one.column for one in numbers if one.row.member == "known"]] = self.program.known[:, None]
        return target


def _kept(motion: ObservedMotion) -> Array:
    """Return what is kept of motions along k axes (n, k, 13), as `ObservedAxis.kept` does."""
    fed = motion.acceleration_m_step2, motion.jerk_m_step2_update
    fit = motion.velocity_m_s, motion.acceleration, motion.jerk, motion.snap
    judged = motion.innovation, motion.noise, motion.memory, motion.missed
    desired = motion.desired_m_s, motion.desired_acceleration, motion.desired_jerk
    return np.stack([*fed, *fit, *judged, *desired], axis=2)


FLIGHTS: Final = {
    "10 ms": settings_of(OBSERVED | {"observer.outage_s": 0.1}),
    "2.5 ms": settings_of(OBSERVED | QUICK),
    "0.1 s": settings_of(OBSERVED | SLOW),
    "height": HIGH,
}


@pytest.mark.parametrize("settings", FLIGHTS.values(), ids=FLIGHTS)
def test_the_reference_observes_targets_as_the_page_says(settings: Settings) -> None:
    """Every number that is kept, over set-points of each kind, jumps, limits, outages and other frames."""
    flight = Flight(settings, seed=1)
    flight.fly(400)
    assert flight.worst < 1e-12
    assert flight.worst_fed < 1e-10
    assert [case for case in CASES if flight.cases[case] == 0] == []


@pytest.mark.parametrize("index", [0, 1])
def test_the_law_has_the_numbers_of_the_jerk_of_the_page(index: int) -> None:
    """Those of each row, and t, of two moves and of one, with delays, integrals and a height, or without."""
    found = [settings_of(case_values(one) | DOUBLE) for one in range(8 + 4 * index, 12 + 4 * index)]
    for settings in [*found, HIGH] if index else [settings_of(ONE_MOVE | DOUBLE), *found]:
        method, horizon = Quadratic(settings), settings.horizon
        laws = [*zip(_loops(settings), method.law.rows, method.law.snap_s, strict=True)]
        if method.height and settings.height:
            loop = settings.height.lag_s, settings.height.delay_s, 0.0
            laws.append((loop, np.insert(method.height.rows, 5, 0, axis=1), method.height.snap_s))
        for loop, rows, snap_s in laws:
            numbers, t = jerk_numbers(horizon.update_period_s, horizon.ramp_s, loop, rows)
            assert rows[:, 3] == pytest.approx(numbers, rel=1e-12)
            assert snap_s == pytest.approx(t, abs=1e-12)


def _loops(settings: Settings) -> list[Loop]:
    """Return the attitude loops of roll and pitch."""
    model, damping = settings.model, settings.damping
    lags = [getattr(model, f"{a}_lag_s") - getattr(damping, f"{a}_rate_feedback_s") for a in ANGLES]
    others = [(getattr(model, f"{a}_delay_s"), getattr(model, f"{a}_integral_1_s")) for a in ANGLES]
    return [(lag, *other) for lag, other in zip(lags, others, strict=True)]
