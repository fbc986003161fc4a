"""A result folder of `pilot`, small."""

from pathlib import Path
from typing import Final

from mambo_extensions.mavlink.pilot_report import PilotSummary
from tests.support.results import HOSTILE

COMMAND: Final = "pilot"
SEEN: Final = ("✗", "simulated autopilot PX4", "5.2 cm in the plane", "0.490; MPC_THR_HOVER says 0.500")
"""What stands on its page."""


def write_folder(folder: Path) -> None:
    """Write a flight over a link that the pilot's switch ended, without its log."""
    PilotSummary(
        source=HOSTILE,
        settings="0123",
        link="udp:127.0.0.1:14540",
        autopilot="PX4",
        simulated=True,
        end=f"the mode is {HOSTILE}",
        good=False,
        trajectory="eight",
        set_points=1000,
        flown_s=10.0,
        interval_s=(0.01, 0.011),
        horizontal_rms_m=0.052,
        vertical_rms_m=0.013,
        command_rms_rad_s=0.2,
        hover_parameter="MPC_THR_HOVER",
        hover_thrust=0.5,
        mean_thrust=0.49,
        link_delay_s=0.002,
        jumps=1,
        pauses=0,
        refused=0,
    ).write(folder)
