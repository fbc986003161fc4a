"""A result folder of `tune`, small."""

from pathlib import Path
from typing import Final

from mambo_extensions.tune.study import FinishedTrial
from mambo_extensions.tune.tuning_report import TuneSummary
from tests.support.results import HOSTILE

COMMAND: Final = "tune"
SEEN: Final = ("trial 3 of 4: 2.5 cm in the mean, the base 5 cm", "cost.response_time_s 0.1", "1 of 8")
"""What stands on its page."""


def write_folder(folder: Path) -> None:
    """Write a study whose chosen trial is closer than its base."""
    base, chosen = (
        FinishedTrial(number, {"cost.response_time_s": 0.1}, iae_m_s, 0.002, 1)
        for number, iae_m_s in ((0, 1.0), (3, 0.5))
    )
    TuneSummary(
        study="mambo-nmpc-0",
        seed=0,
        flights=8,
        duration_s=20.0,
        trials=4,
        base=base,
        chosen=chosen,
        rule=HOSTILE,
        front=[chosen],
    ).write(folder)
