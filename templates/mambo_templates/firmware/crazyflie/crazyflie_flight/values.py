"""The values of these settings, which `mambo-nmpc generate` has written into values.json."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Values:
    """What differs between two folders of the app."""

    group: str
    """Of the app's logs and parameters."""
    digest: str
    """Of controller.toml."""
    has_height: bool
    """Whether the controller commands the thrust too."""
    has_target_observer: bool
    """Whether the app logs what the controller knows of a target's acceleration."""
    says_too_quick: bool
    """Whether the app says that the thrust limits the tilt."""
    flown_m_s2: float
    """Horizontal acceleration that a figure may ask for."""
    lap_m_s2: float
    """The same of a lap: `mambo-nmpc plan` flew it with this vehicle before it wrote it."""
    speed_m_s: float
    """The speed limit."""


def read_values(path: Path) -> Values:
    """Read the values of a file."""
    document: dict[str, Any] = json.loads(path.read_text("utf-8"))
    speed_m_s = document.pop("speed_m_s")
    return Values(**document, speed_m_s=math.inf if speed_m_s is None else speed_m_s)


VALUES = read_values(Path(__file__).with_name("values.json"))
