"""Feed the inputs in a flight log through the compiled controller, next to the commands of the log."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.errors import ResultsError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.identify.columns import Column
from mambo_sil.model.replay.changed_limits import place_changes
from mambo_sil.model.replay.input_errors import SETTLING_S, Filled, InputErrors, input_errors
from mambo_sil.model.replay.logged_inputs import LoggedInputs, read_inputs
from mambo_sil.model.replay.lost_inputs import LostInputs, blocks_of
from mambo_sil.model.replay.replay_step import begin, command_of, step


class LoggedAxis(NamedTuple):
    """A command: its name and its unit, as in a sentence and as in a name."""

    name: str
    unit: str
    suffix: str


AXES: Final = (
    LoggedAxis("roll", "rad", "rad"),
    LoggedAxis("pitch", "rad", "rad"),
    LoggedAxis("thrust", "m/s^2", "m_s2"),
)

_JUMP_RAD: Final = 0.2
"""Least change of a command from one update to the next with which a mixer may cap the thrust."""
_TOLD_BEHIND: Final = 3
"""Updates within which a capped thrust changes a command."""
LARGEST: Final = 0.999
"""Share of the tilt limit from which on a command says nothing: others have it there, too."""


@dataclass(frozen=True, eq=False)
class LogReplay:
    """Commands of a log and of the compiled controller on its inputs, at the k updates that the log has.

    Columns of commands are roll and pitch in rad and, where the log has the thrust that the controller
    commands, thrust over mass in m/s^2.
    """

    time_s: FloatArray
    logged: FloatArray
    """Commands of the log (k, 2 or 3)."""
    replayed: FloatArray
    """Those of the controller."""
    status: IntArray
    """Status of each update (k,)."""
    settled: NDArray[np.bool_]
    """Whether the controller has not begun in the last `SETTLING_S`, or with the command of the log (k,)."""
    begun_s: FloatArray
    """Time (k,) since the controller began in a state that the log does not have, infinite before it did."""
    capped_s: FloatArray
    """Time (k,) since a mixer may have capped the thrust, which no log shows, likewise."""
    complete_s: FloatArray
    """Time (k,) since the last update that the log has lost, likewise."""
    from_start: bool
    """Whether the log certainly begins with the first update of the controller."""
    is_single: bool
    """Whether the inputs have no more digits than single precision."""
    update_period_s: float
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
    input_errors: InputErrors | None
    """What rounding and lost rows do to the commands; None for a log with all rows and all digits."""
    settings: Settings
    remarks: tuple[str, ...]

    @property
    def axes(self) -> tuple[LoggedAxis, ...]:
        """What the columns of the commands are."""
        return AXES[: self.logged.shape[1]]

    @property
    def logged_rad(self) -> FloatArray:
        """Roll and pitch (k, 2) of the log."""
        return self.logged[:, :2]

    @property
    def replayed_rad(self) -> FloatArray:
        """Those of the controller."""
        return self.replayed[:, :2]

    @property
    def share_filled(self) -> float:
        """Share of the replayed updates that the log has lost."""
        return self.filled / (self.filled + len(self.time_s))


def replay_log(path: Path, columns: Mapping[str, Column], settings: Settings) -> LogReplay:
    """Replay the log at `path`; `columns` has those that the user named.

    The controller starts level, without an estimate, as after nmpc_init(). It is reset to the present roll
    and pitch at each take-over that the log counts, where another flight begins, and behind a gap that is too
    long to fill. A lost row is filled, with a quadratic cost by the state that explains the commands behind
    it. One of the height is in the air where the log does not say that it was on the floor, and is not told
    what a mixer made of its thrust, which no log shows. Raises LogError.
    """
    inputs = place_changes(read_inputs(path, columns, settings), settings)
    there = inputs.is_logged
    is_whole, is_quadratic, own = bool(there.all()), settings.controller.method == "quadratic", settings
    if not is_whole and is_quadratic and settings.code.scalar == "fixed":
        settings = with_option(settings, "code.scalar", "float64")  # slopes are differences of commands
    controller, state = CompiledController(settings), inputs.state
    blocks = list(blocks_of(inputs))
    most = max(int((~there[first:last]).sum()) for first, _, last in blocks)
    lost = LostInputs(inputs, settings, most) if is_quadratic and most else None
    replayed, status = np.zeros_like(inputs.command), np.zeros(len(there), np.int64)
    for first, end, last in blocks:
        if inputs.begins[first]:
            begin(controller, inputs, first)
        if lost is not None:
            state = lost.estimate(first, last, controller, state)
        for k in range(first, end):
            done = step(controller, inputs, k, state[k : k + 1])
            replayed[k], status[k] = command_of(done, inputs)[0], done.status[0]
    filled = Filled(state, None if lost is None else lost.drawn)
    is_unknown = _begins_unknown(inputs, replayed, settings.limits.tilt_rad)
    errors = input_errors(inputs, filled, settings, blocks, is_unknown)
    is_filled = np.zeros(len(there), bool)
    for first, end, _ in blocks:
        is_filled[first:end] = ~there[first:end]
    is_capped = np.zeros_like(is_filled) if settings.height is None else _may_be_capped(inputs, replayed)
    begun_s = _since_s(inputs.time_s, is_unknown)
    return LogReplay(
        time_s=inputs.time_s[there],
        logged=inputs.command[there],
        replayed=replayed[there],
        status=status[there],
        settled=(begun_s >= SETTLING_S)[there],
        begun_s=begun_s[there],
        capped_s=_since_s(inputs.time_s, is_capped)[there],
        complete_s=_since_s(inputs.time_s, is_filled)[there],
        from_start=inputs.from_start,
        is_single=bool((inputs.state.astype(np.float32) == inputs.state).all()),
        update_period_s=settings.horizon.update_period_s,
        lost=int((~there).sum()),
        filled=int(is_filled.sum()),
        gaps=inputs.gaps,
        is_exact=inputs.is_exact,
        resampled=inputs.resampled,
        input_errors=None if errors is None else errors.at(there),
        settings=own,
        remarks=inputs.remarks,
    )


def _begins_unknown(inputs: LoggedInputs, replayed: FloatArray, tilt_rad: float) -> NDArray[np.bool_]:
    """Return whether the controller begins at an update (k,) in a state that the log does not have.

    It has it where the log begins with the first update, or where the first roll or pitch, other than 0 and
    below the limit, is that of the log.
    """
    first = np.flatnonzero(inputs.is_logged)[0]
    begins = inputs.begins.copy()
    begins[first] = not inputs.from_start
    size_rad = np.abs(inputs.command_rad)
    tells = (size_rad > 0.0) & (size_rad < LARGEST * tilt_rad)
    is_known = (tells & (replayed[:, :2] == inputs.command_rad)).any(axis=1)
    return np.asarray(begins & ~is_known | inputs.may_lie)


def _may_be_capped(inputs: LoggedInputs, replayed: FloatArray) -> NDArray[np.bool_]:
    """Return whether a mixer may have capped the thrust behind updates (k,), and have told the controller.

    It does where a command of the tilt jumps. Where the log begins with the controller and has all digits,
    the commands (k, axes) that are `replayed` are those of the log up to there, and differ soon behind it.
    """
    tilt = np.concatenate([inputs.start_rad[:1], inputs.command_rad])
    jumps: NDArray[np.bool_] = np.abs(np.diff(tilt, axis=0)).max(axis=1) > _JUMP_RAD
    has_few_digits = any(name in inputs.resolutions for name in inputs.names)
    if not inputs.from_start or has_few_digits or not inputs.is_logged.all():
        return jumps
    first = int(np.argmax((replayed != inputs.command).any(axis=1)))
    return jumps if jumps[max(first - _TOLD_BEHIND, 0) : first].any() else np.zeros_like(jumps)


def _since_s(time_s: FloatArray, happens: NDArray[np.bool_]) -> FloatArray:
    """Return the time (k,) since something happened last, infinite before it did."""
    return np.asarray(time_s - np.maximum.accumulate(np.where(happens, time_s, -np.inf)))


def write_curves(replay: LogReplay, path: Path) -> None:
    """Write logged and replayed commands as CSV."""
    table = np.column_stack([replay.time_s, replay.logged, replay.replayed])
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_curve_columns(len(replay.axes)))
        writer.writerows(table.tolist())


def read_curves(path: Path) -> FloatArray:
    """Return the table (k, 1 + 2 axes) of a file of `write_curves`; raises ResultsError."""
    try:
        header, *lines = csv.reader(path.read_text("utf-8").splitlines())
        table = np.array([[float(field) for field in line] for line in lines])
        axes = len(header) // 2
        if axes not in (2, 3) or header != _curve_columns(axes) or table.shape[1:] != (len(header),):
            raise ValueError("other columns")
    except (OSError, ValueError) as error:
        raise ResultsError(f"{path}: is not what replay writes: {error}; run replay again") from error
    return table


def _curve_columns(axes: int) -> list[str]:
    """Return the header of the curves of the first `AXES`."""
    return [
        "time_s",
        *(f"{one.name}_{kind}_{one.suffix}" for kind in ("logged", "replayed") for one in AXES[:axes]),
    ]
