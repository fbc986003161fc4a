"""A lap as `plan` writes it, without planning one."""

from pathlib import Path

import numpy as np

from mambo_sil.flight.polynomials import COLUMNS, POINT_COLUMNS, PiecesInSpace

LEG_S = 1.5
LEGS_M = ((1.0, 0.5, 0.2), (-0.6, 0.8, -0.1))
"""Along x ahead, y to the left, and up."""


def write_lap(path: Path, height_m: float = 1.0) -> PiecesInSpace:
    """Write two legs from rest to rest, from a height on, and return them as they are read."""
    rows, place = [",".join((*COLUMNS, *POINT_COLUMNS))], np.array([0.0, 0.0, height_m])
    smooth = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0]) / LEG_S ** np.arange(8)
    for leg in LEGS_M:
        axes = [[start, *(length * smooth[1:])] for start, length in zip(place, leg, strict=True)]
        place = place + leg
        numbers = [LEG_S, *np.ravel(axes), *np.zeros(8), len(rows) + 1, *place, 0.1]
        rows.append(",".join(repr(float(one)) for one in numbers) + ",,,")
    path.write_text("\n".join(rows) + "\n", "utf-8")
    return PiecesInSpace.read(path)
