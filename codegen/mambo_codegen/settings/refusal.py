"""Why joint rules refuse settings."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Refusal:
    """The key to change, and the rule that it breaks."""

    section: str
    name: str
    rule: str
