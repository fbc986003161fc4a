"""Laws of a program's own, which fly in place of a controller's C."""

import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from mambo_codegen.errors import echo
from mambo_sil.arguments import require_number
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError, FlightError
from mambo_sil.flight.columns import LEVEL, SPACE, STATE, TARGET, Columns
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.own_file import load_object, whole_name
from mambo_sil.flight.states import DroneState, TargetState, unchecked

RULE: Final = "return roll and pitch in rad, or these and the thrust over mass in m/s^2"


UPDATE_PERIOD_S: Final = 0.01
"""Time from one call of a law to the next, unless it says another one."""


class Law(Protocol):
    """A position controller of a program's own.

    It may have `update_period_s`, the time from one call to the next; without it is called every 10 ms. It
    may have `reset(seed)`, which is called before a flight, with the seed of its noise.
    """

    def step(self, state: DroneState, target: TargetState) -> ArrayLike:
        """Return [roll, pitch] in rad, or [roll, pitch, thrust over mass in m/s^2], for a single drone.

        Positions, velocities and accelerations are (3,), x north, y east, z down. Without a thrust the
        altitude loop of the vehicle holds the height.
        """
        ...


@dataclass(frozen=True)
class LawFile:
    """A law in a file.

    named:           FILE.py:CLASS, with the whole path of the file.
    sha256:          of the file, and of the modules beside it that it imports.
    update_period_s: time from one call of the law to the next.
    """

    named: str
    sha256: str
    update_period_s: float

    @classmethod
    def of(cls, named: str, folder: Path = Path()) -> "LawFile":
        """Return the law that FILE.py:CLASS names, beside `folder`.

        Raises FlightError as `load_law`, and for a law whose update period is no number in 0.001..1.
        """
        whole = whole_name(named, folder)
        law, sha256 = _loaded(whole)
        try:
            period_s = period_of(law)
        except ArgumentError as error:
            raise FlightError(f"{echo(named)}: {error}") from error
        return cls(whole, sha256, period_s)

    def load(self) -> Law:
        """Return a new law; raises FlightError as `load_law`, and if the file is no longer what it was."""
        law, sha256 = _loaded(self.named)
        if sha256 != self.sha256:
            raise FlightError(f"{echo(self.named)}: the file, or one that it imports, is not what it was")
        return law


def load_law(named: str) -> Law:
    """Return a new law of the class that FILE.py:CLASS names; the file may import modules beside it.

    Raises FlightError, in one sentence, for whatever is wrong with the file or the class.
    """
    return _loaded(named)[0]


def _loaded(named: str) -> tuple[Law, str]:
    """Return a new law, and the SHA-256 of what it is made of; raises as `load_object`."""
    law, sha256 = load_object(named)
    if not callable(getattr(law, "step", None)):
        name = echo(named.rpartition(":")[2])
        raise FlightError(f"{echo(named)}: {name} has no method step(state, target)")
    return cast("Law", law), sha256


def period_of(law: object) -> float:
    """Return the time from one call of a law, or step of a controller, to the next; raises ArgumentError."""
    period_s = getattr(law, "update_period_s", UPDATE_PERIOD_S)
    require_number("update_period_s", period_s, 0.001, 1.0)
    return float(period_s)


class OwnLaw:
    """A law of one flight, as the closed loop calls it.

    Once the law has failed, that is raised, or returned what is no command, its commands are NaN: the flight
    is lost. `failure` says when and why.
    """

    def __init__(self, law: Law, columns: Columns, update_period_s: float) -> None:
        self._law, self.columns, self._period_s = law, columns, update_period_s
        self._calls = 0
        self.failure: str | None = None

    def step(
        self,
        state: FloatArray,
        target: FloatArray,
        thrust_acceleration_m_s2: FloatArray,  # noqa: ARG002 - part of the interface
    ) -> Applied:
        """Return the command (1, 2) or (1, 3) for a state (1, 10) and a target (1, 13)."""
        numbers = np.full((1, self.columns.command), np.nan)
        if self.failure is None and np.isfinite(state).all():
            try:
                numbers[0] = command_of(self._law.step(*_seen(state[0], target[0])), self.columns)
            except (Exception, SystemExit) as error:
                said = str(error) if isinstance(error, ArgumentError) else f"{type(error).__name__}: {error}"
                self.failure = f"{self._calls * self._period_s:g} s: law.step: {said}"
        self._calls += 1
        return Applied.of(numbers, np.zeros(1, np.int64))


class OwnLaws:
    """A copy of a law for each of n flights."""

    def __init__(self, law: Law, flight: Flight) -> None:
        self.columns = columns_of_law(_copy(law), flight)
        seeds = flight.seeds or (0,) * flight.flights
        self.laws = [OwnLaw(_ready(law, seed), self.columns, flight.update_period_s) for seed in seeds]

    def of_flight(self, flight: int) -> OwnLaw:
        """Return the law of a flight."""
        return self.laws[flight]

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Return the commands (n, 2) or (n, 3) for states (n, 10) and targets (n, 13)."""
        numbers = np.empty((len(self.laws), self.columns.command))
        for each, law in enumerate(self.laws):
            rows = slice(each, each + 1)
            found = law.step(state[rows], target[rows], thrust_acceleration_m_s2[rows])
            numbers[each, :2] = found.command_rad[0]
            if found.thrust_m_s2 is not None:
                numbers[each, 2] = found.thrust_m_s2[0]
        return Applied.of(numbers, np.zeros(len(self.laws), np.int64))

    @property
    def failures(self) -> dict[int, str]:
        """When and why laws failed, by the number of the flight."""
        return {each: law.failure for each, law in enumerate(self.laws) if law.failure is not None}


def columns_of_law(law: Law, flight: Flight) -> Columns:
    """Ask a law for a command at the start of a flight, and return how many numbers it takes and gives.

    Raises ArgumentError if it raises, or returns what is no command.
    """
    if isinstance(law, type):
        raise ArgumentError(f"law: {law.__name__} is a class; give an object, {law.__name__}()")
    target = flight.targets_in_space[0, 0]
    state = np.zeros(SPACE.state)
    for member in ("position_m", "height_m"):
        state[STATE[member]] = target[TARGET[member]]
    state[STATE["yaw_rad"]] = np.broadcast_to(flight.yaw_rad, flight.flights)[0]
    try:
        found = law.step(*_seen(state, target))
    except (Exception, SystemExit) as error:
        raise ArgumentError(f"law.step: {type(error).__name__}: {error}") from error
    count = np.size(found)
    columns = Columns(SPACE.state, SPACE.target, SPACE.command if count == SPACE.command else LEVEL.command)
    try:
        command_of(found, columns)
    except ArgumentError as error:
        raise ArgumentError(f"law.step: {error}") from error
    return columns


def command_of(found: Any, columns: Columns) -> FloatArray:
    """Return what a law returned as numbers (2,) or (3,); raises ArgumentError for what is no command."""
    try:
        numbers = np.asarray(found, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    good = numbers.shape == (columns.command,) and bool(np.isfinite(numbers).all())
    if not good:
        raise ArgumentError(f"returned {echo(repr(found))}; it must {RULE}")
    return numbers


def _copy(law: Law) -> Law:
    """Return a copy of a law, of its memory too; raises ArgumentError if it has none."""
    try:
        return copy.deepcopy(law)
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        raise ArgumentError(f"law: {said}; it is copied for each flight: give it __deepcopy__") from error


def _ready(law: Law, seed: int) -> Law:
    """Return a copy of a law for a flight; raises ArgumentError if its `reset` raises."""
    found = _copy(law)
    if callable(reset := getattr(found, "reset", None)):
        try:
            reset(seed)
        except (Exception, SystemExit) as error:
            raise ArgumentError(f"law.reset: {type(error).__name__}: {error}") from error
    return found


def _places(columns: dict[str, slice], *members: str) -> list[int]:
    """Return the columns of members, x, y and up of each vector."""
    return [column for member in members for column in range(columns[member].start, columns[member].stop)]


_DRONE: Final = _places(
    STATE, "position_m", "height_m", "velocity_m_s", "climb_m_s", "roll_rad", "pitch_rad", "yaw_rad"
)
_TARGET: Final = _places(
    TARGET,
    *("position_m", "height_m", "velocity_m_s", "climb_m_s"),
    *("acceleration_m_s2", "climb_acceleration_m_s2", "ahead_m_s2", "climb_ahead_m_s2"),
)
_OF_DRONE: Final = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
_OF_TARGET: Final = np.array([1.0, 1.0, -1.0] * 4)
"""Signs that make up into down."""
_ON_GROUND, _KNOWN = STATE["on_ground"].start, TARGET["known"].start


def _seen(state: FloatArray, target: FloatArray) -> tuple[DroneState, TargetState]:
    """Return a state (10,) and a target (13,) as a law is given them, z down."""
    drone, goal, known = state[_DRONE] * _OF_DRONE, target[_TARGET] * _OF_TARGET, target[_KNOWN]
    return (
        unchecked(
            DroneState,
            position_m=drone[:3],
            velocity_m_s=drone[3:6],
            attitude_rad=drone[6:],
            on_ground=state[_ON_GROUND] != 0.0,
        ),
        unchecked(
            TargetState,
            position_m=goal[:3],
            velocity_m_s=goal[3:6],
            acceleration_m_s2=goal[6:9] if known >= 1 else None,
            ahead_m_s2=goal[9:] if known >= 2 else None,
            yaw_rad=None,
        ),
    )
