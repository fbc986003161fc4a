"""The curves of an identification's picture, and their CSV file."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ResultsError

CURVE_COLUMNS: Final = (
    *("time_s", "roll_command_rad", "roll_rad", "roll_model_rad"),
    *("pitch_command_rad", "pitch_rad", "pitch_model_rad"),
)


@dataclass(frozen=True, eq=False)
class Curves:
    """Commanded, measured and modelled tilt of the longest stretch, for the picture.

    The model is the one fitted to the first half of each stretch. Pairs are roll, pitch.
    """

    time_s: FloatArray
    """(m,), from 0."""
    command_rad: FloatArray
    """(2, m)."""
    tilt_rad: FloatArray
    model_rad: FloatArray
    """(2, m); NaN for an axis without a fit."""


def curves_csv(curves: Curves) -> str:
    """Return the curves as CSV with the columns `CURVE_COLUMNS`."""
    columns = [curves.time_s]
    for axis in range(2):
        columns += [curves.command_rad[axis], curves.tilt_rad[axis], curves.model_rad[axis]]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return (
        "\n".join([",".join(CURVE_COLUMNS), *(",".join(f"{each:.6g}" for each in row) for row in rows)])
        + "\n"
    )


def read_curves(path: Path) -> dict[str, FloatArray]:
    """Return the columns (m,) of a fit.csv; raises ResultsError."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            header, *rows = csv.reader(file)
        table = np.array(rows, np.float64).reshape(-1, len(CURVE_COLUMNS))
    except (OSError, ValueError, csv.Error) as error:
        raise ResultsError(f"{path}: is not what identify writes: {error}; run identify again") from error
    if tuple(header) != CURVE_COLUMNS or not len(table):
        raise ResultsError(f"{path}: is not what identify writes; run identify again")
    return dict(zip(CURVE_COLUMNS, table.T, strict=True))
