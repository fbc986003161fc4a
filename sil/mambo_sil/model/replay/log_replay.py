"""Feed the inputs in a flight log through the compiled controller, next to the commands of the log."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.errors import ResultsError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.identify.columns import Column
from mambo_sil.model.replay.logged_inputs import LoggedInputs, read_inputs
from mambo_sil.model.replay.lost_inputs import AHEAD, BLOCK, LostInputs
from mambo_sil.model.replay.stepping import begin, step

AXES: Final = ("roll", "pitch")
CURVE_COLUMNS: Final = ("time_s", *(f"{axis}_{kind}_rad" for kind in ("logged", "replayed") for axis in AXES))

SETTLING_S: Final = 2.0
"""Time from a beginning of the controller in which its estimates approach the estimates of the flight."""


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
            begin(controller, inputs, first)
        if lost is not None:
            state = lost.estimate(first, last, controller, state)
        for k in range(first, end):
            done = step(controller, inputs, k, state[k : k + 1])
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
