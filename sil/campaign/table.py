"""Read the table of a campaign: one line per flight with its draws and the results of each controller."""

import csv
from pathlib import Path

import numpy as np

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.campaign.statistics import Table
from mambo_nmpc.sil.errors import ResultsError


def read_table(path: Path) -> Table:
    """Return the numeric columns of a table without a truncated last line; raises ResultsError."""
    name = echo(str(path))
    try:
        text = path.read_text("utf-8")
        header, *rows = csv.reader(text[: text.rfind("\n") + 1].splitlines())
        columns = zip(header, zip(*rows, strict=True), strict=True) if rows else ()
        return {
            title: np.array([float(cell) for cell in cells])
            for title, cells in columns
            if not title.endswith("_sha256")
        }
    except (OSError, ValueError, csv.Error) as error:
        raise ResultsError(
            f"{name}: is not the table of a campaign: {echo(str(error))}; run campaign again"
        ) from error
