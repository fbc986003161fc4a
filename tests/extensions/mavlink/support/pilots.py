"""Pilots of a simulated autopilot."""

from mambo_extensions.mavlink.links import SimulatedLink
from mambo_extensions.mavlink.pilot import Pilot
from mambo_extensions.mavlink.simulated import Condition, SimulatedAutopilot
from mambo_sil.life.records import STACKS
from mambo_sil.life.steering import Update
from tests.support.links import controller, drone


def simulated(
    stack: str, condition: Condition | None = None
) -> tuple[Pilot, SimulatedAutopilot, list[Update]]:
    """Return a pilot, its autopilot, and the steps of the flight."""
    updates: list[Update] = []
    link = SimulatedLink(STACKS[stack], drone(), condition)
    return Pilot(controller(), lambda: link, updates.append), link.autopilot, updates
