"""Feed the inputs in a flight log through the compiled controller, next to the commands of the log."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.errors import ResultsError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.identify.columns import Column
from mambo_sil.model.replay.logged_inputs import LoggedInputs, read_inputs

AXES: Final = ("roll", "pitch")
CURVE_COLUMNS: Final = ("time_s", *(f"{axis}_{kind}_rad" for kind in ("logged", "replayed") for axis in AXES))

SETTLING_S: Final = 2.0
"""Time from a beginning of the controller in which its estimates approach the estimates of the flight."""

BLOCK: Final = 100
"""Updates whose lost states are estimated at once."""
AHEAD: Final = 50
"""Further updates whose commands are read for that."""
ESTIMATED: Final = 4
"""Numbers of a state: position and velocity along x and y. Angles and height are slower, and interpolated."""
COMMAND_NOISE_RAD: Final = 2e-5
"""Standard deviation of what the model leaves of a command."""

_UPWARDS: Final = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
_LEVEL: Final = [0, 1, 3, 4, 6]
"""A jump with the height upwards, and the columns of one without."""


@dataclass(frozen=True, eq=False)
class LogReplay:
    """Commands of a log and of the compiled controller on its inputs, at the k updates that the log has."""

    time_s: FloatArray
    logged_rad: FloatArray
    """Roll and pitch (k, 2)."""
    replayed_rad: FloatArray
    status: IntArray
    """Status of each update (k,)."""
    settled: NDArray[np.bool_]
    """Whether the controller has not begun anew in the last `SETTLING_S` (k,)."""
    lost: int
    """Updates that the log has lost."""
    filled: int
    """Those of them that are filled."""
    gaps: int
    """Gaps behind which the controller began anew."""
    is_exact: bool
    """Whether inputs and commands of an update are of one row, or of the same count of updates."""
    resampled: bool
    """Whether the log has another rate than the controller: inputs are interpolated, commands held."""
    remarks: tuple[str, ...]

    @property
    def share_filled(self) -> float:
        """Share of the replayed updates that the log has lost."""
        return self.filled / (self.filled + len(self.time_s))


def replay_log(path: Path, columns: Mapping[str, Column], settings: Settings) -> LogReplay:
    """Replay the log at `path`; `columns` has those that the user named.

    The controller starts level, without an estimate, as after nmpc_init(). It is reset to the present roll
    and pitch at each take-over that the log counts, and behind a gap that is too long to fill. A lost row is
    filled, with a quadratic cost by the state that explains the commands behind it. One of the height is in
    the air where the log does not say that it was on the floor, and is not told what a mixer made of its
    thrust, which no log shows. Raises LogError.
    """
    inputs = read_inputs(path, columns, settings)
    there = inputs.is_logged
    is_whole, is_quadratic = bool(there.all()), settings.cost.norm == "quadratic"
    if not is_whole and is_quadratic and settings.code.scalar == "fixed":
        settings = with_option(settings, "code.scalar", "float64")  # slopes are differences of commands
    controller, state = CompiledController(settings), inputs.state
    blocks = list(_blocks(inputs))
    most = max(int((~there[first:last]).sum()) for first, _, last in blocks)
    lost = LostInputs(inputs, settings, most) if is_quadratic and most else None
    replayed_rad, status = np.zeros_like(inputs.command_rad), np.zeros(len(there), np.int64)
    for first, end, last in blocks:
        if inputs.begins[first]:
            _begin(controller, inputs, first)
        if lost is not None:
            state = lost.estimate(first, last, controller, state)
        for k in range(first, end):
            done = _step(controller, inputs, k, state[k : k + 1])
            replayed_rad[k], status[k] = done.command_rad[0], done.status[0]
    return LogReplay(
        time_s=inputs.time_s[there],
        logged_rad=inputs.command_rad[there],
        replayed_rad=replayed_rad[there],
        status=status[there],
        settled=_settled(inputs)[there],
        lost=int((~there).sum()),
        filled=sum(int((~there[first:end]).sum()) for first, end, _ in blocks),
        gaps=inputs.gaps,
        is_exact=inputs.is_exact,
        resampled=inputs.resampled,
        remarks=inputs.remarks,
    )


def _blocks(inputs: LoggedInputs) -> Iterator[tuple[int, int, int]]:
    """Yield first and end of the updates to replay, and the end of those to estimate the lost states by.

    A block begins where the controller does, and ends at the latest with the last update before a gap.
    """
    there = np.flatnonzero(inputs.is_logged)
    starts = sorted({there[0], *np.flatnonzero(inputs.begins & (np.arange(len(inputs.begins)) > there[0]))})
    for start, following in zip(starts, [*starts[1:], there[-1] + 1], strict=True):
        end = there[np.searchsorted(there, following) - 1] + 1
        for first in range(start, end, BLOCK):
            yield first, min(first + BLOCK, end), min(first + BLOCK + AHEAD, end)


def _settled(inputs: LoggedInputs) -> NDArray[np.bool_]:
    """Return whether an update (k,) may be judged: `LogReplay.settled`."""
    time_s, begins = inputs.time_s, inputs.begins | inputs.may_lie
    begins[np.flatnonzero(inputs.is_logged)[0]] = True
    latest_s = np.maximum.accumulate(np.where(begins, time_s, -np.inf))
    return np.asarray(time_s - latest_s >= SETTLING_S)


class LostInputs:
    """Estimates the states that a log has lost from the commands that it has, block by block.

    The controller itself is the model: its commands behind a lost row depend on the position and velocity
    that it read there. A batch of controllers, each with one of these numbers changed, gives the slopes, and
    least squares the numbers; how well a row between two others is interpolated is their prior.
    """

    def __init__(self, inputs: LoggedInputs, settings: Settings, most: int) -> None:
        """Take a log that has lost `most` updates in the worst block."""
        self._inputs = inputs
        self._batch = CompiledController(settings, 1 + ESTIMATED * most)
        self._deviation = _deviation(inputs)

    def estimate(self, first: int, end: int, controller: CompiledController, state: FloatArray) -> FloatArray:
        """Return `state` (k, n) with the lost rows of first..end - 1 and of what follows estimated.

        No update but the first of these may begin anew; `controller` is as before the first, and stays so.
        """
        inputs, batch = self._inputs, self._batch
        lost = first + np.flatnonzero(~inputs.is_logged[first:end])
        count = ESTIMATED * len(lost)
        if not count:
            return state
        batch.instances[:] = controller.instances
        changes = dict(zip(lost.tolist(), np.arange(count).reshape(-1, ESTIMATED), strict=True))
        commands = []
        for k in range(first, end):
            states = np.repeat(state[k : k + 1], batch.n, axis=0)
            if k in changes:
                states[1 + changes[k], np.arange(ESTIMATED)] += self._deviation[k]
            commands.append(_step(batch, inputs, k, states).command_rad[: 1 + count])
        there = inputs.is_logged[first:end]
        found = np.asarray(commands, np.float64)[there]
        slopes = (found[:, 1:] - found[:, :1]).transpose(0, 2, 1).reshape(-1, count) / COMMAND_NOISE_RAD
        left = (inputs.command_rad[first:end][there] - found[:, 0]).reshape(-1) / COMMAND_NOISE_RAD
        change = np.linalg.solve(slopes.T @ slopes + np.eye(count), slopes.T @ left)
        estimated = state.copy()
        estimated[lost, :ESTIMATED] += change.reshape(-1, ESTIMATED) * self._deviation[lost]
        return estimated


def _deviation(inputs: LoggedInputs) -> FloatArray:
    """Return the standard deviations (k, 4) of interpolated positions and velocities.

    They are those of rows that are there from the mean of the rows beside them, times the distance to the
    next row that is there.
    """
    there, state = inputs.is_logged, inputs.state[:, :ESTIMATED]
    middle = there[:-2] & there[1:-1] & there[2:]
    error = (state[1:-1] - 0.5 * (state[:-2] + state[2:]))[middle]
    spread = np.sqrt((error * error).mean(axis=0)) if len(error) else np.zeros(ESTIMATED)
    rows, places = np.arange(len(there)), np.flatnonzero(there)
    after = places[np.minimum(np.searchsorted(places, rows), len(places) - 1)]
    before = places[np.maximum(np.searchsorted(places, rows, side="right") - 1, 0)]
    distance = np.minimum(np.abs(after - rows), np.abs(rows - before))
    return np.asarray(np.maximum(spread, 1e-6) * distance[:, np.newaxis])


def _step(controller: CompiledController, inputs: LoggedInputs, k: int, states: FloatArray) -> Any:
    """Step n controllers at update `k` with `states` (n, m); return their step.

    A controller with a quadratic cost is told which command the log says was sent, so that an error of one
    command is none of the next ones.
    """
    n, settings = len(states), controller.settings
    commands_thrust = settings.height is not None
    if inputs.jump[k].any():
        change = inputs.jump[k] * _UPWARDS if commands_thrust else inputs.jump[k][_LEVEL]
        controller.shift(np.repeat(change[np.newaxis], n, axis=0))
    target = np.repeat(inputs.target[k : k + 1], n, axis=0)
    if inputs.shift[k].any():
        controller.shift(np.repeat(inputs.shift[k : k + 1], n, axis=0))
    done = controller.step(states, target, None if commands_thrust else np.repeat(inputs.thrust_m_s2[k], n))
    sent = np.repeat(inputs.command_rad[k : k + 1], n, axis=0)
    if inputs.levelled[k]:
        sent = np.zeros_like(sent)
        done = replace(done, command_rad=sent.astype(done.command_rad.dtype))
    if settings.cost.norm == "quadratic" and (inputs.is_logged[k] or inputs.levelled[k]):
        controller.set_command(np.column_stack([sent, done.thrust_m_s2]) if commands_thrust else sent)
    return done


def _begin(controller: CompiledController, inputs: LoggedInputs, k: int) -> None:
    """Reset a controller to what it began with at update `k`: the attitude, with a height the thrust."""
    held = inputs.start_rad[k : k + 1]
    commands_thrust = controller.settings.height is not None
    controller.reset(np.column_stack([held, inputs.start_m_s2[k : k + 1]]) if commands_thrust else held)


def write_curves(replay: LogReplay, path: Path) -> None:
    """Write logged and replayed commands as CSV."""
    table = np.column_stack([replay.time_s, replay.logged_rad, replay.replayed_rad])
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CURVE_COLUMNS)
        writer.writerows(table.tolist())


def read_curves(path: Path) -> FloatArray:
    """Return the table (k, 5) of a file of `write_curves`; raises ResultsError."""
    try:
        header, *lines = csv.reader(path.read_text("utf-8").splitlines())
        table = np.array([[float(field) for field in line] for line in lines])
        if tuple(header) != CURVE_COLUMNS or table.shape[1:] != (len(CURVE_COLUMNS),):
            raise ValueError("other columns")
    except (OSError, ValueError) as error:
        raise ResultsError(f"{path}: is not what replay writes: {error}; run replay again") from error
    return table
