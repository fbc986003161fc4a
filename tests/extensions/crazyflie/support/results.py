"""A result folder of `fly --app`, small."""

from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_extensions.crazyflie.desk import desk_report
from mambo_extensions.crazyflie.desk.desk_events import DeskTrace
from mambo_extensions.crazyflie.desk.events_file import BoundSection, EventsFile
from tests.support.results import HOSTILE

COMMAND: Final = "fly --app"
SEEN: Final = ("✗", "1 of 2 bounds BROKEN", "1.05", "&lt;= 0.25", "console: NMPC: &lt;img", "<svg role")
"""What stands on its page."""


def write_folder(folder: Path) -> None:
    """Write a flight of an app that breaks one of two bounds."""
    events = EventsFile(bounds={"lowest_m": BoundSection(least=0.5), "off_m": BoundSection(most=0.25)})
    time_s = np.arange(0.0, 4.0, 0.01)
    zeros = np.zeros((len(time_s), 3))
    flown = DeskTrace(time_s, zeros, zeros, zeros[:, :2], zeros[:, 0], 0.0, f"NMPC: {HOSTILE}\n")
    desk_report.write_trace(flown, folder / "trace.csv")
    desk_report.DeskSummary(
        app="crazyflie",
        source=HOSTILE,
        settings=Settings().digest,
        events="camera-lost",
        flight=events,
        seed=0,
        measures={"lowest_m": 0.75, "off_m": 1.05, "mean_m": 0.21, "drift_m": 0.02, "touch_m_s": 0.3},
        broken=["off_m"],
        console=flown.console,
    ).write(folder)
