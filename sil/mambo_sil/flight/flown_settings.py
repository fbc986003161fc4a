"""What a flight says of the settings that it was flown with."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FlownSettings:
    """Whether a drone flew well with its settings, in words."""

    good: bool
    words: str
